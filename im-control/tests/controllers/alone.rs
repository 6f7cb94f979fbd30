//! Controllers without a drive around them: whatever is measured or asked for, the command is a number, and a good sample later all is well.

use im_control::{FieldOriented, FieldOrientedGains, Kenne, KenneGains, MachineData};
use im_model::machines::JADOT_TABLE_I;
use im_model::simulation::{Command, Controller, Measured, Reference};
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
