//! Iron loss: a conductance across the magnetizing branch, fed through the diffusion of the laminations.
//!
//! i_fe = G dψ_fe/dt,  dψ_fe/dt = (ψ_m − ψ_fe)/τ,  P_fe = (3/2) G |dψ_fe/dt|²
//!
//! Below 1/(2πτ) ≈ 3 kHz this is the resistor R_fe = 1/G across the magnetizing voltage dψ_m/dt. The corner is physical (eddy
//! currents need time to diffuse into a lamination) and it makes the branch lossless to integrate: a bare resistor behind the
//! leakages has a time constant of G·L_l ≈ 3 µs, which goes to zero with the strength (docs/effects.md).

use num_complex::Complex;

use super::{About, Card, Operating, Place, effect};
use crate::error::Bound;
use crate::instant::Powers;
use crate::scalar::Scalar;
use crate::space_vector::norm2;

/// A lag that is followed, not resolved: what of it dies within a step of 2 τ is of no account, and a step is 0.8 over the rate.
const FOLLOWING: f64 = 0.4;

/// The longest diffusion time that a lamination has.
const SLOWEST_S: f64 = 1e-2;

effect! {
    /// Eddy-current and hysteresis loss of the stator iron.
    IronLoss, "iron_loss",
    about: About::at(Place::FluxMap),
    card: Card {
        title: "Iron loss",
        what: "A conductance G across the magnetizing branch takes i_fe = G dψ_m/dt: P_fe = (3/2) G |ωψ_m|².",
        shows: "No-load power that grows with frequency and flux; a current error in phase with the voltage, at no load too; torque missing in proportion when the shaft power is known.",
        rivals: &[
            ("windage", "also takes power at high speed, but through the shaft: it does not depend on flux"),
            ("coulomb_friction", "takes power through the shaft in proportion to speed, whatever the flux"),
            ("main_flux_saturation", "adds reactive current; iron loss adds active current"),
        ],
        test: "Flux steps at constant speed and load: windage stays, iron loss follows the square of flux.",
        place: "extra branch across the magnetizing inductance (adds one complex state)",
        source: "motulator's core-loss conductance i_s = (i_s' + G u_s)/(1 + G R_s), moved behind the stator leakage",
    },
    parameters: {
        /// Conductance across the magnetizing branch.
        conductance_s: Strength, default 0.0, "S", Conductance, typical 0.005 to 0.12, Bound::NotNegative;
        /// Diffusion time of the laminations.
        diffusion_time_s: Fixed, default 5e-5, "s", One, typical 2e-5 to 2e-4, Bound::Within(1e-5, SLOWEST_S);
    },
    states: ["psi_fe_Vs": Vector],
    hooks: {
        #[inline(always)]
        fn core_branch(&self, inv_l: T) -> T {
            inv_l + self.conductance_s / self.diffusion_time_s
        }

        #[inline(always)]
        fn core_source(&self, source: Complex<T>, own: &[T]) -> Complex<T> {
            source + psi_fe(own) * (self.conductance_s / self.diffusion_time_s)
        }

        #[inline(always)]
        fn rates(&self, rates: &mut [T], at: &Operating<T>, _powers: &Powers<T>, own: &[T]) {
            let rate = (at.currents.psi_m - psi_fe(own)) * (T::one() / self.diffusion_time_s);
            (rates[0], rates[1]) = (rate.re, rate.im);
        }

        fn settled(&self, own: &mut [T], at: &Operating<T>, psi_m_rate: Complex<T>) {
            let psi = at.currents.psi_m - psi_m_rate * self.diffusion_time_s;
            (own[0], own[1]) = (psi.re, psi.im);
        }

        #[inline(always)]
        fn powers(&self, powers: &mut Powers<T>, at: &Operating<T>, own: &[T]) {
            let rate = (at.currents.psi_m - psi_fe(own)) * (T::one() / self.diffusion_time_s);
            powers.iron += (self.conductance_s * norm2(rate)).scale(1.5);
        }

        fn stored_energy(&self, energy: T, at: &Operating<T>, own: &[T]) -> T {
            energy + (self.conductance_s / self.diffusion_time_s * norm2(at.currents.psi_m - psi_fe(own))).scale(0.75)
        }

        fn fastest_rate(&self, _rotor_inertia: f64) -> f64 {
            FOLLOWING / self.diffusion_time_s.value()
        }
    },
    own: {
        /// Iron diffuses no faster than the sampling can follow, and no slower than iron does.
        fn suit_sampling(&mut self, sample_time_s: T) {
            self.diffusion_time_s = self.diffusion_time_s.max(sample_time_s.scale(0.5)).min(T::from_f64(SLOWEST_S));
        }
    }
}

#[inline(always)]
fn psi_fe<T: Scalar>(own: &[T]) -> Complex<T> {
    Complex::new(own[0], own[1])
}

#[cfg(feature = "std")]
impl super::Drawn for IronLoss<f64> {
    fn frame(&self, on: &super::Rated) -> super::Frame {
        super::Frame::new(
            "supply frequency, Hz",
            "iron loss, W",
            (0.0, 1.2 * on.frequency_hz),
            "Iron loss over frequency at rated flux.",
        )
    }

    fn law(&self, on: &super::Rated, x: f64) -> f64 {
        1.5 * self.conductance_s * (core::f64::consts::TAU * x * on.rating.rotor_flux_vs).powi(2)
    }
}
