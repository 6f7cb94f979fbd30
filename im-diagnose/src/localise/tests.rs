use im_model::Complex;

use super::*;

/// Noise of unit variance: sums of twelve uniforms.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let mut u = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| u()).sum::<f64>() - 6.0
    }
}

const SIGMA: f64 = 0.05;

/// Four seconds at 4 kHz: flux and speed sweep independently, 50 Hz, load steps; the current error is `error` plus noise.
fn signals(error: impl Fn(f64, &Row) -> Complex<f64>) -> Signals {
    let t_s = 2.5e-4;
    let mut noise = Noise(7);
    let rows = (0..16_000)
        .map(|k| {
            let t = f64::from(k) * t_s;
            let turn = im_model::space_vector::unit(std::f64::consts::TAU * 50.0 * t);
            let mut row = Row {
                current_error: None,
                speed_error: Some(0.1 * noise.next()),
                current: turn * Complex::new(3.0 + 2.0 * (3.1 * t).sin(), -2.0 - (0.7 * t).sin()),
                flux: turn * (0.7 + 0.4 * (5.3 * t).sin()),
                speed: 80.0 + 60.0 * (1.7 * t).cos(),
                torque: 10.0 * (0.9 * t).sin(),
                slip_hz: 1.0 + 0.5 * (2.3 * t).sin(),
                voltage: turn * 200.0,
                load: if t % 1.0 < 0.5 { 5.0 } else { 0.0 },
            };
            row.current_error = Some(error(t, &row) + Complex::new(SIGMA * noise.next(), SIGMA * noise.next()));
            row
        })
        .collect();
    Signals {
        runs: vec![Run { name: "synthetic".into(), sample_time_s: t_s, rows }],
        current_noise_a: SIGMA,
        speed_noise_rad_s: 0.1,
        pole_pairs: 2,
    }
}

#[test]
fn an_error_of_flux_is_said_to_grow_above_the_knee_at_every_speed() {
    let l = localise(&signals(|_, r| r.flux * (f64::max(r.flux.norm() - 0.8, 0.0) * 4.0)));
    let p = l.profiles.iter().find(|p| p.quantity == Quantity::Current && p.over == ProfileOver::Flux).unwrap();
    assert!(p.conclusion.starts_with("the current error is larger at flux above 0.8"), "{}", p.conclusion);
    assert!(p.conclusion.ends_with("at every speed"), "{}", p.conclusion);
    assert_eq!(l.findings()[0], p.conclusion);
    // The speed is right, and is said to be.
    let speed = l.profiles.iter().find(|p| p.quantity == Quantity::Speed).unwrap();
    assert!(speed.conclusion.contains("that of the noise"), "{}", speed.conclusion);
    // An error that lasts as long as the flux is high.
    assert!(l.memory[0].conclusion.contains("lasts"), "{}", l.memory[0].conclusion);
    assert!(l.memory[1].conclusion.contains("as sensor noise is"), "{}", l.memory[1].conclusion);
}

#[test]
fn dead_time_is_seen_at_zero_crossings_and_at_six_times_the_supply() {
    let l = localise(&signals(|_, r| {
        // Phase errors of the sign of the phase current, gone away from its zero crossing.
        let phases = im_model::space_vector::to_phases(r.current).map(|i| i.signum() * 0.6 * (-(i / 0.8).powi(2)).exp());
        im_model::space_vector::from_phases(phases)
    }));
    let c = l.crossings.as_ref().unwrap();
    assert!(c.near > 1.5 * c.far && c.conclusion.contains("times as large within 15°"), "{}", c.conclusion);
    let s = l.spectra.iter().find(|s| s.quantity == Quantity::Current).unwrap();
    assert!(s.conclusion.contains("at 300 Hz (6 × supply"), "{}", s.conclusion);
    assert!((s.supply_hz - 50.0).abs() < 0.1, "{}", s.supply_hz);
}

#[test]
fn noise_alone_gives_no_findings() {
    let l = localise(&signals(|_, _| Complex::new(0.0, 0.0)));
    assert_eq!(l.findings(), Vec::<String>::new());
    assert!((l.level[0] - 1.0).abs() < 0.05 && (l.level[1] - 1.0).abs() < 0.05, "{:?}", l.level);
    assert!(l.correlations.conclusion.contains("below 0.3"));
    assert!(l.planes.iter().all(|p| p.strength == 0.0), "{:?}", l.planes[0].conclusion);
}

#[test]
fn an_unnamed_line_is_reported_with_its_orders() {
    let l = localise(&signals(|t, r| r.flux / r.flux.norm() * (0.5 * (std::f64::consts::TAU * 137.0 * t).sin())));
    let s = l.spectra.iter().find(|s| s.quantity == Quantity::Current).unwrap();
    assert!(s.conclusion.contains("× supply") && s.conclusion.contains("at 137 Hz"), "{}", s.conclusion);
}

#[test]
fn an_error_in_step_with_the_load_is_found_and_the_worst_second_too() {
    let l = localise(&signals(|t, r| {
        let along = r.flux / r.flux.norm();
        along * Complex::new(0.0, 0.05 * r.load) + along * (if (2.0..3.0).contains(&t) { 1.0 } else { 0.0 })
    }));
    let load = l.correlations.signals.iter().position(|s| s.starts_with("load")).unwrap();
    assert!(l.correlations.coefficients[1][load] > 0.7, "{:?}", l.correlations.coefficients);
    let w = l.worst.unwrap();
    assert!((w.from_s - 2.0).abs() < 0.02 && (w.to_s - 3.0).abs() < 0.02 && w.level > w.average, "{w:?}");
}

#[test]
fn short_and_empty_runs_are_no_trouble() {
    let mut s = signals(|_, _| Complex::new(0.0, 0.0));
    for n in [1_000, 100, 1, 0] {
        s.runs[0].rows.truncate(n);
        let _ = localise(&s).findings();
    }
    s.runs.clear();
    assert!(localise(&s).worst.is_none());
}

/// What is left of an input shows at its lag, what is not does not leave the band more often than chance.
#[test]
fn an_error_that_follows_an_input_leaves_the_band_of_chance_and_noise_does_not() {
    let clean = localise(&signals(|_, _| Complex::new(0.0, 0.0)));
    for x in &clean.inputs {
        let outside = x.points.iter().filter(|p| p[1].abs() > x.chance).count() as f64 / x.points.len() as f64;
        assert!(outside < 0.1 && x.conclusion.contains("holds nothing"), "{} with {}: {outside}", x.error, x.input);
    }
    let mut s = signals(|_, _| Complex::new(0.0, 0.0));
    let late = 40;
    let rows = s.runs[0].rows.clone();
    for (k, r) in s.runs[0].rows.iter_mut().enumerate().skip(late) {
        r.speed_error = r.speed_error.map(|e| e + 0.02 * (rows[k - late].load - 2.5));
    }
    let found = localise(&s);
    let x = found.inputs.iter().find(|x| x.error.starts_with("speed") && x.input.starts_with("load")).unwrap();
    let most = x.points.iter().max_by(|a, b| a[1].total_cmp(&b[1])).unwrap();
    assert!((most[0] - late as f64 * 2.5e-4).abs() < 1e-9 && most[1] > x.chance, "{most:?}, {}", x.chance);
    assert!(x.conclusion.contains("still follows the load torque"), "{}", x.conclusion);
}
