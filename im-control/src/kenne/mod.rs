//! Sliding-mode control of speed and rotor flux (Kenné, Ahmed-Ali, Nkwawo, Lamnabhi-Lagarrigue 2005).
//!
//! ```text
//! dλ/dt = (−R_r/L_r + jn_pω) λ + (R_r/L_r) M i_s,   T_e = mμ Im(λ̄ i_s)                         (44), (45)
//! s_ω = ω̇ − ω̇_ref + c_ω (ω − ω_ref),   s_λ = d|λ|²/dt − Ḟ_ref + c_λ (|λ|² − F_ref)              (17)
//! v_s = (λ/|λ|)(v_sd + jv_sq),   v_sq = v̂_sq − k_vsq sign s_ω,   v_sd = v̂_sd − k_vsd sign s_λ      (46), (15), (16)
//! ```
//!
//! with v̂ from ṡ = 0, (47) and (48). The derivatives in s follow from the model: ω̇ = (T_e − αω − T_L)/m and (9).
//!
//! What the paper leaves open, and what is done here:
//!
//! - *Current limit.* s_ω = ω̇ − a* with a* = ω̇_ref − c_ω e_ω; a* is kept within the accelerations that the current allows, and
//!   likewise the rate of |λ|². Within these limits the law is the paper's; at a limit it slides along it.
//! - *Sampling.* The sign has a boundary layer; v_s is turned ahead to the middle of its sample.
//! - *Offset.* Inside the layer a wrong v̂ leaves an offset. The mean of the switching term, which is what v̂ lacks (the equivalent control,
//!   Remark 6), is fed back: v_q gains v_e with dv_e/dt = −a_e k_vsq sat(s_ω/Φ_ω), |v_e| ≤ k_vsq, and d likewise.
//! - *Zero flux.* The law divides by |λ|: below a quarter of the flux wanted a current regulator builds up the flux.
//! - *Reference.* ω_ref is shaped so that its two derivatives exist; F_ref may change (its derivative enters as Remark 4 says).

mod gains;
mod law;

use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::space_vector::{cross, dot, j, norm2};
use im_model::{Complex, Scalar};

use crate::current_regulator::{CurrentRegulator, Turning};
use crate::error::ControlError;
use crate::flux::{RotorFlux, RotorFluxModel};
use crate::flying_start::{BeginsAt, Caught};
use crate::guard::{self, Sampled, Standing};
use crate::load_torque::{LoadTorqueEstimate, LoadTorqueObserver};
use crate::machine_data::MachineData;
use crate::reference::Shaped;
use crate::status::{DriveStatus, Reports};
use crate::vector::{norm, rotation};

pub use gains::{KenneGains, LoadTorqueSource, input_gains, switching_gain};
use law::{Aims, Law, Seen};

/// Share of the flux wanted from which on the law is used, and below which it is not any more.
const MAGNETIZED: [f64; 2] = [0.6, 0.25];

/// A drive by Kenné et al.'s law: follows speed and rotor flux.
#[derive(Clone, Copy, Debug)]
pub struct Kenne<T> {
    law: Law<T>,
    gains: KenneGains<T>,
    model: RotorFluxModel<T>,
    load: LoadTorqueObserver<T>,
    magnetizing: CurrentRegulator<T>,
    rotor_resistance_ohm: T,
    current_max_a: T,
    state: State<T>,
    /// Before the first sample.
    first: State<T>,
}

#[derive(Clone, Copy, Debug)]
struct State<T> {
    rotor: RotorFlux<T>,
    load: LoadTorqueEstimate<T>,
    direction: Complex<T>,
    current_integral: Complex<T>,
    /// v_e, V: what v̂ was found to lack.
    lacking: Complex<T>,
    shaped: Shaped<T>,
    flux_limit: T,
    /// The squared flux reference of the sample before, where there was one.
    flux2_before: Option<T>,
    wanted_v: T,
    omega_s: T,
    magnetized: bool,
    torque_nm: T,
    standing: Standing<T>,
}

