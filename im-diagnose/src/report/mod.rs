//! The report: seeing where a model fails and watching the error fall.
//!
//! [`html`] makes one self-contained page, [`terminal`] the same story in short for a terminal, [`Files`] the files of a
//! diagnosis. [`Comparison`] is the report of a model against recordings without a diagnosis; [`side_by_side`] compares diagnoses.

mod compare;
mod curves;
mod electrical_words;
mod json;
mod load_words;
mod overlay;
pub mod page;
mod sections;
mod settling;
mod side_by_side;
mod signals;
mod story;
mod terminal;
mod text_plot;
mod words;
mod write;

use im_identify::offline::Experiment;
use serde::Serialize;

use crate::diagnosis::Diagnosis;
use crate::intake::Finding;
use crate::next_test::ProfileTrace;
use crate::sources::by_fit;

pub use crate::format::{number, quantity};
pub use compare::{Comparison, compare_html, compare_terminal};
pub use sections::run_on_files;
pub use side_by_side::{SideBySide, side_by_side, side_by_side_terminal};
pub use signals::SignalTable;
pub use story::Story;
pub use terminal::terminal;
pub use words::{key_words, short_effect_name};
pub use write::{FILES, Files, Written};

/// What a report says besides the result: where it comes from, and what others found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Meta {
    /// Heading; the name of the motor when empty.
    pub title: String,
    /// Name and version of the program.
    pub program: String,
    /// The command that made it.
    pub command: Option<String>,
    /// Seed of what was random; `None` when nothing was.
    pub seed: Option<u64>,
    /// When it was made, in words; left out when absent, so that equal inputs give equal files.
    pub made: Option<String>,
    /// The files that were read.
    pub files: Vec<InputFile>,
    /// What was noticed about the data; `None` when nobody looked.
    pub quality: Option<Vec<Finding>>,
    /// The next test.
    pub next_test: Option<NextTest>,
}

impl Meta {
    /// Beside a diagnosis: what was noticed about its recordings, without what the answer refutes and with what its fit shows, the test that would
    /// settle what is open.
    pub fn of(found: &Diagnosis, mut noticed: Vec<Finding>) -> Self {
        noticed.retain(|f| !found.refutes(f));
        noticed.extend(by_fit(&noticed, &found.case.motor, &found.refined.machine, found.case.supply()));
        Self { quality: Some(noticed), next_test: NextTest::after(found), ..Self::default() }
    }
}

/// A file that was read.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InputFile {
    /// Its path, as it was given.
    pub name: String,
    /// SHA-256 of its bytes, as `sha256sum` prints it.
    pub sha256: String,
}

/// A recording as it was used, so that it can be recognized.
#[derive(Serialize)]
pub(crate) struct Used {
    pub name: String,
    /// What it was used for.
    pub role: &'static str,
    pub rows: usize,
    /// A hash of its numbers.
    pub digest: String,
}

/// The test to make next.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct NextTest {
    /// What to do, in a sentence or two.
    pub text: String,
    /// What it would settle.
    pub settles: Vec<String>,
    /// What to command, over time.
    pub profile: Vec<ProfileTrace>,
}

/// The page: a string of HTML that needs nothing else.
pub fn html(story: &Story) -> String {
    sections::whole(story)
}

const FNV_OFFSET: u64 = 0xcbf2_9ce4_8422_2325;

fn eaten(hash: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(hash, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x0100_0000_01b3))
}

/// The same hash of a text.
pub(crate) fn text_digest(text: &str) -> String {
    format!("{:016x}", eaten(FNV_OFFSET, text.as_bytes()))
}

/// A hash of the numbers of a recording (FNV-1a, 64 bit): equal data, equal hash.
pub fn digest(e: &Experiment) -> String {
    let mut h = FNV_OFFSET;
    let mut eat = |x: f64| h = eaten(h, &x.to_bits().to_le_bytes());
    eat(e.sample_time_s);
    e.u_s.iter().for_each(|u| {
        eat(u.re);
        eat(u.im);
    });
    e.tau_load.iter().for_each(|t| eat(*t));
    e.channels.iter().flat_map(|c| &c.values).for_each(|v| eat(*v));
    format!("{h:016x}")
}

impl Used {
    pub fn of(e: &Experiment, role: &'static str) -> Self {
        Self { name: e.name.clone(), role, rows: e.len(), digest: digest(e) }
    }
}
