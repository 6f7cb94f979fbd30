//! `im report`: several diagnoses side by side.

use std::io::Write;
use std::path::PathBuf;

use im_diagnose::report::{Meta, SideBySide, side_by_side, side_by_side_terminal};
use im_model::{read_text, write_atomically};

use crate::failure::Failure;
use crate::output::Outputs;
use crate::provenance::of_this_run;
use crate::terminal::{STORY_WIDTH, stdout};

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  im report before/diagnosis.json after/diagnosis.json -o both.html")]
pub struct Args {
    /// diagnosis.json files, or the folders that hold them
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// Where to write the page
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let file = |path: &PathBuf| if path.is_dir() { path.join("diagnosis.json") } else { path.clone() };
    let files: Vec<PathBuf> = args.files.iter().map(file).collect();
    let mut outputs = Outputs::beside(&files);
    args.output.as_deref().map_or(Ok(()), |path| outputs.file(path))?;
    let read = |(given, file): (&PathBuf, &PathBuf)| {
        SideBySide::parse(&given.display().to_string(), &read_text(file)?).map_err(Failure::Input)
    };
    let all: Vec<SideBySide> = args.files.iter().zip(&files).map(read).collect::<Result<_, _>>()?;
    if let Some(path) = &args.output {
        write_atomically(path, |w| w.write_all(side_by_side(&all, &of_this_run(Meta::default(), &outputs)).as_bytes()))?;
    }
    write!(stdout(), "{}", side_by_side_terminal(&all, STORY_WIDTH))?;
    Ok(())
}
