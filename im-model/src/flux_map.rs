//! Currents from flux linkages: the T circuit's inductances, saturable, with branches across the core (iron loss) as a third winding.
//!
//! Node equation for the magnetizing flux ψ_m:
//!
//! μ(|ψ_m|²) ψ_m/L_m + (ψ_m − ψ_c)/L_c = f_s(ψ_s − ψ_m) + f_r(ψ_r − ψ_m),   f(ψ) = φ(|ψ|²) ψ/L_l,
//!
//! then i_s = f_s, i_r = f_r. Its left and right sides are gradients of convex energies, so that the solution is unique and the
//! map is monotone, invertible and lossless. Linear: solved at once. Main flux saturated: a scalar equation, as ψ_m points along
//! the linear solution; solved beforehand on a grid (a step then costs an interpolation instead of logarithms; being a function
//! along ψ_0, the interpolated map is the gradient of an energy too, so that no power is lost or made). Leakage saturated:
//! Newton's method in the plane.

use num_complex::Complex;
use num_traits::{One, Zero};

use crate::air_gap::{AirGapSaturation, PreparedGap};
use crate::effects::{Active, Effects, LeakageLaw};
use crate::instant::Currents;
use crate::parameters::TParameters;
use crate::scalar::Scalar;
use crate::space_vector::norm2;

/// The interval of the grid that x ≥ 0 lies in. By way of i32: processors convert to signed numbers in one instruction.
#[inline(always)]
fn interval(x: f64) -> u32 {
    (x as i32).cast_unsigned()
}

/// The values without derivatives.
fn real<T: Scalar>(x: Complex<T>) -> Complex<T::Real> {
    Complex::new(x.re.real(), x.im.real())
}

/// Intervals of the saturation grid; the test `the_grid_is_as_good_as_the_law` states the interpolation error.
const INTERVALS: usize = 128;
/// Flux at the end of the grid over the reference flux.
const GRID_REACH: f64 = 1.75;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shape {
    /// Two coupled windings.
    Linear,
    /// No iron saturates, but a branch across the core is a third winding.
    Lossy,
    /// The magnetizing branch saturates.
    MainSaturated,
    /// Leakages saturate.
    General,
    /// Iron and rotor leakage saturate with the air-gap flux.
    AirGap,
}

/// The flux-current map of one machine, prepared.
#[derive(Clone, Copy, Debug)]
pub struct FluxMap<T> {
    shape: Shape,
    on: Active,
    /// How the leakages of stator and rotor saturate.
    leakages: [LeakageLaw<T>; 2],
    /// 1/L_ls, 1/L_lr, 1/L_m, H⁻¹.
    inv_ls: T,
    inv_lr: T,
    inv_m: T,
    /// 1/L_c of the branch across the core, H⁻¹; zero when there is none.
    inv_c: T,
    /// 1/(sum of the four).
    parallel: T,
    /// Without saturation and iron loss: i_s = Γ_s ψ_s − Γ_m ψ_r, i_r = Γ_r ψ_r − Γ_m ψ_s, as [Γ_s, Γ_m, Γ_r], H⁻¹.
    inverse_inductances: [T; 3],
    /// Intervals of the grid per squared flux, (Vs)⁻².
    per_interval: T,
    /// On each interval, the coefficients of the cubic in t ∈ [0, 1) that has the values and slopes of y at the nodes.
    grid: [[T; 4]; INTERVALS],
    /// The machine's own air gap, if it has one.
    air_gap: Option<PreparedGap<T>>,
}

