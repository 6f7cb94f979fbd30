//! Switching gains of Kenné et al. (2005): k_sq, k_sd of (25), (26), K of (34), k_Rr, over a region.
//!
//! With λ, i as complex numbers, X = Re λ*i, Y = Im λ*i, w = n_pω, k = R_s/σL_s + R_r/σL_r, derivation gives
//!
//! ```text
//! ω̈       = −kμY − wμ(β|λ|² + X) − (D/J)ω̇ − Ṫ_L/J          + b_ω v_sq,  b_ω = μ|λ|/σL_s
//! (|λ|²)¨ = η²(4|λ|² − 4MX + 2M²|i|² + 2Mβ|λ|²) + 2ηM(wY − kX) + b_λ v_sd,  b_λ = 2ηM|λ|/σL_s
//! ```
//!
//! (the printed (8), (11), (13), (14), (21) differ in signs and factors). Bounds over the region follow term by term from
//! |X|, |Y| ≤ |λ||i|. Resistances enter as ratios to their nominal values; the law uses the nominal ones.
//!
//! For (34): on the machine's trajectories f₁ = β di_r/dt, and i_r = λ/σL_r − βψ_s with ψ_s the stator's flux, so that
//!
//! ```text
//! f₁ = β[(1/σL_r) dλ/dt − β(u_s − R_s i)] = β{(R_rM/σL_r² + βR_s) i − (1/σL_r)(R_r/L_r − jw)λ − βu_s},
//! max|f₁| = β{(R_rM/σL_r² + βR_s) i_max + (1/σL_r)√((R_r/L_r)² + w²) |λ|_max + βu_max}
//! ```
//!
//! at the largest R_s, R_r: λ, i and u_s may point anywhere, so every term reaches its bound at once and no smaller K holds over
//! the region. The law's R_s is taken as right in (34), as in the paper.

use crate::certificate::{Certificate, Claim, Obligation, Plant};
use crate::error::{DesignError, positive};
use crate::exact::Field;
use crate::machine::Constants;
use serde::{Deserialize, Serialize};

/// Where the gains must hold, and how fast.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KenneRegion {
    /// |ω| up to this mechanical speed, rad/s.
    pub speed_max_rad_s: f64,
    /// Rotor flux linkage amplitudes, Wb.
    pub flux_vs: [f64; 2],
    /// Relative error of the estimated flux amplitude, below 1.
    pub flux_uncertainty: f64,
    /// |i_s| up to this, A.
    pub current_max_a: f64,
    /// |u_s| up to this, V (peak): 2/3 of the DC link's voltage for an inverter that may switch as it likes.
    pub voltage_max_v: f64,
    /// R_s over nominal.
    pub stator_resistance_ratio: [f64; 2],
    /// R_r over nominal, and R̂_r.
    pub rotor_resistance_ratio: [f64; 2],
    /// |dω/dt| up to this, rad/s².
    pub acceleration_max_rad_s2: f64,
    /// |ω̈_ref + c_ω ω̇_ref| up to this, rad/s³.
    pub reference_max_rad_s3: f64,
    /// Error of the load torque the law uses, over the inertia, rad/s².
    pub load_error_rad_s2: f64,
    /// |dT_L/dt|/J up to this, rad/s³.
    pub load_rate_rad_s3: f64,
    /// |dR_r/dt|/R_rn up to this, 1/s.
    pub rotor_resistance_rate_per_s: f64,
    /// c_ω of (17), 1/s.
    pub c_omega: f64,
    /// c_λ of (17), 1/s.
    pub c_lambda: f64,
    /// η_ω of (24), rad/s³: the surface is reached within |s_ω(0)|/η_ω.
    pub reach_omega: f64,
    /// η_λ of (24), Wb²/s²: the surface is reached within |s_λ(0)|/η_λ.
    pub reach_lambda: f64,
}

