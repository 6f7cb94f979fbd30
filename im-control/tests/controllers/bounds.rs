//! Every number that a controller is made from has its bounds, and an error names the one that is out of them.

use im_control::modulation::DeadTimeCompensation;
use im_control::*;
use im_identify::online::{Fixed, Lambda};
use im_model::{Machine, machines};

const ABOVE_ZERO: [f64; 4] = [0.0, -1.0, f64::NAN, f64::INFINITY];
const FROM_ZERO: [f64; 3] = [-1e-9, f64::NAN, f64::INFINITY];

fn data() -> MachineData<f64> {
    let m = machines::JADOT_TABLE_I;
    MachineData::of(&Machine::base(m.parameters(), m.pole_pairs).unwrap(), 20.0)
}

/// `make` takes what is good, and refuses it with any of the bad values in a field, by the field's name.
macro_rules! refuses {
    ($make:expr, $good:expr, $($bad:expr => [$($($field:ident).+),+]),+ $(,)?) => {{
        let (make, good) = ($make, $good);
        assert!(make(&good).is_ok());
        $($(for bad in $bad {
            let mut x = good;
            x.$($field).+ = bad;
            let name = stringify!($($field).+).rsplit(['.', ' ']).next().unwrap();
            let said = make(&x).err().map(|e| e.to_string());
            assert!(said.as_ref().is_some_and(|said| said.starts_with(name)), "{name} = {bad}: {said:?}");
        })+)+
    }};
}

#[test]
fn of_a_machine() {
    refuses!(|x: &MachineData<f64>| x.validate(), data(), ABOVE_ZERO => [current_max_a, windings.stator_resistance_ohm, windings.inertia_kg_m2],
        [-1e-9, 0.011, f64::NAN] => [voltage_delay_s], [0, 101] => [pole_pairs]);
    let edge = MachineData { voltage_delay_s: 0.01, pole_pairs: 100, ..data() };
    assert!(edge.validate().is_ok());
}

#[test]
fn of_a_drive() {
    refuses!(|x: &DriveLimits<f64>| x.validate(), DriveLimits::generous(&data(), 150.0, 0.9),
        ABOVE_ZERO => [current_range_a, overcurrent_a, speed_range_rad_s, speed_max_rad_s, rotor_flux_max_vs, torque_max_nm,
            speed_slew_rad_s2, torque_slew_nm_per_s, voltage_max_v, fade_s],
        [0, 101] => [pole_pairs]);
}

#[test]
fn of_field_orientation() {
    let good = FieldOrientedGains::typical(&data(), 0.9, 1e-4);
    refuses!(|x: &FieldOrientedGains<f64>| FieldOriented::try_new(&data(), x), good,
        ABOVE_ZERO => [current_bandwidth_rad_s, flux_bandwidth_rad_s, speed_bandwidth_rad_s, reference.bandwidth_rad_s,
            reference.acceleration_max_rad_s2, field_weakening.bandwidth_per_s],
        [0.09, 1.01, f64::NAN] => [field_weakening.voltage_share]);
    for bad in ABOVE_ZERO {
        let x = FieldOrientedGains { orientation: Orientation::Direct { crossover_rad_s: bad }, ..good };
        assert!(FieldOriented::try_new(&data(), &x).unwrap_err().to_string().starts_with("crossover_rad_s"));
    }
    assert!(
        matches!(good.direct().orientation, Orientation::Direct { crossover_rad_s } if (crossover_rad_s - 31.4).abs() < 1e-9)
    );
}

#[test]
fn of_kenne() {
    refuses!(|x: &KenneGains<f64>| Kenne::try_new(&data(), x), KenneGains::typical(&data(), 0.9, 540.0, 1e-4),
        ABOVE_ZERO => [k_sq, k_sd, c_omega, c_lambda, load_bandwidth_per_s, load_limit_nm, magnetizing_bandwidth_rad_s,
            reference.bandwidth_rad_s, field_weakening.bandwidth_per_s],
        FROM_ZERO => [boundary_omega, boundary_lambda, equivalent_bandwidth_per_s]);
}

