//! Kenné's surfaces with the law computed once per sample and held, on the machine in continuous time; s and b as in `kenne/mod.rs`.
//!
//! Over a sample ṡ = f + bv with v = v̂(t_k) − k sat(s(t_k)/Φ), held at the stator in the flux's direction of then. Beyond what the
//! continuous law leaves, |f + bv̂| ≤ b_min k₀ − η with k₀ of (25), (26), a sample adds
//!
//! ```text
//! b|v̂(t) − v̂(t_k)| ≤ h (b_max/b̂_min)(max|f̂'| + max|f̂| |λ|'/|λ|) + 2 max|reference|,    b|v||turn| ≤ h b_max U |λ|'/|λ|,
//! ```
//!
//! h E₁ and twice the reference's part together. With k ≥ k₀ + (hE₁ + 2 max|ref|)/b_min all else is below b_min k − η at every time, and with
//!
//! ```text
//! Φ ≥ h(b_max + b_min)k
//! ```
//!
//! |s| outside the layer falls by at least hη per sample and does not jump over it; inside |s⁺| ≤ Φ − hη: it stays.
//!
//! f̂' is bounded term by term with the rates of the machine, resistances at their largest, |u_s| ≤ U:
//! |λ|' ≤ η(Λ + MI) + wΛ, |i|' ≤ β(η + w)Λ + γI + U/σL_s, |ω|'' ≤ μ(|λ|'I + Λ|i|') + (D/J)|ω|' + |T_L|'/J. The identifier's sign law, taken
//! implicitly as in `im-identify`, needs no more at any period: |e| falls by (k_Rr − |Ṙ_r|)h per sample, to |Ṙ_r|h.

use super::{longest, usual};
use crate::certificate::{Certificate, Claim, DesignModel, Obligation};
use crate::error::{DesignError, positive};
use crate::exact::Field;
use crate::kenne::{self, KenneDesign, KenneRegion, Rates};
use crate::machine::Constants;
use serde::{Deserialize, Serialize};

/// The gains with the boundary layers that a period asks for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SampledKenneDesign {
    /// Gains with their region; k_sq and k_sd are those of the sampled law.
    pub continuous: KenneDesign,
    /// Sampling period h, s.
    pub period_s: f64,
    /// Φ_ω, rad/s².
    pub boundary_omega: f64,
    /// Φ_λ, Wb²/s.
    pub boundary_lambda: f64,
}

/// (25) and (26) with what a sample adds, V.
fn needed<F: Field>(rates: &[Rates<F>; 2], period: &F) -> [F; 2] {
    rates.clone().map(|r| r.k + (period.clone() * r.per_second + r.at_once) / r.input[0].clone())
}

/// h(b_max + b_min) k.
fn layers<F: Field>(rates: &[Rates<F>; 2], period: &F, k: [F; 2]) -> [F; 2] {
    let [omega, lambda] = rates.clone().map(|r| r.input[0].clone() + r.input[1].clone());
    let [k_sq, k_sd] = k;
    [period.clone() * omega * k_sq, period.clone() * lambda * k_sd]
}

impl SampledKenneDesign {
    /// The smallest layers [Φ_ω, Φ_λ] over the same region at another period.
    pub(crate) fn layers_at(&self, c: &Constants<f64>, period_s: f64) -> [f64; 2] {
        let rates = kenne::rates(c, &self.continuous.region);
        layers(&rates, &period_s, needed(&rates, &period_s))
    }
}

impl Claim for SampledKenneDesign {
    fn obligations<F: Field>(&self, c: &Constants<F>) -> Result<Vec<Obligation<F>>, String> {
        let mut obligations = self.continuous.obligations(c)?;
        let (h, d) = (F::from_f64(self.period_s), &self.continuous);
        let rates = kenne::rates(c, &d.region);
        let k = [d.k_sq, d.k_sd].map(F::from_f64);
        let [need_q, need_d] = needed(&rates, &h);
        let [omega, lambda] = layers(&rates, &h, k.clone());
        let [k_sq, k_sd] = k;
        let f = F::from_f64;
        obligations.extend([
            Obligation::Positive("period".into(), h),
            Obligation::Exceeds("k_sq over (25) sampled".into(), k_sq, need_q).limit(),
            Obligation::Exceeds("k_sd over (26) sampled".into(), k_sd, need_d).limit(),
            Obligation::Exceeds("layer of s_omega over the longest jump".into(), f(self.boundary_omega), omega).limit(),
            Obligation::Exceeds("layer of s_lambda over the longest jump".into(), f(self.boundary_lambda), lambda).limit(),
        ]);
        Ok(obligations)
    }
}