impl KenneRegion {
    /// A machine known exactly, under a steady load and at steady references, with surfaces of some 0.1 s: what is uncertain is set on top.
    /// Speed in rad/s (mechanical), flux amplitudes in Wb, current in A, voltage in V (peak).
    pub fn certain(speed_max_rad_s: f64, flux_vs: [f64; 2], current_max_a: f64, voltage_max_v: f64) -> Self {
        Self {
            speed_max_rad_s,
            flux_vs,
            flux_uncertainty: 0.0,
            current_max_a,
            voltage_max_v,
            stator_resistance_ratio: [1.0, 1.0],
            rotor_resistance_ratio: [1.0, 1.0],
            acceleration_max_rad_s2: 1000.0,
            reference_max_rad_s3: 0.0,
            load_error_rad_s2: 0.0,
            load_rate_rad_s3: 0.0,
            rotor_resistance_rate_per_s: 1.0,
            c_omega: 15.0,
            c_lambda: 10.0,
            reach_omega: 100.0,
            reach_lambda: 1.0,
        }
    }
}

/// The gains, with their region.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KenneDesign {
    /// Where they hold.
    pub region: KenneRegion,
    /// k_vsq of (15), V.
    pub k_sq: f64,
    /// k_vsd of (16), V.
    pub k_sd: f64,
    /// K of (34), A/s².
    pub k_x: f64,
    /// k_Rr over the nominal rotor resistance, 1/s.
    pub k_rr_per_s: f64,
}

/// The bounds of the four gains over the region.
struct Bounds<F> {
    k_sq: F,
    k_sd: F,
    /// K of (34) is the first and the root of the second: exact numbers have no roots.
    k_x: [F; 2],
    k_rr: F,
}

/// What a surface's law asks for: (25) or (26), and what a sampling period adds.
#[derive(Clone)]
pub(crate) struct Rates<F> {
    /// Smallest and largest input gain b.
    pub input: [F; 2],
    /// k of the continuous law, V.
    pub k: F,
    /// E₁ of `sampled/switching.rs`: grows with the time since the sample.
    pub per_second: F,
    /// What may jump between samples.
    pub at_once: F,
}

/// Sizes that the laws' terms are made of: |λ|, |i|, w, and their rates.
struct Sizes<F> {
    flux: F,
    current: F,
    w: F,
    flux_rate: F,
    current_rate: F,
}

fn larger<F: Field>(a: F, b: F) -> F {
    if a > b { a } else { b }
}

fn magnitude<F: Field>(a: F) -> F {
    if a < F::zero() { -a } else { a }
}

fn square<F: Field>(x: F) -> F {
    x.clone() * x
}

/// R_r/σL_r at nominal resistance.
fn rotor_rate<F: Field>(c: &Constants<F>) -> F {
    c.gamma.clone() + c.eta.clone() - c.stator_rate.clone()
}

