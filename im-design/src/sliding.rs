//! Switching gains of the sliding-mode observers of Derdiyok et al. and of Utkin et al., as small as the region allows.
//!
//! **Derdiyok**: with s = î − i, ṡ = β(ν − A_ωλ) − γs (the paper prints βA_ωλ inside the bracket: one β too many), so
//! V̇ = −βν₀‖s‖₁ − βsᵀA_ωλ − γ‖s‖² < 0 for all s exactly when ν₀ > max|components of A_ωλ|. Over all orientations
//! of the flux that maximum is |A_ωλ| = |λ|√(η² + n_p²ω²), hence
//!
//! ```text
//! ν₀ > λ_max √(η² + n_p²ω_max²);   with ν₀ = bound + δ sliding starts within ‖s(0)‖₂/(βδ).
//! ```
//!
//! No smaller ν₀ holds over the region: at s = (s_a, 0) small, with the flux turned so that A_ωλ lies along −a, it fails.
//!
//! **Utkin**: with ê = î − i and s_n = Im(λ̂* ê),
//!
//! ```text
//! ṡ_n = −n_p ω̂ (β|λ̂|² + Re λ̂*ê) + β(n_p ω Re λ̂*λ − η Im λ̂*λ) + ηL_m Im î*ê − (η + γ)s_n,   ω̂ = ω₀ sign s_n.
//! ```
//!
//! With λ = λ̂ + d, |d| ≤ δ_λ, |ê| ≤ e and |i| ≤ I every term reaches its bound at once (ê against λ̂, on s_n = 0), so
//! the smallest ω₀ is, at |λ̂| = λ_min,
//!
//! ```text
//! ω₀ > [β(n_pω_max λ_min + δ_λ√(η² + n_p²ω_max²)) + ηL_m I e/λ_min] / (n_p(βλ_min − e)).
//! ```

use crate::certificate::{Certificate, Claim, DesignModel, Obligation};
use crate::error::{DesignError, not_negative, positive};
use crate::exact::Field;
use crate::machine::Constants;
use serde::{Deserialize, Serialize};

/// ν₀ with its region.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DerdiyokDesign {
    /// |ω| up to this mechanical speed, rad/s.
    pub speed_max_rad_s: f64,
    /// |λ| up to this rotor flux linkage, Wb.
    pub flux_max_vs: f64,
    /// ν₀, V (the dimension of A_ωλ).
    pub nu0: f64,
    /// δ: ν₀ exceeds the bound by at least this, so sliding starts within ‖s(0)‖₂/(βδ).
    pub reserve: f64,
}

impl Claim for DerdiyokDesign {
    fn obligations<F: Field>(&self, c: &Constants<F>) -> Result<Vec<Obligation<F>>, String> {
        let f = F::from_f64;
        if self.speed_max_rad_s < 0.0 || self.flux_max_vs < 0.0 {
            return Err("the bounds of the region must not be negative".into());
        }
        let square = |x: F| x.clone() * x;
        let bound = square(f(self.flux_max_vs)) * (square(c.eta.clone()) + square(c.n_p.clone() * f(self.speed_max_rad_s)));
        let rest = f(self.nu0) - f(self.reserve);
        Ok(vec![
            Obligation::Positive("reserve".into(), f(self.reserve)),
            Obligation::Positive("nu0 less reserve".into(), rest.clone()),
            Obligation::Exceeds("(nu0 - reserve)² over the squared bound".into(), square(rest), bound).limit(),
        ])
    }
}

/// The smallest ν₀ for a region with a reserve.
///
/// # Errors
/// A region or reserve that is not positive and finite.
pub fn derdiyok(
    plant: DesignModel,
    speed_max_rad_s: f64,
    flux_max_vs: f64,
    reserve: f64,
) -> Result<(DerdiyokDesign, Certificate), DesignError> {
    positive("speed_max_rad_s", speed_max_rad_s)?;
    positive("flux_max_vs", flux_max_vs)?;
    positive("reserve", reserve)?;
    let c = plant.constants::<f64>();
    let nu0 = (flux_max_vs * c.eta.hypot(c.n_p * speed_max_rad_s) + reserve) * (1.0 + 1e-12);
    let design = DerdiyokDesign { speed_max_rad_s, flux_max_vs, nu0, reserve };
    Ok((design, Certificate::seal(plant, design)?))
}

