//! Every distinction on a card, checked by a simulation. The table lists the claims; a claim without a check fails the test.

use core::f64::consts::PI;

use im_model::{Bench, Complex, EffectId, Effects, Machine, PlantInput, State};

use crate::lab::{self, RATED_V, SYNCHRONOUS, Shaft, Supply, T};

use EffectId::*;

/// An effect, its rival, and what tells them apart: the check is called with the machines of both, in this order.
type Check = fn(effect: &Machine<f64>, rival: &Machine<f64>);

const RATED: Supply = Supply { peak: RATED_V, hz: 50.0 };
const NO_LOAD: Shaft = Shaft::Speed(SYNCHRONOUS);
const LOADED: Shaft = Shaft::Speed(0.96 * SYNCHRONOUS);
const LOCKED: Shaft = Shaft::Speed(0.0);

/// Effect, rival, check. Symmetric claims stand on both cards and are checked once for each.
const CLAIMS: &[(EffectId, EffectId, Check)] = &[
    (MainFluxSaturation, IronLoss, reactive_against_active),
    (IronLoss, MainFluxSaturation, |a, b| reactive_against_active(b, a)),
    (MainFluxSaturation, LeakageFluxSaturation, no_load_against_locked),
    (LeakageFluxSaturation, MainFluxSaturation, |a, b| no_load_against_locked(b, a)),
    (MainFluxSaturation, VoltageGain, knee_against_proportion),
    (VoltageGain, MainFluxSaturation, |a, b| knee_against_proportion(b, a)),
    (LeakageFluxSaturation, RotorSkinEffect, current_against_slip_frequency),
    (RotorSkinEffect, LeakageFluxSaturation, |a, b| current_against_slip_frequency(b, a)),
    (LeakageFluxSaturation, RotorHeating, at_once_against_drifting),
    (RotorSkinEffect, RotorHeating, gone_when_running_against_staying),
    (RotorHeating, RotorSkinEffect, |a, b| gone_when_running_against_staying(b, a)),
    (IronLoss, Windage, flux_against_no_flux),
    (IronLoss, CoulombFriction, flux_against_no_flux),
    (Windage, IronLoss, |a, b| flux_against_no_flux(b, a)),
    (CoulombFriction, IronLoss, |a, b| flux_against_no_flux(b, a)),
    (CoulombFriction, Windage, constant_against_square),
    (Windage, CoulombFriction, |a, b| constant_against_square(b, a)),
    (StatorHeating, RotorHeating, stator_against_rotor_heating),
    (RotorHeating, StatorHeating, |a, b| stator_against_rotor_heating(b, a)),
    (StatorHeating, InverterNonlinearity, drifting_against_dead_time),
    (InverterNonlinearity, StatorHeating, |a, b| drifting_against_dead_time(b, a)),
    (InverterNonlinearity, VoltageGain, fixed_voltage_against_proportion),
    (InverterNonlinearity, CurrentSensorOffset, sixth_harmonic_against_direct_current),
    (CurrentSensorOffset, InverterNonlinearity, sign_kept_against_sign_changed),
    (VoltageDelay, SpeedSensorLag, currents_against_speed),
    (SpeedSensorLag, VoltageDelay, |a, b| currents_against_speed(b, a)),
    (VoltageDelay, IronLoss, turned_against_added),
    (VoltageGain, CurrentSensorGain, torque_in_proportion_against_not),
    (CurrentSensorGain, VoltageGain, |a, b| torque_in_proportion_against_not(b, a)),
    (CurrentSensorGain, StatorAsymmetry, shown_against_real_unbalance),
    (StatorAsymmetry, CurrentSensorGain, |a, b| shown_against_real_unbalance(b, a)),
    (CurrentSensorGain, CurrentSensorOffset, proportional_against_constant),
    (CurrentSensorOffset, CurrentSensorGain, |a, b| proportional_against_constant(b, a)),
    (SpeedSensorLag, ShaftCompliance, smooth_against_ringing),
    (ShaftCompliance, SpeedSensorLag, |a, b| smooth_against_ringing(b, a)),
    (StatorAsymmetry, RotorAsymmetry, standing_against_slipping),
    (RotorAsymmetry, StatorAsymmetry, |a, b| standing_against_slipping(b, a)),
    (RotorAsymmetry, LoadTorqueRipple, slip_against_shaft),
    (LoadTorqueRipple, RotorAsymmetry, |a, b| slip_against_shaft(b, a)),
    (ShaftCompliance, LoadTorqueRipple, fixed_frequency_against_speed),
    (LoadTorqueRipple, ShaftCompliance, |a, b| fixed_frequency_against_speed(b, a)),
];

