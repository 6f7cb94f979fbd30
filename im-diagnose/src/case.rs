//! What is to be explained: a motor as its papers give it, recordings to learn from, and one held out.

use std::collections::BTreeMap;

use im_identify::offline::{Channel, Experiment, Start, guess_start, start_on};
use im_model::{EffectId, Machine, MotorFile, Recording, State};
use rayon::prelude::*;

use crate::intake::mapping::Begin;
use crate::intake::quality::voltage_noise::{self, Rough, noise_part};
use crate::intake::quality::{supply, switched};
use crate::intake::{Intake, LoadPlan};
use crate::noise::{step_sigma, white_sigma};
use crate::residuals::{all_residuals, nudged};
use crate::statistics::median;

/// A run with how it begins and what is known of its load.
pub type Run = (Experiment, Begin, LoadPlan);

/// A motor with its recordings.
#[derive(Clone, Debug)]
pub struct Case {
    /// The motor as it is known: the starting point.
    pub motor: MotorFile,
    /// Recordings to fit and diagnose with.
    pub train: Vec<Experiment>,
    /// A recording that no fit sees.
    pub holdout: Option<Experiment>,
}

impl Case {
    /// Size of the supply's voltage over the rated one, in the first recording that is on a steady one.
    pub fn supply(&self) -> Option<f64> {
        self.train.iter().find_map(|e| supply::of_rated(&self.motor, e))
    }

    /// Whether the way of recording takes an effect out of every run.
    pub fn rules_out(&self, effect: EffectId) -> bool {
        let mut runs = self.runs().peekable();
        runs.peek().is_some() && runs.all(|e| e.inert == Some(effect))
    }

    fn runs(&self) -> impl Iterator<Item = &Experiment> {
        self.train.iter().filter(|e| !e.is_table())
    }

    /// All recordings, that which is held out the last.
    pub fn all(&self) -> impl Iterator<Item = &Experiment> {
        self.train.iter().chain(&self.holdout)
    }

    /// Whether the mains feed the machine in every recording.
    pub fn is_on_mains(&self) -> bool {
        let mut recordings = self.runs().peekable();
        recordings.peek().is_some() && recordings.all(|e| supply::is_mains(&self.motor, e))
    }

    /// From canonical recordings, the load of those without a torque unknown; the noise of each sensor is estimated from all of them together.
    pub fn new(motor: MotorFile, train: &[Recording], holdout: Option<&Recording>) -> Self {
        let run = |r: &Recording| {
            let load = if r.tau_load.is_none() { LoadPlan::Unknown } else { LoadPlan::Known };
            let mut e = Experiment::from_recording(r, [1.0, 1.0], 1.0);
            e.voltage_noise = voltage_noise::of_recording(&motor, &e, &e.u_s, &[]);
            (e, Begin::Auto, load)
        };
        let (train, holdout) = (train.iter().map(run).collect(), holdout.map(run));
        Self::of(motor, train, holdout)
    }

    /// From recordings as they were taken in; the noise of each sensor is estimated from all of them together.
    pub fn from_intake(motor: MotorFile, train: Vec<Intake>, holdout: Option<Intake>) -> Self {
        let run = |i: Intake| (i.experiment, i.begin, i.load);
        Self::of(motor, train.into_iter().map(run).collect(), holdout.map(run))
    }

    /// From runs, with how each begins and what is known of its load.
    pub fn of(motor: MotorFile, train: Vec<Run>, holdout: Option<Run>) -> Self {
        let (begins, plans): (Vec<Begin>, Vec<LoadPlan>) = train.iter().chain(&holdout).map(|r| (r.1, r.2)).unzip();
        let mut case = Self { motor, train: train.into_iter().map(|r| r.0).collect(), holdout: holdout.map(|r| r.0) };
        case.estimate_noise();
        for (e, begin) in case.train.iter_mut().chain(&mut case.holdout).zip(begins) {
            e.start = match (begin, guess_start(e)) {
                (Begin::AtRest, _) => Start::Rest,
                (Begin::InMotion, Start::Rest) => Start::Estimated(State::default()),
                (_, guess) => guess,
            };
        }
        case.load_plans(plans)
    }

    /// Loads every run as is known of it. How it starts must have been seen before: an unknown load takes the speed out of what is compared.
    fn load_plans(mut self, plans: Vec<LoadPlan>) -> Self {
        let count = self.train.len();
        let motor = &self.motor;
        let apply = |(e, plan): (Experiment, &LoadPlan)| plan.apply(e, motor);
        self.train = self.train.into_par_iter().zip(&plans[..count]).map(apply).collect();
        self.holdout = self.holdout.map(|e| plans[count].apply(e, motor));
        self
    }

