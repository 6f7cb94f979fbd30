//! `im demo`: the whole loop on embedded data with a hidden effect.
//!
//! The recordings come from a simulator that shares no equations with the model (im-trials); nothing here says what it hid.

use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

use im_diagnose::case::Case;
use im_diagnose::diagnosis::diagnose;
use im_diagnose::report::{FILES, Meta, Story};
use im_diagnose::search::Options;
use im_model::{MotorFile, Recording, write_atomically};

use super::diagnose::finish;
use super::inputs::refused;
use crate::failure::Failure;
use crate::output::Outputs;
use crate::provenance::of_this_run;
use crate::spinner::spinning;
use crate::terminal::{stdout, wrapped};

/// Arguments.
#[derive(clap::Args)]
pub struct Args {
    /// Folder for report.html, motor.refined.toml and diagnosis.json
    #[arg(long, value_name = "DIR", default_value = "im-demo")]
    out: PathBuf,
    /// Write the embedded motor and recordings there too, to try the other commands on
    #[arg(long, value_name = "DIR")]
    save_data: Option<PathBuf>,
    /// Print diagnosis.json instead of the story
    #[arg(long)]
    json: bool,
}

const MOTOR: &str = include_str!("../../data/demo/motor.toml");
const TRAIN: [&str; 2] = [include_str!("../../data/demo/train1.csv"), include_str!("../../data/demo/train2.csv")];
const HOLDOUT: &str = include_str!("../../data/demo/holdout.csv");

const SAVED: [(&str, &str); 4] =
    [("motor.toml", MOTOR), ("train1.csv", TRAIN[0]), ("train2.csv", TRAIN[1]), ("holdout.csv", HOLDOUT)];

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let begun = Instant::now();
    let mut outputs = Outputs::default();
    outputs.folder(&args.out, &FILES)?;
    args.save_data.as_deref().map_or(Ok(()), |dir| outputs.folder(dir, &SAVED.map(|(name, _)| name)))?;
    let read = |text: &str, name: &str| Recording::from_csv(text.as_bytes(), name);
    let motor = MotorFile::parse(MOTOR, "motor.toml")?;
    let train = [read(TRAIN[0], "train1.csv")?, read(TRAIN[1], "train2.csv")?];
    let holdout = read(HOLDOUT, "holdout.csv")?;
    if let Some(dir) = &args.save_data {
        for (name, text) in SAVED {
            write_atomically(&dir.join(name), |w| w.write_all(text.as_bytes()))?;
        }
    }
    let intro = "A motor with nameplate-grade parameters, two recordings to learn from and one held out. Something in the machine \
                 is not in the model. The program does not know what.";
    if !args.json {
        writeln!(stdout(), "{}", wrapped("", intro))?;
    }
    let case = Case::new(motor, &train, Some(&holdout));
    let found = spinning("fitting and scoring", || diagnose(case, Options::default()))
        .map_err(|e| refused(std::path::Path::new("embedded motor.toml"), &e))?;
    let meta = of_this_run(Meta { quality: None, ..Meta::of(&found, Vec::new()) }, &outputs);
    finish(&Story::new(&found, &meta), Some(&args.out), args.json)?;
    if args.json {
        return Ok(());
    }
    let mut out = stdout();
    writeln!(out, "\nTook {:.1} s. The same on your own files: im diagnose --help", begun.elapsed().as_secs_f64())?;
    if args.save_data.is_none() {
        writeln!(out, "The data of this demo, as files: im demo --save-data DIR")?;
    }
    Ok(())
}
