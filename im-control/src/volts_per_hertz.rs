//! Volts per hertz with slip compensation: the baseline without a speed, measured or estimated.
//!
//! In the frame of the stator flux that is asked for, which turns at ω_s, inverse-Γ form, α = R_R/L_M:
//!
//! ```text
//! u = R_s i* + jω_s ψ_s,   ω_s = n_p ω* + ω_slip − k r (i_q − ī_q),   ω_slip = r ī_q,   r = (R_R + αL_σ)/(ψ_s − L_σ i_d*)
//! i_d* = (αψ_s + ω_slip L_σ ī_q)/(R_R + αL_σ),   i_q* = ī_q,   ī' = α_f (i − ī)
//! ```
//!
//! i* is the current that the machine has at this flux, slip and torque. Fast changes of the torque current lower the frequency, by k times
//! the slip that belongs to them: without (k = 0) the compensation of R_s takes the damping away and the machine swings from a third of its
//! rated frequency on (`without_droop_it_swings`). Above the current limit the voltage gives way as a current regulator's does, and
//! the frequency runs back with the shaft. Nothing here sees the speed: an error of the slip is an error of the speed, and a load that goes on
//! beyond what the current carries pulls the machine out, which nothing tells.
//!
//! After M. Hinkkanen, L. Tiitinen, E. Mölsä, L. Harnefors, "On the stability of volts-per-hertz control for induction motors", IEEE J.
//! Emerg. Sel. Top. Power Electron. 10 (2022); the slip from the exact steady state: derived here.

use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::space_vector::{j, norm2};
use im_model::{Bound, Complex, ModelError, Scalar};

use crate::current_regulator::{CurrentRegulator, Turning};
use crate::error::ControlError;
use crate::flying_start::{BeginsAt, Caught};
use crate::guard::{self, Sampled, Standing};
use crate::machine_data::MachineData;
use crate::reference::{ReferenceShaper, Shaped};
use crate::status::{DriveStatus, Reports};
use crate::vector::{clamp, norm, rotation, shortened};

/// Share of the flux wanted at which the magnetizing ends.
const MAGNETIZED: f64 = 0.9;

/// What to tune.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoltsPerHertzGains<T> {
    /// k: how much of the slip of a fast change the frequency gives way by.
    pub droop: T,
    /// α_f: of the current that slip and voltage are compensated with, rad/s.
    pub filter_rad_s: T,
    /// How much of the slip is compensated: 1, or 0 for bare volts per hertz.
    pub slip_share: T,
    /// How fast the frequency runs back above the current limit, rad/s² (mechanical) per A.
    pub run_back_rad_s2_per_a: T,
    /// The ramp.
    pub reference: ReferenceShaper<T>,
    /// What part of U_dc/√3 is used; above, the flux is that over the frequency.
    pub voltage_share: T,
}

impl<T: Scalar> VoltsPerHertzGains<T> {
    /// Gains for a machine: k = 3, a filter of 10 rad/s, the acceleration that 40 %
    /// of the current limit gives at `rotor_flux_vs`, run back at four times what the excess of current accelerates.
    pub fn typical(machine: &MachineData<T>, rotor_flux_vs: T) -> Self {
        let c = T::from_f64;
        let w = &machine.windings;
        let per_ampere = c(1.5) * machine.n_p() * rotor_flux_vs * w.mutual_inductance_h / w.rotor_inductance_h / w.inertia_kg_m2;
        let acceleration = per_ampere * machine.current_max_a * c(0.4);
        Self {
            droop: c(3.0),
            filter_rad_s: c(10.0),
            slip_share: T::one(),
            run_back_rad_s2_per_a: per_ampere * c(4.0),
            reference: ReferenceShaper { bandwidth_rad_s: c(30.0), acceleration_max_rad_s2: acceleration },
            voltage_share: c(0.92),
        }
    }

    fn validate(&self) -> Result<(), ModelError> {
        Bound::Within(0.0, 100.0).check("droop", self.droop.value())?;
        guard::SIZE.check("filter_rad_s", self.filter_rad_s.value())?;
        Bound::Within(0.0, 2.0).check("slip_share", self.slip_share.value())?;
        guard::SIZE_OR_ZERO.check("run_back_rad_s2_per_a", self.run_back_rad_s2_per_a.value())?;
        self.reference.validate()?;
        Bound::Within(0.1, 1.0).check("voltage_share", self.voltage_share.value())
    }
}

