//! Main-flux saturation: the magnetizing current grows faster than the magnetizing flux.
//!
//! i_m = (ψ_m/L_m) (1 + k (|ψ_m|/ψ_N)^S)
//!
//! The power form of the saturable inductance L(ψ) = L_u/(1 + (αψ)^S) used by motulator, with the strength measured at a
//! reference flux. Monotone for k ≥ 0, hence invertible; the gradient of an energy, hence lossless.

use super::{About, Card, Place, effect};
use crate::error::Bound;

effect! {
    /// Saturation of the magnetizing branch.
    MainFluxSaturation, "main_flux_saturation",
    about: About::at(Place::FluxMap),
    card: Card {
        title: "Main-flux saturation",
        what: "The iron of teeth and yokes saturates: i_m = (ψ_m/L_m)(1 + k(|ψ_m|/ψ_N)^S). L_m is then the unsaturated inductance.",
        shows: "No-load current grows faster than voltage over frequency. The current error grows with flux above a knee and is in phase with the magnetizing current, at every speed and load.",
        rivals: &[
            ("iron_loss", "adds current in phase with the voltage, growing with frequency; saturation adds reactive current, independent of frequency"),
            ("leakage_flux_saturation", "acts with current (start, stalls, load), not with flux at no load"),
            ("voltage_gain", "wrong at every flux alike, in voltage per frequency; saturation only above the knee"),
        ],
        test: "No-load flux steps or a slow voltage ramp at constant frequency, from half to 1.2 times rated flux.",
        place: "flux-current map, magnetizing branch",
        source: "motulator, power-form saturation of the 2.2-kW machine: L_s(ψ) = 0.34/(1 + (0.84ψ)^7) H",
    },
    parameters: {
        /// Extra magnetizing current at the reference flux, as a fraction of the unsaturated one.
        excess: Strength, default 0.0, "", One, typical 0.1 to 2.0, Bound::NotNegative;
        /// Sharpness of the knee.
        exponent: Shape, default 7.0, "", One, typical 3.0 to 10.0, Bound::Within(1.0, 20.0);
        /// Flux at which the strength is measured: rated magnetizing flux.
        reference_flux_vs: Fixed, default 1.0, "Vs", Flux, typical 0.9 to 1.1, Bound::Positive;
    },
    hooks: {
        #[inline(always)]
        fn reluctance(&self, (mu, dmu): (T, T), psi_m_squared: T) -> (T, T) {
            let half_s = self.exponent * T::from_f64(0.5);
            let q = psi_m_squared / (self.reference_flux_vs * self.reference_flux_vs);
            let extra = self.excess * q.powf(half_s);
            let slope = if psi_m_squared.value() > 0.0 { extra * half_s / psi_m_squared } else { T::zero() };
            (mu + extra, dmu + slope)
        }

        fn reluctance_integral(&self, psi_m_squared: T) -> T {
            let half_s = self.exponent * T::from_f64(0.5);
            let q = psi_m_squared / (self.reference_flux_vs * self.reference_flux_vs);
            psi_m_squared * self.excess * q.powf(half_s) / (half_s + T::one())
        }

        fn reference_flux(&self, _flux: T) -> T {
            self.reference_flux_vs
        }
    }
}

#[cfg(feature = "std")]
impl super::Drawn for MainFluxSaturation<f64> {
    fn frame(&self, _on: &super::Rated) -> super::Frame {
        super::Frame::new(
            "magnetizing flux, Vs",
            "magnetizing current, A",
            (0.0, 1.25 * self.reference_flux_vs),
            "Saturation curve: magnetizing current over flux. Dashed: the same machine unsaturated.",
        )
    }

    fn law(&self, on: &super::Rated, x: f64) -> f64 {
        let l_m = on.parameters.magnetizing_inductance_h;
        x / l_m * (1.0 + self.excess * (x / self.reference_flux_vs).abs().powf(self.exponent))
    }
}