impl<T: Scalar> Kenne<T> {
    /// For a machine, with gains.
    ///
    /// # Errors
    /// Machine data or gains out of bounds.
    pub fn try_new(machine: &MachineData<T>, gains: &KenneGains<T>) -> Result<Self, ControlError> {
        machine.validate()?;
        gains.validate()?;
        let w = &machine.windings;
        let law = Law::new(w, machine.pole_pairs);
        let k_r = w.mutual_inductance_h / w.rotor_inductance_h;
        let (o, z) = (T::zero(), Complex::new(T::zero(), T::zero()));
        let state = State {
            rotor: RotorFlux::default(),
            load: LoadTorqueEstimate::default(),
            direction: Complex::new(T::one(), o),
            current_integral: z,
            lacking: z,
            shaped: Shaped::at(o),
            flux_limit: o,
            flux2_before: None,
            wanted_v: o,
            omega_s: o,
            magnetized: false,
            torque_nm: o,
            standing: Standing::new(machine.current_max_a),
        };
        Ok(Self {
            law,
            gains: *gains,
            model: RotorFluxModel {
                rotor_inductance_h: w.rotor_inductance_h,
                mutual_inductance_h: w.mutual_inductance_h,
                pole_pairs: machine.n_p(),
            },
            load: LoadTorqueObserver {
                inertia_kg_m2: w.inertia_kg_m2,
                viscous_friction_nm_s_per_rad: w.viscous_friction_nm_s_per_rad,
                bandwidth_per_s: gains.load_bandwidth_per_s,
                limit_nm: gains.load_limit_nm,
            },
            magnetizing: CurrentRegulator {
                bandwidth_rad_s: gains.magnetizing_bandwidth_rad_s,
                leakage_inductance_h: law.sigma_l_s,
                resistance_ohm: w.stator_resistance_ohm + k_r * k_r * w.rotor_resistance_ohm,
                voltage_delay_s: machine.voltage_delay_s,
            },
            rotor_resistance_ohm: w.rotor_resistance_ohm,
            current_max_a: machine.current_max_a,
            state,
            first: state,
        })
    }

    /// The rotor resistance from now on, Ω: how the identifier (43) takes part. Ignored unless positive and finite.
    pub fn set_rotor_resistance_ohm(&mut self, rotor_resistance_ohm: T) {
        if rotor_resistance_ohm > T::zero() && rotor_resistance_ohm.is_finite() {
            self.rotor_resistance_ohm = rotor_resistance_ohm;
        }
    }

    /// Rotor resistance in use, Ω.
    pub fn rotor_resistance_ohm(&self) -> T {
        self.rotor_resistance_ohm
    }

    /// Load torque and its rate, Nm and Nm/s, where they are given ([`LoadTorqueSource::Given`]).
    pub fn set_load_torque(&mut self, torque_nm: T, rate_nm_per_s: T) {
        if self.gains.load_torque == LoadTorqueSource::Given && torque_nm.is_finite() && rate_nm_per_s.is_finite() {
            (self.state.load.torque_nm, self.state.load.rate_nm_per_s) = (torque_nm, rate_nm_per_s);
        }
    }

    /// λ̂_r of (44), stator frame, Vs.
    pub fn rotor_flux_vs(&self) -> Complex<T> {
        self.state.rotor.flux_vs
    }

    /// T̂_e of (45), Nm.
    pub fn torque_nm(&self) -> T {
        self.state.torque_nm
    }

    /// Load torque in use, Nm.
    pub fn load_torque_nm(&self) -> T {
        self.state.load.torque_nm
    }

    /// Speed reference after shaping, rad/s.
    pub fn shaped_speed_rad_s(&self) -> T {
        self.state.shaped.speed
    }
}

impl<T: Scalar> Sampled<T> for Kenne<T> {
    #[inline]
    fn standing(&mut self) -> &mut Standing<T> {
        &mut self.state.standing
    }

