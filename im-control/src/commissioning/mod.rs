//! Self-commissioning: the parameters of the machine from its own drive, at standstill, then turning, in less than two minutes.
//!
//! ```text
//! quiet ─► pulses ─► direct currents ─► alternating currents ─► [fit] ─► torque up, none, down ─► [fit] ─► no load at several fluxes ─► stop ─► [fit]
//! offset   L_σ,      R_s by direction,  L_l, R_r, skin effect            J, friction                       magnetizing curve, iron loss
//!          phases    dead-time curve,
//!                    flux decay
//! ```
//!
//! It sees what the drive will see: measured currents, commanded voltages, the dc link. [`Controller::step`] may be called by a simulation as any controller is. In
//! firmware the interrupt calls [`sample`](Commissioning::sample), which never computes a fit. The main loop calls [`fit`](Commissioning::fit) on a copy, so that
//! the interrupt is held off for the copy alone, and gives what it returns to [`adopt`](Commissioning::adopt): between two stages the machine rests at zero current, or
//! keeps its speed, until that has been done (the README has the lines).
//!
//! The current stays within [`CommissioningPlan::current_max_a`]; a third beyond it everything ends. What ends it early is a [`CommissioningFault`].
//!
//! The equations: `standstill.rs`, `turning.rs`. Sources: direct and alternating tests at standstill as in N. R. Klaes, "Parameter identification of an induction machine with
//! regard to dependencies on saturation", IEEE Trans. Ind. Appl. 29 (1993), and M. Sumner, G. M. Asher, "Autocommissioning for voltage-referenced voltage-fed
//! vector-controlled induction motor drives", IEE Proc. B 140 (1993); the tests on a direct current, and the fits, derived here.

mod drive;
mod fit;
#[cfg(feature = "std")]
mod motor;
mod result;
#[cfg(feature = "std")]
mod simulated;
mod standstill;
mod turning;

use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::space_vector::{dot, norm2, unit};
use im_model::{Complex, ModelError, Scalar};

use crate::current_regulator::{CurrentRegulator, Turning as Frame};
use crate::delay::Delayed;
use crate::error::ControlError;
use crate::guard;
use crate::status::{DriveStatus, Reports};
use crate::vector::{is_finite, rotation, shortened, within_hexagon};
pub use drive::CommissionedDrive;
pub use fit::Found;
pub use result::{Commissioned, CommissioningFault, CommissioningPlan, MagnetizingPoint, NO_LOAD_LEVELS};
#[cfg(feature = "std")]
pub use simulated::{Comparison, SimulatedCommissioning, bench, commission};
use standstill::{AtStandstill, BIAS, FALLING, LEVELS, Level, TONE_SAMPLES, TONE_SHARE, TONES_HZ, Tone, axis};
use turning::Turning;

/// Offset and noise are measured over this, s.
const QUIET_S: f64 = 0.1;
/// A first pulse raises the current by 0.3 of the rated one at a leakage of 0.05 per unit. Where it is not seen it is doubled, to what gives 1.2 times the rated current
/// at 0.1 per unit. The next give half of the rated current.
const PULSE_SHARE: f64 = 0.3;
const PULSE_LEAKAGE: f64 = 0.05;
const PULSE_MOST: f64 = 2.4;
const PULSE_CURRENT: f64 = 0.5;
const PULSE_REST_S: f64 = 0.02;
/// References change over this.
const RAMP_S: f64 = 0.02;
/// Means of direct currents are compared over this, and are settled when they differ by no more than what the fit leaves open; longest time.
const WINDOW_S: f64 = 0.2;
const LEVEL_S: f64 = 8.0;
/// Standard deviations by which noise may tell two means apart; the most windows over which a settled voltage is averaged.
const NOISE: f64 = 4.0;
const SETTLED_WINDOWS: u32 = 6;
/// A current further than this share of the rated one from its reference does not follow it.
const FOLLOWED: f64 = 0.25;
/// Lost samples that are bridged.
const LOST_MAX: u32 = 10;
/// Periods of alternating currents faster than this are measured again where samples were lost.
const BRIDGED_HZ: f64 = 1.5;
/// A current beyond this times the limit ends everything.
const TRIP: f64 = 1.33;
/// How long the current is held at zero at the end.
const END_S: f64 = 0.5;
const LONGEST_S: f64 = 120.0;