/// In the table here, or by a test `differs_from_RIVAL` in the effect's own file.
#[test]
fn every_rival_on_every_card_is_distinguished() {
    let mut elsewhere = 0;
    for &id in EffectId::ALL {
        let file = std::fs::read_to_string(format!("{}/src/effects/{id}.rs", env!("CARGO_MANIFEST_DIR"))).unwrap();
        for (rival, _) in id.card().rivals {
            let other = EffectId::from_name(rival).unwrap_or_else(|| panic!("{id} names {rival}, which is no effect"));
            if file.contains(&format!("fn differs_from_{rival}()")) {
                elsewhere += 1;
                continue;
            }
            let check = CLAIMS.iter().find(|(a, b, _)| (*a, *b) == (id, other));
            let (_, _, check) = check.unwrap_or_else(|| panic!("{id} against {rival} is not checked"));
            check(&typical(id), &typical(other));
        }
    }
    let claimed: usize = EffectId::ALL.iter().map(|id| id.card().rivals.len()).sum();
    assert_eq!(claimed, CLAIMS.len() + elsewhere, "checks without a claim");
}

/// The machine with an effect of middling size; sensors' and windings' unbalances along α.
fn typical(id: EffectId) -> Machine<f64> {
    match id {
        // Their unbalance, not their common part, is what is confused.
        CurrentSensorGain => lab::machine(|e: &mut Effects<f64>| {
            e.current_sensor_gain.common = 0.02;
            e.current_sensor_gain.unbalance_alpha = 0.02;
        }),
        _ => lab::with(id),
    }
}

fn added(m: &Machine<f64>, supply: Supply, shaft: Shaft) -> Complex<f64> {
    lab::phasor(m, supply, shaft) - lab::phasor(&lab::base(), supply, shaft)
}

/// |Δi|/|i|.
fn relative(m: &Machine<f64>, supply: Supply, shaft: Shaft) -> f64 {
    added(m, supply, shaft).norm() / lab::phasor(&lab::base(), supply, shaft).norm()
}

/// Saturation adds reactive current, the same at half the frequency; iron loss active current, in proportion to frequency.
fn reactive_against_active(saturation: &Machine<f64>, iron: &Machine<f64>) {
    let (half, half_load) = (Supply::rated_flux(25.0), Shaft::Speed(0.5 * SYNCHRONOUS));
    let (s, i) = (added(saturation, RATED, NO_LOAD), added(iron, RATED, NO_LOAD));
    assert!(s.im.abs() > 5.0 * s.re.abs() && i.re.abs() > 5.0 * i.im.abs(), "{s} {i}");
    let (s, i) = (s.norm() / added(saturation, half, half_load).norm(), i.norm() / added(iron, half, half_load).norm());
    // The resistive drop takes some of the flux at the lower frequency, and saturation is steep.
    assert!(s < 1.4 && i > 1.8, "{s} {i}");
}

fn no_load_against_locked(main: &Machine<f64>, leakage: &Machine<f64>) {
    let ratio = |m| relative(m, RATED, NO_LOAD) / relative(m, RATED, LOCKED);
    assert!(ratio(main) > 10.0 && ratio(leakage) < 0.1, "{} {}", ratio(main), ratio(leakage));
}

/// Relative error at half flux and at 1.1 times rated flux.
fn knee_against_proportion(saturation: &Machine<f64>, gain: &Machine<f64>) {
    let at = |m, flux: f64| relative(m, Supply { peak: flux * RATED_V, hz: 50.0 }, NO_LOAD);
    assert!(at(saturation, 1.1) > 20.0 * at(saturation, 0.5));
    assert!((at(gain, 1.1) / at(gain, 0.5) - 1.0).abs() < 1e-6);
}

