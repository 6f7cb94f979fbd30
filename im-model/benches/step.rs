//! Cost of one fourth-order Runge-Kutta sample, by what is switched on.
#![allow(missing_docs)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use im_model::{Bench, Complex, Drive, Dual, Effects, Machine, Scalar, State, machines};

fn machine(set: impl Fn(&mut Effects<f64>)) -> Machine<f64> {
    let m = machines::MOTULATOR_2_2_KW;
    let mut e = Effects::scaled(&m.rating, &m.parameters(), m.pole_pairs);
    set(&mut e);
    Machine::try_new(m.parameters(), m.pole_pairs, e).unwrap()
}

/// The voltage of a thousand samples at 10 kHz.
fn voltage<T: Scalar>() -> Vec<Complex<T>> {
    let u = |k: i32| (0.0314 * f64::from(k)).sin_cos();
    (0..1000).map(|k| Complex::new(T::from_f64(320.0 * u(k).1), T::from_f64(320.0 * u(k).0))).collect()
}

/// A thousand samples of a running machine: read a microsecond as a nanosecond per sample.
fn samples<T: Scalar>(bench: &mut Bench<T>, voltage: &[Complex<T>]) -> T {
    let tau = black_box(T::from_f64(10.0));
    for &u in voltage {
        bench.advance(&Drive::new(u, tau));
    }
    bench.output().omega_m
}

fn step(c: &mut Criterion) {
    let mut group = c.benchmark_group("rk4_sample_x1000");
    let u = voltage();
    let strong = |e: &mut Effects<f64>| e.main_flux_saturation.excess = 0.5;
    let all = |e: &mut Effects<f64>| {
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
    };
    let base = machine(|_| ());
    let saturated = machine(strong);
    let full = machine(all);
    let start = |m: &Machine<f64>| im_model::steady_state(m, 320.0, 50.0, im_model::Held::Load(10.0)).unwrap();
    let at_start = |m: &Machine<f64>| Bench::new(m, start(m), 1e-4);
    println!("steps per sample: base {}, all effects {}", at_start(&base).substeps(), at_start(&full).substeps());
    group.bench_function("base", |b| {
        b.iter_batched_ref(|| at_start(&base), |bench| samples(bench, &u), criterion::BatchSize::SmallInput)
    });
    group.bench_function("main_flux_saturation", |b| {
        b.iter_batched_ref(|| at_start(&saturated), |bench| samples(bench, &u), criterion::BatchSize::SmallInput);
    });
    group.bench_function("all_effects", |b| {
        b.iter_batched_ref(|| at_start(&full), |bench| samples(bench, &u), criterion::BatchSize::SmallInput)
    });
    let single = Bench::new(&base.cast::<f32>(), State::default(), 1e-4);
    let u = voltage();
    group.bench_function("base_f32", |b| {
        b.iter_batched_ref(|| single, |bench| samples(bench, &u), criterion::BatchSize::SmallInput)
    });
    let dual = Bench::new(
        &base.map(|id, x| {
            let k = [0, 1, 2, 4, 5, 6].iter().position(|&k| id == im_model::ParameterId::Base(im_model::BaseParameter::ALL[k]));
            k.map_or(Dual::<8>::constant(x), |k| Dual::seeded(x, k, x))
        }),
        State::default(),
        1e-4,
    );
    let u = voltage();
    group.bench_function("base_dual8", |b| {
        b.iter_batched_ref(|| dual, |bench| samples(bench, &u), criterion::BatchSize::SmallInput)
    });
    group.finish();
}

criterion_group!(benches, step);
criterion_main!(benches);
