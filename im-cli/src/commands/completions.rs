//! `im completions`: what a shell needs to complete the command line.

use std::io::Write;

use clap_complete::Shell;

use crate::failure::Failure;
use crate::terminal::stdout;

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  im completions bash > ~/.local/share/bash-completion/completions/im
  im completions zsh > ~/.zfunc/_im")]
pub struct Args {
    /// Which shell
    #[arg(value_enum)]
    shell: Shell,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut crate::command_line(), "im", &mut script);
    Ok(stdout().write_all(&script)?)
}