/// Where a commissioning is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CommissioningStage {
    /// Zero voltage: offset and noise of the sensors.
    Quiet,
    /// Voltage pulses.
    Pulses,
    /// Direct currents.
    DirectCurrent,
    /// Alternating currents.
    AlternatingCurrent,
    /// The machine turns.
    Turning,
    /// The current is brought to zero.
    Ending,
    /// Done: zero voltage.
    Done,
}

#[derive(Clone, Copy, Debug)]
enum Stage {
    Quiet,
    /// The pulse k of a round, and the rest after it.
    Pulse(u32),
    Level(usize),
    Tone(usize),
    /// A fit is due.
    Waiting,
    Turning,
    Ending,
    Done,
}

/// Sums over a window or a period.
#[derive(Clone, Copy, Debug)]
struct Sums<T> {
    samples: u32,
    u: Complex<T>,
    i: Complex<T>,
    i2: T,
}

impl<T: Scalar> Sums<T> {
    fn new() -> Self {
        let z = Complex::new(T::zero(), T::zero());
        Self { samples: 0, u: z, i: z, i2: T::zero() }
    }

    fn mean(&self) -> [Complex<f64>; 2] {
        let n = f64::from(self.samples.max(1));
        [self.u, self.i].map(|z| Complex::new(z.re.value() / n, z.im.value() / n))
    }
}

/// A direct current while it settles, in f64 from window to window.
#[derive(Clone, Copy, Debug, Default)]
struct Settling {
    windows: u32,
    close: u32,
    before: Complex<f64>,
    voltage_sum: f64,
    current_sum: f64,
    samples: f64,
    /// Windows until it was seen to have settled, and the sum of their mean voltages since.
    settled_after: Option<u32>,
    settled_voltage_v: Complex<f64>,
}

/// An alternating current: periods passed, and mean and square of the impedance.
#[derive(Clone, Copy, Debug, Default)]
struct Periods {
    seen: u32,
    sum: Complex<f64>,
    square: f64,
}

/// A commissioning in sampled time.
#[derive(Clone, Copy, Debug)]
pub struct Commissioning<T: Scalar> {
    plan: CommissioningPlan,
    stage: Stage,
    samples: u32,
    elapsed: u32,
    lost: u32,
    dc_voltage_v: T,
    command: Complex<T>,
    /// The last sample that was one, and whether it stands for others in the present period.
    believed: Complex<T>,
    bridged: bool,
    voltage: Delayed<T>,
    offset: Complex<T>,
    noise_a: f64,
    pulse_vs: f64,
    rough: bool,
    answers: [Complex<f64>; 6],
    answer: Complex<T>,
    leakage_h: f64,
    regulator: CurrentRegulator<T>,
    integral: Complex<T>,
    direction: Complex<T>,
    reference_a: Complex<T>,
    /// Samples in a row in which the current did not follow.
    astray: u32,
    sums: Sums<T>,
    settling: Settling,
    levels: [Level; LEVELS.len()],
    periods: Periods,
    tones: [Tone; TONES_HZ.len()],
    tone_count: usize,
    still: Option<AtStandstill>,
    turning: Option<Turning<T>>,
    /// Everything has been measured.
    stopped: bool,
    outcome: Option<Result<Commissioned, CommissioningFault>>,
}

/// A fit, computed beside the interrupt.
#[derive(Clone, Copy, Debug)]
pub struct Fit<T: Scalar>(Due<T>);

#[derive(Clone, Copy, Debug)]
#[allow(clippy::large_enum_variant, reason = "there is no heap")]
enum Due<T: Scalar> {
    /// Of what was measured at standstill.
    Still(Result<(AtStandstill, Turning<T>), CommissioningFault>),
    /// Of the run under torque.
    Turned(Result<CommissionedDrive<T>, CommissioningFault>),
    /// Of everything.
    Found(Result<Commissioned, CommissioningFault>),
}

impl<T: Scalar> Commissioning<T> {
    /// For a machine at rest.
    ///
    /// # Errors
    /// A quantity of the plan out of bounds.
    pub fn try_new(plan: &CommissioningPlan) -> Result<Self, ControlError> {
        Ok(Self::for_plan(plan)?)
    }