/// Where ω₀ must be enough.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UtkinRegion {
    /// |ω| up to this mechanical speed, rad/s.
    pub speed_max_rad_s: f64,
    /// |λ̂| from this on, Wb.
    pub flux_min_vs: f64,
    /// |λ − λ̂| up to this, Wb.
    pub flux_error_max_vs: f64,
    /// |î − i| up to this, A; must stay below β λ_min.
    pub current_error_max_a: f64,
    /// |i| up to this, A.
    pub current_max_a: f64,
}

/// ω₀ with its region.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UtkinDesign {
    /// The region.
    pub region: UtkinRegion,
    /// ω₀, mechanical rad/s.
    pub omega0_rad_s: f64,
    /// A number at least √(η² + n_p²ω_max²), so that the check needs no root.
    pub root_bound: f64,
}

impl Claim for UtkinDesign {
    fn obligations<F: Field>(&self, c: &Constants<F>) -> Result<Vec<Obligation<F>>, String> {
        let (f, r) = (F::from_f64, &self.region);
        let bounds = [r.speed_max_rad_s, r.flux_error_max_vs, r.current_error_max_a, r.current_max_a];
        if bounds.iter().any(|x| *x < 0.0) {
            return Err("the bounds of the region must not be negative".into());
        }
        let square = |x: F| x.clone() * x;
        let w = c.n_p.clone() * f(r.speed_max_rad_s);
        let [flux, error, current] = [r.flux_min_vs, r.current_error_max_a, r.current_max_a].map(f);
        let lever = c.beta.clone() * flux.clone() - error.clone();
        let drive = c.beta.clone() * (w.clone() * flux.clone() + f(r.flux_error_max_vs) * f(self.root_bound));
        // Both sides times λ_min, to divide by nothing.
        let reach = f(self.omega0_rad_s) * c.n_p.clone() * lever.clone() * flux.clone();
        let need = drive * flux.clone() + c.eta_l_m.clone() * current * error;
        Ok(vec![
            Obligation::Positive("flux_min_vs".into(), flux),
            Obligation::Positive("root_bound".into(), f(self.root_bound)),
            Obligation::Exceeds(
                "root_bound² over η² + n_p²ω²".into(),
                square(f(self.root_bound)),
                square(c.eta.clone()) + square(w),
            )
            .limit(),
            Obligation::Positive("βλ_min less the current error".into(), lever),
            Obligation::Exceeds("reach of ω₀ over what it must overcome".into(), reach, need).limit(),
        ])
    }
}

/// The smallest ω₀ for a region.
///
/// # Errors
/// [`DesignError::Infeasible`] when the current error may exceed βλ_min: no amplitude reaches the surface then.
pub fn utkin(plant: DesignModel, region: &UtkinRegion) -> Result<(UtkinDesign, Certificate), DesignError> {
    positive("speed_max_rad_s", region.speed_max_rad_s)?;
    positive("flux_min_vs", region.flux_min_vs)?;
    not_negative("flux_error_max_vs", region.flux_error_max_vs)?;
    not_negative("current_error_max_a", region.current_error_max_a)?;
    not_negative("current_max_a", region.current_max_a)?;
    let c = plant.constants::<f64>();
    let (omega0_rad_s, root_bound) = utkin_bound(&c, region).ok_or_else(|| DesignError::Infeasible {
        constraint: format!("|î − i| ≤ {} A against βλ_min", region.current_error_max_a),
        feasible: format!("current errors below {:.3} A", c.beta * region.flux_min_vs),
    })?;
    let design = UtkinDesign { region: *region, omega0_rad_s, root_bound };
    Ok((design, Certificate::seal(plant, design)?))
}