/// Volts per hertz: follows speed and flux without seeing either.
#[derive(Clone, Copy, Debug)]
pub struct VoltsPerHertz<T> {
    gains: VoltsPerHertzGains<T>,
    current: CurrentRegulator<T>,
    pole_pairs: T,
    stator_resistance_ohm: T,
    /// R_R and L_M.
    rotor_resistance_ohm: T,
    magnetizing_inductance_h: T,
    /// M/L_r.
    k_r: T,
    current_max_a: T,
    state: State<T>,
    first: State<T>,
}

#[derive(Clone, Copy, Debug)]
struct State<T> {
    direction: Complex<T>,
    /// ī.
    current: Complex<T>,
    shaped: Shaped<T>,
    /// ψ_R as it is built up at standstill.
    rotor_flux: T,
    magnetized: bool,
    omega_s: T,
    standing: Standing<T>,
}

impl<T: Scalar> VoltsPerHertz<T> {
    /// For a machine, with gains.
    ///
    /// # Errors
    /// Machine data or gains out of bounds.
    pub fn try_new(machine: &MachineData<T>, gains: &VoltsPerHertzGains<T>, sample_time_s: T) -> Result<Self, ControlError> {
        machine.validate()?;
        gains.validate()?;
        guard::check_sample_time("sample_time_s", sample_time_s)?;
        let w = &machine.windings;
        let k_r = w.mutual_inductance_h / w.rotor_inductance_h;
        let (o, z) = (T::zero(), Complex::new(T::zero(), T::zero()));
        let state = State {
            direction: Complex::new(T::one(), o),
            current: z,
            shaped: Shaped::at(o),
            rotor_flux: o,
            magnetized: false,
            omega_s: o,
            standing: Standing::new(machine.current_max_a),
        };
        Ok(Self {
            gains: *gains,
            current: CurrentRegulator::of(machine, sample_time_s),
            pole_pairs: machine.n_p(),
            stator_resistance_ohm: w.stator_resistance_ohm,
            rotor_resistance_ohm: k_r * k_r * w.rotor_resistance_ohm,
            magnetizing_inductance_h: k_r * w.mutual_inductance_h,
            k_r,
            current_max_a: machine.current_max_a,
            state,
            first: state,
        })
    }

    /// Torque by the current that is compensated with, Nm.
    pub fn torque_nm(&self) -> T {
        let psi_s = self.state.rotor_flux * (T::one() + self.current.leakage_inductance_h / self.magnetizing_inductance_h);
        T::from_f64(1.5) * self.pole_pairs * psi_s * self.state.current.im
    }

    fn made(&self, m: &Measured<T>, u: Complex<T>) -> crate::Regulated<T> {
        let s = &self.state;
        let frame = Turning {
            direction: s.direction,
            omega_s: s.omega_s,
            dc_voltage_v: m.dc_voltage_v,
            sample_time_s: m.sample_time_s,
            overmodulates: false,
        };
        frame.to_stator(u, self.current.voltage_delay_s)
    }
}

impl<T: Scalar> Sampled<T> for VoltsPerHertz<T> {
    #[inline]
    fn standing(&mut self) -> &mut Standing<T> {
        &mut self.state.standing
    }