impl<T: Scalar> FluxMap<T> {
    /// Prepares the map of a valid machine.
    pub fn new(p: &TParameters<T>, effects: &Effects<T>, air_gap: Option<&AirGapSaturation<T>>) -> Self {
        let one = T::one();
        let [inv_ls, inv_lr, inv_m] =
            [p.stator_leakage_inductance_h, p.rotor_leakage_inductance_h, p.magnetizing_inductance_h].map(|l| one / l);
        let on = effects.which();
        let inv_c = effects.core_branch(on, T::zero());
        let laws = [inv_ls, inv_lr].map(|inv_l| effects.leakage(on, None, inv_l));
        let reach = effects.reference_flux() * T::from_f64(GRID_REACH);
        // A law that leaves the reluctance alone at the end of the grid does so everywhere.
        let (mu, dmu) = effects.reluctance(on, (one, T::zero()), reach * reach);
        let saturated = !((mu - one).is_zero() && dmu.is_zero());
        let shape = if air_gap.is_some() {
            Shape::AirGap
        } else if laws.iter().any(Option::is_some) {
            Shape::General
        } else if saturated {
            Shape::MainSaturated
        } else if !inv_c.is_zero() {
            Shape::Lossy
        } else {
            Shape::Linear
        };
        let per_interval = T::from_f64(INTERVALS as f64) / (reach * reach);
        let parallel = one / (inv_ls + inv_lr + inv_m + inv_c);
        // Without saturation y = 1 everywhere.
        let flat = [one, T::zero(), T::zero(), T::zero()];
        // With p = 1/(1/L_ls + 1/L_lr + 1/L_m): Γ_s = p (1/L_lr + 1/L_m)/L_ls, free of differences of near-equal numbers.
        let mutual = parallel * inv_ls * inv_lr;
        let inverse_inductances = [mutual + parallel * inv_ls * inv_m, mutual, mutual + parallel * inv_lr * inv_m];
        let (leakages, grid) = (laws.map(Option::unwrap_or_default), [flat; INTERVALS]);
        let air_gap = air_gap.map(|gap| PreparedGap::new(gap, p));
        let mut map = Self {
            shape,
            on,
            leakages,
            inv_ls,
            inv_lr,
            inv_m,
            inv_c,
            parallel,
            inverse_inductances,
            per_interval,
            grid,
            air_gap,
        };
        if saturated && shape != Shape::AirGap {
            let node = |k: usize| {
                let (y, slope) = map.solve_ratio(T::from_f64(k as f64) / per_interval, effects);
                (y, slope / per_interval)
            };
            let mut left = node(0);
            let mut grid = map.grid;
            for (k, cubic) in grid.iter_mut().enumerate() {
                let right = node(k + 1);
                let ((y0, m0), (y1, m1)) = (left, right);
                let (b, c) = (y1 - y0 - m0, m1 - (y1 - y0));
                *cubic = [y0, m0, b + b - c, c - b];
                left = right;
            }
            map.grid = grid;
        }
        map
    }

    /// Currents at the given flux linkages; `core` is the sum of ψ_c/L_c, A.
    #[inline(always)]
    pub fn currents(&self, psi_s: Complex<T>, psi_r: Complex<T>, core: Complex<T>, effects: &Effects<T>) -> Currents<T> {
        match self.shape {
            Shape::Linear => {
                let [s, m, r] = &self.inverse_inductances;
                Currents {
                    i_s: psi_s * *s - psi_r * *m,
                    i_r: psi_r * *r - psi_s * *m,
                    psi_m: self.linear_flux(psi_s, psi_r, core),
                }
            }
            Shape::Lossy => self.unsaturated_leakages(psi_s, psi_r, self.linear_flux(psi_s, psi_r, core)),
            Shape::MainSaturated => {
                let linear = self.linear_flux(psi_s, psi_r, core);
                self.unsaturated_leakages(psi_s, psi_r, linear * self.main_ratio(norm2(linear), effects))
            }
            Shape::General => self.saturated_leakages(psi_s, psi_r, self.linear_flux(psi_s, psi_r, core), effects),
            Shape::AirGap => self.through_air_gap(psi_s, psi_r, core, effects),
        }
    }

    /// With what effects add to the reluctance: (μ − 1)/L_m.
    fn through_air_gap(&self, psi_s: Complex<T>, psi_r: Complex<T>, core: Complex<T>, effects: &Effects<T>) -> Currents<T> {
        let Some(gap) = &self.air_gap else {
            return self.unsaturated_leakages(psi_s, psi_r, self.linear_flux(psi_s, psi_r, core));
        };
        let added = |flux: T| {
            let (mu, slope) = effects.reluctance(self.on, (T::one(), T::zero()), flux * flux);
            (self.inv_m * (mu - T::one()), self.inv_m * slope * (flux + flux))
        };
        let [i_s, i_r, psi_m] = gap.currents(psi_s, psi_r, core, self.inv_c, added);
        Currents { i_s, i_r, psi_m }
    }