/// The smallest gains and layers for a period; with layers [Φ_ω, Φ_λ] given, proven for them, at the period or at the largest.
///
/// # Errors
/// As [`kenne::design`]; [`DesignError::Infeasible`] with the largest period for the layers.
pub fn switching(
    plant: DesignModel,
    region: &KenneRegion,
    reserve: f64,
    wanted: Option<[f64; 2]>,
    period_s: Option<f64>,
) -> Result<(SampledKenneDesign, Certificate), DesignError> {
    let (continuous, _) = kenne::design(plant, region, reserve)?;
    for (name, layer) in ["boundary_omega", "boundary_lambda"].into_iter().zip(wanted.into_iter().flatten()) {
        positive(name, layer)?;
    }
    period_s.map_or(Ok(()), usual)?;
    let rates = kenne::rates(&plant.constants::<f64>(), region);
    let above = 1.0 + 1e-12;
    let attempt = |h: f64| {
        let k = needed(&rates, &h).map(|k| k * above);
        let least = layers(&rates, &h, k).map(|layer| layer * above);
        let [boundary_omega, boundary_lambda] = match wanted {
            Some(layers) if layers[0] < least[0] || layers[1] < least[1] => return None,
            Some(layers) => layers,
            None => least,
        };
        let continuous = KenneDesign { k_sq: k[0], k_sd: k[1], ..continuous };
        let design = SampledKenneDesign { continuous, period_s: h, boundary_omega, boundary_lambda };
        Some((design, Certificate::seal(plant, design).ok()?))
    };
    const LONGEST_S: f64 = 1e-2;
    let what = wanted.map_or("any layers".into(), |[omega, lambda]| format!("layers of {omega} rad/s² and {lambda} Wb²/s"));
    match (period_s, wanted) {
        (Some(h), _) => attempt(h).ok_or_else(|| DesignError::Infeasible {
            constraint: format!("{what} at {h} s"),
            feasible: longest(h, attempt)
                .map_or("wider layers".into(), |(d, _)| format!("these layers at periods up to {:.2} µs", 1e6 * d.period_s)),
        }),
        (None, Some(_)) => longest(LONGEST_S, attempt).ok_or_else(|| DesignError::Infeasible {
            constraint: format!("{what} at any period"),
            feasible: "wider layers".into(),
        }),
        (None, None) => Err(DesignError::request("the largest period needs boundary layers")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LinearMachine;

    fn region() -> KenneRegion {
        KenneRegion {
            flux_uncertainty: 0.02,
            stator_resistance_ratio: [0.8, 1.2],
            rotor_resistance_ratio: [0.9, 1.1],
            ..KenneRegion::certain(150.0, [0.2, 0.3], 5.0, 311.0)
        }
    }

    #[test]
    fn gains_go_to_the_continuous_ones_and_layers_to_zero_with_the_period() {
        let plant = DesignModel::Machine(LinearMachine::kenne_appendix_ii());
        let (continuous, _) = kenne::design(plant, &region(), 0.05).unwrap();
        let (short, certificate) = switching(plant, &region(), 0.05, None, Some(1e-9)).unwrap();
        certificate.check().unwrap();
        assert!((short.continuous.k_sq / continuous.k_sq - 1.0).abs() < 1e-3 && short.boundary_omega < 1e-2);
        let (d, certificate) = switching(plant, &region(), 0.05, None, Some(2e-5)).unwrap();
        certificate.check().unwrap();
        for smaller in [
            SampledKenneDesign { boundary_omega: 0.999 * d.boundary_omega, ..d },
            SampledKenneDesign { boundary_lambda: 0.999 * d.boundary_lambda, ..d },
            SampledKenneDesign { period_s: 1.001 * d.period_s, ..d },
            SampledKenneDesign { continuous, ..d },
        ] {
            assert!(Certificate::seal(plant, smaller).is_err(), "{smaller:?}");
        }
        let layers = Some([d.boundary_omega * 1.0001, d.boundary_lambda * 1.0001]);
        let (largest, _) = switching(plant, &region(), 0.05, layers, None).unwrap();
        assert!((largest.period_s / d.period_s - 1.0).abs() < 0.02, "{}", largest.period_s);
        let error = switching(plant, &region(), 0.05, layers, Some(4e-5)).unwrap_err().to_string();
        assert!(error.contains("periods up to"), "{error}");
    }
}
