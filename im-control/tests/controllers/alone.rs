//! Controllers without a drive around them: whatever is measured or asked for, the command is a number, and a good sample later all is well.

use im_control::{
    CurrentRegulator, DiscreteCurrent, FieldOriented, FieldOrientedGains, Kenne, KenneGains, MachineData, Regulated, Turning,
};
use im_model::machines::JADOT_TABLE_I;
use im_model::simulation::{Bridge, Command, Controller, Measured, Reference};
use im_model::space_vector::unit;
use im_model::{Complex, Machine, Scalar};
use proptest::prelude::*;

fn data<T: Scalar>() -> MachineData<T> {
    let machine = Machine::base(JADOT_TABLE_I.parameters(), JADOT_TABLE_I.pole_pairs).unwrap();
    MachineData::of(&machine, 25.0).cast()
}

/// Every kind, direct and indirect.
fn all<T: Scalar + 'static>() -> Vec<Box<dyn Controller<T>>> {
    let (data, c) = (data::<T>(), T::from_f64);
    let field = FieldOrientedGains::typical(&data, c(0.9), c(1e-4));
    vec![
        Box::new(FieldOriented::try_new(&data, &field).unwrap()),
        Box::new(FieldOriented::try_new(&data, &field.direct()).unwrap()),
        Box::new(Kenne::try_new(&data, &KenneGains::typical(&data, c(0.9), c(540.0), c(1e-4))).unwrap()),
    ]
}

fn measured<T: Scalar>(x: [f64; 7]) -> Measured<T> {
    let [a, b, w, ua, ub, dc, t] = x.map(T::from_f64);
    Measured { i_s: Complex::new(a, b), omega_m: w, u_s: Complex::new(ua, ub), dc_voltage_v: dc, sample_time_s: t }
}

fn reference<T: Scalar>(x: [f64; 3]) -> Reference<T> {
    let [omega_m, rotor_flux_vs, torque_nm] = x.map(T::from_f64);
    Reference { omega_m, rotor_flux_vs, torque_nm }
}

const GOOD: [f64; 7] = [5.0, 2.0, 100.0, 30.0, 7.0, 540.0, 1e-4];
const ASKED: [f64; 3] = [100.0, 0.9, 5.0];

fn anything() -> impl Strategy<Value = f64> {
    prop_oneof![
        prop::num::f64::ANY,
        prop::sample::select(vec![0.0, 5e-324, 1e-40, 1e19, 1e38, -1e300, f64::NAN, f64::INFINITY, f64::NEG_INFINITY]),
        -1e4..1e4f64,
    ]
}

fn finite<T: Scalar>(command: Command<T>) -> bool {
    let (Command::Voltage(x) | Command::Current(x)) = command;
    x.re.is_finite() && x.im.is_finite()
}

