//! What is wrong is refused, with the quantity, its value and the bound in the message.

use im_model::effects::Role;
use im_model::machines::MOTULATOR_2_2_KW;
use im_model::{BaseParameter, Bound, EffectId, Effects, Machine, ModelError, ParameterId, TParameters};

use crate::lab;

#[test]
fn bad_base_parameters_are_refused_by_name() {
    for (parameter, bad) in [
        (BaseParameter::MagnetizingInductance, -0.2),
        (BaseParameter::StatorLeakageInductance, 0.0),
        (BaseParameter::Inertia, 0.0),
        (BaseParameter::RotorResistance, f64::NAN),
        (BaseParameter::StatorResistance, f64::INFINITY),
        (BaseParameter::ViscousFriction, -1e-3),
        // What no machine has.
        (BaseParameter::StatorResistance, 1e-20),
        (BaseParameter::MagnetizingInductance, 1e-308),
        (BaseParameter::Inertia, 1e20),
    ] {
        let error = lab::base().with(&[(ParameterId::Base(parameter), bad)]).unwrap_err();
        let ModelError::OutOfBounds { quantity, value, bound } = error else { panic!("{error}") };
        assert_eq!((quantity, value.to_bits()), (parameter.key(), bad.to_bits()));
        let text = error.to_string();
        assert!(text.contains(parameter.key()) && text.contains(&bound.to_string()), "{text}");
        let plain = format!("{bad}");
        assert!(text.contains(&plain) || text.contains(&format!("{bad:e}")), "{text}");
    }
}

#[test]
fn windings_coupled_more_than_perfectly_are_refused() {
    let mut w = MOTULATOR_2_2_KW.windings;
    w.mutual_inductance_h = w.stator_inductance_h;
    let error = w.to_t().unwrap_err();
    assert!(matches!(error, ModelError::CouplingNotPhysical { squared, product } if squared >= product), "{error}");
}

#[test]
fn pole_pairs_are_bounded() {
    let p: TParameters<f64> = MOTULATOR_2_2_KW.parameters();
    assert!(Machine::base(p, 0).unwrap_err().to_string().starts_with("pole_pairs = 0 must be from 1 to 100"));
}

/// Every parameter of every effect, just beyond each end of its bound, and NaN.
#[test]
fn effects_out_of_bounds_are_refused_by_name() {
    for &id in EffectId::ALL {
        for (k, info) in id.parameters().iter().enumerate() {
            let mut bad = vec![f64::NAN, f64::INFINITY];
            match info.bound {
                Bound::Positive => bad.extend([0.0, -1.0]),
                Bound::NotNegative => bad.push(-1e-9),
                Bound::Whole(a, b) => bad.extend([-1.0, f64::from(a) + 0.5, f64::from(b) + 1.0]),
                Bound::Within(a, b) | Bound::OfMachines(a, b) => {
                    bad.extend([a - 1e-6 * (1.0 + a.abs()), b + 1e-6 * (1.0 + b.abs())])
                }
            }
            for value in bad {
                let mut e = Effects::none();
                e.set(id, k, value);
                let error = lab::base().with_effects(e).unwrap_err();
                let ModelError::OutOfBounds { quantity, value: got, bound } = error else { panic!("{error}") };
                assert_eq!((quantity, got.to_bits(), bound), (info.key, value.to_bits(), info.bound), "{id}");
            }
            // Defaults and typical sizes are within their own bounds.
            let scale = lab::MACHINE.rating.unit_of(info.scale, &MOTULATOR_2_2_KW.parameters(), 2);
            for size in [info.typical.0, info.typical.1] {
                info.bound.check(info.key, size * scale).unwrap();
            }
            assert!(info.role == Role::Strength || info.bound.check(info.key, info.default * scale).is_ok(), "{id}");
        }
    }
}
