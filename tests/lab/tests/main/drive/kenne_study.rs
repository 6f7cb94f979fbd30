//! The second simulation study of Kenné et al.: what is changed there, and what the paper's own conditions ask for.

use std::f64::consts::PI;

use im_lab::kenne_study::{CURRENT_A, Law, Row, Study, constant};

/// 8 % of noise, R_r between nominal and twice that, R_s + 50 % at 2 s, speed ±4 %, load ±50 %: with switching gains of (25), (26) speed and flux
/// follow; k_vsd of Table I, below (26), loses the flux.
#[test]
fn with_gains_of_25_and_26_the_second_study_of_kenne_holds() {
    let sine = |t: f64| (PI * t).sin();
    let study = Study {
        speed: &|t| 145.0 * (1.0 + 0.04 * sine(t)),
        load: &|t| 6.89 * (1.0 + 0.5 * sine(t)),
        r_r: &|t| 0.7 * (1.5 - 0.5 * (PI * t).cos()),
        r_s: &|t| if t < 2.0 { 8.65 } else { 1.5 * 8.65 },
        noise_a: 0.08 * CURRENT_A,
        ..constant(4.0)
    };
    let worst = |rows: &[Row], of: &dyn Fn(&Row) -> f64| rows[rows.len() / 2..].iter().fold(0.0f64, |w, r| w.max(of(r).abs()));
    let [table_i, designed] = [Law::Layers, Law::Designed].map(|law| study.run(law));
    let speed = worst(&designed, &|r| r.omega / r.omega_ref - 1.0);
    let estimate = worst(&designed, &|r| r.flux2_hat / 0.0645 - 1.0);
    let [flux, lost] = [&designed, &table_i].map(|rows| worst(rows, &|r| r.flux2 / 0.0645 - 1.0));
    // The machine's flux is off by what R̂_r is, 17 % at times.
    assert!(speed < 0.04 && estimate < 0.1 && flux < 0.3, "{speed} {estimate} {flux}");
    assert!(lost > 0.5, "{lost}");
}

/// With no more voltage than the machine is rated for, 311 V, Fig. 1 holds with Table I.
#[test]
fn the_first_study_holds_within_the_rated_voltage() {
    let rows = Study { voltage_v: 311.0, ..constant(2.5) }.run(Law::Layers);
    let end = &rows[rows.len() - 1000..];
    assert!(end.iter().all(|r| (r.omega / r.omega_ref - 1.0).abs() < 5e-3 && (r.flux2 / 0.0645 - 1.0).abs() < 0.02));
}
