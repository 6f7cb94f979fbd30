//! The next test: among safe manoeuvres, the one that best separates what is still open.
//!
//! Each manoeuvre is simulated with the refined machine; the signatures of the open effects in it, with everything a refit can do
//! projected out, say how large an effect would be found and how far two rivals lie apart.

use im_identify::offline::{Experiment, FitError, FitOptions, base_parameters_in, fit};
use im_model::simulation::{Scenario, Simulation};
use im_model::{EffectId, Machine, MotorFile, Recording};
use rayon::prelude::*;
use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::diagnosis::{NOT_EXCITED, SUSPECTED};
use crate::format::number;
use crate::intake::LoadPlan;
pub use crate::manoeuvres::{Limits, Supply};
use crate::manoeuvres::{Manoeuvre, manoeuvres, rounded};
use crate::residuals::nudged;
use crate::search::score::{Score, ScoreContext, closest};
use crate::search::{Options, needed_to_tell_apart};

/// A manoeuvre with what it would show.
#[derive(Clone, Debug)]
pub struct Proposal {
    /// Short name.
    pub name: &'static str,
    /// What to do, in a sentence.
    pub what: String,
    /// The scenario, as `scenario.toml`.
    pub scenario_toml: String,
    /// For every open effect: smallest size that would be found over its largest usual size; below one it can be seen, infinite where a refit
    /// imitates it.
    pub detectable: Vec<(EffectId, f64)>,
    /// Smallest angle between the signatures of two open effects that it shows, degrees: 0 is the same, 90 as different as can be.
    pub angle_deg: f64,
    /// From which size on, over its largest usual size, every open effect is told from every other: infinite where none is.
    pub told_apart: f64,
    /// Largest phase current, peak, A, and speed, rad/s, of all machines that the test must be safe for.
    pub reaches: (f64, f64),
    /// The limits of both.
    pub limits: (f64, f64),
    /// How long it takes, s.
    pub duration_s: f64,
    /// What it is worth: larger is better.
    pub merit: f64,
    /// Voltage, load and speed over time, as simulated.
    pub profile: Vec<ProfileTrace>,
}

/// Why a proposal is not the test on an effect's card.
pub const WHY: &str = "Of the manoeuvres that are safe for this motor, this one shows best what is open, all of it at once, and tells it \
                       apart best; the test on an effect's card (im effects show NAME) is for that effect alone.";

impl Proposal {
    /// Why it may be shorter than the tests on the cards of the effects that it shows, where it is.
    pub fn why_so_short(&self) -> Option<String> {
        let longer = |e: &EffectId| self.duration_s < 60.0 && e.card().test.contains("a minute");
        let seen: Vec<&str> =
            self.detectable.iter().filter(|(e, x)| *x < 1.0 && longer(e)).map(|(e, _)| e.card().title).collect();
        (!seen.is_empty()).then(|| {
            format!(
                "{}: the minute on the card shows the drift to the eye. A fit that knows its form tells it from the noise within the {} s \
                 of this test, from the size said above.",
                seen.join(", "),
                rounded(self.duration_s)
            )
        })
    }
}

impl Proposal {
    /// Whether rivals are told apart, in a sentence.
    pub fn tells_apart(&self) -> String {
        let lie = format!("their marks in it lie {:.0} degrees apart, of 90", self.angle_deg);
        if self.told_apart < 1.0 {
            format!(
                "It tells the rivals apart from {} % of their largest usual sizes on ({lie}).",
                number(100.0 * self.told_apart, 2)
            )
        } else {
            format!("It does not tell the rivals apart at any usual size ({lie}): the tests on their cards are for each alone.")
        }
    }
}

/// An effect that is found from so many times its largest usual size on is worth as little as one that is not.
const NOT_SEEN: f64 = 1e3;

