//! Direct torque control: a voltage vector of the bridge for each sample, by two comparators and a table.
//!
//! ```text
//! ψ_s' = u − R_s i,   τ = (3/2) n_p ψ_s × i = (3/2) n_p ψ_R × ψ_s/L_σ
//! ```
//!
//! Over a sample the rotor's flux hardly moves; the vector moves ψ_s along itself by uT. In the sector k of ψ_s (60° about the vector V_k):
//!
//! | | torque lacks | right | too much |
//! | --- | --- | --- | --- |
//! | flux lacks | V_{k+1} | zero | V_{k−1} |
//! | flux too large | V_{k+2} | zero | V_{k−2} |
//!
//! Where torque is right and flux lacks the zero vector is replaced by V_k at low speed, where the table's flux decays on R_s. What is seen is
//! taken ahead by the delay of the voltage, with the command that acts meanwhile. The flux is the voltage's, drawn to the current model below
//! a crossover frequency (as `direct` field orientation). There is no current regulator: the torque asked for is what the current limit gives, and
//! the stator flux asked for while magnetizing is no more than the current limit's L_σ i from the rotor's.
//!
//! Ripple is what a vector does in a sample, (2/3)U_dc T/L_σ of current: 25 µs suit it, where modulated controllers take 100 µs.
//!
//! Source: I. Takahashi, T. Noguchi, "A new quick-response and high-efficiency control strategy of an induction motor", IEEE Trans. Ind. Appl.
//! 22 (1986).

use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::space_vector::{cross, norm2};
use im_model::{Bound, Complex, ModelError, Scalar};

use crate::error::ControlError;
use crate::field_oriented::FieldOrientedGains;
use crate::flux::{RotorFlux, RotorFluxModel};
use crate::flying_start::{BeginsAt, Caught};
use crate::guard::{self, Sampled, Standing};
use crate::machine_data::MachineData;
use crate::reference::{ReferenceShaper, Shaped};
use crate::speed_regulator::SpeedRegulator;
use crate::stator_flux::StatorFlux;
use crate::status::{DriveStatus, Reports};
use crate::vector::{clamp, norm, rotation};

/// Share of the flux wanted from which on there is torque, and below which there is none any more.
const MAGNETIZED: [f64; 2] = [0.8, 0.25];
/// The six vectors over (2/3)U_dc.
const VECTORS: [[f64; 2]; 6] =
    [[1.0, 0.0], [0.5, ROOT3_HALF], [-0.5, ROOT3_HALF], [-1.0, 0.0], [-0.5, -ROOT3_HALF], [0.5, -ROOT3_HALF]];
const ROOT3_HALF: f64 = 0.866_025_403_784_438_6;

/// What to tune.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectTorqueGains<T> {
    /// Half the width of the torque comparator, Nm.
    pub torque_band_nm: T,
    /// Half the width of the flux comparator, over the flux.
    pub flux_band: T,
    /// Below this frequency the flux is the current model's, rad/s.
    pub crossover_rad_s: T,
    /// Of the speed loop, rad/s.
    pub speed_bandwidth_rad_s: T,
    /// The torque reference is followed in place of the speed reference.
    pub follows_torque: bool,
    /// How the speed reference is shaped.
    pub reference: ReferenceShaper<T>,
    /// What part of U_dc/√3 is used; above, the flux is that over the frequency.
    pub voltage_share: T,
    /// The dc link where none is measured, V.
    pub dc_voltage_v: T,
}