    #[inline]
    fn follow(&mut self, m: &Measured<T>) -> Complex<T> {
        let (g, s) = (&self.gains, &mut self.state);
        let (t, half) = (m.sample_time_s, T::from_f64(0.5));
        let (l_sigma, l_m) = (self.current.leakage_inductance_h, self.magnetizing_inductance_h);
        let alpha = self.rotor_resistance_ohm / l_m;
        let wanted = (s.standing.reference.rotor_flux_vs * self.k_r).max(T::zero());

        // The frame goes on as it turned, and with it what was filtered.
        s.direction *= rotation(s.omega_s * t);
        s.direction *= (T::from_f64(3.0) - norm2(s.direction)) * half;
        let i = m.i_s * s.direction.conj();
        let share = g.filter_rad_s * t / (T::one() + g.filter_rad_s * t);
        s.current += (i - s.current) * share;

        // At standstill the flux is built up first, with up to twice the current that holds it.
        if !s.magnetized {
            let d = (wanted / l_m * T::from_f64(2.0)).min(self.current_max_a * T::from_f64(0.9));
            let rate = self.rotor_resistance_ohm * i.re.max(T::zero()) - alpha * s.rotor_flux;
            s.rotor_flux = (s.rotor_flux + rate * t).max(T::zero());
            s.magnetized = wanted > T::zero() && s.rotor_flux >= wanted * T::from_f64(MAGNETIZED);
            s.standing.status = DriveStatus::OK.and(DriveStatus::MAGNETIZING);
            s.omega_s = T::zero();
            let wanted = Complex::new(d, T::zero());
            let u = wanted * self.stator_resistance_ohm + (wanted - i) * (l_sigma * self.current.bandwidth_rad_s);
            s.current = i;
            return self.made(m, u).u_s;
        }

        // The flux that the voltage allows.
        let mut flux = wanted * (T::one() + l_sigma / l_m);
        let mut weakened = false;
        if m.dc_voltage_v > T::zero() {
            let u_max = g.voltage_share * m.dc_voltage_v * T::from_f64(1.0 / 1.732_050_807_568_877_2);
            let most = (u_max - self.stator_resistance_ohm * s.current.im.abs()).max(u_max * half)
                / s.omega_s.abs().max(T::from_f64(1e-3));
            weakened = most < flux;
            flux = flux.min(most);
        }
        s.rotor_flux = flux / (T::one() + l_sigma / l_m);

        // Slip and the current that belongs to it.
        let damped = self.rotor_resistance_ohm + alpha * l_sigma;
        let i_d = alpha * flux / damped;
        let left = (flux - l_sigma * i_d).max(flux * T::from_f64(0.1));
        // Half of the pull-out slip: beyond, more slip is less torque.
        let pull_out = damped / l_sigma * half;
        let per_ampere = damped / left.max(T::from_f64(1e-9));
        let slip = clamp(per_ampere * s.current.im, -pull_out, pull_out);
        let droop = clamp(g.droop * per_ampere * (i.im - s.current.im), -pull_out, pull_out);
        let i_d = (alpha * flux + slip * l_sigma * s.current.im) / damped;
        let steady = Complex::new(i_d, s.current.im);

        // The ramp, which waits and runs back where the current is at its limit.
        let excess = norm(i) - self.current_max_a;
        let limited = excess > T::zero();
        g.reference.step(&mut s.shaped, s.standing.reference.omega_m, t);
        if limited {
            let back = g.run_back_rad_s2_per_a * excess * t;
            let moved = s.shaped.rate * t;
            let speed = s.shaped.speed - moved - if i.im > T::zero() { back } else { -back };
            s.shaped = Shaped::at(speed);
        }
        s.omega_s = self.pole_pairs * s.shaped.speed + slip * g.slip_share - droop;

        let mut u = steady * self.stator_resistance_ohm + j(Complex::new(flux, T::zero())) * s.omega_s;
        u -= (i - shortened(i, self.current_max_a)) * (l_sigma * self.current.bandwidth_rad_s);
        let out = self.made(m, u);
        self.state.standing.status = DriveStatus::OK
            .and_if(out.limited, DriveStatus::VOLTAGE_LIMITED)
            .and_if(limited, DriveStatus::CURRENT_LIMITED)
            .and_if(weakened, DriveStatus::FIELD_WEAKENING);
        out.u_s
    }

    #[inline]
    fn sum(&self) -> T {
        let s = &self.state;
        s.omega_s + s.shaped.speed + s.rotor_flux + s.current.re + s.current.im + s.direction.re + s.direction.im
    }

    fn begin_anew(&mut self) {
        self.state = self.first;
    }
}

impl<T: Scalar> Controller<T> for VoltsPerHertz<T> {
    /// The measured speed is not looked at.
    #[inline]
    fn step(&mut self, m: &Measured<T>, reference: &Reference<T>) -> Command<T> {
        guard::step(self, &Measured { omega_m: T::zero(), ..*m }, reference)
    }
}

impl<T: Scalar> BeginsAt<T> for VoltsPerHertz<T> {
    fn begin_at(&mut self, caught: &Caught<T>) {
        let psi = caught.rotor_flux_vs * self.k_r;
        let size = norm(psi);
        let s = &mut self.state;
        s.rotor_flux = size;
        s.shaped = Shaped::at(caught.omega_m);
        s.omega_s = self.pole_pairs * caught.omega_m;
        if size > T::zero() {
            s.direction = psi * (T::one() / size);
            s.magnetized = true;
        }
    }
}

impl<T: Scalar> Reports for VoltsPerHertz<T> {
    fn status(&self) -> DriveStatus {
        self.state.standing.status
    }
}

#[cfg(test)]
mod tests;
