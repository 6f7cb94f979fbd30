//! Parameters from a recording: a start, a load step and a reversal, with noise; the fit begins 30 to 60 % off. Prints each parameter with its standard
//! deviation and the truth, and draws the recording with both models:
//!
//!     cargo run --release -p im-identify --example fit_recording -- fit.svg

use im_chart::{Panel, Series, panels};
use im_identify::offline::{Experiment, FitOptions, base_parameters, fit, predict};
use im_model::simulation::{Load, Profile, Scenario, Sensors, Simulation, Source, VoltsPerHertz};
use im_model::{Machine, TParameters, machines};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let m = machines::MOTULATOR_2_2_KW;
    let truth = Machine::base(m.parameters(), m.pole_pairs)?;

    // What a bench would record. On your own files: `Recording::read_csv("run.csv")`.
    let supply = VoltsPerHertz { voltage_peak_v: 326.6, frequency_hz: 50.0, boost_v: 20.0, ramp_hz_per_s: 100.0 };
    let scenario = Scenario {
        source: Source::VoltsPerHertz(supply, Profile::points([[0.0, 40.0], [1.2, 40.0], [1.2, -20.0]])?),
        load: Load { torque_nm: Profile::points([[0.8, 0.0], [0.8, 8.0]])?, ..Load::none() },
        sensors: Sensors { current_noise_a: 0.05, speed_noise_rad_s: 0.1, ..Sensors::default() },
        ..Scenario::direct_on_line(0.0, 50.0, 2.0)
    };
    let recording = Simulation::new(&truth, &scenario).run()?.recording;

    let p = m.parameters();
    let guess = truth.with_parameters(TParameters {
        stator_resistance_ohm: 0.7 * p.stator_resistance_ohm,
        rotor_resistance_ohm: 1.4 * p.rotor_resistance_ohm,
        stator_leakage_inductance_h: 0.6 * p.stator_leakage_inductance_h,
        rotor_leakage_inductance_h: 0.6 * p.rotor_leakage_inductance_h,
        magnetizing_inductance_h: 1.3 * p.magnetizing_inductance_h,
        inertia_kg_m2: 0.7 * p.inertia_kg_m2,
        ..p
    })?;
    let experiments = [Experiment::from_recording(&recording, [0.05; 2], 0.1)];
    let found = fit(&guess, &experiments, &base_parameters(&guess), &FitOptions::default())?;
    println!("{} steps, {:.3} σ rms left", found.iterations, found.chi2_per_sample().sqrt());
    for ((free, value), deviation) in found.free.iter().zip(found.values()).zip(found.standard_deviations()) {
        let id = free.id().ok_or("a parameter of the machine")?;
        println!("{:62} {value:.5} ± {deviation:.1e}, true {:.5}", free.name(), truth.get(id));
    }
    if let Some(path) = std::env::args().nth(1) {
        let r = &recording;
        let line = |name: &str, speed: &[f64]| Series::line(name, speed.iter().enumerate().map(|(k, w)| (r.time_s(k), *w)));
        let of = |machine: &Machine<f64>| predict(machine, &experiments[0], &experiments[0].start.state());
        // Channels: current α and β, speed.
        let (before, after) = (of(&guess), of(&found.machine));
        let error = |model: &[f64]| model.iter().zip(&r.omega_m).map(|(a, b)| a - b).collect::<Vec<_>>();
        let speed = [line("recorded", &r.omega_m), line("guess", &before[2]), line("fitted", &after[2])];
        let errors = [line("error of the fitted model", &error(&after[2]))];
        let parts = [Panel::new("speed, rad/s", speed), Panel::new("rad/s", errors)];
        std::fs::write(path, panels("A fit of seven parameters", "time, s", &parts))?;
    }
    Ok(())
}