    /// The machine's own air gap.
    pub(crate) fn air_gap(&self) -> Option<&AirGapSaturation<T>> {
        self.air_gap.as_ref().map(PreparedGap::gap)
    }

    /// ψ_m of the circuit without saturation.
    #[inline(always)]
    fn linear_flux(&self, psi_s: Complex<T>, psi_r: Complex<T>, core: Complex<T>) -> Complex<T> {
        let mut source = psi_s * self.inv_ls + psi_r * self.inv_lr;
        if !self.inv_c.is_zero() {
            source += core;
        }
        source * self.parallel
    }

    #[inline(always)]
    fn unsaturated_leakages(&self, psi_s: Complex<T>, psi_r: Complex<T>, psi_m: Complex<T>) -> Currents<T> {
        Currents { i_s: (psi_s - psi_m) * self.inv_ls, i_r: (psi_r - psi_m) * self.inv_lr, psi_m }
    }

    /// y = |ψ_m|/|ψ_0| in (0, 1], where ψ_0 is the linear solution, from the grid or, beyond it, solved.
    #[inline(always)]
    fn main_ratio(&self, psi_0_squared: T, effects: &Effects<T>) -> T {
        let x = psi_0_squared * self.per_interval;
        let k = interval(x.value());
        let Some(&[a, b, c, d]) = self.grid.get(k as usize) else {
            return self.solve_ratio(psi_0_squared, effects).0;
        };
        let t = x - T::from_f64(f64::from(k));
        a + t * (b + t * (c + t * d))
    }