/// Locked rotor at two currents, and at two frequencies and one current.
fn current_against_slip_frequency(leakage: &Machine<f64>, skin: &Machine<f64>) {
    let at = |m, volts: f64, hz: f64| relative(m, Supply { peak: volts, hz }, LOCKED);
    assert!(at(leakage, 200.0, 50.0) > 3.0 * at(leakage, 60.0, 50.0));
    assert!((at(skin, 200.0, 50.0) / at(skin, 60.0, 50.0) - 1.0).abs() < 1e-6, "the skin effect is linear");
    // The share of the resistance that the skin effect adds, against the share of the reactance that saturation takes.
    let impedance = |m: &Machine<f64>, hz: f64| {
        let base = Supply { peak: 200.0, hz: 50.0 };
        let wanted = lab::phasor(&lab::base(), base, LOCKED).norm();
        let trial = Supply { peak: 100.0, hz };
        let scaled = Supply { peak: 100.0 * wanted / lab::phasor(&lab::base(), trial, LOCKED).norm(), hz };
        scaled.peak / lab::phasor(m, scaled, LOCKED)
    };
    let rise = |m: &Machine<f64>, hz| impedance(m, hz).re - impedance(&lab::base(), hz).re;
    assert!(rise(skin, 50.0) > 5.0 * rise(skin, 5.0), "{} {}", rise(skin, 50.0), rise(skin, 5.0));
    let fall = |m: &Machine<f64>, hz: f64| (impedance(&lab::base(), hz).im - impedance(m, hz).im) / hz;
    let ratio = fall(leakage, 50.0) / fall(leakage, 10.0);
    assert!((0.5..2.0).contains(&ratio), "{ratio}");
}

/// The relative error of the locked-rotor current soon after switching on, and after three seconds.
fn drift(m: &Machine<f64>) -> f64 {
    let supply = Supply { peak: 120.0, hz: 50.0 };
    let i = |m, settle| lab::run(m, supply, LOCKED, settle, 0.02).current(50.0);
    (i(m, 3.0) - i(m, 0.3)).norm() / i(m, 0.3).norm()
}

fn at_once_against_drifting(leakage: &Machine<f64>, heating: &Machine<f64>) {
    assert!(drift(leakage) < 1e-6 && drift(heating) > 1e-3, "{} {}", drift(leakage), drift(heating));
}

/// A second of locked rotor, then running at 1 % slip: what is left of the error.
fn gone_when_running_against_staying(skin: &Machine<f64>, heating: &Machine<f64>) {
    let left = |m: &Machine<f64>| {
        let running = |m: &Machine<f64>| {
            let locked = lab::run(m, RATED, LOCKED, 0.0, 2.0).state;
            let mut x = locked;
            x.change_speed(|w| *w = 0.99 * SYNCHRONOUS);
            lab::run_from(m, x, RATED, Shaft::Speed(0.99 * SYNCHRONOUS), 1.0, 0.02).current(50.0)
        };
        let (with, without) = (running(m), running(&lab::base()));
        (with - without).norm() / without.norm()
    };
    let (locked, ran) = (relative(skin, RATED, LOCKED), left(skin));
    // At a slip frequency of 0.5 Hz the bars still lag by k·ωτ = 1 % of R_r.
    assert!(ran < 0.03 * locked, "{ran} of {locked}");
    assert!(left(heating) > 5.0 * ran, "{} {ran}", left(heating));
}

/// Power at the terminals at constant speed, by flux: iron loss follows its square, friction is not seen there at all.
fn flux_against_no_flux(iron: &Machine<f64>, friction: &Machine<f64>) {
    let power = |m: &Machine<f64>, flux: f64| {
        let supply = Supply { peak: flux * RATED_V, hz: 50.0 };
        1.5 * supply.peak * added(m, supply, NO_LOAD).re
    };
    let ratio = power(iron, 1.0) / power(iron, 0.6);
    assert!((ratio * 0.36 - 1.0).abs() < 0.02, "{ratio}");
    assert!(power(friction, 1.0).abs() < 1e-6 * power(iron, 1.0));
}

fn coasting(m: &Machine<f64>, omega_m: f64) -> f64 {
    let mut bench = Bench::new(m, State { omega_m, ..State::default() }, T);
    bench.advance(&PlantInput::new(Complex::new(0.0, 0.0), 0.0));
    (omega_m - bench.output().omega_m) / T
}

fn constant_against_square(dry: &Machine<f64>, windage: &Machine<f64>) {
    let ratio = |m| coasting(m, 150.0) / coasting(m, 30.0);
    assert!((ratio(dry) - 1.0).abs() < 0.02 && (ratio(windage) / 25.0 - 1.0).abs() < 0.02, "{} {}", ratio(dry), ratio(windage));
}