/// The two laws, [speed, flux]: (25) and (26) with F, b and |f̂| bounded over the region, and the rates of |f̂|.
///
/// The estimated flux, |λ̂| within 1 ± δ of the flux, enters b̂ and every term of f̂. A term of degree n in |λ| is off by at most
/// (1 + δ)ⁿ − 1 of itself, so that |f̂ − f| gains the law at (1 + δ)|λ| less the law at |λ|.
pub(crate) fn rates<F: Field>(c: &Constants<F>, region: &KenneRegion) -> [Rates<F>; 2] {
    let (f, r) = (F::from_f64, region);
    let [low, high] = r.flux_vs.map(f);
    let (less, more) = (F::one() - f(r.flux_uncertainty), F::one() + f(r.flux_uncertainty));
    let m = c.eta_l_m.clone() / c.eta.clone();
    let [s_low, s_high] = r.stator_resistance_ratio.map(f);
    let [r_low, r_high] = r.rotor_resistance_ratio.map(f);
    let spread = |low: F, high: F| larger(magnitude(low - F::one()), magnitude(high - F::one()));
    let rotor_rate = rotor_rate(c);
    let k = c.stator_rate.clone() + rotor_rate.clone();
    let (d_s, d_r) = (spread(s_low, s_high.clone()), spread(r_low.clone(), r_high.clone()));
    let (two, four) = (f(2.0), f(4.0));
    let (current, w) = (f(r.current_max_a), c.n_p.clone() * f(r.speed_max_rad_s));
    let eta_high = c.eta.clone() * r_high.clone();
    let sizes = |flux: F| Sizes {
        flux_rate: (eta_high.clone() + w.clone()) * flux.clone() + eta_high.clone() * m.clone() * current.clone(),
        current_rate: c.beta.clone() * (eta_high.clone() + w.clone()) * flux.clone()
            + (c.stator_rate.clone() * s_high.clone() + c.beta.clone() * c.eta_l_m.clone() * r_high.clone()) * current.clone()
            + c.inverse_sigma_l_s.clone() * f(r.voltage_max_v),
        current: current.clone(),
        w: w.clone(),
        flux,
    };
    let (true_sizes, law_sizes) = (sizes(high.clone()), sizes(high.clone() * more.clone()));
    let xy = |z: &Sizes<F>| z.flux.clone() * z.current.clone();
    let xy_rate = |z: &Sizes<F>| z.flux_rate.clone() * z.current.clone() + z.flux.clone() * z.current_rate.clone();
    // (2Λ)Λ', of |λ|².
    let flux2_rate = |z: &Sizes<F>| two.clone() * z.flux.clone() * z.flux_rate.clone();
    let turn = law_sizes.flux_rate.clone() / (low.clone() * less.clone());
    // b/b̂, b at one time of the sample and b̂ at another.
    let mismatch = high.clone() / (low.clone() * less.clone());

    // Speed.
    let input = |flux: F| c.mu.clone() * flux * c.inverse_sigma_l_s.clone();
    let b = [input(low.clone() * less.clone()), input(high.clone())];
    let damping = magnitude(f(r.c_omega) - c.friction_rate.clone());
    let law = |z: &Sizes<F>| {
        k.clone() * c.mu.clone() * xy(z)
            + z.w.clone() * c.mu.clone() * (c.beta.clone() * square(z.flux.clone()) + xy(z))
            + damping.clone() * f(r.acceleration_max_rad_s2)
            + f(r.reference_max_rad_s3)
    };
    let d_k = c.stator_rate.clone() * d_s + rotor_rate.clone() * d_r.clone();
    let largest = law(&law_sizes);
    let error = d_k * c.mu.clone() * xy(&true_sizes)
        + f(r.load_rate_rad_s3)
        + damping.clone() * f(r.load_error_rad_s2)
        + (largest.clone() - law(&true_sizes));
    let ratio = more.clone() / less.clone() - F::one();
    let jerk =
        c.mu.clone() * xy_rate(&true_sizes) + c.friction_rate.clone() * f(r.acceleration_max_rad_s2) + f(r.load_rate_rad_s3);
    let z = &law_sizes;
    let rate = k.clone() * c.mu.clone() * xy_rate(z)
        + c.n_p.clone() * f(r.acceleration_max_rad_s2) * c.mu.clone() * (c.beta.clone() * square(z.flux.clone()) + xy(z))
        + z.w.clone() * c.mu.clone() * (c.beta.clone() * flux2_rate(z) + xy_rate(z))
        + damping * jerk;
    let direction = |b: &F| b.clone() * f(r.voltage_max_v) * turn.clone();
    let speed = Rates {
        k: (error + f(r.reach_omega) + ratio * largest.clone()) / b[0].clone(),
        per_second: mismatch.clone() * (rate + largest * turn.clone()) + direction(&b[1]),
        at_once: two.clone() * f(r.reference_max_rad_s3) * mismatch.clone(),
        input: b,
    };

    // Flux.
    let input = |rotor: F, flux: F| two.clone() * c.eta_l_m.clone() * rotor * flux * c.inverse_sigma_l_s.clone();
    let b = [input(r_low.clone(), low.clone() * less.clone()), input(r_high.clone(), high)];
    let quadratic = |z: &Sizes<F>| {
        (four.clone() + two.clone() * m.clone() * c.beta.clone()) * square(z.flux.clone())
            + four.clone() * m.clone() * xy(z)
            + two.clone() * square(m.clone() * z.current.clone())
    };
    let quadratic_rate = |z: &Sizes<F>| {
        (four.clone() + two.clone() * m.clone() * c.beta.clone()) * flux2_rate(z)
            + four.clone() * m.clone() * xy_rate(z)
            + four.clone() * square(m.clone()) * z.current.clone() * z.current_rate.clone()
    };
    let slope = |z: &Sizes<F>| two.clone() * square(z.flux.clone()) + two.clone() * m.clone() * xy(z);
    let slope_rate = |z: &Sizes<F>| two.clone() * flux2_rate(z) + two.clone() * m.clone() * xy_rate(z);
    let cross = |z: &Sizes<F>| two.clone() * m.clone() * xy(z);
    let eta2 = square(c.eta.clone());
    let law = |z: &Sizes<F>| {
        eta2.clone() * quadratic(z)
            + c.eta.clone() * cross(z) * (z.w.clone() + k.clone())
            + f(r.c_lambda) * c.eta.clone() * slope(z)
    };
    let d_eta2 = eta2.clone() * larger(magnitude(square(r_high.clone()) - F::one()), magnitude(square(r_low.clone()) - F::one()));
    let d_eta = c.eta.clone() * d_r;
    // ηk over both resistances: largest departure from nominal at a corner of the ratios.
    let mut d_eta_k = F::zero();
    for s in r.stator_resistance_ratio.map(f) {
        for x in [r_low.clone(), r_high.clone()] {
            let k_there = c.stator_rate.clone() * s.clone() + rotor_rate.clone() * x.clone();
            d_eta_k = larger(d_eta_k, c.eta.clone() * magnitude(x * k_there - k.clone()));
        }
    }
    let (z, largest) = (&true_sizes, law(&law_sizes));
    let error = d_eta2 * quadratic(z)
        + d_eta.clone() * cross(z) * z.w.clone()
        + d_eta_k * cross(z)
        + f(r.c_lambda) * d_eta * slope(z)
        + (largest.clone() - law(z));
    let ratio = (more * r_high.clone()) / (less * r_low.clone()) - F::one();
    let z = &law_sizes;
    let rate = eta2 * quadratic_rate(z)
        + c.eta.clone()
            * two.clone()
            * m.clone()
            * (c.n_p.clone() * f(r.acceleration_max_rad_s2) * xy(z) + (z.w.clone() + k) * xy_rate(z))
        + f(r.c_lambda) * c.eta.clone() * slope_rate(z);
    let mismatch = mismatch * r_high / r_low;
    let flux = Rates {
        k: (error + f(r.reach_lambda) + ratio * largest.clone()) / b[0].clone(),
        per_second: mismatch * (rate + largest * turn.clone()) + direction(&b[1]),
        at_once: F::zero(),
        input: b,
    };
    [speed, flux]
}

