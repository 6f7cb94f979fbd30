//! Recordings as laboratories have them: from files with foreign columns to an [`Experiment`] and what is wrong with it.
//!
//! file → [`raw`] columns → ([`mapping`]) → [`signals`] in SI units → ([`quality`]) → [`Intake`].

pub mod also;
pub mod columns;
mod decimate;
pub mod draft;
mod encoder;
mod error;
pub mod finding;
mod instant;
mod lag;
mod load_plan;
pub mod mapping;
mod mapping_file;
mod names;
#[cfg(feature = "parquet")]
mod parquet_text;
pub mod quality;
pub mod raw;
mod repair;
mod replay;
mod resampled;
mod sampled;
pub mod signals;
pub mod sniff;
pub mod steady_table;
mod trace;
pub mod unit;

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use im_identify::offline::{Channel, ChannelKind, Experiment, Start, VoltageNoise};
use im_model::{CanonicalColumns, EffectId, FileError, FileKind, MotorFile, Problem, Rows, TextFormat, VectorColumns, read_text};

pub use columns::Columns;
pub use draft::Draft;
pub use error::IntakeError;
pub use finding::{Finding, FindingKind, Severity, joined};
pub use load_plan::LoadPlan;
use mapping::{Begin, CurrentForm, Instant, Load, Mapping, Preface, Said, Signal, Speed, TextSaid, Time, Voltage, VoltageForm};
use quality::supply::unfed;
use raw::RawTable;
use signals::{Signals, SpeedTrace};
use sniff::Sniffed;
pub use steady_table::{SteadyRow, SteadyTable, TableKind};

/// A recording, ready to compare with.
#[derive(Clone, Debug, PartialEq)]
pub struct Intake {
    /// Inputs and channels; noise levels are still to be estimated.
    pub experiment: Experiment,
    /// How it begins, as the mapping says.
    pub begin: Begin,
    /// What is known of the load torque beside its column.
    pub load: LoadPlan,
    /// Time of its first row in the file, s.
    pub start_s: f64,
    /// What was noticed.
    pub findings: Vec<Finding>,
    /// Whether it has stretches of steady operation.
    pub steady: bool,
    /// The mapping that was guessed because there was none.
    pub draft: Option<Draft>,
}

/// Reads what a path names: a recording, with the mapping beside it if there is one, or a mapping, with the recordings it names.
///
/// The mapping of `run.csv` is `mapping` where given, else `run.recording.toml`, else `recording.toml` in the same folder, where that names
/// the file or none; a file in canonical columns needs none. For any other one is guessed, and used if nothing essential is missing.
///
/// # Errors
/// What is wrong with a file, with line and key or column; [`IntakeError::Unmapped`] where the guess is not complete.
pub fn read(path: &Path, mapping: Option<&Path>, motor: &MotorFile) -> Result<Vec<Intake>, IntakeError> {
    sources(path, mapping)?.into_iter().map(|(data, mapping)| read_one(Origin::File(&data), mapping, motor)).collect()
}

/// The columns of one recording's file as they stand in it, whatever they mean; what is no number is NaN.
///
/// # Errors
/// The file or its mapping cannot be read, or the mapping is of several recordings.
pub fn columns_of(path: &Path, mapping: Option<&Path>) -> Result<Columns, FileError> {
    let mut all = sources(path, mapping)?;
    let Some((data, said)) = all.pop().filter(|_| all.is_empty()) else {
        let reason = "is of several recordings; name one of them".to_owned();
        return Err(FileError::new(&path.display().to_string(), None, None, Problem::Syntax { reason }));
    };
    let label = data.display().to_string();
    let format = match said {
        Some(Said::Columns(mapping)) => mapping.format,
        Some(Said::Preface(preface)) => sniff::sniff(&data, &label, preface.text)?.format,
        None if raw::open(&data, &label, TextFormat::default()).is_ok_and(|rows| CanonicalColumns::meant(rows.names())) => {
            TextFormat::default()
        }
        None => sniff::sniff(&data, &label, TextSaid::default())?.format,
    };
    let rows = raw::open(&data, &label, format)?;
    let every: Vec<usize> = (0..rows.names().len()).collect();
    let table = RawTable::from_rows(rows, &label, &every, usize::MAX)?;
    Columns::try_new(&label, table.names.into_iter().zip(table.columns).collect(), None)
}

