//! Effects that are off leave the base machine alone, bit for bit; single precision follows double.

use im_model::effects::Role;
use im_model::{Bench, Complex, EffectId, Machine, PlantInput, Scalar, State};
use proptest::prelude::*;

use crate::lab::{self, Supply};

/// Currents and speeds of a start with a load step.
fn start<T: Scalar>(m: &Machine<T>, samples: usize) -> Vec<[f64; 3]> {
    let mut bench = Bench::new(m, State::default(), T::from_f64(lab::T));
    let supply = Supply::rated_flux(50.0);
    let each = |k| {
        let u = supply.mean(k);
        let tau = if k < samples / 2 { 1.0 } else { 8.0 };
        bench.advance(&PlantInput::new(Complex::new(T::from_f64(u.re), T::from_f64(u.im)), T::from_f64(tau)));
        let y = bench.output();
        [y.i_s.re.value(), y.i_s.im.value(), y.omega_m.value()]
    };
    (0..samples).map(each).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn at_strength_zero_the_base_machine_remains_bit_for_bit(places in prop::collection::vec(0.0..1.0f64, 16 * EffectId::ALL.len())) {
        let off = lab::machine(|e| {
            let mut places = places.into_iter();
            for &id in EffectId::ALL {
                for (k, info) in id.parameters().iter().enumerate() {
                    let place = places.next().unwrap();
                    if info.role != Role::Strength {
                        let (lo, hi) = info.typical;
                        let size = (lo + (hi - lo) * place) * lab::MACHINE.rating.unit_of(info.scale, &lab::MACHINE.parameters(), 2);
                        e.set(id, k, if info.role == Role::Order { size.round() } else { size });
                    }
                }
            }
        });
        let bits = |run: Vec<[f64; 3]>| -> Vec<[u64; 3]> { run.into_iter().map(|y| y.map(f64::to_bits)).collect() };
        prop_assert!(bits(start(&off, 300)) == bits(start(&lab::base(), 300)));
    }
}

#[test]
fn single_precision_follows_double() {
    let all = lab::machine(|e| {
        for &id in EffectId::ALL {
            // The iron's and the bars' short times are as in the benchmark: one step per sample in both precisions.
            lab::set_typical(e, id, 0.3);
        }
    });
    for m in [lab::base(), all] {
        let (double, single) = (start(&m, 3000), start(&m.cast::<f32>(), 3000));
        for (a, b) in double.iter().zip(&single) {
            // 24 bits are 6e-8; thousands of samples and the angle (tens of radians) leave 1e-3 of an inrush of 40 A.
            assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 0.04, "{a:?} {b:?}");
            assert!((a[2] - b[2]).abs() < 0.05, "{a:?} {b:?}");
        }
    }
}

/// What begins at another angle of the shaft runs otherwise with those effects that say they are fixed to it, and with no other.
#[test]
fn effects_fixed_to_the_shaft_say_so() {
    for &id in EffectId::ALL {
        let m = lab::machine(|e| {
            lab::set_typical(e, id, 0.9);
        });
        let run = |theta_m: f64| {
            let mut bench = Bench::new(&m, State { theta_m, ..State::default() }, lab::T);
            let supply = Supply::rated_flux(50.0);
            (0..1000).for_each(|k| bench.advance(&PlantInput::new(supply.mean(k), 5.0)));
            let y = bench.output();
            (y.i_s, y.omega_m)
        };
        assert_eq!(run(0.0) != run(0.7), id.about().fixed_to_shaft, "{id}");
    }
}
