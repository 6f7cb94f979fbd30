//! Currents from flux linkages: the T circuit's inductances, saturable, with the iron-loss branch as a third winding.
//!
//! Node equation for the magnetizing flux ψ_m:
//!
//! μ(|ψ_m|²) ψ_m/L_m + (ψ_m − ψ_fe) G/τ = f_s(ψ_s − ψ_m) + f_r(ψ_r − ψ_m),   f(ψ) = φ(|ψ|²) ψ/L_l,
//!
//! then i_s = f_s, i_r = f_r. Its left and right sides are gradients of convex energies, so that the solution is unique and the
//! map is monotone, invertible and lossless. Linear: solved at once. Main flux saturated: a scalar equation, as ψ_m points along
//! the linear solution; solved beforehand on a grid (a step then costs an interpolation instead of logarithms). Leakage
//! saturated: Newton's method in the plane.

use num_complex::Complex;

use crate::effects::{EffectId, Effects, LeakageFluxSaturation};
use crate::parameters::TParameters;
use crate::scalar::Scalar;
use crate::space_vector::norm2;

/// Currents and magnetizing flux.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Currents<T> {
    /// Stator current, A.
    pub i_s: Complex<T>,
    /// Rotor current, A.
    pub i_r: Complex<T>,
    /// Magnetizing flux linkage, Vs.
    pub psi_m: Complex<T>,
}

/// Intervals of the saturation grid: the interpolation error is below 1e-8 of the flux for exponents up to 10.
const INTERVALS: usize = 64;
/// Flux at the end of the grid over the reference flux.
const GRID_REACH: f64 = 1.75;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shape {
    /// No iron saturates.
    Linear,
    /// The magnetizing branch saturates.
    MainSaturated,
    /// Leakages saturate.
    General,
}

/// The flux-current map of one machine, prepared.
#[derive(Clone, Copy, Debug)]
pub struct FluxMap<T> {
    shape: Shape,
    /// 1/L_ls, 1/L_lr, 1/L_m, H⁻¹.
    inv_ls: T,
    inv_lr: T,
    inv_m: T,
    /// G/τ of the iron-loss branch, H⁻¹; zero when off.
    inv_fe: T,
    /// 1/(sum of the four).
    parallel: T,
    /// Intervals of the grid per squared flux, (Vs)⁻².
    per_interval: T,
    /// y and its slope per interval at the nodes.
    grid: [[T; 2]; INTERVALS + 1],
}

impl<T: Scalar> FluxMap<T> {
    /// Prepares the map of a valid machine.
    pub fn new(p: &TParameters<T>, effects: &Effects<T>) -> Self {
        let one = T::one();
        let [inv_ls, inv_lr, inv_m] =
            [p.stator_leakage_inductance_h, p.rotor_leakage_inductance_h, p.magnetizing_inductance_h].map(|l| one / l);
        let iron = &effects.iron_loss;
        let inv_fe = if effects.is_on(EffectId::IronLoss) { iron.conductance_s / iron.diffusion_time_s } else { T::zero() };
        let custom_on = effects.custom_ids().any(|c| effects.is_on(EffectId::Custom(c)));
        let shape = if effects.is_on(EffectId::LeakageFluxSaturation) {
            Shape::General
        } else if effects.is_on(EffectId::MainFluxSaturation) || custom_on {
            Shape::MainSaturated
        } else {
            Shape::Linear
        };
        let reach = effects.main_flux_saturation.reference_flux_vs * T::from_f64(GRID_REACH);
        let per_interval = T::from_f64(INTERVALS as f64) / (reach * reach);
        let parallel = one / (inv_ls + inv_lr + inv_m + inv_fe);
        let grid = [[one, T::zero()]; INTERVALS + 1];
        let mut map = Self { shape, inv_ls, inv_lr, inv_m, inv_fe, parallel, per_interval, grid };
        if effects.is_on(EffectId::MainFluxSaturation) || custom_on {
            for k in 0..=INTERVALS {
                let (y, slope) = map.solve_ratio(T::from_f64(k as f64) / per_interval, effects);
                map.grid[k] = [y, slope / per_interval];
            }
        }
        map
    }

    /// Currents at the given flux linkages.
    #[inline(always)]
    pub fn currents(&self, psi_s: Complex<T>, psi_r: Complex<T>, psi_fe: Complex<T>, effects: &Effects<T>) -> Currents<T> {
        let mut source = psi_s * self.inv_ls + psi_r * self.inv_lr;
        if !self.inv_fe.is_zero() {
            source += psi_fe * self.inv_fe;
        }
        let linear = source * self.parallel;
        match self.shape {
            Shape::Linear => self.unsaturated_leakages(psi_s, psi_r, linear),
            Shape::MainSaturated => self.unsaturated_leakages(psi_s, psi_r, linear * self.main_ratio(norm2(linear), effects)),
            Shape::General => {
                let start = linear * self.main_ratio(norm2(linear), effects);
                self.general(psi_s, psi_r, psi_fe, start, effects)
            }
        }
    }

