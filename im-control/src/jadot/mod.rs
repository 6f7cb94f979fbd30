//! Passivity-based adaptive regulation of Jadot, Malrait, Moreno-Valenzuela, Sepulchre (2009).
//!
//! In inverse-Γ form, φ = (L_m/L_r)ψ_r, in a frame that the controller turns itself at ω_s = ω_r + ω_g:
//!
//! ```text
//! R i_q,cons = ω_g φ_cons,   ω_g = −k_p(Δω + ξ),   ξ' = k_i Δω,   R i_cons = (T⁻¹ + jω_g)φ_cons           (12), (14), (15)
//! L_f i_ref' = (R_s + R)(i_cons − i_ref)                                                                 (20)
//! φ_ref' = −(T⁻¹ + jω_g)φ_ref + R i_ref − v_r                                                           (17)
//! u_s = (R_s + R + jL_fω_s)i_ref − (T⁻¹ − jω_r)φ_ref + v_s + L_f i_ref'                                  (19)
//! v_s = −K_P(Δi + η),   η' = K_I Δi,   v_r = −(R + λ(T⁻¹ + jω_r))Δi,   Δi = i_s − i_ref                   (22), (25)
//! ```
//!
//! The parameters come from an [`Adaptation`] of `im-identify`: [`Fixed`](im_identify::online::Fixed), or one of the paper's three.
//!
//! **Limits, which the paper leaves open.** *Voltage*: (18) says what a voltage does to the reference. If the inverter gave u instead of the
//! u_s of (19), then L_f i_ref' = (R_s + R)(i_cons − i_ref) + (u − u_s): the reference becomes what the voltage can deliver. The error
//! equations (21), (27), (28) do not change at all, so that passivity, the integral action and the adaptations know nothing of the limit:
//! nothing winds up. *Current*: i_cons is kept within the limit, flux first; ω_g follows from the limited current. *Speed*: ξ stands still
//! while a limit keeps the torque below what the speed error asks for. Flux that the voltage does not allow at a speed is weakened.
//! Until half the flux is there, there is no torque.
//!
//! **In sampled time** (20) and (17) are implicit, so that they are stable at any period and exact in the steady state; (19) takes
//! i_ref, φ_ref at the middle of the sample and the rate that i_ref will really have; the command is turned ahead to the middle of the sample
//! in which it acts. Of the loops only K_P h < L_f limits the period.

mod gains;
#[cfg(test)]
mod tests;

use im_identify::online::{Adaptation, Estimate, RegulationParameters, Tracking};
use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::space_vector::{j, norm2};
use im_model::{Complex, Scalar};

use crate::error::ControlError;
use crate::flying_start::{BeginsAt, Caught};
use crate::guard;
use crate::machine_data::MachineData;
use crate::status::{DriveStatus, Reports};
use crate::vector::{clamp, is_finite, norm, rotation, within_hexagon};

pub use gains::JadotGains;

/// Share of the flux wanted from which on there is torque.
const MAGNETIZED: f64 = 0.5;
/// Share of the largest current that flux may take.
const FLUX_CURRENT_SHARE: f64 = 0.9;

/// A drive by passivity-based control: follows speed and rotor flux, with an adaptation.
#[derive(Clone, Copy, Debug)]
pub struct Jadot<T: Scalar, A: Adaptation<T>> {
    gains: JadotGains<T>,
    adaptation: A,
    n_p: T,
    /// L_m/L_r: from the flux of references to φ.
    k_r: T,
    current_max_a: T,
    voltage_delay_s: T,
    state: State<T, A::State>,
}

#[derive(Clone, Copy, Debug)]
struct State<T, S> {
    /// e^{jθ_s} at the beginning of the sample.
    direction: Complex<T>,
    omega_s: T,
    omega_g: T,
    omega_m: T,
    phi_ref: Complex<T>,
    i_ref: Complex<T>,
    i_ref_rate: Complex<T>,
    eta: Complex<T>,
    xi: T,
    /// The last command before the limit, in the frame and at the stator; none before the first.
    asked: Option<[Complex<T>; 2]>,
    limited_v: Complex<T>,
    flux_limit: T,
    i_cons: Complex<T>,
    phi_cons: T,
    adaptation: S,
    estimate: Option<Estimate<T, 4>>,
    status: DriveStatus,
}

