//! What the tests of the controllers share.

use im_model::simulation::{Command, Controller, Inverter, Load, Measured, Profile, Reference, References, Scenario, Source};
use im_model::{Bench, Complex, Machine, PlantInput, State, machines};
use proptest::prelude::*;

use crate::MachineData;

const M: machines::NamedMachine = machines::JADOT_TABLE_I;
const T: f64 = 1e-4;

/// So many cases, or as many as `PROPTEST_CASES` says.
pub(crate) fn cases(few: u32) -> ProptestConfig {
    let standard = ProptestConfig::default();
    if std::env::var_os("PROPTEST_CASES").is_some() { standard } else { ProptestConfig { cases: few, ..standard } }
}

/// A controller that follows a speed at a flux, sampled every 100 µs.
pub(crate) fn scenario(speed: Profile, flux: f64, load: Profile, duration_s: f64, dc_voltage_v: Option<f64>) -> Scenario {
    Scenario {
        source: Source::Controller {
            name: "the one of the test".into(),
            observer: None,
            references: References { speed_rad_s: speed, rotor_flux_vs: flux.into(), torque_nm: 0.0.into() },
        },
        inverter: Inverter::Averaged { dc_voltage_v },
        load: Load { torque_nm: load, quadratic_nm_s2: 0.0 },
        ..Scenario::direct_on_line(0.0, 50.0, duration_s)
    }
}

/// The same through points of speed and load, at 0.9 Vs and 560 V.
pub(crate) fn through(speed: &[[f64; 2]], load: &[[f64; 2]], duration_s: f64) -> Scenario {
    let [speed, load] = [speed, load].map(|p| Profile::points(p).unwrap());
    scenario(speed, 0.9, load, duration_s, Some(560.0))
}

/// Numbers as a fault leaves them, and some good ones.
pub(crate) fn anything() -> impl Strategy<Value = f64> {
    prop_oneof![
        prop::num::f64::ANY,
        prop::sample::select(vec![0.0, 1e38, -1e300, f64::MAX, f64::NAN, f64::INFINITY, f64::NEG_INFINITY]),
        -1e3..1e3f64,
    ]
}

/// At 80 rad/s the controller is shown bad samples (current, voltage, speed, speed asked for); every command is of numbers and within the link, and after three good
/// seconds the machine is at its speed.
pub(crate) fn comes_back<C: Controller<f64>>(
    make: impl Fn(&MachineData<f64>) -> C,
    bad: &[[f64; 6]],
) -> Result<(), TestCaseError> {
    let machine = Machine::base(M.parameters(), M.pole_pairs).unwrap();
    let known = MachineData::of(&machine, 1.5 * M.rating.current_peak_a(&M.parameters(), M.pole_pairs));
    let mut controller = make(&known);
    let mut bench = Bench::new(&machine, State::default(), T);
    let mut u_s = Complex::new(0.0, 0.0);
    for k in 0..50_000 {
        let o = bench.output();
        let mut m = Measured { i_s: o.i_s, omega_m: o.omega_m, u_s, dc_voltage_v: 560.0, sample_time_s: T };
        let mut r = Reference { omega_m: if k < 3000 { 0.0 } else { 80.0 }, rotor_flux_vs: 0.9, torque_nm: 0.0 };
        if let Some(x) = (k as usize).checked_sub(15_000).and_then(|k| bad.get(k)) {
            m.i_s = Complex::new(x[0], x[1]);
            m.u_s = Complex::new(x[2], x[3]);
            (m.omega_m, r.omega_m) = (x[4], x[5]);
        }
        let Command::Voltage(u) = controller.step(&m, &r) else { panic!("gives voltages") };
        prop_assert!(u.norm() <= 560.0 * 2.0 / 3.0 + 1e-6, "{k}: {u}");
        u_s = u;
        bench.advance(&PlantInput::new(u, 2.0));
        if k == 14_999 {
            let w = bench.output().omega_m;
            prop_assert!((w - 80.0).abs() < 2.0, "before: {w}");
        }
    }
    let w = bench.output().omega_m;
    prop_assert!((w - 80.0).abs() < 2.0, "{w}");
    Ok(())
}
