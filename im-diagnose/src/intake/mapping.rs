//! `recording.toml`: what the columns of a laboratory's file mean. Types; `mapping_file.rs` reads and writes them.
//!
//! Of every column the value used is gain · (x − offset) · unit, with x as it stands in the file and the unit in SI.

use im_identify::offline::Size;
use im_model::{FileError, Problem, TextFormat};
use serde::Deserialize;

use super::unit::Quantity;

/// A column of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Column {
    /// By its name in the first line.
    Name(String),
    /// By its place, from 1.
    Number(usize),
}

/// What is taken off a column, in the column's own unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Offset {
    /// A known number.
    Value(f64),
    /// The mean over the recording: for alternating quantities in steady operation.
    Mean,
    /// The mean before this time, s, while nothing is switched on yet.
    MeanBefore(f64),
}

/// A gain found from a stretch of known value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// Begin of the stretch, s.
    pub from_s: f64,
    /// End of the stretch, s.
    pub to_s: f64,
    /// The mean there, in the column's unit after the gain.
    pub value: f64,
}

/// How a column becomes a quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Signal {
    /// Where it stands.
    pub column: Column,
    /// One of its units in SI; `None`: from the column's name, else SI.
    pub unit: Option<f64>,
    /// Gain; negative to turn the sign.
    pub gain: f64,
    /// Offset.
    pub offset: Offset,
    /// Replaces the gain.
    pub calibrate: Option<Calibration>,
    /// A second sensor of the same quantity.
    pub alternate: Option<Box<Signal>>,
    /// Of one over the column: the period of an encoder's pulses is in it.
    pub reciprocal: bool,
    /// Later than the row by so much, s: channels that are sampled one after the other.
    pub delay_s: f64,
    /// Whether single samples far off their neighbours are replaced.
    pub spikes: bool,
    /// Line of the mapping file that names it.
    pub line: Option<usize>,
}

impl Signal {
    /// A column in SI units as it stands.
    pub fn plain(name: &str) -> Self {
        Self {
            column: Column::Name(name.to_owned()),
            unit: None,
            gain: 1.0,
            offset: Offset::Value(0.0),
            calibrate: None,
            alternate: None,
            reciprocal: false,
            delay_s: 0.0,
            spikes: false,
            line: None,
        }
    }
}

/// Another file of the same run.
#[derive(Clone, Debug, PartialEq)]
pub struct Also {
    /// Its name; it lies beside the recording.
    pub file: String,
    /// Its column of time.
    pub time: Signal,
    /// How its clock stands to that of the recording.
    pub clock: Clock,
    /// Line of the mapping that names it.
    pub line: usize,
}

/// How two clocks stand to each other.
#[derive(Clone, Debug, PartialEq)]
pub enum Clock {
    /// Nobody says: its time is the recording's.
    Unsaid,
    /// Its time and so many seconds are the recording's.
    Shift(f64),
    /// The shift is that by which its column is like one of the recording.
    Alike {
        /// Its column.
        column: Box<Signal>,
        /// The recording's.
        with: Box<Signal>,
    },
}

/// How the voltage stands in the file.
#[derive(Clone, Debug, PartialEq)]
pub enum VoltageForm {
    /// Phase voltages a, b, c against any common point.
    Phases([Signal; 3]),
    /// Phase voltages a and b against the star point of the machine: the third is minus their sum.
    TwoPhases([Signal; 2]),
    /// Two line-to-line voltages.
    Lines([Line; 2], [Signal; 2]),
    /// All three line-to-line voltages ab, bc, ca.
    ThreeLines([Signal; 3]),
    /// Space vector.
    AlphaBeta([Signal; 2]),
    /// Space vector in the frame of the mapping.
    Dq([Signal; 2]),
    /// Duty cycles of the legs, 0 to 1, and the voltage of the dc link.
    Duty([Signal; 3], Signal),
}

/// A line-to-line voltage: of the first against the second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// u_a − u_b.
    Ab,
    /// u_b − u_c.
    Bc,
    /// u_c − u_a.
    Ca,
}

/// Which instant a voltage belongs to.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Instant {
    /// The average from this row to the next: what a drive commands.
    HeldFromRow,
    /// The value at the row, as a voltmeter samples it.
    Sample,
    /// The average from the row before to this one.
    HeldUntilRow,
}

impl Begin {
    /// The word in files.
    pub fn word(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::AtRest => "at_rest",
            Self::InMotion => "in_motion",
        }
    }
}

impl Instant {
    /// The word in files.
    pub fn word(self) -> &'static str {
        match self {
            Self::HeldFromRow => "held_from_row",
            Self::Sample => "sample",
            Self::HeldUntilRow => "held_until_row",
        }
    }
}

