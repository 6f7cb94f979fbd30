//! A motor with its recordings, as the acts of the main job take them: read, checked, and made one [`Case`].

use std::path::{Path, PathBuf};

use im_identify::offline::{Experiment, FitError};
use im_model::{BaseParameter, FileError, Known, Machine, MotorFile, ParameterId, Plant};
use rayon::prelude::*;
use thiserror::Error;

use crate::case::Case;
use crate::consistency;
use crate::intake::quality::convention;
use crate::intake::{self, Columns, Draft, Finding, FindingKind, Intake, IntakeError, SteadyTable};
use crate::search::Options;
use crate::tables;
use crate::winding;

/// Why the work cannot begin, or ended early: one message that says what is wrong and what to do.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum Refused {
    /// A file that is not as it should be.
    #[error(transparent)]
    File(#[from] FileError),
    /// Anything else that is wrong with the input; the text says what and where.
    #[error("{0}")]
    Input(String),
}

impl Refused {
    /// A fit that could not be made, of the motor of this name.
    pub fn fit(motor: &str, e: &FitError) -> Self {
        Self::Input(format!("{motor}: {e}"))
    }
}

/// Where a recording comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// A file, or a `recording.toml`, and the mapping to use instead of the one beside it.
    File(PathBuf, Option<PathBuf>),
    /// Columns in memory.
    Columns(Box<Columns>),
}

impl Source {
    /// Its name in messages.
    pub fn label(&self) -> String {
        match self {
            Self::File(path, _) => path.display().to_string(),
            Self::Columns(c) => c.label.clone(),
        }
    }

    /// Reads it as it is, with a guessed mapping where it has none.
    ///
    /// # Errors
    /// As [`intake::read`].
    pub fn read(&self, motor: &MotorFile) -> Result<Vec<Intake>, IntakeError> {
        match self {
            Self::File(path, mapping) => intake::read(path, mapping.as_deref(), motor),
            Self::Columns(c) => Ok(vec![intake::read_columns(c, motor).map_err(|e| in_memory(e, &c.label))?]),
        }
    }

    /// Reads recordings that are long enough to say something, and whose columns somebody has said the meaning of.
    ///
    /// # Errors
    /// As [`mapped`](Self::mapped); there are too few rows.
    pub fn recordings(&self, motor: &MotorFile) -> Result<Vec<Intake>, Refused> {
        self.long_enough(self.mapped(motor)?)
    }

    /// Reads recordings whose columns somebody has said the meaning of.
    ///
    /// # Errors
    /// As [`intake::read`]; nobody has said the meaning of the columns.
    pub fn mapped(&self, motor: &MotorFile) -> Result<Vec<Intake>, Refused> {
        let taken = self.read(motor).map_err(|e| match e {
            IntakeError::File(e) => Refused::File(e),
            IntakeError::Unmapped { draft, .. } => self.unmapped(&draft),
        })?;
        if let Some(draft) = taken.iter().find_map(|t| t.draft.as_ref()) {
            return Err(self.unmapped(draft));
        }
        Ok(taken)
    }

    /// Reads the one recording that there is.
    ///
    /// # Errors
    /// As [`recordings`](Self::recordings); there are several.
    pub fn recording(&self, motor: &MotorFile) -> Result<Intake, Refused> {
        self.only(self.recordings(motor)?)
    }

    /// The one recording that there is.
    ///
    /// # Errors
    /// There are several.
    pub fn only(&self, mut all: Vec<Intake>) -> Result<Intake, Refused> {
        match (all.pop(), all.is_empty()) {
            (Some(one), true) => Ok(one),
            _ => Err(Refused::Input(format!("{}: names several recordings; only one can stand here", self.label()))),
        }
    }

    /// Recordings that are long enough to fit a machine to.
    ///
    /// # Errors
    /// One has fewer than 200 rows.
    pub fn long_enough(&self, taken: Vec<Intake>) -> Result<Vec<Intake>, Refused> {
        match taken.iter().map(|t| t.experiment.len()).find(|n| *n < 200) {
            None => Ok(taken),
            Some(n) => Err(Refused::Input(format!(
                "{}: {n} rows are too few to fit a machine to; record a start or a load step with at least 200",
                self.label()
            ))),
        }
    }

