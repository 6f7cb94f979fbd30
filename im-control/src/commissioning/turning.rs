//! The machine turns: the sensorless drive with what standstill has shown, first following torque, then speed.
//!
//! **Torque up, none, torque down** gives inertia and friction by what the torque adds up to. For each part, from when flux and currents have settled in the frame of the flux,
//! and with a constant M for each:
//!
//! ∫τ dt = J ω + D ∫ω dt + τ_C t + k ∫ω² dt + (3/2) n_p G ∫ω_s ψ² dt + M,   τ = (3/2) n_p Re((u − u_lost − N ī − R_s i) ī)/ω_s
//!
//! Nothing is differentiated: noise and ripple of the speed, and what ω̂ lags by under a constant torque (it is in M), make no acceleration. With a torque that ripples and a
//! shaft that gives the mean is the machine's all the same.
//!
//! Windage k is kept where it is more than its uncertainty. Where it is not, friction in proportion to speed holds a part of it, and the intervals of D and τ_C reach to
//! what they would be with it.
//!
//! The torque is that of the power across the air gap, less the iron loss: the observer's own follows a speed that lags behind while it changes. While the machine
//! coasts the flux is reduced, so that friction is not taken for iron loss. G is that of the run without load.
//!
//! **No load** at half the rated speed, at several levels of flux, in the frame of the flux:
//!
//! ψ_s = (u − u_lost − N ī − R_s i)/(jω_s),   ψ_m = ψ_s − L_l i,   i_m = Re(ψ̄_m i)/|ψ_m| − L_l i_r²/|ψ_m|,   Re((u − u_lost − N ī − R_s i) ī)/ω_s = G ω_sψ_m² + M_0
//!
//! with i_r = Im(ψ̄_m i)/|ψ_m|, what friction asks of the rotor (it stands across ψ_r, not across ψ_m: with 5 % of rated torque at half of the flux 7 % of i_m), and M_0 the friction of that speed: over ω_s, so that what the slip takes, which is the larger the less the flux, is no iron loss.
//!
//! The speed is not the same at each level: the observer's L_m is that of one flux, and ω̂ is off by up to 1 % of the synchronous speed at the others. What friction changes by that,
//! D and k of the run under torque, is taken off first, with the speed ω_s − R_r i_r/ψ_m, in which L_m does not stand.
//!
//! The current of a sample is its mean, not that of its ends. While the voltage is held and the emf turns, i″ = −jω_s(u − L_σi′)/L_σ, and with i′ = jω_s i
//!
//! ī = (i₀ + i₁)/2 − i″T²/12 = (i₀ + i₁)/2 · (1 + (ω_sT)²/12) + jω_sT² u/(12 L_σ)
//!
//! Along u that is nothing, but R_s|i|² is off by 1e-5 to 1e-4 of the rated power without it.
//!
//! A dead time t_d delays one edge of each pulse, whichever way the current flows, hence the middle of every pulse by t_d/2. The sample, in the middle of a zero vector as commanded, comes as
//! much too early, while the current falls by u/L_σ: it shows u t_d/(2L_σ) too much, along u. As power that is an iron loss of G = t_d/(2L_σ), a tenth of the iron's at 2 µs.

use im_model::effects::InverterNonlinearity;
use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::space_vector::{cross, dot, j, norm2};
use im_model::{Complex, Scalar, TParameters};

use super::drive::{CommissionedDrive as Drive, Use, drive, soft_current_a};
use super::fit::{Found, Linear};
use super::result::{CommissioningFault, CommissioningPlan, MagnetizingPoint, NO_LOAD_LEVELS, ON_LAW, magnetizing_laws};
use super::standstill::{AtStandstill, SHARPEST};
use crate::ControlError;
use crate::status::{DriveStatus, Reports};
use crate::vector::{is_finite, norm};

/// Parts of the run under torque.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Part {
    Magnetize,
    /// With torque until this share of the synchronous speed.
    Up(f64),
    Down(f64),
    Coast,
}