fn bounds<F: Field>(c: &Constants<F>, region: &KenneRegion) -> Bounds<F> {
    let (f, r) = (F::from_f64, region);
    let [speed, flux] = rates(c, region);
    // Rotor resistance identifier: (R_r,high − R_r,low) times the bound of f₁ in the header.
    let [_, high] = r.flux_vs.map(f);
    let w = c.n_p.clone() * f(r.speed_max_rad_s);
    let [_, s_high] = r.stator_resistance_ratio.map(f);
    let [r_low, r_high] = r.rotor_resistance_ratio.map(f);
    let rotor_rate = rotor_rate(c);
    let error = c.beta.clone() * (r_high.clone() - r_low);
    let resistive = rotor_rate.clone() * r_high.clone() + c.stator_rate.clone() * s_high;
    let by_stator = c.eta_l_m.clone() * (resistive * f(r.current_max_a) + c.inverse_sigma_l_s.clone() * f(r.voltage_max_v));
    let by_flux2 = square(error.clone() * rotor_rate * high) * (square(c.eta.clone() * r_high) + square(w));
    Bounds { k_sq: speed.k, k_sd: flux.k, k_x: [error * by_stator, by_flux2], k_rr: f(r.rotor_resistance_rate_per_s) }
}

/// k_sq of (25) and k_sd of (26) that a region asks for, V.
pub fn needed(c: &Constants<f64>, region: &KenneRegion) -> [f64; 2] {
    let b = bounds(c, region);
    [b.k_sq, b.k_sd]
}

