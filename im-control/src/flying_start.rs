//! Flying start: onto a machine that turns and may carry flux of unknown size and direction.
//!
//! Without stator current the rotor flux is frozen to the rotor. Seen from there it only decays, ψ_R = ψ_0 e^{−t/T_r}, and the emf
//!
//! e = (jω_e − 1/T_r) ψ_R   (inverse-Γ form)
//!
//! stands still. So the current is first held at zero in the frame of the rotor: no torque, whatever the flux is. What the regulator then
//! needs is e, and the flux follows from it; the controller behind begins with that flux. No inductance enters, and at zero current neither
//! resistance nor dead time take voltage.
//!
//! The regulator is not left to find e by itself. Over the first sample the voltage stays as it was (zero, on a machine that was left alone) and
//! the current rises by −eT/L_σ, which tells e; the peak is about ω_e ψ (T + delay)/L_σ: at 50 Hz, 100 µs and a leakage of 0.2 per unit,
//! 0.16 of rated current for each sample, with a torque jolt of as much.
//!
//! Where the emf is more than the link can hold, the voltage keeps its direction, and the controller does not begin before the flux has decayed.
//!
//! In front of an inverter that tracks currents ([`FlyingStart::tracking_currents`]) the current asked for is zero, and e is the mean of the voltage
//! that the inverter gives, less what changes the current.
//!
//! The error of the flux is that of the voltage over |jω_e − 1/T_r|: largest at standstill, ΔV·T_r.

use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::space_vector::{j, norm2};
use im_model::{Complex, Scalar};

use crate::current_regulator::{CurrentRegulator, Turning};
use crate::error::ControlError;
use crate::guard;
use crate::machine_data::MachineData;
use crate::status::{DriveStatus, Reports};
use crate::vector::{is_finite, norm, rotation};

/// How long the current is held at zero, in time constants of its regulator: (1 + x)e^{−x} = 0.3 % of what the first guess of e lacked is left.
const SETTLED: f64 = 8.0;

/// A machine, found turning: at the sample before the controller begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Caught<T> {
    /// Rotor flux linkage, stator frame, Vs, referred as the machine data are.
    pub rotor_flux_vs: Complex<T>,
    /// Stator current, A.
    pub i_s: Complex<T>,
    /// Average voltage commanded over the sample before, V.
    pub u_s: Complex<T>,
    /// Mechanical speed, rad/s.
    pub omega_m: T,
    /// Sampling time, s.
    pub sample_time_s: T,
}

/// A controller that can begin on a machine with flux, in its first state.
pub trait BeginsAt<T> {
    /// Takes the state over; the next step is a sample later.
    fn begin_at(&mut self, caught: &Caught<T>);

    /// Draws the rotor flux that the last step believed in towards another estimate of it, stator frame, Vs, by this share of the difference. Controllers whose flux is no
    /// state of a current model do nothing.
    fn draw_flux(&mut self, rotor_flux_vs: Complex<T>, share: T) {
        let _ = (rotor_flux_vs, share);
    }
}

/// Finds the flux before its controller begins.
#[derive(Clone, Copy, Debug)]
pub struct FlyingStart<T, C> {
    regulator: CurrentRegulator<T>,
    pole_pairs: T,
    /// M/L_r.
    k_r: T,
    inverse_rotor_time_constant: T,
    /// The inverter tracks currents.
    currents: bool,
    current_max_a: T,
    controller: C,
    state: State<T>,
}

#[derive(Clone, Copy, Debug)]
struct State<T> {
    /// e^{jθ_e} of the rotor, from the first sample on.
    rotor: Complex<T>,
    /// e, as far as known, in the rotor's frame, V.
    emf: Complex<T>,
    /// The current one sample before, or where currents are tracked that of the first sample, in the rotor's frame, A.
    i_before: Complex<T>,
    samples: u32,
    elapsed_s: T,
    caught: bool,
    /// The last command.
    command: Complex<T>,
}

impl<T: Scalar, C> FlyingStart<T, C> {
    /// Before a controller in its first state, for a machine sampled every `sample_time_s`.
    ///
    /// # Errors
    /// Machine data or sampling time out of bounds.
    pub fn try_new(controller: C, machine: &MachineData<T>, sample_time_s: T) -> Result<Self, ControlError> {
        machine.validate()?;
        guard::check_sample_time("sample_time_s", sample_time_s)?;
        let w = &machine.windings;
        Ok(Self {
            regulator: CurrentRegulator::of(machine, sample_time_s),
            pole_pairs: machine.n_p(),
            k_r: w.mutual_inductance_h / w.rotor_inductance_h,
            inverse_rotor_time_constant: w.rotor_resistance_ohm / w.rotor_inductance_h,
            currents: false,
            controller,
            current_max_a: machine.current_max_a,
            state: State::first(),
        })
    }

