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
use crate::error::DesignError;
use crate::exact::Field;
use crate::machine::Constants;
use crate::sliding::positive;
use serde::{Deserialize, Serialize};

/// Where the gains must hold, and how fast.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KenneRegion {
    /// |ω| up to this mechanical speed, rad/s.
    pub speed_max_rad_per_s: f64,
    /// Rotor flux linkage amplitudes, Wb.
    pub flux_wb: [f64; 2],
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
    pub acceleration_max_rad_per_s2: f64,
    /// |ω̈_ref + c_ω ω̇_ref| up to this, rad/s³.
    pub reference_max_rad_per_s3: f64,
    /// Error of the load torque the law uses, over the inertia, rad/s².
    pub load_error_rad_per_s2: f64,
    /// |dT_L/dt|/J up to this, rad/s³.
    pub load_rate_rad_per_s3: f64,
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

fn bounds<F: Field>(c: &Constants<F>, region: &KenneRegion) -> Bounds<F> {
    let f = F::from_f64;
    let max = |a: F, b: F| if a > b { a } else { b };
    let abs = |a: F| if a < F::zero() { -a } else { a };
    let sq = |x: F| x.clone() * x;
    let r = region;
    let [low, high] = r.flux_wb.map(f);
    let (current, m) = (f(r.current_max_a), c.eta_l_m.clone() / c.eta.clone());
    let w = c.n_p.clone() * f(r.speed_max_rad_per_s);
    let [s_low, s_high] = r.stator_resistance_ratio.map(f);
    let [r_low, r_high] = r.rotor_resistance_ratio.map(f);
    let spread = |low: F, high: F| max(abs(low - F::one()), abs(high - F::one()));
    let rotor_rate = c.gamma.clone() + c.eta.clone() - c.stator_rate.clone(); // R_r/σL_r
    let k = c.stator_rate.clone() + rotor_rate.clone();
    let (d_s, d_r) = (spread(s_low, s_high.clone()), spread(r_low.clone(), r_high.clone()));
    let d_k = c.stator_rate.clone() * d_s + rotor_rate.clone() * d_r.clone();
    let xy = high.clone() * current.clone();
    // Flux as estimated against flux as it is: b within (1 ± δ) of the law's own.
    let (less, more) = (F::one() - f(r.flux_uncertainty), F::one() + f(r.flux_uncertainty));

    // Speed.
    let b_min = c.mu.clone() * low.clone() * less.clone() * c.inverse_sigma_l_s.clone();
    let damping = abs(f(r.c_omega) - c.friction_rate.clone());
    let error = d_k * c.mu.clone() * xy.clone() + f(r.load_rate_rad_per_s3) + damping.clone() * f(r.load_error_rad_per_s2);
    let law = k.clone() * c.mu.clone() * xy.clone()
        + w.clone() * c.mu.clone() * (c.beta.clone() * sq(high.clone()) + xy.clone())
        + damping * f(r.acceleration_max_rad_per_s2)
        + f(r.reference_max_rad_per_s3);
    let ratio = more.clone() / less.clone() - F::one();
    let k_sq = (error + f(r.reach_omega) + ratio * law) / b_min;

    // Flux.
    let two = f(2.0);
    let four = f(4.0);
    let gain = |rotor: F| two.clone() * c.eta_l_m.clone() * rotor * c.inverse_sigma_l_s.clone();
    let b_min = gain(r_low.clone()) * low * less.clone();
    let quadratic = four.clone() * sq(high.clone())
        + four * m.clone() * xy.clone()
        + two.clone() * sq(m.clone() * current.clone())
        + two.clone() * m.clone() * c.beta.clone() * sq(high.clone());
    let slope = two.clone() * sq(high.clone()) + two.clone() * m.clone() * xy.clone();
    let eta2 = sq(c.eta.clone());
    let d_eta2 = eta2.clone() * max(abs(sq(r_high.clone()) - F::one()), abs(sq(r_low.clone()) - F::one()));
    let d_eta = c.eta.clone() * d_r.clone();
    // ηk over both resistances: largest departure from nominal at a corner of the ratios.
    let mut d_eta_k = F::zero();
    for s in r.stator_resistance_ratio.map(f) {
        for x in [r_low.clone(), r_high.clone()] {
            let k_there = c.stator_rate.clone() * s.clone() + rotor_rate.clone() * x.clone();
            d_eta_k = max(d_eta_k, c.eta.clone() * abs(x * k_there - k.clone()));
        }
    }
    let cross = two * m.clone() * xy;
    let error = d_eta2 * quadratic.clone()
        + d_eta.clone() * cross.clone() * w.clone()
        + d_eta_k * cross.clone()
        + f(r.c_lambda) * d_eta * slope.clone();
    let law = eta2 * quadratic + c.eta.clone() * cross * (w.clone() + k) + f(r.c_lambda) * c.eta.clone() * slope;
    let ratio = (more * r_high.clone()) / (less * r_low.clone()) - F::one();
    let k_sd = (error + f(r.reach_lambda) + ratio * law) / b_min;

    // Rotor resistance identifier: (R_r,high − R_r,low) times the bound of f₁ in the header.
    let error = c.beta.clone() * (r_high.clone() - r_low);
    let rates = rotor_rate.clone() * r_high.clone() + c.stator_rate.clone() * s_high;
    let by_stator = c.eta_l_m.clone() * (rates * current + c.inverse_sigma_l_s.clone() * f(r.voltage_max_v));
    let by_flux2 = sq(error.clone() * rotor_rate * high) * (sq(c.eta.clone() * r_high) + sq(w));
    let k_x = [error * by_stator, by_flux2];
    Bounds { k_sq, k_sd, k_x, k_rr: f(r.rotor_resistance_rate_per_s) }
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
            ("flux_wb", self.flux_wb),
            ("stator_resistance_ratio", self.stator_resistance_ratio),
            ("rotor_resistance_ratio", self.rotor_resistance_ratio),
        ];
        let bad = ranges.into_iter().find(|(_, range)| !ordered(*range));
        let values = [
            self.speed_max_rad_per_s,
            self.current_max_a,
            self.voltage_max_v,
            self.acceleration_max_rad_per_s2,
            self.reference_max_rad_per_s3,
            self.load_error_rad_per_s2,
            self.load_rate_rad_per_s3,
            self.rotor_resistance_rate_per_s,
            self.c_omega,
            self.c_lambda,
        ];
        if let Some((name, range)) = bad {
            Some(format!("{name} = {range:?} must be positive and ordered"))
        } else if !(0.0..1.0).contains(&self.flux_uncertainty) {
            Some(format!("flux_uncertainty = {} must lie in [0, 1)", self.flux_uncertainty))
        } else if values.iter().any(|v| !(*v >= 0.0 && v.is_finite())) {
            Some("every bound of the region must be finite and not negative".into())
        } else {
            None
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
            speed_max_rad_per_s: 150.0,
            flux_wb: [0.2, 0.3],
            flux_uncertainty: 0.0,
            current_max_a: 5.0,
            voltage_max_v: 311.0,
            stator_resistance_ratio: [0.5, 1.5],
            rotor_resistance_ratio: [1.0, 2.0],
            acceleration_max_rad_per_s2: 1000.0,
            reference_max_rad_per_s3: 0.0,
            load_error_rad_per_s2: 0.0,
            load_rate_rad_per_s3: 0.0,
            rotor_resistance_rate_per_s: 1.0,
            c_omega: 15.0,
            c_lambda: 10.0,
            reach_omega: 100.0,
            reach_lambda: 1.0,
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
