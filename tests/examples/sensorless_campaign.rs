//! The sensorless drive on random machines with effects that it does not know: commissioned, rated torque at 1 Hz and a slow reversal through zero with R_s +20 %.
//!
//!     cargo run --release -p im-tests --example sensorless_campaign -- FIRST..END [known]
//!
//! Nameplates from 0.4 to 75 kW with one to four pole pairs. Hidden: up to 30 % of saturation, up to 1 % of rated voltage that dead time takes, iron loss, dry friction and windage, on
//! every third machine deep bars, noise of the current; a sample of delay, which the drive knows. The machine is commissioned cold (`im_control::Commissioning`, 0.4 % of noise); the drive
//! gets what was found, dead-time curve included, and then the machine with R_s 20 % larger. With `known` nothing is commissioned: R_r, L_m (of the flux at which it works) and L_ls are within 5 % and
//! dead time takes up to 0.3 %, not compensated, with no other effect.
//! What it has to hold: `im_tests::slow_reversal`.

use std::collections::BTreeMap;

use im_control::commissioning::{CommissionedDrive, Comparison, commission};
use im_control::{CommissioningPlan, DriveLimits, FieldOriented, FieldOrientedGains, MachineData, Reports, Sensorless};
use im_model::effects::Hooks;
use im_model::simulation::{Inverter, Load, References, Scenario, Sensors, Simulation, Source};
use im_model::{Effects, Machine, MotorFile, Nameplate, Rating, TParameters};
use im_observers::{Basis, FullOrder, FullOrderGains};
use im_tests::slow_reversal::{MEAN_S, SlowReversal};

const H: f64 = 1e-4;
type Failure = Box<dyn std::error::Error>;

/// Numbers between bounds, the same for a seed everywhere (SplitMix64).
struct Draw(u64);