    fn unmapped(&self, draft: &Draft) -> Refused {
        let guesses = match &draft.missing[..] {
            [] => draft.listed(),
            open => format!("{}\nTo fill in: {}", draft.listed(), open.join("; ")),
        };
        let (label, nobody) = (self.label(), draft.nobody_says());
        Refused::Input(match self {
            Self::File(path, _) => match intake::mapping_of_others(path) {
                Some(others) => format!(
                    "{label}: recording.toml beside it is of {others} alone. Where it holds for this file, too, delete its key file.\n\
                     Guessed so far:\n{guesses}"
                ),
                None => format!(
                    "{label}: {nobody} what its columns mean. im compare --motor … --data {label} writes a first one; check it, \
                     then come back. Saved as recording.toml it holds for every file of the folder.\nGuessed so far:\n{guesses}"
                ),
            },
            Self::Columns(_) => {
                format!(
                    "{label}: no mapping says what its columns mean. Guessed so far, to check and to give as the mapping:\n{guesses}"
                )
            }
        })
    }
}

/// An error about columns in memory: they have rows, the first of which is 0, and no lines, the first of which would be their names.
fn in_memory(e: IntakeError, label: &str) -> IntakeError {
    match e {
        IntakeError::File(FileError { file, line: Some(line), key, problem }) if file == label && line >= 2 => {
            let file = format!("{file}, row {} (the first is 0)", line - 2);
            IntakeError::File(FileError { file, line: None, key, problem })
        }
        e => e,
    }
}

/// A motor, what is compared with it, and how.
#[derive(Clone, Debug)]
pub struct Sources {
    /// The motor as it is known.
    pub motor: MotorFile,
    /// Its name in messages: its file.
    pub label: String,
    /// Recordings to learn from.
    pub train: Vec<Source>,
    /// Tables of steady states, each with the mapping of its columns where they are foreign.
    pub tables: Vec<(PathBuf, Option<PathBuf>)>,
    /// A recording that no fit sees.
    pub holdout: Option<Source>,
    /// Parameters that are held at their value: keys of the motor file, or `EFFECT.KEY`.
    pub fix: Vec<String>,
    /// Go on where what was noticed about the data makes the answer meaningless.
    pub anyway: bool,
}

impl Sources {
    /// A motor alone, read from a file.
    ///
    /// # Errors
    /// As [`MotorFile::read`].
    pub fn of_motor(path: &Path) -> Result<Self, FileError> {
        Ok(Self::new(MotorFile::read(path)?, path.display().to_string()))
    }

    /// A motor alone.
    pub fn new(motor: MotorFile, label: String) -> Self {
        Self { motor, label, train: Vec::new(), tables: Vec::new(), holdout: None, fix: Vec::new(), anyway: false }
    }

    /// The effects to consider: all of the library, or those that a table can show.
    pub fn options(&self) -> Options {
        let candidates = if self.train.is_empty() { tables::candidates() } else { Vec::new() };
        Options { candidates, ..Options::default() }
    }

    /// Reads everything; what was noticed about the recordings comes along.
    ///
    /// # Errors
    /// A source that cannot be read, or an answer that would mean nothing.
    pub fn case(&self) -> Result<(Case, Vec<Finding>), Refused> {
        let mut motor = self.motor.clone();
        self.fix.iter().try_for_each(|name| hold(&mut motor, name))?;
        if self.train.is_empty() {
            if let Some(held) = &self.holdout {
                let held = held.label();
                return Err(Refused::Input(format!(
                    "{held}: held out from tables alone it says nothing; give recordings with --train"
                )));
            }
            return self.tables(motor).map(with_temperatures);
        }
        let read = || self.train.par_iter().map(|s| s.recordings(&motor)).collect::<Vec<_>>();
        let (train, holdout) = rayon::join(read, || self.holdout.as_ref().map(|s| s.recording(&motor)));
        // Of several that cannot be read, the first is said.
        let train: Vec<Intake> = train.into_iter().collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect();
        let mut earlier = train.iter().enumerate().map(|(k, t)| (t, &train[..k]));
        if let Some((t, other)) =
            earlier.find_map(|(t, all)| Some((t, all.iter().find(|o| same_rows(&o.experiment, &t.experiment))?)))
        {
            return Err(Refused::Input(format!(
                "{}: this training recording has the same rows as {}, and would count twice; give it once",
                t.experiment.name, other.experiment.name
            )));
        }
        let holdout = holdout.transpose()?;
        if let Some(held) = &holdout
            && let Some(same) = train.iter().find(|t| same_rows(&t.experiment, &held.experiment))
        {
            return Err(Refused::Input(format!(
                "{}: the held-out recording has the same rows as the training recording {}, and proves nothing; give another one, or leave it out",
                held.experiment.name, same.experiment.name
            )));
        }
        let mut findings = intake::findings(train.iter().chain(&holdout));
        meaningful(&findings, self.anyway)?;
        for taken in train.iter().chain(&holdout) {
            followed(&motor, &self.label, taken)?;
        }
        let mut case = Case::from_intake(motor.clone(), train, holdout);
        findings.extend(consistency::check(&case));
        if !self.tables.is_empty() {
            let (tables, noticed) = self.tables(motor)?;
            case.train.extend(tables.train);
            findings.extend(noticed);
        }
        meaningful(&findings, self.anyway)?;
        Ok(with_temperatures((case, findings)))
    }

