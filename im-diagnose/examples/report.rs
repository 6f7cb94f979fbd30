//! Diagnoses case folders (`motor.toml`, `train*.csv`, `holdout.csv`) and writes their reports:
//! `cargo run --release -p im-diagnose --example report -- OUT CASE…` makes `OUT/<case>/report.html` and tells the story.
use std::error::Error;
use std::path::Path;

use im_diagnose::case::Case;
use im_diagnose::diagnosis::diagnose;
use im_diagnose::report::{Files, Meta, Story, terminal};
use im_diagnose::search::Options;
use im_model::{MotorFile, Recording};

fn read(path: &Path) -> Result<Recording, Box<dyn Error>> {
    let mut r = Recording::read_csv(path)?;
    r.name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    Ok(r)
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let out = args.next().ok_or("usage: report OUT CASE…")?;
    for case in args {
        let dir = Path::new(&case);
        let mut train: Vec<_> = std::fs::read_dir(dir)?.map(|e| e.map(|e| e.path())).collect::<Result<_, _>>()?;
        train.retain(|p| p.file_name().is_some_and(|n| n.to_string_lossy().starts_with("train")));
        train.sort();
        let train = train.iter().map(|p| read(p)).collect::<Result<Vec<_>, _>>()?;
        let holdout = read(&dir.join("holdout.csv"))?;
        let d = diagnose(Case::new(MotorFile::read(dir.join("motor.toml"))?, &train, Some(&holdout)), Options::default())?;
        let meta = Meta { program: format!("im-diagnose {}", env!("CARGO_PKG_VERSION")), ..Meta::default() };
        let story = Story::new(&d, &meta);
        print!("{}", terminal(&story, 100));
        let name = dir.file_name().unwrap_or(dir.as_os_str());
        let written = Files::of(&story).write(Path::new(&out).join(name))?;
        println!("\n{}: {} kB", written.report.display(), std::fs::metadata(&written.report)?.len() / 1000);
    }
    Ok(())
}
