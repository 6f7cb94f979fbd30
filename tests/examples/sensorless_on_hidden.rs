//! The sensorless drive on machines of the hidden-effect trials: another simulator, with effects of other forms than the library's.
//!
//!     cargo run --release -p im-tests --example sensorless_on_hidden -- FIRST..END
//!
//! Each seed draws one of the eleven machines, each parameter up to 10 % off, and gives it one effect of the library, weak, medium or strong in turn: all but those of
//! speed sensors, which this drive has none of, and heating, which the trials make strong within the seconds of a recording. A sample of delay, which the drive knows, and 0.3 % of noise of the current. The machine is commissioned cold
//! (`im_control::Commissioning`); the drive gets what was found, and the machine with R_s 20 % larger. What it has to hold: `im_tests::slow_reversal`.

use std::collections::BTreeMap;
use std::error::Error;

use im_control::commissioning::CommissioningStage;
use im_control::{Commissioning, CommissioningPlan, Reports};
use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::{Complex, Rating, TParameters};
use im_tests::hidden::chance::Chance;
use im_tests::hidden::outfit::Outfit;
use im_tests::hidden::plane::Vector;
use im_tests::hidden::plant::{HiddenPlant, at};
use im_tests::hidden::run::Motion;
use im_tests::hidden::{CatalogueMachine, EffectKind, Noise, Strength, sensors::NoiseSource};
use im_tests::slow_reversal::{MEAN_S, SlowReversal};
use rayon::prelude::*;

type Failure = Box<dyn Error + Send + Sync>;

const H: f64 = 1e-4;
const NONE: Reference<f64> = Reference { omega_m: 0.0, rotor_flux_vs: 0.0, torque_nm: 0.0 };
/// The trials resolve a thousandth of the noise of their sensors; a drive needs no more than a fifth of it.
const TOLERANCE: f64 = 200.0;

/// The bench: hidden machine, inverter with a sample of delay, current sensors.
struct Bench<'a> {
    outfit: &'a Outfit,
    motion: Motion<'a>,
    noise: NoiseSource,
    dc_voltage_v: f64,
    sent: Vec<Vector>,
}

impl<'a> Bench<'a> {
    fn at_rest(m: &CatalogueMachine, outfit: &'a Outfit, dc_voltage_v: f64, chance: Chance) -> Self {
        let current = Noise::default().current * m.rated_current_a();
        Self {
            outfit,
            motion: Motion::at_rest(m, &outfit.plant).with_tolerance(TOLERANCE),
            noise: NoiseSource::new(&Noise::default(), current, 0.0, 0.0, chance),
            dc_voltage_v,
            sent: Vec::new(),
        }
    }

    fn speed(&self) -> f64 {
        self.motion.x[at::SPEED]
    }

    fn current_a(&self) -> f64 {
        HiddenPlant::stator_current(&self.motion.x).length()
    }

    fn step(&mut self, controller: &mut impl Controller<f64>, reference: &Reference<f64>, load_nm: f64) {
        let current = self.outfit.sensors.current(HiddenPlant::stator_current(&self.motion.x));
        let [alpha, beta, ..] = self.noise.corrupt([current.x, current.y, 0.0, 0.0]);
        let last = self.sent.last().copied().unwrap_or(Vector::ZERO);
        let measured = Measured {
            i_s: Complex::new(alpha, beta),
            omega_m: f64::NAN,
            u_s: Complex::new(last.x, last.y),
            dc_voltage_v: self.dc_voltage_v,
            sample_time_s: H,
        };
        let Command::Voltage(u) = controller.step(&measured, reference) else { return };
        let late = 1.0 + self.outfit.delay_samples;
        let (whole, part) = (late.floor() as usize, late - late.floor());
        self.sent.push(Vector::new(u.re, u.im));
        let k = self.sent.len() - 1;
        let sent = |back: usize| k.checked_sub(back).map_or(Vector::ZERO, |j| self.outfit.supplied(self.sent[j]));
        let (before, now) = (sent(whole + 1), sent(whole));
        if part > 0.0 {
            self.motion.advance(before, load_nm, part * H);
        }
        self.motion.advance(now, load_nm, (1.0 - part) * H);
    }
}