/// No rotor current at synchronous speed: only the stator's heating shows. Under load at imposed slip, per kelvin of either, the
/// torque falls with the rotor's.
fn stator_against_rotor_heating(stator: &Machine<f64>, rotor: &Machine<f64>) {
    let drift = |m: &Machine<f64>| {
        let (low, sync) = (Supply::rated_flux(5.0), Shaft::Speed(0.1 * SYNCHRONOUS));
        let i = |settle| lab::run(m, low, sync, settle, 0.2).current(5.0);
        (i(3.0) - i(0.2)).norm() / i(0.2).norm()
    };
    assert!(drift(stator) > 1e-4 && drift(rotor) < 1e-6, "{} {}", drift(stator), drift(rotor));
    let slip_change = |m: &Machine<f64>| {
        let speed = |settle| lab::run(m, RATED, Shaft::Load(14.0), settle, 0.02).speed();
        speed(0.2) - speed(3.0)
    };
    assert!(slip_change(rotor) > 2.0 * slip_change(stator), "{} {}", slip_change(rotor), slip_change(stator));
}

fn drifting_against_dead_time(heating: &Machine<f64>, dead_time: &Machine<f64>) {
    let low = Supply { peak: 30.0, hz: 2.5 };
    let error = |m: &Machine<f64>, settle| {
        let x = im_model::steady_state(&lab::base(), low.peak, low.hz, im_model::Held::Speed(0.0)).unwrap();
        let run = |m: &Machine<f64>| lab::run_from(m, x, low, LOCKED, settle, 0.4).current(2.5);
        (run(m) - run(&lab::base())).norm()
    };
    let growth = |m: &Machine<f64>| error(m, 3.2) / error(m, 0.4);
    assert!(growth(heating) > 2.0 && (growth(dead_time) - 1.0).abs() < 0.01, "{} {}", growth(heating), growth(dead_time));
}

/// The relative error of the no-load current at 5 Hz and at 50 Hz with the same flux.
fn fixed_voltage_against_proportion(dead_time: &Machine<f64>, gain: &Machine<f64>) {
    let low = |m| relative(m, Supply::rated_flux(5.0), Shaft::Speed(0.1 * SYNCHRONOUS));
    let high = |m| relative(m, RATED, NO_LOAD);
    assert!(low(dead_time) > 3.0 * high(dead_time), "{} {}", low(dead_time), high(dead_time));
    assert!((low(gain) / high(gain) - 1.0).abs() < 1e-6);
}

fn sixth_harmonic_against_direct_current(dead_time: &Machine<f64>, offset: &Machine<f64>) {
    let run = |m| lab::run(m, Supply::rated_flux(5.0), Shaft::Speed(0.06 * SYNCHRONOUS), 1.0, 0.2);
    let (a, b) = (run(dead_time), run(offset));
    assert!(a.current(-25.0).norm() > 100.0 * a.current(0.0).norm(), "{} {}", a.current(-25.0), a.current(0.0));
    assert!(b.current(0.0).norm() > 100.0 * b.current(-25.0).norm(), "{} {}", b.current(0.0), b.current(-25.0));
}

/// Direct current one way and the other.
fn sign_kept_against_sign_changed(offset: &Machine<f64>, dead_time: &Machine<f64>) {
    let error = |m: &Machine<f64>, volts: f64| {
        let i = |m: &Machine<f64>| {
            let mut bench = Bench::new(m, State::default(), T);
            for _ in 0..20_000 {
                bench.advance(&PlantInput { imposed_speed: Some([0.0; 2]), ..PlantInput::new(Complex::new(volts, 0.0), 0.0) });
            }
            bench.output().i_s.re
        };
        i(m) - i(&lab::base())
    };
    assert!((error(offset, 20.0) / error(offset, -20.0) - 1.0).abs() < 1e-6);
    assert!((error(dead_time, 20.0) / error(dead_time, -20.0) + 1.0).abs() < 1e-6);
}

fn currents_against_speed(delay: &Machine<f64>, lag: &Machine<f64>) {
    assert!(relative(delay, RATED, LOADED) > 0.01 && relative(lag, RATED, LOADED) < 1e-12);
    // A start: the lag shows in the speed only.
    let start = |m: &Machine<f64>| {
        let run = lab::run_from(m, State::default(), RATED, Shaft::Load(0.0), 0.05, 0.001);
        (run.out[0].i_s, run.out[0].omega_m)
    };
    let ((i_0, w_0), (i_delay, _), (i_lag, w_lag)) = (start(&lab::base()), start(delay), start(lag));
    assert!(i_lag == i_0 && (w_lag - w_0).abs() > 0.1 && (i_delay - i_0).norm() > 0.01);
}

