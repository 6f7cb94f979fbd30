//! im-control: machine data, gains, limits and laws of every controller, bare and looked after, and a step with anything.

use im_control::jadot::JadotGains;
use im_control::kenne::{KenneGains, LoadTorqueSource};
use im_control::modulation::DeadTimeCompensation;
use im_control::mtpa::Connection;
use im_control::{
    CurrentControl, Drive, DriveLimits, FieldOriented, FieldOrientedGains, FieldWeakening, FluxAim, FlyingStart, Iron, Jadot,
    Kenne, MachineData, Mtpa, MtpaGains, MtpaLaw, OptimalFlux, Orientation, ReferenceShaper, Reports, SpeedLoop, SpeedRegulator,
};
use im_identify::online::{Fixed, Lambda, RegulationParameters};
use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::{Bench, Machine, PlantInput, State};

use super::*;

const CURRENT_MAX_A: f64 = 25.0;
const DC_V: f64 = 560.0;

fn data<T: Scalar>(f: &mut Fields) -> MachineData<T> {
    MachineData {
        windings: super::machines::windings(f),
        pole_pairs: M.pole_pairs,
        current_max_a: f.or(CURRENT_MAX_A),
        voltage_delay_s: f.or(H),
    }
}

/// The machine as it is.
fn known<T: Scalar>() -> MachineData<T> {
    data(&mut Fields(Vec::new()))
}

fn weakening<T: Scalar>(f: &mut Fields) -> FieldWeakening<T> {
    FieldWeakening { bandwidth_per_s: f.or(15.0), voltage_share: f.or(0.92) }
}

fn shaper<T: Scalar>(f: &mut Fields) -> ReferenceShaper<T> {
    ReferenceShaper { bandwidth_rad_s: f.or(100.0), acceleration_max_rad_s2: f.or(2000.0) }
}

fn field_oriented<T: Scalar>(f: &mut Fields, direct: bool) -> FieldOrientedGains<T> {
    FieldOrientedGains {
        orientation: if direct { Orientation::Direct { crossover_rad_s: f.or(31.4) } } else { Orientation::Indirect },
        current_bandwidth_rad_s: f.or(750.0),
        flux_bandwidth_rad_s: f.or(30.0),
        speed_bandwidth_rad_s: f.or(40.0),
        speed_bandwidth_per_flux2: direct.then(|| f.or(60.0)),
        follows_torque: false,
        reference: shaper(f),
        field_weakening: weakening(f),
        current_control: if direct { CurrentControl::Discrete } else { CurrentControl::Continuous },
        overmodulates: direct,
        optimal_flux: either_flux(f, direct),
    }
}

fn either_flux<T: Scalar>(f: &mut Fields, there: bool) -> Option<OptimalFlux<T>> {
    let iron = Iron { excess: f.or(0.5), exponent: f.or(7.0), reference_flux_vs: f.or(0.9), conductance_s: f.or(1e-3) };
    let aim = FluxAim::LeastLoss;
    there.then_some(OptimalFlux { aim, iron, bandwidth_per_s: f.or(10.0), least_share: f.or(0.3) })
}

fn kenne<T: Scalar>(f: &mut Fields) -> KenneGains<T> {
    let right = KenneGains::<f64>::typical(&known(), M.rating.rotor_flux_vs, DC_V, H);
    KenneGains {
        k_sq: f.or(right.k_sq),
        k_sd: f.or(right.k_sd),
        c_omega: f.or(right.c_omega),
        c_lambda: f.or(right.c_lambda),
        boundary_omega: f.or(right.boundary_omega),
        boundary_lambda: f.or(right.boundary_lambda),
        equivalent_bandwidth_per_s: f.or(right.equivalent_bandwidth_per_s),
        load_torque: LoadTorqueSource::Estimated,
        load_bandwidth_per_s: f.or(right.load_bandwidth_per_s),
        load_limit_nm: f.or(right.load_limit_nm),
        magnetizing_bandwidth_rad_s: f.or(right.magnetizing_bandwidth_rad_s),
        reference: shaper(f),
        field_weakening: weakening(f),
    }
}