impl<T: Scalar, S> State<T, S> {
    /// The last command was more than the inverter can give.
    fn voltage_binds(&self) -> bool {
        self.asked.is_some_and(|[_, at_stator]| norm2(self.limited_v) < norm2(at_stator) * T::from_f64(0.9999))
    }
}

impl<T: Scalar, A: Adaptation<T>> Jadot<T, A> {
    /// For a machine, with gains and an adaptation made for the same sampling time. Of the machine only pole pairs, L_m/L_r, the largest
    /// current and the delay are used: the parameters are the adaptation's.
    ///
    /// # Errors
    /// Machine data or gains out of bounds.
    pub fn try_new(machine: &MachineData<T>, gains: &JadotGains<T>, adaptation: A) -> Result<Self, ControlError> {
        machine.validate()?;
        gains.validate()?;
        Ok(Self {
            gains: *gains,
            n_p: machine.n_p(),
            k_r: machine.windings.mutual_inductance_h / machine.windings.rotor_inductance_h,
            current_max_a: machine.current_max_a,
            voltage_delay_s: machine.voltage_delay_s,
            state: Self::first(&adaptation),
            adaptation,
        })
    }

    /// The state before the first sample.
    fn first(adaptation: &A) -> State<T, A::State> {
        let (o, z) = (T::zero(), Complex::new(T::zero(), T::zero()));
        State {
            direction: Complex::new(T::one(), o),
            omega_s: o,
            omega_g: o,
            omega_m: o,
            phi_ref: z,
            i_ref: z,
            i_ref_rate: z,
            eta: z,
            xi: o,
            asked: None,
            limited_v: z,
            flux_limit: o,
            i_cons: z,
            phi_cons: o,
            adaptation: adaptation.start(),
            estimate: None,
            status: DriveStatus::OK,
        }
    }

    /// The parameters in use.
    pub fn parameters(&self) -> RegulationParameters<T> {
        self.adaptation.parameters(&self.state.adaptation)
    }

    /// What the adaptation said last.
    pub fn estimate(&self) -> Option<Estimate<T, 4>> {
        self.state.estimate
    }

    /// The load torque as the controller estimates it, (11): (3/2) n_p φ_cons i_q,cons, Nm.
    pub fn load_torque_nm(&self) -> T {
        T::from_f64(1.5) * self.n_p * self.state.phi_cons * self.state.i_cons.im
    }

    /// |i_cons|: the current consumption asked for, peak, A.
    pub fn current_a(&self) -> T {
        norm(self.state.i_cons)
    }

    /// φ_ref and i_ref in the frame, Vs and A.
    pub fn references(&self) -> (Complex<T>, Complex<T>) {
        (self.state.phi_ref, self.state.i_ref)
    }

    /// The frame: e^{jθ_s} at the beginning of the next sample.
    pub fn direction(&self) -> Complex<T> {
        self.state.direction
    }

    /// ω_s and ω_g, rad/s.
    pub fn frequencies(&self) -> (T, T) {
        (self.state.omega_s, self.state.omega_g)
    }

    /// i_ref after what the inverter did not give in the last sample.
    fn i_ref_after(&self, m: &Measured<T>) -> Complex<T> {
        let (x, p, h) = (&self.state, self.parameters(), m.sample_time_s);
        let Some([_, asked]) = x.asked else { return x.i_ref };
        let given = if is_finite(m.u_s) { m.u_s } else { x.limited_v };
        let half = T::from_f64(0.5) * h;
        let in_frame = (given - asked) * x.direction.conj() * rotation(x.omega_s * (half - self.voltage_delay_s));
        let l_f = p.leakage_inductance_h;
        x.i_ref + in_frame * (h / (l_f + half * (p.stator_resistance_ohm + p.rotor_resistance_ohm)))
    }