const PARTS: [Part; 7] =
    [Part::Magnetize, Part::Up(0.6), Part::Coast, Part::Down(0.3), Part::Coast, Part::Up(0.6), Part::Down(0.4)];
const COAST_S: f64 = 1.9;
/// A shaft that is not fast by then does not turn.
const UP_S: f64 = 15.0;
/// Mean torque and speed are taken over this.
const WINDOW_S: f64 = 0.02;
/// Currents and estimates have settled to a torque that changed, s.
const SETTLED_S: f64 = 0.08;
/// A light shaft gets less torque beyond its friction, so that speeding up takes this long; and the least share of it.
const UP_AT_LEAST_S: f64 = 0.8;
const LEAST_TORQUE: f64 = 0.15;
/// Below this share of the rated frequency the power does not show the torque.
const SEEN_FROM: f64 = 0.08;
/// No load: flux over that of the plan, and the speed over the synchronous one.
const NO_LOAD: [f64; NO_LOAD_LEVELS] = [0.5, 0.7, 0.85, 1.0, 1.1, 1.2];
const NO_LOAD_SPEED: f64 = 0.5;
/// How long each is averaged, s. Noise of the current sensor along the emf is power, of which iron may take 0.001 of the rated one: least and most flux show it.
const NO_LOAD_S: [f64; NO_LOAD_LEVELS] = [4.0, 0.4, 0.4, 0.4, 0.4, 4.0];
const STOP_S: f64 = 1.5;

#[derive(Clone, Copy, Debug)]
enum Stage {
    Torque(usize),
    NoLoad(usize),
    Stop,
}

/// Sums over a window.
#[derive(Clone, Copy, Debug)]
struct Window<T> {
    samples: u32,
    /// Re((u − u_lost − N ī − R_s i) ī), W over 3/2.
    power: T,
    omega: T,
    /// Of the flux' frame: u − u_lost − N ī, i, and the angle turned.
    u: Complex<T>,
    i: Complex<T>,
    turned: T,
}

impl<T: Scalar> Window<T> {
    fn new() -> Self {
        let (o, z) = (T::zero(), Complex::new(T::zero(), T::zero()));
        Self { samples: 0, power: o, omega: o, u: z, i: z, turned: o }
    }
}

/// A level of flux at no load.
#[derive(Clone, Copy, Debug, Default)]
struct NoLoad {
    u: Complex<f64>,
    i: Complex<f64>,
    omega_s: f64,
    /// u − R_s i in the frame of the stator.
    steady_v: Complex<f64>,
}

/// The mean of a voltage that stands still while everything else turns, with weights x(1 − x) over its time: of what turns n times 0.3/n² is left.
#[derive(Clone, Copy, Debug)]
struct Steady<T> {
    sum: Complex<T>,
    weights: T,
}

impl<T: Scalar> Steady<T> {
    fn new() -> Self {
        Self { sum: Complex::new(T::zero(), T::zero()), weights: T::zero() }
    }

    fn add(&mut self, u: Complex<T>, share: f64) {
        let weight = T::from_f64(share * (1.0 - share));
        (self.sum, self.weights) = (self.sum + u * weight, self.weights + weight);
    }

    fn mean(&self) -> Complex<f64> {
        Complex::new(self.sum.re.value(), self.sum.im.value()) * (1.0 / self.weights.value())
    }
}

/// A part of the run under torque: what torque, speed and iron have added up to.
#[derive(Clone, Copy, Debug)]
struct Momentum {
    rows: Linear<5>,
    /// Σx and Σy of the rows, for their means.
    sum: [f64; 5],
    sum_y: f64,
    count: f64,
    /// ∫τ dt, ∫ω dt, t, ∫ω² dt, (3/2) n_p ∫ω_s ψ² dt.
    impulse_nm_s: f64,
    integrals: [f64; 4],
}

impl Momentum {
    const NONE: Self =
        Self { rows: Linear::new(), sum: [0.0; 5], sum_y: 0.0, count: 0.0, impulse_nm_s: 0.0, integrals: [0.0; 4] };