/// Takes in columns that stand in memory, in the same way: by their mapping, as canonical columns, or by a guess.
///
/// # Errors
/// As [`read`].
pub fn read_columns(columns: &Columns, motor: &MotorFile) -> Result<Intake, IntakeError> {
    read_one(Origin::Columns(columns), columns.mapping.clone().map(|m| Said::Columns(Box::new(m))), motor)
}

/// Where the rows of a recording stand.
#[derive(Clone, Copy)]
enum Origin<'a> {
    File(&'a Path),
    Columns(&'a Columns),
}

impl Origin<'_> {
    fn label(self) -> String {
        match self {
            Self::File(path) => path.display().to_string(),
            Self::Columns(c) => c.label.clone(),
        }
    }

    fn rows<'l>(self, label: &'l str, format: TextFormat) -> Result<Rows<'l, Box<dyn Read>>, FileError> {
        match self {
            Self::File(path) => raw::open(path, label, format),
            Self::Columns(c) => c.rows(label),
        }
    }

    fn is_text(self) -> bool {
        let kind = |path| raw::kind_of(&mut File::open(path)?, path);
        matches!(self, Self::File(path) if kind(path).is_ok_and(|k| k == raw::Kind::Text))
    }

    fn sniff(self, label: &str, said: TextSaid) -> Result<Sniffed, FileError> {
        match self {
            Self::File(path) => sniff::sniff(path, label, said),
            Self::Columns(_) => Ok(Sniffed::default()),
        }
    }
}