    /// y and dy/d|ψ_0|², without derivatives by parameters.
    #[inline(always)]
    fn main_ratio_and_slope(&self, psi_0_squared: T::Real, effects: &Effects<T>) -> (T::Real, T::Real) {
        let per_interval = self.per_interval.real();
        let x = psi_0_squared * per_interval;
        let k = interval(x.value());
        let Some(cubic) = self.grid.get(k as usize) else {
            let (y, slope) = self.solve_ratio(T::from_real(psi_0_squared), effects);
            return (y.real(), slope.real());
        };
        let [a, b, c, d] = cubic.map(T::real);
        let t = x - T::Real::from_f64(f64::from(k));
        let dt = t * d;
        (a + t * (b + t * (c + dt)), (b + t * ((c + c) + (dt + dt + dt))) * per_interval)
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
            let (mu, dmu) = effects.reluctance(self.on, (one, T::zero()), y2 * psi_0_squared);
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

    /// The leakages' saturation as a current added to the source: ψ_m = G(b_0 + δ(ψ_s − ψ_m) + δ(ψ_r − ψ_m)), where δ(ψ) =
    /// (φ − 1) ψ/L_l and G is the map of the machine with linear leakages, which the grid knows.
    ///
    /// Newton's method in the plane of ψ_m runs on the values; where derivatives are carried, one more step with them in the
    /// residual only makes them exact (implicit function theorem).
    #[inline(never)]
    fn saturated_leakages(&self, psi_s: Complex<T>, psi_r: Complex<T>, linear: Complex<T>, effects: &Effects<T>) -> Currents<T> {
        let [stator, rotor] = &self.leakages;
        let (m, inverse) =
            self.solve_magnetizing_flux(real(psi_s), real(psi_r), real(linear), [stator.real(), rotor.real()], effects);
        let mut psi_m = Complex::new(T::from_real(m.re), T::from_real(m.im));
        if T::DERIVATIVES {
            let z = linear + (stator.correction(psi_s - psi_m) + rotor.correction(psi_r - psi_m)) * self.parallel;
            let residual = psi_m - z * self.main_ratio(norm2(z), effects);
            let [a, b, c, d] = inverse.map(|x| x.value());
            psi_m.re -= residual.re.scale(a) + residual.im.scale(b);
            psi_m.im -= residual.re.scale(c) + residual.im.scale(d);
        }
        let (s, r) = (psi_s - psi_m, psi_r - psi_m);
        Currents { i_s: s * self.inv_ls + stator.correction(s), i_r: r * self.inv_lr + rotor.correction(r), psi_m }
    }

    /// ψ_m and the inverse of the equation's Jacobian, row by row, without derivatives by parameters.
    #[inline(always)]
    fn solve_magnetizing_flux(
        &self,
        psi_s: Complex<T::Real>,
        psi_r: Complex<T::Real>,
        linear: Complex<T::Real>,
        [stator, rotor]: [LeakageLaw<T::Real>; 2],
        effects: &Effects<T>,
    ) -> (Complex<T::Real>, [T::Real; 4]) {
        let one = T::Real::one();
        let parallel = self.parallel.real();
        // The step that is left is of the order of the last one squared: below 1e-11 of the flux. Derivatives are as good as the
        // Jacobian, hence as the last step itself.
        let last_step_squared = if T::DERIVATIVES { 1e-20 } else { 1e-11 };
        let mut m = linear * self.main_ratio_and_slope(norm2(linear), effects).0;
        let (mut adjugate, mut inverse_det) = ([one, T::Real::zero(), T::Real::zero(), one], one);
        for _ in 0..40 {
            let (add_s, ds) = stator.correction_and_slope(psi_s - m);
            let (add_r, dr) = rotor.correction_and_slope(psi_r - m);
            let z = linear + (add_s + add_r) * parallel;
            let (y, slope) = self.main_ratio_and_slope(norm2(z), effects);
            let residual = m - z * y;
            // J = 1 + g d with the symmetric g = ∂ψ_m/∂z = y + 2 y' z zᵀ and d = −∂z/∂m = p (Dδ_s + Dδ_r).
            let two_slope = slope + slope;
            let g = [y + two_slope * z.re * z.re, two_slope * z.re * z.im, y + two_slope * z.im * z.im];
            let d = [0, 1, 2].map(|k| parallel * (ds[k] + dr[k]));
            let j = [
                one + g[0] * d[0] + g[1] * d[1],
                g[0] * d[1] + g[1] * d[2],
                g[1] * d[0] + g[2] * d[1],
                one + g[1] * d[1] + g[2] * d[2],
            ];
            let k = one / (j[0] * j[3] - j[1] * j[2]);
            adjugate = [j[3], -j[1], -j[2], j[0]];
            let step = Complex::new(j[3] * residual.re - j[1] * residual.im, j[0] * residual.im - j[2] * residual.re) * k;
            inverse_det = k;
            m -= step;
            if norm2(step).value() <= last_step_squared * norm2(m).value() {
                break;
            }
        }
        (m, adjugate.map(|x| x * inverse_det))
    }

    /// Γ_s and Γ_r: how i_s rises with ψ_s and i_r with ψ_r where nothing saturates, H⁻¹.
    #[inline(always)]
    pub(crate) fn unsaturated_slopes(&self) -> [T; 2] {
        let [s, _, r] = self.inverse_inductances;
        [s, r]
    }

    /// How much more steeply than its unsaturated value a leakage current can rise with its flux, at most.
    pub(crate) fn steepest_leakage(&self) -> f64 {
        if let Some(gap) = &self.air_gap {
            return gap.steepest().value();
        }
        let [s, r] = &self.leakages;
        1.0 + s.drop(self.inv_ls).value().max(r.drop(self.inv_lr).value())
    }

    /// Magnetic energy stored, J (with the 3/2), but for that of the branches across the core.
    pub fn energy(&self, psi_s: Complex<T>, psi_r: Complex<T>, core: Complex<T>, effects: &Effects<T>) -> T {
        let psi_m = self.currents(psi_s, psi_r, core, effects).psi_m;
        let half = T::from_f64(0.5);
        let (ls, lr, m) = (norm2(psi_s - psi_m), norm2(psi_r - psi_m), norm2(psi_m));
        let mut w = match &self.air_gap {
            None => half * (ls * self.inv_ls + lr * self.inv_lr + m * self.inv_m),
            Some(gap) => gap.energy(psi_s, psi_r, psi_m),
        };
        w += self.inv_m * half * effects.reluctance_integral(self.on, m);
        for (law, squared) in self.leakages.iter().zip([ls, lr]) {
            w += law.energy(squared);
        }
        w * T::from_f64(1.5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machines::MOTULATOR_2_2_KW;

    fn effects(set: impl Fn(&mut Effects<f64>)) -> (TParameters<f64>, Effects<f64>) {
        let mut e = Effects::none();
        set(&mut e);
        (MOTULATOR_2_2_KW.parameters(), e)
    }

    /// The error of a cubic on an interval of 1/128 of the squared reach falls with the fourth derivative of y: below 1e-8 of the
    /// reference flux for the usual exponents. Below 4 the curve has a singular derivative at zero flux, where the error of the
    /// first interval is up to 1e-6.
    #[test]
    fn the_grid_is_as_good_as_the_law() {
        for exponent in [3.0, 4.0, 5.0, 7.0, 10.0, 20.0] {
            for excess in [0.1, 0.5, 2.0] {
                let (p, e) = effects(|e| {
                    e.main_flux_saturation.excess = excess;
                    e.main_flux_saturation.exponent = exponent;
                });
                let map = FluxMap::new(&p, &e, None);
                let error = |psi: f64| {
                    let q = psi * psi;
                    (map.main_ratio(q, &e) - map.solve_ratio(q, &e).0).abs() * psi
                };
                let worst = (0..20_000).map(|k| error(1.8 * f64::from(k) / 20_000.0)).fold(0.0, f64::max);
                let bound = if exponent < 4.0 {
                    1e-6
                } else if exponent <= 10.0 {
                    1e-8
                } else {
                    5e-8
                };
                assert!(worst < bound, "exponent {exponent}, excess {excess}: {worst:e}");
            }
        }
    }

    /// The node equation itself, with the laws as the cards print them; the tolerance is the grid's.
    #[test]
    fn currents_solve_the_node_equation_with_every_saturation() {
        let (p, e) = effects(|e| {
            e.main_flux_saturation.excess = 0.8;
            e.leakage_flux_saturation.drop = 1.2;
            e.leakage_flux_saturation.knee_current_a = 10.0;
            e.iron_loss.conductance_s = 2e-3;
        });
        let map = FluxMap::new(&p, &e, None);
        let k = &e.leakage_flux_saturation;
        let current = |psi: Complex<f64>, l: f64| {
            let q = psi.norm_sqr() / (l * k.knee_current_a).powi(2);
            psi / l * (1.0 + k.drop * q / (1.0 + q))
        };
        for n in 0..200 {
            // From rated flux at no load to many times the rated current.
            let (a, b) = (f64::from(n) * 0.37, 0.002 * f64::from(n));
            let psi_s = Complex::from_polar(0.9, a);
            let psi_r = psi_s + Complex::from_polar(b, 2.0 * a);
            let psi_fe = psi_s * 0.95;
            let inv_c = e.iron_loss.conductance_s / e.iron_loss.diffusion_time_s;
            let c = map.currents(psi_s, psi_r, psi_fe * inv_c, &e);
            let i_m = c.psi_m / p.magnetizing_inductance_h * (1.0 + 0.8 * c.psi_m.norm().powi(7));
            let i_fe = (c.psi_m - psi_fe) * inv_c;
            assert!((c.i_s - current(psi_s - c.psi_m, p.stator_leakage_inductance_h)).norm() < 1e-12 * (1.0 + c.i_s.norm()));
            // 1e-8 Vs of the grid over the parallel of the inductances, 5 mH, times up to 1 + 3κ of saturated leakages.
            assert!((c.i_s + c.i_r - i_m - i_fe).norm() < 1e-5, "sample {n}: {}", c.i_s + c.i_r - i_m - i_fe);
        }
    }
}
