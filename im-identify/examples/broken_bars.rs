//! Are broken bars seen in the rotor resistance of Kenné et al. (Section V, "diagnostics and fault detection")? With the rotor's resistance
//! R_r(1 + δ·mirror), the current that turns with the slip meets R_r(1 + δ cos 2ω_g t): R̂_r should swing by δR_r at twice the slip frequency.
//!
//!     cargo run --release -p im-identify --example broken_bars -- broken_bars.svg
//!
//! Prints the mean of R̂_r and its amplitude at twice the slip frequency, over R_r, for unbalances and loads; draws R̂_r at rated load.

use im_chart::{Series, chart};
use im_identify::online::{Identifier, KenneRotorResistance, KenneSettings, Sample};
use im_model::space_vector::unit;
use im_model::{Bench, Complex, Effects, Machine, PlantInput, State, machines};

const H: f64 = 1e-4;
const M: machines::NamedMachine = machines::MOTULATOR_2_2_KW;
/// Settled from there on, s, to the end.
const SPAN_S: [f64; 2] = [4.0, 8.0];

struct Seen {
    /// Of R̂_r over R_r.
    mean: f64,
    amplitude: f64,
    /// Slip frequency, electrical, Hz.
    slip_hz: f64,
    curve: Vec<(f64, f64)>,
}

fn run(unbalance: f64, load_nm: f64, ripple: f64) -> Result<Seen, Box<dyn std::error::Error>> {
    let mut effects = Effects::none();
    effects.rotor_asymmetry.unbalance_direct = unbalance;
    let machine = Machine::try_new(M.parameters(), M.pole_pairs, effects)?;
    let windings = machine.parameters().windings();
    let settings = KenneSettings::for_rating(&windings, M.pole_pairs, &M.rating, H);
    let identifier = KenneRotorResistance::try_new(&windings, M.pole_pairs, &settings, H)?;
    let (mut state, mut bench) = (identifier.start(), Bench::new(&machine, State::default(), H));
    let r_r = windings.rotor_resistance_ohm;
    let omega = std::f64::consts::TAU * M.rating.electrical_frequency_hz;
    let (mut rows, mut speed) = (Vec::new(), 0.0);
    for k in 0..(SPAN_S[1] / H) as usize {
        let t = H * k as f64;
        let u = Complex::from_polar(M.rating.phase_voltage_peak_v, omega * t);
        // A load that swings once a turn of the shaft, the usual rival.
        let swing = 1.0 + ripple * bench.state().theta_m.cos();
        bench.advance(&PlantInput::new(u, if t > 0.5 { load_nm * swing } else { 0.0 }));
        let shown = bench.output();
        let estimate = identifier.step(&mut state, &Sample { i_s: shown.i_s, u_s: u, omega_m: shown.omega_m });
        if t >= SPAN_S[0] {
            rows.push((t, estimate.values[0] / r_r));
            speed += shown.omega_m;
        }
    }
    let n = rows.len() as f64;
    let slip = omega - f64::from(M.pole_pairs) * speed / n;
    let mean = rows.iter().map(|r| r.1).sum::<f64>() / n;
    // Over whole turns of twice the slip.
    let period = std::f64::consts::PI / slip;
    let whole = ((SPAN_S[1] - SPAN_S[0]) / period).floor() * period;
    let within: Vec<_> = rows.iter().filter(|r| r.0 < SPAN_S[0] + whole).collect();
    let turned: Complex<f64> = within.iter().map(|(t, y)| unit(-2.0 * slip * t) * (y - mean)).sum();
    let curve = rows.iter().step_by(100).copied().collect();
    Ok(Seen { mean, amplitude: 2.0 * turned.norm() / within.len() as f64, slip_hz: slip / std::f64::consts::TAU, curve })
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("| unbalance δ | load, Nm | load ripple | slip, Hz | mean of R̂_r/R_r | amplitude at twice the slip |");
    println!("|---|---|---|---|---|---|");
    let mut curves = Vec::new();
    for (unbalance, load_nm, ripple) in [
        (0.0, 14.0, 0.0),
        (0.02, 14.0, 0.0),
        (0.05, 14.0, 0.0),
        (0.1, 14.0, 0.0),
        (0.2, 14.0, 0.0),
        (0.1, 7.0, 0.0),
        (0.1, 3.0, 0.0),
        (0.0, 14.0, 0.2),
    ] {
        let seen = run(unbalance, load_nm, ripple)?;
        println!("| {unbalance} | {load_nm} | {ripple} | {:.2} | {:.4} | {:.4} |", seen.slip_hz, seen.mean, seen.amplitude);
        if load_nm == 14.0 && ripple == 0.0 && [0.0, 0.05, 0.1].contains(&unbalance) {
            curves.push(Series::line(format!("δ = {unbalance}"), seen.curve));
        }
    }
    if let Some(path) = std::env::args().nth(1) {
        std::fs::write(path, chart("Broken bars in the estimated rotor resistance, 14 Nm", "t, s", "R̂_r over R_r", &curves))?;
    }
    Ok(())
}
