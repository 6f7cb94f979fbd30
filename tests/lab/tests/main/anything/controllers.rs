//! im-control: a step of every controller with anything.

use im_control::jadot::JadotGains;
use im_control::kenne::KenneGains;
use im_control::{
    FieldOriented, FieldOrientedGains, FieldWeakening, Jadot, Kenne, MachineData, Mtpa, MtpaGains, MtpaLaw, Orientation,
    ReferenceShaper, Reports,
};
use im_identify::online::{Fixed, RegulationParameters};
use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::{Bench, Machine, PlantInput, State};

use super::*;

const DC_V: f64 = 560.0;

fn data() -> MachineData<f64> {
    MachineData { windings: M.windings, pole_pairs: M.pole_pairs, current_max_a: 25.0, voltage_delay_s: H }
}

fn field_oriented(orientation: Orientation<f64>) -> FieldOrientedGains<f64> {
    FieldOrientedGains {
        orientation,
        current_bandwidth_rad_s: 750.0,
        flux_bandwidth_rad_s: 30.0,
        speed_bandwidth_rad_s: 40.0,
        follows_torque: false,
        reference: ReferenceShaper { bandwidth_rad_s: 100.0, acceleration_max_rad_s2: 2000.0 },
        field_weakening: FieldWeakening { bandwidth_per_s: 15.0, voltage_share: 0.92 },
    }
}

/// What a controller sees and is asked for, some of it odd.
#[derive(Clone, Copy, Debug)]
struct Bad([f64; 9]);

impl Bad {
    fn sample<T: Scalar>(&self) -> (Measured<T>, Reference<T>) {
        let x = &self.0;
        let c = T::from_f64;
        let (omega_m, dc_voltage_v, sample_time_s) = (c(x[4]), c(x[5]), c(if x[6] > 0.0 { H } else { x[6] }));
        let m = Measured { i_s: vector(x[0], x[1]), u_s: vector(x[2], x[3]), omega_m, dc_voltage_v, sample_time_s };
        (m, Reference { omega_m: c(x[7]), rotor_flux_vs: c(x[8]), torque_nm: c(x[7]) })
    }
}

fn good<T: Scalar>(k: u32) -> (Measured<T>, Reference<T>) {
    let (s, c) = (0.0314 * f64::from(k)).sin_cos();
    let f = T::from_f64;
    let (omega_m, dc_voltage_v, sample_time_s) = (f(50.0), f(DC_V), f(H));
    let m = Measured { i_s: vector(8.0 * c, 8.0 * s), u_s: vector(100.0 * s, -100.0 * c), omega_m, dc_voltage_v, sample_time_s };
    (m, Reference { omega_m: f(60.0), rotor_flux_vs: f(0.9), torque_nm: f(5.0) })
}

/// A second and a half of a drive at 60 rad/s, its sample at one second bad: half a second later it is where it was.
fn comes_back(mut controller: impl Controller<f64> + Reports, bad: &Bad) -> Result<(), TestCaseError> {
    let machine = Machine::base(M.parameters(), M.pole_pairs).unwrap();
    let mut bench = Bench::new(&machine, State::default(), H);
    let (mut acting, mut next) = (vector(0.0, 0.0), vector(0.0, 0.0));
    let reference = Reference { omega_m: 60.0, rotor_flux_vs: M.rating.rotor_flux_vs, torque_nm: 0.0 };
    let mut before = None;
    for k in 0..15000 {
        let o = bench.output();
        let good = Measured { i_s: o.i_s, u_s: acting, omega_m: o.omega_m, dc_voltage_v: DC_V, sample_time_s: H };
        if k == 10000 {
            before = Some(controller.status());
        }
        let m = if k == 10000 { bad.sample().0 } else { good };
        let (Command::Voltage(u) | Command::Current(u)) = controller.step(&m, &reference);
        prop_assert!(is_finite(&[u.re, u.im]), "{k}: {u}");
        (acting, next) = (next, u);
        bench.advance(&PlantInput::new(acting, 5.0));
    }
    let (omega, status) = (bench.output().omega_m, controller.status());
    prop_assert!((omega - 60.0).abs() < 1.0 && Some(status) == before, "{omega} rad/s, {status}, {before:?} before");
    Ok(())
}

/// A current source that does what it is told: the current comes back.
fn current_comes_back(mut controller: impl Controller<f64> + Reports + Copy, bad: &Bad) -> Result<(), TestCaseError> {
    let mut other = controller;
    let mut i = [vector(0.0, 0.0); 2];
    for k in 0..4000 {
        for (c, (i, spoilt)) in [&mut controller, &mut other].into_iter().zip(i.iter_mut().zip([k == 1000, false])) {
            let (m, r) = good::<f64>(k);
            let m = if spoilt { bad.sample().0 } else { Measured { i_s: *i, ..m } };
            let (Command::Voltage(x) | Command::Current(x)) = c.step(&m, &r);
            prop_assert!(is_finite(&[x.re, x.im]));
            *i = x;
        }
    }
    let [a, b] = i.map(|i| i.norm());
    prop_assert!((a - b).abs() < 1e-3 * b && controller.status() == other.status(), "{a} A, {b} A");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases().cases / 4, ..cases() })]
    /// Bare, without a drive around them.
    #[test]
    fn bare_controllers_come_back_from_one_bad_sample(bad in prop::array::uniform9(odd()), nan in 0usize..7) {
        let mut bad = Bad(bad);
        bad.0[nan] = if nan == 6 { -1.0 } else { f64::NAN };
        let machine = data();
        for orientation in [Orientation::Indirect, Orientation::Direct { crossover_rad_s: 31.4 }] {
            comes_back(FieldOriented::try_new(&machine, &field_oriented(orientation)).unwrap(), &bad)?;
        }
        let gains = KenneGains::typical(&machine, M.rating.rotor_flux_vs, DC_V, H);
        comes_back(Kenne::try_new(&machine, &gains).unwrap(), &bad)?;
        let gains = JadotGains {
            current_proportional_ohm: 7.0,
            current_integral_per_s: 790.0,
            speed_proportional: 1.4,
            speed_integral_per_s: 15.7,
            ..JadotGains::of_the_paper()
        };
        let known = Fixed::try_new(RegulationParameters::from(M.parameters().inverse_gamma())).unwrap();
        comes_back(Jadot::try_new(&machine, &gains, known).unwrap(), &bad)?;
        let law = MtpaLaw { torque_nm: [0.5, 40.0], ..MtpaLaw::kwon_printed() };
        current_comes_back(Mtpa::try_new(&machine, &law, &MtpaGains::typical(&machine)).unwrap(), &bad)?;
    }
}
