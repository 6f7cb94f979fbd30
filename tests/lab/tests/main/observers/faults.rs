//! Bad input: the state stays finite, the estimate says that it is not valid, and good samples bring it back.

use im_lab::observation::{C, Truth, basis, every_observer, machine, volts_per_hertz};
use im_model::machines::{JADOT_TABLE_I, MOTULATOR_2_2_KW};
use im_observers::{Estimate, Input, ObserverStatus};
use proptest::prelude::*;

fn finite(e: &Estimate<f64>) -> bool {
    [e.rotor_flux_vs.re, e.rotor_flux_vs.im, e.omega_m, e.torque_nm, e.residual_a.re, e.residual_a.im]
        .iter()
        .all(|x| x.is_finite())
}

fn running() -> Truth {
    let m = JADOT_TABLE_I;
    Truth::of(&machine(&m), &volts_per_hertz(&m, 40.0, 8.0, 2.5))
}

#[test]
fn a_fault_is_named_and_good_samples_bring_the_estimate_back() {
    let truth = running();
    let m = JADOT_TABLE_I;
    type Spoil = fn(&Input<f64>) -> Input<f64>;
    let faults: [(&str, Spoil, ObserverStatus); 6] = [
        ("NaN current", |x| Input { i_s: C::new(f64::NAN, x.i_s.im), ..*x }, ObserverStatus::CURRENT_LOST),
        ("infinite current", |x| Input { i_s: C::new(x.i_s.re, f64::INFINITY), ..*x }, ObserverStatus::CURRENT_LOST),
        ("current beyond the sensor", |x| Input { i_s: x.i_s * 1e3, ..*x }, ObserverStatus::CURRENT_LOST),
        ("lost sample", |x| Input { omega_m: x.omega_m, ..Input::lost(x.u_s) }, ObserverStatus::CURRENT_LOST),
        ("NaN voltage", |x| Input { u_s: C::new(f64::NAN, f64::NAN), ..*x }, ObserverStatus::VOLTAGE_LOST),
        ("saturated voltage", |x| Input { u_s: x.u_s * 2.0, ..*x }, ObserverStatus::VOLTAGE_LIMITED),
    ];
    for (fault, spoil, reason) in faults {
        for mut observer in every_observer(&machine(&m), &m.rating, basis(&m, 1e-4)) {
            let name = observer.name;
            // Ten bad samples at 2 s.
            let bad = truth.at(2.0)..truth.at(2.0) + 10;
            for k in 0..truth.len() {
                let good = truth.input(k);
                let e = observer.step(&if bad.contains(&k) { spoil(&good) } else { good });
                assert!(finite(&e), "{name}, {fault} at row {k}: {e:?}");
                if bad.contains(&k) {
                    assert!(e.status.contains(reason), "{name}, {fault}: {}", e.status);
                }
                if k == bad.end {
                    assert!(e.status.contains(ObserverStatus::SETTLING), "{name}, {fault}: {}", e.status);
                }
                if k == bad.start - 1 || k == truth.len() - 1 {
                    assert!(e.status.is_valid(), "{name}, {fault} at row {k}: {}", e.status);
                    assert!((e.omega_m - truth.omega[k]).abs() < 1.0, "{name}, {fault}: {} {}", e.omega_m, truth.omega[k]);
                }
            }
        }
    }
}

/// Derdiyok's flux is made of the voltage. While that is not to be believed it goes on with the rotor instead: 0.25 rad in ten samples at 40 Hz.
#[test]
fn a_voltage_that_is_not_believed_leaves_the_flux_turning() {
    let truth = running();
    let m = JADOT_TABLE_I;
    for mut observer in every_observer(&machine(&m), &m.rating, basis(&m, 1e-4)).into_iter().filter(|o| o.name == "Derdiyok") {
        let bad = truth.at(2.0)..truth.at(2.0) + 10;
        for k in 0..bad.end {
            let good = truth.input(k);
            // Measured currents are good; the voltage is a hundred times too large.
            let e = observer.step(&if bad.contains(&k) { Input { u_s: good.u_s * 100.0, ..good } } else { good });
            if k + 1 == bad.end {
                let off = (e.rotor_flux_vs - truth.flux[k]).norm() / truth.flux[k].norm();
                assert!(off < 0.03, "{}: {off}", observer.name);
            }
        }
    }
}

#[test]
fn without_flux_nothing_is_claimed() {
    let m = MOTULATOR_2_2_KW;
    for mut observer in every_observer(&machine(&m), &m.rating, basis(&m, 1e-4)) {
        for _ in 0..2000 {
            let e = observer.step(&Input::new(C::new(0.0, 0.0), C::new(0.0, 0.0)).with_speed(0.0));
            assert!(finite(&e) && e.status.contains(ObserverStatus::FLUX_LOW), "{}: {e:?}", observer.name);
        }
    }
}

#[test]
fn the_current_model_says_when_it_has_no_speed() {
    let truth = running();
    let m = JADOT_TABLE_I;
    let mut observer = every_observer(&machine(&m), &m.rating, basis(&m, 1e-4)).remove(0);
    for k in 0..truth.len() {
        let with = truth.input(k);
        let e = observer.step(&Input { omega_m: if k % 2 == 0 { None } else { Some(f64::NAN) }, ..with });
        assert!(finite(&e) && !e.status.is_valid());
    }
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        -1e3..1e3f64,
        Just(f64::NAN),
        Just(f64::INFINITY),
        Just(f64::NEG_INFINITY),
        Just(f64::MAX),
        Just(-f64::MAX),
        Just(f64::MIN_POSITIVE),
        Just(0.0),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Two hundred samples of anything at all, then the machine again: a second later every estimate is right.
    #[test]
    fn whatever_comes_in_the_state_stays_finite(garbage in prop::collection::vec((number(), number(), number(), number(), number()), 200)) {
        let m = JADOT_TABLE_I;
        for mut observer in every_observer(&machine(&m), &m.rating, basis(&m, 1e-4)) {
            for &(a, b, c, d, w) in &garbage {
                let e = observer.step(&Input::new(C::new(a, b), C::new(c, d)).with_speed(w));
                prop_assert!(finite(&e), "{}: {e:?}", observer.name);
            }
        }
    }
}

#[test]
fn after_garbage_the_machine_is_found_again() {
    let truth = running();
    let m = JADOT_TABLE_I;
    for mut observer in every_observer(&machine(&m), &m.rating, basis(&m, 1e-4)) {
        let name = observer.name;
        for k in 0..truth.len() {
            // Tenth of a second of nonsense at 1.2 s.
            let spoiled = (12_000..13_000).contains(&k);
            let x = (k as f64 * 0.7).sin() * 200.0;
            let input = if spoiled { Input::new(C::new(x, -2.0 * x), C::new(0.3 * x, x)).with_speed(x) } else { truth.input(k) };
            let e = observer.step(&input);
            assert!(finite(&e));
            if k == truth.len() - 1 {
                assert!(
                    e.status.is_valid() && (e.omega_m - truth.omega[k]).abs() < 1.5,
                    "{name}: {} {}",
                    e.status,
                    e.omega_m - truth.omega[k]
                );
            }
        }
    }
}