fn read_one(origin: Origin<'_>, said: Option<Said>, motor: &MotorFile) -> Result<Intake, IntakeError> {
    let (mapping, preface) = match said {
        Some(Said::Columns(m)) => (Some(*m), Preface::default()),
        Some(Said::Preface(p)) => (None, p),
        None => (None, Preface::default()),
    };
    if let (Origin::File(path), Some(m)) = (origin, &mapping)
        && !m.also.is_empty()
    {
        let mut joined = read_columns(&also::join(path, m)?, motor)?;
        joined.findings.extend(also::clocks_taken_as_one(m, &joined.experiment.name));
        return Ok(joined);
    }
    let label = origin.label();
    let mut format = mapping.as_ref().map_or_else(|| preface.text.over(TextFormat::default()), |m| m.format);
    let mut rows = origin.rows(&label, format)?;
    // Canonical names in a spreadsheet's numbers.
    if mapping.is_none() && CanonicalColumns::meant(rows.names()) && !rows.separated_by(b',') && origin.is_text() {
        format = origin.sniff(&label, preface.text)?.format;
        rows = origin.rows(&label, format)?;
    }
    let (mapping, mut draft) = match mapping {
        Some(m) => (m, None),
        None => {
            let meant = CanonicalColumns::meant(rows.names()).then(|| canonical(&mut rows, &label, &preface));
            match meant {
                Some(Ok(mapping)) => (Mapping { format, ..mapping }, None),
                // A name that is nearly right is a slip of the pen; one that is quite another is guessed.
                Some(Err(e)) if !matches!(*e.problem, Problem::MissingColumn { nearest: None, .. }) => return Err(e.into()),
                _ => {
                    let (mapping, draft) = guess(origin, &label, &preface, motor)?;
                    rows = origin.rows(&label, mapping.format)?;
                    (mapping, Some(draft))
                }
            }
        }
    };
    let mut asked: Vec<usize> =
        mapping.signals().iter().map(|(s, _)| raw::place(rows.names(), s, &mapping)).collect::<Result<_, _>>()?;
    asked.sort_unstable();
    asked.dedup();
    for &k in &asked {
        if mapping.time.fill_gaps { rows.require_where_given(k) } else { rows.require(k) }
    }
    if let Some(time) = &mapping.time.signal {
        rows.time_in(raw::place(rows.names(), time, &mapping)?);
    }
    let mut table = RawTable::from_rows(rows, &label, &asked, usize::MAX)?;
    let mut signals = Signals::new(&mut table, &mapping, motor.machine.pole_pairs())?;
    let repeated = table.repeated;
    drop(table);
    if let Some(draft) = draft.as_mut().filter(|d| d.leaves_the_instant_open()) {
        let at = |instant| {
            let there = Signals { instant, ..signals.clone() };
            assemble(&there, quality::check(&there, motor), mapping.begin).experiment
        };
        let choice = instant::choose(at, signals.load, motor, draft.named);
        draft.decide_instant(&choice);
        signals.instant = choice.instant;
    }
    let mut checked = quality::check(&signals, motor);
    if repeated > 0 {
        let text = format!("{repeated} rows stand twice, time included; they are read once");
        let mut finding = Finding::new(FindingKind::RepeatedRows, Severity::Note, text, "");
        finding.recording.clone_from(&signals.name);
        checked.findings.push(finding);
    }
    // The instant may have been chosen by now.
    let measured_voltage = Voltage { instant: signals.instant, ..mapping.voltage.clone() }.is_measured();
    let mut taken = Intake { draft, ..assemble(&signals, checked, mapping.begin) };
    taken.experiment.inert = Some(if measured_voltage { EffectId::InverterNonlinearity } else { EffectId::VoltageOffset });
    let switches = signals.switches();
    taken.experiment.voltage_noise =
        quality::voltage_noise::of_recording(motor, &taken.experiment, &signals.voltages(), &switches);
    let unfed = end_with_the_supply(&mut taken, &signals, motor);
    taken.findings.extend(unfed);
    taken.experiment.warmth = mapping.winding_c.map(|c| motor.warmth(c, c)).into_iter().collect();
    if let Some(mut finding) = decimate::decimate(&mut taken.experiment, motor.rating.electrical_frequency_hz) {
        finding.recording.clone_from(&signals.name);
        taken.findings.push(finding);
    }
    Ok(taken)
}

/// Once the switch has opened, only its speed moves a machine's voltage: where neither speed nor torque is known, the rows after that show nothing.
fn end_with_the_supply(taken: &mut Intake, s: &Signals, motor: &MotorFile) -> Option<Finding> {
    let last = unfed(motor, &taken.experiment).pop()?;
    if taken.load != LoadPlan::Unseen || last.start == 0 || last.end < taken.experiment.len() {
        return None;
    }
    taken.experiment.end_after(last.start);
    let text = format!(
        "No current flows from {} s on, and neither speed nor torque is known: what comes after shows nothing of the machine, and is left out",
        s.end_before(last.start)
    );
    let mut finding = Finding::new(FindingKind::Unfed, Severity::Note, text, "");
    finding.recording.clone_from(&s.name);
    Some(finding.at(vec![last]))
}

/// Guesses what the columns of a file mean, by what is said of it.
fn guess(origin: Origin<'_>, label: &str, said: &Preface, motor: &MotorFile) -> Result<(Mapping, Draft), IntakeError> {
    let sniffed = origin.sniff(label, said.text)?;
    let rows = origin.rows(label, sniffed.format)?;
    let all: Vec<usize> = (0..rows.names().len()).collect();
    let mut table = RawTable::from_rows(rows, label, &all, draft::ROWS)?;
    table.columns.iter_mut().for_each(|x| bridge(x));
    let is_number = |x: &&Vec<f64>| x.iter().any(|v| v.is_finite());
    if table.columns.iter().filter(is_number).count() < 2 {
        let found = "no two columns of numbers: this is no recording, or its lines of numbers were not found (say where they begin with \
                     skip_lines in [text])";
        return Err(FileError::new(label, None, None, Problem::NoRows { found }).into());
    }
    let path = PathBuf::from(label);
    let file = path.file_name().map_or_else(|| label.to_owned(), |f| f.to_string_lossy().into_owned());
    let draft = draft::draft(&table, &file, matches!(origin, Origin::File(_)), &sniffed, said, motor);
    if !draft.missing.is_empty() {
        return Err(IntakeError::Unmapped { file: path, draft: Box::new(draft) });
    }
    let mapping = Mapping::parse(&draft.text, "the guessed mapping")?;
    Ok((mapping, draft))
}