impl Draw {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        low + (high - low) * ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A machine as a catalogue has it: efficiency and power factor grow with size, slip falls.
fn machine(draw: &mut Draw) -> Result<(Machine<f64>, Rating), Failure> {
    let (size, spread, pairs) = (draw.between(0.0, 1.0), draw.between(-1.0, 1.0), draw.between(1.0, 5.0).floor());
    let power_w = 400.0 * (75_000.0f64 / 400.0).powf(size);
    let efficiency = 0.70 + 0.24 * size + 0.01 * spread;
    let power_factor = 0.74 + 0.13 * size + 0.02 * spread - 0.02 * (pairs - 1.0);
    let nameplate = Nameplate {
        power_w,
        line_voltage_rms_v: 400.0,
        line_current_rms_a: power_w / (3f64.sqrt() * 400.0 * efficiency * power_factor),
        speed_rpm: 3000.0 / pairs * (1.0 - 0.07 + 0.055 * size - 0.005 * spread),
        frequency_hz: 50.0,
        power_factor,
        ..Nameplate::default()
    };
    let guess = nameplate.guess()?;
    Ok((Machine::base(guess.parameters, guess.pole_pairs)?, guess.rating))
}

/// What a trial showed.
#[derive(Default)]
struct Trial {
    /// Why control was lost, and how.
    lost: Option<(&'static str, String)>,
    /// What was found beside what the machine has.
    found: Vec<Comparison>,
}

/// The drive of a machine that is known to 5 %.
fn known(
    base: &Machine<f64>,
    truth: &Machine<f64>,
    plan: &CommissioningPlan,
    draw: &mut Draw,
) -> Result<CommissionedDrive<f64>, Failure> {
    let working = plan.rating.rotor_flux_vs;
    let p = *base.parameters();
    // The inductance of the flux at which it works.
    let chord_h = p.magnetizing_inductance_h / truth.effects().main_flux_saturation.reluctance((1.0, 0.0), working * working).0;
    let parameters = TParameters {
        stator_resistance_ohm: p.stator_resistance_ohm / 1.2,
        rotor_resistance_ohm: p.rotor_resistance_ohm * draw.between(0.95, 1.05),
        magnetizing_inductance_h: chord_h * draw.between(0.95, 1.05),
        stator_leakage_inductance_h: p.stator_leakage_inductance_h * draw.between(0.95, 1.05),
        ..p
    };
    let known = Machine::base(parameters, base.pole_pairs())?;
    let data = MachineData::of(&known, plan.current_max_a).delayed(H);
    let controller = FieldOriented::try_new(&data, &FieldOrientedGains::typical(&data, working, H))?;
    let gains = FullOrderGains::for_machine(&known, &plan.rating);
    let observer = FullOrder::try_new(Basis::try_new(&known, &plan.rating, H)?, gains)?;
    let speed = plan.rating.synchronous_speed_rad_s(plan.pole_pairs);
    Ok(Sensorless::try_new(controller, observer, &data, &DriveLimits::generous(&data, speed, working), H)?)
}

/// The drive of the machine commissioned with a cold winding.
fn commissioned(
    truth: &Machine<f64>,
    plan: &CommissioningPlan,
    seed: u64,
    trial: &mut Trial,
) -> Result<Option<CommissionedDrive<f64>>, Failure> {
    let p = truth.parameters();
    let cold = truth.with_parameters(TParameters { stator_resistance_ohm: p.stator_resistance_ohm / 1.2, ..*p })?;
    let rated = plan.rated_current_a;
    let motor = MotorFile::new("random", cold, plan.rating);
    let bench = Scenario {
        inverter: Inverter::Averaged { dc_voltage_v: Some(1.05 * 3f64.sqrt() * plan.rating.phase_voltage_peak_v) },
        sensors: Sensors { current_noise_a: 0.004 * rated, current_step_a: 0.002 * rated, seed, ..Sensors::default() },
        load: Load { torque_nm: 0.0.into(), quadratic_nm_s2: 0.0 },
        record_every: 1000,
        ..Scenario::direct_on_line(1.0, 50.0, 1.0)
    };
    let done = commission(&motor, &bench, &mut |_, _| ())?;
    match done.outcome {
        Ok(found) => {
            trial.found = done.comparisons(&found, &motor.machine, &bench.inverter);
            Ok(Some(found.drive(plan)?))
        }
        Err(fault) => {
            trial.lost = Some(("commissioning", fault.to_string()));
            Ok(None)
        }
    }
}

fn trial(seed: u64, by_commissioning: bool) -> Result<Trial, Failure> {
    let mut draw = Draw(seed);
    let (base, rating) = machine(&mut draw)?;
    let (p, pairs) = (*base.parameters(), base.pole_pairs());
    let mut trial = Trial::default();
    let mut e = Effects::scaled(&rating, &p, pairs);
    e.main_flux_saturation.excess = draw.between(0.0, 0.3);
    e.inverter_nonlinearity.voltage_v =
        draw.between(0.0, if by_commissioning { 0.01 } else { 0.003 }) * rating.phase_voltage_peak_v;
    e.voltage_delay.delay_s = H;
    let (flux, speed, rated) =
        (0.95 * rating.rotor_flux_vs, rating.synchronous_speed_rad_s(pairs), rating.current_peak_a(&p, pairs));
    let plan = CommissioningPlan::of(Rating { rotor_flux_vs: flux, ..rating }, rated, pairs, H).delayed(H);
    let plan = CommissioningPlan { current_max_a: 1.6 * rated, ..plan };
    let (truth, mut drive) = if by_commissioning {
        e.iron_loss.conductance_s = draw.between(0.0, 0.03) * rated / rating.phase_voltage_peak_v;
        e.coulomb_friction.torque_nm = draw.between(0.0, 0.02) * rating.torque_nm;
        e.windage.coefficient_nm_s2 = draw.between(0.0, 0.02) * rating.torque_nm / (speed * speed);
        if seed.is_multiple_of(3) {
            let bars = &mut e.rotor_skin_effect;
            (bars.resistance_rise, bars.time_constant_s) = (draw.between(0.2, 2.0), draw.between(1e-3, 5e-3));
        }
        let truth = base.with_effects(e)?;
        let Some(drive) = commissioned(&truth, &plan, seed, &mut trial)? else { return Ok(trial) };
        (truth, drive)
    } else {
        let truth = base.with_effects(e)?;
        (truth, known(&base, &truth, &plan, &mut draw)?)
    };

    let manoeuvre = SlowReversal::of(&p, pairs, &rating, flux)?;
    let scenario = Scenario {
        source: Source::Controller {
            name: "sensorless".into(),
            observer: None,
            references: References {
                speed_rad_s: manoeuvre.speed_rad_s.clone(),
                rotor_flux_vs: flux.into(),
                torque_nm: 0.0.into(),
            },
        },
        inverter: Inverter::Averaged { dc_voltage_v: Some(3f64.sqrt() * rating.phase_voltage_peak_v) },
        load: Load { torque_nm: manoeuvre.load_nm.clone(), quadratic_nm_s2: 0.0 },
        sensors: Sensors { current_noise_a: 0.003 * rated, seed, ..Sensors::default() },
        ..Scenario::direct_on_line(1.0, 50.0, manoeuvre.duration_s())
    };
    let run = Simulation::new(&truth, &scenario).controlled_by(&mut drive).run()?.recording;
    let mean = |t: f64| {
        let (last, count) = (((t / H) as usize).min(run.len()), (MEAN_S / H) as usize);
        run.omega_m[last - count..last].iter().sum::<f64>() / count as f64
    };
    let (at, peak) =
        run.i_s.iter().enumerate().fold((0, 0.0), |(at, peak), (k, i)| if i.norm() > peak { (k, i.norm()) } else { (at, peak) });
    let held = manoeuvre.judge(manoeuvre.judged_s.map(mean), peak / plan.current_max_a);
    trial.lost = held.lost().map(|reason| {
        let how = format!(
            "{:.1} kW, {pairs} pole pairs: off by {:.1} % at 1 Hz, {:.1} % at the end, {:.2} of the current limit at {:.2} s of {:.0} s, R_s {:.2} of the true one, {}",
            1e-3 * rating.torque_nm * speed,
            100.0 * held.errors[0],
            100.0 * held.errors[1],
            held.peak,
            H * at as f64,
            manoeuvre.duration_s(),
            drive.observer_state().stator_resistance_ratio() / 1.2,
            drive.status()
        );
        (reason, how)
    });
    Ok(trial)
}

fn main() -> Result<(), Failure> {
    let range = std::env::args().nth(1).unwrap_or_else(|| "0..100".into());
    let by_commissioning = std::env::args().nth(2).is_none_or(|how| how != "known");
    let (first, end) = range.split_once("..").ok_or("seeds are FIRST..END")?;
    let seeds = first.parse::<u64>()?..end.parse::<u64>()?;
    let count = seeds.clone().count();
    let mut reasons = BTreeMap::<&str, usize>::new();
    // Of each value: found, within 5 %, covered by its interval.
    let mut values = BTreeMap::<&str, [usize; 3]>::new();
    for seed in seeds {
        let t = trial(seed, by_commissioning)?;
        if let Some((reason, how)) = t.lost {
            *reasons.entry(reason).or_default() += 1;
            println!("{seed}: {reason}: {how}");
        }
        for c in t.found {
            let counts = values.entry(c.symbol).or_default();
            counts[0] += 1;
            counts[1] += usize::from(c.error().abs() < 0.05);
            counts[2] += usize::from(c.found.covers(c.truth));
        }
    }
    println!("control kept on {} of {count} machines; lost: {reasons:?}", count - reasons.values().sum::<usize>());
    for (symbol, [found, near, covered]) in values {
        println!("{symbol:9} within 5 % on {near}, covered on {covered} of {found}");
    }
    Ok(())
}
