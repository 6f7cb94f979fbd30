//! Stator flux from the voltage, drawn to that of the current model at low frequency.
//!
//! dψ_s/dt = u − R_s i + g (ψ_R,cm + L_σ i − ψ_s),   ψ_R = ψ_s − L_σ i: below |ω_s| = g the current model decides, above the voltage.

use im_model::simulation::Measured;
use im_model::{Complex, Scalar};

use crate::vector::clamp;

/// ψ_s, and what it was brought up to date with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StatorFlux<T> {
    psi_s: Complex<T>,
    psi_r: Complex<T>,
    i_s: Complex<T>,
    u_before: Complex<T>,
}

impl<T: Scalar> Default for StatorFlux<T> {
    fn default() -> Self {
        let z = Complex::new(T::zero(), T::zero());
        Self { psi_s: z, psi_r: z, i_s: z, u_before: z }
    }
}

impl<T: Scalar> StatorFlux<T> {
    /// With a rotor flux (inverse-Γ, Vs), current and voltage to begin with.
    pub fn at(psi_r: Complex<T>, leakage_h: T, i_s: Complex<T>, u_before: Complex<T>) -> Self {
        Self { psi_s: psi_r + i_s * leakage_h, psi_r, i_s, u_before }
    }

    /// Brings it to the instant of the measurement; returns the rotor flux (inverse-Γ), Vs.
    #[inline]
    pub fn step(&mut self, m: &Measured<T>, pull: Complex<T>, leakage_h: T, r_s: T, crossover: T, delay_s: T) -> Complex<T> {
        let t = m.sample_time_s;
        // What the machine saw of the command, a delay later; up to one sample.
        let f = clamp(delay_s / t, T::zero(), T::one());
        let u = m.u_s * (T::one() - f) + self.u_before * f;
        let i = (self.i_s + m.i_s) * T::from_f64(0.5);
        let g = crossover * t;
        self.psi_s = (self.psi_s + (u - i * r_s) * t + pull * g) * (T::one() / (T::one() + g));
        (self.i_s, self.u_before) = (m.i_s, m.u_s);
        self.psi_r = self.psi_s - m.i_s * leakage_h;
        self.psi_r
    }

    pub fn rotor_flux_vs(&self) -> Complex<T> {
        self.psi_r
    }
}
