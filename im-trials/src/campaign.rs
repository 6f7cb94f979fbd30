//! The hidden-effect campaign: trials of [`hidden`](crate::hidden) put before the diagnosing tool, which is told nothing.

use std::fmt::Write;
use std::time::{Duration, Instant};

use im_diagnose::case::Case as DiagnosisCase;
use im_diagnose::diagnosis::{Diagnosis, Verdict, diagnose};
use im_diagnose::refine::Options;
use im_model::{Complex, MotorFile, Recording};
use rayon::prelude::*;

use crate::hidden::{Case, EffectKind, Excitation, Machine, Noise, Part, Strength, Table, Trial, simulate};

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

/// One trial of the campaign.
#[derive(Clone, Debug)]
pub struct Planned {
    /// The row of the table that it counts in.
    pub group: &'static str,
    /// What is hidden, in words.
    pub name: String,
    /// The case.
    pub case: Case,
}

/// The rows of the table.
pub const GROUPS: [&str; 10] = ["strong", "medium", "weak", "clean", "coloured", "pairs", "triples", "outside", "poor", "steady"];

/// The whole campaign: single effects of three strengths, machines of all sizes, clean runs with white and coloured noise, pairs, triples,
/// effects outside the library, and excitation that shows little (constant speed, started from rest; and nothing but a steady state).
pub fn plan(seeds: u64) -> Vec<Planned> {
    let library: Vec<EffectKind> = EffectKind::ALL.iter().copied().filter(|k| k.in_library()).collect();
    let quick: Vec<EffectKind> = library.iter().copied().filter(|k| !k.is_thermal()).collect();
    let strengths = [("strong", Strength::Strong), ("medium", Strength::Medium), ("weak", Strength::Weak)];
    let mut out = Vec::new();
    for seed in 0..seeds {
        let machine = |k: usize, stride: usize| (k * stride + 3 * seed as usize) % Machine::COUNT;
        let mut add = |group, name: String, case| out.push(Planned { group, name, case });
        for (k, kind) in EffectKind::ALL.iter().enumerate() {
            for (group, strength) in strengths {
                let m = machine(k, 5) + group.len();
                let case = Case::new(m % Machine::COUNT, &[(*kind, strength)], 100 + seed);
                add(if kind.in_library() { group } else { "outside" }, format!("{} {group}", kind.name()), case);
            }
        }
        for m in 0..Machine::COUNT {
            add("clean", "nothing".into(), Case::new(m, &[], 300 + seed));
            let mut case = Case::new(m, &[], 400 + seed);
            case.noise = Noise::coloured(0.9);
            add("coloured", "nothing".into(), case);
        }
        for (k, &first) in quick.iter().enumerate() {
            let other = |step: usize| quick[(k + step + seed as usize) % quick.len()];
            let (a, b) = (other(3), other(7));
            let two = [(first, Strength::Strong), (a, Strength::Medium)];
            add("pairs", format!("{} + {}", first.name(), a.name()), Case::new(machine(k, 7), &two, 500 + seed));
            if a != b && b != first {
                let three = [two[0], two[1], (b, Strength::Medium)];
                let name = format!("{} + {} + {}", first.name(), a.name(), b.name());
                add("triples", name, Case::new(machine(k, 3), &three, 600 + seed));
            }
        }
        for (k, &kind) in quick.iter().enumerate() {
            for (group, excitation) in [("poor", Excitation::Poor), ("steady", Excitation::Steady)] {
                let mut case = Case::new(machine(k, 5), &[(kind, Strength::Medium)], 700 + seed);
                case.excitation = excitation;
                add(group, kind.name().into(), case);
            }
        }
    }
    out
}

/// Runs trials on all cores. `tell` gets each as it ends, with what came out and the time it took; those that the tool refused are left out
/// of what is returned.
pub fn run_all(
    planned: &[Planned],
    tell: impl Fn(&Planned, &Result<Outcome, String>, Duration) + Sync,
) -> Vec<(&Planned, Outcome)> {
    planned
        .par_iter()
        .filter_map(|p| {
            let begun = Instant::now();
            let outcome = run(&p.case);
            tell(p, &outcome, begun.elapsed());
            Some((p, outcome.ok()?))
        })
        .collect()
}

/// The table over finished trials, one row per group, in Markdown.
pub fn table(outcomes: &[(&Planned, Outcome)]) -> String {
    let mut out = String::from(
        "| trials of | number | named first | exact | with a false effect | adequate | confounded | inconclusive | unexplained | held out before | after | after, worst tenth |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for group in GROUPS {
        let of: Vec<&Outcome> = outcomes.iter().filter(|(p, _)| p.group == group).map(|(_, o)| o).collect();
        if of.is_empty() {
            continue;
        }
        let count = |f: &dyn Fn(&Outcome) -> bool| of.iter().filter(|o| f(o)).count();
        let verdict = |v| count(&|o| o.verdict == v);
        let part = |q: f64, of_one: &dyn Fn(&Outcome) -> f64| {
            let mut v: Vec<f64> = of.iter().map(|o| of_one(o)).collect();
            v.sort_by(f64::total_cmp);
            v[((v.len() - 1) as f64 * q).round() as usize]
        };
        let _ = writeln!(
            out,
            "| {group} | {} | {} | {} | {} | {} | {} | {} | {} | {:.2} | {:.2} | {:.2} |",
            of.len(),
            count(&|o| o.first_right()),
            count(&Outcome::exact),
            count(&|o| o.false_additions() > 0),
            verdict(Verdict::Adequate),
            verdict(Verdict::Confounded),
            verdict(Verdict::Inconclusive),
            verdict(Verdict::Unexplained),
            part(0.5, &|o| o.holdout.0),
            part(0.5, &|o| o.holdout.1),
            part(0.9, &|o| o.holdout.1),
        );
    }
    out
}
