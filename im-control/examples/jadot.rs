//! Passivity-based control of Jadot et al. with the time-scale adaptation, on the paper's machine with parameters 25 % wrong.
//!
//!     cargo run --release -p im-control --example jadot -- jadot.svg

use im_chart::{Panel, Series, panels};
use im_control::{Drive, DriveLimits, FlyingStart, Jadot, JadotGains, MachineData};
use im_identify::online::{RegulationParameters, SchemeSettings, TimeScale};
use im_model::simulation::{Inverter, Load, Profile, References, Scenario, Simulation, Source};
use im_model::{Machine, machines::JADOT_TABLE_I};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let m = JADOT_TABLE_I;
    let machine = Machine::base(m.parameters(), m.pole_pairs)?;
    let known = MachineData::of(&machine, 25.0);
    let truth = RegulationParameters::from(m.parameters().inverse_gamma());
    // R_req, L, R_s, L_f; the parameters are the adaptation's.
    let settings = SchemeSettings::full(truth.scaled([1.25, 0.75, 1.25, 0.75]), 1e-4);
    let jadot =
        Jadot::try_new(&known, &JadotGains::of_the_paper(), TimeScale::try_new(&settings, TimeScale::<f64>::PAPER_SHARE)?)?;
    let limits = DriveLimits::generous(&known, 157.0, m.rating.rotor_flux_vs);
    let mut drive = Drive::try_new(FlyingStart::try_new(jadot, &known, 1e-4)?, &limits)?;

    let scenario = Scenario {
        source: Source::Controller {
            name: "jadot".into(),
            observer: None,
            references: References {
                speed_rad_s: Profile::points([[0.5, 0.0], [1.5, 140.0]])?,
                rotor_flux_vs: 0.9.into(),
                torque_nm: 0.0.into(),
            },
        },
        inverter: Inverter::Averaged { dc_voltage_v: Some(560.0) },
        load: Load { torque_nm: Profile::points([[2.0, 0.0], [2.0, 20.0]])?, quadratic_nm_s2: 0.0 },
        ..Scenario::direct_on_line(0.0, 50.0, 6.0)
    };
    let run = Simulation::new(&machine, &scenario).controlled_by(&mut drive).run()?;
    let jadot = drive.controller().controller();
    println!("{:.2} rad/s; load torque estimated {:.2} Nm of 20", run.state.omega_m, jadot.load_torque_nm());
    for (name, (x, truth)) in
        RegulationParameters::<f64>::NAMES.iter().zip(jadot.parameters().values().iter().zip(truth.values()))
    {
        println!("{name}: {:.1} % of the truth", 100.0 * x / truth);
    }
    if let Some(path) = std::env::args().nth(1) {
        let r = &run.recording;
        let over_time = |f: &dyn Fn(usize) -> f64| (0..r.len()).map(|k| (r.time_s(k), f(k))).collect::<Vec<_>>();
        let speed = Series::line("speed", over_time(&|k| r.omega_m[k]));
        let current = Series::line("length of the current", over_time(&|k| r.i_s[k].norm()));
        let parts = [Panel::new("speed, rad/s", [speed]), Panel::new("current, A", [current])];
        std::fs::write(path, panels("Jadot et al., all parameters adapting; 20 Nm from 2 s", "time, s", &parts))?;
    }
    Ok(())
}
