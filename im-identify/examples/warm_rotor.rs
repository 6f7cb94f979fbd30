//! A rotor that warms, and an identifier that sees it: the rotor resistance by the method of Kenné et al., sample by sample, in single precision as in
//! firmware. Prints estimate and truth, and draws them:
//!
//!     cargo run --release -p im-identify --example warm_rotor -- warm_rotor.svg

use im_chart::{Panel, Series, panels};
use im_identify::online::{Identifier, KenneRotorResistance, KenneSettings, Sample};
use im_model::{Bench, Complex, Effects, Machine, PlantInput, State, machines};

const H: f64 = 1e-4;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let m = machines::MOTULATOR_2_2_KW;
    let mut effects = Effects::scaled(&m.rating, &m.parameters(), m.pole_pairs);
    // Heated far faster than a real rotor, so that it shows in twenty seconds.
    effects.rotor_heating.inverse_heat_capacity_k_per_j = 0.12;
    effects.rotor_heating.time_constant_s = 8.0;
    let machine = Machine::try_new(m.parameters(), m.pole_pairs, effects)?;
    let cold = m.parameters().rotor_resistance_ohm;

    let windings = machine.parameters().cast::<f32>().windings();
    let settings = KenneSettings::for_rating(&windings, m.pole_pairs, &m.rating, H as f32);
    let identifier = KenneRotorResistance::try_new(&windings, m.pole_pairs, &settings, H as f32)?;
    let mut state = identifier.start();

    let mut bench = Bench::new(&machine, State::default(), H);
    let single = |z: Complex<f64>| Complex::new(z.re as f32, z.im as f32);
    let (mut estimates, mut truth, mut speed) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..200_000 {
        let t = H * f64::from(k);
        let u = Complex::from_polar(326.6, 314.16 * t);
        // Rated load for twelve seconds, then little: what the rotor does then cannot be seen, and the identifier says so.
        let load_nm = if (1.0..13.0).contains(&t) { 14.0 } else { 0.5 };
        bench.advance(&PlantInput::new(u, load_nm));
        let shown = bench.output();
        let sample = Sample { i_s: single(shown.i_s), u_s: single(u), omega_m: shown.omega_m as f32 };
        let estimate = identifier.step(&mut state, &sample);
        let true_ohm = cold * (1.0 + 0.004 * bench.state().extra.of(im_model::EffectId::RotorHeating)[0]);
        if k % 20_000 == 19_999 {
            println!("{t:4.1} s: {:.3} Ω, true {true_ohm:.3} Ω ({:?})", estimate.values[0], estimate.status);
        }
        estimates.push((t, f64::from(estimate.values[0])));
        truth.push((t, true_ohm));
        speed.push((t, shown.omega_m));
    }
    if let Some(path) = std::env::args().nth(1) {
        let resistance = [Series::line("estimate", estimates), Series::line("truth", truth)];
        let parts =
            [Panel::new("R_r, Ω", resistance), Panel::new("speed, rad/s", [Series::line("speed", speed.split_off(8000))])];
        std::fs::write(path, panels("Rated load from 1 s to 13 s", "time, s", &parts))?;
    }
    Ok(())
}
