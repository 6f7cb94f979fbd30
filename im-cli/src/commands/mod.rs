//! The commands: each file holds its arguments and what it does.

use clap::Subcommand;

use crate::failure::Failure;

mod add;
mod commission;
mod compare;
mod completions;
mod demo;
#[cfg(feature = "design")]
mod design;
mod diagnose;
mod effects;
mod fit;
mod fleet;
mod identify;
mod inputs;
mod learn;
mod losses;
mod motor;
mod next_test;
mod observe;
mod report;
mod simulate;
mod validate;
#[cfg(feature = "verify")]
mod verify;

/// What can be asked of the program.
#[derive(Subcommand)]
pub enum Command {
    /// See the whole loop on embedded data with a hidden effect; needs no files
    Demo(demo::Args),
    /// Make a first motor file from a nameplate
    Motor(motor::Args),
    /// Show where a model and recordings disagree
    Compare(compare::Args),
    /// Fit the motor, find the missing physical effect, add it, check it on a held-out recording
    Diagnose(diagnose::Args),
    /// As diagnose, and learn as a curve what no effect of the library explains
    Learn(learn::Args),
    /// Fit the parameters of a motor to recordings
    Fit(fit::Args),
    /// Segregate the losses of no-load and load tests, as IEC 60034-2-1 and IEEE 112 do
    Losses(losses::Args),
    /// Judge many motors: one table of verdicts, statistics of types, a page
    Fleet(fleet::Args),
    /// Estimate parameters as a drive does while running; show where they can be estimated
    Identify(identify::Args),
    /// Add a physical effect to a motor
    Add(add::Args),
    /// Compare a motor before and after on a recording that neither has seen
    Validate(validate::Args),
    /// Propose the manoeuvre that best settles what is still open
    NextTest(next_test::Args),
    /// Put several diagnoses side by side
    Report(report::Args),
    /// Run a machine through a scenario and write the recording
    Simulate(simulate::Args),
    /// Let a simulated drive find the parameters of its motor, at standstill and turning
    Commission(commission::Args),
    /// Run a recording through a flux and speed observer
    Observe(observe::Args),
    /// Make gains of observers and controllers, each with a proof; check a proof
    #[cfg(feature = "design")]
    Design(design::Args),
    /// Try the claims of the papers on many machines, or on yours
    #[cfg(feature = "verify")]
    Verify(verify::Args),
    /// List the physical effects that the model knows, or show the card of one
    Effects(effects::Args),
    /// Print what a shell needs to complete commands, options and effects
    Completions(completions::Args),
}

impl Command {
    /// Runs the command.
    pub fn run(self) -> Result<(), Failure> {
        match self {
            Self::Demo(args) => demo::run(&args),
            Self::Motor(args) => motor::run(&args),
            Self::Compare(args) => compare::run(&args),
            Self::Report(args) => report::run(&args),
            Self::Diagnose(args) => diagnose::run(&args),
            Self::Learn(args) => learn::run(&args),
            Self::Fit(args) => fit::run(&args),
            Self::Losses(args) => losses::run(&args),
            Self::Fleet(args) => fleet::run(&args),
            Self::Identify(args) => identify::run(&args),
            Self::Add(args) => add::run(&args),
            Self::Validate(args) => validate::run(&args),
            Self::NextTest(args) => next_test::run(&args),
            Self::Simulate(args) => simulate::run(&args),
            Self::Commission(args) => commission::run(&args),
            Self::Observe(args) => observe::run(&args),
            #[cfg(feature = "design")]
            Self::Design(args) => design::run(&args),
            #[cfg(feature = "verify")]
            Self::Verify(args) => verify::run(&args),
            Self::Effects(args) => effects::run(&args),
            Self::Completions(args) => completions::run(&args),
        }
    }
}
