//! im-model: windings, ratings and a step.

use im_model::{Bench, Machine, PlantInput, Rating, Scalar, State, WindingParameters};

use super::*;

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

proptest! {
    #![proptest_config(cases())]
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
