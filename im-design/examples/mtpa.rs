//! The drive of Kwon et al. for least current: law from the machine's circuit, delta modulation at 100 µs with dead time.
//!
//!     cargo run --release -p im-design --example mtpa -- mtpa.svg

use im_chart::{Series, chart};
use im_control::{MachineData, Mtpa, MtpaGains, MtpaLaw};
use im_design::mtpa::{TCircuit, for_torque, laws::fit_log};
use im_model::simulation::{Bridge, DeltaModulator, Inverter, References, Scenario, Simulation, Source};
use im_model::{Effects, Machine, machines};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let m = machines::JADOT_TABLE_I;
    let mut effects = Effects::scaled(&m.rating, &m.parameters(), m.pole_pairs);
    effects.main_flux_saturation.excess = 0.5;
    let machine = Machine::try_new(m.parameters(), m.pole_pairs, effects)?;

    let fit = fit_log(&TCircuit::from(&machine), [1.0, 40.0], 0.01)?;
    let law = MtpaLaw::series(fit.torque_n_m, &fit.current, &fit.slip)?;
    let known = MachineData::of(&machine, 30.0);
    println!("torque asked, got Nm; rms current, least possible A");
    let (mut measured, mut least) = (Vec::new(), Vec::new());
    for torque in [2.0, 5.0, 10.0, 20.0, 30.0] {
        let mut drive = Mtpa::try_new(&known, &law, &MtpaGains::typical(&known))?;
        let bridge = Bridge { dead_time_s: 3e-6, ..Bridge::ideal(560.0) };
        let scenario = Scenario {
            source: Source::Controller {
                name: "mtpa".into(),
                observer: None,
                references: References { speed_rad_s: 0.0.into(), rotor_flux_vs: 0.0.into(), torque_nm: torque.into() },
            },
            inverter: Inverter::DeltaModulation(DeltaModulator { period_s: 1e-4 }, bridge),
            imposed_speed: Some(60.0.into()),
            ..Scenario::direct_on_line(0.0, 50.0, 2.5)
        };
        let run = Simulation::new(&machine, &scenario).controlled_by(&mut drive).with_internals().run()?;
        let x = run.internals.ok_or("asked for")?;
        let last = x.torque_nm.len() - 5000..x.torque_nm.len();
        let got = x.torque_nm[last.clone()].iter().sum::<f64>() / 5000.0;
        let rms = (run.recording.i_s[last].iter().map(|i| i.norm_sqr()).sum::<f64>() / 10_000.0).sqrt();
        let possible = for_torque(&TCircuit::from(&machine), got)?.current_rms_a;
        println!("{torque:5.1} {got:6.2}; {rms:6.3} {possible:6.3}");
        measured.push((got, rms));
        least.push((got, possible));
    }
    if let Some(path) = std::env::args().nth(1) {
        let series = [Series::line("least possible", least), Series::crosses("drive, ripple included", measured)];
        std::fs::write(path, chart("Torque per ampere, delta modulation at 100 µs", "torque, Nm", "current, A rms", &series))?;
    }
    Ok(())
}