    fn for_plan(plan: &CommissioningPlan) -> Result<Self, ModelError> {
        plan.validate()?;
        let (f, z) = (T::from_f64, Complex::new(T::zero(), T::zero()));
        let lag = plan.sample_time_s + plan.voltage_delay_s;
        let regulator = CurrentRegulator {
            bandwidth_rad_s: f((0.12 / lag).min(1000.0)),
            leakage_inductance_h: f(PULSE_LEAKAGE * plan.impedance_ohm() / plan.omega_rad_s()),
            resistance_ohm: T::zero(),
            voltage_delay_s: f(plan.voltage_delay_s),
        };
        Ok(Self {
            plan: *plan,
            stage: Stage::Quiet,
            samples: 0,
            elapsed: 0,
            lost: 0,
            dc_voltage_v: T::zero(),
            command: z,
            believed: z,
            bridged: false,
            voltage: Delayed::new(f(plan.voltage_delay_s / plan.sample_time_s)),
            offset: z,
            noise_a: 0.0,
            pulse_vs: PULSE_SHARE * PULSE_LEAKAGE * plan.rating.phase_voltage_peak_v / plan.omega_rad_s(),
            rough: true,
            answers: [Complex::new(0.0, 0.0); 6],
            answer: z,
            leakage_h: 0.0,
            regulator,
            integral: z,
            direction: Complex::new(T::one(), T::zero()),
            reference_a: z,
            astray: 0,
            sums: Sums::new(),
            settling: Settling::default(),
            levels: [Level::default(); LEVELS.len()],
            periods: Periods::default(),
            tones: [Tone::default(); TONES_HZ.len()],
            tone_count: 0,
            still: None,
            turning: None,
            stopped: false,
            outcome: None,
        })
    }

    /// The result, at the end.
    pub fn outcome(&self) -> Option<&Result<Commissioned, CommissioningFault>> {
        self.outcome.as_ref()
    }

    /// Where it is.
    pub fn stage(&self) -> CommissioningStage {
        match self.stage {
            Stage::Quiet => CommissioningStage::Quiet,
            Stage::Pulse(_) => CommissioningStage::Pulses,
            Stage::Level(_) => CommissioningStage::DirectCurrent,
            Stage::Tone(_) => CommissioningStage::AlternatingCurrent,
            Stage::Turning => CommissioningStage::Turning,
            Stage::Waiting if self.turning.is_some() => CommissioningStage::Turning,
            Stage::Waiting => CommissioningStage::AlternatingCurrent,
            Stage::Ending => CommissioningStage::Ending,
            Stage::Done => CommissioningStage::Done,
        }
    }

    /// How long it has been running, s.
    pub fn drive_time_s(&self) -> f64 {
        f64::from(self.elapsed) * self.plan.sample_time_s
    }

    fn go_on(&mut self, stage: Stage) {
        (self.stage, self.samples) = (stage, 0);
        (self.sums, self.settling, self.periods) = (Sums::new(), Settling::default(), Periods::default());
    }

    fn fail(&mut self, fault: CommissioningFault) {
        if self.outcome.is_none() {
            self.outcome = Some(Err(fault));
        }
        self.go_on(Stage::Ending);
    }

    fn seconds(&self) -> f64 {
        f64::from(self.samples) * self.plan.sample_time_s
    }

