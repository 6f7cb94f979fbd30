//! Field orientation, the baseline: torque and flux as two currents in the frame of the rotor flux.
//!
//! In inverse-Γ form, d along ψ_R:  dψ_R/dt = R_R i_d − ψ_R/T_r,   τ = (3/2) n_p ψ_R i_q,   ω_s = n_p ω + R_R i_q/ψ_R
//!
//! *Indirect*: the flux follows from current and speed alone (the slip relation, fed with the measured current). *Direct*: above a
//! crossover frequency it follows from the voltage, which does not need R_r.

mod gains;

use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::space_vector::{j, norm2};
use im_model::{Complex, Scalar};

use crate::current_regulator::{CurrentRegulator, Turning};
use crate::discrete_current::{CurrentControl, DiscreteCurrent};
use crate::error::ControlError;
use crate::flux::{RotorFlux, RotorFluxModel, SampledFlux};
use crate::flying_start::{BeginsAt, Caught};
use crate::guard::{self, Sampled, Standing};
use crate::machine_data::MachineData;
use crate::optimal_flux::Operation;
use crate::reference::{ReferenceShaper, Shaped};
use crate::speed_regulator::SpeedRegulator;
use crate::stator_flux::StatorFlux;
use crate::status::{DriveStatus, Reports};
use crate::vector::{clamp, norm, rotation, within};

pub use gains::{FieldOrientedGains, Orientation};

/// Share of the flux wanted from which on there is torque, and below which there is none any more.
const MAGNETIZED: [f64; 2] = [0.8, 0.25];
/// Of the current at which the torque is largest.
const SHORT_OF_PULL_OUT: f64 = 0.9;

/// A drive by field orientation: follows speed, or torque, and rotor flux.
#[derive(Clone, Copy, Debug)]
pub struct FieldOriented<T> {
    law: Law<T>,
    state: State<T>,
    /// Before the first sample.
    first: State<T>,
}

/// What does not change from sample to sample.
#[derive(Clone, Copy, Debug)]
struct Law<T> {
    gains: FieldOrientedGains<T>,
    speed: SpeedRegulator<T>,
    pole_pairs: T,
    voltage_delay_s: T,
    rotor_resistance_ohm: T,
    stator_resistance_ohm: T,
    mutual_inductance_h: T,
    inverse_inertia: T,
    current_max_a: T,
    /// Of i_d.
    magnetizing_max_a: T,
    stator_leakage_h: T,
    rotor_leakage_h: T,
    /// (3/2) n_p.
    torque_factor: T,
}

#[derive(Clone, Copy, Debug)]
struct State<T> {
    circuit: Circuit<T>,
    rotor: RotorFlux<T>,
    stator: StatorFlux<T>,
    /// Direction of the flux; kept turning with the rotor where there is none.
    direction: Complex<T>,
    current_integral: Complex<T>,
    discrete: DiscreteCurrent<T>,
    speed_integral: T,
    shaped: Shaped<T>,
    /// The flux that follows the torque, and the torque that it follows.
    optimal_flux: T,
    asked_nm: T,
    current_limited: bool,
    flux_limit: T,
    wanted_v: T,
    omega_s: T,
    magnetized: bool,
    torque_nm: T,
    standing: Standing<T>,
}

impl<T: Scalar> FieldOriented<T> {
    /// For a machine, with gains.
    ///
    /// # Errors
    /// Machine data or gains out of bounds.
    pub fn try_new(machine: &MachineData<T>, gains: &FieldOrientedGains<T>) -> Result<Self, ControlError> {
        machine.validate()?;
        gains.validate()?;
        let w = &machine.windings;
        let law = Law {
            gains: *gains,
            speed: SpeedRegulator { bandwidth_rad_s: gains.speed_bandwidth_rad_s, inertia_kg_m2: w.inertia_kg_m2 },
            pole_pairs: machine.n_p(),
            voltage_delay_s: machine.voltage_delay_s,
            mutual_inductance_h: w.mutual_inductance_h,
            rotor_resistance_ohm: w.rotor_resistance_ohm,
            stator_resistance_ohm: w.stator_resistance_ohm,
            inverse_inertia: T::one() / w.inertia_kg_m2,
            current_max_a: machine.current_max_a,
            magnetizing_max_a: machine.current_max_a * T::from_f64(0.9),
            stator_leakage_h: w.stator_inductance_h - w.mutual_inductance_h,
            rotor_leakage_h: w.rotor_inductance_h - w.mutual_inductance_h,
            torque_factor: T::from_f64(1.5) * machine.n_p(),
        };
        let (o, z) = (T::zero(), Complex::new(T::zero(), T::zero()));
        let state = State {
            circuit: law.circuit(law.mutual_inductance_h, T::from_f64(1e-4)),
            rotor: RotorFlux::default(),
            stator: StatorFlux::default(),
            direction: Complex::new(T::one(), o),
            current_integral: z,
            discrete: DiscreteCurrent::default(),
            speed_integral: o,
            shaped: Shaped::at(o),
            optimal_flux: o,
            asked_nm: o,
            current_limited: false,
            flux_limit: o,
            wanted_v: o,
            omega_s: o,
            magnetized: false,
            torque_nm: o,
            standing: Standing::new(machine.current_max_a),
        };
        Ok(Self { law, state, first: state })
    }