/// What a trial showed.
struct Trial {
    name: String,
    /// Why control was lost, and how.
    lost: Option<(&'static str, String)>,
    /// How long the commissioning took, s of drive time.
    commissioned_s: f64,
}

fn kinds() -> Vec<EffectKind> {
    use EffectKind as E;
    let acts = |k: EffectKind| k.in_library() && !k.is_thermal() && !matches!(k, E::SpeedSensorLag | E::SpeedSensorScale);
    EffectKind::ALL.iter().copied().filter(|k| acts(*k)).collect()
}

fn trial(seed: u64) -> Result<Trial, Failure> {
    let kinds = kinds();
    let index = (seed % CatalogueMachine::COUNT as u64) as usize;
    let turn = seed / CatalogueMachine::COUNT as u64;
    let kind = kinds[(turn % kinds.len() as u64) as usize];
    let strength = [Strength::Weak, Strength::Medium, Strength::Strong][(turn / kinds.len() as u64 % 3) as usize];
    let name = format!("{seed}: {kind} {strength:?} on {}", CatalogueMachine::catalogue(index).name);
    let cold = CatalogueMachine::catalogue(index).scattered(0.1, &mut Chance::new(seed, "machine"));
    let hot = CatalogueMachine { stator_resistance_ohm: 1.2 * cold.stator_resistance_ohm, ..cold.clone() };
    let rating = Rating {
        torque_nm: cold.rated_torque_nm,
        electrical_frequency_hz: cold.rated_frequency_hz,
        phase_voltage_peak_v: cold.rated_voltage_v,
        rotor_flux_vs: cold.rated_rotor_flux_vs,
    };
    let dc_voltage_v = 1.05 * 3f64.sqrt() * cold.rated_voltage_v;
    let plan = CommissioningPlan::of(rating, cold.rated_current_a(), cold.pole_pairs, H).delayed(H);

    let outfit = Outfit::new(&cold, &[(kind, strength)], seed);
    let mut bench = Bench::at_rest(&cold, &outfit, dc_voltage_v, Chance::new(seed, "noise cold"));
    let mut commissioning = Commissioning::<f64>::try_new(&plan)?;
    while commissioning.stage() != CommissioningStage::Done {
        bench.step(&mut commissioning, &NONE, 0.0);
    }
    let commissioned_s = commissioning.drive_time_s();
    let found = match commissioning.outcome().ok_or("a commissioning that is done has an outcome")? {
        Ok(found) => *found,
        Err(fault) => return Ok(Trial { name, lost: Some(("commissioning", fault.to_string())), commissioned_s }),
    };

    let flux = 0.95 * rating.rotor_flux_vs;
    let plan =
        CommissioningPlan { rating: Rating { rotor_flux_vs: flux, ..rating }, current_max_a: 1.6 * plan.rated_current_a, ..plan };
    let parameters = TParameters {
        stator_resistance_ohm: hot.stator_resistance_ohm,
        rotor_resistance_ohm: hot.rotor_resistance_ohm,
        stator_leakage_inductance_h: hot.stator_leakage_h,
        rotor_leakage_inductance_h: hot.rotor_leakage_h,
        magnetizing_inductance_h: hot.magnetizing_h,
        inertia_kg_m2: hot.inertia_kg_m2,
        viscous_friction_nm_s_per_rad: hot.friction_nm_s,
    };
    let manoeuvre = SlowReversal::of(&parameters, hot.pole_pairs, &rating, flux)?;
    let outfit = Outfit::new(&hot, &[(kind, strength)], seed);
    let mut bench = Bench::at_rest(&hot, &outfit, dc_voltage_v, Chance::new(seed, "noise hot"));
    let mut drive = found.drive::<f64>(&plan)?;
    let samples = (manoeuvre.duration_s() / H) as usize;
    let mut sums = [0.0; 2];
    let mut peak = 0.0f64;
    for k in 0..samples {
        let t = k as f64 * H;
        let reference = Reference { omega_m: manoeuvre.speed_rad_s.at(t), rotor_flux_vs: flux, torque_nm: 0.0 };
        bench.step(&mut drive, &reference, manoeuvre.load_nm.at(t));
        peak = peak.max(bench.current_a());
        for (sum, end) in sums.iter_mut().zip(manoeuvre.judged_s) {
            if (end - MEAN_S..end).contains(&t) {
                *sum += bench.speed() * H / MEAN_S;
            }
        }
    }
    let held = manoeuvre.judge(sums, peak / plan.current_max_a);
    let how = format!(
        "off by {:.1} % at 1 Hz, {:.1} % at the end, {:.2} of the current limit, R_s {:.3} of the true one, {}",
        100.0 * held.errors[0],
        100.0 * held.errors[1],
        held.peak,
        drive.observer_state().stator_resistance_ratio() * found.stator_resistance_ohm.value / hot.stator_resistance_ohm,
        drive.status()
    );
    Ok(Trial { name, lost: held.lost().map(|reason| (reason, how)), commissioned_s })
}

fn main() -> Result<(), Failure> {
    let range = std::env::args().nth(1).unwrap_or_else(|| "0..99".into());
    let (first, end) = range.split_once("..").ok_or("seeds are FIRST..END")?;
    let seeds: Vec<u64> = (first.parse()?..end.parse()?).collect();
    let trials = seeds.par_iter().map(|&seed| trial(seed)).collect::<Result<Vec<_>, _>>()?;
    let mut reasons = BTreeMap::<&str, usize>::new();
    for t in &trials {
        if let Some((reason, how)) = &t.lost {
            *reasons.entry(reason).or_default() += 1;
            println!("{}: {reason}: {how}", t.name);
        }
    }
    let kept = trials.len() - reasons.values().sum::<usize>();
    let longest_s = trials.iter().map(|t| t.commissioned_s).fold(0.0, f64::max);
    println!("control kept on {kept} of {} machines; lost: {reasons:?}; commissioned in {longest_s:.0} s at most", trials.len());
    Ok(())
}