    /// A sample of the interrupt: the voltage for the next.
    pub fn sample(&mut self, measured: &Measured<T>) -> Complex<T> {
        let z = Complex::new(T::zero(), T::zero());
        if matches!(self.stage, Stage::Done) {
            return z;
        }
        self.elapsed = self.elapsed.saturating_add(1);
        let t = T::from_f64(self.plan.sample_time_s);
        let known = Measured { omega_m: T::zero(), sample_time_s: t, ..*measured };
        let commanded = if guard::is_voltage(measured.u_s) { measured.u_s } else { self.command };
        let u_s = self.voltage.step(commanded);
        if guard::is_usable(&Measured { u_s: z, ..known }, T::from_f64(self.plan.current_max_a)) {
            (self.lost, self.dc_voltage_v, self.believed) = (0, measured.dc_voltage_v, measured.i_s);
        } else {
            self.lost = self.lost.saturating_add(1);
            match self.stage {
                // The regulated current is where it was; what is short is measured again.
                Stage::Level(_) | Stage::Tone(_) if self.lost <= LOST_MAX => self.bridged = true,
                Stage::Quiet if self.lost <= LOST_MAX => self.go_on(Stage::Quiet),
                Stage::Pulse(_) if self.lost <= LOST_MAX => self.go_on(Stage::Pulse(0)),
                _ => {
                    let nan = T::from_f64(f64::NAN);
                    self.command = self.without_a_sample(&Measured { i_s: Complex::new(nan, nan), u_s: commanded, ..known });
                    return self.command;
                }
            }
        }
        let dc_voltage_v = self.dc_voltage_v;
        let m = Measured { i_s: self.believed - self.offset, u_s: commanded, dc_voltage_v, ..known };
        let most = T::from_f64(TRIP * self.plan.current_max_a);
        if norm2(m.i_s) > most * most && !matches!(self.stage, Stage::Ending) {
            self.fail(CommissioningFault::Overcurrent);
        } else if self.drive_time_s() > LONGEST_S && !matches!(self.stage, Stage::Ending) {
            self.fail(CommissioningFault::TooLong);
        }
        self.samples = self.samples.saturating_add(1);
        let u = match self.stage {
            Stage::Quiet => self.quiet(&m),
            Stage::Pulse(k) => self.pulse(k, &m),
            Stage::Level(k) => self.level(k, &m, u_s),
            Stage::Tone(k) => self.tone(k, &m, u_s),
            Stage::Turning => self.turn(&m, u_s),
            Stage::Waiting => self.wait(&m, u_s),
            Stage::Ending => self.end(&m),
            Stage::Done => z,
        };
        self.command = if is_finite(u) { within_hexagon(u, self.dc_voltage_v) } else { z };
        self.command
    }

    /// In the background: the fit that is due, if one is. Where an interrupt samples meanwhile, [`fit`](Self::fit) and [`adopt`](Self::adopt) instead.
    pub fn evaluate(&mut self) {
        if let Some(fit) = self.fit() {
            self.adopt(fit);
        }
    }

    /// The fit that is due, if one is. It takes long: on a copy, while the interrupt goes on with the commissioning itself.
    pub fn fit(&self) -> Option<Fit<T>> {
        if !matches!(self.stage, Stage::Waiting) {
            return None;
        }
        let fit = match &self.turning {
            Some(turning) if self.stopped => Due::Found(self.found(turning)?),
            Some(turning) => Due::Turned(turning.fitted()),
            None => {
                let tones = self.tones.get(..self.tone_count).unwrap_or(&[]);
                Due::Still(
                    standstill::evaluate(&self.plan, &self.levels, tones, self.leakage_h, self.dc_voltage_v.value()).and_then(
                        |still| {
                            let turning = Turning::try_new(&self.plan, &still).map_err(|_| CommissioningFault::NoImpedance)?;
                            Ok((still, turning))
                        },
                    ),
                )
            }
        };
        Some(Fit(fit))
    }

    /// Goes on with a fit of [`fit`](Self::fit). One that nothing waits for is not taken.
    pub fn adopt(&mut self, fit: Fit<T>) {
        if !matches!(self.stage, Stage::Waiting) {
            return;
        }
        let next = match (fit.0, &mut self.turning) {
            (Due::Found(found), Some(_)) if self.stopped => {
                self.outcome = Some(found);
                return self.go_on(Stage::Ending);
            }
            (Due::Turned(drive), Some(turning)) if !self.stopped => drive.map(|drive| turning.adopt(drive)),
            (Due::Still(still), None) => still.map(|(still, turning)| {
                (self.still, self.turning) = (Some(still), Some(turning));
            }),
            _ => return,
        };
        match next {
            Ok(()) => self.go_on(Stage::Turning),
            Err(fault) => self.fail(fault),
        }
    }

    /// A sample without a measurement: the last command, turned with the rotor, and fading where that lasts.
    fn without_a_sample(&mut self, m: &Measured<T>) -> Complex<T> {
        if self.lost > LOST_MAX && !matches!(self.stage, Stage::Ending) {
            self.fail(CommissioningFault::MeasurementLost);
        }
        if let (Stage::Turning, Some(turning)) = (self.stage, &mut self.turning)
            && let Ok((u, _)) = turning.step(m, self.command)
        {
            return if is_finite(u) { u } else { Complex::new(T::zero(), T::zero()) };
        }
        // As the emf of the flux that is there: with the rotor, at its time constant.
        let (omega, decay_s) = self.turning.as_ref().map_or((T::zero(), 0.0), |t| (t.omega_e(), t.rotor_time_constant_s()));
        let share = if self.lost > LOST_MAX { decay_s / (decay_s + self.plan.sample_time_s) } else { 1.0 };
        self.samples = self.samples.saturating_add(1);
        if matches!(self.stage, Stage::Ending) && self.seconds() > END_S + 5.0 * decay_s {
            self.go_on(Stage::Done);
            return Complex::new(T::zero(), T::zero());
        }
        self.command * rotation(omega * m.sample_time_s) * T::from_f64(share)
    }

