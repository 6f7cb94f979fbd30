//! Effects that show while something changes.

use im_chart::{Panel, Series};
use im_model::simulation::{Load, Profile, Run, Scenario, Simulation, SimulationError, Source, Start, VoltsPerHertz};
use im_model::{EffectId, Effects, Held, Machine, Recording};

use super::{Picture, Studio, pair};

/// A signal over time, s.
type Signal = Vec<(f64, f64)>;
type Drawn = Result<Picture, Box<dyn std::error::Error>>;

/// On rated voltage and frequency, from the steady state at `before` Nm; `after` Nm from 0.1 s on.
fn loaded(s: &Studio, before: f64, after: f64, duration_s: f64) -> Result<Scenario, im_model::ModelError> {
    let r = &s.rating;
    let torque_nm = Profile::points([[0.1, before], [0.1, after]])?;
    Ok(Scenario {
        load: Load { torque_nm, ..Load::none() },
        start: Start::SteadyState(Held::Load(before)),
        ..Scenario::direct_on_line(r.phase_voltage_peak_v, r.electrical_frequency_hz, duration_s)
    })
}

fn run(machine: &Machine<f64>, scenario: &Scenario) -> Result<Run, SimulationError> {
    Simulation::new(machine, scenario).with_internals().run()
}

/// A signal over time from `from_s` on.
fn signal(run: &Run, from_s: f64, value: impl Fn(&Recording, usize) -> f64) -> Signal {
    let r = &run.recording;
    (0..r.len()).map(|k| (r.time_s(k), value(r, k))).filter(|p| p.0 >= from_s).collect()
}

/// One signal of both machines in one scenario.
fn compared(
    s: &Studio,
    scenario: &Scenario,
    from_s: f64,
    label: &str,
    set: impl FnOnce(&mut Effects<f64>),
    value: impl Fn(&Recording, usize) -> f64,
) -> Result<Vec<Panel>, Box<dyn std::error::Error>> {
    let with = s.with(set)?;
    let lines = [&s.base, &with].map(|m| run(m, scenario).map(|run| signal(&run, from_s, &value)));
    let [without, with] = lines;
    Ok(vec![pair(label, without?, with?)])
}

fn speed(r: &Recording, k: usize) -> f64 {
    r.omega_m[k]
}

fn phase_a(r: &Recording, k: usize) -> f64 {
    r.i_s[k].re
}

/// A winding whose resistance follows its temperature, at rated load; heated faster than a real one.
fn heating(
    s: &Studio,
    set: impl FnOnce(&mut Effects<f64>),
    rise: impl Fn(&Run, usize) -> f64,
) -> Result<[Signal; 2], Box<dyn std::error::Error>> {
    let scenario = Scenario { record_every: 100, ..loaded(s, 0.0, s.rating.torque_nm, 40.0)? };
    let run = run(&s.with(set)?, &scenario)?;
    Ok([signal(&run, 0.0, |_, k| rise(&run, k)), signal(&run, 0.5, speed)])
}

pub fn stator_heating(s: &Studio) -> Drawn {
    let set =
        |e: &mut Effects<f64>| (e.stator_heating.inverse_heat_capacity_k_per_j, e.stator_heating.time_constant_s) = (0.02, 15.0);
    let state = |run: &Run, k: usize| run.internals.as_ref().map_or(0.0, |x| x.states[k].extra.of(EffectId::StatorHeating)[0]);
    let [rise, _] = heating(s, set, state)?;
    let cold = s.base.parameters().stator_resistance_ohm;
    let ohm = rise.iter().map(|(t, k)| (*t, cold * (1.0 + 0.00393 * k))).collect::<Vec<_>>();
    let parts =
        vec![Panel::new("rise, K", [Series::line("winding", rise)]), Panel::new("R_s, Ω", [Series::line("resistance", ohm)])];
    Ok(("Rated load; 1/C = 0.02 K/J, τ = 15 s (sped up)", "time, s", parts))
}

pub fn rotor_heating(s: &Studio) -> Drawn {
    let set =
        |e: &mut Effects<f64>| (e.rotor_heating.inverse_heat_capacity_k_per_j, e.rotor_heating.time_constant_s) = (0.06, 15.0);
    let state = |run: &Run, k: usize| run.internals.as_ref().map_or(0.0, |x| x.states[k].extra.of(EffectId::RotorHeating)[0]);
    let [rise, speed] = heating(s, set, state)?;
    let parts =
        vec![Panel::new("rise, K", [Series::line("cage", rise)]), Panel::new("speed, rad/s", [Series::line("speed", speed)])];
    Ok(("Rated load; 1/C = 0.06 K/J, τ = 15 s (sped up)", "time, s", parts))
}