impl<T: Scalar> DirectTorqueGains<T> {
    /// Half widths of 2 % of the torque of the current limit and of 1 % of the flux; the rest as field orientation has it.
    pub fn typical(machine: &MachineData<T>, rotor_flux_vs: T, dc_voltage_v: T, sample_time_s: T) -> Self {
        let c = T::from_f64;
        let as_oriented = FieldOrientedGains::typical(machine, rotor_flux_vs, sample_time_s);
        let w = &machine.windings;
        let torque =
            c(1.5) * machine.n_p() * rotor_flux_vs * w.mutual_inductance_h / w.rotor_inductance_h * machine.current_max_a;
        Self {
            torque_band_nm: torque * c(0.02),
            flux_band: c(0.01),
            crossover_rad_s: c(31.4),
            speed_bandwidth_rad_s: as_oriented.speed_bandwidth_rad_s,
            follows_torque: false,
            reference: as_oriented.reference,
            voltage_share: c(0.92),
            dc_voltage_v,
        }
    }

    fn validate(&self) -> Result<(), ModelError> {
        guard::SIZE.check("torque_band_nm", self.torque_band_nm.value())?;
        Bound::Within(1e-6, 0.5).check("flux_band", self.flux_band.value())?;
        guard::SIZE.check("crossover_rad_s", self.crossover_rad_s.value())?;
        guard::SIZE.check("speed_bandwidth_rad_s", self.speed_bandwidth_rad_s.value())?;
        self.reference.validate()?;
        Bound::Within(0.1, 1.0).check("voltage_share", self.voltage_share.value())?;
        guard::SIZE.check("dc_voltage_v", self.dc_voltage_v.value())
    }
}

/// Direct torque control: follows speed, or torque, and flux.
#[derive(Clone, Copy, Debug)]
pub struct DirectTorque<T> {
    gains: DirectTorqueGains<T>,
    model: RotorFluxModel<T>,
    speed: SpeedRegulator<T>,
    rotor_resistance_ohm: T,
    stator_resistance_ohm: T,
    leakage_h: T,
    magnetizing_h: T,
    k_r: T,
    torque_factor: T,
    voltage_delay_s: T,
    current_max_a: T,
    state: State<T>,
    first: State<T>,
}

#[derive(Clone, Copy, Debug)]
struct State<T> {
    rotor: RotorFlux<T>,
    stator: StatorFlux<T>,
    shaped: Option<Shaped<T>>,
    speed_integral: T,
    magnetized: bool,
    /// What the comparators say: +1, 0, −1; flux lacks.
    torque_level: i8,
    flux_lacks: bool,
    torque_nm: T,
    standing: Standing<T>,
}

/// The sector of a vector: 60° about each of [`VECTORS`].
fn sector<T: Scalar>(psi: Complex<T>) -> usize {
    let root3 = T::from_f64(2.0 * ROOT3_HALF);
    let (x, y) = (psi.re, psi.im);
    // Borders at ±30° of the x axis, and at the y axis.
    if y.abs() * root3 <= x.abs() {
        if x >= T::zero() { 0 } else { 3 }
    } else if y > T::zero() {
        if x >= T::zero() { 1 } else { 2 }
    } else if x >= T::zero() {
        5
    } else {
        4
    }
}

/// A voltage vector of the bridge, V.
fn vector<T: Scalar>(k: usize, dc_voltage_v: T) -> Complex<T> {
    let [re, im] = VECTORS.get(k % 6).copied().unwrap_or([0.0; 2]).map(T::from_f64);
    Complex::new(re, im) * (dc_voltage_v * T::from_f64(2.0 / 3.0))
}

