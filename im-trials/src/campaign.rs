//! The hidden-effect campaign: trials of [`hidden`](crate::hidden) put before the diagnosing tool, which knows nothing of them.

use std::fmt::Write;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use im_diagnose::case::Case;
use im_diagnose::diagnosis::{Diagnosis, Step, Verdict, diagnose};
use im_diagnose::intake::LoadPlan;
use im_diagnose::intake::mapping::Begin;
use im_diagnose::search::Options;
use im_identify::offline::{ChannelKind, Experiment};
use im_model::{Complex, EffectId, MotorFile, Recording};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::hidden::{CatalogueMachine, EffectKind, Excitation, Noise, Part, Strength, Table, Trial, TrialCase, simulate};

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

/// What a bench has of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Knowledge {
    /// Voltage, current, speed and load torque.
    Whole,
    /// No load torque.
    WithoutLoad,
    /// No speed: the load torque turns the model.
    WithoutSpeed,
    /// Neither speed nor load torque.
    WithoutSpeedAndLoad,
}

/// The trial as a case: motor file, training and held-out recordings, nothing else.
pub fn case_of(trial: &Trial) -> Case {
    case_knowing(trial, Knowledge::Whole)
}

/// The same as a bench has it that has not measured everything.
pub fn case_knowing(trial: &Trial, knowledge: Knowledge) -> Case {
    let motor = MotorFile::parse(&trial.motor_toml, "motor.toml").expect("the simulator writes valid motor files");
    let run = |name: &str, t: &Table| {
        let mut e = Experiment::from_recording(&recording(name, t), [1.0; 2], 1.0);
        let plan = match knowledge {
            Knowledge::Whole | Knowledge::WithoutSpeed => LoadPlan::Known,
            Knowledge::WithoutLoad => LoadPlan::Unknown,
            Knowledge::WithoutSpeedAndLoad => LoadPlan::Unseen,
        };
        if matches!(knowledge, Knowledge::WithoutSpeed | Knowledge::WithoutSpeedAndLoad) {
            e.channels.retain(|c| c.kind != ChannelKind::Speed);
        }
        if plan != LoadPlan::Known {
            e.tau_load.fill(0.0);
        }
        (e, Begin::Auto, plan)
    };
    let train = trial.train.iter().enumerate().map(|(k, t)| run(&format!("train{}", k + 1), t)).collect();
    Case::of(motor, train, Some(run("holdout", &trial.holdout)))
}

/// How a trial ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Outcome {
    /// What was hidden.
    pub hidden: Vec<String>,
    /// The verdict.
    pub verdict: Verdict,
    /// The effects named, in order: none under `unexplained`.
    pub named: Vec<String>,
    /// For each, its rivals.
    pub alternatives: Vec<Vec<String>>,
    /// For each, its probability.
    pub probabilities: Vec<f64>,
    /// Change that the effects make, rms in noise standard deviations over currents and speed, larger of the training recordings.
    pub change: f64,
    /// Held-out error of the refitted base model and of the final one, χ²/N; at most [`BEYOND`].
    pub holdout: (f64, f64),
    /// Whether the first round sees each hidden effect: its score is past its threshold.
    pub visible: Vec<bool>,
}

/// Errors from here on are all the same, and what is no number is one of them: files of results hold numbers only.
pub const BEYOND: f64 = 1e300;

/// From this probability on an effect is said to be sure.
pub const SURE: f64 = 0.9;

impl Outcome {
    /// Whether exactly what was hidden was named, or of it what the library has a name for. A gain of the voltage and one of all currents are
    /// the same at every terminal: where both are hidden, that of the currents is both.
    pub fn exact(&self) -> bool {
        let [voltage, currents] = [EffectKind::VoltageGain, EffectKind::CurrentSensorGain].map(|k| k.name().to_owned());
        let shown = |v: &[String]| {
            let mut v = v.to_vec();
            if v.contains(&currents) {
                v.retain(|e| *e != voltage);
            }
            v.sort_unstable();
            v
        };
        let known = |h: &&String| EffectId::from_name(h).is_some();
        let mut nameable: Vec<String> = self.hidden.iter().filter(known).cloned().collect();
        if nameable.is_empty() {
            nameable.clone_from(&self.hidden);
        }
        shown(&nameable) == shown(&self.named)
    }

    /// Whether a hidden effect was named, or is among the rivals of one named, first.
    pub fn first_right(&self) -> bool {
        self.named
            .first()
            .is_some_and(|n| self.hidden.contains(n) || self.alternatives[0].iter().any(|a| self.hidden.contains(a)))
    }

    /// Named effects that are not there, rivals not counted.
    pub fn false_additions(&self) -> usize {
        self.are_there().filter(|there| !there).count()
    }

    /// Of the effects that are named with a probability of [`SURE`] or more, how many are there, and how many there are.
    pub fn sure(&self) -> (usize, usize) {
        let sure = || self.are_there().zip(&self.probabilities).filter(|(_, p)| **p >= SURE);
        (sure().filter(|(there, _)| *there).count(), sure().count())
    }