    #[inline(always)]
    fn unsaturated_leakages(&self, psi_s: Complex<T>, psi_r: Complex<T>, psi_m: Complex<T>) -> Currents<T> {
        Currents { i_s: (psi_s - psi_m) * self.inv_ls, i_r: (psi_r - psi_m) * self.inv_lr, psi_m }
    }

    /// y = |ψ_m|/|ψ_0| in (0, 1], where ψ_0 is the linear solution, from the grid or, beyond it, solved.
    #[inline(always)]
    fn main_ratio(&self, psi_0_squared: T, effects: &Effects<T>) -> T {
        let x = psi_0_squared * self.per_interval;
        let k = x.value() as usize;
        if k >= INTERVALS {
            return self.solve_ratio(psi_0_squared, effects).0;
        }
        // Cubic Hermite between nodes: values and slopes are exact there.
        let t = x - T::from_f64(k as f64);
        let ([y0, m0], [y1, m1]) = (self.grid[k], self.grid[k + 1]);
        let rise = y1 - y0;
        let (b, c) = (rise - m0, m1 - rise);
        y0 + t * (m0 + t * (b + b - c + t * (c - b)))
    }

    /// y and dy/d|ψ_0|² of y (1 + ε(μ(y²|ψ_0|²) − 1)) = 1, ε = parallel/L_m.
    fn solve_ratio(&self, psi_0_squared: T, effects: &Effects<T>) -> (T, T) {
        let eps = self.inv_m * self.parallel;
        let one = T::one();
        let two = T::from_f64(2.0);
        let mut y = one;
        let mut slope_by_flux = T::zero();
        // The residual is convex and increasing: Newton from y = 1 descends to the root without overshoot.
        for _ in 0..60 {
            let y2 = y * y;
            let (mu, dmu) = effects.reluctance(y2 * psi_0_squared);
            let excess = eps * (mu - one);
            let residual = y * (one + excess) - one;
            let slope = one + excess + two * eps * dmu * y2 * psi_0_squared;
            slope_by_flux = -(y * y2 * eps * dmu) / slope;
            let step = residual / slope;
            y -= step;
            // Quadratic convergence: the step after this one would be below rounding.
            if step.value().abs() < 1e-9 {
                break;
            }
        }
        (y, slope_by_flux)
    }

    fn leakage(&self, psi: Complex<T>, inv_l: T, law: &LeakageFluxSaturation<T>) -> (Complex<T>, [T; 3]) {
        let (phi, dphi) = law.factor(norm2(psi), inv_l);
        let two = T::from_f64(2.0);
        let (a, b) = (inv_l * phi, two * inv_l * dphi);
        (psi * a, [a + b * psi.re * psi.re, b * psi.re * psi.im, a + b * psi.im * psi.im])
    }

    #[inline(never)]
    fn general(
        &self,
        psi_s: Complex<T>,
        psi_r: Complex<T>,
        psi_fe: Complex<T>,
        start: Complex<T>,
        effects: &Effects<T>,
    ) -> Currents<T> {
        let law = &effects.leakage_flux_saturation;
        let two = T::from_f64(2.0);
        let mut m = start;
        let (mut i_s, mut i_r) = (start, start);
        for _ in 0..40 {
            let (mu, dmu) = effects.reluctance(norm2(m));
            let (fs, ds) = self.leakage(psi_s - m, self.inv_ls, law);
            let (fr, dr) = self.leakage(psi_r - m, self.inv_lr, law);
            (i_s, i_r) = (fs, fr);
            let residual = m * (self.inv_m * mu) + (m - psi_fe) * self.inv_fe - fs - fr;
            let (a, b) = (self.inv_m * mu + self.inv_fe, two * self.inv_m * dmu);
            let j11 = a + b * m.re * m.re + ds[0] + dr[0];
            let j12 = b * m.re * m.im + ds[1] + dr[1];
            let j22 = a + b * m.im * m.im + ds[2] + dr[2];
            let det = j11 * j22 - j12 * j12;
            let step = Complex::new((j22 * residual.re - j12 * residual.im) / det, (j11 * residual.im - j12 * residual.re) / det);
            m -= step;
            // Quadratic convergence: the step after this one would be below rounding.
            if norm2(step).value() <= 1e-17 * norm2(m).value() {
                break;
            }
        }
        Currents { i_s, i_r, psi_m: m }
    }

    /// Magnetic energy stored, J (with the 3/2).
    pub fn energy(&self, psi_s: Complex<T>, psi_r: Complex<T>, psi_fe: Complex<T>, effects: &Effects<T>) -> T {
        let psi_m = self.currents(psi_s, psi_r, psi_fe, effects).psi_m;
        let half = T::from_f64(0.5);
        let (ls, lr, m) = (norm2(psi_s - psi_m), norm2(psi_r - psi_m), norm2(psi_m));
        let mut w = half * (ls * self.inv_ls + lr * self.inv_lr + m * self.inv_m + norm2(psi_m - psi_fe) * self.inv_fe);
        let l_m = T::one() / self.inv_m;
        w += effects.main_flux_saturation.energy(m, l_m);
        w += effects.leakage_flux_saturation.energy(ls, self.inv_ls) + effects.leakage_flux_saturation.energy(lr, self.inv_lr);
        w * T::from_f64(1.5)
    }
}
