//! What may be free, by how much, and within which limits.

use super::*;
use im_model::EffectId;
use im_model::effects::Role;

#[test]
fn search_variables_move_quantities_by_factors_or_amounts_and_stop_at_limits() {
    let log = Free {
        target: Target::Machine(vec![id(BaseParameter::Inertia)]),
        transform: Transform::Log,
        limits: (0.5, 4.0),
        priors: Vec::new(),
    };
    assert!((log.value(2.0, 0.1) - 2.0 * 0.1f64.exp()).abs() < 1e-15 && log.slope(2.0) == 2.0);
    assert_eq!((log.value(2.0, 5.0), log.value(2.0, -5.0)), (4.0, 0.5));
    let linear = Free { transform: Transform::Linear(0.25), ..log.clone() };
    assert_eq!((linear.value(2.0, 2.0), linear.value(2.0, -2.0), linear.slope(2.0)), (2.5, 1.5, 0.25));
    let names: Vec<String> = start_parameters(&[odd().0], &M.rating, false).iter().map(Free::name).collect();
    assert_eq!(names[0], "initial psi_s_alpha_Vs of run 1");
    assert_eq!(names[4], "initial omega_m_rad_s of run 1");
    // Effects: strengths by amounts from zero on, shapes that are positive by factors near what is usual.
    for effect in EffectId::ALL {
        for f in effect_parameters(*effect, &truth(), &M.rating) {
            let (low, high) = f.limits;
            assert!(low < high, "{}: {low} {high}", f.name());
            if f.transform == Transform::Log {
                assert!(low > 0.0 && high / low >= 16.0 - 1e-9, "{}: {low} {high}", f.name());
            }
        }
    }
}

/// Strengths and shapes, nothing else; limits are what the model takes, and a step of one unit of a strength is its typical size.
#[test]
fn what_is_free_of_an_effect_stays_where_the_model_takes_it() {
    let mut by_factors = 0;
    for effect in EffectId::ALL {
        let free = effect_parameters(*effect, &truth(), &M.rating);
        let infos = effect.parameters();
        let wanted = infos.iter().enumerate().filter(|(_, i)| matches!(i.role, Role::Strength | Role::Shape));
        assert_eq!(
            free.iter().map(|f| f.id().unwrap()).collect::<Vec<_>>(),
            wanted.map(|(k, _)| ParameterId::Effect(*effect, k)).collect::<Vec<_>>()
        );
        for f in &free {
            let Some(ParameterId::Effect(_, k)) = f.id() else { panic!("{}", f.name()) };
            let info = &infos[k];
            let unit = M.rating.unit_of(info.scale, &M.parameters(), M.pole_pairs);
            let (low, high) = f.limits;
            for p in [low, high].into_iter().filter(|p| p.abs() < 1e6) {
                info.bound.check("limit", p).unwrap_or_else(|e| panic!("{}: {e}", f.name()));
            }
            match f.transform {
                Transform::Log => {
                    by_factors += 1;
                    // All that is typical can be reached, and a factor beyond it where the model takes that.
                    let within = |p: f64, beyond: f64| info.bound.check("beyond", beyond).is_err() || p == beyond;
                    assert!(info.role == Role::Shape && info.typical.0 > 0.0, "{}", f.name());
                    assert!(
                        within(low, 0.25 * info.typical.0 * unit) && within(high, 4.0 * info.typical.1 * unit),
                        "{}",
                        f.name()
                    );
                }
                Transform::Linear(step) => {
                    assert!(info.role == Role::Strength || info.typical.0 <= 0.0, "{}", f.name());
                    assert!((step / (info.typical.1 * unit) - 1.0).abs() < 1e-12, "{}: {step}", f.name());
                    // As far as the model goes: what lies beyond is refused.
                    for beyond in [low - 1e-3 * step, high + 1e-3 * step].into_iter().filter(|p| p.abs() < 1e6) {
                        assert!(info.bound.check("beyond", beyond).is_err(), "{}: {beyond}", f.name());
                    }
                }
            }
        }
    }
    assert!(by_factors >= 8, "{by_factors}");
}

/// Friction moves by amounts that brake the machine in ten seconds, from none on; all else of the circuit by factors, the leakages by one.
#[test]
fn base_parameters_are_six_and_five_where_nothing_accelerates() {
    use BaseParameter as P;
    let free = base_parameters(&truth());
    let ids: Vec<Vec<_>> = free
        .iter()
        .map(|f| match &f.target {
            Target::Machine(ids) => ids.clone(),
            Target::Initial { .. } => vec![],
        })
        .collect();
    let wanted: [&[P]; 6] = [
        &[P::StatorResistance],
        &[P::RotorResistance],
        &[P::StatorLeakageInductance, P::RotorLeakageInductance],
        &[P::MagnetizingInductance],
        &[P::Inertia],
        &[P::ViscousFriction],
    ];
    assert_eq!(ids, wanted.map(|ps| ps.iter().map(|p| id(*p)).collect::<Vec<_>>()));
    assert_eq!(free[2].name(), format!("{} and {}", ids[2][0], ids[2][1]));
    assert!(free[..5].iter().all(|f| f.transform == Transform::Log && f.limits.0 > 0.0));
    assert_eq!((free[5].transform, free[5].limits.0), (Transform::Linear(M.parameters().inertia_kg_m2 / 10.0), 0.0));
    let run = experiment(&recording(false));
    let table = Experiment { supply_frequency_hz: Some(50.0), ..run.clone() };
    let count = |e: &[Experiment]| base_parameters_in(&truth(), e).len();
    assert_eq!([count(std::slice::from_ref(&run)), count(&[table.clone(), run]), count(&[table])], [6, 6, 5]);
}
