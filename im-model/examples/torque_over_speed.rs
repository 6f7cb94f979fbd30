//! Torque and current over speed in steady operation, and what saturated leakages and skin effect do to them. No simulation: each point is a
//! steady state, solved as such. Prints starting and pull-out torque, and draws the curves:
//!
//!     cargo run --release -p im-model --example torque_over_speed -- torque.svg

use im_chart::{Panel, Series, panels};
use im_model::{Effects, Held, Machine, ModelError, Plant, machines, steady_state};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let m = machines::JADOT_TABLE_I;
    let base = Machine::base(m.parameters(), m.pole_pairs)?;
    let mut leakage = Effects::scaled(&m.rating, &m.parameters(), m.pole_pairs);
    leakage.leakage_flux_saturation.drop = 0.5;
    let mut skin = leakage;
    skin.rotor_skin_effect.resistance_rise = 0.5;
    let machines =
        [("linear", base), ("+ leakage saturation", base.with_effects(leakage)?), ("+ skin effect", base.with_effects(skin)?)];

    let (voltage, frequency) = (m.rating.phase_voltage_peak_v, m.rating.electrical_frequency_hz);
    let synchronous = m.rating.synchronous_speed_rad_s(m.pole_pairs);
    let (mut torque, mut current) = (Vec::new(), Vec::new());
    for (name, machine) in &machines {
        let plant = Plant::new(machine);
        let at = |share: f64| -> Result<(f64, f64, f64), ModelError> {
            let x = steady_state(machine, voltage, frequency, Held::Speed(share * synchronous))?;
            Ok((share, plant.torque(&x), plant.currents(&x).i_s.norm()))
        };
        let points = (0..=100).map(|k| at(f64::from(k) / 100.0)).collect::<Result<Vec<_>, _>>()?;
        let most = points.iter().map(|p| p.1).fold(0.0, f64::max);
        println!("{name}: {:.1} Nm and {:.1} A at standstill, pull-out torque {most:.1} Nm", points[0].1, points[0].2);
        torque.push(Series::line(*name, points.iter().map(|p| (p.0, p.1))));
        current.push(Series::line(*name, points.iter().map(|p| (p.0, p.2))));
    }
    if let Some(path) = std::env::args().nth(1) {
        let parts = [Panel::new("torque, Nm", torque), Panel::new("current, A peak", current)];
        std::fs::write(path, panels("Steady operation at rated voltage and frequency", "speed over synchronous speed", &parts))?;
    }
    Ok(())
}