impl<T: Scalar> DirectTorque<T> {
    /// For a machine, with gains.
    ///
    /// # Errors
    /// Machine data or gains out of bounds.
    pub fn try_new(machine: &MachineData<T>, gains: &DirectTorqueGains<T>) -> Result<Self, ControlError> {
        machine.validate()?;
        gains.validate()?;
        let w = &machine.windings;
        let k_r = w.mutual_inductance_h / w.rotor_inductance_h;
        let o = T::zero();
        let state = State {
            rotor: RotorFlux::default(),
            stator: StatorFlux::default(),
            shaped: None,
            speed_integral: o,
            magnetized: false,
            torque_level: 0,
            flux_lacks: true,
            torque_nm: o,
            standing: Standing::new(machine.current_max_a),
        };
        Ok(Self {
            gains: *gains,
            model: RotorFluxModel {
                rotor_inductance_h: w.rotor_inductance_h,
                mutual_inductance_h: w.mutual_inductance_h,
                pole_pairs: machine.n_p(),
            },
            speed: SpeedRegulator { bandwidth_rad_s: gains.speed_bandwidth_rad_s, inertia_kg_m2: w.inertia_kg_m2 },
            rotor_resistance_ohm: w.rotor_resistance_ohm,
            stator_resistance_ohm: w.stator_resistance_ohm,
            leakage_h: w.stator_inductance_h - k_r * w.mutual_inductance_h,
            magnetizing_h: k_r * w.mutual_inductance_h,
            k_r,
            torque_factor: T::from_f64(1.5) * machine.n_p(),
            voltage_delay_s: machine.voltage_delay_s,
            current_max_a: machine.current_max_a,
            state,
            first: state,
        })
    }

    /// Estimated torque, Nm.
    pub fn torque_nm(&self) -> T {
        self.state.torque_nm
    }
}

impl<T: Scalar> Sampled<T> for DirectTorque<T> {
    #[inline]
    fn standing(&mut self) -> &mut Standing<T> {
        &mut self.state.standing
    }

    #[inline]
    fn follow(&mut self, m: &Measured<T>) -> Complex<T> {
        let (g, s) = (&self.gains, &mut self.state);
        let (t, l) = (m.sample_time_s, self.leakage_h);
        let dc = if m.dc_voltage_v > T::zero() { m.dc_voltage_v } else { g.dc_voltage_v };
        let (zero, one) = (T::zero(), T::one());

        // Where the fluxes are, and where they will be when the command acts.
        self.model.step(&mut s.rotor, self.rotor_resistance_ohm, m.i_s, m.omega_m, t);
        let by_current = s.rotor.flux_vs * self.k_r;
        let crossover = if s.magnetized { g.crossover_rad_s } else { T::from_f64(10.0) / t };
        let r_s = self.stator_resistance_ohm;
        let psi_r = s.stator.step(m, by_current + m.i_s * l, l, r_s, crossover, self.voltage_delay_s);
        let size_r = norm(psi_r);
        let torque = self.torque_factor * cross(psi_r, m.i_s);
        s.torque_nm = torque;
        let least = T::from_f64(1e-12);
        let slip = self.k_r * self.k_r * self.rotor_resistance_ohm * cross(psi_r, m.i_s) / (size_r * size_r).max(least);
        let omega_s = self.model.pole_pairs * m.omega_m + if s.magnetized { slip } else { zero };
        let d = self.voltage_delay_s;
        let psi_s = psi_r + m.i_s * l + (s.standing.command - m.i_s * r_s) * d;
        let psi_r = psi_r * rotation(omega_s * d);
        let size = norm(psi_s);
        let torque = self.torque_factor * cross(psi_r, psi_s) / l;

        // The flux to be had: of the voltage, and while there is little of it of the current.
        let ratio = one + l / self.magnetizing_h;
        let asked = (s.standing.reference.rotor_flux_vs * self.k_r).max(zero);
        let u_max = g.voltage_share * dc * T::from_f64(0.5 / ROOT3_HALF);
        let flux_r = asked.min(u_max / (omega_s.abs().max(T::from_f64(1e-3)) * ratio));
        let i_d = (flux_r / self.magnetizing_h).min(self.current_max_a * T::from_f64(0.9));
        // What a vector adds within a sample is not the reference's.
        let ripple = dc * T::from_f64(2.0 / 3.0) * t / l;
        let room = (self.current_max_a - ripple * T::from_f64(0.5)).max(self.current_max_a * T::from_f64(0.3));
        let i_q_max = (room * room - i_d * i_d).max(zero).sqrt();

        let [enough, too_little] = MAGNETIZED.map(|x| flux_r * T::from_f64(x));
        s.magnetized = flux_r > zero && (size_r >= enough || s.magnetized && size_r > too_little);
        // Short of the pull-out: as much ψ_s across the rotor's flux as along it.
        let i_q_max = i_q_max.min(size_r * ratio / l * T::from_f64(0.9));
        let torque_max = if s.magnetized { self.torque_factor * size_r * i_q_max } else { zero };
        let wanted = if g.follows_torque {
            clamp(s.standing.reference.torque_nm, -torque_max, torque_max)
        } else if s.magnetized {
            let shaped = s.shaped.get_or_insert(Shaped::at(m.omega_m));
            let shaper = ReferenceShaper {
                acceleration_max_rad_s2: g.reference.acceleration_max_rad_s2.min(torque_max / self.speed.inertia_kg_m2),
                ..g.reference
            };
            shaper.step(shaped, s.standing.reference.omega_m, t);
            self.speed.step(&mut s.speed_integral, shaped, m.omega_m, torque_max, t)
        } else {
            (s.shaped, s.speed_integral) = (None, zero);
            zero
        };
        let i_q = if s.magnetized { wanted / (self.torque_factor * size_r) } else { zero };
        let along = (flux_r * ratio).min(size_r + l * room * T::from_f64(0.9));
        let flux = (along * along + (l * i_q) * (l * i_q)).sqrt();

        // The comparators.
        let lacking = wanted - torque;
        s.torque_level = if lacking > g.torque_band_nm || s.torque_level > 0 && lacking > zero {
            1
        } else if lacking < -g.torque_band_nm || s.torque_level < 0 && lacking < zero {
            -1
        } else {
            0
        };
        let band = g.flux_band * flux;
        s.flux_lacks = if s.flux_lacks { size < flux + band } else { size < flux - band };

        // The table.
        let k = sector(psi_s);
        // Slower than this a zero vector lets the flux decay faster than the table brings it back.
        let slow = omega_s.abs() < T::from_f64(5.0) * r_s / (l + self.magnetizing_h);
        let u = match (s.torque_level, s.flux_lacks) {
            (1, true) => vector(k + 1, dc),
            (1, false) => vector(k + 2, dc),
            (-1, true) => vector(k + 5, dc),
            (-1, false) => vector(k + 4, dc),
            (_, true) if slow || !s.magnetized => vector(k, dc),
            _ => Complex::new(zero, zero),
        };
        s.standing.status = DriveStatus::OK
            .and_if(!s.magnetized, DriveStatus::MAGNETIZING)
            .and_if(s.magnetized && wanted.abs() >= torque_max, DriveStatus::CURRENT_LIMITED)
            .and_if(flux_r < asked * T::from_f64(0.98), DriveStatus::FIELD_WEAKENING);
        u
    }

