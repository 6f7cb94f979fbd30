//! The sensorless drive on random machines with effects that it does not know: rated torque at 1 Hz and a slow reversal through zero.
//!
//!     cargo run --release -p im-control --example sensorless_campaign -- [FIRST..END]
//!
//! Nameplates from 0.4 to 75 kW with one to four pole pairs. The drive knows the machine as after commissioning, R_r, L_m (of the flux at which it works) and L_ls within
//! 5 %, and the R_s of then: the machine's is 20 % larger. It knows its sample of delay, and nothing of the effects: up to 30 % of saturation, 0.3 % of rated voltage that dead time takes,
//! noise of the current. From rest: up to a tenth of synchronous speed, rated torque for 5 s, in 2 s or more to 1 Hz of the stator, 4 s there, and in 2 s or more through zero to minus a tenth, which the
//! load drives.
//! Control is lost where the mean speed is not within 5 % of synchronous speed of what was asked for at 1 Hz or at the end, or the current is beyond 1.5 times its limit.

use im_control::{DriveLimits, FieldOriented, FieldOrientedGains, MachineData, Reports, Sensorless};
use im_model::effects::Hooks;
use im_model::simulation::{Inverter, Load, Profile, References, Scenario, Sensors, Simulation, Source};
use im_model::{Effects, Machine, Nameplate, Rating, TParameters};
use im_observers::{Basis, FullOrder, FullOrderGains};

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
        locked_rotor_current_ratio: None,
    };
    let guess = nameplate.guess()?;
    Ok((Machine::base(guess.parameters, guess.pole_pairs)?, guess.rating))
}

/// What is said of a machine where control was lost.
fn trial(seed: u64) -> Result<Option<String>, Failure> {
    let mut draw = Draw(seed);
    let (base, rating) = machine(&mut draw)?;
    let (p, pairs) = (*base.parameters(), base.pole_pairs());
    let mut e = Effects::scaled(&rating, &p, pairs);
    e.main_flux_saturation.excess = draw.between(0.0, 0.3);
    e.inverter_nonlinearity.voltage_v = draw.between(0.0, 0.003) * rating.phase_voltage_peak_v;
    e.voltage_delay.delay_s = H;
    let truth = base.with_effects(e)?;
    // As commissioned: the inductance of the flux at which it works.
    let working = 0.95 * rating.rotor_flux_vs;
    let chord_h = p.magnetizing_inductance_h / e.main_flux_saturation.reluctance((1.0, 0.0), working * working).0;
    let known = TParameters {
        stator_resistance_ohm: p.stator_resistance_ohm / 1.2,
        rotor_resistance_ohm: p.rotor_resistance_ohm * draw.between(0.95, 1.05),
        magnetizing_inductance_h: chord_h * draw.between(0.95, 1.05),
        stator_leakage_inductance_h: p.stator_leakage_inductance_h * draw.between(0.95, 1.05),
        ..p
    };
    let known = Machine::base(known, pairs)?;

    let (flux, speed, rated) =
        (0.95 * rating.rotor_flux_vs, rating.synchronous_speed_rad_s(pairs), rating.current_peak_a(&p, pairs));
    let data = MachineData::of(&known, 1.6 * rated).delayed(H);
    let controller = FieldOriented::try_new(&data, &FieldOrientedGains::typical(&data, flux, H))?;
    let observer = FullOrder::try_new(Basis::try_new(&known, &rating, H)?, FullOrderGains::for_machine(&known, &rating))?;
    let mut drive = Sensorless::try_new(controller, observer, &data, &DriveLimits::generous(&data, speed, flux), H)?;

    let slip = rating.torque_nm * p.rotor_resistance_ohm / (1.5 * f64::from(pairs) * flux * flux);
    let at_1_hz = (std::f64::consts::TAU - slip) / f64::from(pairs);
    let slow = 0.1 * speed;
    let (t_r, up) = (p.rotor_inductance_h() / p.rotor_resistance_ohm, (2.0 * p.inertia_kg_m2 * slow / rating.torque_nm).max(0.3));
    let on = (5.0 * t_r).clamp(0.5, 3.0) + up + 0.5;
    let ramp = (2.0 * p.inertia_kg_m2 * 2.0 * slow / rating.torque_nm).max(2.0);
    let (low, held) = (on + 5.0 + ramp, on + 9.0 + ramp);
    let end = held + ramp + 1.5;
    let magnetized = on - up - 0.5;
    let speed_rad_s = Profile::points([
        [0.0, 0.0],
        [magnetized, 0.0],
        [magnetized + up, slow],
        [on + 5.0, slow],
        [low, at_1_hz],
        [held, at_1_hz],
        [held + ramp, -slow],
    ])?;
    let scenario = Scenario {
        source: Source::Controller {
            name: "sensorless".into(),
            observer: None,
            references: References { speed_rad_s, rotor_flux_vs: flux.into(), torque_nm: 0.0.into() },
        },
        inverter: Inverter::Averaged { dc_voltage_v: Some(3f64.sqrt() * rating.phase_voltage_peak_v) },
        load: Load { torque_nm: Profile::points([[on, 0.0], [on + 0.3, rating.torque_nm]])?, quadratic_nm_s2: 0.0 },
        sensors: Sensors { current_noise_a: 0.003 * rated, seed, ..Sensors::default() },
        ..Scenario::direct_on_line(1.0, 50.0, end)
    };
    let run = Simulation::new(&truth, &scenario).controlled_by(&mut drive).run()?.recording;
    let mean = |t: f64| {
        let last = ((t / H) as usize).min(run.len());
        run.omega_m[last - 2000..last].iter().sum::<f64>() / 2000.0
    };
    let peak = run.i_s.iter().map(|i| i.norm()).fold(0.0, f64::max);
    let errors = [(mean(held) - at_1_hz) / speed, (mean(end) + slow) / speed];
    let lost = errors.iter().any(|e| e.abs() > 0.05) || peak > 1.5 * 1.6 * rated;
    Ok(lost.then(|| {
        format!(
            "{seed}: {:.1} kW, {pairs} pole pairs: off by {:.1} % at 1 Hz, {:.1} % at the end, {:.2} of the current limit, R_s {:.2} of the true one, {}",
            1e-3 * rating.torque_nm * speed,
            100.0 * errors[0],
            100.0 * errors[1],
            peak / (1.6 * rated),
            drive.observer_state().stator_resistance_ratio() / 1.2,
            drive.status()
        )
    }))
}

fn main() -> Result<(), Failure> {
    let range = std::env::args().nth(1).unwrap_or_else(|| "0..100".into());
    let (first, end) = range.split_once("..").ok_or("seeds are FIRST..END")?;
    let seeds = first.parse::<u64>()?..end.parse::<u64>()?;
    let (mut lost, count) = (0, seeds.clone().count());
    for seed in seeds {
        if let Some(what) = trial(seed)? {
            lost += 1;
            println!("{what}");
        }
    }
    println!("control kept on {} of {count} machines", count - lost);
    Ok(())
}