    /// The rotor resistance from now on, Ω: how an identifier takes part. Ignored unless positive and finite.
    pub fn set_rotor_resistance_ohm(&mut self, rotor_resistance_ohm: T) {
        if rotor_resistance_ohm > T::zero() && rotor_resistance_ohm.is_finite() {
            self.law.rotor_resistance_ohm = rotor_resistance_ohm;
            for s in [&mut self.state, &mut self.first] {
                s.circuit = self.law.circuit(self.law.mutual_inductance_h, s.circuit.sample_time_s);
            }
        }
    }

    /// Estimated rotor flux linkage, stator frame, Vs, referred as the machine data are.
    pub fn rotor_flux_vs(&self) -> Complex<T> {
        match self.law.gains.orientation {
            Orientation::Indirect => self.state.rotor.flux_vs,
            Orientation::Direct { .. } => self.state.stator.rotor_flux_vs() / self.state.circuit.k_r,
        }
    }

    /// Estimated torque, Nm.
    pub fn torque_nm(&self) -> T {
        self.state.torque_nm
    }
}

impl<T: Scalar> Sampled<T> for FieldOriented<T> {
    #[inline]
    fn standing(&mut self) -> &mut Standing<T> {
        &mut self.state.standing
    }

    #[inline]
    fn follow(&mut self, m: &Measured<T>) -> Complex<T> {
        let (law, s) = (&self.law, &mut self.state);
        let g = &law.gains;
        let (t, omega_e, zero) = (m.sample_time_s, law.pole_pairs * m.omega_m, T::zero());
        let mut status = DriveStatus::OK;

        // Where the flux is.
        let (mut seen, mut iron_a) = (m.i_s, zero);
        if let Some(o) = &g.optimal_flux {
            let flux_vs = norm(s.rotor.flux_vs);
            let chord_h = law.mutual_inductance_h / (T::one() + o.iron.bend(flux_vs));
            s.circuit = law.circuit(chord_h, t);
            iron_a = o.iron.conductance_s * s.omega_s * flux_vs;
            // The rotor does not see what the iron takes.
            seen -= j(s.direction) * iron_a;
        } else if t != s.circuit.sample_time_s {
            s.circuit = law.circuit(law.mutual_inductance_h, t);
        }
        let circuit = &s.circuit;
        let (current, k_r) = (&circuit.current, circuit.k_r);
        if g.current_control == CurrentControl::Discrete {
            // Between two samples the held voltage bends the current, i'' = −jω_s e/L_σ, and its mean is not that of its ends.
            let x = s.omega_s * t;
            seen -= s.rotor.flux_vs * (k_r * x * x / (T::from_f64(12.0) * current.leakage_inductance_h));
        }
        circuit.flux.step(&mut s.rotor, seen, m.omega_m);
        let psi = match g.orientation {
            Orientation::Indirect => s.rotor.flux_vs * k_r,
            Orientation::Direct { crossover_rad_s } => {
                let l = current.leakage_inductance_h;
                let pull = s.rotor.flux_vs * k_r + m.i_s * l;
                // While there is little flux, what the inverter keeps for itself would be taken for it: the current model decides alone.
                let crossover = if s.magnetized { crossover_rad_s } else { T::from_f64(10.0) / t };
                s.stator.step(m, pull, l, law.stator_resistance_ohm, crossover, current.voltage_delay_s)
            }
        };
        let size = norm(psi);
        let asked = s.standing.reference.rotor_flux_vs.max(zero);
        let optimal = match &g.optimal_flux {
            None => asked,
            Some(o) => {
                let operation = Operation {
                    torque: s.asked_nm / (law.torque_factor * k_r),
                    current_max_a: law.current_max_a,
                    limited: s.current_limited,
                    omega_s: s.omega_s,
                    stator_resistance_ohm: law.stator_resistance_ohm,
                    rotor_resistance_ohm: circuit.rotor_resistance_ohm,
                    mutual_inductance_h: law.mutual_inductance_h,
                    inverse_t_r: circuit.inverse_t_r,
                };
                if !s.magnetized {
                    // A machine without flux gets all of it: what it will be asked for is not known.
                    s.optimal_flux = asked;
                }
                o.step(&mut s.optimal_flux, asked, &operation, t)
            }
        };
        let wanted = optimal * k_r;
        let inverse_size = T::one() / size;
        s.direction = if size > wanted * T::from_f64(1e-3) {
            psi * inverse_size
        } else {
            let turned = s.direction * rotation(omega_e * t);
            turned * (T::from_f64(1.5) - norm2(turned) * T::from_f64(0.5))
        };
        let i = m.i_s * s.direction.conj();
        let lever = law.torque_factor * size;
        s.torque_nm = lever * (i.im - iron_a);

        // The flux to be had, and the current for it.
        let flux = g.field_weakening.step(&mut s.flux_limit, wanted, s.wanted_v, s.omega_s, m.dc_voltage_v, t);
        status = status.and_if(flux < wanted * T::from_f64(0.98), DriveStatus::FIELD_WEAKENING);
        let i_d = flux * circuit.inverse_mutual + (flux - size) * circuit.per_lack;
        let i_d = clamp(i_d, zero, law.magnetizing_max_a);
        let mut i_wanted = Complex::new(i_d, iron_a);
        s.omega_s = omega_e;

        // The torque to be had, and the current for it; without flux there is none.
        let [enough, too_little] = MAGNETIZED.map(|x| flux * T::from_f64(x));
        s.magnetized = flux > zero && (size >= enough || s.magnetized && size > too_little);
        if s.magnetized {
            let mut i_q_max = (law.current_max_a * law.current_max_a - i_d * i_d).sqrt();
            if iron_a != zero {
                let iron_share = if s.asked_nm >= zero { iron_a } else { -iron_a };
                i_q_max = (i_q_max - iron_share.max(zero)).max(zero);
            }
            if m.dc_voltage_v > zero {
                // Beyond, less torque needs more current: the pull-out in the frame of the flux.
                i_q_max = i_q_max.min(size * circuit.pull_out + i_d * T::from_f64(SHORT_OF_PULL_OUT));
            }
            let torque_max = lever * i_q_max;
            s.asked_nm = if g.follows_torque {
                within(s.standing.reference.torque_nm, torque_max)
            } else {
                // What the current cannot do is not asked for.
                let shaper = ReferenceShaper {
                    acceleration_max_rad_s2: g.reference.acceleration_max_rad_s2.min(torque_max * law.inverse_inertia),
                    ..g.reference
                };
                shaper.step(&mut s.shaped, s.standing.reference.omega_m, t);
                let speed = match g.speed_bandwidth_per_flux2 {
                    Some(per_flux2) => {
                        let flux_vs = size / k_r;
                        let most = per_flux2 * flux_vs * flux_vs;
                        SpeedRegulator { bandwidth_rad_s: law.speed.bandwidth_rad_s.min(most), ..law.speed }
                    }
                    None => law.speed,
                };
                speed.step(&mut s.speed_integral, &s.shaped, m.omega_m, torque_max, t)
            };
            s.current_limited = s.asked_nm.abs() >= torque_max;
            status = status.and_if(s.current_limited, DriveStatus::CURRENT_LIMITED);
            i_wanted.im += s.asked_nm / lever;
            s.omega_s += circuit.rotor_resistance_ohm * (i.im - iron_a) * inverse_size;
        } else {
            status = status.and(DriveStatus::MAGNETIZING);
            (s.shaped, s.speed_integral, s.asked_nm, s.current_limited) = (Shaped::at(m.omega_m), zero, zero, false);
        }

        // The voltage that brings the currents there.
        let frame = Turning {
            direction: s.direction,
            omega_s: s.omega_s,
            dc_voltage_v: m.dc_voltage_v,
            sample_time_s: t,
            overmodulates: g.overmodulates,
        };
        let emf = Complex::new(-size * circuit.inverse_t_r, size * omega_e);
        let out = match g.current_control {
            CurrentControl::Continuous => current.follow(&mut s.current_integral, &frame, i_wanted, i, emf),
            CurrentControl::Discrete => s.discrete.follow(current, &frame, i_wanted, i, emf),
        };
        s.wanted_v = out.wanted_v;
        s.standing.status = status.and_if(out.limited, DriveStatus::VOLTAGE_LIMITED);
        out.u_s
    }