/// Fields that are no numbers in a column of numbers, to guess what it means: reading it says where they are.
fn bridge(column: &mut [f64]) {
    let numbers = column.iter().filter(|x| x.is_finite()).count();
    let Some(mut last) = column.iter().copied().find(|x| x.is_finite()).filter(|_| 10 * numbers > 9 * column.len()) else {
        return;
    };
    for x in column {
        if x.is_finite() {
            last = *x;
        } else {
            *x = last;
        }
    }
}

/// The files that are read for a path: its recordings and their mapping.
///
/// # Errors
/// The mapping cannot be read.
pub fn files(path: &Path, mapping: Option<&Path>) -> Result<Vec<PathBuf>, FileError> {
    let mut files = vec![path.to_path_buf()];
    for (data, mapping) in sources(path, mapping)? {
        files.extend(mapping.iter().filter_map(Said::columns).flat_map(|m| also::files(&data, m)));
        files.push(data);
        files.extend(mapping.map(|m| PathBuf::from(m.label())));
    }
    Ok(files)
}

/// What was noticed about recordings of one set-up: of offsets, only those that all of them show; no inertia or torque by a speed that one of them
/// shows to be in another unit.
pub fn findings<'a>(all: impl Iterator<Item = &'a Intake>) -> Vec<Finding> {
    let (mut found, steady): (Vec<Vec<Finding>>, Vec<bool>) = all.map(|i| (i.findings.clone(), i.steady)).unzip();
    quality::offset::keep_common(&mut found, &steady);
    let mut found: Vec<Finding> = found.into_iter().flatten().collect();
    if found.iter().any(|f| f.kind == FindingKind::SpeedScale && f.severity == Severity::Serious) {
        found.retain(|f| !matches!(f.kind, FindingKind::Inertia | FindingKind::LoadTorque));
    }
    found
}

/// How the names of recordings end; other names are read as well where a recording is asked for by its name.
pub const ENDINGS: [&str; 6] = ["csv", "parquet", "mat", "mf4", "tdms", "cfg"];

/// The recordings that a path names, each with its mapping.
fn sources(path: &Path, mapping: Option<&Path>) -> Result<Vec<(PathBuf, Option<Said>)>, FileError> {
    if path.extension().is_some_and(|e| e == "toml") {
        let mapping = read_mapping(path)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let files: Vec<PathBuf> = if mapping.files().is_empty() {
            let stem = path.file_name().map(|n| n.to_string_lossy().replace(".recording.toml", "").replace(".toml", ""));
            let data = ENDINGS.map(|end| folder.join(format!("{}.{end}", stem.as_deref().unwrap_or_default())));
            vec![data.iter().find(|p| p.is_file()).unwrap_or(&data[0]).clone()]
        } else {
            mapping.files().iter().map(|f| folder.join(f)).collect()
        };
        if let Some(missing) = files.iter().find(|f| !f.is_file()) {
            let problem =
                Problem::Unexpected { found: missing.display().to_string(), expected: "a recording that is there".into() };
            return Err(FileError::new(&path.display().to_string(), None, Some("file"), problem));
        }
        return Ok(files.into_iter().map(|f| (f, Some(mapping.clone()))).collect());
    }
    // Names that no recording has: a look inside says what it is.
    if path.extension().is_some_and(|e| ["json", "html"].iter().any(|other| e.eq_ignore_ascii_case(other)))
        && let Some(reason) = FileKind::Mapping.mistaken(&read_text(path)?)
    {
        return Err(FileError::new(&path.display().to_string(), None, None, Problem::Syntax { reason }));
    }
    let own = path.with_extension("recording.toml");
    let said = match mapping.or_else(|| own.is_file().then_some(own.as_path())) {
        Some(mapping) => Some(read_mapping(mapping)?),
        None => of_folder(path)?,
    };
    Ok(vec![(path.to_path_buf(), said)])
}