/// ω₀ that a region asks for and the root bound it is made with; none when the current error may exceed βλ_min.
pub(crate) fn utkin_bound(c: &Constants<f64>, region: &UtkinRegion) -> Option<(f64, f64)> {
    let lever = c.beta * region.flux_min_vs - region.current_error_max_a;
    if lever.is_nan() || lever <= 0.0 {
        return None;
    }
    let w = c.n_p * region.speed_max_rad_s;
    let root_bound = c.eta.hypot(w) * (1.0 + 1e-12);
    let drive = c.beta * (w * region.flux_min_vs + region.flux_error_max_vs * root_bound)
        + c.eta_l_m * region.current_max_a * region.current_error_max_a / region.flux_min_vs;
    Some((drive / (c.n_p * lever) * (1.0 + 1e-12), root_bound))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::LinearMachine;

    fn plant() -> DesignModel {
        DesignModel::Machine(LinearMachine::kwon_table_iv())
    }

    /// V̇ of Derdiyok's observer by the model, at one state.
    fn derdiyok_slope(c: &Constants<f64>, nu0: f64, omega: f64, lambda: [f64; 2], s: [f64; 2]) -> f64 {
        let w = c.n_p * omega;
        let a_lambda = [c.eta * lambda[0] + w * lambda[1], -w * lambda[0] + c.eta * lambda[1]];
        let rate = |k: usize| c.beta * (-nu0 * s[k].signum() - a_lambda[k]) - c.gamma * s[k];
        s[0] * rate(0) + s[1] * rate(1)
    }

    #[test]
    fn derdiyok_bound_is_sufficient_and_necessary() {
        let c = plant().constants::<f64>();
        let (design, certificate) = derdiyok(plant(), 190.0, 1.1, 1.0).unwrap();
        certificate.check().unwrap();
        let mut worst = f64::NEG_INFINITY;
        for k in 0..3600 {
            let angle = f64::from(k) * 0.1f64.to_radians();
            let lambda = [1.1 * angle.cos(), 1.1 * angle.sin()];
            for s in [[1e-6, 1e-9], [-1e-6, 1e-9], [1e-6, -2e-6], [1e-9, 1e-6]] {
                assert!(derdiyok_slope(&c, design.nu0, 190.0, lambda, s) < 0.0);
                worst = worst.max(derdiyok_slope(&c, 0.999 * (design.nu0 - 1.0), 190.0, lambda, s));
            }
        }
        assert!(worst > 0.0, "a gain 0.1 % below the bound must fail somewhere");
    }

    /// Of Kwon's machine to 190 rad/s.
    pub(crate) fn region() -> UtkinRegion {
        UtkinRegion {
            speed_max_rad_s: 190.0,
            flux_min_vs: 0.6,
            flux_error_max_vs: 0.05,
            current_error_max_a: 5.0,
            current_max_a: 80.0,
        }
    }

    #[test]
    fn utkin_bound_is_sufficient_and_tight() {
        let c = plant().constants::<f64>();
        let region = region();
        let (design, certificate) = utkin(plant(), &region).unwrap();
        certificate.check().unwrap();
        // ṡ_n on s_n = +0 with ê against λ̂ = λ_min and everything else at its worst.
        let w = c.n_p * 190.0;
        let slope = |omega0: f64| {
            let lever = c.beta * 0.6 * 0.6 - 0.6 * 5.0;
            -c.n_p * omega0 * lever + c.beta * (w * 0.36 + 0.6 * 0.05 * c.eta.hypot(w)) + c.eta_l_m * 80.0 * 5.0
        };
        assert!(slope(design.omega0_rad_s) < 0.0);
        assert!(slope(0.999 * design.omega0_rad_s) > 0.0);
        let hopeless = UtkinRegion { current_error_max_a: 1e4, ..region };
        assert!(matches!(utkin(plant(), &hopeless), Err(DesignError::Infeasible { .. })));
    }
}