    #[inline]
    fn follow(&mut self, m: &Measured<T>) -> Complex<T> {
        let (law, g, s) = (&self.law, &self.gains, &mut self.state);
        let c = T::from_f64;
        let (t, r_r) = (m.sample_time_s, self.rotor_resistance_ohm);
        let torque_before = s.torque_nm;

        self.model.step(&mut s.rotor, r_r, m.i_s, m.omega_m, t);
        let lambda = s.rotor.flux_vs;
        s.torque_nm = law.torque_factor * cross(lambda, m.i_s);
        if g.load_torque == LoadTorqueSource::Estimated {
            self.load.step(&mut s.load, (torque_before + s.torque_nm) * c(0.5), m.omega_m, t);
        }

        let size = norm(lambda);
        let wanted = s.standing.reference.rotor_flux_vs.max(T::zero());
        let omega_e = law.n_p * m.omega_m;
        s.direction = if size > wanted * c(1e-3) && size > T::zero() {
            lambda * (T::one() / size)
        } else {
            let turned = s.direction * rotation(omega_e * t);
            turned * (c(1.5) - norm2(turned) * c(0.5))
        };
        // In the unit of λ the voltage of the inverse-Γ flux is larger by L_r/M.
        let flux = g.field_weakening.step(&mut s.flux_limit, wanted, s.wanted_v, s.omega_s, m.dc_voltage_v, t);
        let [enough, too_little] = MAGNETIZED.map(|x| flux * c(x));
        s.magnetized = flux > T::zero() && (size >= enough || s.magnetized && size > too_little);
        let i = m.i_s * s.direction.conj();
        let mut status = DriveStatus::OK.and_if(flux < wanted * c(0.98), DriveStatus::FIELD_WEAKENING);
        let frame = |slip| Turning {
            direction: s.direction,
            omega_s: omega_e + slip,
            dc_voltage_v: m.dc_voltage_v,
            sample_time_s: t,
            overmodulates: false,
        };

        let out = if s.magnetized {
            let load = (s.load.torque_nm, s.load.rate_nm_per_s);
            let seen = Seen {
                omega_m: m.omega_m,
                flux_vs: size,
                x: dot(lambda, m.i_s),
                torque_nm: s.torque_nm,
                i2: norm2(m.i_s),
                load,
                r_r,
            };
            // The torque that the current leaves beside the flux; at least a fifth of the current is the torque's.
            let i_max = self.current_max_a;
            let i_q_max = (i_max * i_max - i.re * i.re).max(i_max * i_max * c(0.04)).sqrt();
            let torque_max = law.torque_factor * size * i_q_max;
            let flux2 = flux * flux;
            let flux2_rate = s.flux2_before.map_or(T::zero(), |before| (flux2 - before) / t);
            s.flux2_before = Some(flux2);
            let shaper = crate::reference::ReferenceShaper {
                acceleration_max_rad_s2: g.reference.acceleration_max_rad_s2.min(torque_max / law.m),
                ..g.reference
            };
            shaper.step(&mut s.shaped, s.standing.reference.omega_m, t);
            let aims = Aims { speed: s.shaped, flux2, flux2_rate, torque_max, i_d_max: i_max * c(0.9) };
            let limited = s.standing.status.has(DriveStatus::VOLTAGE_LIMITED);
            let v = law.voltage(g, &seen, &aims, &mut s.lacking, if limited { T::zero() } else { t });
            status = status.and_if(v.limited, DriveStatus::CURRENT_LIMITED);
            let slip = r_r / self.model.rotor_inductance_h * self.model.mutual_inductance_h * i.im / size;
            s.current_integral = Complex::new(T::zero(), T::zero());
            let frame = frame(slip);
            s.omega_s = frame.omega_s;
            frame.to_stator(v.v, self.magnetizing.voltage_delay_s)
        } else {
            status = status.and(DriveStatus::MAGNETIZING);
            (s.shaped, s.lacking) = (Shaped::at(m.omega_m), Complex::new(T::zero(), T::zero()));
            s.flux2_before = None;
            let k_r = law.m_big / self.model.rotor_inductance_h;
            let psi = Complex::new(size * k_r, T::zero());
            let emf = j(psi) * omega_e - psi * (r_r / self.model.rotor_inductance_h);
            let i_d = (flux / law.m_big * c(2.0)).min(self.current_max_a * c(0.9));
            let frame = frame(T::zero());
            s.omega_s = frame.omega_s;
            self.magnetizing.follow(&mut s.current_integral, &frame, Complex::new(i_d, T::zero()), i, emf)
        };
        // What the sliding terms add is not the steady need for voltage; it averages out in the limit of the flux.
        s.wanted_v = out.wanted_v * self.model.rotor_inductance_h / law.m_big;
        s.standing.status = status.and_if(out.limited, DriveStatus::VOLTAGE_LIMITED);
        out.u_s
    }

    #[inline]
    fn sum(&self) -> T {
        let s = &self.state;
        s.current_integral.re + s.current_integral.im + s.flux_limit + s.torque_nm
    }

    fn begin_anew(&mut self) {
        self.state = self.first;
    }
}

impl<T: Scalar> Controller<T> for Kenne<T> {
    #[inline]
    fn step(&mut self, m: &Measured<T>, reference: &Reference<T>) -> Command<T> {
        guard::step(self, m, reference)
    }
}

impl<T: Scalar> BeginsAt<T> for Kenne<T> {
    fn begin_at(&mut self, caught: &Caught<T>) {
        let s = &mut self.state;
        s.rotor = RotorFlux::of(caught);
        s.shaped = Shaped::at(caught.omega_m);
        s.omega_s = self.law.n_p * caught.omega_m;
        // Flux that is there is within what the voltage allows.
        s.flux_limit = norm(caught.rotor_flux_vs);
        s.wanted_v = norm(caught.rotor_flux_vs) * s.omega_s.abs();
    }

    #[inline]
    fn draw_flux(&mut self, rotor_flux_vs: Complex<T>, share: T) {
        self.state.rotor.draw(rotor_flux_vs, share);
    }
}

impl<T: Scalar> Reports for Kenne<T> {
    fn status(&self) -> DriveStatus {
        self.state.standing.status
    }
}

#[cfg(test)]
mod tests;