    /// The tables as a case.
    fn tables(&self, motor: MotorFile) -> Result<(Case, Vec<Finding>), Refused> {
        let read = |(path, mapping): &(PathBuf, Option<PathBuf>)| SteadyTable::read(path, mapping.as_deref());
        let tables = self.tables.iter().map(read).collect::<Result<Vec<_>, _>>()?;
        // Few rows are enough beside recordings.
        let mut noticed = tables::look(&motor, &tables);
        noticed.retain(|f| self.train.is_empty() || !matches!(f.kind, FindingKind::TooFewRows | FindingKind::OneVoltage));
        meaningful(&noticed, self.anyway)?;
        let (case, mut findings) = tables::case(motor, &tables).map_err(|e| Refused::fit(&self.label, &e))?;
        findings.extend(noticed);
        Ok((case, findings))
    }
}

/// A case with what its temperatures ask for.
fn with_temperatures((mut case, mut findings): (Case, Vec<Finding>)) -> (Case, Vec<Finding>) {
    findings.extend(winding::settle(&mut case.motor, &case.train));
    (case, findings)
}

/// That the motor of this name can be simulated at a recording's sampling time.
///
/// # Errors
/// It would need too many steps for a sample.
pub fn followed(motor: &MotorFile, label: &str, taken: &Intake) -> Result<(), Refused> {
    let e = &taken.experiment;
    let machine = Plant::new(&motor.machine).followed(e.sample_time_s);
    machine.map_err(|why| Refused::Input(format!("{label} with {}: {why}", e.name)))
}

/// Ends a run whose answer would mean nothing, unless it is wanted anyway.
///
/// # Errors
/// A finding that stops a run.
pub fn meaningful(findings: &[Finding], anyway: bool) -> Result<(), Refused> {
    let stops: Vec<String> = findings.iter().filter(|f| f.stops()).map(Finding::line).collect();
    if stops.is_empty() || anyway {
        return Ok(());
    }
    Err(Refused::Input(format!("{}\nUntil that is corrected the answer means nothing; --anyway goes on", stops.join("\n"))))
}

/// What the fitted machine says of the convention of the recordings, unless that is said already; `supply` as [`Fitted`](crate::fitted::Fitted) has it.
pub fn by_fit(noticed: &[Finding], given: &MotorFile, fitted: &Machine<f64>, supply: Option<f64>) -> Option<Finding> {
    let found =
        convention::of_fit(given, fitted, supply).filter(|_| noticed.iter().all(|f| f.kind != FindingKind::Convention))?;
    Some(Finding { recording: "the fit".into(), ..found })
}

/// Holds a parameter of a motor at its value.
fn hold(motor: &mut MotorFile, name: &str) -> Result<(), Refused> {
    let keys = || {
        let base = BaseParameter::ALL.into_iter().map(ParameterId::Base);
        let on = motor.machine.effects().active().flat_map(|e| (0..e.parameters().len()).map(move |k| ParameterId::Effect(e, k)));
        base.chain(on)
    };
    let Some(id) = keys().find(|id| id.to_string() == name || id.key() == name) else {
        let known: Vec<String> = keys().map(|id| id.to_string()).collect();
        return Err(Refused::Input(format!(
            "--fix {name}: no parameter of this motor is called so; there are {}",
            known.join(", ")
        )));
    };
    motor.known.insert(id, Known { value: motor.machine.get(id), tolerance: 0.0 });
    Ok(())
}

/// Whether two recordings hold the same values.
fn same_rows(a: &Experiment, b: &Experiment) -> bool {
    a.u_s == b.u_s && a.channels.iter().map(|c| &c.values).eq(b.channels.iter().map(|c| &c.values))
}