    /// For each effect named, whether it or one of its rivals is there.
    fn are_there(&self) -> impl Iterator<Item = bool> {
        let named = self.named.iter().zip(&self.alternatives);
        named.map(|(n, a)| self.hidden.contains(n) || a.iter().any(|x| self.hidden.contains(x)))
    }
}

/// Simulates and diagnoses one case: how it ended, and the whole answer.
///
/// # Errors
/// The text of what the tool refused.
pub fn run(case: &TrialCase) -> Result<(Outcome, Diagnosis), String> {
    run_knowing(case, Knowledge::Whole)
}

/// The same by a bench that has not measured everything.
///
/// # Errors
/// As [`run`].
pub fn run_knowing(case: &TrialCase, knowledge: Knowledge) -> Result<(Outcome, Diagnosis), String> {
    let trial = simulate(case);
    let diagnosis = diagnose(case_knowing(&trial, knowledge), Options::default()).map_err(|e| e.to_string())?;
    let hidden: Vec<String> = case.effects.iter().map(|(k, _)| k.name().into()).collect();
    let last = &diagnosis.steps[diagnosis.steps.len() - 1];
    let error = |s: &Step| s.holdout.as_ref().map_or(BEYOND, |e| e.chi2_per_sample).min(BEYOND);
    let change = [Part::Train1, Part::Train2].into_iter().map(|p| case.change(p).total()).fold(0.0, f64::max);
    let visible = hidden
        .iter()
        .map(|h| diagnosis.ranking.iter().find(|c| c.effect.name() == *h).is_some_and(|c| c.score > c.threshold))
        .collect();
    let names = |effects: &[EffectId]| effects.iter().map(|e| e.name().into()).collect();
    let probability = |e: &EffectId| diagnosis.course.posterior.of(*e);
    let outcome = Outcome {
        verdict: diagnosis.verdict,
        named: names(diagnosis.named()),
        alternatives: diagnosis.named().iter().map(|e| names(diagnosis.rivals(*e))).collect(),
        probabilities: diagnosis.named().iter().map(probability).collect(),
        change: if hidden.is_empty() { 0.0 } else { change.min(BEYOND) },
        holdout: (error(&diagnosis.steps[0]), error(last)),
        visible,
        hidden,
    };
    Ok((outcome, diagnosis))
}

/// One trial of the campaign.
#[derive(Clone, Debug)]
pub struct Planned {
    /// Its place in the plan, from 0: the same for any number of seeds that has it.
    pub index: usize,
    /// The row of the table that it counts in.
    pub group: &'static str,
    /// What is hidden, in words.
    pub name: String,
    /// The case.
    pub case: TrialCase,
}

impl Planned {
    /// Whether a word tells of it: its group, a hidden effect, or the machine (`m7`).
    pub fn is(&self, word: &str) -> bool {
        self.group == word || self.name.split(' ').any(|w| w == word) || format!("m{}", self.case.machine) == word
    }
}

/// A finished trial: a line of the results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Finished {
    /// Its place in the plan.
    pub trial: usize,
    /// The row of the table that it counts in.
    pub group: String,
    /// What is hidden, in words.
    pub name: String,
    /// The time it took, s.
    pub took_s: f64,
    /// How it ended, or why the tool refused it.
    pub outcome: Result<Outcome, String>,
}

impl Finished {
    /// Whether it is this trial of the plan.
    pub fn is_of(&self, planned: &Planned) -> bool {
        (self.trial, self.group.as_str(), &self.name) == (planned.index, planned.group, &planned.name)
    }
}

/// The rows of the table.
pub const GROUPS: [&str; 12] =
    ["strong", "medium", "weak", "clean", "coloured", "pairs", "triples", "outside", "ramp", "steady", "poor", "beside"];

/// Seeds as a command line names them: a number of them from 0, or `FIRST..END`.
pub fn seeds(argument: &str) -> Option<Range<u64>> {
    match argument.split_once("..") {
        Some((first, end)) => Some(first.parse().ok()?..end.parse().ok()?),
        None => Some(0..argument.parse().ok()?),
    }
}

