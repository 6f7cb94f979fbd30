//! What was noticed about a recording before anything is fitted to it.

use std::ops::Range;

use serde::Serialize;

/// What kind of thing was noticed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FindingKind {
    /// A current sensor that ends at a limit, hard or soft.
    ClippedSensor,
    /// A second sensor takes the place of the first.
    RedundantSensor,
    /// Rows that no machine can have made.
    Glitch,
    /// Phase currents that do not sum to zero.
    CurrentSum,
    /// A mean where there should be none.
    Offset,
    /// Phases of unequal size.
    Unbalance,
    /// A channel that does not move.
    DeadChannel,
    /// A phase that does not conduct, in one direction or at all.
    OpenPhase,
    /// Values that no sensor of this machine should show.
    OutOfRange,
    /// Rows missing in time.
    Gap,
    /// Times that are not evenly spaced.
    IrregularSampling,
    /// Fewer samples than the supply or the leakage need.
    SlowSampling,
    /// A channel with fewer samples than the recording has rows.
    SlowChannel,
    /// Files of one run by several instruments, of which nobody says how their clocks differ.
    ClocksTakenAsOne,
    /// Times that are no machine's: probably in another unit.
    TimeUnit,
    /// Voltage, current or power that are probably given in another convention: line to line, rms, power-invariant.
    Convention,
    /// More rows than are needed or can be used.
    Decimated,
    /// Rows at the end in which nothing feeds the machine, and that show nothing.
    Unfed,
    /// Rows that stand twice.
    RepeatedRows,
    /// Sequence of the phases and sign of the speed contradict each other.
    SwappedPhases,
    /// Steady speed and supply frequency do not fit the pole pairs.
    WrongPolePairs,
    /// The speed's unit or gain is off.
    SpeedScale,
    /// Fewer points than what is looked for needs.
    TooFewRows,
    /// Tables of one voltage only.
    OneVoltage,
    /// Temperatures of windings that are not said, of the motor or of its evidence.
    WindingTemperature,
    /// No load torque is known.
    MissingLoad,
    /// The load torque is not what voltage and current make of it: another sign, gain or unit.
    LoadTorque,
    /// The inertia is not what the acceleration shows.
    Inertia,
    /// No speed is known.
    MissingSpeed,
    /// The instant of the voltage is probably another.
    VoltageInstant,
    /// The recording and the motor file, or two recordings, seem to be of different machines.
    DifferentMachine,
}

/// How much it matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// Worth knowing; taken care of.
    Note,
    /// May distort what is found.
    Warning,
    /// Makes what is found doubtful until it is corrected.
    Serious,
}

/// One thing that was noticed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// What kind.
    pub kind: FindingKind,
    /// How much it matters.
    pub severity: Severity,
    /// The recording.
    pub recording: String,
    /// The column, where it is about one.
    pub channel: Option<String>,
    /// Rows from the first that is used, counted from 0, end excluded; empty where it is about all of them.
    pub rows: Vec<Range<usize>>,
    /// The same in time, s: from the beginning of the first to the end of the last.
    pub span_s: Option<[f64; 2]>,
    /// The size of what was noticed, in the SI unit of the channel, where it has one.
    pub value: Option<f64>,
    /// What was noticed and what was done about it, in a sentence.
    pub sentence: String,
    /// What the user should do; empty when there is nothing to do.
    pub advice: String,
}

impl Finding {
    /// A finding about a whole recording or channel.
    pub fn new(kind: FindingKind, severity: Severity, sentence: impl Into<String>, advice: impl Into<String>) -> Self {
        Self {
            kind,
            severity,
            recording: String::new(),
            channel: None,
            rows: Vec::new(),
            span_s: None,
            value: None,
            sentence: sentence.into(),
            advice: advice.into(),
        }
    }

    /// Whether what would be found means nothing until this is corrected, so that it is better not begun.
    pub fn stops(&self) -> bool {
        // A voltage sensor that clips leaves most of a recording as it is.
        self.severity == Severity::Serious && self.kind != FindingKind::ClippedSensor
    }

    /// About one column.
    #[must_use]
    pub fn on(mut self, channel: &str) -> Self {
        self.channel = Some(channel.to_owned());
        self
    }

    /// About some rows.
    #[must_use]
    pub fn at(mut self, rows: Vec<Range<usize>>) -> Self {
        self.rows = rows;
        self
    }

    /// One line for people.
    pub fn line(&self) -> String {
        let stop = if self.sentence.ends_with(['.', '!', '?']) { "" } else { "." };
        let mark = match self.severity {
            Severity::Note => "",
            Severity::Warning => "warning: ",
            Severity::Serious => "serious: ",
        };
        let advice = if self.advice.is_empty() { String::new() } else { format!(" {}", self.advice) };
        format!("{}: {mark}{}{stop}{advice}", self.recording, self.sentence)
    }
}

/// What was noticed, each once: the recordings of which the same is said stand together.
pub fn joined(findings: &[Finding]) -> Vec<Finding> {
    let mut all: Vec<Finding> = Vec::new();
    for f in findings {
        let same = |x: &&mut Finding| (x.severity, &x.sentence, &x.advice) == (f.severity, &f.sentence, &f.advice);
        match all.iter_mut().find(same) {
            Some(first) => first.recording = format!("{}, {}", first.recording, f.recording),
            None => all.push(f.clone()),
        }
    }
    all
}

/// The rows where `marked` holds, as ranges.
pub fn ranges(marked: &[bool]) -> Vec<Range<usize>> {
    let mut found: Vec<Range<usize>> = Vec::new();
    for k in (0..marked.len()).filter(|&k| marked[k]) {
        match found.last_mut() {
            Some(r) if r.end == k => r.end = k + 1,
            _ => found.push(k..k + 1),
        }
    }
    found
}
