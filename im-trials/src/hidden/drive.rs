//! Drives: open-loop voltage over frequency, and vector control of the rotor flux.

use super::machine::CatalogueMachine;
use super::plane::Vector;
use std::f64::consts::TAU;

/// What a drive sees at a sampling instant.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// Stator current, A.
    pub current: Vector,
    /// Mechanical speed, rad/s.
    pub speed_rad_s: f64,
}

/// A drive: from what is wanted and measured to the voltage of the next sample.
pub trait VoltageSource {
    /// Average phase voltage to apply over sample `k`, as it is sent to the inverter.
    fn voltage(&mut self, k: usize, measured: Measured) -> Vector;
}

/// A recorded voltage, played again.
pub struct Playback<'a> {
    /// Voltage of each sample, α, V.
    pub alpha_v: &'a [f64],
    /// Voltage of each sample, β, V.
    pub beta_v: &'a [f64],
}

impl VoltageSource for Playback<'_> {
    fn voltage(&mut self, k: usize, _: Measured) -> Vector {
        Vector::new(self.alpha_v[k], self.beta_v[k])
    }
}

/// Voltage in proportion to frequency, with a boost that covers the resistive drop at standstill.
pub struct VoltsPerHertz<'a> {
    /// Frequency of each sample, Hz.
    pub frequency_hz: &'a [f64],
    /// Factor on the voltage of each sample.
    pub factor: &'a [f64],
    /// Excitation added to the voltage of each sample, V.
    pub excitation: &'a [Vector],
    /// Voltage at rated frequency, V.
    pub rated_v: f64,
    /// Rated frequency, Hz.
    pub rated_hz: f64,
    /// Voltage at standstill, V.
    pub boost_v: f64,
    /// Sampling time, s.
    pub sample_s: f64,
    /// Angle of the voltage, rad.
    pub angle_rad: f64,
}

impl VoltageSource for VoltsPerHertz<'_> {
    fn voltage(&mut self, k: usize, _: Measured) -> Vector {
        let f = self.frequency_hz[k];
        let part = f.abs() / self.rated_hz;
        let length = self.factor[k] * (self.rated_v * part + self.boost_v * (1.0 - part).max(0.0));
        let turn = TAU * f * self.sample_s;
        let u = Vector::polar(length.min(self.rated_v), self.angle_rad + 0.5 * turn);
        self.angle_rad = (self.angle_rad + turn) % TAU;
        u + self.excitation[k]
    }
}

/// Indirect vector control: the angle of the rotor flux is the measured speed plus the slip that the wanted currents imply.
pub struct VectorControl<'a> {
    speed_ref: &'a [f64],
    flux_ref: &'a [f64],
    excitation: &'a [Vector],
    sample_s: f64,
    machine: CatalogueMachine,
    current_limit_a: f64,
    angle_rad: f64,
    flux_vs: f64,
    torque_integral_nm: f64,
    voltage_integral: Vector,
}

impl<'a> VectorControl<'a> {
    /// A controller tuned from the (wrong) parameters it believes in.
    pub fn new(
        believed: &CatalogueMachine,
        speed_ref: &'a [f64],
        flux_ref: &'a [f64],
        excitation: &'a [Vector],
        sample_s: f64,
    ) -> Self {
        Self {
            speed_ref,
            flux_ref,
            excitation,
            sample_s,
            machine: believed.clone(),
            current_limit_a: 1.4 * believed.rated_current_a(),
            angle_rad: 0.0,
            flux_vs: 0.02 * believed.rated_rotor_flux_vs,
            torque_integral_nm: 0.0,
            voltage_integral: Vector::ZERO,
        }
    }
}

impl VoltageSource for VectorControl<'_> {
    fn voltage(&mut self, k: usize, measured: Measured) -> Vector {
        let m = &self.machine;
        let (n_p, dt) = (f64::from(m.pole_pairs), self.sample_s);
        let rotor_h = m.rotor_leakage_h + m.magnetizing_h;
        let coupling = m.magnetizing_h / rotor_h;
        let leakage_h = m.stator_leakage_h + coupling * m.rotor_leakage_h;
        let rotor_rate = m.rotor_resistance_ohm / rotor_h;

        // Speed loop: torque within what the current limit leaves beside the flux.
        let flux_error = self.flux_ref[k] - self.flux_vs;
        let d_ref = ((self.flux_ref[k] + 4.0 * flux_error) / m.magnetizing_h).clamp(0.0, 0.9 * self.current_limit_a);
        let room_a = (self.current_limit_a.powi(2) - d_ref * d_ref).max(0.0).sqrt();
        let torque_per_a = 1.5 * n_p * coupling * self.flux_vs;
        let bandwidth = 40.0;
        let error = self.speed_ref[k] - measured.speed_rad_s;
        let wanted = bandwidth * m.inertia_kg_m2 * error + self.torque_integral_nm;
        let limit_nm = room_a * torque_per_a;
        let torque_nm = wanted.clamp(-limit_nm, limit_nm);
        if wanted == torque_nm {
            self.torque_integral_nm += 0.25 * bandwidth * bandwidth * m.inertia_kg_m2 * error * dt;
        }
        let q_ref = torque_nm / torque_per_a;

        // Orientation.
        let slip = rotor_rate * m.magnetizing_h * q_ref / self.flux_vs;
        let omega_s = n_p * measured.speed_rad_s + slip;
        let (sin, cos) = self.angle_rad.sin_cos();
        let current = measured.current.turn_back((cos, sin));

        // Current loop: pole cancellation at 90 Hz, with the back-e.m.f. fed forward.
        let bandwidth = TAU * 90.0;
        let i_error = Vector::new(d_ref, q_ref) - current;
        let resistance = m.stator_resistance_ohm + coupling * coupling * m.rotor_resistance_ohm;
        let back_emf = (current * leakage_h).quarter_turn() * omega_s
            + Vector::new(-rotor_rate, n_p * measured.speed_rad_s) * (coupling * self.flux_vs);
        let wanted = i_error * (bandwidth * leakage_h) + self.voltage_integral + back_emf;
        let length = wanted.length();
        let u = if length > m.rated_voltage_v { wanted * (m.rated_voltage_v / length) } else { wanted };
        if length <= m.rated_voltage_v {
            self.voltage_integral = self.voltage_integral + i_error * (bandwidth * resistance * dt);
        }

        // The flux model runs on the wanted current, and cannot fall to nothing.
        self.flux_vs += dt * rotor_rate * (m.magnetizing_h * d_ref - self.flux_vs);
        self.flux_vs = self.flux_vs.max(0.02 * m.rated_rotor_flux_vs);
        let middle = self.angle_rad + 0.5 * omega_s * dt;
        self.angle_rad = (self.angle_rad + omega_s * dt) % TAU;
        let (sin, cos) = middle.sin_cos();
        u.turn((cos, sin)) + self.excitation[k]
    }
}
