//! The electrical side alone, where everything together is not explained.
//!
//! With the load torque taken as unknown the measured speed drives the machine, and the balance of torques is not used. Effects that explain the
//! currents then are missing whatever is wrong at the shaft. If they explain everything together as well, nothing is wrong there; else what the balance
//! asks of the load is held against the torque column.

use im_identify::offline::{Experiment, Load};
use im_model::EffectId;
use serde::Serialize;
use serde_json::{Value, json};

use super::{Diagnosis, Step, Verdict, decide};
use crate::case::Case;
use crate::loads::Found;
use crate::search::{Learning, Options, Refinement, UNEXPLAINED};
use crate::torque_column::TorqueColumn;

/// Simulations that its search may take: what takes more is as a rule not explained.
const MOST_WORK: f64 = 1000.0;

/// What the electrical side alone says.
#[derive(Clone, Debug, PartialEq)]
pub struct ElectricalSide {
    /// Its verdict.
    pub verdict: Verdict,
    /// The effects that explain it.
    pub effects: Vec<EffectId>,
    /// For each, those that explain it as well.
    pub alternatives: Vec<Vec<EffectId>>,
    /// χ²/N of the refitted base model and of the last one, the larger of training and held-out recordings.
    pub error: [f64; 2],
    /// The torque column against what currents and speed ask for, where there is one and the currents are explained.
    pub torque_column: Option<TorqueColumn>,
    /// Where no column holds the load: the torque that currents and speed ask for in its place.
    pub load: Option<AskedLoad>,
}

/// A load torque that currents and speed ask for, of all recordings together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AskedLoad {
    /// Mean, Nm.
    pub mean_nm: f64,
    /// Least, Nm.
    pub least_nm: f64,
    /// Largest, Nm.
    pub most_nm: f64,
    /// It was said that there is none.
    pub none_was_said: bool,
}

impl AskedLoad {
    /// Said where the load alone is more than what counts as unexplained of what is missed.
    fn of(d: &Diagnosis, found: &Diagnosis) -> Option<Self> {
        let error = |d: &Diagnosis| d.steps.last().map_or(f64::INFINITY, Step::error);
        if error(found) > UNEXPLAINED * error(d) {
            return None;
        }
        let all: Vec<&Found> = found.loads.found.iter().map(|f| &f.found).collect();
        let means: Vec<f64> = all.iter().filter_map(|f| f.mean()).collect();
        let ranges = || all.iter().filter_map(|f| f.range());
        let [least_nm, most_nm] =
            [ranges().map(|r| r.0).fold(f64::INFINITY, f64::min), ranges().map(|r| r.1).fold(f64::NEG_INFINITY, f64::max)];
        let none_was_said = d.case.all().all(|e| e.load == Load::Known);
        let mean_nm = means.iter().sum::<f64>() / means.len() as f64;
        (least_nm <= most_nm).then_some(Self { mean_nm, least_nm, most_nm, none_was_said })
    }
}

/// The diagnosis of the electrical side of a case, which everything together does not explain; nothing where the speed was not measured beside a load
/// that was taken as known.
pub(super) fn alone(d: &Diagnosis, options: &Options) -> Option<Diagnosis> {
    let Case { motor, train, holdout } = &d.case;
    if d.verdict != Verdict::Unexplained || d.case.all().any(Experiment::speed_is_imposed) {
        return None;
    }
    let driven = |e: &Experiment| e.clone().driven_by_speed();
    let case = Case { motor: motor.clone(), train: train.iter().map(driven).collect(), holdout: holdout.as_ref().map(driven) };
    if !case.all().all(Experiment::speed_is_imposed) {
        return None;
    }
    let options = Options { most_work: MOST_WORK, learning: Learning::Never, ..options.clone() };
    let (loop_, base) = Refinement::new(case, options).ok()?;
    decide(loop_, base, None).ok()
}

impl ElectricalSide {
    /// Of a case that everything together does not explain.
    pub(super) fn of(d: &Diagnosis, alone: &Diagnosis) -> Option<Self> {
        let last = alone.steps.last()?;
        let explained = alone.verdict != Verdict::Unexplained;
        let has_column = d.case.all().any(|e| e.load == Load::Known && e.tau_load.iter().any(|t| *t != 0.0));
        let column = || TorqueColumn::of(&last.machine, &alone.case.train, &last.starts);
        let torque_column = (explained && has_column).then(column).flatten();
        let load = if has_column { None } else { AskedLoad::of(d, alone) };
        let alternatives = alone.named().iter().map(|e| alone.rivals(*e).to_vec()).collect();
        let error = [&alone.steps[0], last].map(Step::error);
        Some(Self { verdict: alone.verdict, effects: alone.named().to_vec(), alternatives, error, torque_column, load })
    }

