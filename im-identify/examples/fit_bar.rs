//! The fit that `../shared/bench` times in Python, for a side-by-side run: six parameters to 20,000 samples, and 30 starts from
//! a third to three times the truth. Usage: `fit_bar base_train.csv`.

use std::time::Instant;

use im_identify::offline::{Channel, ChannelKind, Experiment, FitOptions, Load, Start, base_parameters, cost, fit, linearize};
use im_model::{Complex, InverseGammaParameters, Machine};

const TRUTH: [f64; 6] = [3.7, 2.1, 0.224, 0.021, 0.015, 0.002];
const GUESS: [f64; 6] = [2.8, 2.8, 0.30, 0.015, 0.010, 0.004];

fn machine([r_s, r_r, l_m, l_s, j, d]: [f64; 6]) -> Machine<f64> {
    let g = InverseGammaParameters {
        stator_resistance_ohm: r_s,
        rotor_resistance_ohm: r_r,
        leakage_inductance_h: l_s,
        magnetizing_inductance_h: l_m,
    };
    Machine::base(g.to_t(1.0, j, d), 2).expect("physical parameters")
}

fn main() {
    let path = std::env::args().nth(1).unwrap_or_else(|| "../shared/bench/base_train.csv".into());
    let Ok(text) = std::fs::read_to_string(&path) else {
        println!("{path} is not there: nothing to time");
        return;
    };
    let rows: Vec<Vec<f64>> =
        text.lines().skip(1).map(|l| l.split(',').map(|x| x.trim().parse().expect("a number")).collect()).collect();
    let column = |k: usize| rows.iter().map(|r| r[k]).collect::<Vec<f64>>();
    let channel = |name: &str, kind, k, sigma| Channel { name: name.into(), kind, values: column(k), valid: None, sigma };
    let current = |direction_rad| ChannelKind::Current { direction_rad };
    let experiment = Experiment {
        name: path,
        sample_time_s: 1e-4,
        u_s: rows.iter().map(|r| Complex::new(r[1], r[2])).collect(),
        is_smooth: false,
        voltage_noise: Default::default(),
        tau_load: column(6),
        load: Load::Known,
        imposed_speed: None,
        speed_nudge: None,
        warmth: Vec::new(),
        inert: None,
        nudge_part: 1.0,
        supply_frequency_hz: None,
        channels: vec![
            channel("i_alpha_A", current(0.0), 3, 0.05),
            channel("i_beta_A", current(std::f64::consts::FRAC_PI_2), 4, 0.05),
            channel("omega_m_rad_s", ChannelKind::Speed, 5, 0.1),
        ],
        start: Start::Rest,
    };
    let experiments = [experiment];
    let free = base_parameters(&machine(GUESS));
    let options = FitOptions::default();
    let time = |f: &mut dyn FnMut()| {
        let mut best = f64::MAX;
        for _ in 0..7 {
            let t = Instant::now();
            f();
            best = best.min(t.elapsed().as_secs_f64());
        }
        1e3 * best
    };
    let guess = machine(GUESS);
    let start = experiments[0].start.state();
    println!("one simulation {:.2} ms", time(&mut || assert!(cost(&guess, &experiments, &[start]).is_finite())));
    println!(
        "one simulation with sensitivities {:.2} ms",
        time(&mut || assert_eq!(linearize(&guess, &experiments[0], &start, 0, &free).slopes.len(), 6))
    );
    let reference = fit(&guess, &experiments, &free, &options).expect("fits");
    println!("whole fit {:.1} ms", time(&mut || assert!(fit(&guess, &experiments, &free, &options).is_ok())));
    println!("chi2/N {:.5}, {} steps", reference.chi2_per_sample(), reference.iterations);
    let g = reference.machine.parameters().inverse_gamma();
    println!("{g:?}");

    let mut seed = 1u64;
    let mut uniform = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut reached = 0;
    for _ in 0..30 {
        let from = machine(TRUTH.map(|x| x * ((2.0 * uniform() - 1.0) * 3f64.ln()).exp()));
        match fit(&from, &experiments, &free, &options) {
            Ok(f) if (f.cost / reference.cost - 1.0).abs() < 1e-6 => reached += 1,
            Ok(f) => println!("  stuck at {:.4}", f.chi2_per_sample()),
            Err(e) => println!("  {e}"),
        }
    }
    println!("starts that reach the optimum: {reached}/30");
}