fn jadot<T: Scalar>(f: &mut Fields, constant: bool) -> JadotGains<T> {
    JadotGains {
        current_proportional_ohm: f.or(7.0),
        current_integral_per_s: f.or(790.0),
        speed_proportional: f.or(1.4),
        speed_integral_per_s: f.or(15.7),
        lambda: if constant { Lambda::Constant(f.or(0.01)) } else { Lambda::Scheduled },
        field_weakening: Some(weakening(f)),
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

/// Twenty milliseconds, with some bad samples: every command is of numbers.
fn runs<T: Scalar>(mut controller: impl Controller<T>, bad: &Bad) -> bool {
    (0..200).all(|k| {
        let (m, r) = if k % 50 == 30 { bad.sample() } else { good(k) };
        let (Command::Voltage(u) | Command::Current(u)) = controller.step(&m, &r);
        is_finite(&[u.re, u.im])
    })
}

fn all<T: Scalar>(f: &Fields, bad: &Bad, either: bool) -> Result<(), TestCaseError> {
    let mut f = f.clone();
    let machine = data::<T>(&mut f);
    let g = field_oriented(&mut f, either);
    if let Ok(c) = FieldOriented::try_new(&machine, &g) {
        prop_assert!(runs(c, bad), "{g:?} {machine:?}");
    }
    let fixed = Fixed::try_new(RegulationParameters::from_values([f.or(1.0), f.or(0.15), f.or(1.4), f.or(0.01)]));
    let g = jadot(&mut f, either);
    if let Some(c) = fixed.ok().and_then(|fixed| Jadot::try_new(&machine, &g, fixed).ok()) {
        prop_assert!(runs(c, bad), "{g:?} {machine:?}");
    }
    Ok(())
}

fn more<T: Scalar>(f: &Fields, bad: &Bad, either: bool) -> Result<(), TestCaseError> {
    let mut f = f.clone();
    let machine = known::<T>();
    let g = kenne(&mut f);
    if let Ok(c) = Kenne::try_new(&machine, &g) {
        prop_assert!(runs(c, bad), "{g:?}");
    }
    let c = |x: f64| T::from_f64(x);
    let printed = MtpaLaw::<f64>::kwon_printed();
    let coefficients: [f64; 4] = std::array::from_fn(|k| f.or([1.0, 0.5, 0.01, 0.0][k]));
    let range = [f.or_64(printed.torque_nm[0]), f.or_64(printed.torque_nm[1])];
    let gains = MtpaGains {
        tau_scr_s: f.or(0.01),
        integral_limit_a: f.or(6.0),
        connection: if either { Connection::Star } else { Connection::Delta },
        slip_factor: f.or(1.0),
    };
    for law in [
        MtpaLaw::<T>::series(range, &coefficients, &coefficients),
        Ok(MtpaLaw { torque_nm: range.map(c), ..MtpaLaw::kwon_printed() }),
    ] {
        let Ok(law) = law else { continue };
        let Ok(drive) = Mtpa::try_new(&machine, &law, &gains) else { continue };
        prop_assert!(runs(drive, bad), "{law:?} {gains:?}");
        let regulator = SpeedRegulator { bandwidth_rad_s: f.or(20.0), inertia_kg_m2: f.or(0.03) };
        if let Ok(c) = SpeedLoop::try_new(&regulator, &shaper(&mut f), f.or(40.0), drive) {
            prop_assert!(runs(c, bad), "{regulator:?} {law:?}");
        }
    }
    Ok(())
}

/// Looked after: limits, dead time, a flying start.
fn supervised<T: Scalar>(f: &Fields, bad: &Bad) -> Result<(), TestCaseError> {
    let mut f = f.clone();
    let machine = known::<T>();
    let controller = FieldOriented::try_new(&machine, &field_oriented(&mut Fields(Vec::new()), false)).unwrap();
    let right = DriveLimits::<f64>::generous(&known(), 157.0, M.rating.rotor_flux_vs);
    let limits = DriveLimits {
        pole_pairs: M.pole_pairs,
        current_range_a: f.or(right.current_range_a),
        overcurrent_a: f.or(right.overcurrent_a),
        speed_range_rad_s: f.or(right.speed_range_rad_s),
        speed_max_rad_s: f.or(right.speed_max_rad_s),
        rotor_flux_max_vs: f.or(right.rotor_flux_max_vs),
        torque_max_nm: f.or(right.torque_max_nm),
        speed_slew_rad_s2: f.or(right.speed_slew_rad_s2),
        torque_slew_nm_per_s: f.or(right.torque_slew_nm_per_s),
        voltage_max_v: f.or(right.voltage_max_v),
        lost_samples_max: 10,
        fade_s: f.or(right.fade_s),
    };
    let dead_time = DeadTimeCompensation {
        dead_time_s: f.or(2e-6),
        switching_period_s: f.or(1e-4),
        drop_v: f.or(1.5),
        on_resistance_ohm: f.or(0.02),
        soft_current_a: f.or(0.5),
    };
    let Ok(flying) = FlyingStart::try_new(controller, &machine, f.or(H)) else { return Ok(()) };
    prop_assert!(runs(flying, bad), "flying start, {f:?}");
    let Ok(drive) = Drive::try_new(flying, &limits).and_then(|d| d.compensating(&dead_time)) else { return Ok(()) };
    prop_assert!(runs(drive, bad), "{limits:?} {dead_time:?}");
    Ok(())
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
    let name = std::any::type_name_of_val(&controller);
    // Two in a hundred of the speed are left of the worst sample.
    prop_assert!((omega - 60.0).abs() < 2.0 && Some(status) == before, "{name}: {omega} rad/s, {status}, {before:?} before");
    Ok(())
}

/// A current source that gives what is commanded: the current comes back.
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
    #![proptest_config(cases())]
    #[test]
    fn controllers_are_refused_or_run(f in fields(), bad in prop::array::uniform9(odd()), either in any::<bool>()) {
        let bad = Bad(bad);
        all::<f64>(&f, &bad, either)?;
        all::<f32>(&f, &bad, either)?;
        more::<f64>(&f, &bad, either)?;
        more::<f32>(&f, &bad, either)?;
        supervised::<f64>(&f, &bad)?;
        supervised::<f32>(&f, &bad)?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases().cases / 4, ..cases() })]
    /// Bare, without a drive around them.
    #[test]
    fn bare_controllers_come_back_from_one_bad_sample(bad in prop::array::uniform9(odd()), nan in 0usize..7) {
        let mut bad = Bad(bad);
        bad.0[nan] = if nan == 6 { -1.0 } else { f64::NAN };
        let (machine, right) = (known::<f64>(), || Fields(Vec::new()));
        for direct in [false, true] {
            comes_back(FieldOriented::try_new(&machine, &field_oriented(&mut right(), direct)).unwrap(), &bad)?;
        }
        comes_back(Kenne::try_new(&machine, &kenne(&mut right())).unwrap(), &bad)?;
        let parameters = Fixed::try_new(RegulationParameters::from(M.parameters().inverse_gamma())).unwrap();
        comes_back(Jadot::try_new(&machine, &jadot(&mut right(), true), parameters).unwrap(), &bad)?;
        let law = MtpaLaw { torque_nm: [0.5, 40.0], ..MtpaLaw::kwon_printed() };
        current_comes_back(Mtpa::try_new(&machine, &law, &MtpaGains::typical(&machine)).unwrap(), &bad)?;
    }
}
