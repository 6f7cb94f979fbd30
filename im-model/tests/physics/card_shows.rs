//! Every effect moves the outputs the way its card says, anywhere in its typical range.

use core::f64::consts::PI;

use im_model::{Bench, Complex, EffectId, Effects, Machine, PlantInput, State};
use proptest::prelude::*;

use crate::lab::{self, Shaft, Supply, T};

const RATED: Supply = Supply { peak: lab::RATED_V, hz: 50.0 };
const NO_LOAD: Shaft = Shaft::Speed(lab::SYNCHRONOUS);

/// The machine with one effect at a place in its typical range, and its size.
fn at(id: EffectId, place: f64) -> (Machine<f64>, f64) {
    let mut size = 0.0;
    let m = lab::machine(|e: &mut Effects<f64>| size = lab::set_typical(e, id, place));
    (m, size)
}

/// Deceleration while coasting without flux from a speed, rad/s².
fn coasting(m: &Machine<f64>, omega_m: f64) -> f64 {
    let mut bench = Bench::new(m, State::turning(omega_m), T);
    for _ in 0..10 {
        bench.advance(&PlantInput::new(Complex::new(0.0, 0.0), 0.0));
    }
    (omega_m - bench.output().omega_m) / (10.0 * T)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 6, ..ProptestConfig::default() })]

    #[test]
    fn main_flux_saturation_raises_the_reactive_no_load_current(place in 0.0..1.0f64) {
        let (m, excess) = at(EffectId::MainFluxSaturation, place);
        let (with, without) = (lab::phasor(&m, RATED, NO_LOAD), lab::phasor(&lab::base(), RATED, NO_LOAD));
        let added = with - without;
        prop_assert!(added.im < 0.0 && added.re.abs() < 0.2 * added.im.abs(), "in phase with the magnetizing current: {added}");
        // More than twice the current of more than twice the excess is impossible: flux falls a little.
        prop_assert!(with.norm() > without.norm() * (1.0 + 0.3 * excess.min(0.5)));
        let half = Supply::rated_flux(50.0);
        let half = Supply { peak: 0.5 * half.peak, ..half };
        let ratio = lab::phasor(&m, half, NO_LOAD).norm() / lab::phasor(&lab::base(), half, NO_LOAD).norm();
        prop_assert!(ratio < 1.0 + 0.02 * excess, "below the knee nothing happens: {ratio}");
    }

    #[test]
    fn leakage_flux_saturation_raises_the_locked_rotor_current(place in 0.0..1.0f64) {
        let (m, drop) = at(EffectId::LeakageFluxSaturation, place);
        let ratio = |s, shaft| lab::phasor(&m, s, shaft).norm() / lab::phasor(&lab::base(), s, shaft).norm();
        let locked = ratio(RATED, Shaft::Speed(0.0));
        // At most the leakages fall by 1 + κ; the resistances, and what of the knee is not passed, leave a sixth of it at least.
        prop_assert!(locked > 1.0 + drop / 6.0 && locked < 1.0 + drop, "{locked}");
        prop_assert!((ratio(RATED, NO_LOAD) - 1.0).abs() < 0.01, "no error at no load");
    }

    #[test]
    fn rotor_skin_effect_raises_the_starting_torque_per_current(place in 0.0..1.0f64) {
        let (m, rise) = at(EffectId::RotorSkinEffect, place);
        let torque = |m: &Machine<f64>, speed| lab::run(m, RATED, Shaft::Speed(speed), 0.6, 0.2).mean_torque();
        let ratio = torque(&m, 0.0) / torque(&lab::base(), 0.0);
        let current = lab::phasor(&m, RATED, Shaft::Speed(0.0)).norm() / lab::phasor(&lab::base(), RATED, Shaft::Speed(0.0)).norm();
        // At 50 Hz and τ = 3 ms half of the rise is seen; at constant voltage the current takes back some, for k > 3 all of it.
        prop_assert!(ratio / (current * current) > 1.0 + 0.25 * rise, "{ratio} {current} {rise}");
        prop_assert!(rise > 3.0 || ratio > 1.01, "{ratio} {rise}");
        let running = 0.98 * lab::SYNCHRONOUS;
        // Slip frequency 1 Hz against 1/(2πτ) = 53 Hz: the bars lag by k·2 %.
        prop_assert!((torque(&m, running) / torque(&lab::base(), running) - 1.0).abs() < 0.01 * (1.0 + rise));
    }

    #[test]
    fn iron_loss_adds_power_with_the_square_of_the_voltage_behind_the_leakage(place in 0.0..1.0f64) {
        let (m, g) = at(EffectId::IronLoss, place);
        let p = lab::MACHINE.parameters();
        let (i, i_base) = (lab::phasor(&m, RATED, NO_LOAD), lab::phasor(&lab::base(), RATED, NO_LOAD));
        let behind = RATED.peak - Complex::new(p.stator_resistance_ohm, 100.0 * PI * p.stator_leakage_inductance_h) * i;
        // Against the base machine, which cancels that a current sampled at the edges of held voltages misses their ripple.
        let power = |i: Complex<f64>| 1.5 * (RATED.peak * i.re - p.stator_resistance_ohm * i.norm_sqr());
        let (added, expected) = (power(i) - power(i_base), 1.5 * g * behind.norm_sqr());
        prop_assert!((added / expected - 1.0).abs() < 2e-3, "{added} {expected}");
    }

    #[test]
    fn stator_heating_lowers_the_current_at_low_speed_over_time(place in 0.3..1.0f64) {
        let (m, _) = at(EffectId::StatorHeating, place);
        let low = Supply { peak: 30.0, hz: 2.5 };
        let x = im_model::steady_state(&m, low.peak, low.hz, im_model::Held::Speed(0.0)).unwrap();
        let early = lab::run_from(&m, x, low, Shaft::Speed(0.0), 0.0, 0.4).current(2.5).norm();
        let late = lab::run_from(&m, x, low, Shaft::Speed(0.0), 3.2, 0.4);
        prop_assert!(late.state.extra.of(EffectId::StatorHeating)[0] > 0.0 && late.current(2.5).norm() < early * (1.0 - 1e-4));
        prop_assert_eq!(late.state.extra.of(EffectId::RotorHeating), [0.0]);
    }

    #[test]
    fn rotor_heating_makes_the_slip_grow_under_load(place in 0.3..1.0f64) {
        let (m, _) = at(EffectId::RotorHeating, place);
        let speed = |m: &Machine<f64>, load, settle| lab::run(m, RATED, Shaft::Load(load), settle, 0.02).speed();
        let (slip_early, slip_late) = (lab::SYNCHRONOUS - speed(&m, 14.0, 0.2), lab::SYNCHRONOUS - speed(&m, 14.0, 3.0));
        prop_assert!(slip_late > slip_early * 1.0002, "{slip_early} {slip_late}");
        prop_assert!((speed(&m, 0.0, 0.2) - speed(&m, 0.0, 3.0)).abs() < 1e-4, "none at no load");
    }

    #[test]
    fn coulomb_friction_coasts_down_in_a_straight_line(place in 0.0..1.0f64) {
        let (m, torque) = at(EffectId::CoulombFriction, place);
        let expected = torque / lab::MACHINE.parameters().inertia_kg_m2;
        for speed in [150.0, 50.0, -50.0] {
            // The smooth sign leaves (ω_0/ω)²/2 = 5e-5; the Stribeck rise is gone at 50 rad/s.
            prop_assert!((coasting(&m, speed) * f64::signum(speed) / expected - 1.0).abs() < 2e-3);
        }
        prop_assert!(coasting(&m, 2.0) > 1.05 * expected, "more near standstill");
    }

    #[test]
    fn windage_brakes_with_the_square_of_speed(place in 0.0..1.0f64) {
        let (m, c) = at(EffectId::Windage, place);
        for speed in [150.0, 30.0, -90.0f64] {
            let expected = c * speed * speed.abs() / lab::MACHINE.parameters().inertia_kg_m2;
            // The speed falls a little during the millisecond.
            prop_assert!((coasting(&m, speed) / expected - 1.0).abs() < 0.01);
        }
    }

    #[test]
    fn inverter_nonlinearity_takes_voltage_and_leaves_a_sixth_harmonic(place in 0.0..1.0f64) {
        let (m, lost) = at(EffectId::InverterNonlinearity, place);
        let low = Supply::rated_flux(5.0);
        let shaft = Shaft::Speed(0.05 * lab::SYNCHRONOUS);
        let (with, without) = (lab::run(&m, low, shaft, 0.8, 0.2), lab::run(&lab::base(), low, shaft, 0.8, 0.2));
        prop_assert!(with.current(5.0).norm() < without.current(5.0).norm());
        // The sixth harmonic in the rotating frame is the fifth backwards and the seventh forwards.
        let harmonic = |run: &lab::Trace, k: f64| run.current(5.0 * k).norm();
        let floor = 1e-4 * lost;
        prop_assert!(harmonic(&with, -5.0) > floor && harmonic(&with, 7.0) > 0.2 * floor);
        prop_assert!(harmonic(&without, -5.0) < 1e-3 * harmonic(&with, -5.0));
    }

    #[test]
    fn voltage_delay_turns_the_current_by_the_angle_it_takes(place in 0.0..1.0f64, hz in prop::sample::select(vec![10.0, 25.0, 50.0])) {
        let (m, delay) = at(EffectId::VoltageDelay, place);
        let (supply, shaft) = (Supply::rated_flux(hz), Shaft::Speed(0.96 * 2.0 * PI * hz / 2.0));
        let turned = lab::phasor(&m, supply, shaft) / lab::phasor(&lab::base(), supply, shaft);
        // The mean of two held samples is a little short: (ωT)²/8 = 1e-4 at most.
        prop_assert!((turned.arg() + 2.0 * PI * hz * delay).abs() < 2e-3 * (2.0 * PI * hz * delay) + 1e-6);
        prop_assert!((turned.norm() - 1.0).abs() < 2e-4);
    }

    #[test]
    fn voltage_gain_scales_the_current(place in 0.0..1.0f64) {
        let (m, gain) = at(EffectId::VoltageGain, place);
        let ratio = lab::phasor(&m, RATED, Shaft::Speed(150.0)) / lab::phasor(&lab::base(), RATED, Shaft::Speed(150.0));
        prop_assert!((ratio - (1.0 + gain)).norm() < 1e-9);
    }

    #[test]
    fn current_sensor_gain_scales_and_mirrors_what_is_shown(place in 0.0..1.0f64, alpha in -0.06..0.06f64, beta in -0.06..0.06f64) {
        let (_, gain) = at(EffectId::CurrentSensorGain, place);
        let m = lab::machine(|e| {
            e.current_sensor_gain.common = gain;
            e.current_sensor_gain.unbalance_alpha = alpha;
            e.current_sensor_gain.unbalance_beta = beta;
        });
        let run = lab::run(&m, RATED, Shaft::Speed(150.0), 0.4, 0.2);
        let i = lab::phasor(&lab::base(), RATED, Shaft::Speed(150.0));
        prop_assert!((run.current(50.0) - i * (1.0 + gain)).norm() < 1e-6);
        prop_assert!((run.current(-50.0) - Complex::new(alpha, beta) * i.conj()).norm() < 1e-6);
    }

    #[test]
    fn current_sensor_offset_shows_at_standstill(place in 0.0..1.0f64) {
        let (m, offset) = at(EffectId::CurrentSensorOffset, place);
        let y = Bench::new(&m, State::default(), T).output();
        prop_assert_eq!(y.i_s, Complex::new(offset, 0.0));
        let run = lab::run(&m, RATED, Shaft::Speed(150.0), 0.4, 0.2);
        prop_assert!((run.current(0.0) - offset).norm() < 1e-6);
    }

    #[test]
    fn speed_sensor_lag_is_an_error_in_proportion_to_acceleration(place in 0.0..1.0f64) {
        let (m, tau) = at(EffectId::SpeedSensorLag, place);
        let mut bench = Bench::new(&m, State::default(), T);
        let acceleration = 500.0;
        let ramp = |k: u32| acceleration * T * f64::from(k);
        for k in 0..3000 {
            bench.advance(&PlantInput { imposed_speed: Some([ramp(k), ramp(k + 1)]), ..PlantInput::new(Complex::new(0.0, 0.0), 0.0) });
        }
        // The lags of filters in series add.
        let ratio = m.effects().speed_sensor_lag.pole_ratio;
        let lag = tau * (1.0 + ratio + ratio * ratio);
        let (shown, expected) = (bench.output().omega_m, ramp(3000) - lag * acceleration);
        prop_assert!((shown - expected).abs() < 1e-6 * expected, "{shown} {expected}");
    }

    #[test]
    fn stator_asymmetry_adds_a_backward_current(place in 0.0..1.0f64) {
        let (m, delta) = at(EffectId::StatorAsymmetry, place);
        let low = Supply { peak: 40.0, hz: 5.0 };
        let run = lab::run(&m, low, Shaft::Speed(0.9 * 5.0 * PI), 1.0, 0.2);
        let ratio = run.current(-5.0).norm() / run.current(5.0).norm();
        // R_s δ over the machine's impedance against the backward sequence, which is about R_s + R_r/2 + j5 Hz·L_σ.
        prop_assert!(ratio > 0.3 * delta && ratio < 1.2 * delta, "{ratio} {delta}");
    }

    #[test]
    fn rotor_asymmetry_adds_sidebands_at_twice_the_slip_frequency(place in 0.0..1.0f64) {
        let (m, delta) = at(EffectId::RotorAsymmetry, place);
        // 4 % slip at imposed speed: the lower sideband lies at 46 Hz.
        let run = lab::run(&m, RATED, Shaft::Speed(0.96 * lab::SYNCHRONOUS), 1.0, 0.5);
        let ratio = run.current(46.0).norm() / run.current(50.0).norm();
        prop_assert!(ratio > 0.05 * delta && ratio < 1.5 * delta, "{ratio} {delta}");
        let base = lab::run(&lab::base(), RATED, Shaft::Speed(0.96 * lab::SYNCHRONOUS), 1.0, 0.5);
        prop_assert!(base.current(46.0).norm() < 1e-3 * run.current(46.0).norm());
    }

    #[test]
    fn shaft_compliance_rings_at_the_torsional_resonance(place in 0.0..1.0f64) {
        let (m, f) = at(EffectId::ShaftCompliance, place);
        let mut twisted = State::default();
        twisted.extra.of_mut(EffectId::ShaftCompliance)[1] = 0.05;
        let mut bench = Bench::new(&m, twisted, T);
        // Without voltage only the twist drives the rotor; every crossing of its speed is half a period.
        let mut crossings = vec![];
        let mut before = 0.0;
        for k in 0..5000 {
            bench.advance(&PlantInput::new(Complex::new(0.0, 0.0), 0.0));
            let now = bench.output().omega_m;
            if before * now < 0.0 {
                crossings.push(T * (f64::from(k) + before / (before - now)));
            }
            before = now;
        }
        let half_period = (crossings.last().unwrap() - crossings[0]) / (crossings.len() - 1) as f64;
        let antiresonance = m.effects().shaft_compliance.antiresonance_rad_s;
        let resonance = antiresonance / (1.0 - f).sqrt();
        // Damping lowers the frequency by ζ²/2 and less.
        prop_assert!((PI / half_period / resonance - 1.0).abs() < 0.02, "{} {resonance}", PI / half_period);
    }

    #[test]
    fn load_torque_ripple_follows_the_shaft_at_any_flux(place in 0.0..1.0f64) {
        let (m, c) = at(EffectId::LoadTorqueRipple, place);
        for (supply, hz) in [(Supply { peak: 0.6 * lab::RATED_V, hz: 50.0 }, 25.0), (Supply::rated_flux(25.0), 12.5)] {
            // No load: the shaft turns at half the supply's frequency (two pole pairs).
            let run = lab::run(&m, supply, Shaft::Load(0.0), 1.0, 0.4);
            let free = c / (lab::MACHINE.parameters().inertia_kg_m2 * 2.0 * PI * hz);
            let ripple = run.speed_ripple(hz);
            // The field is a spring between rotor and supply: near its swing frequency the ripple exceeds that of the free inertia.
            prop_assert!(ripple > 0.4 * free && ripple < 6.0 * free, "{ripple} {free}");
        }
    }
}
