//! The parts that controllers are made of, for those who make their own: nothing panics; what was checked works in finite numbers.

use im_control::modulation::{DeadTimeCompensation, ZeroSequence, duty_cycles, dwell_times};
use im_control::{
    FieldWeakening, LoadTorqueEstimate, LoadTorqueObserver, ReferenceShaper, RotorFlux, RotorFluxModel, Shaped, SpeedRegulator,
};
use im_identify::online::{Range, sign_law};

use super::*;

fn steps<T: Scalar>(f: &Fields, x: &[f64; 6]) -> Result<(), TestCaseError> {
    let mut f = f.clone();
    let c = |k: usize| T::from_f64(x[k]);
    let right = f.are_all_right();
    // Inputs of anything: no panic; of usual sizes: finite.
    let mut finite = true;
    for (odd, [a, b, d, h]) in [(true, [c(0), c(1), c(2), c(3)]), (false, [50.0, 60.0, 300.0, H].map(T::from_f64))] {
        let shaper = ReferenceShaper { bandwidth_rad_s: f.or(100.0), acceleration_max_rad_s2: f.or(500.0) };
        let mut shaped = Shaped::at(a);
        shaper.step(&mut shaped, b, h);
        let regulator = SpeedRegulator { bandwidth_rad_s: f.or(40.0), inertia_kg_m2: f.or(0.03) };
        let mut integral = T::zero();
        let torque = regulator.step(&mut integral, &shaped, a, T::from_f64(40.0), h);
        let weakening = FieldWeakening { bandwidth_per_s: f.or(15.0), voltage_share: f.or(0.9) };
        let mut limit = T::one();
        let flux = weakening.step(&mut limit, T::one(), a, b, d, h);
        let (mut load, mut rotor) = (LoadTorqueEstimate::default(), RotorFlux::default());
        let observer = LoadTorqueObserver {
            inertia_kg_m2: f.or(0.03),
            viscous_friction_nm_s_per_rad: f.or(0.001),
            bandwidth_per_s: f.or(100.0),
            limit_nm: f.or(50.0),
        };
        observer.step(&mut load, b, a, h);
        let model =
            RotorFluxModel { rotor_inductance_h: f.or(0.16), mutual_inductance_h: f.or(0.156), pole_pairs: T::from_f64(2.0) };
        model.step(&mut rotor, f.or(0.9), Complex::new(a, b), a, h);
        let checked = shaper.validate().is_ok() && regulator.validate().is_ok() && weakening.validate().is_ok();
        finite &= odd || !checked || is_finite(&[shaped.speed, shaped.rate, torque, flux]);
        finite &= odd || !right || is_finite(&[load.torque_nm, rotor.flux_vs.re, rotor.flux_vs.im]);
    }
    prop_assert!(finite, "{f:?}");
    let _ = sign_law(c(0), c(1), c(2));
    if let Ok(range) = Range::try_new("range", c(0), c(1)) {
        prop_assert!(is_finite(&[range.project(c(2))]));
    }
    for zero in [ZeroSequence::None, ZeroSequence::Centred, ZeroSequence::Low, ZeroSequence::High] {
        let d = duty_cycles(Complex::new(c(0), c(1)), c(2), zero).duty;
        prop_assert!(d.iter().all(|x| *x >= T::zero() && *x <= T::one()));
    }
    let w = dwell_times(Complex::new(c(0), c(1)), c(2));
    prop_assert!([w.first, w.second, w.zero].iter().all(|x| *x >= T::zero() && *x <= T::one()));
    let dead_time = DeadTimeCompensation {
        dead_time_s: c(0),
        switching_period_s: c(1),
        drop_v: c(2),
        on_resistance_ohm: c(3),
        soft_current_a: c(4),
    };
    if dead_time.validate().is_ok() {
        let u = dead_time.voltage(vector(3.0, -4.0), T::from_f64(560.0));
        prop_assert!(is_finite(&[u.re, u.im]), "{dead_time:?}");
    }
    Ok(())
}

proptest! {
    #![proptest_config(cases())]
    #[test]
    fn parts_take_anything(f in fields(), x in [odd(), odd(), odd(), odd(), odd(), odd()]) {
        steps::<f64>(&f, &x)?;
        steps::<f32>(&f, &x)?;
    }
}