    /// As it stands in `diagnosis.json`.
    pub fn to_json(&self) -> Value {
        let names = |v: &[EffectId]| v.iter().map(|e| e.name()).collect::<Vec<_>>();
        json!({
            "verdict": self.verdict.name(),
            "named": names(&self.effects),
            "alternatives": self.effects.iter().zip(&self.alternatives).map(|(e, a)| (e.name().to_owned(), json!(names(a)))).collect::<serde_json::Map<_, _>>(),
            "rms_in_sigma": self.error.map(f64::sqrt),
            "torque_column": self.torque_column,
            "load": self.load,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use im_model::simulation::{Scenario, Simulation};
    use im_model::{MotorFile, Recording};

    use super::*;
    use crate::diagnosis::diagnose;

    const MOTOR: &str = "[machine]\nname = \"m\"\npole_pairs = 2\n[machine.parameters]\nstator_resistance_ohm = 1.5\nrotor_resistance_ohm = 0.9\n\
        stator_leakage_inductance_h = 0.004\nrotor_leakage_inductance_h = 0.004\nmagnetizing_inductance_h = 0.156\ninertia_kg_m2 = 0.03\n\
        viscous_friction_nm_s_per_rad = 0.002\n[machine.rating]\ntorque_nm = 26.0\nelectrical_frequency_hz = 50.0\n\
        phase_voltage_peak_v = 326.6\nrotor_flux_vs = 0.95\n";
    const SCENARIO: &str = "[scenario]\nname = \"start\"\nduration_s = 0.8\nsample_time_s = 2e-4\n[mains]\nvoltage_peak_v = 326.6\n\
        frequency_hz = 50\nclosing_s = 0.02\n[load]\ntorque_nm = [[0, 0], [0.35, 0], [0.35, 10], [0.55, 10], [0.55, 20]]\n[sensors]\n\
        current_noise_a = 0.05\nspeed_noise_rad_s = 0.1\nseed = 1\n";

    /// A load that was said not to be there is asked for by currents and speed.
    #[test]
    fn a_load_that_was_denied_is_found() {
        let motor = MotorFile::parse(MOTOR, "motor.toml").unwrap();
        let scenario = Scenario::parse(SCENARIO, "scenario.toml", Path::new("")).unwrap();
        let run = Simulation::new(&motor.machine, &scenario).run().unwrap().recording;
        let denied = Recording { tau_load: Some(vec![0.0; run.u_s.len()]), ..run };
        let d = diagnose(Case::new(motor, &[denied], None), Options { most_work: MOST_WORK, ..Options::default() }).unwrap();
        assert_eq!(d.verdict, Verdict::Unexplained);
        let alone = d.electrical_side.unwrap();
        let load = alone.load.expect("a load");
        assert!(load.none_was_said && alone.torque_column.is_none(), "{alone:?}");
        // No load, 10 and 20 Nm, the last without end: 10 Nm or so in the mean.
        assert!((5.0..12.0).contains(&load.mean_nm) && load.most_nm > 19.0, "{load:?}");
    }

    /// What a search does not come to itself, here for want of work, is found by way of the currents.
    #[test]
    fn effects_that_explain_the_currents_are_tried_on_everything_together() {
        let motor = MotorFile::parse(MOTOR, "motor.toml").unwrap();
        let scenario = Scenario::parse(SCENARIO, "scenario.toml", Path::new("")).unwrap();
        let missing = [EffectId::LeakageFluxSaturation, EffectId::RotorSkinEffect];
        let machine = missing.iter().fold(motor.clone(), |m, e| m.with_usual(*e).unwrap()).machine;
        let run = Simulation::new(&machine, &scenario).run().unwrap().recording;
        let d = diagnose(Case::new(motor, &[run], None), Options { most_work: -1.0, ..Options::default() }).unwrap();
        let mut named = d.named().to_vec();
        named.sort();
        assert_eq!((d.verdict, named.as_slice()), (Verdict::MissingEffects, &missing[..]));
        assert!(d.electrical_side.is_none() && d.steps.last().unwrap().error() < 1.05);
    }
}