/// Proposals within the limits that show something of what is open, best first: no manoeuvre leaves them on any of the machines `safe_for`
/// ([`worst_case::machines`](crate::worst_case::machines)).
///
/// `open` are the effects in question: rivals to be separated, or effects that the recordings so far could not show. `sensing` is what will be
/// measured.
///
/// # Errors
/// A machine whose own simulation cannot be fitted.
pub fn propose(
    motor: &MotorFile,
    open: &[EffectId],
    sensing: Sensing,
    limits: &Limits,
    safe_for: &[Machine<f64>],
) -> Result<Vec<Proposal>, FitError> {
    let mut proposals: Vec<Proposal> = manoeuvres(motor, (sensing.current_a, sensing.speed_rad_s), limits)
        .into_par_iter()
        .filter_map(|m| proposal(motor, open, sensing, limits, safe_for, m))
        .collect();
    // What no manoeuvre shows is no reason to prefer one.
    let shows = |p: &Proposal, e: EffectId| p.detectable.iter().any(|(x, size)| *x == e && size.is_finite());
    let shown: Vec<EffectId> = open.iter().copied().filter(|&e| proposals.iter().any(|p| shows(p, e))).collect();
    for p in &mut proposals {
        // Worth: how far below its usual size the worst open effect would still be found, and, of rivals, apart from the other.
        let worst = p.detectable.iter().filter(|(e, _)| shown.contains(e)).map(|(_, x)| x.min(NOT_SEEN)).fold(0.0, f64::max);
        p.merit = p.angle_deg.to_radians().sin() / worst.max(1e-9);
    }
    proposals.retain(|p| p.detectable.iter().any(|(_, size)| size.is_finite()));
    proposals.sort_by(|a, b| b.merit.total_cmp(&a.merit));
    Ok(proposals)
}

/// The effects of a `diagnosis.json` that have rivals, and these.
pub fn rivals(diagnosis: &Value) -> Vec<EffectId> {
    let named = |name: &Value| EffectId::from_name(name.as_str()?);
    let all = diagnosis["alternatives"].as_object().into_iter().flatten();
    let of = |(name, rivals): (&String, &Value)| {
        let rivals: Vec<EffectId> = rivals.as_array().into_iter().flatten().filter_map(named).collect();
        let own = EffectId::from_name(name).filter(|_| !rivals.is_empty());
        own.into_iter().chain(rivals).collect::<Vec<_>>()
    };
    all.flat_map(of).collect()
}

/// What a `diagnosis.json` left open: effects with rivals and their rivals; without any, those that the recordings could not show.
pub fn open_after(diagnosis: &Value) -> Vec<EffectId> {
    let open = rivals(diagnosis);
    if !open.is_empty() {
        return open;
    }
    let concludes = |c: &&Value| {
        let unsettled = [NOT_EXCITED, SUSPECTED];
        c["conclusion"].as_str().is_some_and(|s| unsettled.iter().any(|u| s.starts_with(u)))
    };
    let ranking = diagnosis["ranking"].as_array().into_iter().flatten();
    ranking.filter(concludes).filter_map(|c| EffectId::from_name(c["effect"].as_str()?)).collect()
}

/// What a bench measures in a test.
#[derive(Clone, Copy, Debug)]
pub struct Sensing {
    /// Noise of the currents, A.
    pub current_a: f64,
    /// Noise of the speed, rad/s.
    pub speed_rad_s: f64,
    /// What is known of load and speed.
    pub load: LoadPlan,
}

impl Sensing {
    /// As is usual for a motor, load and speed measured; after a `diagnosis.json`, the noise that it found, and no more sensors than it had.
    pub fn after(motor: &MotorFile, diagnosis: Option<&Value>) -> Self {
        let rated = motor.rating.current_peak_a(motor.machine.parameters(), motor.machine.pole_pairs());
        let noise = |k: &str| diagnosis.and_then(|d| d["noise"][k].as_f64());
        let found: Vec<&Value> =
            diagnosis.into_iter().flat_map(|d| d["loads"]["found"].as_array().into_iter().flatten()).collect();
        let lacks = |what: &str| found.iter().any(|f| f[what].is_array());
        let load = match (lacks("omega_m_rad_s"), lacks("torque_nm")) {
            (true, _) => LoadPlan::Unseen,
            (false, true) => LoadPlan::Unknown,
            _ => LoadPlan::Known,
        };
        let (current_a, speed_rad_s) = (noise("i_alpha_A").unwrap_or(0.003 * rated), noise("omega_m_rad_s").unwrap_or(0.1));
        Self { current_a, speed_rad_s, load }
    }
}