fn survives<T: Scalar + 'static>(bad: &[([f64; 7], [f64; 3])]) -> Result<(), TestCaseError> {
    for mut c in all::<T>() {
        for _ in 0..50 {
            c.step(&measured(GOOD), &reference(ASKED));
        }
        for (m, r) in bad {
            prop_assert!(finite(c.step(&measured(*m), &reference(*r))), "{m:?} {r:?}");
        }
        for _ in 0..3 {
            prop_assert!(finite(c.step(&measured(GOOD), &reference(ASKED))), "after {bad:?}");
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn no_sample_makes_a_command_that_is_no_number(
        bad in prop::collection::vec((prop::array::uniform7(anything()), prop::array::uniform3(anything())), 1..6)
    ) {
        survives::<f64>(&bad)?;
        survives::<f32>(&bad)?;
    }
}

/// One bad sample leaves the state as it is: the commands after it are those without it.
#[test]
fn a_lost_sample_is_forgotten() {
    for (k, _) in all::<f64>().iter().enumerate() {
        let run = |spoilt: bool| {
            let mut c = all::<f64>().swap_remove(k);
            for _ in 0..200 {
                c.step(&measured(GOOD), &reference(ASKED));
            }
            if spoilt {
                let bad = [f64::NAN, 2.0, 100.0, 30.0, 7.0, 540.0, 1e-4];
                c.step(&measured(bad), &reference([f64::NAN; 3]));
            }
            let (Command::Voltage(x) | Command::Current(x)) = c.step(&measured(GOOD), &reference(ASKED));
            x
        };
        assert_eq!(run(true), run(false));
    }
}

/// What a current regulator is told at a sample: direction, ω_s, dc link, sampling time, current wanted and measured, emf.
type Told = [f64; 11];

/// Sixty samples of each law at a machine's leakage and resistance behind a bridge of 540 V, then the bad ones, then 600 good ones: what is refused leaves the last
/// voltage standing, what is not is of numbers, and the current is where it was.
fn regulates<T: Scalar>(bad: &[Told], discrete: bool) -> Result<(), TestCaseError> {
    const H: f64 = 1e-4;
    let c = T::from_f64;
    let vector = |re: f64, im: f64| Complex::new(c(re), c(im));
    let law = CurrentRegulator::of(&data::<T>(), c(H));
    let (l, r) = (law.leakage_inductance_h.value(), law.resistance_ohm.value());
    let (wanted, emf) = (Complex::new(5.0, 9.0), Complex::new(-4.0, 120.0));
    let (mut x, mut state) = (vector(0.0, 0.0), DiscreteCurrent::default());
    let (mut i, mut held, mut odd) = (Complex::new(0.0, 0.0), Complex::new(0.0, 0.0), false);
    let bridge = Bridge::ideal(540.0);
    for k in 0..60 + bad.len() + 600 {
        let direction = unit(0.03 * k as f64);
        let seen = i * direction.conj();
        let good = [direction.re, direction.im, 300.0, 540.0, H, wanted.re, wanted.im, seen.re, seen.im, emf.re, emf.im];
        let told = k.checked_sub(60).and_then(|k| bad.get(k)).copied().unwrap_or(good);
        let [d_re, d_im, omega, dc, t, w_re, w_im, i_re, i_im, e_re, e_im] = told;
        let frame = Turning {
            direction: vector(d_re, d_im),
            omega_s: c(omega),
            dc_voltage_v: c(dc),
            sample_time_s: c(t),
            overmodulates: false,
        };
        let (w, now, e) = (vector(w_re, w_im), vector(i_re, i_im), vector(e_re, e_im));
        let before = x;
        let out = if discrete { state.step(&law, &frame, w, now, e) } else { law.step(&mut x, &frame, w, now, e) };
        if let Some(Regulated { u_s, .. }) = out {
            prop_assert!(told.iter().all(|x| !x.is_nan()), "{told:?}: {u_s:?}");
            held = Complex::new(u_s.re.value(), u_s.im.value());
            prop_assert!(held.norm() <= 1.5e6, "{told:?}: {u_s:?}");
        } else {
            // What an odd sample that was one foretold of the next may be wrong.
            prop_assert!(x == before && (told != good || odd), "refused: {told:?}");
        }
        odd = told != good;
        let made = bridge.limited(held);
        for step in 0..20 {
            let e = emf * direction * unit(0.03 * (f64::from(step) + 0.5) / 20.0);
            i += (made - i * r - e) * (H / l / 20.0);
        }
    }
    let off = (i * unit(-0.03 * (660 + bad.len()) as f64) - wanted).norm() / wanted.norm();
    prop_assert!(off < 0.01, "{off}: {i} after {bad:?}");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn a_current_regulator_refuses_what_is_no_sample_and_goes_on(
        bad in prop::collection::vec(prop::collection::vec(prop_oneof![2 => Just(None), 1 => anything().prop_map(Some)], 11), 1..8)
    ) {
        // Odd values among good ones.
        let good = [1.0, 0.0, 300.0, 540.0, 1e-4, 5.0, 9.0, 5.0, 9.0, -4.0, 120.0];
        let bad: Vec<Told> = bad.iter().map(|x| std::array::from_fn(|k| x[k].unwrap_or(good[k]))).collect();
        for discrete in [false, true] {
            regulates::<f64>(&bad, discrete)?;
            regulates::<f32>(&bad, discrete)?;
        }
    }
}
