//! The drive for what was found.

use im_model::{Complex, Machine, Scalar, TParameters};
use im_observers::{Basis, FullOrder, FullOrderGains, Limits};

use super::fit::Found;
use super::result::{Commissioned, CommissioningPlan};
use crate::modulation::DeadTimeCompensation;
use crate::{ControlError, DriveLimits, FieldOriented, FieldOrientedGains, MachineData, Sensorless};

/// Field orientation with the speed of the full-order observer.
pub type CommissionedDrive<T> = Sensorless<T, FieldOriented<T>, FullOrder<T>>;

/// The knee of a compensation, over the rated current: narrower, noise would switch the whole amount back and forth.
const SOFTEST: f64 = 0.03;

/// Leakage for fast changes over that for slow ones, from which on the observer's flux is the better one.
const FLUX_FROM: f64 = 0.8;

/// How fast the observer is over the current loop, and over the sampling: what ω̂ lags by is then less than the current loop does. A shaft with a resonance swings on the
/// speed loop where the lags of both make a quarter of a turn at its frequency, wherever the resonance is too sharp to be lost in the gain: with as much again for the
/// observer between 30 and 90 Hz, with a quarter of it nowhere from 15 to 100 Hz. The noise of ω̂ stays below a hundredth of rated torque in the loop.
const OBSERVED: f64 = 4.0;
const OBSERVED_SAMPLE: f64 = 0.3;

/// What distinguishes the drive of a commissioning from the one after it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Use {
    pub follows_torque: bool,
    pub learns_stator_resistance: bool,
    /// The shaft is loaded, and sped up with all of the current.
    pub is_loaded: bool,
    /// The least flux at which the speed is followed, over that of the plan.
    pub least_flux: f64,
}

/// K, s: where a fast change of current meets `lacking_h` = ΔL less than the observer expects, the current changes faster than the voltage explains, which is taken for speed,
/// n_pω̃ = −(ΔL/ψ) sF i_q with F = (λ/2)²/(s + λ/2)². The speed loop of bandwidth a answers with more current, i_q = −2aJ/(1.5 n_pψ) ω̃ through the current loop α/(s + α):
/// a loop that feeds itself,
///
/// 1 = K sF α/(s + α),   K = 2aJΔL/(1.5 n_p²ψ²),   stable for K < 1/α + 4/λ − 1/(α + λ)
///
/// With λ = 2/K it has half of that or less.
fn fed_by_itself_s(plan: &CommissioningPlan, speed_bandwidth_rad_s: f64, inertia_kg_m2: f64, lacking_h: f64) -> f64 {
    let (n_p, flux) = (f64::from(plan.pole_pairs), plan.rating.rotor_flux_vs);
    2.0 * speed_bandwidth_rad_s * inertia_kg_m2 * lacking_h / (1.5 * n_p * n_p * flux * flux)
}

