//! A drive without a speed sensor whose observer has gains with a proof, made by `im design` for speeds from 10 to 60 rad/s, braking included:
//!
//!     im design example-region kubota-loop > region.toml
//!     im design kubota-loop --motor examples/motor.toml --region region.toml -o gains.toml --rust im-control/examples/designed_gains/gains.rs
//!     cargo run --release -p im-control --example designed_gains -- designed_gains.svg

use im_chart::{Panel, Series, panels};
use im_control::commissioning::bench;
use im_control::modulation::DeadTimeCompensation;
use im_control::{DriveLimits, FieldOriented, FieldOrientedGains, MachineData, Reports, Sensorless};
use im_model::MotorFile;
use im_model::simulation::{Inverter, Load, Profile, References, Scenario, Simulation, Source};
use im_observers::{Basis, Kubota};

mod gains;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let motor = MotorFile::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/motor.toml"))?;
    let (machine, rating, rig) = (motor.machine, motor.rating, bench(&motor));
    let Inverter::CarrierPwm(pwm, bridge) = &rig.inverter else { return Err("the bench switches".into()) };
    let rated_a = rating.current_peak_a(machine.parameters(), machine.pole_pairs());
    let (flux, period_s) = (0.9, 2.0 * pwm.half_period_s);

    let data = MachineData::of(&machine, 1.5 * rated_a);
    let controller = FieldOriented::try_new(&data, &FieldOrientedGains::typical(&data, flux, rig.sample_time_s))?;
    let observer = Kubota::try_new(Basis::try_new(&machine, &rating, rig.sample_time_s)?, gains::kubota_loop::GAINS)?;
    let limits = DriveLimits::generous(&data, rating.synchronous_speed_rad_s(machine.pole_pairs()), flux);
    let drive = Sensorless::try_new(controller, observer, &data, &limits, rig.sample_time_s)?;
    let mut drive = drive.compensating(&DeadTimeCompensation::of(bridge, period_s, 0.03 * rated_a))?;

    let torque = 0.8 * rating.torque_nm;
    let references = References {
        speed_rad_s: Profile::points([[0.0, 0.0], [0.5, 0.0], [1.0, 55.0], [3.0, 55.0], [4.0, 15.0]])?,
        rotor_flux_vs: flux.into(),
        torque_nm: 0.0.into(),
    };
    let scenario = Scenario {
        source: Source::Controller { name: "designed".into(), observer: None, references: references.clone() },
        // It carries the load, then the load drives it.
        load: Load { torque_nm: Profile::points([[1.5, 0.0], [1.6, torque], [2.2, torque], [2.4, -torque]])?, ..rig.load },
        duration_s: 6.0,
        ..rig
    };
    let run = Simulation::new(&machine, &scenario).controlled_by(&mut drive).run()?.recording;
    let over_time = |f: &dyn Fn(usize) -> f64| (0..run.len()).step_by(20).map(|k| (run.time_s(k), f(k))).collect::<Vec<_>>();
    let last = run.len() - 1;
    println!("{:.1} of {:.1} rad/s in the end; {}", run.omega_m[last], references.at(run.time_s(last)).omega_m, drive.status());
    if let Some(path) = std::env::args().nth(1) {
        let wanted = Series::line("wanted", over_time(&|k| references.at(run.time_s(k)).omega_m));
        let speeds = Panel::new("speed, rad/s", [Series::line("true", over_time(&|k| run.omega_m[k])), wanted]);
        let current = Panel::new("current, A", [Series::line("length", over_time(&|k| run.i_s[k].norm()))]);
        std::fs::write(path, panels("Gains with a proof: start, load, braking at 15 rad/s", "time, s", &[speeds, current]))?;
    }
    Ok(())
}
