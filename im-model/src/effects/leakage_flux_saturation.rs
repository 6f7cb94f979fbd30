//! Leakage-flux saturation: tooth tips and slot bridges saturate at high current, so that the leakages fall.
//!
//! i = (ψ_σ/L_l) φ(q),  φ(q) = 1 + κ q/(1 + q),  q = (|ψ_σ|/(L_l I_k))²
//!
//! for stator and rotor leakage alike: L_l at small currents, L_l/(1+κ) far above the knee. Monotone for κ ≥ 0; conservative.

use super::{About, Card, LeakageLaw, Place, effect};
use crate::error::Bound;

effect! {
    /// Saturation of both leakage paths.
    LeakageFluxSaturation, "leakage_flux_saturation",
    about: About::at(Place::FluxMap),
    card: Card {
        title: "Leakage-flux saturation",
        what: "Tooth tips and slot bridges saturate with current: both leakage inductances fall from L_l to L_l/(1+κ) around the knee current.",
        shows: "Inrush and locked-rotor current higher than small-current tests predict; the current error grows with current, at standstill too, and the model starts too slowly. No error at no load.",
        rivals: &[
            ("rotor_skin_effect", "acts with slip frequency at any current; leakage saturation acts with current at any slip: repeat the locked-rotor test at two currents and at two frequencies"),
            ("main_flux_saturation", "acts with flux at no load; leakage saturation with current"),
            ("rotor_heating", "drifts over seconds; saturation is immediate"),
        ],
        test: "Locked-rotor tests at low and at full voltage, or a direct-on-line start.",
        place: "flux-current map, both leakage branches",
        source: "rational form of the tooth-tip saturation of leakages by current, cf. L_lr(λ_m) of Kwon et al., Table V",
    },
    parameters: {
        /// L_l unsaturated over fully saturated, less one.
        drop: Strength, default 0.0, "", One, typical 0.1 to 1.5, Bound::NotNegative;
        /// Winding current (peak) at which half of the fall in 1/L_l has happened.
        knee_current_a: Shape, default 2.5, "A", Current, typical 0.7 to 6.0, Bound::Positive;
    },
    hooks: {
        fn leakage(&self, _so_far: Option<LeakageLaw<T>>, inv_l: T) -> Option<LeakageLaw<T>> {
            let scale = inv_l / self.knee_current_a;
            Some(LeakageLaw { strength: self.drop * inv_l, scale: scale * scale })
        }
    }
}

#[cfg(feature = "std")]
impl super::Drawn for LeakageFluxSaturation<f64> {
    fn frame(&self, on: &super::Rated) -> super::Frame {
        super::Frame::new(
            "winding current (peak), A",
            "stator leakage inductance, mH",
            (0.0, 8.0 * on.current_a),
            "Stator leakage inductance (flux over current) over winding current; the rotor's falls by the same law.",
        )
    }

    fn law(&self, on: &super::Rated, x: f64) -> f64 {
        let l = on.parameters.stator_leakage_inductance_h;
        // ψ(i) by bisection: the law is monotone.
        let i_of = |psi: f64| {
            let q = (psi / (l * self.knee_current_a)).powi(2);
            psi / l * (1.0 + self.drop * q / (1.0 + q))
        };
        let i = x.max(1e-6 * on.current_a);
        let (mut lo, mut hi) = (0.0, l * i);
        for _ in 0..60 {
            let middle = 0.5 * (lo + hi);
            if i_of(middle) < i { lo = middle } else { hi = middle }
        }
        1e3 * lo / i
    }
}