    #[inline]
    fn sum(&self) -> T {
        let s = &self.state;
        let control = match self.law.gains.current_control {
            CurrentControl::Continuous => s.current_integral,
            CurrentControl::Discrete => s.discrete.sum(),
        };
        control.re + control.im + s.flux_limit + s.torque_nm
    }

    fn begin_anew(&mut self) {
        self.state = self.first;
    }
}

impl<T: Scalar> Controller<T> for FieldOriented<T> {
    #[inline]
    fn step(&mut self, m: &Measured<T>, reference: &Reference<T>) -> Command<T> {
        guard::step(self, m, reference)
    }
}

/// The circuit at a flux, over a sampling time.
#[derive(Clone, Copy, Debug)]
struct Circuit<T> {
    sample_time_s: T,
    current: CurrentRegulator<T>,
    flux: SampledFlux<T>,
    /// M/L_r: from the flux of references to that of the inverse-Γ form.
    k_r: T,
    /// R_R = k_r²R_r.
    rotor_resistance_ohm: T,
    inverse_t_r: T,
    /// 1/L_M, and the current that the flux loop takes for a flux that lacks, A/Vs.
    inverse_mutual: T,
    per_lack: T,
    /// Across the flux, the current short of the pull-out: 0.9 i_d, and this much for the flux.
    pull_out: T,
}