/// What `im next-test --json` prints of proposals, best first.
pub fn to_json(open: &[EffectId], proposals: &[Proposal]) -> Value {
    let names: Vec<&str> = open.iter().map(|e| e.name()).collect();
    let Some(best) = proposals.first() else { return json!({"schema": 1, "open": names, "test": null, "others": []}) };
    let seen: Map<_, _> = best.detectable.iter().map(|(e, x)| (e.name().to_owned(), json!(x))).collect();
    let others = proposals.iter().skip(1).map(|p| json!({"name": p.name, "what": p.what, "merit": p.merit / best.merit}));
    json!({
        "schema": 1, "open": names, "others": others.collect::<Vec<_>>(),
        "test": {
            "name": best.name, "what": best.what, "duration_s": best.duration_s, "why_so_short": best.why_so_short(), "peak_current_a": best.reaches.0, "peak_speed_rad_s": best.reaches.1,
            "limit_current_a": best.limits.0, "limit_speed_rad_s": best.limits.1,
            "detectable_over_usual": seen, "angle_deg": best.angle_deg, "told_apart_over_usual": best.told_apart.is_finite().then_some(best.told_apart), "scenario_toml": best.scenario_toml,
        },
    })
}

/// Largest current and speed of machines in a scenario; `None` where a simulation runs away.
fn reached<'a>(machines: impl IntoParallelIterator<Item = &'a Machine<f64>>, scenario: &Scenario) -> Option<(f64, f64)> {
    let of = |machine: &Machine<f64>| {
        let r = Simulation::new(machine, scenario).run().ok()?.recording;
        let current = r.i_s.iter().map(|i| i.norm()).fold(0.0, f64::max);
        Some((current, r.omega_m.iter().fold(0.0f64, |m, w| m.max(w.abs()))))
    };
    let larger = |a: (f64, f64), b: (f64, f64)| Some((a.0.max(b.0), a.1.max(b.1)));
    machines.into_par_iter().map(of).try_reduce(|| (0.0, 0.0), larger)
}

fn proposal(
    motor: &MotorFile,
    open: &[EffectId],
    sensing: Sensing,
    limits: &Limits,
    safe_for: &[Machine<f64>],
    manoeuvre: Manoeuvre,
) -> Option<Proposal> {
    let Manoeuvre { name, what, scenario } = manoeuvre;
    let scenario_toml = scenario.to_toml()?;
    // The open effects are switched off in the machine that is moved: their signatures are what is asked for.
    let machine = motor.machine.without(open.iter().copied()).and_then(|m| m.rescaled(&motor.rating)).ok()?;
    let run = Simulation::new(&machine, &scenario).run().ok()?;
    let r = &run.recording;
    let rated = motor.rating.current_peak_a(machine.parameters(), machine.pole_pairs());
    let most = (limits.current * rated, limits.speed * motor.rating.synchronous_speed_rad_s(machine.pole_pairs()));
    let all: Vec<Machine<f64>> = safe_for.iter().copied().chain([machine]).collect();
    let reaches = reached(&all, &scenario)?;
    if !(reaches.0 <= most.0 && reaches.1 <= most.1) {
        return None;
    }
    let recorded = Experiment::from_recording(r, [sensing.current_a; 2], sensing.speed_rad_s);
    let experiments: Vec<Experiment> = nudged(&[sensing.load.apply(recorded, motor)]);
    let free = base_parameters_in(&machine, &experiments);
    let fitted = fit(&machine, &experiments, &free, &FitOptions { iterations: 3, ..FitOptions::near() }).ok()?;
    let level = Options::default().significance.get() / machine.effects().ids().count() as f64;
    let context = ScoreContext::new(&fitted.machine, &fitted.starts, &experiments, &motor.rating, &free, level);
    let scores: Vec<Score> = open.par_iter().filter_map(|&e| context.score(e, None)).collect();
    let mut detectable: Vec<(EffectId, f64)> = scores
        .iter()
        .map(|s| {
            let info = &s.effect.parameters()[crate::search::score::strengths(s.effect)[0]];
            let usual = info.typical.1 * motor.rating.unit_of(info.scale, machine.parameters(), machine.pole_pairs());
            // What a refit imitates all but wholly is not seen, whatever its slopes say.
            (s.effect, if s.is_excited() { s.detectable / usual } else { f64::INFINITY })
        })
        .collect();
    // Without a score it leaves no mark.
    let scored = |e: EffectId| scores.iter().any(|s| s.effect == e);
    detectable.extend(open.iter().filter(|e| !scored(**e)).map(|&e| (e, f64::INFINITY)));
    let samples = experiments.iter().map(Experiment::count).sum::<usize>() as f64;
    let (mut angle_deg, mut told_apart) = (90.0f64, 0.0f64);
    for (k, a) in scores.iter().enumerate() {
        for (l, b) in scores.iter().enumerate().skip(k + 1) {
            let angle = closest(a, b).min(1.0).acos();
            if detectable[k].1.is_finite() && detectable[l].1.is_finite() {
                angle_deg = angle_deg.min(angle.to_degrees());
            }
            // χ² grows with the square of the size; what is not found is not told either.
            let needed = |s: &Score| (needed_to_tell_apart(angle.sin().powi(2), samples) / s.chi2_detectable).sqrt().max(1.0);
            told_apart = told_apart.max(needed(a) * detectable[k].1).max(needed(b) * detectable[l].1);
        }
    }
    if open.len() > scores.len() && open.len() > 1 {
        told_apart = f64::INFINITY;
    }
    Some(Proposal {
        name,
        what,
        scenario_toml,
        detectable,
        angle_deg,
        told_apart,
        reaches,
        limits: most,
        duration_s: scenario.duration_s,
        merit: 0.0,
        profile: profile(r),
    })
}

