//! The next test: among safe manoeuvres, the one that best separates what is still open.
//!
//! Each manoeuvre is simulated with the refined machine; the signatures of the open effects in it, with everything a refit can do
//! projected out, say how large an effect would be found and how far two rivals lie apart.

use im_identify::offline::{Experiment, FitError, FitOptions, base_parameters, fit};
use im_model::simulation::{Scenario, Simulation};
use im_model::{EffectId, MotorFile, Recording};
use rayon::prelude::*;

use crate::residuals::nudged;
use crate::search::Options;
use crate::search::score::{Score, ScoreContext, closest};

/// What the machine and its supply may be asked to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Largest phase current, peak, over the rated one.
    pub current: f64,
    /// Largest speed over the synchronous one.
    pub speed: f64,
    /// Largest load torque over the rated one.
    pub torque: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { current: 2.5, speed: 1.1, torque: 0.8 }
    }
}

/// A manoeuvre with what it would show.
#[derive(Clone, Debug)]
pub struct Proposal {
    /// Short name.
    pub name: &'static str,
    /// What to do, in a sentence.
    pub what: &'static str,
    /// The scenario, as `scenario.toml`.
    pub scenario_toml: String,
    /// For every open effect: smallest size that would be found over its largest usual size; below one it can be seen.
    pub detectable: Vec<(EffectId, f64)>,
    /// Smallest angle between the signatures of two open effects, degrees: 0 is the same, 90 as different as can be.
    pub angle_deg: f64,
    /// Largest phase current, peak, A, and speed, rad/s, in the simulation.
    pub reaches: (f64, f64),
    /// What it is worth: larger is better.
    pub merit: f64,
    /// Voltage, load and speed over time, as simulated.
    pub profile: Vec<ProfileTrace>,
}

/// Proposals within the limits, best first.
///
/// `open` are the effects in question: rivals to be separated, or effects that the recordings so far could not show. `noise` is that
/// of the currents, A, and of the speed, rad/s.
///
/// # Errors
/// A machine whose own simulation cannot be fitted.
pub fn propose(motor: &MotorFile, open: &[EffectId], noise: (f64, f64), limits: &Limits) -> Result<Vec<Proposal>, FitError> {
    let mut proposals: Vec<Proposal> = manoeuvres(motor, noise, limits)
        .into_par_iter()
        .filter_map(|(name, what, toml)| proposal(motor, open, noise, limits, name, what, toml))
        .collect();
    proposals.sort_by(|a, b| b.merit.total_cmp(&a.merit));
    Ok(proposals)
}

fn proposal(
    motor: &MotorFile,
    open: &[EffectId],
    noise: (f64, f64),
    limits: &Limits,
    name: &'static str,
    what: &'static str,
    toml: String,
) -> Option<Proposal> {
    let scenario = Scenario::parse(&toml, name, std::path::Path::new(".")).ok()?;
    // The open effects are switched off in the machine that is moved: their signatures are what is asked for.
    let mut effects = *motor.machine.effects();
    for &e in open {
        effects.switch_off(e);
    }
    effects.rescale(&motor.rating, motor.machine.parameters(), motor.machine.pole_pairs());
    let machine = motor.machine.with_effects(effects).ok()?;
    let run = Simulation::new(&machine, &scenario).run().ok()?;
    let r = &run.recording;
    let rated = motor.rating.current_peak_a(machine.parameters(), machine.pole_pairs());
    let current = r.i_s.iter().map(|i| i.norm()).fold(0.0, f64::max);
    let speed = r.omega_m.iter().fold(0.0f64, |m, w| m.max(w.abs()));
    let top = motor.rating.synchronous_speed_rad_s(machine.pole_pairs());
    if !(current <= limits.current * rated && speed <= limits.speed * top) {
        return None;
    }
    let experiments: Vec<Experiment> = nudged(&[Experiment::from_recording(r, [noise.0; 2], noise.1)]);
    let free = base_parameters(&machine);
    let fitted = fit(&machine, &experiments, &free, &FitOptions { iterations: 3, ..FitOptions::near() }).ok()?;
    let level = Options::default().significance / machine.effects().ids().count() as f64;
    let context = ScoreContext::new(&fitted.machine, &fitted.starts, &experiments, &motor.rating, &free, level);
    let scores: Vec<Score> = open.par_iter().filter_map(|&e| context.score(e, None)).collect();
    let detectable: Vec<(EffectId, f64)> = scores
        .iter()
        .map(|s| {
            let info = &s.effect.parameters()[crate::search::score::strengths(s.effect)[0]];
            let usual = info.typical.1 * motor.rating.unit_of(info.scale, machine.parameters(), machine.pole_pairs());
            (s.effect, s.detectable / usual)
        })
        .collect();
    let mut angle_deg = 90.0f64;
    for (k, a) in scores.iter().enumerate() {
        for b in &scores[k + 1..] {
            angle_deg = angle_deg.min(closest(a, b).min(1.0).acos().to_degrees());
        }
    }
    // Worth: how far below its usual size the worst open effect would still be found, and, of rivals, apart from the other.
    let worst = detectable.iter().map(|(_, x)| *x).fold(0.0, f64::max);
    let apart = if scores.len() > 1 { angle_deg.to_radians().sin() } else { 1.0 };
    let merit = if detectable.is_empty() { 0.0 } else { apart / worst.max(1e-9) };
    Some(Proposal {
        name,
        what,
        scenario_toml: toml,
        detectable,
        angle_deg,
        reaches: (current, speed),
        merit,
        profile: profile(r),
    })
}

/// One commanded signal of a test.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileTrace {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Time in s, value.
    pub points: Vec<[f64; 2]>,
}

