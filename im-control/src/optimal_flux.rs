//! The rotor flux of least current or of least loss for a torque, with saturated iron and its loss.
//!
//! With i_d = (λ/M)(1 + b), b = k(λ/ψ_N)^S, and i_q = τ'/(k_r λ), τ' = τ/(1.5 n_p), k_r = M/L_r:
//!
//! ```text
//! i²  = i_d² + i_q²                                    least where  λ⁴ (1 + b)(1 + (1 + S)b)/M² = (τ'/k_r)²
//! P/1.5 = R_s i_d² + (R_s + R_R) i_q² + G ω_s² λ²      least where  λ⁴ (R_s (1 + b)(1 + (1 + S)b)/M² + G ω_s²) = (R_s + R_R)(τ'/k_r)²
//! ```
//!
//! The left side is taken at the flux of the sample before, and the flux follows its root at a rate slower than the flux loop: a fixed
//! point without iteration. Where the current is at its limit the torque in the formula is what the limit gives at this flux, and the aim
//! the least current: the fixed point is then the largest torque.
//!
//! What comes after is in [`FieldWeakening`](crate::FieldWeakening) and field orientation itself: the voltage takes flux (constant power,
//! with the current at its limit), and i_q stays below 0.9 of what the pull-out slip R_R(1/L_σ + 1/L_M) has: 0.9945 of the largest torque
//! of a voltage.

use im_model::effects::{IronLoss, MainFluxSaturation};
use im_model::{Bound, Machine, ModelError, Scalar};

use crate::guard;

/// What a controller knows of the iron. All zero is iron without saturation and loss.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iron<T> {
    /// k: extra magnetizing current at the reference flux, over the unsaturated one; the mutual inductance of the machine data is then the unsaturated one.
    pub excess: T,
    /// S.
    pub exponent: T,
    /// ψ_N, Vs.
    pub reference_flux_vs: T,
    /// G: conductance across the magnetizing branch, S.
    pub conductance_s: T,
}

impl<T: Scalar> Iron<T> {
    /// Iron without saturation and loss.
    pub fn ideal() -> Self {
        Self { excess: T::zero(), exponent: T::one(), reference_flux_vs: T::one(), conductance_s: T::zero() }
    }

    /// The effects `main_flux_saturation` and `iron_loss` of a machine.
    pub fn of(machine: &Machine<f64>) -> Self {
        let (MainFluxSaturation { excess, exponent, reference_flux_vs }, IronLoss { conductance_s, .. }) =
            (machine.effects().main_flux_saturation, machine.effects().iron_loss);
        let f = T::from_f64;
        Self {
            excess: f(excess),
            exponent: f(exponent),
            reference_flux_vs: f(reference_flux_vs),
            conductance_s: f(conductance_s),
        }
    }

    /// b: what saturation adds to the magnetizing current, over the unsaturated one.
    #[inline]
    pub fn bend(&self, flux_vs: T) -> T {
        if self.excess > T::zero() && flux_vs > T::zero() {
            // Beyond twice the reference flux no machine is driven, and the power has no room.
            let x = (flux_vs / self.reference_flux_vs).min(T::from_f64(2.0));
            self.excess * x.powf(self.exponent)
        } else {
            T::zero()
        }
    }

    pub(crate) fn validate(&self) -> Result<(), ModelError> {
        Bound::Within(0.0, 100.0).check("excess", self.excess.value())?;
        Bound::Within(1.0, 20.0).check("exponent", self.exponent.value())?;
        guard::SIZE.check("reference_flux_vs", self.reference_flux_vs.value())?;
        guard::SIZE_OR_ZERO.check("conductance_s", self.conductance_s.value())
    }
}

/// What is to be least.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FluxAim {
    /// The current for the torque.
    LeastCurrent,
    /// Copper and iron losses for the torque.
    LeastLoss,
}

/// How the flux follows the torque. The flux asked for is then the largest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OptimalFlux<T> {
    /// What is to be least.
    pub aim: FluxAim,
    /// The iron.
    pub iron: Iron<T>,
    /// How fast the flux follows where it is to rise, 1/s; it falls over twelve rotor time constants.
    pub bandwidth_per_s: T,
    /// The least flux, over the one asked for: what is there for a torque that comes suddenly.
    pub least_share: T,
}

/// What the optimum is taken for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Operation<T> {
    /// τ/(1.5 n_p k_r), and the largest current.
    pub torque: T,
    pub current_max_a: T,
    /// The current is at its limit.
    pub limited: bool,
    pub omega_s: T,
    pub stator_resistance_ohm: T,
    /// R_R.
    pub rotor_resistance_ohm: T,
    /// M without saturation.
    pub mutual_inductance_h: T,
    pub inverse_t_r: T,
}

/// The rate at which the flux falls, over 1/T_r. A torque that comes while there is little flux takes the largest current until the flux is back, and
/// that costs what about six T_r with little flux have saved: a flux that falls sooner loses in short pauses what it saves in long ones.
const FALL: f64 = 1.0 / 12.0;

impl<T: Scalar> OptimalFlux<T> {
    /// Follows at 10 1/s, from 0.3 of the flux asked for on.
    pub fn new(aim: FluxAim, iron: Iron<T>) -> Self {
        Self { aim, iron, bandwidth_per_s: T::from_f64(10.0), least_share: T::from_f64(0.3) }
    }

    pub(crate) fn validate(&self) -> Result<(), ModelError> {
        self.iron.validate()?;
        guard::SIZE.check("bandwidth_per_s", self.bandwidth_per_s.value())?;
        Bound::Within(0.01, 1.0).check("least_share", self.least_share.value())
    }

    /// The flux for this sample, from that of the last; `most` is the one asked for.
    #[inline]
    pub(crate) fn step(&self, flux: &mut T, most: T, o: &Operation<T>, sample_time_s: T) -> T {
        let (one, least) = (T::one(), most * self.least_share);
        let at = (*flux).max(least).max(T::from_f64(1e-9));
        let b = self.iron.bend(at);
        let chord = (one + b) / o.mutual_inductance_h;
        let bent = chord * (one + (one + self.iron.exponent) * b) / o.mutual_inductance_h;
        let torque = if o.limited {
            let i_d = at * chord;
            at * (o.current_max_a * o.current_max_a - i_d * i_d).max(T::zero()).sqrt()
        } else {
            o.torque.abs()
        };
        let (left, right) = match self.aim {
            FluxAim::LeastLoss if !o.limited => (
                o.stator_resistance_ohm * bent + self.iron.conductance_s * o.omega_s * o.omega_s,
                o.stator_resistance_ohm + o.rotor_resistance_ohm,
            ),
            _ => (bent, one),
        };
        let wanted = (torque * (right / left).sqrt()).sqrt();
        let rate = if wanted > at { self.bandwidth_per_s } else { self.bandwidth_per_s.min(o.inverse_t_r * T::from_f64(FALL)) };
        let x = rate * sample_time_s;
        let next = at + (wanted - at) * (x / (one + x));
        *flux = next.max(least).min(most);
        *flux
    }
}