/// What the `recording.toml` of the folder says of a recording: nothing where it names other files, or other columns than the canonical ones
/// that the recording has.
fn of_folder(path: &Path) -> Result<Option<Said>, FileError> {
    let file = path.with_file_name("recording.toml");
    if !file.is_file() {
        return Ok(None);
    }
    let said = read_mapping(&file)?;
    // Canonical columns mean what they are called where the mapping is of other columns.
    let of_others = |m: &Mapping| {
        let label = path.display().to_string();
        raw::open(path, &label, TextFormat::default()).is_ok_and(|mut rows| {
            let has_all = m.signals().iter().all(|(signal, _)| raw::place(rows.names(), signal, m).is_ok());
            !has_all && CanonicalColumns::find(&mut rows).is_ok()
        })
    };
    let meant = if said.files().is_empty() { !said.columns().is_some_and(of_others) } else { is_of(&said, path) };
    Ok(meant.then_some(said))
}

/// Whether a mapping is of a recording by its name.
fn is_of(said: &Said, path: &Path) -> bool {
    said.files().iter().any(|f| path.file_name() == Path::new(f).file_name())
}

/// The files that the `recording.toml` beside a recording is of, where this is none of them.
pub fn mapping_of_others(path: &Path) -> Option<String> {
    let said = read_mapping(&path.with_file_name("recording.toml")).ok()?;
    (!said.files().is_empty() && !is_of(&said, path)).then(|| said.files().join(", "))
}

/// Reads a mapping.
///
/// # Errors
/// The file cannot be read, or is no mapping.
pub fn read_mapping(path: &Path) -> Result<Said, FileError> {
    Said::parse(&read_text(path)?, &path.display().to_string())
}

/// The mapping of a file in canonical columns.
fn canonical<R: Read>(rows: &mut Rows<'_, R>, label: &str, said: &Preface) -> Result<Mapping, FileError> {
    let found = CanonicalColumns::find(rows)?;
    let signal = |k: usize| Signal::plain(&rows.names()[k]);
    let voltage = match found.u {
        VectorColumns::Vector(c) => VoltageForm::AlphaBeta(c.map(signal)),
        VectorColumns::Phases(c) => VoltageForm::Phases(c.map(signal)),
        VectorColumns::TwoPhases(c) => VoltageForm::TwoPhases(c.map(signal)),
    };
    let current = match found.i {
        VectorColumns::Vector(c) => CurrentForm::AlphaBeta(c.map(signal)),
        VectorColumns::Phases(c) => CurrentForm::Phases(c.map(signal)),
        VectorColumns::TwoPhases(c) => CurrentForm::TwoPhases([0, 1], c.map(signal)),
    };
    Ok(Mapping {
        label: label.to_owned(),
        keys: Vec::new(),
        files: Vec::new(),
        also: Vec::new(),
        format: said.text.over(TextFormat::default()),
        time: Time {
            signal: Some(signal(found.time)),
            sample_time_s: None,
            from_s: f64::NEG_INFINITY,
            to_s: f64::INFINITY,
            fill_gaps: false,
        },
        voltage: Voltage { form: voltage, times: None, instant: Instant::HeldFromRow, measured: None },
        current,
        angle: None,
        speed: Speed::Measured { signal: signal(found.omega_m), electrical: false },
        load: found.tau_load.map_or(Load::Unstated, |k| Load::Measured { signal: signal(k), times: None }),
        begin: said.begin,
        winding_c: said.winding_c,
    })
}

