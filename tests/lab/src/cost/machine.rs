//! One fourth-order Runge-Kutta sample of the machine, by what is switched on.

use super::Cost;
use im_model::{
    BaseParameter, Bench, Complex, Effects, Held, Machine, ParameterId, PlantInput, Scalar, SingleDual, machines, steady_state,
};

/// Sampling time, s: 10 kHz.
const SAMPLE_TIME_S: f64 = 1e-4;
/// Load torque, Nm.
const LOAD_NM: f64 = 10.0;

fn machine(set: impl Fn(&mut Effects<f64>)) -> Machine<f64> {
    let m = machines::MOTULATOR_2_2_KW;
    let mut e = Effects::scaled(&m.rating, &m.parameters(), m.pole_pairs);
    set(&mut e);
    Machine::try_new(m.parameters(), m.pole_pairs, e).unwrap()
}

/// The linear machine.
fn base() -> Machine<f64> {
    machine(|_| ())
}

/// With saturation of the main flux.
fn saturated() -> Machine<f64> {
    machine(|e| e.main_flux_saturation.excess = 0.5)
}

/// With all effects, each at a usual size; diffusion times such that one step per sample is enough.
fn all_effects() -> Machine<f64> {
    machine(|e| {
        e.main_flux_saturation.excess = 0.5;
        e.leakage_flux_saturation.drop = 0.3;
        e.rotor_skin_effect.resistance_rise = 1.0;
        e.iron_loss.conductance_s = 2e-3;
        e.iron_loss.diffusion_time_s = 2e-4;
        e.stator_heating.inverse_heat_capacity_k_per_j = 0.02;
        e.rotor_heating.inverse_heat_capacity_k_per_j = 0.02;
        e.coulomb_friction.torque_nm = 0.5;
        e.coulomb_friction.smoothing_speed_rad_s = 1.0;
        e.windage.coefficient_nm_s2 = 1e-5;
        e.inverter_nonlinearity.voltage_v = 4.0;
        e.voltage_delay.delay_s = 1.5e-4;
        e.voltage_gain.gain = 0.01;
        e.current_sensor_gain.unbalance_alpha = 0.01;
        e.current_sensor_offset.alpha_a = 0.05;
        e.speed_sensor_lag.time_constant_s = 2e-3;
        e.stator_asymmetry.unbalance_alpha = 0.02;
        e.rotor_asymmetry.unbalance_direct = 0.05;
        e.shaft_compliance.load_inertia_fraction = 0.4;
        e.load_torque_ripple.cosine_nm = 0.5;
    })
}

/// A machine on the bench, running in its steady state.
fn running(m: &Machine<f64>) -> Bench<f64> {
    Bench::new(m, steady_state(m, 320.0, 50.0, Held::Load(LOAD_NM)).unwrap(), SAMPLE_TIME_S)
}

/// The same in another scalar, six of the seven base parameters (all but the rotor leakage) seeded as the fitting does.
fn running_as<T: Scalar>(m: &Machine<f64>, seed: impl Fn(f64, usize) -> T) -> Bench<T> {
    let x = steady_state(m, 320.0, 50.0, Held::Load(LOAD_NM)).unwrap();
    let seeded = m.map(|id, value| {
        let place = [0, 1, 2, 4, 5, 6].iter().position(|&k| id == ParameterId::Base(BaseParameter::ALL[k]));
        place.map_or(T::from_f64(value), |k| seed(value, k))
    });
    Bench::new(&seeded, x.map(|x| T::from_f64(*x)), T::from_f64(SAMPLE_TIME_S))
}

/// N base parameters seeded with relative slopes.
fn dual<const N: usize>(value: f64, k: usize) -> SingleDual<N> {
    SingleDual::seeded(value, k, value)
}

/// One thousand samples of the supply voltage.
fn voltage<T: Scalar>() -> Vec<Complex<T>> {
    let w = 2.0 * core::f64::consts::PI * 50.0 * SAMPLE_TIME_S;
    (0..1000)
        .map(|k| {
            let (s, c) = (w * (f64::from(k) + 0.5)).sin_cos();
            Complex::new(T::from_f64(320.0 * c), T::from_f64(320.0 * s))
        })
        .collect()
}

/// Once through the voltages, which close a whole number of periods.
fn cost<T: Scalar + 'static>(name: &str, bench: impl FnOnce() -> Bench<T> + 'static) -> Cost {
    Cost::new(name, move || {
        let (mut bench, u, tau) = (bench(), voltage::<T>(), T::from_f64(LOAD_NM));
        assert_eq!(bench.substeps(), 1, "one step per sample is what is measured");
        move || {
            let tau = std::hint::black_box(tau);
            for &u in &u {
                bench.advance(&PlantInput::new(u, tau));
            }
            let y = bench.output();
            (y.i_s.re + y.omega_m).value()
        }
    })
}

pub fn costs() -> Vec<Cost> {
    vec![
        cost("base", || running(&base())),
        cost("main_flux_saturation", || running(&saturated())),
        cost("all_effects", || running(&all_effects())),
        cost("base_f32", || running_as(&base(), |x, _| x as f32)),
        cost("base_dual8", || running_as(&base(), dual::<8>)),
        cost("base_dual12", || running_as(&base(), dual::<12>)),
        cost("all_effects_dual12", || running_as(&all_effects(), dual::<12>)),
    ]
}
