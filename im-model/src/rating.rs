//! What a machine is built for.

use crate::effects::ScaleOf;
use crate::error::{Bound, ModelError};
use crate::parameters::TParameters;
use crate::scalar::Scalar;

/// What the machine is built for: the measures of typical sizes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rating {
    /// Torque, Nm.
    pub torque_nm: f64,
    /// Supply frequency, Hz.
    pub electrical_frequency_hz: f64,
    /// Phase voltage, peak, star-equivalent, V.
    pub phase_voltage_peak_v: f64,
    /// Rotor flux linkage, Vs.
    pub rotor_flux_vs: f64,
}

/// Kinetic energy at synchronous speed over rated power, s.
pub(crate) const INERTIA_CONSTANT_S: f64 = 0.14;

impl Rating {
    /// Keys in files, in the order of the fields, with what machines have.
    pub const BOUNDS: [(&'static str, Bound); 4] = [
        ("torque_nm", Bound::OfMachines(1e-9, 1e9)),
        ("electrical_frequency_hz", Bound::OfMachines(1e-3, 1e5)),
        ("phase_voltage_peak_v", Bound::OfMachines(1e-3, 1e6)),
        ("rotor_flux_vs", Bound::OfMachines(1e-7, 1e4)),
    ];

    /// Checks every quantity: of a size that machines have.
    pub fn validate(&self) -> Result<(), ModelError> {
        let values = [self.torque_nm, self.electrical_frequency_hz, self.phase_voltage_peak_v, self.rotor_flux_vs];
        Self::BOUNDS.into_iter().zip(values).try_for_each(|((key, bound), x)| bound.check(key, x))
    }

    /// A plausible rating when none is given, of the size that the inertia tells: 50 Hz, the torque that brings it to synchronous speed with
    /// a kinetic energy of 0.14 s times the power (as the guess from a [`Nameplate`](crate::Nameplate)), and the rotor flux that makes this torque at a slip of
    /// 4 %. A load's inertia in the file makes it as much too large.
    pub fn guess(p: &TParameters<f64>, pole_pairs: u32) -> Self {
        let n_p = f64::from(pole_pairs);
        let w = 2.0 * core::f64::consts::PI * 50.0;
        let torque = p.inertia_kg_m2 * (w / n_p) / (2.0 * INERTIA_CONSTANT_S);
        let slip = 0.04 * w;
        let flux = Scalar::sqrt(torque * p.rotor_resistance_ohm / (1.5 * n_p * slip));
        Self { torque_nm: torque, electrical_frequency_hz: 50.0, phase_voltage_peak_v: flux * w * 1.08, rotor_flux_vs: flux }
    }

    /// Synchronous mechanical speed, rad/s.
    pub fn synchronous_speed_rad_s(&self, pole_pairs: u32) -> f64 {
        2.0 * core::f64::consts::PI * self.electrical_frequency_hz / f64::from(pole_pairs)
    }

    /// Peak phase current at rated torque and flux, A.
    pub fn current_peak_a(&self, p: &TParameters<f64>, pole_pairs: u32) -> f64 {
        let i_g = p.inverse_gamma();
        // Rotor flux in inverse-Γ is smaller by L_m/L_r.
        let flux = self.rotor_flux_vs * p.magnetizing_inductance_h / p.rotor_inductance_h();
        let torque_current = self.torque_nm / (1.5 * f64::from(pole_pairs) * flux);
        let magnetizing = flux / i_g.magnetizing_inductance_h;
        Scalar::sqrt(torque_current * torque_current + magnetizing * magnetizing)
    }

    /// The unit of `scale` for this machine.
    pub fn unit_of(&self, scale: ScaleOf, p: &TParameters<f64>, pole_pairs: u32) -> f64 {
        let i = self.current_peak_a(p, pole_pairs);
        let w = self.synchronous_speed_rad_s(pole_pairs);
        match scale {
            ScaleOf::One => 1.0,
            ScaleOf::Voltage => self.phase_voltage_peak_v,
            ScaleOf::Current => i,
            ScaleOf::Flux => self.rotor_flux_vs,
            ScaleOf::Torque => self.torque_nm,
            ScaleOf::PerTorque => 1.0 / self.torque_nm,
            ScaleOf::TorquePerSpeedSquared => self.torque_nm / (w * w),
            ScaleOf::Conductance => i / self.phase_voltage_peak_v,
            ScaleOf::Speed => w,
            ScaleOf::StatorHeating => 1.0 / (1.5 * p.stator_resistance_ohm * i * i),
            ScaleOf::RotorHeating => 1.0 / (1.5 * p.rotor_resistance_ohm * i * i),
        }
    }
}