    /// A window, and the speed at its end.
    fn add(&mut self, seconds: f64, torque_nm: f64, [omega, iron]: [f64; 2], omega_at_end: f64) {
        self.impulse_nm_s += torque_nm * seconds;
        for (sum, x) in self.integrals.iter_mut().zip([omega, 1.0, omega * omega, iron]) {
            *sum += x * seconds;
        }
        let [turned, time, square, iron] = self.integrals;
        let x = [omega_at_end, turned, time, square, iron];
        self.rows.add(x, self.impulse_nm_s);
        for (sum, x) in self.sum.iter_mut().zip(x) {
            *sum += x;
        }
        self.sum_y += self.impulse_nm_s;
        self.count += 1.0;
    }

    /// Its rows, with a constant of their own.
    fn rows(&self) -> Option<Linear<5>> {
        let n = self.count;
        (n > 2.0).then(|| self.rows.about_the_mean(self.sum.map(|x| x / n), self.sum_y / n))
    }
}

/// The machine that turns.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turning<T: Scalar> {
    plan: CommissioningPlan,
    still: AtStandstill,
    drive: Drive<T>,
    torque_nm: f64,
    /// How fast the shaft gained speed on average while it first sped up, rad/s², and how long that took.
    first_up: [f64; 2],
    coasting_from: f64,
    rotor_time_constant_s: f64,
    resistance_ohm: T,
    asymmetry_ohm: Complex<T>,
    voltage_offset_v: Complex<T>,
    bridge: InverterNonlinearity<T>,
    /// T/(12 L_σ), 1/Ω.
    curvature: T,
    /// t_d/(2L_σ), 1/Ω.
    early: T,
    stage: Stage,
    elapsed_s: f64,
    window: Window<T>,
    before: Option<(Complex<T>, Complex<T>)>,
    momentum: Momentum,
    mechanics: Linear<5>,
    levels: [NoLoad; NO_LOAD_LEVELS],
    steady: Steady<T>,
    doubtful_s: f64,
    pending: bool,
}

/// What turning has shown.
#[derive(Clone, Copy, Debug)]
pub(super) struct WhileTurning {
    pub magnetizing_inductance_h: Found,
    pub magnetizing: [MagnetizingPoint; NO_LOAD_LEVELS],
    pub inertia_kg_m2: Found,
    pub viscous_friction_nm_s_per_rad: Found,
    pub coulomb_friction_nm: Found,
    pub windage_nm_s2: Found,
    pub iron_conductance_s: Found,
    pub voltage_offset_v: [Found; 2],
}

/// The drive for what is known; with an inertia it follows speed. R_s has just been measured.
fn drive_of<T: Scalar>(
    plan: &CommissioningPlan,
    still: &AtStandstill,
    inertia_kg_m2: Option<f64>,
) -> Result<Drive<T>, ControlError> {
    let rating = &plan.rating;
    let parameters = TParameters {
        stator_resistance_ohm: still.stator_resistance_ohm.value,
        rotor_resistance_ohm: still.rotor_resistance_ohm.value,
        stator_leakage_inductance_h: still.leakage_inductance_h.value,
        rotor_leakage_inductance_h: still.leakage_inductance_h.value,
        magnetizing_inductance_h: still.magnetizing_inductance_h,
        // Half a second to rated speed, where only torque is followed.
        inertia_kg_m2: inertia_kg_m2.unwrap_or(0.5 * rating.torque_nm / rating.synchronous_speed_rad_s(plan.pole_pairs)),
        viscous_friction_nm_s_per_rad: 0.0,
    };
    drive(
        plan,
        parameters,
        still.skin_effect,
        still.inverter(),
        Use {
            follows_torque: inertia_kg_m2.is_none(),
            learns_stator_resistance: false,
            is_loaded: false,
            least_flux: NO_LOAD[0],
        },
    )?
    .with_voltage_offset(cast(still.voltage_offset()))?
    .with_resistance_asymmetry(cast(still.asymmetry()))
}

