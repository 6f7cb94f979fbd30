//! Utkin's sliding mode stepped by forward Euler with a boundary layer φ, on the machine itself: ω̂ = ω₀ sat(s/φ), s = Im(λ̂*ê).
//!
//! The observer takes a step h from (λ̂, î), with ê = î − i at its beginning; the machine goes on in continuous time under a held
//! voltage. With A = −η + jn_pω̂, and ī, m the means of i and (η − jn_pω)λ over the sample,
//!
//! ```text
//! Δλ̂ = h(Aλ̂ + ηL_m î),   Δê = −h(βAλ̂ + γ(î − ī) + βm),   s⁺ = Im (λ̂ + Δλ̂)*(ê + Δê)
//! s⁺ = (1 − h(η + γ))s − hω̂ n_p(β|λ̂|² + Re λ̂*ê) + h d
//! |d| ≤ βn_pω_max|λ̂|² + b|λ̂| + c,   b = βR(δ_λ + ½hλ') + ½γh i',   c = ηL_m I e + hQ
//! Q = a(γε + βM) + ηL_m(I + e)(βa + γε + βM),   a = (η + n_pω₀)Λ,  ε = e + ½h i',  M = R(Λ + δ_λ)
//! ```
//!
//! with R ≥ √(η² + n_p²ω_max²), |λ̂| ≤ Λ, and the machine's own rates λ' = M + ηL_m I, i' = βM + γI + U/σL_s under |u_s| ≤ U. If
//!
//! ```text
//! r = ω₀n_pλ_min(βλ_min − e) − (βn_pω_maxλ_min² + bλ_min + c) > 0,
//! (1 − h(η + γ))φ ≥ h[ω₀n_pΛ(βΛ + e) + βn_pω_maxΛ² + bΛ + c],
//! ```
//!
//! then |s| outside the layer falls by at least hr per sample without jumping over it, and inside |s⁺| ≤ φ − hr: it stays. (r/x grows
//! with |λ̂| = x, so that λ_min is the worst.) An exact s = 0 cannot be claimed of a sampled sign; a layer in proportion to h can. What
//! is claimed holds while the errors are those of the region, as for the continuous observer.

use super::{longest, usual};
use crate::certificate::{Certificate, Claim, DesignModel, Obligation};
use crate::error::{DesignError, positive};
use crate::exact::Field;
use crate::machine::Constants;
use crate::sliding::{UtkinDesign, UtkinRegion, utkin_bound};
use serde::{Deserialize, Serialize};

/// ω₀ with the boundary layer that a period asks for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SampledUtkinDesign {
    /// ω₀ with its region.
    pub continuous: UtkinDesign,
    /// |λ̂| up to this, Wb.
    pub flux_max_vs: f64,
    /// |u_s| up to this, V.
    pub voltage_max_v: f64,
    /// Sampling period h, s.
    pub period_s: f64,
    /// φ, A Wb.
    pub boundary_layer_avs: f64,
}

/// The numbers of the header for a design; affine in ω₀: what does not depend on it, and its factor.
struct Step<F> {
    /// r.
    reach: [F; 2],
    /// The bracket beside φ.
    jump: [F; 2],
    /// 1 − h(η + γ).
    kept: F,
}

fn step<F: Field>(c: &Constants<F>, d: &SampledUtkinDesign) -> Step<F> {
    let f = F::from_f64;
    let (u, r) = (&d.continuous, &d.continuous.region);
    let [least, most, error, h] = [r.flux_min_vs, d.flux_max_vs, r.current_error_max_a, d.period_s].map(f);
    let [gap, current, root] = [r.flux_error_max_vs, r.current_max_a, u.root_bound].map(f);
    let (w, half) = (c.n_p.clone() * f(r.speed_max_rad_s), f(0.5) * h.clone());
    let (beta, gamma) = (c.beta.clone(), c.gamma.clone());
    let m = root.clone() * (most.clone() + gap.clone());
    let drive = c.eta_l_m.clone() * current.clone();
    let flux_rate = m.clone() + drive.clone();
    let supply = c.inverse_sigma_l_s.clone() * f(d.voltage_max_v);
    let current_rate = beta.clone() * m.clone() + gamma.clone() * current.clone() + supply;
    let b = beta.clone() * root * (gap + half.clone() * flux_rate) + gamma.clone() * half.clone() * current_rate.clone();
    let rest = gamma * (error.clone() + half * current_rate) + beta.clone() * m;
    let fed = c.eta_l_m.clone() * (current + error.clone());
    // Q = Q₀ + ω₀Q₁.
    let per_a = rest.clone() + fed.clone() * beta.clone();
    let q_0 = c.eta.clone() * most.clone() * per_a.clone() + fed * rest;
    let q_1 = c.n_p.clone() * most.clone() * per_a;
    let (c_0, c_1) = (drive * error.clone() + h.clone() * q_0, h.clone() * q_1);
    let disturbance = |x: &F| beta.clone() * w.clone() * x.clone() * x.clone() + b.clone() * x.clone() + c_0.clone();
    let lever = |x: &F, error: F| c.n_p.clone() * x.clone() * (beta.clone() * x.clone() + error);
    Step {
        reach: [-disturbance(&least), lever(&least, -error.clone()) - c_1.clone()],
        jump: [h.clone() * disturbance(&most), h.clone() * (lever(&most, error) + c_1)],
        kept: F::one() - h * (c.eta.clone() + c.gamma.clone()),
    }
}

impl SampledUtkinDesign {
    /// The smallest layer of this ω₀ at another period, A Wb; the disturbances of a sample grow with it.
    pub(crate) fn layer_at(&self, c: &Constants<f64>, period_s: f64) -> f64 {
        let s = step(c, &SampledUtkinDesign { period_s, ..*self });
        (s.jump[0] + self.continuous.omega0_rad_s * s.jump[1]) / s.kept
    }
}

