//! Simulations of the nonlinear machine in steady state with an observer that starts wrong.

use im_design::machine::Constants;
use im_design::matrix::Matrix;
use im_design::model;
use im_design::thau_box::BoxDesign;

/// One step of the classical Runge-Kutta method.
pub fn rk4<const N: usize>(x: &mut [f64; N], h: f64, f: impl Fn(&[f64; N]) -> [f64; N]) {
    let ahead = |x: &[f64; N], k: &[f64; N], h: f64| std::array::from_fn::<f64, N, _>(|i| x[i] + h * k[i]);
    let k1 = f(x);
    let k2 = f(&ahead(x, &k1, 0.5 * h));
    let k3 = f(&ahead(x, &k2, 0.5 * h));
    let k4 = f(&ahead(x, &k3, h));
    *x = std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
}

/// Stator voltage that keeps steady state at rotor flux λ (turning at ω_e) and slip.
pub fn steady_voltage(c: &Constants<f64>, speed: f64, slip: f64, flux: f64, t: f64) -> ([f64; 2], [f64; 5]) {
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

/// Speed errors (s, percent of the first) of a fifth-order observer started 5 rad/s and 5 % of flux wrong, at 100 rad/s.
///
/// The load torque is taken equal to the estimated torque, as in the second study of Kwon et al.
pub fn fifth_order(c: &Constants<f64>, time: f64, feed: impl Fn(f64, [f64; 2]) -> [f64; 5]) -> Vec<(f64, f64)> {
    let (speed, slip, flux, h) = (100.0, 4.0, 0.95, 5e-5);
    let (_, truth) = steady_voltage(c, speed, slip, flux, 0.0);
    let mut x = [truth[0] + 5.0, truth[1] * 0.95, truth[2], truth[3], truth[4]];
    let steps = (time / h).round() as u32;
    let mut errors = vec![(0.0, 100.0)];
    for k in 0..steps {
        let t = h * f64::from(k);
        rk4(&mut x, h, |x| {
            // The true state at the step's start: the error of the half-step shift is far below the speed errors seen.
            let (u, truth) = steady_voltage(c, speed, slip, flux, t);
            let angle = (c.n_p * speed + slip) * t;
            let mut d = model::derivative(c, x, u, 0.0);
            d[0] = -c.friction_rate * (x[0] - speed);
            let fed = feed(angle, [truth[3] - x[3], truth[4] - x[4]]);
            std::array::from_fn(|k| d[k] + fed[k])
        });
        errors.push((t + h, 100.0 * (x[0] - speed) / 5.0));
    }
    errors
}

/// L e.
pub fn times(gain: &Matrix<f64>, e: [f64; 2]) -> [f64; 5] {
    std::array::from_fn(|k| gain[(k, 0)] * e[0] + gain[(k, 1)] * e[1])
}

/// The box gain applied in a frame at `angle`: turn the error in, the correction out.
pub fn turning(design: &BoxDesign, frame_speed: f64) -> impl Fn(f64, [f64; 2]) -> [f64; 5] {
    let gain = &design.gain + &design.gain_per_frame_speed.scaled(&frame_speed);
    move |angle, e| {
        let (s, k) = angle.sin_cos();
        let out = times(&gain, [e[0] * k + e[1] * s, e[1] * k - e[0] * s]);
        let back = |x: f64, y: f64| [x * k - y * s, x * s + y * k];
        let ([la, lb], [ia, ib]) = (back(out[1], out[2]), back(out[3], out[4]));
        [out[0], la, lb, ia, ib]
    }
}
