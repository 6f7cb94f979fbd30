//! A drive whose machine has effects that the controller does not know: what each of them costs.
//!
//!     cargo run --release -p im-control --example unknown_effects -- unknown_effects.svg

use im_chart::{Series, chart};
use im_control::MachineData;
use im_control::named::{Setting, named};
use im_model::simulation::{Inverter, Load, Profile, References, Scenario, Simulation, Source};
use im_model::{EffectId, Effects, Machine, machines};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let m = machines::JADOT_TABLE_I;
    let base = Machine::base(m.parameters(), m.pole_pairs)?;
    let machine = MachineData::of(&base, 1.5 * m.rating.current_peak_a(&m.parameters(), m.pole_pairs));
    let setting = Setting {
        machine,
        rating: m.rating,
        dc_voltage_v: 560.0,
        sample_time_s: 1e-4,
        dead_time: None,
        iron: im_control::Iron::ideal(),
        mtpa: None,
        observer: None,
    };
    let scenario = Scenario {
        source: Source::Controller {
            name: "indirect".into(),
            observer: None,
            references: References {
                speed_rad_s: Profile::points([[0.0, 0.0], [0.3, 0.0], [0.6, 120.0]])?,
                rotor_flux_vs: 0.9.into(),
                torque_nm: 0.0.into(),
            },
        },
        inverter: Inverter::Averaged { dc_voltage_v: Some(560.0) },
        load: Load { torque_nm: Profile::points([[0.8, 0.0], [0.8, 20.0]])?, quadratic_nm_s2: 0.0 },
        ..Scenario::direct_on_line(0.0, 50.0, 1.5)
    };
    println!("effect: speed dip at the load step, rad/s; flux, Vs (0.9 asked for); current, A");
    let mut dips = Vec::new();
    for effect in [None, Some(EffectId::MainFluxSaturation), Some(EffectId::IronLoss), Some(EffectId::InverterNonlinearity)] {
        let mut effects = Effects::scaled(&m.rating, &m.parameters(), m.pole_pairs);
        match effect {
            Some(EffectId::MainFluxSaturation) => effects.main_flux_saturation.excess = 0.8,
            Some(EffectId::IronLoss) => effects.iron_loss.conductance_s = 2e-3,
            Some(EffectId::InverterNonlinearity) => effects.inverter_nonlinearity.voltage_v = 10.0,
            _ => {}
        }
        let truth = base.with_effects(effects)?;
        let mut drive = named("indirect_field_orientation", &setting)?;
        let run = Simulation::new(&truth, &scenario).controlled_by(drive.as_mut()).run()?;
        let dip = run.recording.omega_m[8000..].iter().fold(0.0f64, |d, w| d.max(120.0 - w));
        let current = run.recording.i_s.last().map_or(0.0, |i| i.norm());
        let name = effect.map_or("none", EffectId::name);
        println!("{name:22} {dip:5.2} {:6.3} {current:6.2}", run.state.psi_r.norm());
        let r = &run.recording;
        dips.push(Series::line(name, (7500..10_000).map(|k| (r.time_s(k), r.omega_m[k]))));
    }
    if let Some(path) = std::env::args().nth(1) {
        std::fs::write(path, chart("20 Nm onto a drive that knows the linear machine alone", "time, s", "speed, rad/s", &dips))?;
    }
    Ok(())
}
