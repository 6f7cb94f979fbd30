//! `im design`: gains with proofs, and the check of a proof.

mod check;
mod make;
mod words;

pub use check::other_machine;

use clap::Subcommand;
use im_design::gains::{GainSet, Value};
use im_design::request::Kind;
use serde_json::json;
use std::io::Write;

use crate::failure::Failure;
use crate::terminal::{rounded, stdout};

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = AFTER_HELP)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

const AFTER_HELP: &str = "\
Example:
  im design example-region kubota > region.toml
  im design kubota --motor examples/motor.toml --region region.toml -o gains.toml --rust gains.rs
  im design check gains.toml

The file of gains carries its own proof: machine, region, gains, Lyapunov matrices and rates. `im design check` decides \
every inequality again in exact rational arithmetic, without the solver, and refuses a file of which one digit was altered. \
With --period gains and proof are for a sampling period: observers by forward Euler, controllers with their voltage held. \
`im design KIND --help` explains a design and shows a region file for it.";

#[derive(Subcommand)]
enum What {
    /// Flux observer of Kubota et al.: a gain scheduled over speed, smallest for a decay rate
    #[command(visible_alias = "scheduled", after_help = help(Kind::Kubota))]
    Kubota(make::Args),
    /// Kubota's adaptive speed observer: stabilized and certified where it fails, regenerating at low speed
    #[command(after_help = help(Kind::KubotaLoop))]
    KubotaLoop(make::Args),
    /// Thau observer of Kwon et al.: the largest Lipschitz constant that a gain can tolerate
    #[command(after_help = help(Kind::Thau))]
    Thau(make::Args),
    /// Speed and flux observer certified over a box of speed, slip and flux, without a Lipschitz bound
    #[command(after_help = help(Kind::ThauBox))]
    ThauBox(make::Args),
    /// Sliding-mode observer of Derdiyok et al.: the smallest nu0
    #[command(after_help = help(Kind::Derdiyok))]
    Derdiyok(make::Args),
    /// Sliding-mode observer of Utkin et al.: the smallest omega0
    #[command(after_help = help(Kind::Utkin))]
    Utkin(make::Args),
    /// Sliding-mode control of Kenné et al.: the smallest gains
    #[command(after_help = help(Kind::Kenne))]
    Kenne(make::Args),
    /// Passivity-based control of Jadot et al.: gains for wanted bandwidths
    #[command(after_help = help(Kind::Jadot))]
    Jadot(make::Args),
    /// Flux observer for forward Euler: a gain made for the sampling period
    #[command(after_help = help(Kind::Sampled))]
    Sampled(make::Args),
    /// Maximum torque per ampere: laws for current and slip, with saturation, near the least current there is
    #[command(after_help = help(Kind::Mtpa))]
    Mtpa(make::Args),
    /// Print a commented region file for a design
    ExampleRegion {
        /// The design
        #[arg(value_parser = clap::builder::PossibleValuesParser::new(Kind::ALL.map(|(_, name)| name)))]
        kind: String,
    },
    /// Verify a file of gains exactly; exit status 1 when it is refused
    Check(check::Args),
}

/// The example that ends the help of one design.
fn help(kind: Kind) -> String {
    let name = kind.name();
    let example: String = kind.example_region().lines().map(|line| format!("  {line}\n")).collect();
    format!(
        "Example:\n  im design example-region {name} > region.toml\n  \
         im design {name} --motor examples/motor.toml --region region.toml -o gains.toml\n\nA region file:\n{example}"
    )
}

/// Gains, region and rates for programs.
fn as_json(set: &GainSet) -> serde_json::Map<String, serde_json::Value> {
    let value = |v: &Value| match v {
        Value::Scalar(x) => json!(x),
        Value::Range(x) => json!(x),
        Value::List(x) => json!(x),
        Value::Matrix(m) => {
            json!((0..m.rows()).map(|i| (0..m.cols()).map(|j| m[(i, j)]).collect()).collect::<Vec<Vec<f64>>>())
        }
    };
    set.gains.iter().map(|g| (g.name.clone(), value(&g.value))).collect()
}

/// One of them for people.
fn shown(value: &Value) -> String {
    let listed = |x: &[f64]| format!("[{}]", x.iter().map(|x| rounded(*x)).collect::<Vec<_>>().join(", "));
    match value {
        Value::Scalar(x) => share(*x),
        Value::Range(x) => listed(x),
        Value::List(x) => listed(x),
        Value::Matrix(m) => {
            let row = |i: usize| listed(&(0..m.cols()).map(|j| m[(i, j)]).collect::<Vec<_>>());
            (0..m.rows()).map(row).collect::<Vec<_>>().join("; ")
        }
    }
}

/// A number to three digits; of one just below 1, a contraction, three digits of what it is below.
fn share(x: f64) -> String {
    let below = 1.0 - x;
    if below > 0.0 && below < 0.01 { format!("{x:.0$}", (2.0 - below.log10().floor()) as usize) } else { rounded(x) }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    match &args.what {
        What::Kubota(a) => make::run(Kind::Kubota, a),
        What::KubotaLoop(a) => make::run(Kind::KubotaLoop, a),
        What::Thau(a) => make::run(Kind::Thau, a),
        What::ThauBox(a) => make::run(Kind::ThauBox, a),
        What::Derdiyok(a) => make::run(Kind::Derdiyok, a),
        What::Utkin(a) => make::run(Kind::Utkin, a),
        What::Kenne(a) => make::run(Kind::Kenne, a),
        What::Jadot(a) => make::run(Kind::Jadot, a),
        What::Sampled(a) => make::run(Kind::Sampled, a),
        What::Mtpa(a) => make::run(Kind::Mtpa, a),
        What::Check(a) => check::run(a),
        What::ExampleRegion { kind } => {
            let kind: Kind = kind.parse().map_err(|e| Failure::Input(format!("{e}")))?;
            Ok(stdout().write_all(kind.example_region().as_bytes())?)
        }
    }
}
