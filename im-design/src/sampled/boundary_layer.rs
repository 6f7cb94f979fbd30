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
use crate::certificate::{Certificate, Claim, DesignModel, Obligation};
use crate::error::{DesignError, positive};
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
            Obligation::Exceeds("boundary layer over the longest jump".into(), kept * layer, reach).limit(),
        ]);
        Ok(obligations)
    }
}

/// The smallest ν₀ and boundary layer at a period; with a layer given, proven for it, at the period or at the largest for which it holds.
///
/// # Errors
/// [`DesignError::Infeasible`] from the period on at which forward Euler turns the current error's own decay round, or at which the
/// layer is too narrow.
pub fn derdiyok(
    plant: DesignModel,
    speed_max_rad_s: f64,
    flux_max_vs: f64,
    reserve: f64,
    layer_a: Option<f64>,
    period_s: Option<f64>,
) -> Result<(SampledDerdiyokDesign, Certificate), DesignError> {
    let (continuous, _) = sliding::derdiyok(plant, speed_max_rad_s, flux_max_vs, reserve)?;
    let c = plant.constants::<f64>();
    let jump = c.beta * (2.0 * continuous.nu0 - continuous.reserve);
    // (1 − hγ)φ = hβ(2ν₀ − δ).
    let largest = |layer: f64| layer / (jump + layer * c.gamma) * (1.0 - 1e-12);
    let (period_s, boundary_layer_a) = match (period_s, layer_a) {
        (None, None) => return Err(DesignError::request("the largest period needs a boundary layer")),
        (None, Some(layer)) => (largest(layer), layer),
        (Some(h), None) => {
            meaningful(&c, h)?;
            (h, h * jump / (1.0 - h * c.gamma) * (1.0 + 1e-12))
        }
        (Some(h), Some(layer)) => {
            meaningful(&c, h)?;
            if h > largest(layer) {
                return Err(DesignError::Infeasible {
                    constraint: format!("forward Euler at {h} s with a boundary layer of {layer} A"),
                    feasible: format!("periods up to {:.2} µs", 1e6 * largest(layer)),
                });
            }
            (h, layer)
        }
    };
    positive("boundary_layer_a", boundary_layer_a)?;
    let design = SampledDerdiyokDesign { continuous, period_s, boundary_layer_a };
    Ok((design, Certificate::seal(plant, design)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LinearMachine;

    #[test]
    fn sampled_sliding_enters_its_layer_and_stays() {
        let plant = DesignModel::Machine(LinearMachine::kwon_table_iv());
        let c = plant.constants::<f64>();
        let (d, certificate) = derdiyok(plant, 190.0, 1.1, 5.0, None, Some(100e-6)).unwrap();
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
        let error = derdiyok(plant, 190.0, 1.1, 5.0, None, Some(1.0)).unwrap_err();
        assert!(error.to_string().contains("periods up to"), "{error}");
        let (largest, _) = derdiyok(plant, 190.0, 1.1, 5.0, Some(layer), None).unwrap();
        assert!((largest.period_s / h - 1.0).abs() < 1e-9, "{}", largest.period_s);
        assert!(derdiyok(plant, 190.0, 1.1, 5.0, Some(layer), Some(1.01 * h)).unwrap_err().to_string().contains("100.00 µs"));
    }
}
