//! A drive without a speed sensor finds its machine, then starts, carries 80 % of the rated load and reverses. Everything follows from the nameplate and the commissioning.
//!
//!     cargo run --release -p im-control --example sensorless -- sensorless.svg

use im_chart::{Panel, Series, panels};
use im_control::Reports;
use im_control::commissioning::{bench, commission};
use im_model::machines::MOTULATOR_2_2_KW as M;
use im_model::simulation::{Load, Profile, References, Scenario, Simulation, Source};
use im_model::{Machine, MotorFile};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let machine = Machine::base(M.parameters(), M.pole_pairs)?;
    let (torque, speed) = (M.rating.torque_nm, M.rating.synchronous_speed_rad_s(M.pole_pairs));
    // Inverter with dead time, sensors with noise.
    let motor = MotorFile::new(M.name, machine, M.rating);
    let rig = bench(&motor);
    let commissioned = commission(&motor, &rig, &mut |_, _| ())?;
    let found = commissioned.outcome?;
    println!("found by its own drive, with half the width of the interval, and what the simulated machine has:");
    for c in commissioned.comparisons(&found, &machine, &rig.inverter) {
        println!("{:8} {:.4} ± {:.4} {}, true {:.4}", c.symbol, c.found.value, c.found.half_width, c.unit, c.truth);
    }
    let mut drive = found.drive(&commissioned.plan)?;

    let references = References {
        speed_rad_s: Profile::points([[0.0, 0.0], [0.3, 0.0], [0.8, 0.8 * speed], [2.0, 0.8 * speed], [3.0, -0.8 * speed]])?,
        rotor_flux_vs: M.rating.rotor_flux_vs.into(),
        torque_nm: 0.0.into(),
    };
    let scenario = Scenario {
        source: Source::Controller { name: "sensorless".into(), observer: None, references: references.clone() },
        load: Load {
            torque_nm: Profile::points([[1.2, 0.0], [1.2, 0.8 * torque], [1.8, 0.8 * torque], [1.8, 0.0]])?,
            ..rig.load
        },
        duration_s: 4.0,
        ..rig
    };
    let run = Simulation::new(&machine, &scenario).controlled_by(&mut drive).run()?.recording;
    let over_time = |f: &dyn Fn(usize) -> f64| (0..run.len()).step_by(20).map(|k| (run.time_s(k), f(k))).collect::<Vec<_>>();
    let speeds = [
        Series::line("true", over_time(&|k| run.omega_m[k])),
        Series::line("wanted", over_time(&|k| references.at(run.time_s(k)).omega_m)),
    ];
    let current = Series::line("length of the current", over_time(&|k| run.i_s[k].norm()));
    let last = run.len() - 1;
    println!("{:.1} of {:.1} rad/s in the end; {}", run.omega_m[last], references.at(run.time_s(last)).omega_m, drive.status());
    if let Some(path) = std::env::args().nth(1) {
        let parts = [Panel::new("speed, rad/s", speeds), Panel::new("current, A", [current])];
        std::fs::write(path, panels("Without a speed sensor: start, 80 % of rated load, reversal", "time, s", &parts))?;
    }
    Ok(())
}
