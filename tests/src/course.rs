//! The course of a loop, for those who ask why it ended as it did.

use im_diagnose::case::Case;
use im_diagnose::diagnosis::{Diagnosis, diagnose};
use im_diagnose::search::{Options, Stage};
use im_identify::offline::FitError;
use im_trials::campaign::case_of;
use im_trials::hidden::{TrialCase, simulate};

/// The loop on the same recordings once more, with the refined motor as the one that is given.
pub fn again(case: &TrialCase, answer: &Diagnosis) -> Result<Diagnosis, FitError> {
    let trial = simulate(case);
    diagnose(Case { motor: answer.refined.clone(), ..case_of(&trial) }, Options::default())
}

/// Prints its sets and stages: models, leading scores and refits.
pub fn why(answer: &Diagnosis) {
    let p = &answer.course.posterior;
    println!("      λ {:.1}, cut short: {}", p.dispersion, answer.course.cut_short);
    for s in &p.sets {
        println!("      set {:.3} D {:.1} k {} {:?}", s.probability, s.deviance, s.parameters, s.effects);
    }
    let curves: Vec<&str> = answer.curves.iter().map(|e| e.name()).collect();
    println!("      curves of no known form in the likeliest set: {curves:?}");
    for Stage { model: m, round: r, .. } in &answer.course.stages {
        println!(
            "      {:?} train {:.4} held out {:.4} D {:.0} + {:.0} of {}",
            m.effects,
            m.train(),
            m.holdout.unwrap_or(0.0),
            m.train_deviance,
            m.deviance - m.train_deviance,
            m.fit.count
        );
        for (f, x) in m.fit.free.iter().zip(m.fit.values()) {
            println!("         {:?} = {x:.4e}", f.id());
        }
        for s in r.scores.iter().take(5) {
            let name = s.effect.name();
            println!(
                "         {name:<26} score {:>9.1} gain {:.0} explained share {:.3} {:?} detectable {:.2e}",
                s.score, s.gain, s.explained_share, s.predicted, s.detectable
            );
        }
        for t in &r.trials {
            let m = &t.model;
            let (name, seen, unseen) = (t.effect.name(), m.train(), m.holdout.unwrap_or(0.0));
            println!(
                "         try {name:<26} train {seen:.4} held out {unseen:.4} D {:.0} + {:.0} {:?}",
                m.train_deviance,
                m.deviance - m.train_deviance,
                t.refusal
            );
        }
    }
    for l in answer.dependences.iter().take(3) {
        println!("         residual {:?} of {:?} log p {:.1} size {:.4}", l.variable, l.part, l.log_p, l.size);
    }
}