    /// Zero voltage.
    fn quiet(&mut self, m: &Measured<T>) -> Complex<T> {
        self.sums.samples += 1;
        self.sums.i += m.i_s;
        self.sums.i2 += norm2(m.i_s);
        if self.seconds() >= QUIET_S {
            let [_, mean] = self.sums.mean();
            let n = f64::from(self.sums.samples.max(1));
            self.noise_a = Scalar::sqrt((self.sums.i2.value() / n - norm2(mean)).max(0.0));
            let rated = self.plan.rated_current_a;
            // A shaft that turns with flux makes an alternating current; one that stands still is the sensors'.
            if Scalar::sqrt(norm2(mean)) > 0.1 * rated || self.noise_a > 0.05 * rated {
                self.fail(CommissioningFault::NotAtRest);
            } else {
                self.offset = Complex::new(T::from_f64(mean.re), T::from_f64(mean.im));
                self.go_on(Stage::Pulse(0));
            }
        }
        Complex::new(T::zero(), T::zero())
    }

    /// A rest, and pulse k along one of six directions: up, a pause in which the current is read, down. After the sixth a rest alone. A pulse that lost a sample leaves a
    /// current, so that the first of its round begins with a rest too.
    fn pulse(&mut self, k: u32, m: &Measured<T>) -> Complex<T> {
        let (t, rated_v) = (self.plan.sample_time_s, self.plan.rating.phase_voltage_peak_v);
        let zero = Complex::new(T::zero(), T::zero());
        let rest = (PULSE_REST_S / t) as u32;
        if self.samples <= rest {
            self.answer = zero;
            return zero;
        }
        if k == 6 {
            self.pulses_done();
            return zero;
        }
        let direction: Complex<T> = unit(T::from_f64(f64::from(k) * core::f64::consts::FRAC_PI_3));
        let long = ((self.pulse_vs / (0.5 * rated_v * t)) as u32).saturating_add(1);
        let late = (self.plan.voltage_delay_s / t) as u32 + 2;
        let height = T::from_f64(self.pulse_vs / (f64::from(long) * t));
        let at = self.samples - rest - 1;
        // The sample that sees the whole pulse.
        if at >= long && at < long + late {
            let seen = m.i_s * direction.conj();
            if norm2(seen) > norm2(self.answer) {
                self.answer = seen;
            }
        }
        if at + 1 >= 2 * long + late {
            if let Some(a) = self.answers.get_mut(k as usize) {
                *a = Complex::new(self.answer.re.value(), self.answer.im.value());
            }
            self.go_on(Stage::Pulse(k + 1));
        }
        if at < long {
            direction * height
        } else if at >= long + late {
            -direction * height
        } else {
            zero
        }
    }

    fn pulses_done(&mut self) {
        let unit_vs = PULSE_LEAKAGE * self.plan.rating.phase_voltage_peak_v / self.plan.omega_rad_s();
        match standstill::leakage(&self.answers, self.pulse_vs, self.noise_a) {
            // Too little to be seen: again, with more.
            Err(CommissioningFault::NoCurrent) if self.pulse_vs < 0.5 * PULSE_MOST * unit_vs => {
                self.pulse_vs *= 2.0;
                self.go_on(Stage::Pulse(0));
            }
            Err(fault) => self.fail(fault),
            Ok(leakage_h) if self.rough => {
                self.rough = false;
                self.pulse_vs = leakage_h * PULSE_CURRENT * self.plan.rated_current_a;
                self.go_on(Stage::Pulse(0));
            }
            Ok(leakage_h) => {
                self.leakage_h = leakage_h;
                self.regulator.leakage_inductance_h = T::from_f64(leakage_h);
                self.go_on(Stage::Level(0));
            }
        }
    }

