//! Motor and recordings as the commands of the main job take them.

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use im_diagnose::case::Case;
use im_diagnose::intake::{Draft, Finding, FindingKind, Intake, IntakeError, Severity};
use im_diagnose::search::Options;
use im_diagnose::sources::{Refused, Source, Sources};
use im_identify::offline::FitError;
use im_model::{MotorFile, Recording};

use crate::failure::Failure;
use crate::output::Outputs;
use crate::spinner::spinning;
use crate::terminal::{say, wrapped};

/// A motor with its recordings.
#[derive(clap::Args)]
#[command(group(clap::ArgGroup::new("evidence").args(["train", "table"]).required(true).multiple(true)))]
pub struct Data {
    /// The motor as it is known: a motor.toml
    #[arg(long, value_name = "FILE")]
    pub motor: PathBuf,
    /// A recording to learn from, or its recording.toml; give it several times for several recordings
    #[arg(long, value_name = "FILE")]
    pub train: Vec<PathBuf>,
    /// A table of steady states, alone or beside recordings (V_LL_V, I_A, P_3ph_W, Q_3ph_var, n_rpm, T_Nm; other columns by a table.toml beside it); give no-load, locked-rotor and load tests together
    #[arg(long, value_name = "FILE")]
    pub table: Vec<PathBuf>,
    /// A recording that no fit sees, to check on
    #[arg(long, value_name = "FILE")]
    pub holdout: Option<PathBuf>,
    /// What the columns of the recordings mean, instead of the recording.toml beside them
    #[arg(long, value_name = "FILE")]
    pub mapping: Option<PathBuf>,
    /// Hold a parameter at its value in the motor file: a key of it, or EFFECT.KEY; give it several times for several
    #[arg(long, value_name = "NAME")]
    pub fix: Vec<String>,
    /// Go on where what was noticed about the data makes the answer meaningless
    #[arg(long)]
    pub anyway: bool,
}

impl Data {
    /// Motor, recordings and tables as the library takes them.
    pub fn sources(&self) -> Result<Sources, Failure> {
        let source = |path: &PathBuf| Source::File(path.clone(), self.mapping.clone());
        // A mapping is that of the recordings: a table beside them has the canonical columns.
        let mapping = self.mapping.clone().filter(|_| self.train.is_empty());
        Ok(Sources {
            train: self.train.iter().map(source).collect(),
            tables: self.table.iter().map(|path| (path.clone(), mapping.clone())).collect(),
            holdout: self.holdout.as_ref().map(source),
            fix: self.fix.clone(),
            anyway: self.anyway,
            ..Sources::of_motor(&self.motor)?
        })
    }

    /// Reads everything; what was noticed about the recordings comes along, and the options of a search in them.
    pub fn case(&self) -> Result<(Case, Vec<Finding>, Options), Failure> {
        let sources = self.sources()?;
        let (case, findings) = spinning(READING, || sources.case())?;
        // What makes all that follows doubtful is said before it, and once more in its place.
        for f in findings.iter().filter(|f| f.severity == Severity::Serious) {
            say(&wrapped("! ", &f.line()));
        }
        Ok((case, findings, sources.options()))
    }

    /// Where files may be written.
    pub fn outputs(&self) -> Outputs {
        let recordings = self.train.iter().chain(&self.holdout);
        let read = [&self.motor].into_iter().chain(&self.table).chain(&self.mapping);
        Outputs::beside(read).and_recordings(recordings, self.mapping.as_deref())
    }
}

/// What the reading of recordings is called where it takes long.
const READING: &str = "reading and checking the recording";

/// Reads one recording whose columns somebody has said the meaning of.
pub fn recording(path: &Path, mapping: Option<&Path>, motor: &MotorFile) -> Result<Intake, Failure> {
    let source = Source::File(path.to_path_buf(), mapping.map(Path::to_path_buf));
    Ok(spinning(READING, || source.recording(motor))?)
}

/// Reads recordings that are long enough to say something; of files without a mapping a draft is written beside them, or where that is not allowed
/// into `folder`. What was guessed comes along, one sentence each.
pub fn recordings_or_drafts(
    paths: &[PathBuf],
    mapping: Option<&Path>,
    motor: &MotorFile,
    folder: Option<&Path>,
) -> Result<(Vec<Intake>, Vec<String>), Failure> {
    let (mut all, mut said) = (Vec::new(), Vec::new());
    for path in paths {
        let source = Source::File(path.clone(), mapping.map(Path::to_path_buf));
        all.extend(source.long_enough(taken_or_draft(&source, path, motor, folder, &mut said)?)?);
    }
    Ok((all, said))
}

