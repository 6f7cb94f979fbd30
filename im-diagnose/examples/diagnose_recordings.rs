//! The loop from Rust, with typed results: what is missing from a motor model, how sure that is, what the parameters became. The data are those
//! of `im demo`. Prints the answer, and draws the error from step to step:
//!
//!     cargo run --release -p im-diagnose --example diagnose_recordings -- diagnosis.svg

use im_chart::{Series, chart};
use im_diagnose::case::Case;
use im_diagnose::diagnosis::{Verdict, diagnose};
use im_diagnose::search::Options;
use im_model::{MotorFile, Recording};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/../im-cli/data/demo");
    let read = |name: &str| Recording::read_csv(format!("{data}/{name}"));
    let motor = MotorFile::read(format!("{data}/motor.toml"))?;
    let case = Case::new(motor, &[read("train1.csv")?, read("train2.csv")?], Some(&read("holdout.csv")?));

    let d = diagnose(case, Options::default())?;
    match d.verdict {
        Verdict::Adequate => println!("the model explains the recordings"),
        Verdict::MissingEffects => println!("missing: {:?}", d.effects.iter().map(|e| e.name()).collect::<Vec<_>>()),
        Verdict::Confounded => println!("missing, but confounded: {:?} or {:?}", d.effects, d.alternatives),
        Verdict::Inconclusive => println!("the recordings do not show enough: see `im_diagnose::next_test`"),
        Verdict::Unexplained => {
            println!("nothing in the library explains it; what is left depends on {:?}", d.dependences.first())
        }
    }
    for candidate in d.ranking.iter().take(3) {
        let (score, chance) = (candidate.score, candidate.threshold);
        println!("  {:24} score {score:7.0} where chance reaches {chance:.0}", candidate.effect.name());
    }
    for p in &d.estimates.list {
        println!("  {:54} {:.5} -> {:.5} ± {:.1e}", p.quantity.key(), p.before, p.after, p.std);
    }
    // Every command of `im` takes this as --motor.
    let refined = d.refined.to_toml();
    println!("  the refined motor is a file of {} lines", refined.lines().count());

    if let Some(path) = std::env::args().nth(1) {
        let error = |of: &dyn Fn(&im_diagnose::diagnosis::Step) -> Option<f64>| -> Vec<(f64, f64)> {
            let steps = d.steps.iter().enumerate();
            steps.filter_map(|(k, s)| Some((k as f64, of(s)?.log10()))).collect()
        };
        let train = Series::line("training", error(&|s| Some(s.train.chi2_per_sample)));
        let holdout = Series::line("held out", error(&|s| Some(s.holdout.as_ref()?.chi2_per_sample)));
        let svg = chart("Error from effect to effect", "effects added", "lg of χ²/N", &[train, holdout]);
        std::fs::write(path, svg)?;
    }
    Ok(())
}