/// Makes the experiment of what the checks left.
fn assemble(s: &Signals, checked: quality::Checked, begin: Begin) -> Intake {
    let u_s = s.held_voltage();
    let n = u_s.len();
    let current = |x: usize| checked.current(s, x);
    let valid = |x: usize| -> Option<Vec<bool>> {
        let sampled = checked.samples.get(x).and_then(Option::as_ref);
        let of = |k: usize| {
            checked.valid.get(x).is_none_or(|v| v[k])
                && s.filled.get(k).is_none_or(|f| !f)
                && sampled.is_none_or(|s| s.measured[k])
        };
        let mask: Vec<bool> = (0..n).map(of).collect();
        mask.contains(&false).then_some(mask)
    };
    let channel = |name: &str, kind, values: Vec<f64>, valid| Channel { name: name.into(), kind, values, valid, sigma: 1.0 };
    let along = |direction_rad: f64| ChannelKind::Current { direction_rad };
    const THIRD: f64 = 2.0 * std::f64::consts::FRAC_PI_3;
    const RIGHT: f64 = std::f64::consts::FRAC_PI_2;
    let phase = |x: usize, p: usize| {
        channel(["i_a_A", "i_b_A", "i_c_A"][p], along(THIRD * p as f64), current(x).values[..n].to_vec(), valid(x))
    };
    let vector = |of: &dyn Fn(usize) -> im_model::Complex<f64>| {
        let mask = valid(usize::MAX);
        vec![
            channel("i_alpha_A", along(0.0), (0..n).map(|k| of(k).re).collect(), mask.clone()),
            channel("i_beta_A", along(RIGHT), (0..n).map(|k| of(k).im).collect(), mask),
        ]
    };
    let masked = !checked.valid.is_empty() || checked.samples[..s.current.len()].iter().any(Option::is_some);
    // Whole rows make a space vector; where single phases are left out every phase is compared for itself.
    let mut channels = match &s.current_form {
        // What stood in d and q was turned on the way in.
        CurrentForm::AlphaBeta(_) | CurrentForm::Dq(_) => vec![
            channel("i_alpha_A", along(0.0), current(0).values[..n].to_vec(), valid(0)),
            channel("i_beta_A", along(RIGHT), current(1).values[..n].to_vec(), valid(1)),
        ],
        CurrentForm::Phases(_) if masked => (0..3).map(|x| phase(x, x)).collect(),
        CurrentForm::Phases(_) => vector(&|k| checked.i(s, k)),
        CurrentForm::TwoPhases(which, _) if masked => (0..2).map(|x| phase(x, which[x])).collect(),
        CurrentForm::TwoPhases(..) => vector(&|k| checked.i(s, k)),
    };
    if let SpeedTrace::Measured(w) = &s.speed {
        channels.push(channel("omega_m_rad_s", ChannelKind::Speed, w.values[..n].to_vec(), valid(s.current.len())));
    }
    let experiment = Experiment {
        load: im_identify::offline::Load::Known,
        name: s.name.clone(),
        sample_time_s: s.sample_time_s,
        u_s,
        is_smooth: s.instant == Instant::Sample,
        voltage_noise: VoltageNoise::default(),
        tau_load: s.tau_load.as_ref().map_or_else(|| vec![0.0; n], |t| t.values[..n].to_vec()),
        imposed_speed: matches!(s.speed, SpeedTrace::Locked).then(|| vec![0.0; n]),
        speed_nudge: None,
        warmth: Vec::new(),
        inert: None,
        nudge_part: 1.0,
        supply_frequency_hz: None,
        channels,
        start: Start::Rest,
    };
    Intake {
        experiment,
        begin,
        load: if checked.load_is_guessed { LoadPlan::Unknown } else { s.load },
        start_s: s.start_s,
        findings: checked.findings,
        steady: checked.steady,
        draft: None,
    }
}
