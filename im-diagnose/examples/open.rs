//! The whole loop on folders of `motor.toml`, `train1.csv`, `train2.csv`, `holdout.csv`, with every round of it.

use std::path::Path;

use im_diagnose::case::Case;
use im_diagnose::diagnosis::diagnose;
use im_diagnose::search::{Options, Stage};
use im_model::{MotorFile, Recording};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for dir in std::env::args().skip(1) {
        let dir = Path::new(&dir);
        let read = |name: &str| Recording::read_csv(dir.join(name));
        let case = Case::new(
            MotorFile::read(dir.join("motor.toml"))?,
            &[read("train1.csv")?, read("train2.csv")?],
            Some(&read("holdout.csv")?),
        );
        let d = diagnose(case, Options::default())?;
        println!("{}: {} {:?} rivals {:?}", dir.display(), d.verdict.name(), d.effects, d.alternatives);
        for Stage { model, round, .. } in &d.course.stages {
            println!("  {:?}: train {:.4}, held out {:.4}", model.effects, model.train(), model.holdout.unwrap_or(f64::NAN));
            for s in round.scores.iter().take(5) {
                println!(
                    "    {:<26} score {:>9.1} gain {:>9.1} explained share {:.3} size {:.4?}",
                    s.effect.name(),
                    s.score,
                    s.gain,
                    s.explained_share,
                    s.predicted
                );
            }
            for t in &round.trials {
                println!("      with {:<26} train {:.4}", t.effect.name(), t.model.train());
            }
        }
    }
    Ok(())
}
