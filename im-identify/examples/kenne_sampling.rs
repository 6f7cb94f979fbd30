//! What sampling, noise and wrong inductances leave of Theorem 7 of Kenné et al.: `cargo run --release -p im-identify --example
//! kenne_sampling`.
//!
//! The machine of Appendix II in the steady state at 50 Hz, 6.89 Nm; R̂_r starts at zero, k = 9.5 Ω/s in the paper's reference (0.7 Ω),
//! noise uniform up to the given share of the current's peak. Printed: when 98 % is reached (Theorem 7 says 72 ms), and mean and standard
//! deviation from 0.3 to 0.8 s, all relative to R_r.

use im_identify::online::{Identifier, KenneRotorResistance, KenneSettings, Range, Sample};
use im_model::machines::KENNE_APPENDIX_II;
use im_model::space_vector::unit;
use im_model::{Complex, Held, Machine, Plant, PlantInput, WindingParameters, steady_state};

/// A case of the table.
struct Setting {
    h: f64,
    gain: f64,
    noise: f64,
    /// Factor on M, L_s, L_r as the identifier knows them.
    main: f64,
    /// Factor on σ as the identifier knows it.
    leakage: f64,
}

/// Uniform over ±1, from splitmix64.
fn uniform(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (*seed ^ (*seed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

fn known(w: &WindingParameters<f64>, case: &Setting) -> WindingParameters<f64> {
    let sigma = 1.0 - w.mutual_inductance_h.powi(2) / (w.stator_inductance_h * w.rotor_inductance_h);
    let (l_s, l_r) = (w.stator_inductance_h * case.main, w.rotor_inductance_h * case.main);
    WindingParameters {
        stator_inductance_h: l_s,
        rotor_inductance_h: l_r,
        mutual_inductance_h: ((1.0 - sigma * case.leakage) * l_s * l_r).sqrt(),
        ..*w
    }
}

/// Time to 98 %, mean and standard deviation, relative to R_r.
fn run(case: &Setting) -> [f64; 3] {
    let m = KENNE_APPENDIX_II;
    let p = m.parameters();
    let r_r = p.rotor_resistance_ohm;
    let machine = Machine::base(p, m.pole_pairs).expect("a machine");
    let plant = Plant::new(&machine);
    let settings = KenneSettings {
        high_gain_per_s: case.gain,
        sliding_gain_a_per_s2: 150_000.0,
        averaging_time_s: 1e-3,
        rate_ohm_per_s: 9.5 / 0.7 * r_r,
        boundary_layer_ohm: 0.0,
        range_ohm: Range::try_new("range_ohm", 0.0, 10.0 * r_r).expect("a range"),
        start_ohm: 0.0,
        least_rotor_current_rate_a_per_s: 30.0,
        excitation_window_s: 0.1,
    };
    let windings = known(&p.windings(), case);
    let identifier = KenneRotorResistance::try_new(&windings, m.pole_pairs, &settings, case.h).expect("settings within bounds");
    let mut state = identifier.start();
    let mut x = steady_state(&machine, 311.0, 50.0, Held::Load(6.89)).expect("a steady state");
    let (omega_m, peak) = (x.omega_m, plant.currents(&x).i_s.norm());
    let (mut u_s, mut seed) = (Complex::new(0.0, 0.0), 1);
    let (mut reached, mut begun, mut sums) = (f64::NAN, None, [0.0; 3]);
    for k in 0..(0.8 / case.h) as usize {
        let t = case.h * k as f64;
        let noise = Complex::new(uniform(&mut seed), uniform(&mut seed)) * (case.noise * peak);
        let said = identifier.step(&mut state, &Sample { i_s: plant.currents(&x).i_s + noise, u_s, omega_m });
        let r = said.values[0] / r_r;
        if said.adapting[0] {
            let begun = *begun.get_or_insert(t);
            if reached.is_nan() && r > 0.98 {
                reached = t - begun;
            }
        }
        if t > 0.3 {
            sums = [sums[0] + 1.0, sums[1] + r, sums[2] + r * r];
        }
        u_s = unit(100.0 * std::f64::consts::PI * case.h * (k as f64 + 0.5)) * 311.0;
        x = plant.step(&x, &PlantInput { imposed_speed: Some([omega_m; 2]), ..PlantInput::new(u_s, 0.0) }, case.h);
    }
    let mean = sums[1] / sums[0];
    [reached, mean, (sums[2] / sums[0] - mean * mean).max(0.0).sqrt()]
}

fn main() {
    println!("| h, µs | Γ, 1/s | noise | inductances known | 98 % after, ms | mean | standard deviation |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    let row = |case: Setting, name: &str| {
        let [reached, mean, deviation] = run(&case);
        let reached = if reached.is_nan() { "never".to_owned() } else { format!("{:.0}", 1e3 * reached) };
        let (h, noise) = (1e6 * case.h, 100.0 * case.noise);
        println!("| {h:.0} | {} | {noise:.0} % | {name} | {reached} | {mean:.4} | {deviation:.4} |", case.gain);
    };
    for noise in [0.0, 0.08] {
        for h in [10e-6, 50e-6, 106e-6, 200e-6] {
            for gain in [31_000.0, 1000.0, 300.0] {
                row(Setting { h, gain, noise, main: 1.0, leakage: 1.0 }, "right");
            }
        }
    }
    for (main, leakage, name) in [
        (1.1, 1.0, "all + 10 %"),
        (0.9, 1.0, "all − 10 %"),
        (1.0, 1.1, "σ + 10 %"),
        (1.0, 0.9, "σ − 10 %"),
        (1.2, 1.0, "all + 20 %"),
    ] {
        row(Setting { h: 106e-6, gain: 300.0, noise: 0.0, main, leakage }, name);
    }
    row(Setting { h: 106e-6, gain: 300.0, noise: 0.08, main: 1.1, leakage: 0.9 }, "all + 10 %, σ − 10 %");
}
