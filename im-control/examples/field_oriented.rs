//! Field orientation on a drive: up to speed, a load step.
//!
//!     cargo run --release -p im-control --example field_oriented -- field_oriented.svg

use im_chart::{Panel, Series, panels};
use im_control::{Drive, DriveLimits, FieldOriented, FieldOrientedGains, MachineData, Reports};
use im_model::simulation::{Inverter, Load, Profile, References, Scenario, Simulation, Source};
use im_model::{Machine, machines};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let m = machines::JADOT_TABLE_I;
    let machine = Machine::base(m.parameters(), m.pole_pairs)?;

    // What the controller knows, its gains, and what is looked after around it.
    let known = MachineData::of(&machine, 1.5 * m.rating.current_peak_a(&m.parameters(), m.pole_pairs));
    let gains = FieldOrientedGains::typical(&known, 0.9, 1e-4).direct();
    let limits = DriveLimits::generous(&known, 157.0, 0.9);
    let mut drive = Drive::try_new(FieldOriented::try_new(&known, &gains)?, &limits)?;

    let scenario = Scenario {
        source: Source::Controller {
            name: "field oriented".into(),
            observer: None,
            references: References {
                speed_rad_s: Profile::points([[0.0, 0.0], [0.3, 0.0], [0.6, 120.0]])?,
                rotor_flux_vs: 0.9.into(),
                torque_nm: 0.0.into(),
            },
        },
        inverter: Inverter::Averaged { dc_voltage_v: Some(560.0) },
        load: Load { torque_nm: Profile::points([[1.0, 0.0], [1.0, 20.0]])?, quadratic_nm_s2: 0.0 },
        ..Scenario::direct_on_line(0.0, 50.0, 1.5)
    };
    let run = Simulation::new(&machine, &scenario).controlled_by(&mut drive).run()?;
    for k in [2000, 5000, 9000, 10_200, 14_999] {
        let r = &run.recording;
        println!("{:.2} s: {:7.2} rad/s, {:5.2} A", 1e-4 * k as f64, r.omega_m[k], r.i_s[k].norm());
    }
    println!("status: {}; torque {:.1} Nm", drive.status(), drive.controller().torque_nm());
    if let Some(path) = std::env::args().nth(1) {
        let r = &run.recording;
        let over_time = |f: &dyn Fn(usize) -> f64| (0..r.len()).map(|k| (r.time_s(k), f(k))).collect::<Vec<_>>();
        let speed = Series::line("speed", over_time(&|k| r.omega_m[k]));
        let current =
            [Series::line("phase a", over_time(&|k| r.i_s[k].re)), Series::line("length", over_time(&|k| r.i_s[k].norm()))];
        let parts = [Panel::new("speed, rad/s", [speed]), Panel::new("current, A", current)];
        std::fs::write(path, panels("Direct field orientation: 120 rad/s, 20 Nm from 1 s", "time, s", &parts))?;
    }
    Ok(())
}