    /// Sets the noise of every channel from the roughness of a fit's residuals on `fitted`, all runs together.
    pub fn set_noise_from(&mut self, fitted: &[Experiment], residuals: &[Vec<Vec<f64>>]) {
        // A table has no roughness.
        let runs = fitted.iter().zip(residuals).filter(|(e, _)| !e.is_table());
        let rough: Vec<(&str, f64)> = runs
            .flat_map(|(e, r)| e.channels.iter().zip(r))
            .map(|(c, r)| {
                let used: Vec<f64> = r.iter().enumerate().filter(|(k, _)| c.is_valid(*k)).map(|(_, v)| *v).collect();
                (c.name.as_str(), (c.sigma * white_sigma(&used)).max(step_sigma(&valid_values(c))))
            })
            .collect();
        let sampled = self.train.iter_mut().chain(&mut self.holdout).filter(|e| !e.is_table());
        for c in sampled.flat_map(|e| &mut e.channels) {
            let mut found: Vec<f64> = rough.iter().filter(|(n, _)| *n == c.name).map(|(_, s)| *s).collect();
            let usual = median(&mut found);
            // A residual cannot be rougher than the sensor: the smaller of both estimates.
            if usual > 0.0 {
                c.sigma = c.sigma.min(usual);
            }
        }
    }

    /// Counts errors as a diagnosis does whose fit is `machine`: the noise of every sensor is the roughness of what it leaves, and where the load is
    /// unknown, what the noise of the speed does to its currents is noise, too.
    pub fn judge_by(&mut self, machine: &Machine<f64>) {
        let runs = nudged(&self.train);
        let starts: Vec<State<f64>> = runs.par_iter().map(|e| start_on(machine, e, &self.motor.rating)).collect();
        let left = all_residuals(machine, &starts, &runs);
        self.set_noise_from(&runs, &left);
        self.settle_voltages(machine, (&runs, &starts), &left);
        let by = |(e, x): (Experiment, &State<f64>)| e.with_inputs_by(machine, x);
        self.train = std::mem::take(&mut self.train).into_par_iter().zip(&starts).map(by).collect();
    }

    /// Takes for voltage what of its roughness the currents follow, by what `machine` leaves of the training recordings, `fitted` from `starts`; the rest
    /// is noise, and the mains are taken from behind it. Switches that closed between two samples close where the currents say.
    pub fn settle_voltages(
        &mut self,
        machine: &Machine<f64>,
        (fitted, starts): (&[Experiment], &[State<f64>]),
        residuals: &[Vec<Vec<f64>>],
    ) {
        let runs = fitted.par_iter().zip(starts);
        self.train.par_iter_mut().zip(runs).for_each(|(e, run)| switched::settle(e, machine, run));
        // Where it begins is only asked where something was switched.
        if let Some(h) = self.holdout.as_mut().filter(|h| !h.voltage_noise.volts.switched.is_empty()) {
            let (run, start) = (h.clone(), start_on(machine, h, &self.motor.rating));
            switched::settle(h, machine, (&run, &start));
        }
        // Mains are found once.
        let is_open = |e: &Experiment| e.voltage_noise.volts.taken_v == 0.0 && e.shows_voltage_noise(machine);
        let of = |e: &Experiment| is_open(e).then(|| Rough::of(&self.motor, e)).flatten();
        let rough: Vec<Option<Rough>> = fitted.par_iter().chain(&self.holdout).map(of).collect();
        let part = noise_part(machine, (fitted, starts), residuals, &rough);
        for (e, rough) in self.train.iter_mut().chain(&mut self.holdout).zip(&rough) {
            rough.iter().for_each(|r| r.leave(e, part));
        }
        // One bench, one measure: where it is too much in one recording, it is counted in none.
        if self.all().any(|e| e.is_voltage_too_noisy(machine)) {
            let others = self.train.iter_mut().chain(&mut self.holdout).filter(|e| !e.is_voltage_too_noisy(machine));
            others.for_each(|e| e.voltage_noise.volts.sigma_v = 0.0);
        }
    }

    /// Sets the noise of every channel from the data: the median over the recordings that have it.
    pub fn estimate_noise(&mut self) {
        // A table has no roughness: what its instruments are good for is said with it.
        let sampled = self.all().filter(|e| !e.is_table());
        let channels: Vec<&Channel> = sampled.flat_map(|e| &e.channels).collect();
        let rough = |c: &&Channel| {
            let values = valid_values(c);
            (c.name.clone(), white_sigma(&values).max(step_sigma(&values)))
        };
        let rough: Vec<(String, f64)> = channels.par_iter().map(rough).collect();
        let mut found: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        rough.into_iter().for_each(|(name, sigma)| found.entry(name).or_default().push(sigma));
        let usual: BTreeMap<&str, f64> = found.iter_mut().map(|(name, all)| (name.as_str(), median(all))).collect();
        let sampled = self.train.iter_mut().chain(&mut self.holdout).filter(|e| !e.is_table());
        for c in sampled.flat_map(|e| &mut e.channels) {
            c.sigma = usual[c.name.as_str()].max(1e-9);
        }
    }
}

fn valid_values(c: &Channel) -> Vec<f64> {
    c.values.iter().enumerate().filter(|(k, _)| c.is_valid(*k)).map(|(_, v)| *v).collect()
}
