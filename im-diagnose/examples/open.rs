//! Runs the loop on folders of cases and prints its course.
use std::path::Path;
use std::time::Instant;

use im_diagnose::case::Case;
use im_diagnose::refine::Options;
use im_model::{MotorFile, Recording};

fn read(p: &Path) -> Recording {
    let text = std::fs::read_to_string(p).unwrap();
    let rows: Vec<Vec<f64>> = text.lines().skip(1).map(|l| l.split(',').map(|x| x.parse().unwrap()).collect()).collect();
    Recording {
        name: p.display().to_string(),
        start_s: 0.0,
        sample_time_s: (rows[rows.len() - 1][0] - rows[0][0]) / (rows.len() - 1) as f64,
        u_s: rows.iter().map(|r| im_model::Complex::new(r[1], r[2])).collect(),
        i_s: rows.iter().map(|r| im_model::Complex::new(r[3], r[4])).collect(),
        omega_m: rows.iter().map(|r| r[5]).collect(),
        tau_load: Some(rows.iter().map(|r| r[6]).collect()),
    }
}

fn main() {
    for dir in std::env::args().skip(1) {
        let dir = Path::new(&dir);
        let t = Instant::now();
        let motor = MotorFile::read(&dir.join("motor.toml")).unwrap();
        let case = Case::new(
            motor,
            &[read(&dir.join("train1.csv")), read(&dir.join("train2.csv"))],
            Some(&read(&dir.join("holdout.csv"))),
        );
        println!("== {} read {:.2} s", dir.display(), t.elapsed().as_secs_f64());
        let t = Instant::now();
        match im_diagnose::diagnosis::diagnose(case, Options::default()) {
            Ok(d) => {
                println!("  VERDICT {} {:?} alternatives {:?}", d.verdict.name(), d.effects, d.alternatives);
                for ((m, round), st) in d.course.models.iter().zip(&d.course.rounds).zip(&d.steps) {
                    println!(
                        "  {:?} train {:.4} holdout {:.4} evidence {:.0} unaided train {:.4} holdout {:.4}",
                        m.effects,
                        m.train(),
                        m.holdout.unwrap_or(0.0),
                        m.evidence,
                        st.train.chi2_per_sample,
                        st.holdout.as_ref().map_or(0.0, |h| h.chi2_per_sample)
                    );
                    for s in round.scores.iter().take(if std::env::var("ALL").is_ok() { 20 } else { 4 }) {
                        println!(
                            "     {:<26} score {:>10.1} keep {:.3} size {:?} det {:.3e} {:?}",
                            s.effect.name(),
                            s.score,
                            s.keep,
                            s.predicted,
                            s.detectable,
                            s.shape
                        );
                    }
                    for t in &round.trials {
                        println!(
                            "       try {:<26} train {:.4} holdout {:.4} ev {:.0}",
                            t.effect.name(),
                            t.model.train(),
                            t.model.holdout.unwrap_or(0.0),
                            t.model.evidence
                        );
                    }
                }
                for l in d.leftover.iter().take(3) {
                    println!("     leftover {:?} of {:?} log p {:.1} size {:.4}", l.variable, l.part, l.log_p, l.size);
                }
                let bad: Vec<&str> =
                    d.ranking.iter().filter(|c| c.detectable_size > c.usual_size).map(|c| c.effect.name()).collect();
                println!("     unexcited {bad:?}");
                for p in &d.parameters {
                    println!("       {:<40} {:.5} -> {:.5} ± {:.2e}", p.id.to_string(), p.before, p.after, p.std);
                }
            }
            Err(e) => println!("  {e}"),
        }
        println!("   {:.2} s", t.elapsed().as_secs_f64());
    }
}