/// What the bridge takes. Where its ripple is not known, the knee of standstill is no narrower than the drive has it.
fn bridge<T: Scalar>(plan: &CommissioningPlan, still: &AtStandstill) -> InverterNonlinearity<T> {
    let [voltage_v, knee_a] = still.inverter();
    let known = still.ripple_a_per_v > 0.0;
    let f = T::from_f64;
    InverterNonlinearity {
        voltage_v: f(voltage_v),
        zero_crossing_current_a: f(if known {
            knee_a.max(SHARPEST * plan.rated_current_a)
        } else {
            soft_current_a(plan, knee_a)
        }),
        ripple_a_per_v: f(still.ripple_a_per_v),
        dc_voltage_v: f(still.dc_voltage_v),
    }
}

fn cast<T: Scalar>(z: Complex<f64>) -> Complex<T> {
    Complex::new(T::from_f64(z.re), T::from_f64(z.im))
}

/// What the torque goes to.
struct Mechanics {
    inertia: Found,
    viscous: Found,
    coulomb: Found,
    windage: Found,
}

fn without_windage(rows: &Linear<5>, iron: f64) -> Linear<3> {
    rows.knowing_the_last::<4>(iron).knowing_the_last(0.0)
}

impl Mechanics {
    fn of(rows: &Linear<5>, iron: f64) -> Option<Self> {
        let [inertia, viscous, coulomb] = without_windage(rows, iron).solve()?;
        let Some([j, d, c, windage]) = rows.knowing_the_last::<4>(iron).solve() else {
            return Some(Self { inertia, viscous, coulomb, windage: Found::default() });
        };
        // A friction below zero is another effect that the square has taken in.
        if windage.is_seen() && windage.value > 0.0 && d.value >= 0.0 && c.value >= 0.0 {
            return Some(Self { inertia: j, viscous: d, coulomb: c, windage });
        }
        // Both laws describe the data.
        let reaching =
            |f: Found, to: Found| Found { half_width: f.half_width.max((f.value - to.value).abs() + to.half_width), ..f };
        let none = Found { value: 0.0, half_width: windage.value.abs() + windage.half_width };
        Some(Self { inertia, viscous: reaching(viscous, d), coulomb: reaching(coulomb, c), windage: none })
    }
}

impl<T: Scalar> Turning<T> {
    pub fn try_new(plan: &CommissioningPlan, still: &AtStandstill) -> Result<Self, ControlError> {
        let magnetizing = plan.rating.rotor_flux_vs / still.magnetizing_inductance_h;
        let left = (plan.current_max_a * plan.current_max_a - magnetizing * magnetizing).max(0.0);
        let torque_current = (0.3 * plan.rated_current_a).min(0.7 * Scalar::sqrt(left));
        let (f, l_m) = (T::from_f64, still.magnetizing_inductance_h);
        Ok(Self {
            plan: *plan,
            still: *still,
            drive: drive_of(plan, still, None)?,
            torque_nm: 1.5 * f64::from(plan.pole_pairs) * plan.rating.rotor_flux_vs * torque_current,
            first_up: [0.0; 2],
            coasting_from: 0.0,
            rotor_time_constant_s: (l_m + still.leakage_inductance_h.value) / still.rotor_resistance_ohm.value,
            resistance_ohm: f(still.stator_resistance_ohm.value),
            asymmetry_ohm: cast(still.asymmetry()),
            voltage_offset_v: cast(still.voltage_offset()),
            bridge: bridge(plan, still),
            curvature: f(plan.sample_time_s / (24.0 * still.leakage_inductance_h.value)),
            early: f(plan.dead_time_s / (4.0 * still.leakage_inductance_h.value)),
            stage: Stage::Torque(0),
            elapsed_s: 0.0,
            window: Window::new(),
            before: None,
            momentum: Momentum::NONE,
            mechanics: Linear::new(),
            levels: [NoLoad::default(); NO_LOAD_LEVELS],
            steady: Steady::new(),
            doubtful_s: 0.0,
            pending: false,
        })
    }

    /// Speed of the flux as the drive believes it, electrical, rad/s.
    pub fn omega_e(&self) -> T {
        self.drive.estimate().map_or(T::zero(), |e| e.omega_m) * T::from_f64(f64::from(self.plan.pole_pairs))
    }

