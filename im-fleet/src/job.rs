//! What there is to do: one motor with the recordings of one day.
//!
//! From a folder:
//!
//! ```text
//! fleet/pump-07/motor.toml                 the motor, as all of its type are given; its name is the type
//! fleet/pump-07/run.csv                    a recording; several are learned from together, holdout.csv is held out
//! fleet/pump-07/2026-03-01/run.csv         the same by date
//! ```
//!
//! From a table (CSV), one line for each recording, paths relative to it:
//!
//! ```text
//! unit,type,date,motor,recording,role,mapping
//! pump-07,4 kW,2026-03-01,types/4kw.toml,data/p07.csv,train,
//! ```
//!
//! `type`, `date`, `role` (`train` or `holdout`) and `mapping` may be missing or empty. Lines of one unit and date are one job.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use im_diagnose::intake::ENDINGS;
use im_diagnose::sources::Refused;
use im_model::{FileError, Problem, fields_of, read_text};
use serde::{Deserialize, Serialize};

/// One motor with its recordings.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Job {
    /// The motor's own name.
    pub unit: String,
    /// Motors of one type are compared with each other; empty: by the name in the motor file.
    pub kind: String,
    /// When it was recorded, as text that sorts; empty where nobody says.
    pub date: String,
    /// The motor as it is given.
    pub motor: PathBuf,
    /// Recordings to learn from.
    pub train: Vec<PathBuf>,
    /// A recording that no fit sees.
    pub holdout: Option<PathBuf>,
    /// What the columns mean, instead of what lies beside the recordings.
    pub mapping: Option<PathBuf>,
}

impl Job {
    /// What it is called in messages and in order.
    pub fn label(&self) -> String {
        if self.date.is_empty() { self.unit.clone() } else { format!("{} {}", self.unit, self.date) }
    }
}

