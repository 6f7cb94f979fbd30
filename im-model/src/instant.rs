//! What is known of the machine at an instant: what drives it, its currents and its powers.

use num_complex::Complex;

use crate::parameters::TParameters;
use crate::scalar::Scalar;

/// What the sensors show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output<T> {
    /// Stator current, A.
    pub i_s: Complex<T>,
    /// Mechanical speed, rad/s.
    pub omega_m: T,
}

/// What drives the machine during a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantInput<T> {
    /// Commanded stator voltage over the step that begins, V: its mean where it is not held.
    pub u_s: Complex<T>,
    /// When given, the voltage changes by this over the step, V, in a straight line about its mean: so does a supply that no inverter holds. Between
    /// samples, the current at a held voltage strays from that at a sine by (ωT)²U/(12ωL_σ) in the mean: two per cent of the magnetizing current at 50 Hz and 2 kHz.
    pub u_rise: Option<Complex<T>>,
    /// Load torque, Nm, positive against positive rotation.
    pub tau_load: T,
    /// When given, the rotor turns at this speed (rad/s at the start and at the end of the step) whatever the torque.
    pub imposed_speed: Option<[T; 2]>,
    /// When given as (ω, k), the speed is nudged towards ω, rad/s, at the rate k, 1/s: dω_m/dt gains k(ω − ω_m), and with it
    /// the speed of a load behind a soft shaft. Comparing with a recording, this keeps a wrong model from pulling out of step, and leaves its torque errors visible as speed errors.
    pub speed_nudge: Option<[T; 2]>,
}

impl<T: Scalar> PlantInput<T> {
    /// Voltage and load torque, speed free.
    pub fn new(u_s: Complex<T>, tau_load: T) -> Self {
        Self { u_s, u_rise: None, tau_load, imposed_speed: None, speed_nudge: None }
    }

    /// What nudging adds to the acceleration at a rotor speed, rad/s²: of everything on the shaft alike, rigid or not.
    #[inline(always)]
    pub fn nudging(&self, omega_m: T) -> Option<T> {
        self.speed_nudge.map(|[target, rate]| (target - omega_m) * rate)
    }
}

/// Powers at an instant, W; a loss is positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Powers<T> {
    /// Taken in at the commanded voltage.
    pub electrical_input: T,
    /// Between command and terminals (inverter, gain).
    pub inverter_loss: T,
    /// Stator winding.
    pub stator_copper: T,
    /// Rotor winding, both cages.
    pub rotor_copper: T,
    /// Iron.
    pub iron: T,
    /// Friction, windage, ripple and what user effects brake.
    pub friction: T,
    /// Damping in the shaft.
    pub shaft_damping: T,
    /// Given to the load.
    pub load: T,
}

impl<T: Scalar> Powers<T> {
    /// None.
    pub(crate) fn none() -> Self {
        let o = T::zero();
        Self {
            electrical_input: o,
            inverter_loss: o,
            stator_copper: o,
            rotor_copper: o,
            iron: o,
            friction: o,
            shaft_damping: o,
            load: o,
        }
    }

    /// The values, in the order of the fields.
    pub fn values(&self) -> [T; 8] {
        [
            self.electrical_input,
            self.inverter_loss,
            self.stator_copper,
            self.rotor_copper,
            self.iron,
            self.friction,
            self.shaft_damping,
            self.load,
        ]
    }

    /// Input less losses and load: what goes into fields, masses and springs.
    pub fn net(&self) -> T {
        let [input, rest @ ..] = self.values();
        rest.into_iter().fold(input, |p, loss| p - loss)
    }
}

/// Currents and magnetizing flux.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Currents<T> {
    /// Stator current, A.
    pub i_s: Complex<T>,
    /// Rotor current, A.
    pub i_r: Complex<T>,
    /// Magnetizing flux linkage, Vs.
    pub psi_m: Complex<T>,
}

impl<T: Scalar> Currents<T> {
    /// The currents when `more` is drawn from the node of the air gap, between the leakages of the T circuit: the windings share in it as the
    /// leakages and the magnetizing inductance divide it. ψ_m stays: with it, a current that is the gradient of an energy stays one.
    #[must_use]
    pub fn drawn_at_gap(self, more: Complex<T>, p: &TParameters<T>) -> Self {
        let (l_s, l_r, l_m) = (p.stator_leakage_inductance_h, p.rotor_leakage_inductance_h, p.magnetizing_inductance_h);
        let share = more * (l_m / (l_s * l_r + l_m * (l_s + l_r)));
        Self { i_s: self.i_s + share * l_r, i_r: self.i_r + share * l_s, ..self }
    }
}
