//! Current regulator in a turning frame, by internal model control with active damping (Harnefors, Nee 1998).
//!
//! L_σ di/dt = u − (R_s + R_R) i − jω_s L_σ i − e,   e = −(1/T_r − jω_e) ψ_R   (inverse-Γ form)
//!
//! u = a L_σ (i* − i) − (a L_σ − R_σ) i + jω_s L_σ i + e + x,   dx/dt = a² L_σ (i* − i) + a (ū − u)
//!
//! with ū the voltage after its limit. Closed loop: i = i* a/(s + a), and disturbances are damped as fast.
//!
//! A sample that is no number, or asks for a voltage that no machine has, is refused: x stays as it was.

use im_model::{Complex, Scalar};

use crate::guard::is_voltage;
use crate::machine_data::MachineData;
use crate::overmodulation::{SIX_STEP, overmodulated};
use crate::vector::{norm, rotation, within, within_hexagon};
use im_model::space_vector::j;

/// The regulator's data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurrentRegulator<T> {
    /// a, 1/s; up to about 0.15 over the sampling time plus the delay of the voltage.
    pub bandwidth_rad_s: T,
    /// L_σ = σL_s, H.
    pub leakage_inductance_h: T,
    /// R_σ = R_s + R_R, Ω.
    pub resistance_ohm: T,
    /// Delay from the beginning of a sample to its voltage, s.
    pub voltage_delay_s: T,
}

/// The frame and the link that the regulator works on for a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turning<T> {
    /// Direction of the d axis in the stator frame now, of length 1.
    pub direction: Complex<T>,
    /// ω_s: how fast it turns, rad/s.
    pub omega_s: T,
    /// Voltage of the dc link, V; zero if there is no limit.
    pub dc_voltage_v: T,
    /// Sampling time, s.
    pub sample_time_s: T,
    /// The voltage may go beyond the circle of the link, up to six steps.
    pub overmodulates: bool,
}

/// What the regulator asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Regulated<T> {
    /// Voltage for the sample, stator frame, within the hexagon, V.
    pub u_s: Complex<T>,
    /// The same in the turning frame, V.
    pub u: Complex<T>,
    /// |u| asked for before the limit, V.
    pub wanted_v: T,
    /// The limit was met.
    pub limited: bool,
}

impl<T: Scalar> Turning<T> {
    /// A voltage of this frame, held over a sample that begins after the delay, in the stator frame: turned by half a sample and the
    /// delay. Outside the hexagon it is brought into the circle U_dc/√3, d before q: a d voltage too small would raise the flux, and
    /// that the need for voltage.
    #[inline]
    pub fn to_stator(&self, u: Complex<T>, voltage_delay_s: T) -> Regulated<T> {
        let ahead = self.omega_s * (self.sample_time_s * T::from_f64(0.5) + voltage_delay_s);
        let turn = self.direction * rotation(ahead);
        let (wanted, wanted_v) = (u * turn, norm(u));
        let within_circle = wanted_v <= self.dc_voltage_v * T::from_f64(0.577_35) || self.dc_voltage_v <= T::zero();
        if within_circle {
            return Regulated { u_s: wanted, u, wanted_v, limited: false };
        }
        let (u_s, u, limited) = self.limited(u, wanted_v, turn);
        Regulated { u_s, u, wanted_v, limited }
    }

    /// What is beyond the circle, brought into it or, where something beyond it is left to the transients, into the hexagon: in the stator frame, in this one, and
    /// whether that was less.
    #[cold]
    fn limited(&self, u: Complex<T>, wanted_v: T, turn: Complex<T>) -> (Complex<T>, Complex<T>, bool) {
        let wanted = u * turn;
        if !self.overmodulates && within_hexagon(wanted, self.dc_voltage_v) == wanted {
            return (wanted, u, false);
        }
        // A hair inside the circle, so that rounding does not leave the hexagon.
        let reach = if self.overmodulates { SIX_STEP } else { 1.0 };
        let most = self.dc_voltage_v * T::from_f64(0.577_35 * reach);
        let d = within(u.re, most);
        let q_most = (most * most - d * d).max(T::zero()).sqrt();
        let u = Complex::new(d, within(u.im, q_most));
        if self.overmodulates {
            return (overmodulated(u * turn, self.dc_voltage_v), u, wanted_v > most);
        }
        (u * turn, u, true)
    }

    /// A vector of the stator frame seen from this one.
    #[inline]
    pub fn of_stator(&self, x: Complex<T>) -> Complex<T> {
        x * self.direction.conj()
    }
}

impl<T: Scalar> CurrentRegulator<T> {
    /// As fast as a lag of sample and voltage allows, at most 2000 1/s.
    pub fn bandwidth_for(lag_s: T) -> T {
        (T::from_f64(0.15) / lag_s).min(T::from_f64(2000.0))
    }

    /// For a machine sampled every `sample_time_s`.
    pub fn of(machine: &MachineData<T>, sample_time_s: T) -> Self {
        let w = &machine.windings;
        let k_r = w.mutual_inductance_h / w.rotor_inductance_h;
        Self {
            bandwidth_rad_s: Self::bandwidth_for(sample_time_s + machine.voltage_delay_s),
            leakage_inductance_h: w.stator_inductance_h - k_r * w.mutual_inductance_h,
            resistance_ohm: w.stator_resistance_ohm + k_r * k_r * w.rotor_resistance_ohm,
            voltage_delay_s: machine.voltage_delay_s,
        }
    }

    /// One sample. `i` and `wanted` in the turning frame, A; `emf` is e, V; `integral` is x, V. `None` where the sample is refused: hold the last voltage.
    pub fn step(
        &self,
        integral: &mut Complex<T>,
        frame: &Turning<T>,
        wanted: Complex<T>,
        i: Complex<T>,
        emf: Complex<T>,
    ) -> Option<Regulated<T>> {
        let mut x = *integral;
        let out = self.follow(&mut x, frame, wanted, i, emf);
        let is_one = frame.dc_voltage_v.is_finite() && is_voltage(out.u) && is_voltage(out.u_s) && is_voltage(x);
        is_one.then(|| {
            *integral = x;
            out
        })
    }

    /// [`step`](Self::step) for a sample that is one: the controllers look at it before.
    #[inline]
    pub(crate) fn follow(
        &self,
        integral: &mut Complex<T>,
        frame: &Turning<T>,
        wanted: Complex<T>,
        i: Complex<T>,
        emf: Complex<T>,
    ) -> Regulated<T> {
        let (a, l) = (self.bandwidth_rad_s, self.leakage_inductance_h);
        let e = wanted - i;
        let (al, at) = (a * l, a * frame.sample_time_s);
        let u = e * al - i * (al - self.resistance_ohm) + j(i) * (frame.omega_s * l) + emf + *integral;
        let out = frame.to_stator(u, self.voltage_delay_s);
        *integral += e * (al * at);
        if out.limited {
            *integral += (out.u - u) * at;
        }
        out
    }
}