/// The jobs of a folder or of a table, by unit and date.
///
/// # Errors
/// It cannot be read, or there is nothing to do in it.
pub fn jobs(path: &Path) -> Result<Vec<Job>, Refused> {
    let mut jobs = if path.is_dir() { of_folder(path)? } else { of_table(path)? };
    if jobs.is_empty() {
        return Err(Refused::Input(format!(
            "{}: no motors with recordings; each needs a folder with motor.toml and at least one recording (.{})",
            path.display(),
            ENDINGS.join(", .")
        )));
    }
    jobs.sort_by(|a, b| (&a.unit, &a.date).cmp(&(&b.unit, &b.date)));
    if let Some(twice) = jobs.windows(2).find(|w| (&w[0].unit, &w[0].date) == (&w[1].unit, &w[1].date)) {
        return Err(Refused::Input(format!("{}: {} stands twice", path.display(), twice[0].label())));
    }
    Ok(jobs)
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>, FileError> {
    let io = |e: std::io::Error| FileError::io(&folder.display().to_string(), "read", &e);
    let mut all = fs::read_dir(folder).map_err(io)?.map(|e| Ok(e?.path())).collect::<std::io::Result<Vec<_>>>().map_err(io)?;
    all.sort();
    Ok(all)
}

fn name(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

fn of_folder(path: &Path) -> Result<Vec<Job>, Refused> {
    let mut jobs = Vec::new();
    for folder in entries(path)?.into_iter().filter(|p| p.is_dir()) {
        let motor = folder.join("motor.toml");
        if !motor.is_file() {
            continue;
        }
        let unit = Job { unit: name(&folder), motor, ..Job::default() };
        jobs.extend(with_recordings(&unit, &folder)?);
        for dated in entries(&folder)?.into_iter().filter(|p| p.is_dir()) {
            jobs.extend(with_recordings(&Job { date: name(&dated), ..unit.clone() }, &dated)?);
        }
    }
    Ok(jobs)
}

/// The folders of a fleet that make no job, and what is missing in each.
///
/// # Errors
/// A folder cannot be read.
pub fn passed_over(path: &Path, jobs: &[Job]) -> Result<Vec<(PathBuf, &'static str)>, FileError> {
    let folders = if path.is_dir() { entries(path)? } else { Vec::new() };
    let hidden = |p: &PathBuf| name(p).starts_with('.');
    let without = folders.into_iter().filter(|p| p.is_dir() && !hidden(p)).filter(|p| jobs.iter().all(|j| j.unit != name(p)));
    let why = |p: &PathBuf| if p.join("motor.toml").is_file() { "no recording" } else { "no motor.toml" };
    Ok(without.map(|p| (p.clone(), why(&p))).collect())
}

/// A job with the recordings of a folder, if there are any.
fn with_recordings(job: &Job, folder: &Path) -> Result<Option<Job>, FileError> {
    let is_recording = |p: &PathBuf| p.is_file() && p.extension().is_some_and(|e| ENDINGS.iter().any(|end| e == *end));
    let (holdout, train): (Vec<PathBuf>, Vec<PathBuf>) =
        entries(folder)?.into_iter().filter(is_recording).partition(|p| p.file_stem().is_some_and(|s| s == "holdout"));
    Ok((!train.is_empty()).then(|| Job { train, holdout: holdout.into_iter().next(), ..job.clone() }))
}

fn of_table(path: &Path) -> Result<Vec<Job>, Refused> {
    let label = path.display().to_string();
    let text = read_text(path)?;
    let mut lines = text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty());
    let head: Vec<String> = lines.next().map(|(_, l)| fields_of(l, b',')).unwrap_or_default();
    let place = |name: &str| head.iter().position(|h| h.trim() == name);
    let needed = |name: &str| {
        let problem = Problem::MissingColumn { present: head.clone(), nearest: None };
        place(name).ok_or_else(|| FileError::new(&label, Some(1), Some(name), problem))
    };
    let (unit_at, motor_at, recording_at) = (needed("unit")?, needed("motor")?, needed("recording")?);
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut jobs: BTreeMap<(String, String), Job> = BTreeMap::new();
    for (k, line) in lines {
        let fields = fields_of(line, b',');
        let at = |k: usize| fields.get(k).map_or("", |f| f.trim());
        let may = |name: &str| place(name).map_or("", at);
        let wrong = |key: &str, found: &str, expected: &str| {
            let problem = Problem::Unexpected { found: found.to_owned(), expected: expected.to_owned() };
            FileError::new(&label, Some(k + 1), Some(key), problem)
        };
        for (key, at_) in [("unit", unit_at), ("motor", motor_at), ("recording", recording_at)] {
            if at(at_).is_empty() {
                return Err(wrong(key, "nothing", "a name").into());
            }
        }
        let (unit, date) = (at(unit_at).to_owned(), may("date").to_owned());
        let job = jobs.entry((unit.clone(), date.clone())).or_insert_with(|| Job {
            unit,
            date,
            kind: may("type").to_owned(),
            motor: folder.join(at(motor_at)),
            ..Job::default()
        });
        let recording = folder.join(at(recording_at));
        if !may("mapping").is_empty() {
            job.mapping = Some(folder.join(may("mapping")));
        }
        match may("role") {
            "" | "train" => job.train.push(recording),
            "holdout" => job.holdout = Some(recording),
            other => return Err(wrong("role", other, "train or holdout").into()),
        }
    }
    Ok(jobs.into_values().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_and_a_folder_say_the_same() {
        let dir = tempfile::tempdir().unwrap();
        let at = |p: &str| dir.path().join(p);
        for file in [
            "a/motor.toml",
            "a/run.csv",
            "a/holdout.csv",
            "b/motor.toml",
            "b/2026-01/run.csv",
            "b/2026-02/run.csv",
            "c/notes.csv",
        ] {
            fs::create_dir_all(at(file).parent().unwrap()).unwrap();
            fs::write(at(file), "").unwrap();
        }
        let folder = jobs(dir.path()).unwrap();
        let table = "unit,date,motor,recording,role\nb,2026-02,b/motor.toml,b/2026-02/run.csv,train\nb,2026-01,b/motor.toml,b/2026-01/run.csv,\n\
                     a,,a/motor.toml,a/holdout.csv,holdout\na,,a/motor.toml,a/run.csv,train\n";
        fs::write(at("fleet.csv"), table).unwrap();
        assert_eq!(jobs(&at("fleet.csv")).unwrap(), folder);
        assert_eq!(folder.iter().map(Job::label).collect::<Vec<_>>(), ["a", "b 2026-01", "b 2026-02"]);
        assert_eq!(passed_over(dir.path(), &folder).unwrap(), [(at("c"), "no motor.toml")]);
        for (wrong, says) in [("train", "parrot"), ("unit,", "units,")] {
            fs::write(at("wrong.csv"), table.replacen(wrong, says, 1)).unwrap();
            let e = jobs(&at("wrong.csv")).unwrap_err().to_string();
            assert!(e.contains("wrong.csv:"), "{e}");
        }
        assert!(jobs(&at("c")).unwrap_err().to_string().contains("no motors"));
    }
}