impl<T: Scalar> Law<T> {
    /// With a mutual inductance M.
    fn circuit(&self, m: T, sample_time_s: T) -> Circuit<T> {
        let l_r = m + self.rotor_leakage_h;
        let k_r = m / l_r;
        let rotor_resistance_ohm = k_r * k_r * self.rotor_resistance_ohm;
        let leakage_inductance_h = self.stator_leakage_h + k_r * self.rotor_leakage_h;
        let model = RotorFluxModel { rotor_inductance_h: l_r, mutual_inductance_h: m, pole_pairs: self.pole_pairs };
        Circuit {
            sample_time_s,
            current: CurrentRegulator {
                bandwidth_rad_s: self.gains.current_bandwidth_rad_s,
                leakage_inductance_h,
                resistance_ohm: self.stator_resistance_ohm + rotor_resistance_ohm,
                voltage_delay_s: self.voltage_delay_s,
            },
            flux: model.sampled(self.rotor_resistance_ohm, sample_time_s),
            k_r,
            rotor_resistance_ohm,
            inverse_t_r: self.rotor_resistance_ohm / l_r,
            inverse_mutual: T::one() / (k_r * m),
            per_lack: self.gains.flux_bandwidth_rad_s / rotor_resistance_ohm,
            pull_out: T::from_f64(SHORT_OF_PULL_OUT) / leakage_inductance_h,
        }
    }
}

impl<T: Scalar> BeginsAt<T> for FieldOriented<T> {
    fn begin_at(&mut self, caught: &Caught<T>) {
        let (law, s) = (&self.law, &mut self.state);
        let psi = caught.rotor_flux_vs * s.circuit.k_r;
        s.rotor = RotorFlux::of(caught);
        s.stator = StatorFlux::at(psi, s.circuit.current.leakage_inductance_h, caught.i_s, caught.u_s);
        s.shaped = Shaped::at(caught.omega_m);
        s.omega_s = law.pole_pairs * caught.omega_m;
        // Flux that is there is within what the voltage allows.
        s.flux_limit = norm(psi);
        s.wanted_v = norm(psi) * s.omega_s.abs();
    }

    #[inline]
    fn draw_flux(&mut self, rotor_flux_vs: Complex<T>, share: T) {
        self.state.rotor.draw(rotor_flux_vs, share);
    }
}

impl<T: Scalar> Reports for FieldOriented<T> {
    fn status(&self) -> DriveStatus {
        self.state.standing.status
    }
}

#[cfg(test)]
mod tests;