/// The voltage.
#[derive(Clone, Debug, PartialEq)]
pub struct Voltage {
    /// Columns.
    pub form: VoltageForm,
    /// What all of them are multiplied by: the dc link's voltage where they are shares of it.
    pub times: Option<Signal>,
    /// Instant.
    pub instant: Instant,
    /// Whether sensors measured it, or a drive commanded it; `None`: as the instant says.
    pub measured: Option<bool>,
}

impl Voltage {
    /// Whether sensors measured it: nobody commands samples.
    pub fn is_measured(&self) -> bool {
        self.measured.unwrap_or(self.instant == Instant::Sample)
    }
}

/// How the current stands in the file.
#[derive(Clone, Debug, PartialEq)]
pub enum CurrentForm {
    /// All three.
    Phases([Signal; 3]),
    /// Two of a, b, c (0, 1, 2); the third is minus their sum.
    TwoPhases([usize; 2], [Signal; 2]),
    /// Space vector.
    AlphaBeta([Signal; 2]),
    /// Space vector in the frame of the mapping.
    Dq([Signal; 2]),
}

/// The speed.
#[allow(clippy::large_enum_variant)] // One per recording.
#[derive(Clone, Debug, PartialEq)]
pub enum Speed {
    /// Not measured.
    Absent,
    /// The rotor is held.
    Locked,
    /// A column; `electrical` when it is the pole pairs' multiple.
    Measured {
        /// Column.
        signal: Signal,
        /// Whether the pole pairs are to be taken out.
        electrical: bool,
    },
    /// Counts of an encoder.
    Counts {
        /// Column.
        signal: Signal,
        /// Counts of a turn.
        per_turn: f64,
        /// Where the counter begins anew; `None`: seen from the column.
        wraps_at: Option<f64>,
    },
}

/// The load torque.
#[allow(clippy::large_enum_variant)] // One per recording.
#[derive(Clone, Debug, PartialEq)]
pub enum Load {
    /// Nobody says: unknown where a speed is measured, else taken as zero.
    Unstated,
    /// There is none: nothing drives or brakes the shaft.
    Absent,
    /// There may be any.
    Unknown,
    /// The same all the time, Nm.
    Constant(f64),
    /// The same all the time, and with the square of the speed; a size that is not given is fitted.
    Law {
        /// Nm.
        constant: Size,
        /// Nm s²/rad².
        fan: Size,
    },
    /// A column, times another where given: k·i_a·i_f of a separately excited dc machine.
    Measured {
        /// Column; its gain makes Nm.
        signal: Signal,
        /// Second factor.
        times: Option<Signal>,
    },
}

/// How the recording begins.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Begin {
    /// To be seen from the data.
    #[default]
    Auto,
    /// At rest, without flux.
    AtRest,
    /// Turning, or with flux.
    InMotion,
}

/// Time.
#[derive(Clone, Debug, PartialEq)]
pub struct Time {
    /// The column; without one, `sample_time_s` counts from zero.
    pub signal: Option<Signal>,
    /// Sampling time, s, where there is no column.
    pub sample_time_s: Option<f64>,
    /// First instant to use, s.
    pub from_s: f64,
    /// First instant not to use, s.
    pub to_s: f64,
    /// Missing rows are filled and left out of the comparison.
    pub fill_gaps: bool,
}

/// How a text is written, as far as somebody says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TextSaid {
    /// Between the fields.
    pub separator: Option<u8>,
    /// Whether numbers have a decimal comma.
    pub decimal_comma: Option<bool>,
    /// Whether the columns have names.
    pub header: Option<bool>,
    /// Lines before the names.
    pub skip_lines: Option<usize>,
    /// Lines between the names and the first row.
    pub skip_after_header: Option<usize>,
    /// What a line begins with that is passed over.
    pub comment: Option<u8>,
}

impl TextSaid {
    /// The whole, what is not said as `other` has it.
    pub fn over(self, other: TextFormat) -> TextFormat {
        TextFormat {
            separator: self.separator.or(other.separator),
            decimal_comma: self.decimal_comma.unwrap_or(other.decimal_comma),
            header: self.header.or(other.header),
            skip_lines: self.skip_lines.unwrap_or(other.skip_lines),
            skip_after_header: self.skip_after_header.unwrap_or(other.skip_after_header),
            comment: self.comment.unwrap_or(other.comment),
        }
    }
}

/// A mapping that names no column: what its columns mean is seen or guessed, as without one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Preface {
    /// The mapping file, for messages.
    pub label: String,
    /// Data files it belongs to.
    pub files: Vec<String>,
    /// How the text is written.
    pub text: TextSaid,
    /// Start.
    pub begin: Begin,
    /// Temperature of the windings, °C.
    pub winding_c: Option<f64>,
}

