//! A drive without a speed sensor: start, rated load, reversal. Everything follows from the machine, its rating and the sampling time.
//!
//!     cargo run --release -p im-control --example sensorless -- sensorless.svg

use im_chart::{Panel, Series, panels};
use im_control::{DriveLimits, FieldOriented, FieldOrientedGains, MachineData, Reports, Sensorless};
use im_model::Machine;
use im_model::machines::MOTULATOR_2_2_KW as M;
use im_model::simulation::{Inverter, Load, Profile, References, Scenario, Simulation, Source};
use im_observers::{Basis, FullOrder, FullOrderGains};

const H: f64 = 1e-4;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let machine = Machine::base(M.parameters(), M.pole_pairs)?;
    let (rating, flux) = (M.rating, M.rating.rotor_flux_vs);
    let speed = rating.synchronous_speed_rad_s(M.pole_pairs);
    let data = MachineData::of(&machine, 1.5 * rating.current_peak_a(machine.parameters(), M.pole_pairs));
    let controller = FieldOriented::try_new(&data, &FieldOrientedGains::typical(&data, flux, H))?;
    let observer = FullOrder::try_new(Basis::try_new(&machine, &rating, H)?, FullOrderGains::for_machine(&machine, &rating))?;
    let limits = DriveLimits::generous(&data, speed, flux);
    let mut drive = Sensorless::try_new(controller, observer, &data, &limits, H)?;

    let references = References {
        speed_rad_s: Profile::points([[0.0, 0.0], [0.3, 0.0], [0.8, 0.8 * speed], [2.0, 0.8 * speed], [3.0, -0.8 * speed]])?,
        rotor_flux_vs: flux.into(),
        torque_nm: 0.0.into(),
    };
    let scenario = Scenario {
        source: Source::Controller { name: "sensorless".into(), observer: None, references: references.clone() },
        inverter: Inverter::Averaged { dc_voltage_v: Some(3f64.sqrt() * rating.phase_voltage_peak_v) },
        load: Load {
            torque_nm: Profile::points([[1.2, 0.0], [1.2, rating.torque_nm], [1.8, rating.torque_nm], [1.8, 0.0]])?,
            quadratic_nm_s2: 0.0,
        },
        ..Scenario::direct_on_line(1.0, rating.electrical_frequency_hz, 4.0)
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
        std::fs::write(path, panels("Without a speed sensor: start, rated load, reversal", "time, s", &parts))?;
    }
    Ok(())
}
