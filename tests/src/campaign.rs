//! The hidden-effect campaign: trials of [`hidden`](crate::hidden) put before the diagnosing tool, which is told nothing.

use im_diagnose::case::Case as DiagnosisCase;
use im_diagnose::diagnosis::{Diagnosis, Verdict, diagnose};
use im_diagnose::refine::Options;
use im_model::{Complex, MotorFile, Recording};

use crate::hidden::{Case, Part, Table, Trial, simulate};

/// A table as the tool reads it.
pub fn recording(name: &str, t: &Table) -> Recording {
    let pairs = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| Complex::new(*x, *y)).collect();
    Recording {
        name: name.into(),
        start_s: t.t_s[0],
        sample_time_s: (t.t_s[t.t_s.len() - 1] - t.t_s[0]) / (t.t_s.len() - 1) as f64,
        u_s: pairs(&t.u_alpha_v, &t.u_beta_v),
        i_s: pairs(&t.i_alpha_a, &t.i_beta_a),
        omega_m: t.omega_m_rad_s.clone(),
        tau_load: Some(t.tau_load_nm.clone()),
    }
}

/// The trial as a case: motor file, training and held-out recordings, nothing else.
pub fn case_of(trial: &Trial) -> DiagnosisCase {
    let motor = MotorFile::parse(&trial.motor_toml, "motor.toml").expect("the simulator writes valid motor files");
    let train: Vec<Recording> = trial.train.iter().enumerate().map(|(k, t)| recording(&format!("train{}", k + 1), t)).collect();
    DiagnosisCase::new(motor, &train, Some(&recording("holdout", &trial.holdout)))
}

/// How a trial ended.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// What was hidden.
    pub hidden: Vec<&'static str>,
    /// The verdict.
    pub verdict: Verdict,
    /// The effects named, in order.
    pub named: Vec<&'static str>,
    /// For each, its rivals.
    pub alternatives: Vec<Vec<&'static str>>,
    /// Change that the effects make, rms in noise standard deviations over currents and speed, larger of the training recordings.
    pub change: f64,
    /// Held-out error of the refitted base model and of the final one, in noise floors.
    pub holdout: (f64, f64),
    /// The hidden effects' detectable size over predicted size in the first round: above one they cannot be seen.
    pub visible: Vec<bool>,
    /// The whole answer.
    pub diagnosis: Diagnosis,
}

impl Outcome {
    /// Whether exactly what was hidden was named.
    pub fn exact(&self) -> bool {
        let sorted = |v: &[&'static str]| {
            let mut v = v.to_vec();
            v.sort_unstable();
            v
        };
        sorted(&self.hidden) == sorted(&self.named)
    }

    /// Whether a hidden effect was named, or is among the rivals of one named, first.
    pub fn first_right(&self) -> bool {
        self.named
            .first()
            .is_some_and(|n| self.hidden.contains(n) || self.alternatives[0].iter().any(|a| self.hidden.contains(a)))
    }

    /// Named effects that are not there, rivals not counted.
    pub fn false_additions(&self) -> usize {
        self.named
            .iter()
            .zip(&self.alternatives)
            .filter(|(n, a)| !self.hidden.contains(n) && !a.iter().any(|x| self.hidden.contains(x)))
            .count()
    }
}

/// Simulates and diagnoses one case.
///
/// # Errors
/// The text of what the tool refused.
pub fn run(case: &Case) -> Result<Outcome, String> {
    let trial = simulate(case);
    let diagnosis = diagnose(case_of(&trial), Options::default()).map_err(|e| e.to_string())?;
    let hidden: Vec<&'static str> = case.effects.iter().map(|(k, _)| k.name()).collect();
    let last = &diagnosis.steps[diagnosis.steps.len() - 1];
    let error = |s: &im_diagnose::diagnosis::Step| s.holdout.as_ref().map_or(f64::NAN, |e| e.chi2_per_sample);
    let change = [Part::Train1, Part::Train2].into_iter().map(|p| case.change(p).total()).fold(0.0, f64::max);
    let visible = hidden
        .iter()
        .map(|h| diagnosis.ranking.iter().find(|c| c.effect.name() == *h).is_some_and(|c| c.score > c.threshold))
        .collect();
    Ok(Outcome {
        verdict: diagnosis.verdict,
        named: diagnosis.effects.iter().map(|e| e.name()).collect(),
        alternatives: diagnosis.alternatives.iter().map(|a| a.iter().map(|e| e.name()).collect()).collect(),
        change: if hidden.is_empty() { 0.0 } else { change },
        holdout: (error(&diagnosis.steps[0]), error(last)),
        visible,
        hidden,
        diagnosis,
    })
}
