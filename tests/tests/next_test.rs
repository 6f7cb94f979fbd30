//! A proposed test keeps the limits on the machine that is really there.

use im_diagnose::intake::LoadPlan;
use im_diagnose::next_test::{Limits, Sensing, propose};
use im_diagnose::worst_case::machines_after;
use im_model::simulation::{Scenario, Simulation};
use im_model::{EffectId, MotorFile};
use im_tests::hidden::{CatalogueMachine, EffectKind, Part, Strength, TrialCase};
use rayon::prelude::*;

/// `HIDDEN_MACHINES=200` tries as many.
#[test]
fn a_next_test_keeps_its_limits_on_hidden_machines() {
    let number = std::env::var("HIDDEN_MACHINES").ok().and_then(|n| n.parse().ok()).unwrap_or(6);
    let broken: Vec<String> = (0..number).into_par_iter().filter_map(beyond).collect();
    assert!(broken.is_empty(), "{} of {number} leave the limits:\n{}", broken.len(), broken.join("\n"));
}

/// What leaves the limits when the proposal for a motor up to 15 % wrong is run on the hidden machine.
fn beyond(k: usize) -> Option<String> {
    let library: Vec<EffectKind> = EffectKind::ALL.iter().copied().filter(|e| e.in_library() && !e.is_thermal()).collect();
    let hidden = library[k % library.len()];
    let other = library[(k / library.len() + k + 1) % library.len()];
    let case = TrialCase::new(k % CatalogueMachine::COUNT, &[(hidden, Strength::Strong)], 5000 + k as u64);
    let motor = MotorFile::parse(&case.nameplate().motor_toml("hidden"), "motor.toml").unwrap();
    let open: Vec<EffectId> = [hidden, other].iter().filter_map(|e| EffectId::from_name(e.name())).collect();
    let limits = Limits::default();
    let sensing = Sensing { current_a: 0.05, speed_rad_s: 0.1, load: LoadPlan::Known };
    let proposals = propose(&motor, &open, sensing, &limits, &machines_after(&motor, None, &open)).unwrap();
    let best = proposals.first()?;
    // The supply does not depend on the machine: what the model's simulation commands, the hidden machine gets.
    let scenario = Scenario::parse(&best.scenario_toml, "scenario.toml", std::path::Path::new("")).unwrap();
    let commanded = Simulation::new(&motor.machine, &scenario).run().unwrap().recording;
    let (alpha, beta): (Vec<f64>, Vec<f64>) = commanded.u_s.iter().map(|u| (u.re, u.im)).unzip();
    let load = commanded.tau_load.clone().unwrap_or_else(|| vec![0.0; alpha.len()]);
    let got = case.played(Part::Train1, [&alpha, &beta], &load, commanded.sample_time_s);
    let current = got.i_alpha_a.iter().zip(&got.i_beta_a).map(|(a, b)| a.hypot(*b)).fold(0.0, f64::max);
    let speed = got.omega_m_rad_s.iter().fold(0.0f64, |m, w| m.max(w.abs()));
    (current > best.limits.0 || speed > best.limits.1).then(|| {
        format!(
            "{} on m{}: {} reaches {current:.1} A of {:.1}, {speed:.1} rad/s of {:.1}",
            hidden.name(),
            case.machine,
            best.name,
            best.limits.0,
            best.limits.1
        )
    })
}