    /// T_r, s.
    pub fn rotor_time_constant_s(&self) -> f64 {
        self.rotor_time_constant_s
    }

    /// Whether a fit is due.
    pub fn is_pending(&self) -> bool {
        self.pending
    }

    fn go_on(&mut self, stage: Stage) {
        (self.stage, self.elapsed_s) = (stage, 0.0);
    }

    /// What is asked of the drive now.
    fn reference(&self) -> Reference<T> {
        let f = T::from_f64;
        let (flux, speed) = (self.plan.rating.rotor_flux_vs, self.plan.rating.synchronous_speed_rad_s(self.plan.pole_pairs));
        let (omega, share, torque) = match self.stage {
            Stage::Torque(part) => match PARTS.get(part) {
                Some(Part::Up(_)) => (0.0, 1.0, self.torque_nm),
                Some(Part::Down(_)) => (0.0, 1.0, -self.torque_nm),
                _ => (0.0, 1.0, 0.0),
            },
            Stage::NoLoad(level) => (NO_LOAD_SPEED * speed, NO_LOAD.get(level).copied().unwrap_or(1.0), 0.0),
            Stage::Stop => (0.0, 1.0, 0.0),
        };
        Reference { omega_m: f(omega), rotor_flux_vs: f(share * flux), torque_nm: f(torque) }
    }

    /// While the machine turns the flux loop is faster than the rotor.
    fn settling_s(&self) -> f64 {
        (2.0 * self.rotor_time_constant_s).clamp(0.3, 1.0)
    }

    /// How long a level of flux at no load is waited for, and averaged. The first also waits for the speed.
    fn no_load_s(&self, level: usize) -> (f64, f64) {
        let wait = if level == 0 { self.settling_s() + 1.5 } else { self.settling_s() };
        (wait, NO_LOAD_S.get(level).copied().unwrap_or(0.0))
    }

    /// A sample: the command, and whether the machine stands again. `u_s` is what was commanded over the sample that ended, as it acted.
    pub fn step(&mut self, m: &Measured<T>, u_s: Complex<T>) -> Result<(Complex<T>, bool), CommissioningFault> {
        let Command::Voltage(u) = self.drive.step(m, &self.reference()) else { return Err(CommissioningFault::DriveLost) };
        if self.pending {
            return Ok((u, false));
        }
        let t = m.sample_time_s.value();
        self.elapsed_s += t;
        let status = self.drive.status();
        let lost = status.has(DriveStatus::SPEED_LOST) || status.has(DriveStatus::RESTARTED);
        self.doubtful_s = if lost { self.doubtful_s + t } else { (self.doubtful_s - 0.1 * t).max(0.0) };
        if self.doubtful_s > 1.0 {
            return Err(CommissioningFault::DriveLost);
        }
        let Some(e) = self.drive.estimate().copied() else { return Ok((u, false)) };
        if is_finite(m.i_s) {
            self.take(u_s, m.i_s, e.rotor_flux_vs, e.omega_m);
        } else {
            // What it adds up to has a gap: another constant from here on.
            self.part_done();
            (self.before, self.window) = (None, Window::new());
        }
        let speed = self.plan.rating.synchronous_speed_rad_s(self.plan.pole_pairs);
        let omega = e.omega_m.value() / speed;
        match self.stage {
            Stage::Torque(part) => {
                let w = self.window;
                let n = f64::from(w.samples);
                if n * t >= WINDOW_S {
                    let after = if part == 0 { f64::INFINITY } else { SETTLED_S };
                    let omega_s = w.turned.value() / (n * t);
                    let seen = omega_s.abs() > SEEN_FROM * self.plan.omega_rad_s();
                    if self.elapsed_s > after + n * t && seen && !lost {
                        let factor = 1.5 * f64::from(self.plan.pole_pairs);
                        let torque = factor * w.power.value() / (n * omega_s);
                        let iron = factor * omega_s * norm2(e.rotor_flux_vs).value();
                        self.momentum.add(n * t, torque, [w.omega.value() / n, iron], e.omega_m.value());
                    } else {
                        self.part_done();
                    }
                    self.window = Window::new();
                }
                let done = match PARTS.get(part) {
                    Some(Part::Up(to)) => omega >= *to,
                    Some(Part::Down(to)) => omega <= *to,
                    Some(Part::Coast) => self.elapsed_s > COAST_S || omega < 0.1,
                    _ => self.elapsed_s > 2.0 * self.settling_s() + 0.1,
                };
                match part {
                    1 if done => (self.first_up, self.coasting_from) = ([omega, self.elapsed_s], omega),
                    2 if done => self.weigh(omega),
                    _ => (),
                }
                if done {
                    self.part_done();
                    self.window = Window::new();
                }
                if done && part + 1 < PARTS.len() {
                    self.go_on(Stage::Torque(part + 1));
                } else if done {
                    self.pending = true;
                } else if self.elapsed_s > UP_S {
                    return Err(CommissioningFault::DoesNotTurn);
                }
            }
            Stage::NoLoad(level) => {
                let (wait, averaged) = self.no_load_s(level);
                if self.elapsed_s <= wait {
                    (self.window, self.steady) = (Window::new(), Steady::new());
                } else if self.elapsed_s > wait + averaged {
                    let (w, n) = (self.window, f64::from(self.window.samples));
                    let mean = |z: Complex<T>| Complex::new(z.re.value() / n, z.im.value() / n);
                    if let Some(l) = self.levels.get_mut(level) {
                        *l = NoLoad {
                            u: mean(w.u),
                            i: mean(w.i),
                            omega_s: w.turned.value() / (n * t),
                            steady_v: self.steady.mean(),
                        };
                    }
                    self.go_on(if level + 1 < NO_LOAD_LEVELS { Stage::NoLoad(level + 1) } else { Stage::Stop });
                }
            }
            Stage::Stop => return Ok((u, self.elapsed_s > STOP_S)),
        }
        Ok((u, false))
    }

