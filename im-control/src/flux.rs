//! Rotor flux in the stator frame from current and speed (the current model), and blended with the voltage model.
//!
//! Kenné (44): dλ/dt = (−R_r/L_r + jn_pω) λ + (R_r/L_r) M i_s, over a sample by its own transition, the current by the trapezoidal
//! rule: λ⁺ = e^{aT} λ + ½ ηMT (e^{aT} i + i⁺), a = −η + jn_pω. The magnitude of e^{aT} is taken as (1 − ½ηT)/(1 + ½ηT): stable for
//! every sampling time, unlike forward Euler.

use im_model::{Complex, Scalar};

use crate::flying_start::Caught;
use crate::vector::rotation;

/// The current model of the rotor flux.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotorFluxModel<T> {
    /// L_r, H.
    pub rotor_inductance_h: T,
    /// M, H.
    pub mutual_inductance_h: T,
    /// n_p.
    pub pole_pairs: T,
}

/// Flux and the current it was brought up to date with. `default` is unmagnetized.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotorFlux<T> {
    /// λ̂_r, Vs.
    pub flux_vs: Complex<T>,
    current_a: Complex<T>,
    omega_m: T,
}

impl<T: Scalar> Default for RotorFlux<T> {
    fn default() -> Self {
        Self { flux_vs: Complex::new(T::zero(), T::zero()), current_a: Complex::new(T::zero(), T::zero()), omega_m: T::zero() }
    }
}

impl<T: Scalar> RotorFlux<T> {
    /// The flux of a machine that was found turning.
    pub(crate) fn of(caught: &Caught<T>) -> Self {
        Self { flux_vs: caught.rotor_flux_vs, current_a: caught.i_s, omega_m: caught.omega_m }
    }

    /// Draws it towards another estimate of the same instant.
    #[inline]
    pub(crate) fn draw(&mut self, flux_vs: Complex<T>, share: T) {
        self.flux_vs += (flux_vs - self.flux_vs) * share;
    }
}

impl<T: Scalar> RotorFluxModel<T> {
    /// Brings the flux to the instant at which `i_s` and `omega_m` were measured, a sample after the last.
    #[inline]
    pub fn step(&self, state: &mut RotorFlux<T>, rotor_resistance_ohm: T, i_s: Complex<T>, omega_m: T, sample_time_s: T) {
        self.sampled(rotor_resistance_ohm, sample_time_s).step(state, i_s, omega_m);
    }

    /// The model over a sampling time.
    #[inline]
    pub(crate) fn sampled(&self, rotor_resistance_ohm: T, sample_time_s: T) -> SampledFlux<T> {
        let half = T::from_f64(0.5) * sample_time_s;
        let x = rotor_resistance_ohm / self.rotor_inductance_h * half;
        SampledFlux {
            decay: (T::one() - x) / (T::one() + x),
            gain_h: x * self.mutual_inductance_h,
            half_angle_s: self.pole_pairs * half,
        }
    }
}

/// The current model over a sampling time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SampledFlux<T> {
    /// |e^{aT}|.
    decay: T,
    /// ½ηMT.
    gain_h: T,
    /// ½n_pT: of the speeds at both ends.
    half_angle_s: T,
}

impl<T: Scalar> SampledFlux<T> {
    /// λ⁺ = e^{aT}(λ + ½ηMT i) + ½ηMT i⁺.
    #[inline]
    pub fn step(&self, state: &mut RotorFlux<T>, i_s: Complex<T>, omega_m: T) {
        let transition = rotation(self.half_angle_s * (state.omega_m + omega_m)) * self.decay;
        state.flux_vs = transition * (state.flux_vs + state.current_a * self.gain_h) + i_s * self.gain_h;
        (state.current_a, state.omega_m) = (i_s, omega_m);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::{Bench, Machine, PlantInput, State, machines, space_vector::unit};

    /// Against the machine itself, thrown onto 300 V while turning, sampled at 100 µs.
    #[test]
    fn the_current_model_follows_the_machine() {
        let m = machines::JADOT_TABLE_I;
        let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
        let w = m.parameters().windings();
        let model = RotorFluxModel {
            rotor_inductance_h: w.rotor_inductance_h,
            mutual_inductance_h: w.mutual_inductance_h,
            pole_pairs: 2.0,
        };
        let mut bench = Bench::new(&machine, State::turning(150.0), 1e-4);
        let mut flux = RotorFlux::default();
        for k in 0..5000 {
            let o = bench.output();
            model.step(&mut flux, w.rotor_resistance_ohm, o.i_s, o.omega_m, 1e-4);
            let e = (flux.flux_vs - bench.state().psi_r).norm();
            // The held voltage bends the current within a sample by ωT u T/(12 L_σ) = 0.01 A on average, of 6 A: 1.5e-3 Vs; more
            // that while the first currents flow.
            assert!(e < if k < 1500 { 2.5e-3 } else { 1.7e-3 }, "{k}: {e}");
            bench.advance(&PlantInput::new(unit(0.0314 * f64::from(k)) * 300.0, 5.0));
        }
        assert!(flux.flux_vs.norm() > 0.7);
    }
}