    /// The same before a controller whose commands are currents, with an inverter that tracks them.
    #[must_use]
    pub fn tracking_currents(self) -> Self {
        Self { currents: true, ..self }
    }

    /// The controller behind.
    pub fn controller(&self) -> &C {
        &self.controller
    }

    /// The controller behind, to set something in it.
    pub fn controller_mut(&mut self) -> &mut C {
        &mut self.controller
    }

    /// Whether the controller has begun.
    pub fn has_caught(&self) -> bool {
        self.state.caught
    }
}

impl<T: Scalar, C: BeginsAt<T>> FlyingStart<T, C> {
    /// A sample with the current at zero; one that cannot be computed with leaves the last command standing.
    fn catch(&mut self, m: &Measured<T>) -> Command<T> {
        let m = &guard::plausible(m, self.current_max_a);
        let z = Complex::new(T::zero(), T::zero());
        if !guard::is_usable(&Measured { u_s: z, ..*m }, self.current_max_a) {
            let u = self.state.command;
            return if self.currents { Command::Current(u) } else { Command::Voltage(u) };
        }
        let (g, s, t) = (&self.regulator, &mut self.state, m.sample_time_s);
        let omega_e = self.pole_pairs * m.omega_m;
        let frame = Turning {
            direction: s.rotor,
            omega_s: omega_e,
            dc_voltage_v: m.dc_voltage_v,
            sample_time_s: t,
            overmodulates: false,
        };
        s.samples += 1;
        s.elapsed_s += t;
        let in_time = |s: &State<T>| s.elapsed_s * g.bandwidth_rad_s >= T::from_f64(SETTLED);
        let command = if self.currents { s.track(g, &frame, m, in_time(s)) } else { s.regulate(g, &frame, m) };
        if in_time(s) {
            // ψ_R = e/(jω_e − 1/T_r).
            let rate = Complex::new(-self.inverse_rotor_time_constant, omega_e);
            let rotor_flux_vs = s.emf * rate.conj() * s.rotor * (T::one() / (norm2(rate) * self.k_r));
            s.caught = true;
            self.controller.begin_at(&Caught { rotor_flux_vs, i_s: m.i_s, u_s: m.u_s, omega_m: m.omega_m, sample_time_s: t });
        }
        let turned = s.rotor * rotation(omega_e * t);
        s.rotor = turned * (T::from_f64(1.5) - norm2(turned) * T::from_f64(0.5));
        let (Command::Voltage(u) | Command::Current(u)) = command;
        if !(is_finite(u) && is_finite(s.emf) && is_finite(s.rotor)) {
            *s = State { caught: s.caught, ..State::first() };
            return if self.currents { Command::Current(z) } else { Command::Voltage(z) };
        }
        s.command = u;
        command
    }
}

impl<T: Scalar> State<T> {
    fn first() -> Self {
        let z = Complex::new(T::zero(), T::zero());
        let rotor = Complex::new(T::one(), T::zero());
        Self { rotor, emf: z, i_before: z, samples: 0, elapsed_s: T::zero(), caught: false, command: z }
    }

    /// The voltage that holds the current at zero; its integral is e.
    fn regulate(&mut self, g: &CurrentRegulator<T>, frame: &Turning<T>, m: &Measured<T>) -> Command<T> {
        let (t, i, half) = (frame.sample_time_s, frame.of_stator(m.i_s), T::from_f64(0.5));
        let none = Complex::new(T::zero(), T::zero());
        let out = if self.samples == 1 {
            // Whatever was commanded, turned on: zero on a machine that was left alone.
            let u = if is_finite(m.u_s) { m.u_s } else { none };
            self.emf = frame.of_stator(u) * rotation(frame.omega_s * (t * half - g.voltage_delay_s));
            frame.to_stator(self.emf, g.voltage_delay_s)
        } else {
            if self.samples == 2 {
                // L_σ di/dt = u − R_σ i − jω_e L_σ i − e over the first sample.
                let (l, mean) = (g.leakage_inductance_h, (i + self.i_before) * half);
                self.emf = self.emf - mean * g.resistance_ohm - j(mean) * (frame.omega_s * l) - (i - self.i_before) * (l / t);
            }
            // In the frame of e, so that a limited voltage keeps its direction.
            let size = norm(self.emf);
            let along = if size > T::zero() { self.emf * (T::one() / size) } else { Complex::new(T::one(), T::zero()) };
            let frame = Turning { direction: frame.direction * along, ..*frame };
            let mut emf = self.emf * along.conj();
            let out = g.follow(&mut emf, &frame, none, i * along.conj(), none);
            self.emf = emf * along;
            out
        };
        if out.limited {
            // More emf than the link can hold: the current is what it is, until the flux has decayed.
            self.elapsed_s = T::zero();
        }
        self.i_before = i;
        Command::Voltage(out.u_s)
    }