    /// A part has ended, or what it adds up to is interrupted.
    fn part_done(&mut self) {
        if let Some(rows) = self.momentum.rows() {
            self.mechanics.join(&rows);
        }
        self.momentum = Momentum::NONE;
    }

    /// After the first coasting, down to `omega` over the synchronous speed: the torque that speeds the shaft up in [`UP_AT_LEAST_S`] beside its friction.
    fn weigh(&mut self, omega: f64) {
        let [gained, took_s] = self.first_up;
        let (up, down) = (gained / took_s, ((self.coasting_from - omega) / self.elapsed_s).max(0.0));
        let friction = down / (up + down);
        let least = LEAST_TORQUE.max(1.5 * friction).min(1.0);
        self.torque_nm *= (friction + (1.0 - friction) * took_s / UP_AT_LEAST_S).clamp(least, 1.0);
    }

    /// Adds a sample to the window.
    fn take(&mut self, u_s: Complex<T>, i_s: Complex<T>, flux: Complex<T>, omega: T) {
        let size = norm(flux);
        let is_flux = size > T::zero();
        if !is_flux {
            return;
        }
        let direction = flux * (T::one() / size);
        if let Some((direction_before, i_before)) = self.before {
            let half = T::from_f64(0.5);
            let (middle, i) = (direction_before + direction, (i_before + i_s) * half);
            let middle = middle * (T::one() / norm(middle).max(half));
            let u = u_s + self.voltage_offset_v - self.bridge.taken_v(u_s, i) - self.asymmetry_ohm * i.conj();
            if let Stage::NoLoad(level) = self.stage {
                let (wait, averaged) = self.no_load_s(level);
                self.steady.add(u - i * self.resistance_ohm, ((self.elapsed_s - wait) / averaged).clamp(0.0, 1.0));
            }
            let i = i - u * self.early;
            let turned = cross(direction_before, direction);
            let i = i * (T::one() + turned * turned * T::from_f64(1.0 / 12.0)) + j(u) * (turned * self.curvature);
            let w = &mut self.window;
            w.samples += 1;
            w.power += dot(u - i * self.resistance_ohm, i);
            w.omega += omega;
            w.u += u * middle.conj();
            w.i += i * middle.conj();
            w.turned += turned;
        }
        self.before = Some((direction, i_s));
    }

