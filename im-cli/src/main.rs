//! The program `im`: a thin shell over the crates. One file per command in [`commands`].
//!
//! Exit status: 0 done, 1 bad input (one message that says where and what to do), 2 usage, 3 claims that did not come out as stated,
//! 130 interrupted.

mod commands;
mod failure;
#[cfg(test)]
mod guide;
mod interrupt;
mod output;
mod provenance;
mod spinner;
mod terminal;

use std::process::ExitCode;

use clap::Parser;
use clap::error::{ContextKind, ContextValue};

/// Simulate three-phase induction machines, compare the model with measurements, and find the physics it lacks.
#[derive(Parser)]
#[command(name = "im", version, max_term_width = 100, arg_required_else_help = true, after_help = AFTER_HELP)]
struct Cli {
    #[command(subcommand)]
    command: commands::Command,
}

/// The whole command line, for what describes it to a shell.
pub fn command_line() -> clap::Command {
    <Cli as clap::CommandFactory>::command()
}

/// Of a number with a comma it is said how it is written.
fn with_decimal_points(mut e: clap::Error) -> clap::Error {
    let Some(ContextValue::String(given)) = e.get(ContextKind::InvalidValue) else { return e };
    let point = given.replace(',', ".");
    if point != *given && point.parse::<f64>().is_ok() {
        let tip = format!("a number has a decimal point: {point}");
        e.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
    }
    e
}

const AFTER_HELP: &str = "\
Examples:
  im demo
  im diagnose --motor motor.toml --train a.csv --train b.csv --holdout c.csv --out out
  im simulate --motor examples/motor.toml --scenario examples/scenario_dol.toml -o run.csv
  im effects show iron_loss

Completion in a shell: im completions bash > /etc/bash_completion.d/im (also zsh, fish, powershell)

Exit status: 0 done, 1 bad input, 2 wrong usage, 3 a claim that did not come out as stated (im verify), \
130 interrupted.";

fn main() -> ExitCode {
    interrupt::listen();
    // Wrong usage ends here, with status 2.
    let cli = Cli::try_parse().unwrap_or_else(|e| with_decimal_points(e).exit());
    match cli.command.run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