/// Recordings of any length; what was guessed is added to `said`.
fn taken_or_draft(
    source: &Source,
    path: &Path,
    motor: &MotorFile,
    folder: Option<&Path>,
    said: &mut Vec<String>,
) -> Result<Vec<Intake>, Failure> {
    match spinning(READING, || source.read(motor)) {
        Ok(taken) => {
            if let Some(draft) = taken.iter().find_map(|t| t.draft.as_ref()) {
                let written = write_draft(path, draft, folder)?;
                said.push(format!(
                    "{}: {} what its columns mean; {} was written with what was guessed. Check it; saved as recording.toml it holds for every file of the folder",
                    path.display(),
                    draft.nobody_says(),
                    written.display()
                ));
                said.extend(draft.guesses.iter().cloned());
            }
            Ok(taken)
        }
        Err(IntakeError::File(e)) => Err(Failure::File(e)),
        Err(IntakeError::Unmapped { file, draft }) => {
            let written = write_draft(path, &draft, folder)?;
            let guesses = draft.listed();
            let e = IntakeError::Unmapped { file, draft };
            Err(Failure::Input(format!("{e}.\n{} is a first draft. Guessed so far:\n{guesses}", written.display())))
        }
    }
}

/// A recording as a drive would have seen it: lost samples, and a speed that was not measured, are NaN.
pub struct Replayed {
    pub recording: Recording,
    /// What was guessed of its columns.
    pub guessed: Vec<String>,
    /// What was noticed about it.
    pub findings: Vec<Finding>,
}

impl Replayed {
    /// Takes in one recording as `im compare` does.
    pub fn read(path: &Path, mapping: Option<&Path>, motor: &MotorFile, folder: Option<&Path>) -> Result<Self, Failure> {
        let mut guessed = Vec::new();
        let source = Source::File(path.to_path_buf(), mapping.map(Path::to_path_buf));
        let one = source.only(taken_or_draft(&source, path, motor, folder, &mut guessed)?)?;
        // Nothing here asks for the load.
        let findings = one.findings.iter().filter(|f| f.kind != FindingKind::MissingLoad).cloned().collect();
        Ok(Self { recording: one.replay(), guessed, findings })
    }

    /// Prints what was guessed and noticed.
    pub fn print(&self, out: &mut dyn io::Write) -> io::Result<()> {
        for guess in &self.guessed {
            write!(out, "{}", wrapped("? ", guess))?;
        }
        for finding in &self.findings {
            write!(out, "{}", wrapped("! ", &finding.line()))?;
        }
        if !(self.guessed.is_empty() && self.findings.is_empty()) {
            writeln!(out)?;
        }
        Ok(())
    }

    /// How many rows lack their current.
    pub fn lost_rows(&self) -> usize {
        self.recording.i_s.iter().filter(|i| !(i.re.is_finite() && i.im.is_finite())).count()
    }

    /// Whether the speed was measured at all.
    pub fn has_speed(&self) -> bool {
        self.recording.omega_m.iter().any(|w| w.is_finite())
    }
}

/// Writes a draft beside its recording, or into `folder`, or where we are; never over a file that is there. One that completes a mapping has a
/// name of its own.
fn write_draft(path: &Path, draft: &Draft, folder: Option<&Path>) -> Result<PathBuf, Failure> {
    let end = if draft.completes.is_some() { "completed.recording.toml" } else { "recording.toml" };
    let name = PathBuf::from(path.with_extension(end).file_name().unwrap_or_default());
    let beside = path.with_file_name(&name);
    let here = folder.unwrap_or(Path::new("")).join(&name);
    let write = |to: &Path, text: &str| {
        if to.exists() {
            return Err(Failure::Input(format!("{}: is there already; name it with --mapping, or move it away", to.display())));
        }
        im_model::write_atomically(to, |w| w.write_all(text.as_bytes())).map_err(Failure::File)
    };
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let of_one = draft.completes.is_some();
    let text = if of_one { draft.text_naming(&file, &file) } else { draft.text.clone() };
    if write(&beside, &text).is_ok() {
        return Ok(beside);
    }
    if let Some(folder) = folder {
        Outputs::default().folder(folder, &[])?;
    }
    // Elsewhere it needs the whole path to its recording.
    let whole = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    write(&here, &draft.text_naming(&file, &whole.display().to_string()))?;
    Ok(here)
}

/// A fit that could not be made, for people.
pub fn refused(motor: &Path, e: &FitError) -> Failure {
    Refused::fit(&motor.display().to_string(), e).into()
}