    /// In the background: what the run under torque says, as the drive that follows speed.
    pub fn fitted(&self) -> Result<Drive<T>, CommissioningFault> {
        let [inertia, ..] = without_windage(&self.mechanics, 0.0).solve().ok_or(CommissioningFault::NoMechanics)?;
        let is_inertia = inertia.value > 0.0 && inertia.tolerance() < 0.3;
        if !is_inertia {
            return Err(CommissioningFault::NoMechanics);
        }
        drive_of(&self.plan, &self.still, Some(inertia.value)).map_err(|_| CommissioningFault::NoMechanics)
    }

    /// Goes on with that drive.
    pub fn adopt(&mut self, drive: Drive<T>) {
        (self.drive, self.pending) = (drive, false);
        self.go_on(Stage::NoLoad(0));
    }

    /// In the background, at the end; `offset_a` is what the offset of the current sensors is uncertain by.
    pub fn result(&self, offset_a: f64) -> Result<WhileTurning, CommissioningFault> {
        let none = CommissioningFault::NoMechanics;
        let (r_s, l_l) = (self.still.stator_resistance_ohm.value, self.still.leakage_inductance_h.value);
        let mut magnetizing = [MagnetizingPoint::default(); NO_LOAD_LEVELS];
        let mut levels = [[0.0; 4]; NO_LOAD_LEVELS];
        let r_r = self.still.rotor_resistance_ohm.value;
        for (((point, level), l), averaged) in magnetizing.iter_mut().zip(&mut levels).zip(&self.levels).zip(NO_LOAD_S) {
            let e = l.u - l.i * r_s;
            // Division by jω.
            let psi_m = Complex::new(e.im, -e.re) * (1.0 / l.omega_s) - l.i * l_l;
            let flux = Scalar::sqrt(norm2(psi_m));
            let [along, across] = [dot(psi_m, l.i), cross(psi_m, l.i)].map(|x| x / flux);
            *point = MagnetizingPoint { flux_vs: flux, current_a: along - l_l * across * across / flux };
            let omega_e = l.omega_s - r_r * across / flux;
            *level = [Scalar::sqrt(averaged), l.omega_s * flux * flux, dot(e, l.i) / l.omega_s, omega_e];
        }
        // The points by a smooth curve through the flux of the plan.
        let wanted = self.plan.rating.rotor_flux_vs;
        let (straight, curve) = magnetizing_laws(&magnetizing, wanted, self.still.magnetizing_inductance_h);
        // R_s and the inverter's voltage stand in ψ_s with their share of the emf.
        let emf = wanted * self.omega_half();
        let share = (self.still.stator_resistance_ohm.half_width * self.plan.rated_current_a
            + self.still.inverter_voltage_v.half_width)
            / emf;
        let l_m = match (curve, straight) {
            (Some(c), Some(s)) if c.cost < s.cost => {
                let [l, k, _] = c.parameters;
                Found::relative(l.value / (1.0 + k.value), ON_LAW * c.chi2.max(1.0) + share)
            }
            (_, Some(s)) => Found::relative(s.parameters[0].value, s.parameters[0].tolerance() + ON_LAW + share),
            _ => return Err(none),
        };
        // Friction is found with the iron loss known, and the iron loss with friction known: what either takes of the other is small.
        let n_p = f64::from(self.plan.pole_pairs);
        let [mut viscous, mut windage] = [0.0; 2];
        let mut conductance = Found::default();
        for _ in 0..3 {
            let mut losses = Linear::<2>::new();
            for [weight, x, y, omega_e] in levels {
                let omega = omega_e / n_p;
                let friction = (viscous + windage * omega) * omega / (1.5 * n_p);
                losses.add([weight * x, weight], weight * (y - friction));
            }
            [conductance, _] = losses.solve().ok_or(none)?;
            let found = Mechanics::of(&self.mechanics, conductance.value.max(0.0)).ok_or(none)?;
            (viscous, windage) = (found.viscous.value, found.windage.value);
        }
        // An error of R_s or of the inverter's voltage is power too.
        let at_most = magnetizing.last().map_or(0.0, |p| {
            let power =
                self.still.stator_resistance_ohm.half_width * p.current_a + 1.3 * self.still.inverter_voltage_v.half_width;
            power * p.current_a / (self.omega_half() * p.flux_vs * self.omega_half() * p.flux_vs)
        });
        // So is what the knee of the inverter's curve takes of it, U_d (2/π) I_0²/i ln(4i/I_0): found at standstill, where the ripple of the current is another.
        let knee = match (magnetizing.first(), magnetizing.last()) {
            (Some(least), Some(most)) => {
                let (a, i_0) = (least.current_a, self.bridge.zero_crossing_current_a.value().min(least.current_a));
                let power = self.still.inverter_voltage_v.value * core::f64::consts::FRAC_2_PI * i_0 * i_0 / a
                    * Scalar::ln(4.0 * a / i_0);
                let omega = self.omega_half();
                power / (omega * omega * (most.flux_vs * most.flux_vs - least.flux_vs * least.flux_vs))
            }
            _ => 0.0,
        };
        let at_most = at_most + if knee > 0.0 { knee } else { 0.0 };
        let iron = if conductance.value > 0.0 { conductance.value } else { 0.0 };
        let Mechanics { inertia, viscous, coulomb, windage } = Mechanics::of(&self.mechanics, iron).ok_or(none)?;
        let conductance = Found { half_width: conductance.half_width + at_most, ..conductance };
        let points = magnetizing.iter().all(|p| p.flux_vs.is_finite() && p.flux_vs > 0.0 && p.current_a > 0.0);
        // A shaft that does not turn shows another flux than the drive's own.
        let z = self.plan.omega_rad_s() / self.plan.impedance_ohm();
        let plausible = l_m.value * z > 0.2 && l_m.value * z < 50.0 && l_m.value > 0.4 * self.still.magnetizing_inductance_h;
        if points && plausible {
            // What the torque is wrong by, inertia and friction are: flux and R_r's part in it.
            let scale = l_m.tolerance() + 0.01;
            let wider = |f: Found| Found { half_width: f.half_width + scale * f.value.abs(), ..f };
            Ok(WhileTurning {
                magnetizing_inductance_h: l_m,
                magnetizing,
                inertia_kg_m2: wider(inertia),
                viscous_friction_nm_s_per_rad: wider(viscous),
                coulomb_friction_nm: wider(coulomb),
                windage_nm_s2: wider(windage),
                iron_conductance_s: conductance,
                voltage_offset_v: self.voltage_offset(offset_a),
            })
        } else {
            Err(none)
        }
    }