/// What a `recording.toml` says.
#[derive(Clone, Debug, PartialEq)]
pub enum Said {
    /// What the columns mean.
    Columns(Box<Mapping>),
    /// Something, but of no column.
    Preface(Preface),
}

impl Said {
    /// Data files it belongs to.
    pub fn files(&self) -> &[String] {
        match self {
            Self::Columns(m) => &m.files,
            Self::Preface(p) => &p.files,
        }
    }

    /// The file, for messages.
    pub fn label(&self) -> &str {
        match self {
            Self::Columns(m) => &m.label,
            Self::Preface(p) => &p.label,
        }
    }

    /// Where columns are given a meaning.
    pub fn columns(&self) -> Option<&Mapping> {
        match self {
            Self::Columns(m) => Some(m),
            Self::Preface(_) => None,
        }
    }
}

/// What the columns of a file mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Mapping {
    /// The mapping file, for messages.
    pub label: String,
    /// What each line is about, where a program wrote the lines and messages name this instead; else empty.
    pub keys: Vec<String>,
    /// Data files it belongs to, relative to it; empty: those named like it, or beside it.
    pub files: Vec<String>,
    /// Files of the same run by other instruments.
    pub also: Vec<Also>,
    /// How the text is written.
    pub format: TextFormat,
    /// Time.
    pub time: Time,
    /// Voltage.
    pub voltage: Voltage,
    /// Current.
    pub current: CurrentForm,
    /// Angle of the d axis, rad, of quantities in d and q.
    pub angle: Option<Signal>,
    /// Speed.
    pub speed: Speed,
    /// Load torque.
    pub load: Load,
    /// Start.
    pub begin: Begin,
    /// Temperature of the windings, °C.
    pub winding_c: Option<f64>,
}

impl VoltageForm {
    /// The signals in it, in order.
    pub fn signals(&self) -> Vec<&Signal> {
        match self {
            Self::Phases(s) | Self::ThreeLines(s) => s.iter().collect(),
            Self::TwoPhases(s) | Self::Lines(_, s) | Self::AlphaBeta(s) | Self::Dq(s) => s.iter().collect(),
            Self::Duty(s, dc) => s.iter().chain([dc]).collect(),
        }
    }
}

impl CurrentForm {
    /// The signals in it, in order.
    pub fn signals(&self) -> Vec<&Signal> {
        match self {
            Self::Phases(s) => s.iter().collect(),
            Self::TwoPhases(_, s) | Self::AlphaBeta(s) | Self::Dq(s) => s.iter().collect(),
        }
    }
}

/// An error named by what its line is about, where lines mean nothing to the reader.
pub(super) fn by_key(keys: &[String], e: FileError) -> FileError {
    match e.line.and_then(|l| keys.get(l - 1)) {
        Some(key) => FileError { file: format!("{}[\"{key}\"]", e.file), line: None, ..e },
        None => e,
    }
}

impl Mapping {
    /// An error at one of its lines.
    pub fn error(&self, line: Option<usize>, key: &str, problem: Problem) -> FileError {
        by_key(&self.keys, FileError::new(&self.label, line, Some(key), problem))
    }

    /// Every column that is asked for, with what it measures; `None` for a pure number.
    pub fn signals(&self) -> Vec<(&Signal, Option<Quantity>)> {
        let mut all: Vec<(&Signal, Option<Quantity>)> = Vec::new();
        all.extend(self.time.signal.iter().map(|s| (s, Some(Quantity::Time))));
        let duty = matches!(self.voltage.form, VoltageForm::Duty(..));
        let voltages = self.voltage.form.signals();
        let last = voltages.len() - 1;
        all.extend(voltages.into_iter().enumerate().map(|(k, s)| (s, (!duty || k == last).then_some(Quantity::Voltage))));
        all.extend(self.voltage.times.iter().map(|s| (s, None)));
        all.extend(self.current.signals().into_iter().map(|s| (s, Some(Quantity::Current))));
        all.extend(self.angle.iter().map(|s| (s, Some(Quantity::Angle))));
        match &self.speed {
            Speed::Measured { signal, .. } => all.push((signal, Some(Quantity::Speed))),
            Speed::Counts { signal, .. } => all.push((signal, None)),
            Speed::Absent | Speed::Locked => {}
        }
        if let Load::Measured { signal, times } = &self.load {
            all.push((signal, None));
            all.extend(times.iter().map(|s| (s, None)));
        }
        let alternates: Vec<_> = all.iter().filter_map(|(s, q)| s.alternate.as_deref().map(|a| (a, *q))).collect();
        all.extend(alternates);
        all
    }
}
