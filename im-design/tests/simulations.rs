//! What was proven, seen in simulations of the nonlinear machine.

use im_design::kubota_loop::{LoopGains, mended, no_feedback};
use im_design::machine::Constants;
use im_design::matrix::Matrix;
use im_design::thau_box::{BoxDesign, BoxRegion, fastest};
use im_design::{Machine, Plant, model, thau};

/// One step of the classical Runge-Kutta method.
fn rk4<const N: usize>(x: &mut [f64; N], h: f64, f: impl Fn(&[f64; N]) -> [f64; N]) {
    let ahead = |x: &[f64; N], k: &[f64; N], h: f64| std::array::from_fn::<f64, N, _>(|i| x[i] + h * k[i]);
    let k1 = f(x);
    let k2 = f(&ahead(x, &k1, 0.5 * h));
    let k3 = f(&ahead(x, &k2, 0.5 * h));
    let k4 = f(&ahead(x, &k3, h));
    *x = std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
}

/// Stator voltage that keeps steady state at rotor flux λ (turning at ω_e) and slip.
fn steady_voltage(c: &Constants<f64>, speed: f64, slip: f64, flux: f64, t: f64) -> ([f64; 2], [f64; 5]) {
    let we = c.n_p * speed + slip;
    // λ = flux e^{jω_e t}: (η + j slip)λ = ηL_m i.
    let i = [c.eta * flux / c.eta_l_m, slip * flux / c.eta_l_m];
    let w = c.n_p * speed;
    // u/σL_s = i' + γ i − β(η − jw)λ with i' = jω_e i.
    let u = [
        (-we * i[1] + c.gamma * i[0] - c.beta * c.eta * flux) / c.inverse_sigma_l_s,
        (we * i[0] + c.gamma * i[1] + c.beta * w * flux) / c.inverse_sigma_l_s,
    ];
    let turn = |x: [f64; 2]| {
        let (s, k) = (we * t).sin_cos();
        [x[0] * k - x[1] * s, x[0] * s + x[1] * k]
    };
    let (u, i, l) = (turn(u), turn(i), turn([flux, 0.0]));
    (u, [speed, l[0], l[1], i[0], i[1]])
}

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
fn regenerating_at_low_speed_fails_without_feedback_and_works_mended() {
    let plant = Plant::Machine(Machine::jadot_table_i());
    let c = plant.constants::<f64>();
    // Speed 20 rad/s, slip −28 rad/s: stator frequency 12 rad/s, inside the unstable band.
    let (speed, slip) = (20.0, -28.0);
    let bad = adaptive_speed_error(&c, &no_feedback(0.02, 4.0), speed, slip, 0.5, 2.0);
    let good = adaptive_speed_error(&c, &mended(plant, 0.2, 0.0, 0.02, 4.0).unwrap(), speed, slip, 0.5, 2.0);
    assert!(bad.abs() > 2.0, "the plain observer must leave: {bad}");
    assert!(good.abs() < 0.2, "the mended one must stay: {good}");
}

/// Speed error over time of a fifth-order observer started with errors, in percent of the start after `time`.
fn fifth_order(c: &Constants<f64>, time: f64, feed: impl Fn(f64, [f64; 2]) -> [f64; 5]) -> f64 {
    let (speed, slip, flux, h) = (100.0, 4.0, 0.95, 5e-5);
    let (_, truth) = steady_voltage(c, speed, slip, flux, 0.0);
    let mut x = [truth[0] + 5.0, truth[1] * 0.95, truth[2], truth[3], truth[4]];
    let mut t = 0.0;
    while t < time {
        rk4(&mut x, h, |x| {
            let (u, truth) = steady_voltage(c, speed, slip, flux, t);
            let angle = (c.n_p * speed + slip) * t;
            // Load torque equal to the estimated torque, friction carried by the drive: the speed is constant.
            let mut d = model::derivative(c, x, u, 0.0);
            d[0] = -c.friction_rate * (x[0] - speed);
            let fed = feed(angle, [truth[3] - x[3], truth[4] - x[4]]);
            std::array::from_fn(|k| d[k] + fed[k])
        });
        t += h;
    }
    100.0 * (x[0] - speed).abs() / 5.0
}

#[test]
fn box_gain_converges_where_lipschitz_gains_wait_for_friction() {
    let plant = Plant::Machine(Machine::kwon_table_iv());
    let c = plant.constants::<f64>();
    let region = BoxRegion {
        frame_rad_per_s: [100.0, 300.0],
        slip_rad_per_s: [-8.0, 8.0],
        flux_d_wb: [0.8, 1.1],
        flux_q_wb: [-0.05, 0.05],
        current_d_a: [0.0; 2],
        current_q_a: [0.0; 2],
    };
    let (boxed, _) = fastest(plant, &region, 20.0, 1e6).unwrap();
    let (lipschitz, _) = thau::maximize(plant, 1e-3).unwrap();
    let by_box = turning(&boxed, 2.0 * 100.0 + 4.0);
    let time = 2.0;
    let open = fifth_order(&c, time, |_, _| [0.0; 5]);
    let bounded = fifth_order(&c, time, |_, e| times(&lipschitz.gain, e));
    let boxed_error = fifth_order(&c, time, by_box);
    // Friction alone leaves e^(−0.238·2) = 62 %.
    assert!(open > 20.0, "{open}");
    assert!(bounded > 20.0, "{bounded}");
    assert!(boxed_error < 1.0, "{boxed_error}, proven rate {}", boxed.rate_per_s);
}

fn times(gain: &Matrix<f64>, e: [f64; 2]) -> [f64; 5] {
    std::array::from_fn(|k| gain[(k, 0)] * e[0] + gain[(k, 1)] * e[1])
}

/// The box gain applied in a frame at `angle`: turn the error in, the correction out.
fn turning(design: &BoxDesign, frame_speed: f64) -> impl Fn(f64, [f64; 2]) -> [f64; 5] {
    let gain = &design.gain + &design.gain_per_frame_speed.scaled(&frame_speed);
    move |angle, e| {
        let (s, k) = angle.sin_cos();
        let out = times(&gain, [e[0] * k + e[1] * s, e[1] * k - e[0] * s]);
        let back = |x: f64, y: f64| [x * k - y * s, x * s + y * k];
        let ([la, lb], [ia, ib]) = (back(out[1], out[2]), back(out[3], out[4]));
        [out[0], la, lb, ia, ib]
    }
}
