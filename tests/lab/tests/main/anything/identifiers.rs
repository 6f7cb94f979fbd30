//! im-identify on-line: settings of every identifier, and a step with anything.

use im_identify::online::{
    DeadZone, Estimate, Fixed, Follower, FollowerGains, Identifier, KenneResistances, KenneRotorResistance, KenneSettings,
    Lambda, Range, RegulationParameters, ResistancesSettings, Sample, SchemeSettings, TimeScale, TimeVarying, TimeVaryingGain,
};

use super::*;

fn finite<T: Scalar, const N: usize>(e: &Estimate<T, N>) -> bool {
    is_finite(&e.values) && is_finite(&e.excitation.of_each) && is_finite(&[e.excitation.smallest])
}

/// Thirty milliseconds of a turning field, some samples odd.
fn runs<T: Scalar, const N: usize>(identifier: &impl Identifier<T, N, Input = Sample<T>>, bad: &[f64; 5]) -> bool {
    let mut state = identifier.start();
    (0..300).all(|k| {
        let (s, c) = (0.0314 * f64::from(k)).sin_cos();
        let good = Sample { i_s: vector(8.0 * s, -8.0 * c), u_s: vector(300.0 * c, 300.0 * s), omega_m: T::from_f64(100.0) };
        let spoilt = Sample { i_s: vector(bad[0], bad[1]), u_s: vector(bad[2], bad[3]), omega_m: T::from_f64(bad[4]) };
        finite(&identifier.step(&mut state, if k % 70 == 60 { &spoilt } else { &good }))
    })
}

fn kenne<T: Scalar>(f: &Fields, bad: &[f64; 5]) -> Result<(), TestCaseError> {
    let mut f = f.clone();
    let w = super::machines::windings::<T>(&mut f);
    let r = M.parameters().rotor_resistance_ohm;
    let Ok(range_ohm) = Range::try_new("range_ohm", f.or(0.3 * r), f.or(3.0 * r)) else { return Ok(()) };
    let rotor = KenneSettings {
        high_gain_per_s: f.or(500.0),
        sliding_gain_a_per_s2: f.or(1e6),
        averaging_time_s: f.or(1e-3),
        rate_ohm_per_s: f.or(10.0 * r),
        boundary_layer_ohm: f.or(0.0),
        range_ohm,
        start_ohm: f.or(0.8 * r),
        least_rotor_current_rate_a_per_s: f.or(50.0),
        excitation_window_s: f.or(0.05),
    };
    let h: T = f.or(H);
    if let Ok(i) = KenneRotorResistance::try_new(&w, M.pole_pairs, &rotor, h) {
        prop_assert!(runs(&i, bad), "{rotor:?} {w:?} {h:?}");
    }
    let both = ResistancesSettings {
        rotor,
        stator_rate_ohm_per_s: f.or(5.0),
        stator_boundary_layer_ohm: f.or(0.0),
        stator_range_ohm: range_ohm,
        least_excitation: f.or(1e-3),
    };
    if let Ok(i) = KenneResistances::try_new(&w, M.pole_pairs, &both, h) {
        prop_assert!(runs(&i, bad), "{both:?} {w:?} {h:?}");
    }
    Ok(())
}

fn jadot<T: Scalar>(f: &Fields, bad: &[f64; 5], constant: bool) -> Result<(), TestCaseError> {
    let mut f = f.clone();
    let p = RegulationParameters::<f64>::from(M.parameters().inverse_gamma()).values();
    let start = RegulationParameters::from_values(p.map(|x| f.or(x)));
    let gains = FollowerGains {
        pole_pairs: M.pole_pairs,
        current_proportional_ohm: f.or(7.0),
        current_integral_per_s: f.or(790.0),
        lambda: if constant { Lambda::Constant(f.or(0.01)) } else { Lambda::Scheduled },
        sample_time_s: f.or(H),
    };
    let right = SchemeSettings::<T>::full(RegulationParameters::from_values(p.map(T::from_f64)), T::from_f64(H));
    let settings = SchemeSettings {
        start,
        ranges: if constant { right.ranges } else { SchemeSettings::full(start, T::from_f64(H)).ranges },
        weights: std::array::from_fn(|_| f.or(1.0)),
        dead_zone: Some(DeadZone { least_turn: f.or(4.0), least_slip: f.or(0.25) }),
        least_regressor_v: f.or(2.0),
        excitation_window_s: f.or(1.0),
        sample_time_s: gains.sample_time_s,
    };
    let rate: T = f.or(100.0);
    if let Some(i) = Fixed::try_new(start).ok().and_then(|a| Follower::try_new(gains, a).ok()) {
        prop_assert!(runs(&i, bad), "{gains:?} {start:?}");
    }
    if let Some(i) = TimeScale::try_new(&settings, f.or(0.6)).ok().and_then(|a| Follower::try_new(gains, a).ok()) {
        prop_assert!(runs(&i, bad), "{gains:?} {settings:?}");
    }
    for gain in [
        TimeVaryingGain::Constant { per_v_a_s: rate },
        TimeVaryingGain::Normalized { frequency_rad_s: rate },
        TimeVaryingGain::NormalizedWithoutLeakage { rate_ohm_per_s: rate },
    ] {
        let made = TimeVarying::with_gain(&settings, gain, f.or(0.0)).ok().and_then(|a| Follower::try_new(gains, a).ok());
        if let Some(i) = made {
            prop_assert!(runs(&i, bad), "{gain:?} {gains:?} {settings:?}");
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(cases())]
    #[test]
    fn identifiers_are_refused_or_run(f in fields(), bad in [odd(), odd(), odd(), odd(), odd()], constant in any::<bool>()) {
        kenne::<f64>(&f, &bad)?;
        kenne::<f32>(&f, &bad)?;
        jadot::<f64>(&f, &bad, constant)?;
        jadot::<f32>(&f, &bad, constant)?;
    }
}
