//! Motor and recordings as the commands of the main job take them.

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use im_diagnose::case::Case;
use im_diagnose::consistency;
use im_diagnose::intake::quality::convention;
use im_diagnose::intake::{self, Draft, Finding, FindingKind, Intake, IntakeError, Severity, SteadyTable};
use im_diagnose::search::Options;
use im_diagnose::tables;
use im_identify::offline::FitError;
use im_model::toml_text::quoted;
use im_model::{BaseParameter, Known, Machine, MotorFile, ParameterId, Plant, Recording};

use crate::failure::Failure;
use crate::output::Outputs;
use crate::spinner::spinning;
use crate::terminal::{say, wrapped};

/// A motor with its recordings.
#[derive(clap::Args)]
pub struct Data {
    /// The motor as it is known: a motor.toml
    #[arg(long, value_name = "FILE")]
    pub motor: PathBuf,
    /// A recording to learn from, or its recording.toml; give it several times for several recordings
    #[arg(long, value_name = "FILE", required_unless_present = "table")]
    pub train: Vec<PathBuf>,
    /// A table of steady states, alone or beside recordings (V_LL_V, I_A, P_3ph_W, Q_3ph_var, n_rpm, T_Nm); give no-load, locked-rotor and load tests together
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

/// That the motor can be simulated at a recording's sampling time.
pub fn followed(motor: &MotorFile, file: &Path, taken: &Intake) -> Result<(), Failure> {
    let e = &taken.experiment;
    let machine = Plant::new(&motor.machine).followed(e.sample_time_s);
    machine.map_err(|why| Failure::Input(format!("{} with {}: {why}", file.display(), e.name)))
}

/// Ends a run whose answer would mean nothing, unless it is wanted anyway.
pub fn meaningful(findings: &[Finding], anyway: bool) -> Result<(), Failure> {
    let stops: Vec<String> = findings.iter().filter(|f| f.stops()).map(Finding::line).collect();
    if stops.is_empty() || anyway {
        return Ok(());
    }
    Err(Failure::Input(format!("{}\nUntil that is corrected the answer means nothing; --anyway goes on", stops.join("\n"))))
}

impl Data {
    /// The effects to consider: all of the library, or those that a table can show.
    pub fn options(&self) -> Options {
        let candidates = if self.train.is_empty() { tables::candidates() } else { Vec::new() };
        Options { candidates, ..Options::default() }
    }

    /// Where files may be written.
    pub fn outputs(&self) -> Outputs {
        let recordings = self.train.iter().chain(&self.holdout);
        let read = [&self.motor].into_iter().chain(&self.table).chain(&self.mapping);
        Outputs::beside(read).and_recordings(recordings, self.mapping.as_deref())
    }

    /// Reads everything; what was noticed about the recordings comes along.
    pub fn case(&self) -> Result<(Case, Vec<Finding>), Failure> {
        let mut motor = MotorFile::read(&self.motor)?;
        for name in &self.fix {
            hold(&mut motor, name)?;
        }
        let mapping = self.mapping.as_deref();
        if self.train.is_empty() {
            if let Some(held) = &self.holdout {
                return Err(Failure::Input(format!(
                    "{}: held out from tables alone it says nothing; give recordings with --train",
                    held.display()
                )));
            }
            return self.tables(motor, mapping);
        }
        let train = recordings(&self.train, mapping, &motor)?;
        let holdout = self.holdout.as_deref().map(|p| recording(p, mapping, &motor)).transpose()?;
        let mut findings = intake::findings(train.iter().chain(&holdout));
        meaningful(&findings, self.anyway)?;
        for taken in train.iter().chain(&holdout) {
            followed(&motor, &self.motor, taken)?;
        }
        let mut case = Case::from_intake(motor.clone(), train, holdout);
        findings.extend(spinning("comparing the recordings", || consistency::check(&case)));
        if !self.table.is_empty() {
            // A mapping is that of the recordings: a table beside them has the canonical columns.
            let (tables, noticed) = self.tables(motor, None)?;
            case.train.extend(tables.train);
            findings.extend(noticed);
        }
        meaningful(&findings, self.anyway)?;
        // What makes all that follows doubtful is said before it, and once more in its place.
        for f in findings.iter().filter(|f| f.severity == Severity::Serious) {
            say(&wrapped("! ", &f.line()));
        }
        Ok((case, findings))
    }