impl Claim for SampledUtkinDesign {
    fn obligations<F: Field>(&self, c: &Constants<F>) -> Result<Vec<Obligation<F>>, String> {
        let mut obligations = self.continuous.obligations(c)?;
        let f = F::from_f64;
        let (omega0, s) = (f(self.continuous.omega0_rad_s), step(c, self));
        let at = |[rest, factor]: [F; 2]| rest + omega0.clone() * factor;
        obligations.extend([
            Obligation::Positive("period".into(), f(self.period_s)),
            Obligation::Positive("voltage".into(), f(self.voltage_max_v)),
            Obligation::Exceeds("largest over smallest flux".into(), f(self.flux_max_vs), f(self.continuous.region.flux_min_vs)),
            Obligation::Positive("1 - period times (eta + gamma)".into(), s.kept.clone()),
            Obligation::Positive("approach to the layer, A Wb/s".into(), at(s.reach)),
            Obligation::Exceeds("boundary layer over the longest jump".into(), s.kept * f(self.boundary_layer_avs), at(s.jump))
                .limit(),
        ]);
        Ok(obligations)
    }
}

/// The smallest ω₀ and boundary layer at a period; with a layer given, proven for it, at the period or at the largest for which it holds.
///
/// # Errors
/// [`DesignError::Infeasible`] where no ω₀ overcomes what a sample adds, or the layer is too narrow, with the largest period.
pub fn utkin(
    plant: DesignModel,
    region: &UtkinRegion,
    [flux_max_vs, voltage_max_v]: [f64; 2],
    layer_avs: Option<f64>,
    period_s: Option<f64>,
) -> Result<(SampledUtkinDesign, Certificate), DesignError> {
    // Bounds and current error are judged as for the continuous observer.
    let (continuous, _) = crate::sliding::utkin(plant, region)?;
    positive("voltage_max_v", voltage_max_v)?;
    positive("flux_max_vs less flux_min_vs", flux_max_vs - region.flux_min_vs)?;
    layer_avs.map_or(Ok(()), |layer| positive("boundary_layer_avs", layer))?;
    let c = plant.constants::<f64>();
    let attempt = |h: f64| {
        let (_, root_bound) = utkin_bound(&c, region)?;
        let mut d = SampledUtkinDesign {
            continuous: UtkinDesign { root_bound, ..continuous },
            flux_max_vs,
            voltage_max_v,
            period_s: h,
            boundary_layer_avs: layer_avs.unwrap_or(0.0),
        };
        let s = step(&c, &d);
        if s.reach[1] <= 0.0 || s.kept <= 0.0 {
            return None;
        }
        d.continuous.omega0_rad_s = -s.reach[0] / s.reach[1] * (1.0 + 1e-9);
        let needed = d.layer_at(&c, h) * (1.0 + 1e-12);
        match layer_avs {
            None => d.boundary_layer_avs = needed,
            Some(layer) if layer < needed => return None,
            Some(_) => {}
        }
        Some((d, Certificate::seal(plant, d).ok()?))
    };
    let most = 1.0 / (c.eta + c.gamma);
    let what = layer_avs.map_or("any boundary layer".into(), |layer| format!("a boundary layer of {layer} A Wb"));
    match period_s {
        Some(h) => {
            usual(h)?;
            attempt(h).ok_or_else(|| DesignError::Infeasible {
                constraint: format!("forward Euler at {h} s with {what}"),
                feasible: longest(h.min(most), attempt)
                    .map_or("a smaller region".into(), |(d, _)| format!("periods up to {:.2} µs", 1e6 * d.period_s)),
            })
        }
        None => longest(most, attempt).ok_or_else(|| super::no_period(0.0, most)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LinearMachine;

    #[test]
    fn the_layer_goes_with_the_period_and_the_amplitude_approaches_the_continuous_one() {
        let plant = DesignModel::Machine(LinearMachine::kwon_table_iv());
        let region = crate::sliding::tests::region();
        let at = |h: f64| utkin(plant, &region, [1.1, 400.0], None, Some(h)).unwrap();
        let (continuous, _) = crate::sliding::utkin(plant, &region).unwrap();
        let ((short, certificate), (long, _)) = (at(1e-7), at(1e-5));
        certificate.check().unwrap();
        assert!((short.continuous.omega0_rad_s / continuous.omega0_rad_s - 1.0).abs() < 0.01);
        let ratio = long.boundary_layer_avs / short.boundary_layer_avs;
        assert!(ratio > 100.0 && ratio < 130.0, "{ratio}");
        for wrong in [
            SampledUtkinDesign { boundary_layer_avs: long.boundary_layer_avs * 0.999, ..long },
            SampledUtkinDesign { voltage_max_v: 440.0, ..long },
            SampledUtkinDesign { period_s: long.period_s * 1.01, ..long },
            SampledUtkinDesign { flux_max_vs: 0.5, ..long },
        ] {
            assert!(Certificate::seal(plant, wrong).is_err(), "{wrong:?}");
        }
        // A layer given has a largest period, and says so.
        let layer = Some(long.boundary_layer_avs * 1.0001);
        let (largest, _) = utkin(plant, &region, [1.1, 400.0], layer, None).unwrap();
        assert!((largest.period_s / 1e-5 - 1.0).abs() < 0.02, "{}", largest.period_s);
        let error = utkin(plant, &region, [1.1, 400.0], layer, Some(2e-5)).unwrap_err().to_string();
        assert!(error.contains("periods up to 9.") || error.contains("periods up to 10."), "{error}");
    }
}