    /// φ_cons and i_cons within the limits; sets ω_g. Returns whether the current limit binds.
    fn set_points(&mut self, p: &RegulationParameters<T>, m: &Measured<T>, reference: &Reference<T>, delta_omega: T) -> bool {
        let (x, g) = (&mut self.state, &self.gains);
        let (l, r) = (p.magnetizing_inductance_h, p.rotor_resistance_ohm);
        let most = l * self.current_max_a * T::from_f64(FLUX_CURRENT_SHARE);
        let wanted = clamp(reference.rotor_flux_vs * self.k_r, most * T::from_f64(1e-3), most);
        x.phi_cons = match &g.field_weakening {
            Some(weakening) => {
                if x.asked.is_none() {
                    x.flux_limit = wanted;
                }
                let voltage = x.asked.map_or(T::zero(), |[u, _]| norm(u));
                weakening.step(&mut x.flux_limit, wanted, voltage, x.omega_s, m.dc_voltage_v, m.sample_time_s)
            }
            None => wanted,
        };
        x.status = x.status.and_if(x.phi_cons < wanted * T::from_f64(0.999), DriveStatus::FIELD_WEAKENING);
        let i_d = x.phi_cons / l;
        let magnetized = norm2(x.phi_ref) >= x.phi_cons * x.phi_cons * T::from_f64(MAGNETIZED * MAGNETIZED);
        let i_q_max =
            if magnetized { (self.current_max_a * self.current_max_a - i_d * i_d).max(T::zero()).sqrt() } else { T::zero() };
        let slip_max = r * i_q_max / x.phi_cons;
        let slip = -g.speed_proportional * (delta_omega + x.xi);
        x.omega_g = clamp(slip, -slip_max, slip_max);
        x.status = x.status.and_if(!magnetized, DriveStatus::MAGNETIZING);
        x.i_cons = Complex::new(i_d, x.omega_g * x.phi_cons / r);
        let binds = slip.abs() > slip_max;
        x.status = x.status.and_if(binds && magnetized, DriveStatus::CURRENT_LIMITED);
        binds
    }
}

impl<T: Scalar, A: Adaptation<T>> Controller<T> for Jadot<T, A> {
    /// A current or speed that is lost is bridged: the last speed, and the current as it should be. A sample without a time, or with a dc
    /// voltage that is none, leaves the last command standing; should the state leave the finite range all the same, it begins anew.
    fn step(&mut self, m: &Measured<T>, reference: &Reference<T>) -> Command<T> {
        let m = guard::plausible(m, self.current_max_a);
        let dc_lost = !m.dc_voltage_v.is_finite();
        if dc_lost || !guard::is_sample_time(m.sample_time_s) {
            let why = if dc_lost { DriveStatus::DC_VOLTAGE_LOST } else { DriveStatus::CURRENT_LOST };
            self.state.status = DriveStatus::OK.and(why);
            return Command::Voltage(self.state.limited_v);
        }
        let u = self.follow(&m, reference);
        let x = &self.state;
        if is_finite(u) && is_finite(x.direction) && x.xi.is_finite() && x.flux_limit.is_finite() && is_finite(x.i_cons) {
            return Command::Voltage(u);
        }
        self.state = Self::first(&self.adaptation);
        self.state.status = DriveStatus::OK.and(DriveStatus::RESTARTED);
        Command::Voltage(self.state.limited_v)
    }
}