/// A delay turns the current and leaves its size; iron loss adds to it.
fn turned_against_added(delay: &Machine<f64>, iron: &Machine<f64>) {
    let size = |m: &Machine<f64>| lab::phasor(m, RATED, LOADED).norm() / lab::phasor(&lab::base(), RATED, LOADED).norm() - 1.0;
    assert!(size(delay).abs() < 2e-4 && size(iron) > 5e-3, "{} {}", size(delay), size(iron));
    // The heat is real: the losses in the machine grow.
    let loss = |m: &Machine<f64>| {
        let run = lab::run(m, RATED, NO_LOAD, 0.6, 0.02);
        let copper = 1.5 * lab::MACHINE.parameters().stator_resistance_ohm * run.current(50.0).norm_sqr();
        let terminals = m.effects().voltage_delay.delay_s * 2.0 * PI * 50.0;
        1.5 * (RATED.peak * im_model::space_vector::unit(-terminals) * run.current(50.0).conj()).re - copper
    };
    assert!(loss(delay).abs() < 0.02 * loss(iron), "{} {}", loss(delay), loss(iron));
}

/// Torque over squared shown current at one slip: a voltage gain leaves it, a sensor gain does not.
fn torque_in_proportion_against_not(voltage: &Machine<f64>, sensor: &Machine<f64>) {
    let ratio = |m: &Machine<f64>| {
        let run = lab::run(m, RATED, LOADED, 0.6, 0.2);
        run.mean_torque() / run.current(50.0).norm_sqr()
    };
    let base = ratio(&lab::base());
    assert!((ratio(voltage) / base - 1.0).abs() < 1e-6 && (ratio(sensor) / base * 1.02 * 1.02 - 1.0).abs() < 1e-6);
}

/// Backward over forward current at 5 Hz and at 50 Hz with the same slip frequency, and the speed's ripple at twice the supply.
fn shown_against_real_unbalance(sensor: &Machine<f64>, winding: &Machine<f64>) {
    let ratio = |m: &Machine<f64>, hz: f64| {
        let run = lab::run(m, Supply::rated_flux(hz), Shaft::Speed(PI * (hz - 1.5)), 1.0, 0.2);
        run.current(-hz).norm() / run.current(hz).norm()
    };
    assert!((ratio(sensor, 5.0) / ratio(sensor, 50.0) - 1.0).abs() < 1e-3);
    assert!(ratio(winding, 5.0) > 1.5 * ratio(winding, 50.0), "{} {}", ratio(winding, 5.0), ratio(winding, 50.0));
    let ripple = |m: &Machine<f64>| lab::run(m, RATED, Shaft::Load(14.0), 1.0, 0.2).speed_ripple(100.0);
    assert!(ripple(winding) > 100.0 * ripple(sensor), "{} {}", ripple(winding), ripple(sensor));
}

fn proportional_against_constant(gain: &Machine<f64>, offset: &Machine<f64>) {
    let at_rest = |m: &Machine<f64>| Bench::new(m, State::default(), T).output().i_s.norm();
    assert!(at_rest(gain) == 0.0 && at_rest(offset) > 0.0);
    let error = |m: &Machine<f64>, flux: f64| {
        let supply = Supply { peak: flux * RATED_V, hz: 50.0 };
        let run = lab::run(m, supply, LOADED, 0.6, 0.2);
        (run.current(-50.0).norm(), run.current(0.0).norm())
    };
    let ((g_low, _), (g_high, g_direct)) = (error(gain, 0.5), error(gain, 1.0));
    assert!((g_high / g_low - 2.0).abs() < 1e-3 && g_direct < 1e-6, "{g_low} {g_high} {g_direct}");
    let ((_, o_low), (o_backward, o_high)) = (error(offset, 0.5), error(offset, 1.0));
    assert!((o_high / o_low - 1.0).abs() < 1e-6 && o_backward < 1e-6);
}