    /// As [`regulate`](Self::regulate), at standstill: a current that does not follow for three samples is not what the sensors show of it. Nor is one
    /// that needs more voltage than the largest direct current has, and what its change takes.
    fn follow(&mut self, m: &Measured<T>, wanted: Complex<T>) -> Complex<T> {
        let rated = self.plan.rated_current_a;
        let off = m.i_s - wanted;
        let most = T::from_f64(FOLLOWED * rated + 4.0 * self.noise_a);
        self.astray = if norm2(off) > most * most { self.astray + 1 } else { 0 };
        let u = self.regulate(m, wanted, T::zero());
        if self.astray > 2 {
            self.fail(CommissioningFault::CurrentNotFollowed);
            return Complex::new(T::zero(), T::zero());
        }
        // Of the first direct current nothing is known yet.
        let direct = self.levels.first().map_or(0.0, |l| l.voltage_v.re);
        let fastest = TONE_SHARE * core::f64::consts::TAU * TONES_HZ[TONES_HZ.len() - 1] + 1.0 / RAMP_S;
        let limit = 1.2 * direct + 2.0 * self.leakage_h * rated * fastest;
        if direct > 0.0 { shortened(u, T::from_f64(limit)) } else { u }
    }

    /// The voltage that brings the current to a reference in a frame, A.
    fn regulate(&mut self, m: &Measured<T>, wanted: Complex<T>, omega: T) -> Complex<T> {
        let frame = Frame {
            direction: self.direction,
            omega_s: omega,
            dc_voltage_v: self.dc_voltage_v,
            sample_time_s: m.sample_time_s,
            overmodulates: false,
        };
        let z = Complex::new(T::zero(), T::zero());
        let i = frame.of_stator(m.i_s);
        self.regulator.follow(&mut self.integral, &frame, wanted, i, z).u_s
    }

    /// A direct current until it has settled.
    fn level(&mut self, k: usize, m: &Measured<T>, u_s: Complex<T>) -> Complex<T> {
        let rated = self.plan.rated_current_a;
        let (phase, share) = LEVELS.get(k).copied().unwrap_or((0.0, 0.0));
        let axis: Complex<T> = axis(phase);
        let most = T::from_f64(rated * self.plan.sample_time_s / RAMP_S);
        self.reference_a += shortened(axis * T::from_f64(share * rated) - self.reference_a, most);
        (self.sums.u, self.sums.i) = (self.sums.u + u_s * axis.conj(), self.sums.i + m.i_s * axis.conj());
        self.sums.samples += 1;
        if f64::from(self.sums.samples) * self.plan.sample_time_s >= WINDOW_S {
            self.window_done(k, share * rated);
        }
        self.follow(m, self.reference_a)
    }

    fn window_done(&mut self, k: usize, wanted: f64) {
        let ([u, i], n) = (self.sums.mean(), f64::from(self.sums.samples));
        let (t, s) = (self.plan.sample_time_s, &mut self.settling);
        s.voltage_sum += u.re * n;
        s.current_sum += i.re * n;
        s.samples += n;
        s.windows += 1;
        // What noise of the current moves a mean of the voltage by: no differential resistance is larger than u/i.
        let noise = self.noise_a / Scalar::sqrt(n) * u.re.abs() / wanted;
        // The other phases are only compared with phase a, and across the current too: there the flux that turned away is seen longest.
        let is_compared = k >= FALLING;
        let change = if is_compared { Scalar::sqrt(norm2(u - s.before)) } else { (u.re - s.before.re).abs() };
        // As the fit weighs it.
        let largest = self.levels.first().map_or(0.0, |l| l.voltage_v.re.abs());
        let close = s.windows > 1 && change < standstill::left_v(u.re, largest) + NOISE * noise;
        s.close = if close { s.close + 1 } else { 0 };
        let before = core::mem::replace(&mut s.before, u);
        if s.settled_after.is_some() {
            s.settled_voltage_v += u;
        } else if s.close > 1 {
            s.settled_after = Some(s.windows);
        }
        let s = *s;
        self.sums = Sums::new();
        let off = (i.re - wanted).abs().max(i.im.abs()) > 0.05 * wanted + 4.0 * self.noise_a;
        // As long again as it took to settle: an error of u_∞ is integrated over all that time.
        let since = s.settled_after.map_or(0, |after| s.windows - after);
        let enough = s.settled_after.is_some_and(|after| is_compared || since >= after.min(SETTLED_WINDOWS));
        if s.windows > 3 && off {
            self.fail(CommissioningFault::CurrentNotReached);
        } else if enough || f64::from(s.windows) * WINDOW_S > LEVEL_S {
            let voltage_v = if since > 1 { s.settled_voltage_v * (1.0 / f64::from(since)) } else { (u + before) * 0.5 };
            if let Some(level) = self.levels.get_mut(k) {
                *level = Level {
                    current_a: i.re,
                    voltage_v,
                    deviation_v: noise / Scalar::sqrt(f64::from(since.max(2))),
                    voltage_area_vs: (s.voltage_sum - s.samples * voltage_v.re) * t,
                    current_area_as: (s.current_sum - s.samples * i.re) * t,
                };
            }
            self.go_on(if k + 1 < LEVELS.len() { Stage::Level(k + 1) } else { Stage::Tone(0) });
        }
    }