    /// The tables as a case.
    fn tables(&self, motor: MotorFile, mapping: Option<&Path>) -> Result<(Case, Vec<Finding>), Failure> {
        let tables = self.table.iter().map(|p| SteadyTable::read(p, mapping)).collect::<Result<Vec<_>, _>>()?;
        // Few rows are enough beside recordings.
        let mut noticed = tables::look(&motor, &tables);
        noticed.retain(|f| self.train.is_empty() || f.kind != FindingKind::TooFewRows);
        meaningful(&noticed, self.anyway)?;
        let (case, mut findings) = tables::case(motor, &tables).map_err(|e| refused(&self.motor, &e))?;
        findings.extend(noticed);
        Ok((case, findings))
    }
}

/// Holds a parameter of a motor at its value.
fn hold(motor: &mut MotorFile, name: &str) -> Result<(), Failure> {
    let keys = || {
        let base = BaseParameter::ALL.into_iter().map(ParameterId::Base);
        let on = motor.machine.effects().active().flat_map(|e| (0..e.parameters().len()).map(move |k| ParameterId::Effect(e, k)));
        base.chain(on)
    };
    let Some(id) = keys().find(|id| id.to_string() == name || id.key() == name) else {
        let known: Vec<String> = keys().map(|id| id.to_string()).collect();
        return Err(Failure::Input(format!(
            "--fix {name}: no parameter of this motor is called so; there are {}",
            known.join(", ")
        )));
    };
    motor.known.insert(id, Known { value: motor.machine.get(id), tolerance: 0.0 });
    Ok(())
}

/// What the reading of recordings is called where it takes long.
const READING: &str = "reading and checking the recording";

/// Reads recordings that are long enough to say something, and whose columns somebody has said the meaning of.
pub fn recordings(paths: &[PathBuf], mapping: Option<&Path>, motor: &MotorFile) -> Result<Vec<Intake>, Failure> {
    let mut all = Vec::new();
    for path in paths {
        let unmapped = |draft: &Draft| {
            let guesses = draft.guesses.join(". ");
            Failure::Input(format!(
                "{}: no recording.toml says what its columns mean. im compare --motor … --data {} writes a first one; check it, then \
                 come back. Guessed so far: {guesses}",
                path.display(),
                path.display()
            ))
        };
        let taken = spinning(READING, || intake::read(path, mapping, motor)).map_err(|e| match e {
            IntakeError::File(e) => Failure::File(e),
            IntakeError::Unmapped { draft, .. } => unmapped(&draft),
        })?;
        if let Some(draft) = taken.iter().find_map(|t| t.draft.as_ref()) {
            return Err(unmapped(draft));
        }
        all.extend(long_enough(path, taken)?);
    }
    Ok(all)
}

/// Reads recordings as [`recordings`] does; of files without a mapping a draft is written beside them, or where that is not allowed
/// into `folder`. What was guessed comes along, one sentence each.
pub fn recordings_or_drafts(
    paths: &[PathBuf],
    mapping: Option<&Path>,
    motor: &MotorFile,
    folder: Option<&Path>,
) -> Result<(Vec<Intake>, Vec<String>), Failure> {
    let (mut all, mut said) = (Vec::new(), Vec::new());
    for path in paths {
        all.extend(long_enough(path, taken_or_draft(path, mapping, motor, folder, &mut said)?)?);
    }
    Ok((all, said))
}

/// Recordings of any length; what was guessed is added to `said`.
fn taken_or_draft(
    path: &Path,
    mapping: Option<&Path>,
    motor: &MotorFile,
    folder: Option<&Path>,
    said: &mut Vec<String>,
) -> Result<Vec<Intake>, Failure> {
    match spinning(READING, || intake::read(path, mapping, motor)) {
        Ok(taken) => {
            if let Some(draft) = taken.iter().find_map(|t| t.draft.as_ref()) {
                let written = write_draft(path, draft, folder)?;
                said.push(format!(
                    "{}: no recording.toml says what its columns mean; {} was written with what was guessed. Check it",
                    path.display(),
                    written.display()
                ));
                said.extend(draft.guesses.iter().cloned());
            }
            Ok(taken)
        }
        Err(IntakeError::File(e)) => Err(Failure::File(e)),
        Err(IntakeError::Unmapped { file, draft }) => {
            let written = write_draft(path, &draft, folder)?;
            let guesses = draft.guesses.join(". ");
            let e = IntakeError::Unmapped { file, draft };
            Err(Failure::Input(format!("{e}. {} is a first draft. Guessed so far: {guesses}", written.display())))
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
        let mut taken = taken_or_draft(path, mapping, motor, folder, &mut guessed)?;
        let (Some(one), true) = (taken.pop(), taken.is_empty()) else {
            return Err(several(path));
        };
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

/// Writes a draft beside its recording, or into `folder`, or where we are; never over a file that is there.
fn write_draft(path: &Path, draft: &Draft, folder: Option<&Path>) -> Result<PathBuf, Failure> {
    let name = PathBuf::from(path.with_extension("recording.toml").file_name().unwrap_or_default());
    let beside = path.with_file_name(&name);
    let here = folder.unwrap_or(Path::new("")).join(&name);
    let write = |to: &Path, text: &str| {
        if to.exists() {
            return Err(Failure::Input(format!("{}: is there already; name it with --mapping, or move it away", to.display())));
        }
        im_model::write_atomically(to, |w| w.write_all(text.as_bytes())).map_err(Failure::File)
    };
    if write(&beside, &draft.text).is_ok() {
        return Ok(beside);
    }
    if let Some(folder) = folder {
        Outputs::default().folder(folder, &[])?;
    }
    // Elsewhere it needs the whole path to its recording.
    let whole = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let line = |l: &str| {
        if l.starts_with("file = ") { format!("file = {}", quoted(&whole.display().to_string())) } else { l.to_owned() }
    };
    let text: Vec<String> = draft.text.lines().map(line).collect();
    write(&here, &(text.join("\n") + "\n"))?;
    Ok(here)
}

fn long_enough(path: &Path, taken: Vec<Intake>) -> Result<Vec<Intake>, Failure> {
    match taken.iter().map(|t| t.experiment.len()).find(|n| *n < 200) {
        None => Ok(taken),
        Some(n) => Err(Failure::Input(format!(
            "{}: {n} rows are too few to fit a machine to; record a start or a load step with at least 200",
            path.display()
        ))),
    }
}

/// Reads one recording.
pub fn recording(path: &Path, mapping: Option<&Path>, motor: &MotorFile) -> Result<Intake, Failure> {
    let mut all = recordings(&[path.to_path_buf()], mapping, motor)?;
    match (all.pop(), all.is_empty()) {
        (Some(one), true) => Ok(one),
        _ => Err(several(path)),
    }
}

fn several(path: &Path) -> Failure {
    Failure::Input(format!("{}: names several recordings; only one can stand here", path.display()))
}

/// What was noticed, for the report: one sentence each.
pub fn quality(findings: &[Finding]) -> Option<Vec<String>> {
    Some(findings.iter().map(Finding::line).collect())
}

/// What the fitted machine says of the convention of the recordings, unless that is said already.
pub fn by_fit(noticed: &[Finding], given: &MotorFile, fitted: &Machine<f64>) -> Option<Finding> {
    let found = convention::of_fit(given, fitted).filter(|_| noticed.iter().all(|f| f.kind != FindingKind::Convention))?;
    Some(Finding { recording: "the fit".into(), ..found })
}

/// Writes what was noticed into `dir/data_quality.json`, for programs.
pub fn write_quality(dir: &Path, findings: &[Finding]) -> Result<(), Failure> {
    let text = format!("{:#}\n", serde_json::json!({"schema": 1, "data_quality": findings}));
    im_model::write_atomically(&dir.join("data_quality.json"), |w| w.write_all(text.as_bytes())).map_err(Failure::File)
}

/// A fit that could not be made, for people.
pub fn refused(motor: &Path, e: &FitError) -> Failure {
    Failure::Input(format!("{}: {e}", motor.display()))
}
