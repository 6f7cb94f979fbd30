//! im-model: parameters, ratings, effects, machines and a step of each.

use im_model::{Bench, Dual, EffectId, Effects, Machine, PlantInput, Rating, Scalar, State, TParameters, WindingParameters};

use super::*;

fn parameters<T: Scalar>(f: &mut Fields) -> TParameters<T> {
    let p = M.parameters();
    TParameters {
        stator_resistance_ohm: f.or(p.stator_resistance_ohm),
        rotor_resistance_ohm: f.or(p.rotor_resistance_ohm),
        stator_leakage_inductance_h: f.or(p.stator_leakage_inductance_h),
        rotor_leakage_inductance_h: f.or(p.rotor_leakage_inductance_h),
        magnetizing_inductance_h: f.or(p.magnetizing_inductance_h),
        inertia_kg_m2: f.or(p.inertia_kg_m2),
        viscous_friction_nm_s_per_rad: f.or(p.viscous_friction_nm_s_per_rad),
    }
}

pub(super) fn windings<T: Scalar>(f: &mut Fields) -> WindingParameters<T> {
    let w = M.windings;
    WindingParameters {
        stator_resistance_ohm: f.or(w.stator_resistance_ohm),
        rotor_resistance_ohm: f.or(w.rotor_resistance_ohm),
        stator_inductance_h: f.or(w.stator_inductance_h),
        rotor_inductance_h: f.or(w.rotor_inductance_h),
        mutual_inductance_h: f.or(w.mutual_inductance_h),
        inertia_kg_m2: f.or(w.inertia_kg_m2),
        viscous_friction_nm_s_per_rad: f.or(w.viscous_friction_nm_s_per_rad),
    }
}

pub(super) fn rating(f: &mut Fields) -> Rating {
    Rating {
        torque_nm: f.or(M.rating.torque_nm),
        electrical_frequency_hz: f.or(M.rating.electrical_frequency_hz),
        phase_voltage_peak_v: f.or(M.rating.phase_voltage_peak_v),
        rotor_flux_vs: f.or(M.rating.rotor_flux_vs),
    }
}

/// A machine that was taken has finite constants in any form, and takes a sample in finite numbers where it can be followed.
fn works<T: Scalar>(machine: &Machine<T>) -> bool {
    let w = machine.parameters().windings();
    let d = w.derived(machine.pole_pairs());
    let g = machine.parameters().inverse_gamma();
    let constants =
        [d.sigma, d.eta, d.beta, d.gamma, d.mu, d.sigma_l_s, d.eta_l_m, g.leakage_inductance_h, g.rotor_resistance_ohm];
    let mut bench = Bench::new(machine, State::default(), T::from_f64(H));
    let followed = bench.plant().followed(H).is_ok();
    for _ in 0..3 {
        bench.advance(&PlantInput::new(vector(300.0, -50.0), T::from_f64(1.0)));
    }
    let o = bench.output();
    is_finite(&constants) && (!followed || is_finite(&[o.i_s.re, o.i_s.im, o.omega_m]))
}

proptest! {
    #![proptest_config(cases())]
    #[test]
    fn machines_are_refused_or_finite(f in fields(), pole_pairs in select(vec![0u32, 1, 2, 50, 100, 101, u32::MAX])) {
        if let Ok(machine) = Machine::base(parameters::<f64>(&mut f.clone()), pole_pairs) {
            prop_assert!(works(&machine), "{machine:?}");
            prop_assert!(works(&machine.cast::<Dual<2>>()), "{machine:?}");
        }
        if let Ok(machine) = Machine::base(parameters::<f32>(&mut f.clone()), pole_pairs) {
            prop_assert!(works(&machine), "{machine:?}");
        }
    }

    #[test]
    fn windings_and_ratings_are_refused_or_finite(f in fields()) {
        let w = windings::<f64>(&mut f.clone());
        if w.validate().is_ok() {
            let d = w.derived(M.pole_pairs);
            prop_assert!(is_finite(&[d.sigma, d.eta, d.beta, d.gamma, d.mu]) && w.to_t().is_ok_and(|t| is_finite(&[t.magnetizing_inductance_h])));
        }
        let r = rating(&mut f.clone());
        if r.validate().is_ok() {
            let p = M.parameters();
            prop_assert!(is_finite(&[r.current_peak_a(&p, M.pole_pairs), r.synchronous_speed_rad_s(M.pole_pairs)]), "{r:?}");
        }
    }

    /// Every effect with odd parameters.
    #[test]
    fn effects_are_refused_or_finite(effect in select(EffectId::ALL.to_vec()), f in fields()) {
        let mut f = f;
        let mut effects = Effects::none();
        for (k, info) in effect.parameters().iter().enumerate() {
            let right = (info.typical.0 * info.typical.1).sqrt() * M.rating.unit_of(info.scale, &M.parameters(), M.pole_pairs);
            effects.set(effect, k, f.or(if right.is_finite() { right } else { info.default }));
        }
        if let Ok(machine) = Machine::try_new(M.parameters(), M.pole_pairs, effects) {
            prop_assert!(works(&machine), "{machine:?}");
        }
    }

    /// A step that gets no numbers does not panic, and a new state works.
    #[test]
    fn a_step_takes_anything(x in [odd(), odd(), odd(), odd(), odd()]) {
        let machine = Machine::base(M.parameters(), M.pole_pairs).unwrap();
        let mut bench = Bench::new(&machine, State::turning(x[4]), H);
        let input = PlantInput {
            imposed_speed: (x[3] > 0.0).then_some([x[3], x[4]]),
            speed_nudge: (x[3] < 0.0).then_some([x[4], x[3]]),
            ..PlantInput::new(vector(x[0], x[1]), x[2])
        };
        for _ in 0..3 {
            bench.advance(&input);
            let _ = bench.output();
        }
        *bench.state_mut() = State::default();
        bench.advance(&PlantInput::new(vector(300.0, -50.0), 1.0));
        let o = bench.output();
        prop_assert!(is_finite(&[o.i_s.re, o.i_s.im, o.omega_m]));
    }
}
