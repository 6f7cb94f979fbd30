//! Whether what no library holds is learned: trials of effects outside it, of effects inside it, and of nothing at all, with a diagnosis that may
//! learn curves.
//!
//! The truth is judged by *place*: the quantity and the variable that a free-form effect of the kind would have, named or among the rivals of
//! one named.

use std::ops::Range;
use std::time::Instant;

use im_diagnose::diagnosis::{Diagnosis, Step, Verdict, diagnose};
use im_diagnose::search::{Learning, Options};
use im_model::EffectId;
use im_model::effects::{Acts, Over};

use crate::campaign::{BEYOND, case_of};
use crate::hidden::{CatalogueMachine, EffectKind, Noise, Sampling, Strength, TrialCase, simulate};

/// The places that are right for a kind outside the library; none for one inside.
pub fn places(kind: EffectKind) -> &'static [(Acts, Over)] {
    use EffectKind as E;
    match kind {
        E::CoggingTorque | E::CamLoad => &[(Acts::Torque, Over::ShaftAngle)],
        E::EddyCurrentBrake => &[(Acts::Torque, Over::Speed)],
        E::ColdGrease => &[(Acts::Friction, Over::Time), (Acts::Torque, Over::Time)],
        E::LooseConnector => &[(Acts::StatorResistance, Over::Time)],
        E::OpenRingJoint => &[(Acts::RotorResistance, Over::Time)],
        E::DcLinkSag => &[(Acts::Voltage, Over::Current)],
        E::Overmodulation => &[(Acts::Voltage, Over::Speed)],
        E::SupplyDip => &[(Acts::Voltage, Over::Time)],
        E::CrossSaturation => &[(Acts::LeakageCurrent, Over::Flux)],
        E::EccentricEncoder => &[(Acts::SpeedSensor, Over::ShaftAngle)],
        E::BentTachogenerator => &[(Acts::SpeedSensor, Over::Speed)],
        E::RotorSlotting => &[(Acts::MagnetizingCurrent, Over::ShaftAngle)],
        E::MagneticAnisotropy => &[(Acts::MagnetizingCurrent, Over::FluxDirection)],
        E::HysteresisLoss => &[(Acts::LossCurrent, Over::Flux), (Acts::LossCurrent, Over::Speed)],
        E::CurrentSensorSaturation => &[(Acts::CurrentSensor, Over::Current)],
        E::SlowCurrentSensor => &[(Acts::CurrentSensor, Over::Lag)],
        _ => &[],
    }
}

/// One trial.
#[derive(Clone, Debug)]
pub struct Planned {
    /// The row of the table that it counts in: `weak`, `medium` or `strong` of what lies outside, `library`, `clean`.
    pub group: &'static str,
    /// What is hidden.
    pub kind: Option<EffectKind>,
    /// The case.
    pub case: TrialCase,
}

/// The rows of the table.
pub const GROUPS: [&str; 5] = ["strong", "medium", "weak", "library", "clean"];

/// The campaign of some seeds: every kind outside the library in three strengths, every quick kind inside it, and clean runs.
pub fn plan(seeds: Range<u64>) -> Vec<Planned> {
    let strengths = [("strong", Strength::Strong), ("medium", Strength::Medium), ("weak", Strength::Weak)];
    let mut out = Vec::new();
    for seed in seeds {
        let machine = |k: usize| (k + 3 * seed as usize) % CatalogueMachine::COUNT;
        for (k, &kind) in EffectKind::ALL.iter().enumerate() {
            if !places(kind).is_empty() {
                for (s, &(group, strength)) in strengths.iter().enumerate() {
                    let case = TrialCase::new(machine(4 * s + 5 * k), &[(kind, strength)], 1100 + seed);
                    out.push(Planned { group, kind: Some(kind), case: sparse(case) });
                }
            } else if !kind.is_thermal() {
                let case = TrialCase::new(machine(3 * k), &[(kind, Strength::Strong)], 1200 + seed);
                out.push(Planned { group: "library", kind: Some(kind), case: sparse(case) });
            }
        }
        for m in 0..CatalogueMachine::COUNT {
            let mut case = TrialCase::new(m, &[], 1300 + seed);
            if m % 2 == 1 {
                case.noise = Noise::coloured(0.9);
            }
            out.push(Planned { group: "clean", kind: None, case: sparse(case) });
        }
    }
    out
}

/// Half the rows of the other campaign: a curve has many parameters, and a fit of them takes its time.
fn sparse(case: TrialCase) -> TrialCase {
    TrialCase { sampling: Some(Sampling { sample_s: 2e-4, duration_s: 2.0 }), ..case }
}

/// How a trial ended.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The verdict.
    pub verdict: Verdict,
    /// The effects of the refined model, each with its rivals.
    pub effects: Vec<(EffectId, Vec<EffectId>)>,
    /// Held-out error of the refitted base model and of the final one, χ²/N.
    pub holdout: (f64, f64),
    /// The time it took, s.
    pub took_s: f64,
}

impl Outcome {
    /// Whether a place is learned, or a rival of what is named.
    pub fn right(&self, kind: EffectKind) -> bool {
        let is = |e: &EffectId| e.free_form().is_some_and(|f| places(kind).contains(&(f.acts(), f.over())));
        self.effects.iter().any(|(e, rivals)| is(e) || rivals.iter().any(is))
    }

    /// Whether an effect of the library is named, or a rival of what is named.
    pub fn names(&self, kind: EffectKind) -> bool {
        let is = |e: &EffectId| e.name() == kind.name();
        self.effects.iter().any(|(e, rivals)| is(e) || rivals.iter().any(is))
    }

    /// Whether any curve is learned.
    pub fn learned(&self) -> bool {
        self.effects.iter().any(|(e, _)| e.free_form().is_some())
    }

    /// The part of the held-out excess over the noise that is left; a base model without any leaves none.
    pub fn left(&self) -> f64 {
        let (before, after) = self.holdout;
        if before <= 1.0 { 0.0 } else { ((after - 1.0) / (before - 1.0)).max(0.0) }
    }
}

/// Simulates and diagnoses one case.
///
/// # Errors
/// The text of what the tool refused.
pub fn run(case: &TrialCase, learning: Learning) -> Result<(Outcome, Diagnosis), String> {
    let begun = Instant::now();
    let options = Options { learning, ..Options::default() };
    let d = diagnose(case_of(&simulate(case)), options).map_err(|e| e.to_string())?;
    let error = |s: &Step| s.holdout.as_ref().map_or(BEYOND, |e| e.chi2_per_sample).min(BEYOND);
    let effects = d.effects.iter().copied().zip(d.alternatives.iter().cloned()).collect();
    let holdout = (error(&d.steps[0]), error(&d.steps[d.steps.len() - 1]));
    Ok((Outcome { verdict: d.verdict, effects, holdout, took_s: begun.elapsed().as_secs_f64() }, d))
}