/// The manoeuvre over time, in as many points as a small picture shows.
fn profile(r: &Recording) -> Vec<ProfileTrace> {
    let stride = (r.len() / 300).max(1);
    let trace = |name: &str, unit: &str, value: &dyn Fn(usize) -> f64| ProfileTrace {
        name: name.into(),
        unit: unit.into(),
        points: (0..r.len()).step_by(stride).map(|k| [r.time_s(k), value(k)]).collect(),
    };
    let mut out =
        vec![trace("phase voltage, peak", "V", &|k| r.u_s[k].norm()), trace("mechanical speed", "rad/s", &|k| r.omega_m[k])];
    if let Some(load) = &r.tau_load {
        out.push(trace("load torque", "Nm", &|k| load[k]));
    }
    out
}

/// The manoeuvres, written for the machine's rating.
fn manoeuvres(motor: &MotorFile, noise: (f64, f64), limits: &Limits) -> Vec<(&'static str, &'static str, String)> {
    let r = &motor.rating;
    let p = motor.machine.parameters();
    let (u, f) = (r.phase_voltage_peak_v, r.electrical_frequency_hz);
    let boost = 0.8 * p.stator_resistance_ohm * r.current_peak_a(p, motor.machine.pole_pairs());
    let torque = limits.torque * r.torque_nm;
    // A ramp that takes about rated torque to follow.
    let ramp = (0.6 * r.torque_nm / p.inertia_kg_m2 * f64::from(motor.machine.pole_pairs()) / std::f64::consts::TAU).min(6.0 * f);
    let vhz = |name: &str, seconds: f64, sample: f64, level: f64, reference: &str, load: &str, boost: f64| {
        format!(
            "[scenario]\nname = \"{name}\"\nduration_s = {seconds}\nsample_time_s = {sample:e}\n\n[volts_per_hertz]\nvoltage_peak_v = {:.4}\n\
             frequency_hz = {f}\nboost_v = {boost:.4}\nramp_hz_per_s = {ramp:.3}\nreference_hz = {reference}\n\n[load]\ntorque_nm = {load}\n\n\
             [sensors]\ncurrent_noise_a = {:e}\nspeed_noise_rad_s = {:e}\nseed = 1\n",
            u * level,
            noise.0,
            noise.1
        )
    };
    let hz = |x: f64| format!("{:.3}", x * f);
    let t = |x: f64| format!("{:.3}", x * torque);
    vec![
        (
            "load_steps",
            "Run up to 80 % speed on volts per hertz, step the load up and down, and come back to 30 %.",
            vhz(
                "load steps",
                3.0,
                1e-4,
                1.0,
                &format!("[[0, {0}], [1.9, {0}], [1.9, {1}]]", hz(0.8), hz(0.3)),
                &format!("[[0, 0], [1.0, 0], [1.0, {0}], [1.5, {0}], [1.5, 0], [2.5, 0], [2.5, {0}]]", t(0.7)),
                boost,
            ),
        ),
        (
            "reversals",
            "Reverse slowly through standstill, twice, without load.",
            vhz(
                "reversals",
                4.0,
                1e-4,
                1.0,
                &format!("[[0, {0}], [1.2, {0}], [1.2, -{0}], [2.6, -{0}], [2.6, {0}]]", hz(0.25)),
                "0",
                boost,
            ),
        ),
        (
            "flux_low",
            "Run at 60 % speed with the voltage at 60 %, without load and with a small one.",
            vhz(
                "low flux",
                3.0,
                1e-4,
                0.6,
                &format!("[[0, {}]]", hz(0.6)),
                &format!("[[0, 0], [1.8, 0], [1.8, {}]]", t(0.2)),
                boost,
            ),
        ),
        (
            "flux_high",
            "Run at 45 % speed with the voltage at 120 %, without load and with load.",
            vhz(
                "high flux",
                3.0,
                1e-4,
                1.2,
                &format!("[[0, {}]]", hz(0.45)),
                &format!("[[0, 0], [1.8, 0], [1.8, {}]]", t(0.5)),
                boost,
            ),
        ),
        (
            "slow_loaded",
            "Creep at 12 % speed under load steps.",
            vhz(
                "slow and loaded",
                3.0,
                1e-4,
                1.0,
                &format!("[[0, {}]]", hz(0.12)),
                &format!("[[0, 0], [1.0, 0], [1.0, {0}], [2.0, {0}], [2.0, {1}]]", t(0.4), t(0.2)),
                1.25 * boost,
            ),
        ),
        (
            "direct_start",
            "Switch on directly at half voltage and full frequency: all slips from standstill to running.",
            format!(
                "[scenario]\nname = \"direct start\"\nduration_s = 3.0\nsample_time_s = 1e-4\n\n[mains]\nvoltage_peak_v = {:.4}\n\
                 frequency_hz = {f}\nclosing_s = 0.02\n\n[sensors]\ncurrent_noise_a = {:e}\nspeed_noise_rad_s = {:e}\nseed = 1\n",
                0.4 * u,
                noise.0,
                noise.1
            ),
        ),
        (
            "heat_run",
            "Hold a high load at 20 % speed for 40 s, with half a second of no load every ten.",
            vhz(
                "heat run",
                40.0,
                5e-4,
                1.0,
                &format!("[[0, {}]]", hz(0.2)),
                &format!(
                    "[[0, 0], [1, 0], [1, {0}], [10, {0}], [10, 0], [11, 0], [11, {0}], [20, {0}], [20, 0], [21, 0], [21, {0}], [30, {0}], [30, 0], [31, 0], [31, {0}]]",
                    t(0.6)
                ),
                1.25 * boost,
            ),
        ),
    ]
}
