//! A machine switched onto the mains with a fan on its shaft: torque, current and speed. Prints where the speed settles, and draws the start:
//!
//!     cargo run --release -p im-model --example direct_on_line -- start.svg

use im_chart::{Panel, Series, panels};
use im_model::simulation::{Load, Scenario, Simulation};
use im_model::{Effects, Machine, machines};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let m = machines::JADOT_TABLE_I;
    // The linear machine and two effects: saturated iron, and a rotor whose bars show skin effect.
    let mut effects = Effects::scaled(&m.rating, &m.parameters(), m.pole_pairs);
    effects.main_flux_saturation.excess = 0.5;
    effects.rotor_skin_effect.resistance_rise = 0.8;
    let machine = Machine::try_new(m.parameters(), m.pole_pairs, effects)?;

    let synchronous = m.rating.synchronous_speed_rad_s(m.pole_pairs);
    let scenario = Scenario {
        load: Load { quadratic_nm_s2: 0.8 * m.rating.torque_nm / synchronous.powi(2), ..Load::none() },
        ..Scenario::direct_on_line(m.rating.phase_voltage_peak_v, m.rating.electrical_frequency_hz, 0.8)
    };
    let run = Simulation::new(&machine, &scenario).with_internals().run()?;

    let r = &run.recording;
    let peak = r.i_s.iter().map(|i| i.norm()).fold(0.0, f64::max);
    println!("{}: peak current {peak:.1} A, settles at {:.2} rad/s of {synchronous:.2}", m.name, run.state.omega_m);

    if let Some(path) = std::env::args().nth(1) {
        let torque = run.internals.ok_or("internals were asked for")?.torque_nm;
        let over_time = |f: &dyn Fn(usize) -> f64| (0..r.len()).map(|k| (r.time_s(k), f(k))).collect::<Vec<_>>();
        let svg = panels(
            "Direct-on-line start of a 4-kW machine with a fan",
            "time, s",
            &[
                Panel::new("torque, Nm", [Series::line("electromagnetic torque", over_time(&|k| torque[k]))]),
                Panel::new("current, A", [Series::line("current of phase a", over_time(&|k| r.i_s[k].re))]),
                Panel::new("speed, rad/s", [Series::line("speed", over_time(&|k| r.omega_m[k]))]),
            ],
        );
        std::fs::write(path, svg)?;
    }
    Ok(())
}