    /// No current asked for; e is the mean of what is given, less what changes the current from the first sample to the last.
    fn track(&mut self, g: &CurrentRegulator<T>, frame: &Turning<T>, m: &Measured<T>, last: bool) -> Command<T> {
        let (t, i) = (frame.sample_time_s, frame.of_stator(m.i_s));
        if self.samples == 1 {
            self.i_before = i;
        } else {
            let n = T::from_f64(f64::from(self.samples - 1));
            // The mean over a sample stands at its middle.
            let u =
                if is_finite(m.u_s) { frame.of_stator(m.u_s) * rotation(frame.omega_s * t * T::from_f64(0.5)) } else { self.emf };
            self.emf += (u - self.emf) * (T::one() / n);
            if last {
                self.emf -= (i - self.i_before) * (g.leakage_inductance_h / (n * t));
            }
        }
        Command::Current(Complex::new(T::zero(), T::zero()))
    }
}

impl<T: Scalar, C: Controller<T> + BeginsAt<T>> Controller<T> for FlyingStart<T, C> {
    #[inline]
    fn step(&mut self, m: &Measured<T>, reference: &Reference<T>) -> Command<T> {
        if self.state.caught { self.controller.step(m, reference) } else { self.catch(m) }
    }
}

impl<T: Scalar, C: Reports> Reports for FlyingStart<T, C> {
    fn status(&self) -> DriveStatus {
        if self.state.caught { self.controller.status() } else { DriveStatus::CATCHING.and(DriveStatus::MAGNETIZING) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::{Bench, Effects, Machine, PlantInput, State as MachineState, machines, space_vector::unit};

    /// Keeps what was caught.
    #[derive(Clone, Copy)]
    struct Keeps<T>(Option<Caught<T>>);
    impl<T: Scalar> BeginsAt<T> for Keeps<T> {
        fn begin_at(&mut self, caught: &Caught<T>) {
            self.0 = Some(*caught);
        }
    }
    impl<T: Scalar> Controller<T> for Keeps<T> {
        fn step(&mut self, _: &Measured<T>, _: &Reference<T>) -> Command<T> {
            Command::Voltage(Complex::new(T::zero(), T::zero()))
        }
    }
    impl<T> Reports for Keeps<T> {}

    /// The relative error of the flux found, the largest current, and how long it took; sampled every 100 µs.
    fn found<T: Scalar>(speed: f64, flux: Complex<f64>, delay_s: f64) -> (f64, f64, f64) {
        let m = machines::JADOT_TABLE_I;
        let mut e = Effects::none();
        e.voltage_delay.delay_s = delay_s;
        let machine = Machine::try_new(m.parameters(), m.pole_pairs, e).unwrap();
        let data = MachineData::of(&machine, 25.0).delayed(delay_s).cast::<T>();
        let k = 0.156 / 0.16;
        let state = MachineState { psi_r: flux, psi_s: flux * k, ..MachineState::turning(speed) };
        let mut bench = Bench::new(&machine, state, 1e-4);
        let mut start = FlyingStart::try_new(Keeps(None), &data, T::from_f64(1e-4)).unwrap();
        let narrow = |z: Complex<f64>| Complex::new(T::from_f64(z.re), T::from_f64(z.im));
        let reference = Reference { omega_m: T::zero(), rotor_flux_vs: T::zero(), torque_nm: T::zero() };
        let (mut u_s, mut peak) = (Complex::new(0.0, 0.0), 0.0f64);
        for step in 1..1000 {
            let shown = bench.output();
            peak = peak.max(shown.i_s.norm());
            let m = Measured {
                i_s: narrow(shown.i_s),
                omega_m: T::from_f64(shown.omega_m),
                u_s: narrow(u_s),
                dc_voltage_v: T::from_f64(560.0),
                sample_time_s: T::from_f64(1e-4),
            };
            let Command::Voltage(u) = start.step(&m, &reference) else { unreachable!("voltages") };
            if let Some(caught) = start.controller().0 {
                assert!(start.has_caught());
                let psi = Complex::new(caught.rotor_flux_vs.re.value(), caught.rotor_flux_vs.im.value());
                let truth = bench.state().psi_r;
                return ((psi - truth).norm() / truth.norm(), peak, 1e-4 * f64::from(step));
            }
            u_s = Complex::new(u.re.value(), u.im.value());
            bench.advance(&PlantInput { imposed_speed: Some([speed; 2]), ..PlantInput::new(u_s, 0.0) });
        }
        panic!("it never ends");
    }

    #[test]
    fn the_flux_found_is_the_one_that_is_there() {
        for (speed, flux, phase) in [(150.0, 0.9, 0.4), (-80.0, 0.5, 2.5), (10.0, 0.9, -1.0), (0.0, 0.9, 1.7)] {
            for delay_s in [0.0, 1e-4] {
                let (error, peak, took) = found::<f64>(speed, unit(phase) * flux, delay_s);
                // The emf decays with T_r = 0.18 s, and the integral follows it 2/a late: 2/(aT_r) = 1.5 % with the delay.
                assert!(error < 0.02, "{speed} {flux} {delay_s}: {error}");
                assert!((took - 8.0 * (1e-4 + delay_s) / 0.15).abs() < 2e-4, "{took}");
                // e(T + delay)/L_σ and some of the tail of the regulator.
                let rise = 2.0 * speed.abs() * flux * 0.975 * (1e-4 + delay_s) / 0.0079;
                assert!(peak < 1.3 * rise + 0.2, "{peak} {rise}");
            }
        }
    }

    #[test]
    fn single_precision_finds_the_same() {
        let (wide, ..) = found::<f64>(100.0, unit(1.0) * 0.8, 1e-4);
        let (narrow, ..) = found::<f32>(100.0, unit(1.0) * 0.8, 1e-4);
        assert!((wide - narrow).abs() < 1e-3, "{wide} {narrow}");
    }

    const SPEED: f64 = 120.0;

    fn start(delay_s: f64) -> FlyingStart<f64, Keeps<f64>> {
        let m = machines::JADOT_TABLE_I;
        let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
        FlyingStart::try_new(Keeps(None), &MachineData::of(&machine, 25.0).delayed(delay_s), 1e-4).unwrap()
    }

    fn measured(i_s: Complex<f64>, u_s: Complex<f64>, dc_voltage_v: f64) -> Measured<f64> {
        Measured { i_s, omega_m: SPEED, u_s, dc_voltage_v, sample_time_s: 1e-4 }
    }

    const NOTHING: Reference<f64> = Reference { omega_m: 0.0, rotor_flux_vs: 0.0, torque_nm: 0.0 };

    /// L_σ di/dt = u − R_σ i − jω_e L_σ i − e over the first sample tells e, whatever current and voltage there were.
    #[test]
    fn the_first_sample_tells_the_emf() {
        let (e, w_e, t) = (Complex::new(30.0, 200.0), 2.0 * SPEED, 1e-4);
        for (i, u) in [(0.0, 0.0), (20.0, 0.0), (0.0, 150.0), (-15.0, 250.0)] {
            let mut s = start(0.0);
            // Much resistance, so that its part is seen.
            s.regulator.resistance_ohm = 30.0;
            let (l, r) = (s.regulator.leakage_inductance_h, s.regulator.resistance_ohm);
            let (i_0, u) = (unit(0.6) * i, unit(-0.4) * u);
            s.step(&measured(i_0, u, 0.0), &NOTHING);
            // The voltage went on as it was, turning with the rotor: in its frame it stands where it was in the middle of the sample before.
            let held = u * unit(w_e * t * 0.5);
            let mut seen = i_0;
            for _ in 0..1000 {
                seen += (held - e - seen * Complex::new(r, w_e * l)) * (t / 1000.0 / l);
            }
            let mut guess = s;
            guess.regulator.bandwidth_rad_s = 0.0;
            guess.step(&measured(seen * unit(w_e * t), held * unit(w_e * t), 0.0), &NOTHING);
            // The trapezoidal mean of an exponential: (R T/L)²/12 of what the current changes by.
            let part = (held - e - i_0 * Complex::new(r, w_e * l)).norm() * (r * t / l).powi(2) / 12.0;
            assert!((guess.state.emf - e).norm() < 2.0 * part + 0.2, "{i} {u}: {} {part}", guess.state.emf);
        }
    }

    /// An inverter that tracks currents gives e on average, and L_σ times the change of the current beside it.
    #[test]
    fn behind_an_inverter_that_tracks_currents_the_mean_voltage_is_the_emf() {
        let (psi, w_e, t) = (unit(0.8) * 0.7, 2.0 * SPEED, 1e-4);
        let mut s = start(0.0).tracking_currents();
        let (l, k_r, a) = (s.regulator.leakage_inductance_h, s.k_r, s.inverse_rotor_time_constant);
        let e = Complex::new(-a, w_e) * psi * k_r;
        let mut before = Complex::new(0.0, 0.0);
        for k in 0..1000 {
            // The current wanders by 3 A while it is watched; the voltage alternates about its mean.
            let i = Complex::new(3.0, -2.0) * (f64::from(k) / 60.0);
            let ripple = if k % 2 == 0 { 40.0 } else { -40.0 };
            let u = if k == 0 { before } else { e + (i - before) * (l / t) + ripple };
            before = i;
            let lost = k == 7;
            let u_s = if lost { Complex::new(f64::NAN, 0.0) } else { u * unit(w_e * t * (f64::from(k) - 0.5)) };
            let Command::Current(command) = s.step(&measured(i * unit(w_e * t * f64::from(k)), u_s, 560.0), &NOTHING) else {
                panic!()
            };
            assert_eq!(command, Complex::new(0.0, 0.0));
            if let Some(caught) = s.controller().0 {
                let found = caught.rotor_flux_vs * unit(-w_e * t * f64::from(k));
                // Of an alternating ripple one sample is left at most, and one was lost.
                let left = 3.0 * 40.0 / f64::from(k) / e.norm();
                assert!((found - psi).norm() < left * psi.norm(), "{found} {psi} {left}");
                assert_eq!((caught.omega_m, caught.sample_time_s), (SPEED, t));
                return;
            }
        }
        panic!("it never ends");
    }

    /// Until the link can hold the emf the controller does not begin; then it begins with what is left of the flux.
    #[test]
    fn more_emf_than_the_link_can_hold_is_waited_for() {
        let (w_e, t) = (2.0 * SPEED, 1e-4);
        let mut s = start(0.0);
        let (g, rate) = (s.regulator, Complex::new(-s.inverse_rotor_time_constant, w_e));
        let mut i = Complex::new(0.0, 0.0);
        let mut u_s = i;
        for k in 0..2000 {
            // Half as much again as 300 V can hold, for a tenth of a second; then half of what they can.
            let psi = unit(0.5) * (if k < 1000 { 1.5 } else { 0.5 }) * 300.0 / 3f64.sqrt() / w_e;
            let e = rate * psi;
            let frame = unit(w_e * t * f64::from(k));
            let Command::Voltage(u) = s.step(&measured(i * frame, u_s, 300.0), &NOTHING) else { panic!() };
            if let Some(caught) = s.controller().0 {
                let (found, wanted) = (caught.rotor_flux_vs * s.k_r, psi * frame);
                assert!(k >= 1000 && (found - wanted).norm() < 0.02 * wanted.norm(), "{k}: {found} {wanted}");
                assert!(s.has_caught() && s.status() == DriveStatus::OK);
                return;
            }
            assert_eq!(s.status(), DriveStatus::CATCHING.and(DriveStatus::MAGNETIZING));
            let held = u * (frame * unit(w_e * t * 0.5)).conj();
            if (100..1000).contains(&k) {
                // All of the link, and the emf's direction but for what the current is kept from.
                assert!((held.norm() - 300.0 / 3f64.sqrt()).abs() < 0.1 && (held / e).arg().abs() < 0.5, "{k}: {held} {e}");
            }
            for _ in 0..20 {
                i += (held - e - i * Complex::new(g.resistance_ohm, w_e * g.leakage_inductance_h))
                    * (t / 20.0 / g.leakage_inductance_h);
            }
            u_s = u;
        }
        panic!("it never ends");
    }

    #[test]
    fn data_out_of_bounds_are_refused() {
        let m = machines::JADOT_TABLE_I;
        let data = MachineData::of(&Machine::<f64>::base(m.parameters(), m.pole_pairs).unwrap(), 25.0);
        assert!(FlyingStart::try_new(Keeps::<f64>(None), &data, 0.0).is_err());
        assert!(FlyingStart::try_new(Keeps::<f64>(None), &MachineData { current_max_a: -1.0, ..data }, 1e-4).is_err());
    }
}
