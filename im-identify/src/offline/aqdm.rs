//! The table of the alternative q-d model (AQDM) from steady states, as its authors characterize a machine: torque and voltage at currents and slips.
//!
//! ```text
//! 1/z = −jΓ_m(λ) + ω_s/(jω_s L_lr(λ) + 1/Y_r(jω_s)),   √2 I = λ/|z|,   T = (3/2)n_p λ² Re(1/z),   U = |R_s + jω_e l_s1 + ω_e z| I    (Kwon et al., (22) to (25))
//! ```
//!
//! Levenberg-Marquardt on the logarithms of torque and voltage; where what is fitted is a size, so is its logarithm. What the points do not tell stays near
//! the guess: a factor of e counts like an error of 0.01 %. R_s, the mechanics and the third branch of Y_r are held.

use im_model::Complex;
use im_model::aqdm::Aqdm;
use nalgebra::{DMatrix, DVector};

/// A steady state that was measured, per winding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SteadyPoint {
    /// ω_e, electrical rad/s.
    pub frequency_rad_s: f64,
    /// ω_s, electrical rad/s.
    pub slip_rad_s: f64,
    /// I, A rms.
    pub current_rms_a: f64,
    /// T, Nm.
    pub torque_nm: f64,
    /// U, V rms.
    pub voltage_rms_v: f64,
}

/// A table, and how well it suits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AqdmFit {
    /// What was found.
    pub table: Aqdm,
    /// Root of the mean squared relative error of torque and voltage.
    pub rms: f64,
}

/// l_s1; l_r1 … l_r4; m₁ … m₆; y and τ of the first two branches.
const PARAMETERS: usize = 15;
/// m₄ and m₆ are places on the flux axis, not sizes.
const PLACES: [usize; 2] = [8, 10];

fn values(t: &Aqdm) -> [f64; PARAMETERS] {
    let ([a, b, c, d], [m1, m2, m3, m4, m5, m6]) = (t.rotor_leakage, t.magnetizing);
    let [[y1, t1], [y2, t2], _] = t.rotor;
    [t.stator_leakage_h, a, b, c, d, m1, m2, m3, m4, m5, m6, y1, t1, y2, t2]
}

fn moved(guess: &Aqdm, by: &DVector<f64>) -> Aqdm {
    let mut v = values(guess);
    for (k, x) in v.iter_mut().enumerate() {
        *x = if PLACES.contains(&k) { *x + by[k] } else { *x * by[k].exp() };
    }
    let [l_ls, a, b, c, d, m1, m2, m3, m4, m5, m6, y1, t1, y2, t2] = v;
    Aqdm {
        stator_leakage_h: l_ls,
        rotor_leakage: [a, b, c, d],
        magnetizing: [m1, m2, m3, m4, m5, m6],
        rotor: [[y1, t1], [y2, t2], guess.rotor[2]],
        ..*guess
    }
}

/// 1/z at a flux and a slip.
fn admittance(t: &Aqdm, flux: f64, slip: f64) -> Complex<f64> {
    let rotor: Complex<f64> = t.rotor.iter().map(|[y, tau]| Complex::new(*y, 0.0) / Complex::new(1.0, tau * slip)).sum();
    Complex::new(slip, 0.0) / (Complex::new(0.0, slip * t.rotor_leakage(flux)) + rotor.inv())
        - Complex::new(0.0, t.inverse_magnetizing(flux))
}

/// Torque and voltage of a table at the current, slip and frequency of a point.
pub fn predicted(t: &Aqdm, p: &SteadyPoint) -> [f64; 2] {
    // The current grows with the flux: bisection, up to what no winding has.
    let (mut low, mut high) = (1e-9, 1e3 * p.voltage_rms_v / p.frequency_rad_s);
    for _ in 0..70 {
        let flux = 0.5 * (low + high);
        let current = flux * admittance(t, flux, p.slip_rad_s).norm() / std::f64::consts::SQRT_2;
        if current < p.current_rms_a { low = flux } else { high = flux }
    }
    let y = admittance(t, low, p.slip_rad_s);
    let z = Complex::new(t.stator_resistance_ohm, p.frequency_rad_s * t.stator_leakage_h) + y.inv() * p.frequency_rad_s;
    [1.5 * f64::from(t.pole_pairs) * low * low * y.re, z.norm() * p.current_rms_a]
}