    /// An alternating current on the direct one, in whole periods of N samples.
    fn tone(&mut self, k: usize, m: &Measured<T>, u_s: Complex<T>) -> Complex<T> {
        let t = self.plan.sample_time_s;
        let frequency = TONES_HZ.get(k).copied().unwrap_or(1.0);
        let n = (1.0 / (frequency * t) + 0.5) as u32;
        let omega = core::f64::consts::TAU / (f64::from(n.max(1)) * t);
        let settling = n.max((0.3 / t) as u32);
        let at = self.samples - 1;
        let axis: Complex<T> = axis(LEVELS[LEVELS.len() - 1].0);
        let phase: Complex<T> = unit(T::from_f64(core::f64::consts::TAU * f64::from(at % n.max(1)) / f64::from(n.max(1))));
        if at >= settling.div_ceil(n.max(1)) * n.max(1) {
            // Without the direct parts, which rounding would show.
            let [u_0, i_0] = self.levels.last().map_or([0.0; 2], |l| [l.voltage_v.re, l.current_a]).map(T::from_f64);
            self.sums.u += phase.conj() * (dot(axis, u_s) - u_0);
            self.sums.i += phase.conj() * (dot(axis, m.i_s) - i_0);
            self.sums.samples += 1;
            if self.sums.samples >= n {
                let [u, i] = self.sums.mean();
                self.sums = Sums::new();
                let spoilt = core::mem::replace(&mut self.bridged, false) && frequency > BRIDGED_HZ;
                // The voltage is held over the sample before: its fundamental is sin x/x of its values at the samples, turned by x = ωT/2.
                let x = 0.5 * omega * t;
                let (sin, cos) = Scalar::sin_cos(x);
                let z = u * Complex::new(cos, sin) * (sin / x) * i.conj() * (1.0 / norm2(i).max(1e-30));
                if !spoilt {
                    self.periods.seen += 1;
                    self.periods.sum += z;
                    self.periods.square += norm2(z);
                }
                let enough = if frequency < 1.5 { 3 } else { 4u32.max((0.5 * frequency) as u32) };
                if self.periods.seen >= enough {
                    self.tone_done(k, omega);
                }
            }
        }
        let rated = self.plan.rated_current_a;
        let [bias, share] = [BIAS, TONE_SHARE].map(|x| T::from_f64(x * rated));
        // The last sample of a tone is the first of the next one.
        self.follow(m, axis * (bias + share * phase.re))
    }

    fn tone_done(&mut self, k: usize, omega_rad_s: f64) {
        let n = f64::from(self.periods.seen);
        let mean = self.periods.sum * (1.0 / n);
        let variance = (self.periods.square / n - norm2(mean)).max(0.0) / (n - 1.0);
        if let Some(tone) = self.tones.get_mut(k) {
            *tone = Tone { omega_rad_s, impedance_ohm: mean, deviation_ohm: Scalar::sqrt(variance) };
        }
        self.tone_count = k + 1;
        let next = TONES_HZ.get(k + 1).is_some_and(|f| 1.0 / (f * self.plan.sample_time_s) >= TONE_SAMPLES);
        self.go_on(if next { Stage::Tone(k + 1) } else { Stage::Waiting });
    }