/// Speed after a load step against the base machine's: crossings through zero of the difference's slope.
fn turns_after_load_step(m: &Machine<f64>) -> usize {
    let shown = |m: &Machine<f64>| {
        let x = im_model::steady_state(m, RATED.peak, 50.0, im_model::Held::Load(0.0)).unwrap();
        lab::run_from(m, x, RATED, Shaft::Load(10.0), 0.0, 0.5).out.iter().map(|y| y.omega_m).collect::<Vec<_>>()
    };
    let (with, without) = (shown(m), shown(&lab::base()));
    let difference: Vec<f64> = with.iter().zip(&without).map(|(a, b)| a - b).collect();
    let largest = difference.iter().fold(0.0f64, |a, b| a.max(b.abs()));
    // Turning points of what exceeds 2 % of the largest difference.
    difference.windows(3).filter(|w| (w[1] - w[0]) * (w[2] - w[1]) < 0.0 && w[1].abs() > 0.02 * largest).count()
}

fn smooth_against_ringing(lag: &Machine<f64>, compliance: &Machine<f64>) {
    let (smooth, ringing) = (turns_after_load_step(lag), turns_after_load_step(compliance));
    assert!(ringing >= 2 * smooth.max(3), "{smooth} {ringing}");
}

fn standing_against_slipping(stator: &Machine<f64>, rotor: &Machine<f64>) {
    let run = |m| lab::run(m, RATED, LOADED, 1.0, 0.5);
    let (s, r) = (run(stator), run(rotor));
    assert!(s.current(-50.0).norm() > 30.0 * s.current(46.0).norm(), "{} {}", s.current(-50.0), s.current(46.0));
    assert!(r.current(46.0).norm() > 30.0 * r.current(-50.0).norm(), "{} {}", r.current(46.0), r.current(-50.0));
}

/// Ripple of the torque at twice the slip frequency and of the speed at the shaft's, with and without load.
fn slip_against_shaft(bars: &Machine<f64>, ripple: &Machine<f64>) {
    // At imposed slip 4 %: sidebands 46 Hz; at no slip none.
    let sideband = |m: &Machine<f64>, shaft, hz| lab::run(m, RATED, shaft, 1.0, 0.5).current(hz).norm();
    assert!(sideband(bars, LOADED, 46.0) > 1e-2 && sideband(ripple, LOADED, 46.0) < 1e-4);
    // No load: the ripple remains, at the turning frequency of 25 Hz; the bars carry no current.
    let free = |m: &Machine<f64>| {
        let run = lab::run(m, RATED, Shaft::Load(0.0), 1.0, 0.4);
        run.out.iter().map(|y| (y.omega_m - run.speed()).abs()).fold(0.0, f64::max)
    };
    assert!(free(ripple) > 0.01 && free(bars) < 1e-3 * free(ripple), "{} {}", free(ripple), free(bars));
}

/// The strongest line of the speed after a load step, from 3 Hz up, at two supply frequencies.
fn fixed_frequency_against_speed(compliance: &Machine<f64>, ripple: &Machine<f64>) {
    let strongest = |m: &Machine<f64>, hz: f64, lines: core::ops::Range<u32>| {
        let supply = Supply::rated_flux(hz);
        let x = im_model::steady_state(m, supply.peak, hz, im_model::Held::Load(0.0)).unwrap();
        // Half-second records of the difference to the base machine: lines every 2 Hz.
        let run = |m: &Machine<f64>| lab::run_from(m, x, supply, Shaft::Load(5.0), 0.02, 0.5);
        let (mut with, without) = (run(m), run(&lab::base()));
        for (a, b) in with.out.iter_mut().zip(&without.out) {
            a.omega_m -= b.omega_m;
        }
        lines.map(|k| f64::from(k) * 2.0).max_by(|a, b| with.speed_ripple(*a).total_cmp(&with.speed_ripple(*b))).unwrap()
    };
    let law = compliance.effects().shaft_compliance;
    let resonance = law.antiresonance_rad_s / (1.0 - law.load_inertia_fraction).sqrt() / (2.0 * PI);
    for hz in [50.0, 30.0] {
        let (c, r) = (strongest(compliance, hz, 8..40), strongest(ripple, hz, 5..40));
        assert!((c - resonance).abs() < 0.25 * resonance, "{c} Hz against {resonance} Hz at {hz} Hz");
        assert!((r - hz / 2.0).abs() <= 2.0, "{r} Hz at {hz} Hz");
    }
}