impl<T: Scalar, A: Adaptation<T>> Jadot<T, A> {
    /// The law for a sample with a time and a dc voltage.
    fn follow(&mut self, m: &Measured<T>, reference: &Reference<T>) -> Complex<T> {
        let (h, one, half) = (m.sample_time_s, T::one(), T::from_f64(0.5));
        let zero = Complex::new(T::zero(), T::zero());
        self.state.status = DriveStatus::OK
            .and_if(!is_finite(m.i_s), DriveStatus::CURRENT_LOST)
            .and_if(!m.omega_m.is_finite(), DriveStatus::SPEED_LOST)
            .and_if(!(reference.omega_m.is_finite() && reference.rotor_flux_vs.is_finite()), DriveStatus::REFERENCE_LOST);
        let lost = !(is_finite(m.i_s) && m.omega_m.is_finite());
        let x = &mut self.state;
        if m.omega_m.is_finite() {
            x.omega_m = m.omega_m;
        }
        // What the inverter could not give, the reference does not ask for: (18).
        self.state.i_ref = self.i_ref_after(m);
        let x = &mut self.state;
        let delta_i = if lost { zero } else { m.i_s * x.direction.conj() - x.i_ref };
        let leak = (self.adaptation.integral_leak_per_s(&x.adaptation) * h).min(one);
        x.eta += delta_i * (self.gains.current_integral_per_s * h) - x.eta * leak;
        let omega_r = x.omega_m * self.n_p;
        let tracking = Tracking {
            delta_i,
            held_v: x.eta * self.gains.current_proportional_ohm,
            i_ref: x.i_ref,
            i_ref_rate: x.i_ref_rate,
            phi_ref: x.phi_ref,
            omega_r,
            omega_g: x.omega_g,
            lost,
        };
        x.estimate = Some(self.adaptation.step(&mut x.adaptation, &tracking));

        let p = self.parameters();
        let (r, l_f, a) = (p.rotor_resistance_ohm, p.leakage_inductance_h, p.inverse_rotor_time_constant());
        let total = p.stator_resistance_ohm + r;
        if !self.state.status.has(DriveStatus::REFERENCE_LOST) {
            let delta_omega = omega_r - reference.omega_m * self.n_p;
            let voltage_binds = self.state.voltage_binds();
            let binds = self.set_points(&p, m, reference, delta_omega) || voltage_binds;
            let x = &mut self.state;
            if !(binds && delta_omega * (delta_omega + x.xi) > T::zero()) {
                x.xi += self.gains.speed_integral_per_s * delta_omega * h;
            }
        }

        let x = &mut self.state;
        x.omega_s = omega_r + x.omega_g;
        // (20) and (17), implicit; (19) with what they will do.
        let i_before = x.i_ref;
        let share = h * total / l_f;
        x.i_ref = (i_before + x.i_cons * share) / (one + share);
        x.i_ref_rate = (x.i_ref - i_before) / h;
        let i_middle = (x.i_ref + i_before) * half;
        let v_r = self.gains.lambda.flux_correction(r, a, omega_r, delta_i) - self.adaptation.flux_injection(&x.adaptation);
        let slow = Complex::new(one + h * a, h * x.omega_g);
        let phi_before = x.phi_ref;
        x.phi_ref = (phi_before + (i_middle * r - v_r) * h) * slow.conj() / norm2(slow);
        let phi_middle = (x.phi_ref + phi_before) * half;
        let v_s = -(delta_i + x.eta) * self.gains.current_proportional_ohm;
        let u = i_middle * total + j(i_middle) * (l_f * x.omega_s) - phi_middle * Complex::new(a, -omega_r)
            + v_s
            + x.i_ref_rate * l_f;

        let ahead = rotation(x.omega_s * (h * half + self.voltage_delay_s));
        let at_stator = u * x.direction * ahead;
        x.limited_v = within_hexagon(at_stator, m.dc_voltage_v);
        x.asked = Some([u, at_stator]);
        x.status = x.status.and_if(x.voltage_binds(), DriveStatus::VOLTAGE_LIMITED);
        let turned = x.direction * rotation(x.omega_s * h);
        // Rounding neither lengthens nor shortens it.
        x.direction = turned * (T::from_f64(1.5) - norm2(turned) * half);
        x.limited_v
    }
}

impl<T: Scalar, A: Adaptation<T>> BeginsAt<T> for Jadot<T, A> {
    fn begin_at(&mut self, caught: &Caught<T>) {
        let x = &mut self.state;
        let size = norm(caught.rotor_flux_vs);
        (x.omega_m, x.omega_s) = (caught.omega_m, caught.omega_m * self.n_p);
        if size > T::zero() {
            // The frame at the next sample, with the flux along its first axis.
            x.direction = caught.rotor_flux_vs * (T::one() / size) * rotation(x.omega_s * caught.sample_time_s);
        }
        x.phi_ref = Complex::new(size * self.k_r, T::zero());
        x.i_ref = caught.i_s * rotation(x.omega_s * caught.sample_time_s) * x.direction.conj();
    }
}

impl<T: Scalar, A: Adaptation<T>> Reports for Jadot<T, A> {
    fn status(&self) -> DriveStatus {
        self.state.status
    }
}