/// Typical gains for a machine; `inverter` is what dead time and devices take, V, and the current at which 71 % of it is taken, A.
pub(super) fn drive<T: Scalar>(
    plan: &CommissioningPlan,
    parameters: TParameters<f64>,
    skin_effect: Option<[Found; 2]>,
    inverter: [f64; 2],
    purpose: Use,
) -> Result<CommissionedDrive<T>, ControlError> {
    let (f, rating) = (T::from_f64, &plan.rating);
    let machine = Machine::base(low_slip(parameters, skin_effect), plan.pole_pairs)?;
    // What changes fast meets the leakage without the bars' part: with gains for the larger one every loop would be faster than meant by as much.
    let fast = parameters.inverse_gamma().leakage_inductance_h / machine.parameters().inverse_gamma().leakage_inductance_h;
    let (flux, t) = (f(rating.rotor_flux_vs), f(plan.sample_time_s));
    let data: MachineData<T> = MachineData::of(&machine, plan.current_max_a).delayed(plan.voltage_delay_s).cast();
    let typical = FieldOrientedGains::typical(&data, flux, t);
    let mut gains = FieldOrientedGains {
        current_bandwidth_rad_s: typical.current_bandwidth_rad_s * f(fast),
        // K at the least flux is then that of the plan's.
        speed_bandwidth_rad_s: typical.speed_bandwidth_rad_s * f(purpose.least_flux * purpose.least_flux),
        follows_torque: purpose.follows_torque,
        ..typical
    };
    let mut observed = FullOrderGains::for_machine(&machine, rating);
    let [current, t_s] = [typical.current_bandwidth_rad_s.value(), plan.sample_time_s];
    let lacking_h = (1.0 - fast).max(0.0) * machine.parameters().inverse_gamma().leakage_inductance_h;
    let fed_s = if purpose.follows_torque {
        0.0
    } else {
        fed_by_itself_s(plan, typical.speed_bandwidth_rad_s.value(), parameters.inertia_kg_m2, lacking_h)
    };
    observed.current_bandwidth_rad_s = if fast < FLUX_FROM && !purpose.is_loaded {
        // What a current's change meets is not what the observer expects, and it is taken for speed. Nothing speeds the shaft up that a slow observer would lag behind, and
        // what swings of the current take is iron loss here.
        fast * observed.current_bandwidth_rad_s.max(fast * current)
    } else {
        let fastest = fast * (OBSERVED * current).min(OBSERVED_SAMPLE / t_s);
        fastest.min((2.0 / fed_s).max(fast * current))
    };
    // The same as the flux is weakened: K as the observer bears it.
    if fed_s > 0.0 {
        let per_bandwidth_s = fed_s / typical.speed_bandwidth_rad_s.value() * rating.rotor_flux_vs * rating.rotor_flux_vs;
        gains.speed_bandwidth_per_flux2 = Some(f(2.0 / (observed.current_bandwidth_rad_s * per_bandwidth_s)));
    }
    observed.speed_bandwidth_rad_s = 0.5 * observed.current_bandwidth_rad_s;
    if !purpose.learns_stator_resistance {
        observed.stator_resistance_per_s = 0.0;
    }
    let limits = DriveLimits::generous(&data, f(rating.synchronous_speed_rad_s(plan.pole_pairs)), flux);
    // The observer goes as far as the drive does.
    let seen = Limits { speed_max_rad_s: limits.speed_range_rad_s.value(), ..Limits::of(&machine, rating) };
    let observer = FullOrder::try_new(Basis::try_new(&machine, rating, plan.sample_time_s)?.with_limits(seen)?, observed)?;
    let drive = Sensorless::try_new(FieldOriented::try_new(&data, &gains)?, observer, &data, &limits, t)?;
    // With such bars its flux is off with every change of current, too.
    let drive = if fast < FLUX_FROM { drive.with_flux_of_controller() } else { drive };
    let lost = dead_time(plan, inverter);
    if lost.drop_v > T::zero() { drive.compensating(&lost) } else { Ok(drive) }
}

/// The dead-time curve as found: volts, and the current at which 71 % of them is taken, A.
fn dead_time<T: Scalar>(plan: &CommissioningPlan, [lost_v, soft_a]: [f64; 2]) -> DeadTimeCompensation<T> {
    let f = T::from_f64;
    DeadTimeCompensation {
        dead_time_s: T::zero(),
        switching_period_s: f(plan.sample_time_s),
        drop_v: f(lost_v),
        on_resistance_ohm: T::zero(),
        soft_current_a: f(soft_current_a(plan, soft_a)),
    }
}

/// The knee of the compensation, A.
pub(super) fn soft_current_a(plan: &CommissioningPlan, found_a: f64) -> f64 {
    found_a.max(SOFTEST * plan.rated_current_a)
}

/// What the flux follows, at low slip frequency: there the bars add kR_rτ to the rotor's leakage.
fn low_slip(p: TParameters<f64>, skin_effect: Option<[Found; 2]>) -> TParameters<f64> {
    let added = skin_effect.map_or(0.0, |[k, tau]| k.value * p.rotor_resistance_ohm * tau.value);
    TParameters { rotor_leakage_inductance_h: p.rotor_leakage_inductance_h + added, ..p }
}

impl Commissioned {
    /// The sensorless drive of this machine: typical gains, the dead-time curve compensated, the offsets of sensors and inverter taken off, unlike phases known to the observer, R_s learnt while it runs; it follows speed. The plan's current limit and
    /// rotor flux are the drive's; L_m is that of the magnetizing curve at this flux.
    ///
    /// # Errors
    /// A value that no drive can be made of.
    pub fn drive<T: Scalar>(&self, plan: &CommissioningPlan) -> Result<CommissionedDrive<T>, ControlError> {
        let inverter = [self.inverter_voltage_v.value, self.inverter_current_a.value];
        let drive = drive(
            plan,
            self.parameters_at(plan.rating.rotor_flux_vs),
            self.skin_effect,
            inverter,
            Use { follows_torque: false, learns_stator_resistance: true, is_loaded: true, least_flux: 1.0 },
        )?;
        let complex = |z: [Found; 2]| {
            let [alpha, beta] = z.map(|f| T::from_f64(f.value));
            Complex::new(alpha, beta)
        };
        drive
            .with_current_offset(complex(self.current_offset_a))?
            .with_voltage_offset(complex(self.voltage_offset_v))?
            .with_resistance_asymmetry(complex(self.resistance_asymmetry_ohm))
    }
}