    /// Until the fit has been done.
    fn wait(&mut self, m: &Measured<T>, u_s: Complex<T>) -> Complex<T> {
        if self.turning.is_some() { self.turn(m, u_s) } else { self.regulate(m, Complex::new(T::zero(), T::zero()), T::zero()) }
    }

    fn turn(&mut self, m: &Measured<T>, u_s: Complex<T>) -> Complex<T> {
        let Some(turning) = &mut self.turning else { return self.command };
        let nan = T::from_f64(f64::NAN);
        match turning.step(&Measured { omega_m: nan, ..*m }, u_s) {
            Ok((u, false)) => {
                if turning.is_pending() && !matches!(self.stage, Stage::Waiting) {
                    self.go_on(Stage::Waiting);
                }
                u
            }
            Ok((u, true)) => {
                self.stopped = true;
                self.go_on(Stage::Waiting);
                u
            }
            Err(fault) => {
                self.fail(fault);
                self.command
            }
        }
    }

    /// What it all says, once everything has been measured.
    fn found(&self, turning: &Turning<T>) -> Option<Result<Commissioned, CommissioningFault>> {
        let still = self.still.as_ref()?;
        let time = self.drive_time_s();
        // A mean over the time of rest, with the noise of each axis.
        let samples = QUIET_S / self.plan.sample_time_s;
        let half_width = 2.5 * self.noise_a / Scalar::sqrt(2.0 * samples);
        let offset = |x: T| Found { value: x.value(), half_width };
        Some(turning.result(half_width).map(|turned| Commissioned {
            stator_resistance_ohm: still.stator_resistance_ohm,
            rotor_resistance_ohm: still.rotor_resistance_ohm,
            leakage_inductance_h: still.leakage_inductance_h,
            magnetizing_inductance_h: turned.magnetizing_inductance_h,
            magnetizing: turned.magnetizing,
            inertia_kg_m2: turned.inertia_kg_m2,
            viscous_friction_nm_s_per_rad: turned.viscous_friction_nm_s_per_rad,
            coulomb_friction_nm: turned.coulomb_friction_nm,
            windage_nm_s2: turned.windage_nm_s2,
            inverter_voltage_v: still.inverter_voltage_v,
            inverter_current_a: still.inverter_current_a,
            skin_effect: still.skin_effect,
            iron_conductance_s: turned.iron_conductance_s,
            current_offset_a: [self.offset.re, self.offset.im].map(offset),
            voltage_offset_v: turned.voltage_offset_v,
            resistance_asymmetry_ohm: still.resistance_asymmetry_ohm,
            dc_voltage_v: self.dc_voltage_v.value(),
            drive_time_s: time,
        }))
    }

    /// Where the machine turns, the current at zero in a frame that turns with it; at standstill, no voltage: flux and current decay, and no sensor is needed for it.
    fn end(&mut self, m: &Measured<T>) -> Complex<T> {
        if self.seconds() > END_S {
            self.go_on(Stage::Done);
        }
        if self.turning.is_none() {
            return Complex::new(T::zero(), T::zero());
        }
        let omega = self.turning.as_ref().map_or(T::zero(), Turning::omega_e);
        if self.samples == 1 {
            // The regulator goes on from the voltage that was there.
            self.direction = Complex::new(T::one(), T::zero());
            self.integral = self.command;
        }
        let u = self.regulate(m, Complex::new(T::zero(), T::zero()), omega);
        let turned = self.direction * rotation(omega * m.sample_time_s);
        self.direction = turned * (T::from_f64(1.5) - norm2(turned) * T::from_f64(0.5));
        u
    }
}

impl<T: Scalar> Controller<T> for Commissioning<T> {
    /// Sample and fit in one, where time does not press. The reference is not looked at.
    fn step(&mut self, measured: &Measured<T>, _reference: &Reference<T>) -> Command<T> {
        let u = self.sample(measured);
        self.evaluate();
        Command::Voltage(u)
    }
}

impl<T: Scalar> Reports for Commissioning<T> {
    fn status(&self) -> DriveStatus {
        DriveStatus::OK
            .and_if(self.lost > 0, DriveStatus::CURRENT_LOST)
            .and_if(matches!(self.outcome, Some(Err(_))), DriveStatus::BLOCKED)
            .and_if(matches!(self.outcome, Some(Err(CommissioningFault::Overcurrent))), DriveStatus::OVERCURRENT)
    }
}

#[cfg(test)]
mod tests;
