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

mod rates;
mod region;

use crate::certificate::{Certificate, Claim, DesignModel, Obligation};
use crate::error::{DesignError, positive};
use crate::exact::Field;
use crate::machine::Constants;
pub(crate) use rates::{Rates, rates};
use rates::{rotor_rate, square};
pub use region::KenneRegion;
use serde::{Deserialize, Serialize};

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
            Obligation::Exceeds("k_sq over (25)".into(), f(self.k_sq), b.k_sq),
            Obligation::Exceeds("k_sd over (26)".into(), f(self.k_sd), b.k_sd),
            Obligation::Positive("K less (34) without flux".into(), left.clone()),
            Obligation::Exceeds(
                "what is left of K, squared, over the flux's part of (34), squared".into(),
                left.clone() * left,
                by_flux2,
            ),
            Obligation::Exceeds("k_Rr over the rate bound".into(), f(self.k_rr_per_s), b.k_rr),
        ])
    }
}

/// The smallest gains over a region; K and k_Rr, whose bounds are strict, exceed them by `reserve` (relative).
///
/// # Errors
/// A region that is not one.
pub fn design(plant: DesignModel, region: &KenneRegion, reserve: f64) -> Result<(KenneDesign, Certificate), DesignError> {
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
    use crate::{LinearMachine, model};

    fn plant() -> DesignModel {
        DesignModel::Machine(LinearMachine::kenne_appendix_ii())
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