impl KenneRegion {
    fn complaint(&self) -> Option<String> {
        let ordered = |[low, high]: [f64; 2]| 0.0 < low && low <= high && high.is_finite();
        let ranges = [
            ("flux_vs", self.flux_vs),
            ("stator_resistance_ratio", self.stator_resistance_ratio),
            ("rotor_resistance_ratio", self.rotor_resistance_ratio),
        ];
        let bad = ranges.into_iter().find(|(_, range)| !ordered(*range));
        let values = [
            ("speed_max_rad_s", self.speed_max_rad_s),
            ("current_max_a", self.current_max_a),
            ("voltage_max_v", self.voltage_max_v),
            ("acceleration_max_rad_s2", self.acceleration_max_rad_s2),
            ("reference_max_rad_s3", self.reference_max_rad_s3),
            ("load_error_rad_s2", self.load_error_rad_s2),
            ("load_rate_rad_s3", self.load_rate_rad_s3),
            ("rotor_resistance_rate_per_s", self.rotor_resistance_rate_per_s),
            ("c_omega", self.c_omega),
            ("c_lambda", self.c_lambda),
        ];
        if let Some((name, range)) = bad {
            Some(format!("{name} = {range:?} must be positive and ordered"))
        } else if !(0.0..1.0).contains(&self.flux_uncertainty) {
            Some(format!("flux_uncertainty = {} must lie in [0, 1)", self.flux_uncertainty))
        } else {
            let bad = values.iter().find(|(_, v)| !(*v >= 0.0 && v.is_finite()));
            bad.map(|(name, v)| format!("{name} = {v} must be finite and not negative"))
        }
    }
}

impl Claim for KenneDesign {
    fn obligations<F: Field>(&self, c: &Constants<F>) -> Result<Vec<Obligation<F>>, String> {
        if let Some(complaint) = self.region.complaint() {
            return Err(complaint);
        }
        let f = F::from_f64;
        let b = bounds(c, &self.region);
        let [by_stator, by_flux2] = b.k_x;
        let left = f(self.k_x) - by_stator;
        Ok(vec![
            Obligation::Positive("reach_omega".into(), f(self.region.reach_omega)),
            Obligation::Positive("reach_lambda".into(), f(self.region.reach_lambda)),
            Obligation::Positive("k_sq less (25)".into(), f(self.k_sq) - b.k_sq),
            Obligation::Positive("k_sd less (26)".into(), f(self.k_sd) - b.k_sd),
            Obligation::Positive("K less (34) without flux".into(), left.clone()),
            Obligation::Positive(
                "what is left of K, squared, less the flux's part of (34), squared".into(),
                left.clone() * left - by_flux2,
            ),
            Obligation::Positive("k_Rr less the rate bound".into(), f(self.k_rr_per_s) - b.k_rr),
        ])
    }
}

/// The smallest gains over a region; K and k_Rr, whose bounds are strict, exceed them by `reserve` (relative).
///
/// # Errors
/// A region that is not one.
pub fn design(plant: Plant, region: &KenneRegion, reserve: f64) -> Result<(KenneDesign, Certificate), DesignError> {
    if let Some(complaint) = region.complaint() {
        return Err(DesignError::request(complaint));
    }
    positive("reserve", reserve)?;
    positive("reach_omega", region.reach_omega)?;
    positive("reach_lambda", region.reach_lambda)?;
    let b = bounds(&plant.constants::<f64>(), region);
    let above = 1.0 + 1e-12;
    let [by_stator, by_flux2] = b.k_x;
    let design = KenneDesign {
        region: *region,
        k_sq: b.k_sq * above,
        k_sd: b.k_sd * above,
        // The square of what is added where R_r is known must still be a number.
        k_x: (by_stator + by_flux2.sqrt()) * (1.0 + reserve) + f64::MIN_POSITIVE.sqrt(),
        k_rr_per_s: b.k_rr * (1.0 + reserve) + f64::MIN_POSITIVE,
    };
    Ok((design, Certificate::seal(plant, design)?))
}

