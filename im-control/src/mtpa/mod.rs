//! Torque control with the least current for the torque (Kwon, Sudhoff, Żak, Hui 2005, Sections VII and VIII).
//!
//! ```text
//! I_s = (27)(T*),   ω_s = (29)(T*),   θ̇_e = n_p ω + ω_s,   i* = √2 I_s along d                          (20)
//! synchronous current regulator (Fig. 5):   x' = (i* − i)/τ_scr,  |x_d|, |x_q| ≤ i_fcl,   i_cmd = i* + x
//! ```
//!
//! The command is a current, for a delta modulator ([`im_model::simulation::DeltaModulator`]), whose mean error the regulator takes out.
//! The flux follows the torque with the rotor time constant, so torque does too.

mod connection;
mod law;

use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::space_vector::norm2;
use im_model::{Bound, Complex, ModelError, Scalar};

use crate::error::ControlError;
use crate::flying_start::{BeginsAt, Caught};
use crate::guard;
use crate::machine_data::MachineData;
use crate::status::{DriveStatus, Reports};
use crate::vector::{clamp, is_finite, rotation};

pub use connection::{Connection, from_synchronous, to_synchronous};
pub use law::{LawForm, MtpaLaw, SERIES};

/// The data of the drive beside its law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MtpaGains<T> {
    /// Integral time of the synchronous current regulator, s.
    pub tau_scr_s: T,
    /// i_fcl: limit of each integrator, A (line current).
    pub integral_limit_a: T,
    /// What the law's current is: of star or of delta windings.
    pub connection: Connection,
    /// Factor on the slip of the law: 1, but for studies like the paper's Fig. 12.
    pub slip_factor: T,
}

impl<T: Scalar> MtpaGains<T> {
    /// τ_scr of 10 ms, integrators to a quarter of the current limit, star.
    pub fn typical(machine: &MachineData<T>) -> Self {
        Self {
            tau_scr_s: T::from_f64(0.01),
            integral_limit_a: machine.current_max_a * T::from_f64(0.25),
            connection: Connection::Star,
            slip_factor: T::one(),
        }
    }

    fn validate(&self) -> Result<(), ModelError> {
        guard::SIZE.check("tau_scr_s", self.tau_scr_s.value())?;
        guard::SIZE_OR_ZERO.check("integral_limit_a", self.integral_limit_a.value())?;
        Bound::Within(0.1, 10.0).check("slip_factor", self.slip_factor.value())
    }
}

/// The drive: follows the torque reference.
#[derive(Clone, Copy, Debug)]
pub struct Mtpa<T> {
    law: MtpaLaw<T>,
    gains: MtpaGains<T>,
    pole_pairs: T,
    current_max_a: T,
    rotor_time_constant_s: T,
    /// e^{jθ_e}.
    direction: Complex<T>,
    /// Direction of the flux of a machine that was caught, until the first step.
    caught: Option<Complex<T>>,
    integral: Complex<T>,
    /// The last sample's, for one that is lost: ω (mechanical) and the sampling time.
    before: [T; 2],
    /// The last torque reference that was a number.
    torque_nm: T,
    status: DriveStatus,
}

impl<T: Scalar> Mtpa<T> {
    /// For a machine, with a law and gains.
    ///
    /// # Errors
    /// Machine data, law or gains out of bounds.
    pub fn try_new(machine: &MachineData<T>, law: &MtpaLaw<T>, gains: &MtpaGains<T>) -> Result<Self, ControlError> {
        machine.validate()?;
        law.validate()?;
        gains.validate()?;
        Ok(Self {
            law: *law,
            gains: *gains,
            pole_pairs: machine.n_p(),
            current_max_a: machine.current_max_a,
            rotor_time_constant_s: machine.windings.rotor_inductance_h / machine.windings.rotor_resistance_ohm,
            direction: Complex::new(T::one(), T::zero()),
            caught: None,
            integral: Complex::new(T::zero(), T::zero()),
            before: [T::zero(), T::zero()],
            torque_nm: T::zero(),
            status: DriveStatus::OK,
        })
    }
}

impl<T: Scalar> Controller<T> for Mtpa<T> {
    /// At a sample that cannot be computed with the field turns on as in the last and the regulator stands still; should the state leave
    /// the finite range all the same, it begins anew.
    #[inline]
    fn step(&mut self, m: &Measured<T>, reference: &Reference<T>) -> Command<T> {
        let g = &self.gains;
        let lost = !guard::is_usable(&guard::without_voltages(m), self.current_max_a);
        if !lost {
            self.before = [m.omega_m, m.sample_time_s];
        }
        let [omega_m, t] = self.before;
        let no_reference = !reference.torque_nm.is_finite();
        if !no_reference {
            self.torque_nm = reference.torque_nm;
        }
        let (rms, slip) = self.law.at(self.torque_nm);
        let winding = rms * T::from_f64(core::f64::consts::SQRT_2);
        let wanted = g.connection.line_current(Complex::new(winding, T::zero()));
        let size = norm2(wanted).sqrt();
        let limited = size > self.current_max_a;
        let wanted = if limited { wanted * (self.current_max_a / size) } else { wanted };

        if let Some(flux) = self.caught.take() {
            // Where the current stands to the flux at this slip, in the steady state: i/ψ_r ∝ 1 + jω_s T_r.
            let lead = Complex::new(T::one(), slip * self.rotor_time_constant_s);
            let turned = flux * lead * g.connection.line_current(Complex::new(T::one(), T::zero())).conj();
            self.direction = turned * (T::one() / norm2(turned).sqrt());
        }
        let i = if lost { wanted } else { m.i_s * self.direction.conj() };
        let x = self.integral + (wanted - i) * (t / g.tau_scr_s);
        let within = |x: T| clamp(x, -g.integral_limit_a, g.integral_limit_a);
        self.integral = Complex::new(within(x.re), within(x.im));
        let command = (wanted + self.integral) * self.direction;

        let turned = self.direction * rotation((self.pole_pairs * omega_m + slip * g.slip_factor) * t);
        // One Newton step keeps its length at 1.
        self.direction = turned * (T::from_f64(1.5) - norm2(turned) * T::from_f64(0.5));
        let beyond = self.torque_nm.abs() > self.law.torque_nm[1];
        self.status = DriveStatus::OK
            .and_if(lost, DriveStatus::CURRENT_LOST)
            .and_if(no_reference, DriveStatus::REFERENCE_LOST)
            .and_if(limited, DriveStatus::CURRENT_LIMITED)
            .and_if(beyond, DriveStatus::REFERENCE_LIMITED);
        if !(is_finite(command) && is_finite(self.direction)) {
            self.direction = Complex::new(T::one(), T::zero());
            self.integral = Complex::new(T::zero(), T::zero());
            self.status = DriveStatus::OK.and(DriveStatus::RESTARTED);
            return Command::Current(self.integral);
        }
        Command::Current(command)
    }
}

impl<T: Scalar> BeginsAt<T> for Mtpa<T> {
    fn begin_at(&mut self, caught: &Caught<T>) {
        let turned = caught.rotor_flux_vs * rotation(self.pole_pairs * caught.omega_m * caught.sample_time_s);
        self.caught = (norm2(turned) > T::zero()).then_some(turned);
    }
}

impl<T: Scalar> Reports for Mtpa<T> {
    fn status(&self) -> DriveStatus {
        self.status
    }
}

#[cfg(test)]
mod tests;
