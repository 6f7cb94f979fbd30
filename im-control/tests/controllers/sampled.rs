//! Field orientation where samples are few and voltage is short: the regulator of sampled time, and overmodulation.

use im_control::{FieldOriented, FieldOrientedGains, MachineData};
use im_model::machines::{self, NamedMachine};
use im_model::simulation::{Inverter, Load, Profile, References, Run, Scenario, Simulation, Source};
use im_model::{Effects, Machine};

const M: NamedMachine = machines::MOTULATOR_2_2_KW;
const DC_V: f64 = 540.0;

fn machine(delay_s: f64) -> (Machine<f64>, MachineData<f64>) {
    let mut e = Effects::none();
    e.voltage_delay.delay_s = delay_s;
    let machine = Machine::try_new(M.parameters(), M.pole_pairs, e).unwrap();
    let current = 1.5 * M.rating.current_peak_a(&M.parameters(), M.pole_pairs);
    (machine, MachineData::of(&machine, current).delayed(delay_s))
}

fn points(p: &[[f64; 2]]) -> Profile {
    Profile::points(p).unwrap()
}

/// Speed held by a test bench, torque asked for from 0.5 s on.
fn torque_run(
    machine: &Machine<f64>,
    drive: &mut FieldOriented<f64>,
    speed: f64,
    torque: f64,
    t: f64,
    dc: f64,
) -> (Run, Vec<f64>) {
    let s = Scenario {
        source: Source::Controller {
            name: "field_oriented".into(),
            observer: None,
            references: References {
                speed_rad_s: 0.0.into(),
                rotor_flux_vs: M.rating.rotor_flux_vs.into(),
                torque_nm: points(&[[0.0, 0.0], [0.5, 0.0], [0.55, torque]]),
            },
        },
        inverter: Inverter::Averaged { dc_voltage_v: Some(dc) },
        imposed_speed: Some(speed.into()),
        load: Load { torque_nm: 0.0.into(), quadratic_nm_s2: 0.0 },
        sample_time_s: t,
        ..Scenario::direct_on_line(0.0, 50.0, 1.5)
    };
    let run = Simulation::new(machine, &s).controlled_by(drive).with_internals().run().unwrap();
    let torque = run.internals.as_ref().unwrap().torque_nm.clone();
    (run, torque)
}

/// Rms of the torque less its reference over the last 0.3 s; infinite where the current left its limit.
fn torque_error(discrete: bool, samples_per_turn: f64) -> f64 {
    let (t, torque) = (5e-4, 8.0);
    let (machine, known) = machine(t);
    let gains = FieldOrientedGains { follows_torque: true, ..FieldOrientedGains::typical(&known, M.rating.rotor_flux_vs, t) };
    let gains = if discrete { gains.discrete(t) } else { gains };
    let mut drive = FieldOriented::try_new(&known, &gains).unwrap();
    let speed = std::f64::consts::TAU / (samples_per_turn * t) / f64::from(M.pole_pairs);
    // The link gives the voltage that this frequency takes: it is about the samples.
    let dc = 3.0 * M.rating.rotor_flux_vs * speed * f64::from(M.pole_pairs);
    let (run, shown) = torque_run(&machine, &mut drive, speed, torque, t, dc);
    let n = shown.len();
    let peak = run.recording.i_s.iter().fold(0.0f64, |p, i| p.max(i.norm()));
    if peak > 1.5 * known.current_max_a {
        return f64::INFINITY;
    }
    (shown[n - 600..].iter().map(|x| (x - torque).powi(2)).sum::<f64>() / 600.0).sqrt()
}

/// A sample of delay, 500 µs. What is left with few samples is the current model's error between them.
#[test]
fn ten_samples_for_a_turn_of_the_field_are_enough_for_the_law_of_sampled_time() {
    let table = [40.0, 20.0, 14.0, 10.0].map(|n| [false, true].map(|discrete| torque_error(discrete, n)));
    println!("{table:.2?}");
    for row in table {
        assert!(row[1] < 0.8 && row[1] < 0.35 * row[0], "{table:?}");
    }
}

/// At twice the rated speed: a sixth more torque than the circle gives.
#[test]
fn overmodulation_gives_the_torque_of_its_voltage() {
    let (machine, known) = machine(0.0);
    let [circle, beyond] = [false, true].map(|over| {
        let gains =
            FieldOrientedGains { follows_torque: true, ..FieldOrientedGains::typical(&known, M.rating.rotor_flux_vs, 1e-4) };
        let gains = if over { gains.overmodulating() } else { gains };
        let mut drive = FieldOriented::try_new(&known, &gains).unwrap();
        let (run, torque) = torque_run(&machine, &mut drive, 300.0, 100.0, 1e-4, DC_V);
        let peak = run.recording.i_s[9000..].iter().fold(0.0f64, |p, i| p.max(i.norm()));
        assert!(peak < 1.4 * known.current_max_a, "{peak} of {}", known.current_max_a);
        torque[12_000..].iter().sum::<f64>() / (torque.len() - 12_000) as f64
    });
    println!("{circle} {beyond}");
    assert!(beyond > 1.1 * circle, "{circle} {beyond}");
}