    /// u_0 where the machine turns: what u* + u_0 is short of R_s i in the mean, at the two levels that are long enough. An offset of the sensors that is not known moves the
    /// inverter's curve by what goes as U_d/|i|: taken off by what both differ in, which is also what it is uncertain by.
    fn voltage_offset(&self, offset_a: f64) -> [Found; 2] {
        let (Some(least), Some(most)) = (self.levels.first(), self.levels.last()) else { return self.still.voltage_offset_v };
        let [i_a, i_b] = [least, most].map(|l| Scalar::sqrt(norm2(l.i)));
        let of = |still: Found, a: f64, b: f64| Found {
            value: still.value - (b * i_b - a * i_a) / (i_b - i_a),
            half_width: (a - b).abs() + offset_a * self.still.stator_resistance_ohm.value,
        };
        let [alpha, beta] = self.still.voltage_offset_v;
        let found = [of(alpha, least.steady_v.re, most.steady_v.re), of(beta, least.steady_v.im, most.steady_v.im)];
        if found.iter().any(Found::is_seen) { found } else { found.map(|f| Found { value: 0.0, ..f }) }
    }

    /// ω_s of the no-load run, rad/s.
    fn omega_half(&self) -> f64 {
        NO_LOAD_SPEED * self.plan.omega_rad_s()
    }
}