#[test]
fn of_jadot() {
    let fixed =
        Fixed::try_new(Machine::base(machines::JADOT_TABLE_I.parameters(), 2).unwrap().parameters().inverse_gamma().into());
    let fixed = fixed.unwrap();
    let good = JadotGains::of_the_paper();
    let make = |x: &JadotGains<f64>| Jadot::try_new(&data(), x, fixed);
    refuses!(make, good, ABOVE_ZERO => [current_proportional_ohm, speed_proportional],
        FROM_ZERO => [current_integral_per_s, speed_integral_per_s]);
    assert!(make(&JadotGains { current_integral_per_s: 0.0, speed_integral_per_s: 0.0, field_weakening: None, ..good }).is_ok());
    assert!(make(&JadotGains { lambda: Lambda::Constant(0.0), ..good }).unwrap_err().to_string().starts_with("lambda_h"));
    let weakening = Some(FieldWeakening { bandwidth_per_s: 0.0, voltage_share: 0.9 });
    assert!(make(&JadotGains { field_weakening: weakening, ..good }).unwrap_err().to_string().starts_with("bandwidth_per_s"));
}

#[test]
fn of_least_current() {
    let law = MtpaLaw::kwon_printed();
    refuses!(|x: &MtpaGains<f64>| Mtpa::try_new(&data(), &law, x), MtpaGains::typical(&data()), ABOVE_ZERO => [tau_scr_s],
        FROM_ZERO => [integral_limit_a], [0.09, 10.1, f64::NAN] => [slip_factor]);
    let make =
        |torque_nm: [f64; 2], current: &[f64]| MtpaLaw::<f64>::series(torque_nm, current, &[0.1]).map_err(|e| e.to_string());
    assert!(make([1.0, 20.0], &[0.5; 16]).is_ok());
    assert!(make([20.0, 20.5], &[0.5]).is_ok(), "a narrow range is one");
    assert!(make([0.0, 20.0], &[0.5]).unwrap_err().starts_with("torque_nm[0]"));
    assert!(make([20.0, 20.0], &[0.5]).unwrap_err().starts_with("torque_nm[1]"));
    assert!(make([1.0, 20.0], &[]).unwrap_err().starts_with("number of current coefficients"));
    assert!(make([1.0, 20.0], &[0.5; 17]).unwrap_err().starts_with("number of current coefficients"));
    assert!(make([1.0, 20.0], &[f64::NAN]).unwrap_err().starts_with("coefficient"));
    let typical = MtpaGains::typical(&data());
    assert_eq!((typical.tau_scr_s, typical.integral_limit_a, typical.slip_factor), (0.01, 5.0, 1.0));
}

#[test]
fn of_dead_time() {
    let good = DeadTimeCompensation {
        dead_time_s: 2e-6,
        switching_period_s: 1e-4,
        drop_v: 1.0,
        on_resistance_ohm: 0.01,
        soft_current_a: 0.1,
    };
    refuses!(|x: &DeadTimeCompensation<f64>| x.validate(), good, ABOVE_ZERO => [switching_period_s, soft_current_a],
        FROM_ZERO => [drop_v, on_resistance_ohm], [-1e-9, 5.1e-5, f64::NAN] => [dead_time_s]);
    // No dead time and no drop is a bridge, too; more than half the period is none.
    assert!(DeadTimeCompensation { dead_time_s: 0.0, drop_v: 0.0, on_resistance_ohm: 0.0, ..good }.validate().is_ok());
    assert!(DeadTimeCompensation { dead_time_s: 5e-5, ..good }.validate().is_ok());
}

#[test]
fn of_a_speed_loop() {
    let inner = Mtpa::try_new(&data(), &MtpaLaw::kwon_printed(), &MtpaGains::typical(&data())).unwrap();
    let regulator = SpeedRegulator { bandwidth_rad_s: 20.0, inertia_kg_m2: 0.1 };
    let shaper = ReferenceShaper { bandwidth_rad_s: 50.0, acceleration_max_rad_s2: 300.0 };
    refuses!(|x: &SpeedRegulator<f64>| SpeedLoop::try_new(x, &shaper, 20.0, inner), regulator, ABOVE_ZERO => [bandwidth_rad_s, inertia_kg_m2]);
    refuses!(|x: &ReferenceShaper<f64>| SpeedLoop::try_new(&regulator, x, 20.0, inner), shaper,
        ABOVE_ZERO => [bandwidth_rad_s, acceleration_max_rad_s2]);
    for bad in ABOVE_ZERO {
        assert!(SpeedLoop::try_new(&regulator, &shaper, bad, inner).err().unwrap().to_string().starts_with("torque_max_nm"));
    }
}
