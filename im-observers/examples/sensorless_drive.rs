//! A sensorless drive: indirect field orientation on the flux and speed that Kubota's observer estimates; no speed sensor is read.
//!
//!     cargo run --release -p im-observers --example sensorless_drive -- sensorless.svg

use im_chart::{Panel, Series, panels};
use im_model::machines::MOTULATOR_2_2_KW;
use im_model::simulation::{
    Command, Controller, Inverter, Load, Measured, Profile, Reference, References, Scenario, Simulation, Source,
};
use im_model::{Complex, Machine};
use im_observers::{Basis, Kubota, KubotaGains, KubotaState, Observer};

const H: f64 = 1e-4;

struct Sensorless {
    observer: Kubota<f64>,
    state: KubotaState<f64>,
    integral: f64,
}

impl Controller<f64> for Sensorless {
    fn step(&mut self, m: &Measured<f64>, reference: &Reference<f64>) -> Command<f64> {
        let estimate = self.observer.step(&mut self.state, &m.into());
        let flux = estimate.rotor_flux_vs;
        // The d axis is the estimated flux; phase a until there is one.
        let d = if flux.norm() > 0.05 { flux / flux.norm() } else { Complex::new(1.0, 0.0) };
        // Speed and flux: proportional-integral and proportional; torque 2.9 Nm per A at rated flux, magnetized by 4.1 A.
        let error = reference.omega_m - estimate.omega_m;
        let wanted = if flux.norm() > 0.5 * reference.rotor_flux_vs { 0.8 * error + self.integral } else { 0.0 };
        let i_q = wanted.clamp(-8.0, 8.0);
        // At the limit the integral waits.
        if i_q == wanted {
            self.integral += 2.0 * H * error;
        }
        let i_d = (4.1 + 10.0 * (reference.rotor_flux_vs - flux.norm())).clamp(0.0, 8.0);
        // Currents: proportional, with the back-voltage fed forward.
        let back = Complex::new(0.0, 2.0 * estimate.omega_m) * flux * 0.956;
        Command::Voltage((Complex::new(i_d, i_q) * d - m.i_s) * 20.0 + m.i_s * 5.6 + back)
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let m = MOTULATOR_2_2_KW;
    let machine = Machine::base(m.parameters(), m.pole_pairs)?;
    let observer = Kubota::try_new(Basis::try_new(&machine, &m.rating, H)?, KubotaGains::for_machine(&machine, &m.rating)?)?;
    let mut drive = Sensorless { observer, state: KubotaState::default(), integral: 0.0 };
    let speed_rad_s = Profile::points([[0.0, 0.0], [0.3, 0.0], [0.6, 120.0], [1.6, 120.0], [2.2, -120.0]])?;
    let references = References { speed_rad_s, rotor_flux_vs: 0.9.into(), torque_nm: 0.0.into() };
    let scenario = Scenario {
        name: "sensorless".into(),
        source: Source::Controller { name: "sensorless".into(), observer: None, references: references.clone() },
        inverter: Inverter::Averaged { dc_voltage_v: Some(560.0) },
        load: Load { torque_nm: Profile::points([[1.0, 0.0], [1.0, 8.0]])?, quadratic_nm_s2: 0.0 },
        ..Scenario::direct_on_line(1.0, 50.0, 3.0)
    };
    let run = Simulation::new(&machine, &scenario).controlled_by(&mut drive).run()?;
    println!("t s    wanted   true rad/s");
    for k in (0..run.recording.len()).step_by(2000) {
        let t = run.recording.time_s(k);
        println!("{t:.1}   {:7.1}   {:7.1}", references.at(t).omega_m, run.recording.omega_m[k]);
    }
    if let Some(path) = std::env::args().nth(1) {
        let r = &run.recording;
        let over_time = |f: &dyn Fn(usize) -> f64| (0..r.len()).map(|k| (r.time_s(k), f(k))).collect::<Vec<_>>();
        let wanted = Series::line("wanted", over_time(&|k| references.at(r.time_s(k)).omega_m));
        let speed = [Series::line("true speed, which nobody reads", over_time(&|k| r.omega_m[k])), wanted];
        let current = Series::line("length of the current", over_time(&|k| r.i_s[k].norm()));
        let parts = [Panel::new("speed, rad/s", speed), Panel::new("current, A", [current])];
        std::fs::write(path, panels("Without a speed sensor: start, 8 Nm from 1 s, reversal", "time, s", &parts))?;
    }
    Ok(())
}
