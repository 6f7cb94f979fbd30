//! Kenné et al.'s sliding modes on a drive, in single precision as in firmware.
//!
//!     cargo run --release -p im-control --example kenne -- kenne.svg

use im_chart::{Panel, Series, panels};
use im_control::{Drive, DriveLimits, Kenne, KenneGains, MachineData};
use im_model::simulation::{Inverter, Load, Profile, References, Scenario, Simulation, SinglePrecision, Source};
use im_model::{Machine, machines};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let m = machines::JADOT_TABLE_I;
    let machine = Machine::base(m.parameters(), m.pole_pairs)?;

    let known = MachineData::of(&machine, 1.5 * m.rating.current_peak_a(&m.parameters(), m.pole_pairs)).cast::<f32>();
    let gains = KenneGains::typical(&known, 0.9, 560.0, 1e-4);
    let limits = DriveLimits::generous(&known, 157.0, 0.9);
    let mut drive = SinglePrecision(Drive::try_new(Kenne::try_new(&known, &gains)?, &limits)?);

    let scenario = Scenario {
        source: Source::Controller {
            name: "kenne".into(),
            observer: None,
            references: References {
                speed_rad_s: Profile::points([[0.0, 0.0], [0.3, 0.0], [0.6, 120.0], [1.5, 120.0], [2.0, -120.0]])?,
                rotor_flux_vs: 0.9.into(),
                torque_nm: 0.0.into(),
            },
        },
        inverter: Inverter::Averaged { dc_voltage_v: Some(560.0) },
        load: Load { torque_nm: Profile::points([[1.0, 0.0], [1.0, 20.0]])?, quadratic_nm_s2: 0.0 },
        ..Scenario::direct_on_line(0.0, 50.0, 2.5)
    };
    let run = Simulation::new(&machine, &scenario).controlled_by(&mut drive).run()?;
    for k in [2000, 5000, 9000, 10_200, 14_000, 24_999] {
        let r = &run.recording;
        println!("{:.2} s: {:7.2} rad/s, {:5.2} A", 1e-4 * k as f64, r.omega_m[k], r.i_s[k].norm());
    }
    println!("load torque as estimated: {:.2} Nm", drive.0.controller().load_torque_nm());
    if let Some(path) = std::env::args().nth(1) {
        let r = &run.recording;
        let over_time = |f: &dyn Fn(usize) -> f64| (0..r.len()).map(|k| (r.time_s(k), f(k))).collect::<Vec<_>>();
        let speed = Series::line("speed", over_time(&|k| r.omega_m[k]));
        let current =
            [Series::line("phase a", over_time(&|k| r.i_s[k].re)), Series::line("length", over_time(&|k| r.i_s[k].norm()))];
        let parts = [Panel::new("speed, rad/s", [speed]), Panel::new("current, A", current)];
        std::fs::write(
            path,
            panels("Sliding modes of Kenné et al. in single precision: 20 Nm from 1 s, reversal", "time, s", &parts),
        )?;
    }
    Ok(())
}