    #[inline]
    fn sum(&self) -> T {
        let s = &self.state;
        norm2(s.stator.rotor_flux_vs()) + norm2(s.rotor.flux_vs) + s.torque_nm + s.speed_integral
    }

    fn begin_anew(&mut self) {
        self.state = self.first;
    }
}

impl<T: Scalar> Controller<T> for DirectTorque<T> {
    #[inline]
    fn step(&mut self, m: &Measured<T>, reference: &Reference<T>) -> Command<T> {
        guard::step(self, m, reference)
    }
}

impl<T: Scalar> BeginsAt<T> for DirectTorque<T> {
    fn begin_at(&mut self, caught: &Caught<T>) {
        let s = &mut self.state;
        s.rotor = RotorFlux::of(caught);
        s.stator = StatorFlux::at(caught.rotor_flux_vs * self.k_r, self.leakage_h, caught.i_s, caught.u_s);
        s.standing.command = caught.u_s;
    }

    #[inline]
    fn draw_flux(&mut self, rotor_flux_vs: Complex<T>, share: T) {
        self.state.rotor.draw(rotor_flux_vs, share);
    }
}

impl<T: Scalar> Reports for DirectTorque<T> {
    fn status(&self) -> DriveStatus {
        self.state.standing.status
    }
}

#[cfg(test)]
mod tests;