pub fn inverter_nonlinearity(s: &Studio) -> Drawn {
    let r = &s.rating;
    let supply = VoltsPerHertz {
        voltage_peak_v: r.phase_voltage_peak_v,
        frequency_hz: r.electrical_frequency_hz,
        boost_v: 12.0,
        ramp_hz_per_s: 1e3,
    };
    let scenario = Scenario {
        source: Source::VoltsPerHertz(supply, 5.0.into()),
        start: Start::SteadyState(Held::Load(0.0)),
        ..Scenario::direct_on_line(0.0, 5.0, 1.5)
    };
    let set = |e: &mut Effects<f64>| e.inverter_nonlinearity.voltage_v = 10.0;
    Ok(("5 Hz without load; U_d = 10 V", "time, s", compared(s, &scenario, 1.1, "current of phase a, A", set, phase_a)?))
}

pub fn voltage_delay(s: &Studio) -> Drawn {
    let scenario = Scenario { sample_time_s: 1e-4, ..Scenario::direct_on_line(s.rating.phase_voltage_peak_v, 50.0, 0.006) };
    let set = |e: &mut Effects<f64>| e.voltage_delay.delay_s = 3.5e-4;
    Ok(("Switched onto the supply; D = 0.35 ms", "time, s", compared(s, &scenario, 0.0, "current of phase a, A", set, phase_a)?))
}

/// The path of the current shown, over one period at rated load.
fn locus(s: &Studio, set: impl FnOnce(&mut Effects<f64>)) -> Result<Vec<Panel>, Box<dyn std::error::Error>> {
    let scenario = loaded(s, s.rating.torque_nm, s.rating.torque_nm, 0.02)?;
    let path =
        |machine: &Machine<f64>| run(machine, &scenario).map(|run| run.recording.i_s.iter().map(|i| (i.re, i.im)).collect());
    Ok(vec![pair("i_β shown, A", path(&s.base)?, path(&s.with(set)?)?)])
}

pub fn current_sensor_gain(s: &Studio) -> Drawn {
    let set = |e: &mut Effects<f64>| (e.current_sensor_gain.common, e.current_sensor_gain.unbalance_alpha) = (0.05, 0.12);
    Ok(("Rated load; g = 0.05, g_α = 0.12", "i_α shown, A", locus(s, set)?))
}

pub fn current_sensor_offset(s: &Studio) -> Drawn {
    let set = |e: &mut Effects<f64>| (e.current_sensor_offset.alpha_a, e.current_sensor_offset.beta_a) = (0.8, 0.4);
    Ok(("Rated load; i_0 = 0.8 + 0.4j A", "i_α shown, A", locus(s, set)?))
}

pub fn speed_sensor_lag(s: &Studio) -> Drawn {
    let scenario = loaded(s, 0.0, s.rating.torque_nm, 0.3)?;
    let set = |e: &mut Effects<f64>| e.speed_sensor_lag.time_constant_s = 0.01;
    Ok(("Rated load from 0.1 s; τ = 10 ms, ρ = 0.3", "time, s", compared(s, &scenario, 0.05, "speed shown, rad/s", set, speed)?))
}

pub fn stator_asymmetry(s: &Studio) -> Drawn {
    let scenario = loaded(s, s.rating.torque_nm, s.rating.torque_nm, 1.06)?;
    let set = |e: &mut Effects<f64>| e.stator_asymmetry.unbalance_alpha = 0.15;
    let length = |r: &Recording, k: usize| r.i_s[k].norm();
    Ok((
        "Rated load; δ_α = 0.15: twice the supply frequency",
        "time, s",
        compared(s, &scenario, 1.0, "length of i, A", set, length)?,
    ))
}

pub fn rotor_asymmetry(s: &Studio) -> Drawn {
    let scenario = loaded(s, s.rating.torque_nm, s.rating.torque_nm, 2.0)?;
    let set = |e: &mut Effects<f64>| e.rotor_asymmetry.unbalance_direct = 0.15;
    let length = |r: &Recording, k: usize| r.i_s[k].norm();
    Ok((
        "Rated load; δ_d = 0.15: twice the slip frequency",
        "time, s",
        compared(s, &scenario, 1.0, "length of i, A", set, length)?,
    ))
}

pub fn shaft_compliance(s: &Studio) -> Drawn {
    let scenario = loaded(s, 0.0, s.rating.torque_nm, 0.5)?;
    let set = |e: &mut Effects<f64>| e.shaft_compliance.load_inertia_fraction = 0.6;
    Ok(("Rated load from 0.1 s; f = 0.6, ω_a = 120 rad/s", "time, s", compared(s, &scenario, 0.05, "speed, rad/s", set, speed)?))
}

pub fn load_torque_ripple(s: &Studio) -> Drawn {
    let scenario = loaded(s, 7.0, 7.0, 1.2)?;
    let set = |e: &mut Effects<f64>| (e.load_torque_ripple.cosine_nm, e.load_torque_ripple.second_sine_nm) = (2.0, 1.0);
    Ok(("Half load; c₁ = 2 Nm, s₂ = 1 Nm, n = 1", "time, s", compared(s, &scenario, 1.0, "speed, rad/s", set, speed)?))
}
