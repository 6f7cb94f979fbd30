//! What a controller knows of its machine.

use im_model::{Bound, Machine, ModelError, Scalar, WindingParameters};

use crate::guard;

/// The machine as a controller knows it, the way its voltage takes, and the current it may carry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MachineData<T> {
    /// Resistances, inductances, inertia and friction; the rotor referred in any way. The rotor flux of references and estimates is
    /// referred in the same way.
    pub windings: WindingParameters<T>,
    /// n_p.
    pub pole_pairs: u32,
    /// Largest stator current, peak, A.
    pub current_max_a: T,
    /// Time from the beginning of a sample until its command begins to act, s: zero in a simulation without the effect
    /// `voltage_delay`, a sample in usual firmware. Controllers turn their command ahead by it.
    pub voltage_delay_s: T,
}

impl<T: Scalar> MachineData<T> {
    /// The base parameters of a machine model (its effects are unknown to a controller), carrying `current_max_a`, without delay.
    pub fn of(machine: &Machine<T>, current_max_a: T) -> Self {
        Self {
            windings: machine.parameters().windings(),
            pole_pairs: machine.pole_pairs(),
            current_max_a,
            voltage_delay_s: T::zero(),
        }
    }

    /// The same machine behind a delay.
    pub fn delayed(self, voltage_delay_s: T) -> Self {
        Self { voltage_delay_s, ..self }
    }

    /// The same in another scalar type.
    pub fn cast<U: Scalar>(&self) -> MachineData<U> {
        let c = |x: T| U::from_f64(x.value());
        let w = &self.windings;
        MachineData {
            windings: WindingParameters {
                stator_resistance_ohm: c(w.stator_resistance_ohm),
                rotor_resistance_ohm: c(w.rotor_resistance_ohm),
                stator_inductance_h: c(w.stator_inductance_h),
                rotor_inductance_h: c(w.rotor_inductance_h),
                mutual_inductance_h: c(w.mutual_inductance_h),
                inertia_kg_m2: c(w.inertia_kg_m2),
                viscous_friction_nm_s_per_rad: c(w.viscous_friction_nm_s_per_rad),
            },
            pole_pairs: self.pole_pairs,
            current_max_a: c(self.current_max_a),
            voltage_delay_s: c(self.voltage_delay_s),
        }
    }

    /// Checks every quantity.
    ///
    /// # Errors
    /// Names the quantity out of bounds.
    pub fn validate(&self) -> Result<(), ModelError> {
        self.windings.validate()?;
        Bound::Within(1.0, 100.0).check("pole_pairs", f64::from(self.pole_pairs))?;
        guard::SIZE.check("current_max_a", self.current_max_a.value())?;
        Bound::Within(0.0, 1e-2).check("voltage_delay_s", self.voltage_delay_s.value())
    }

    /// n_p as a number.
    pub(crate) fn n_p(&self) -> T {
        T::from_f64(f64::from(self.pole_pairs))
    }
}