/// One commanded signal of a test.
#[derive(Clone, Debug, PartialEq, Serialize)]
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

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::{Machine, Rating, machines};

    const PLAIN: Sensing = Sensing { current_a: 0.01, speed_rad_s: 0.1, load: LoadPlan::Known };

    fn motor() -> MotorFile {
        let named = machines::ALL[0];
        let machine = Machine::base(named.parameters(), named.pole_pairs).unwrap();
        MotorFile::new(named.name, machine, Rating::guess(machine.parameters(), named.pole_pairs))
    }

    fn any() -> Limits {
        Limits { current: 20.0, speed: 2.0, ..Limits::default() }
    }

    #[test]
    fn a_short_test_of_what_drifts_says_why_it_suffices() {
        let motor = motor();
        let said = |e: EffectId| {
            let all = propose(&motor, &[e], PLAIN, &any(), &[]).unwrap();
            all.iter().map(|p| (p.detectable[0].1 < 1.0, p.why_so_short())).collect::<Vec<_>>()
        };
        let heating = said(EffectId::StatorHeating);
        assert!(heating.iter().any(|(seen, _)| *seen) && heating.iter().all(|(seen, why)| why.is_some() == *seen), "{heating:?}");
        assert!(said(EffectId::IronLoss).iter().all(|(_, why)| why.is_none()));
    }

    /// A voltage gain and a current gain are the same in every recording; iron loss and main-flux saturation part wherever the flux moves.
    #[test]
    fn a_test_says_whether_it_tells_rivals_apart() {
        let motor = motor();
        let told = |rivals: [EffectId; 2]| propose(&motor, &rivals, PLAIN, &any(), &[]).unwrap();
        let same = told([EffectId::VoltageGain, EffectId::CurrentSensorGain]);
        assert!(
            same.iter().all(|p| p.tells_apart().starts_with("It does not")),
            "{:?}",
            same.iter().map(|p| p.told_apart).collect::<Vec<_>>()
        );
        let apart = told([EffectId::IronLoss, EffectId::MainFluxSaturation]);
        assert!(apart[0].told_apart < 0.5 && apart[0].tells_apart().starts_with("It tells"), "{:?}", apart[0].told_apart);
        assert!(apart[0].told_apart >= apart[0].detectable.iter().map(|d| d.1).fold(0.0, f64::max));
    }

    /// What a bench lacked in its recordings it lacks in the next one.
    #[test]
    fn a_test_is_planned_with_the_sensors_that_there_are() {
        let motor = motor();
        let after = |found: Value| Sensing::after(&motor, Some(&json!({"noise": {}, "loads": {"found": found}}))).load;
        assert_eq!(after(json!([])), LoadPlan::Known);
        assert_eq!(after(json!([{"recording": "a", "torque_nm": [1.0]}])), LoadPlan::Unknown);
        assert_eq!(after(json!([{"recording": "a", "omega_m_rad_s": [1.0]}])), LoadPlan::Unseen);
        let sees = |load| {
            let all = propose(&motor, &[EffectId::Windage], Sensing { load, ..PLAIN }, &any(), &[]).unwrap();
            all.iter().any(|p| p.detectable.iter().any(|d| d.1 < 1.0))
        };
        assert!(sees(LoadPlan::Known) && !sees(LoadPlan::Unknown), "windage is no part of a load that nobody knows");
        let none = propose(&motor, &[EffectId::Windage], Sensing { load: LoadPlan::Unknown, ..PLAIN }, &any(), &[]).unwrap();
        assert!(none.is_empty(), "a test that shows nothing is none");
    }
}