/// Largest high-gain observer gain Γ of (29), (30) under forward Euler: without overshoot 1/h, stable below 2/h.
pub fn high_gain_limits(period_s: f64) -> [f64; 2] {
    [1.0 / period_s, 2.0 / period_s]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Machine, model};

    fn plant() -> Plant {
        Plant::Machine(Machine::kenne_appendix_ii())
    }

    pub(crate) fn region() -> KenneRegion {
        KenneRegion {
            stator_resistance_ratio: [0.5, 1.5],
            rotor_resistance_ratio: [1.0, 2.0],
            ..KenneRegion::certain(150.0, [0.2, 0.3], 5.0, 311.0)
        }
    }

    /// The two second derivatives of the file header against differences along the flow of the machine.
    #[test]
    fn second_derivatives_by_differences() {
        let c = plant().constants::<f64>();
        let (x, u) = ([70.0, 0.2, -0.15, 2.0, 3.0], [120.0, -60.0]);
        let m = c.eta_l_m / c.eta;
        let flow = |x: &[f64; 5], h: f64| {
            let d = model::derivative(&c, x, u, 0.0);
            std::array::from_fn::<f64, 5, _>(|k| x[k] + h * d[k])
        };
        let speed_rate = |x: &[f64; 5]| model::derivative(&c, x, u, 0.0)[0];
        let flux2_rate = |x: &[f64; 5]| {
            let d = model::derivative(&c, x, u, 0.0);
            2.0 * (x[1] * d[1] + x[2] * d[2])
        };
        let h = 1e-7;
        let second = |g: &dyn Fn(&[f64; 5]) -> f64| (g(&flow(&x, h)) - g(&flow(&x, -h))) / (2.0 * h);
        let [omega, la, lb, ia, ib] = x;
        let (l2, i2) = (la * la + lb * lb, ia * ia + ib * ib);
        let (big_x, big_y) = (la * ia + lb * ib, la * ib - lb * ia);
        let (v_q, v_d) = (la * u[1] - lb * u[0], la * u[0] + lb * u[1]); // times |λ|
        let (w, k) = (c.n_p * omega, c.gamma + c.eta);
        let omega_dd = -k * c.mu * big_y - w * c.mu * (c.beta * l2 + big_x) - c.friction_rate * speed_rate(&x)
            + c.mu * c.inverse_sigma_l_s * v_q;
        let flux_dd = c.eta.powi(2) * (4.0 * l2 - 4.0 * m * big_x + 2.0 * m * m * i2 + 2.0 * m * c.beta * l2)
            + 2.0 * c.eta_l_m * (w * big_y - k * big_x)
            + 2.0 * c.eta_l_m * c.inverse_sigma_l_s * v_d;
        assert!((second(&speed_rate) / omega_dd - 1.0).abs() < 1e-6);
        assert!((second(&flux2_rate) / flux_dd - 1.0).abs() < 1e-6);
    }

    #[test]
    fn gains_are_certified_and_the_smallest() {
        let (design, certificate) = design(plant(), &region(), 0.05).unwrap();
        certificate.check().unwrap();
        for smaller in [
            KenneDesign { k_sq: design.k_sq * 0.999, ..design },
            KenneDesign { k_sd: design.k_sd * 0.999, ..design },
            KenneDesign { k_x: design.k_x * 0.95, ..design },
            KenneDesign { k_rr_per_s: 1.0, ..design },
        ] {
            assert!(Certificate::seal(plant(), smaller).is_err());
        }
    }

    #[test]
    fn the_papers_high_gain_is_unstable_at_its_own_period() {
        let [_, stable] = high_gain_limits(106e-6);
        assert!(31000.0 > stable && (31000.0 * 106e-6 - 3.286f64).abs() < 1e-3);
    }
}
