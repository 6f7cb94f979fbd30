//! `im report`: several diagnoses side by side.

use std::io::{self, Write};
use std::path::PathBuf;

use im_diagnose::report::{SideBySide, side_by_side, side_by_side_terminal};
use im_model::write_atomically;

use crate::failure::Failure;
use crate::output;
use crate::terminal::STORY_WIDTH;

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
    args.output.as_deref().map_or(Ok(()), output::file)?;
    let read = |path: &PathBuf| {
        let file = if path.is_dir() { path.join("diagnosis.json") } else { path.clone() };
        let label = path.display().to_string();
        let text = std::fs::read_to_string(&file).map_err(|e| Failure::Input(format!("{}: {e}", file.display())))?;
        SideBySide::parse(&label, &text).map_err(Failure::Input)
    };
    let all: Vec<SideBySide> = args.files.iter().map(read).collect::<Result<_, _>>()?;
    if let Some(path) = &args.output {
        write_atomically(path, |w| w.write_all(side_by_side(&all).as_bytes()))?;
    }
    write!(io::stdout().lock(), "{}", side_by_side_terminal(&all, STORY_WIDTH))?;
    Ok(())
}
