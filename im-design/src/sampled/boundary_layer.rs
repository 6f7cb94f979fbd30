//! Derdiyok's sliding mode stepped by forward Euler with a boundary layer φ: ν = −ν₀ sat(s/φ) per component.
//!
//! s_k⁺ = (1 − hγ)s_k − hβ(ν₀ sat(s_k/φ) + d_k), |d_k| ≤ b = λ_max√(η² + n_p²ω_max²) ≤ ν₀ − δ. If
//!
//! ```text
//! hγ < 1,   (1 − hγ)φ ≥ hβ(2ν₀ − δ),
//! ```
//!
//! a component outside the layer comes nearer by at least hβδ per sample and does not jump over it, and inside
//! |s_k⁺| ≤ a|s_k| + hβb with a = 1 − hγ − hβν₀/φ in (0, 1): it stays, and ends within b/(γ/β + ν₀/φ) < φ.

use super::meaningful;
use crate::certificate::{Certificate, Claim, Obligation, Plant};
use crate::error::DesignError;
use crate::exact::Field;
use crate::machine::Constants;
use crate::sliding::{self, DerdiyokDesign};
use serde::{Deserialize, Serialize};

/// ν₀ with the boundary layer that a period asks for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SampledDerdiyokDesign {
    /// ν₀ with its region.
    pub continuous: DerdiyokDesign,
    /// Sampling period h, s.
    pub period_s: f64,
    /// φ, A.
    pub boundary_layer_a: f64,
}

impl Claim for SampledDerdiyokDesign {
    fn obligations<F: Field>(&self, c: &Constants<F>) -> Result<Vec<Obligation<F>>, String> {
        let mut obligations = self.continuous.obligations(c)?;
        let [h, layer, nu0, reserve] =
            [self.period_s, self.boundary_layer_a, self.continuous.nu0, self.continuous.reserve].map(F::from_f64);
        let kept = F::one() - h.clone() * c.gamma.clone();
        let reach = h.clone() * c.beta.clone() * (nu0.clone() + nu0 - reserve);
        obligations.extend([
            Obligation::Positive("period".into(), h),
            Obligation::Positive("1 - period times gamma".into(), kept.clone()),
            Obligation::Positive("boundary layer less the longest jump".into(), kept * layer - reach),
        ]);
        Ok(obligations)
    }
}

/// The smallest ν₀ and boundary layer at a period.
///
/// # Errors
/// [`DesignError::Infeasible`] from the period on at which forward Euler turns the current error's own decay round.
pub fn derdiyok(
    plant: Plant,
    speed_max_rad_per_s: f64,
    flux_max_wb: f64,
    reserve: f64,
    period_s: f64,
) -> Result<(SampledDerdiyokDesign, Certificate), DesignError> {
    let (continuous, _) = sliding::derdiyok(plant, speed_max_rad_per_s, flux_max_wb, reserve)?;
    let c = plant.constants::<f64>();
    meaningful(&c, period_s)?;
    let kept = 1.0 - period_s * c.gamma;
    let boundary_layer_a = period_s * c.beta * (2.0 * continuous.nu0 - continuous.reserve) / kept * (1.0 + 1e-12);
    let design = SampledDerdiyokDesign { continuous, period_s, boundary_layer_a };
    Ok((design, Certificate::seal(plant, design)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Machine;

    #[test]
    fn sampled_sliding_enters_its_layer_and_stays() {
        let plant = Plant::Machine(Machine::kwon_table_iv());
        let c = plant.constants::<f64>();
        let (d, certificate) = derdiyok(plant, 190.0, 1.1, 5.0, 100e-6).unwrap();
        certificate.check().unwrap();
        let (h, layer, nu0) = (d.period_s, d.boundary_layer_a, d.continuous.nu0);
        let bound = nu0 - d.continuous.reserve;
        for (start, disturbance) in [(5.0 * layer, -bound), (-3.0 * layer, bound), (1.01 * layer, bound), (0.9 * layer, -bound)] {
            let (mut s, mut inside) = (start, false);
            for _ in 0..200_000 {
                let next = (1.0 - h * c.gamma) * s - h * c.beta * (nu0 * (s / layer).clamp(-1.0, 1.0) + disturbance);
                assert!(s.abs() <= layer || next.abs() <= s.abs() - h * c.beta * d.continuous.reserve * 0.999, "{s} {next}");
                s = next;
                assert!(!inside || s.abs() <= layer, "left the layer");
                inside |= s.abs() <= layer;
            }
            assert!(inside);
        }
        let error = derdiyok(plant, 190.0, 1.1, 5.0, 1.0).unwrap_err();
        assert!(error.to_string().contains("periods up to"), "{error}");
    }
}
