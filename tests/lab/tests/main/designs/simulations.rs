//! What was proven, seen in simulations of the nonlinear machine.

use im_design::kubota_loop::{LoopGains, no_feedback, stabilized};
use im_design::machine::Constants;
use im_design::thau_box::{BoxRegion, fastest};
use im_design::{DesignModel, LinearMachine, model, thau};
use im_lab::observer_error::{fifth_order, rk4, steady_voltage, times, turning};

/// Kubota's nonlinear adaptive observer at constant true speed; returns the speed error after `time`.
fn adaptive_speed_error(c: &Constants<f64>, gains: &LoopGains, speed: f64, slip: f64, start: f64, time: f64) -> f64 {
    let flux = 0.9;
    let h = 5e-5;
    // Estimated flux and current, integral of the speed law.
    let (_, x0) = steady_voltage(c, speed, slip, flux, 0.0);
    let mut x = [x0[1], x0[2], x0[3], x0[4], (speed + start) / gains.integral];
    let estimate = |x: &[f64; 5], i: [f64; 2]| {
        let e = c.n_p * c.beta * ((i[0] - x[2]) * x[1] - (i[1] - x[3]) * x[0]);
        (gains.proportional * e + gains.integral * x[4], e)
    };
    let mut t = 0.0;
    while t < time {
        rk4(&mut x, h, |x| {
            // The true state at the step's start: the error of the half-step shift is far below the speed errors seen.
            let (u, truth) = steady_voltage(c, speed, slip, flux, t);
            let i = [truth[3], truth[4]];
            let (omega, e) = estimate(x, i);
            let d = model::derivative(c, &[omega, x[0], x[1], x[2], x[3]], u, 0.0);
            let gain = |r: usize, k: usize| gains.gain[(r, k)] + omega * gains.gain_per_speed[(r, k)];
            let fed = |r: usize| gain(r, 0) * (i[0] - x[2]) + gain(r, 1) * (i[1] - x[3]);
            [d[1] + fed(0), d[2] + fed(1), d[3] + fed(2), d[4] + fed(3), e]
        });
        t += h;
    }
    let (_, truth) = steady_voltage(c, speed, slip, flux, t);
    estimate(&x, [truth[3], truth[4]]).0 - speed
}

#[test]
fn regenerating_at_low_speed_fails_without_feedback_and_works_stabilized() {
    let plant = DesignModel::Machine(LinearMachine::jadot_table_i());
    let c = plant.constants::<f64>();
    // Speed 20 rad/s, slip −28 rad/s: stator frequency 12 rad/s, inside the unstable band.
    let (speed, slip) = (20.0, -28.0);
    let bad = adaptive_speed_error(&c, &no_feedback(0.02, 4.0), speed, slip, 0.5, 2.0);
    let good = adaptive_speed_error(&c, &stabilized(plant, 0.2, 0.0, 0.02, 4.0).unwrap(), speed, slip, 0.5, 2.0);
    assert!(bad.abs() > 2.0, "the plain observer must leave: {bad}");
    assert!(good.abs() < 0.2, "the stabilized one must stay: {good}");
}

#[test]
fn box_gain_converges_where_lipschitz_gains_wait_for_friction() {
    let plant = DesignModel::Machine(LinearMachine::kwon_table_iv());
    let c = plant.constants::<f64>();
    let region = BoxRegion {
        frame_rad_s: [100.0, 300.0],
        slip_rad_s: [-8.0, 8.0],
        flux_d_vs: [0.8, 1.1],
        flux_q_vs: [-0.05, 0.05],
        current_d_a: [0.0; 2],
        current_q_a: [0.0; 2],
    };
    let (boxed, _) = fastest(plant, &region, 20.0, 1e6).unwrap();
    let (lipschitz, _) = thau::maximize(plant, 1e-3).unwrap();
    let by_box = turning(&boxed, 2.0 * 100.0 + 4.0);
    let time = 2.0;
    let last = |errors: Vec<(f64, f64)>| errors[errors.len() - 1].1.abs();
    let open = last(fifth_order(&c, time, |_, _| [0.0; 5]));
    let bounded = last(fifth_order(&c, time, |_, e| times(&lipschitz.gain, e)));
    let boxed_error = last(fifth_order(&c, time, by_box));
    // Friction alone leaves e^(−0.238·2) = 62 %.
    assert!(open > 20.0, "{open}");
    assert!(bounded > 20.0, "{bounded}");
    assert!(boxed_error < 1.0, "{boxed_error}, proven rate {}", boxed.rate_per_s);
}