/// The table that suits the points, from a guess.
pub fn fit_aqdm(guess: &Aqdm, points: &[SteadyPoint]) -> AqdmFit {
    let n = 2 * points.len();
    let prior = 1e-4;
    let errors = |x: &DVector<f64>| {
        let t = moved(guess, x);
        let own = points.iter().flat_map(|p| {
            let [torque, voltage] = predicted(&t, p);
            [(torque / p.torque_nm).abs().max(1e-9).ln(), (voltage / p.voltage_rms_v).max(1e-9).ln()]
        });
        DVector::from_iterator(n + PARAMETERS, own.chain(x.iter().map(|x| prior * x)))
    };
    let mut x = DVector::zeros(PARAMETERS);
    let mut r = errors(&x);
    let mut damping = 1e-3;
    for _ in 0..100 {
        let step = 1e-6;
        let columns: Vec<_> = (0..PARAMETERS)
            .map(|k| {
                let (mut above, mut below) = (x.clone(), x.clone());
                above[k] += step;
                below[k] -= step;
                (errors(&above) - errors(&below)) / (2.0 * step)
            })
            .collect();
        let jacobian = DMatrix::from_columns(&columns);
        let normal = jacobian.tr_mul(&jacobian);
        let gradient = jacobian.tr_mul(&r);
        let before = r.norm_squared();
        let mut better = false;
        while damping < 1e9 {
            let damped = &normal + DMatrix::from_diagonal(&normal.diagonal()) * damping;
            let Some(by) = damped.cholesky().map(|c| c.solve(&gradient)) else { break };
            // No more than a factor of e at a time.
            let shorter = (1.0 / by.amax()).min(1.0);
            let next = &x - by * shorter;
            let found = errors(&next);
            if found.norm_squared() < before {
                (x, r, better) = (next, found, true);
                damping *= 0.2;
                break;
            }
            damping *= 5.0;
        }
        if !better || before - r.norm_squared() < 1e-9 * before {
            break;
        }
    }
    let own = r.rows(0, n).norm_squared() / (n as f64).max(1.0);
    AqdmFit { table: moved(guess, &x), rms: own.sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::machines::KWON_TABLE_V;

    /// Points of the circuit of Table V, from a tenth to twice the rated current, at 30 and 60 Hz; a little wrong, if asked for.
    fn points(noise: f64, shift: f64) -> Vec<SteadyPoint> {
        let mut all = Vec::new();
        for (k, current) in [4.0, 8.0, 15.0, 25.0, 40.0, 60.0].into_iter().enumerate() {
            for (n, slip) in [0.6, 1.2, 2.0, 3.5, 7.0, 20.0, 80.0].into_iter().enumerate() {
                let frequency_rad_s = if (k + n) % 2 == 0 { 188.5 } else { 377.0 };
                let bare = SteadyPoint {
                    frequency_rad_s,
                    slip_rad_s: slip * shift,
                    current_rms_a: current * shift,
                    torque_nm: 1.0,
                    voltage_rms_v: 460.0,
                };
                let [torque, voltage] = predicted(&KWON_TABLE_V, &bare);
                let wrong = |m: usize| 1.0 + noise * (1.7 * (7 * k + 3 * n + m) as f64).sin();
                all.push(SteadyPoint { torque_nm: torque * wrong(0), voltage_rms_v: voltage * wrong(5), ..bare });
            }
        }
        all
    }

    /// What is known before: an unsaturated machine about right, with the second branch of any deep bar.
    fn guess() -> Aqdm {
        Aqdm {
            stator_leakage_h: 1.4e-3,
            rotor_leakage: [4e-4, 3e-3, 1.0, 2.0],
            magnetizing: [9.0, 0.3, 4.0, 2.0, 0.6, 0.5],
            rotor: [[4.5, 2e-2], [0.1, 1e-3], KWON_TABLE_V.rotor[2]],
            ..KWON_TABLE_V
        }
    }

    #[test]
    fn a_table_is_found_again_from_its_steady_states() {
        let found = fit_aqdm(&guess(), &points(0.0, 1.0));
        let between = points(0.0, 1.3);
        let worst = |t: &Aqdm| {
            between.iter().fold(0.0f64, |w, p| {
                let [torque, voltage] = predicted(t, p);
                w.max((torque / p.torque_nm - 1.0).abs()).max((voltage / p.voltage_rms_v - 1.0).abs())
            })
        };
        println!(
            "rms {:.5}, worst between {:.4}, of the guess {:.2}\n{:?}",
            found.rms,
            worst(&found.table),
            worst(&guess()),
            found.table
        );
        assert!(found.rms < 1e-3 && worst(&guess()) > 0.2 && worst(&found.table) < 0.01);
    }

    #[test]
    fn errors_of_a_percent_move_it_by_about_as_much() {
        let found = fit_aqdm(&guess(), &points(0.01, 1.0));
        assert!(found.rms < 0.012);
        for p in points(0.0, 1.0) {
            let [torque, voltage] = predicted(&found.table, &p);
            assert!((torque / p.torque_nm - 1.0).abs() < 0.02 && (voltage / p.voltage_rms_v - 1.0).abs() < 0.02, "{p:?}");
        }
    }
}