/// The whole campaign: single effects of three strengths, machines of all sizes, clean runs with white and coloured noise, pairs, triples,
/// effects outside the library, and excitation that shows less: one ramp from rest to a constant speed ("ramp"), and nothing but the steady
/// state, of effects that have frequencies of their own there ("steady") and of those that only change the fundamental ("poor"); last a strong
/// effect of the library with a medium one outside it ("beside").
pub fn plan(seeds: Range<u64>) -> Vec<Planned> {
    let (library, outside): (Vec<EffectKind>, Vec<EffectKind>) = EffectKind::ALL.iter().partition(|k| k.in_library());
    let quick: Vec<EffectKind> = library.iter().copied().filter(|k| !k.is_thermal()).collect();
    let strengths = [("strong", Strength::Strong), ("medium", Strength::Medium), ("weak", Strength::Weak)];
    let mut out = Vec::new();
    for seed in seeds {
        let machine = |k: usize, stride: usize| (k * stride + 3 * seed as usize) % CatalogueMachine::COUNT;
        let mut add = |group, name: String, case| out.push(Planned { index: out.len(), group, name, case });
        for (k, kind) in EffectKind::ALL.iter().enumerate() {
            for (group, strength) in strengths {
                let m = machine(k, 5) + group.len();
                let case = TrialCase::new(m % CatalogueMachine::COUNT, &[(*kind, strength)], 100 + seed);
                add(if kind.in_library() { group } else { "outside" }, format!("{} {group}", kind.name()), case);
            }
        }
        for m in 0..CatalogueMachine::COUNT {
            add("clean", "nothing".into(), TrialCase::new(m, &[], 300 + seed));
            let mut case = TrialCase::new(m, &[], 400 + seed);
            case.noise = Noise::coloured(0.9);
            add("coloured", "nothing".into(), case);
        }
        for (k, &first) in quick.iter().enumerate() {
            let other = |step: usize| quick[(k + step + seed as usize) % quick.len()];
            let a = if other(3) == first { other(4) } else { other(3) };
            let Some(b) = (7..7 + quick.len()).map(other).find(|b| *b != first && *b != a) else { continue };
            let two = [(first, Strength::Strong), (a, Strength::Medium)];
            add("pairs", format!("{} + {}", first.name(), a.name()), TrialCase::new(machine(k, 7), &two, 500 + seed));
            let three = [two[0], two[1], (b, Strength::Medium)];
            let name = format!("{} + {} + {}", first.name(), a.name(), b.name());
            add("triples", name, TrialCase::new(machine(k, 3), &three, 600 + seed));
        }
        for (k, &kind) in quick.iter().enumerate() {
            let still = if kind.has_frequencies_of_its_own() { "steady" } else { "poor" };
            for (group, excitation) in [("ramp", Excitation::Ramp), (still, Excitation::Steady)] {
                let mut case = TrialCase::new(machine(k, 5), &[(kind, Strength::Medium)], 700 + seed);
                case.excitation = excitation;
                add(group, kind.name().into(), case);
            }
        }
        for (k, &kind) in quick.iter().enumerate() {
            let cause = outside[(k + 5 * seed as usize) % outside.len()];
            let two = [(kind, Strength::Strong), (cause, Strength::Medium)];
            add("beside", format!("{} + {}", kind.name(), cause.name()), TrialCase::new(machine(k, 11), &two, 800 + seed));
        }
    }
    out
}

/// Runs trials on all cores. Each that ends is given to `tell`, one at a time, with the whole answer if there is one; an error of `tell` ends
/// the campaign.
///
/// # Errors
/// The first error of `tell`.
pub fn run_all<E: Send>(
    planned: &[Planned],
    tell: impl FnMut(&Planned, &Finished, Option<&Diagnosis>) -> Result<(), E> + Send,
) -> Result<(), E> {
    let tell = Mutex::new(tell);
    planned.par_iter().with_max_len(1).try_for_each(|p| {
        let begun = Instant::now();
        let (outcome, answer) = run(&p.case).map_or_else(|e| (Err(e), None), |(outcome, answer)| (Ok(outcome), Some(answer)));
        let took_s = begun.elapsed().as_secs_f64();
        let finished = Finished { trial: p.index, group: p.group.into(), name: p.name.clone(), took_s, outcome };
        let mut tell = tell.lock().unwrap_or_else(PoisonError::into_inner);
        tell(p, &finished, answer.as_ref())
    })
}

/// The table over finished trials, one row per group, in Markdown; trials that the tool refused are counted in a column of their own.
pub fn table(finished: &[Finished]) -> String {
    let mut out = String::from(
        "| trials of | number | refused | named first | exact | with a false effect | adequate | confounded | inconclusive | unexplained | held out before | after | after, worst tenth |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for group in GROUPS {
        let all: Vec<&Finished> = finished.iter().filter(|f| f.group == group).collect();
        if all.is_empty() {
            continue;
        }
        let of: Vec<&Outcome> = all.iter().filter_map(|f| f.outcome.as_ref().ok()).collect();
        let count = |f: &dyn Fn(&Outcome) -> bool| of.iter().filter(|o| f(o)).count();
        let verdict = |v| count(&|o| o.verdict == v);
        let part = |q: f64, of_one: &dyn Fn(&Outcome) -> f64| {
            let mut v: Vec<f64> = of.iter().map(|o| of_one(o)).collect();
            v.sort_by(f64::total_cmp);
            let at = (v.len().saturating_sub(1) as f64 * q).round() as usize;
            v.get(at).map_or_else(|| "–".to_owned(), |x| if *x < 1e4 { format!("{x:.2}") } else { format!("{x:.0e}") })
        };
        let _ = writeln!(
            out,
            "| {group} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |",
            all.len(),
            all.len() - of.len(),
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
    let sure = finished.iter().filter_map(|f| f.outcome.as_ref().ok()).map(Outcome::sure);
    let (there, all) = sure.fold((0, 0), |(a, b), (there, all)| (a + there, b + all));
    if all > 0 {
        let percent = 100.0 * there as f64 / all as f64;
        let _ =
            writeln!(out, "\nOf {all} effects named with a probability of {SURE} or more, {there} are there: {percent:.1} %.");
    }
    out
}
