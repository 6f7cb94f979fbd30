//! The commands: each file holds its arguments and what it does.

use clap::Subcommand;

use crate::failure::Failure;

mod effects;
mod simulate;

/// What can be asked of the program.
#[derive(Subcommand)]
pub enum Command {
    /// Run a machine through a scenario and write the recording
    Simulate(simulate::Args),
    /// List the physical effects that the model knows, or show the card of one
    Effects(effects::Args),
}

impl Command {
    /// Runs the command.
    pub fn run(self) -> Result<(), Failure> {
        match self {
            Self::Simulate(args) => simulate::run(&args),
            Self::Effects(args) => effects::run(&args),
        }
    }
}
