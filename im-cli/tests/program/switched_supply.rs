//! What real benches do to a supply: a contactor that opens, a phase sequence that is exchanged, a soft starter; as a voltmeter samples it, with noise.
//! The machine is simulated here, with equations of its own.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;

use crate::common::{Folder, done};

// The T circuit, and a brake that turns with the rotor.
const R_S: f64 = 4.5;
const R_R: f64 = 3.6;
const L_LS: f64 = 0.015;
const L_LR: f64 = 0.018;
const L_M: f64 = 0.35;
const J: f64 = 0.012;
const BRAKE_NM: f64 = 2.0;
/// Ohm across an open contact or thyristor.
const OPEN: f64 = 12e3;

#[derive(Clone, Copy)]
struct Supply {
    peak_v: f64,
    opens_s: f64,
    reverses_s: f64,
    /// Where a soft starter begins to fire, rad after the zero of the phase voltage, and how long it takes to come to none.
    fires: f64,
    ramp_s: f64,
}

const MAINS: Supply = Supply { peak_v: 326.6, opens_s: 9.0, reverses_s: 9.0, fires: 0.0, ramp_s: 0.5 };

fn phases([a, b]: [f64; 2]) -> [f64; 3] {
    let across = 3f64.sqrt() / 2.0 * b;
    [a, across - 0.5 * a, -across - 0.5 * a]
}

fn vector([a, b, c]: [f64; 3]) -> [f64; 2] {
    [(2.0 * a - b - c) / 3.0, (b - c) / 3f64.sqrt()]
}

/// Stator and rotor currents and the magnetizing flux of the fluxes of both windings; `knee` Vs halves L_m, where it is not zero.
fn currents(psi: &[f64; 4], knee: f64) -> ([f64; 2], [f64; 2], [f64; 2]) {
    let of = |k: usize| psi[k] / L_LS + psi[k + 2] / L_LR;
    let (a, inverse) = (of(0).hypot(of(1)), 1.0 / L_LS + 1.0 / L_LR);
    let mut flux = a / (inverse + 1.0 / L_M);
    for _ in 0..if knee > 0.0 { 8 } else { 0 } {
        let part = (flux / knee).powi(6);
        let (left, slope) = (flux * inverse + flux / L_M * (1.0 + part) - a, inverse + (1.0 + 7.0 * part) / L_M);
        flux -= left / slope;
    }
    let psi_m = [0, 1].map(|k| if a > 0.0 { of(k) / a * flux } else { 0.0 });
    ([0, 1].map(|k| (psi[k] - psi_m[k]) / L_LS), [0, 1].map(|k| (psi[k + 2] - psi_m[k]) / L_LR), psi_m)
}

/// A recording of rows of `row_s`, over so many seconds, switched on after 30 ms: three voltages with noise of 0.5 V, three currents, the speed.
fn recorded(supply: &Supply, knee: f64, (row_s, length_s): (f64, f64), seed: u64) -> String {
    let mut state = seed;
    let mut draw = |sigma: f64| {
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        sigma * (0..12).map(|_| uniform()).sum::<f64>()
    };
    let (h, on_s) = (2e-6, 0.0301);
    let every = (row_s / h).round() as usize;
    let (mut x, mut is_open, mut before) = ([0.0; 5], [true; 3], [0.0; 3]);
    let mut text = "t_s,u_a_V,u_b_V,u_c_V,i_a_A,i_b_A,i_c_A,n_rpm\n".to_owned();
    for k in 0..=(length_s / h) as usize {
        let t = k as f64 * h;
        let (i_s, ..) = currents(&[x[0], x[1], x[2], x[3]], knee);
        let i = phases(i_s);
        let direction = if t > supply.reverses_s { -1.0 } else { 1.0 };
        let angle = |phase: usize| TAU * (50.0 * t - direction * phase as f64 / 3.0);
        let fires = supply.fires * (1.0 - (t - on_s) / supply.ramp_s).max(0.0);
        let legs: [f64; 3] = std::array::from_fn(|p| {
            // A contact opens where its current is zero, as a thyristor does; that fires once in each half wave.
            let at_zero = before[p] * i[p] <= 0.0;
            let since_zero = (angle(p) + 0.5 * PI + 8.0 * PI).rem_euclid(PI);
            let fired = since_zero >= fires && since_zero < fires + 0.3;
            if t < on_s || (t > supply.opens_s && at_zero) || (fires > 0.05 && at_zero && !fired) {
                is_open[p] = true;
            } else if t <= supply.opens_s && (fired || fires <= 0.05) {
                is_open[p] = false;
            }
            if is_open[p] { -OPEN * i[p] } else { supply.peak_v * angle(p).cos() }
        });
        before = i;
        let u = vector(legs);
        if k % every == 0 {
            let [a, b, c] = phases(u).map(|u| u + draw(0.5));
            let [ia, ib, ic] = i.map(|i| i + draw(0.02));
            let rpm = (x[4] + draw(0.1)) * 30.0 / PI;
            writeln!(text, "{t:.5},{a:.3},{b:.3},{c:.3},{ia:.4},{ib:.4},{ic:.4},{rpm:.3}").unwrap();
        }
        let slope = |x: &[f64; 5]| {
            let (i_s, i_r, psi_m) = currents(&[x[0], x[1], x[2], x[3]], knee);
            let torque = 3.0 * (psi_m[1] * i_r[0] - psi_m[0] * i_r[1]);
            let [s, r] =
                [[0, 1].map(|k| u[k] - R_S * i_s[k]), [-R_R * i_r[0] - 2.0 * x[4] * x[3], -R_R * i_r[1] + 2.0 * x[4] * x[2]]];
            [s[0], s[1], r[0], r[1], (torque - BRAKE_NM * (x[4] / 2.0).tanh()) / J]
        };
        let half: [f64; 5] = std::array::from_fn(|n| x[n] + 0.5 * h * slope(&x)[n]);
        let d = slope(&half);
        x.iter_mut().zip(d).for_each(|(x, d)| *x += h * d);
    }
    text
}

/// A nameplate's guess at that machine.
const MOTOR: &str = r#"[machine]
name = "bench"
pole_pairs = 2

[machine.parameters]
stator_resistance_ohm = { value = 7.4, tolerance = 1.0 }
rotor_resistance_ohm = { value = 3.9, tolerance = 0.2 }
stator_leakage_inductance_h = { value = 0.0107, tolerance = 0.3 }
rotor_leakage_inductance_h = { value = 0.0107, tolerance = 0.3 }
magnetizing_inductance_h = { value = 0.312, tolerance = 0.2 }
inertia_kg_m2 = { value = 0.017, tolerance = 1.5 }
viscous_friction_nm_s_per_rad = 0.00034

[machine.rating]
torque_nm = 10.0
electrical_frequency_hz = 50.0
phase_voltage_peak_v = 326.6
rotor_flux_vs = 0.914
"#;

/// Nothing is missing, or what is missing is named alone.
#[test]
fn a_supply_that_is_switched_is_no_effect() {
    let opened = Supply { opens_s: 0.6, ..MAINS };
    let soft = Supply { fires: 1.6, ramp_s: 0.4, ..MAINS };
    let reversed = Supply { reverses_s: 0.5, ..MAINS };
    for (name, supply, knee, length_s) in [
        ("opened", opened, 0.0, 1.0),
        ("opened, saturated", opened, 0.95, 1.0),
        ("soft", soft, 0.0, 0.9),
        ("reversed", reversed, 0.0, 1.0),
    ] {
        let f = Folder::new("switched-supply");
        let motor = f.file("motor.toml", MOTOR);
        let other = Supply { peak_v: 0.9 * supply.peak_v, ..supply };
        let rows = (2e-4, length_s);
        let [train, holdout] = [("a.csv", &supply, 1), ("b.csv", &other, 2)]
            .map(|(file, supply, seed)| f.file(file, &recorded(supply, knee, rows, seed)));
        done(&["compare", "--motor", &motor, "--data", &train, "--out", &f.path("compared")]);
        std::fs::rename(f.path("a.recording.toml"), f.path("recording.toml")).unwrap();
        let said = done(&["diagnose", "--motor", &motor, "--train", &train, "--holdout", &holdout, "--out", &f.path("out")]);
        let found: serde_json::Value = serde_json::from_str(&f.read("out/diagnosis.json")).unwrap();
        let wanted: &[&str] = if knee > 0.0 { &["main_flux_saturation"] } else { &[] };
        let named: Vec<&str> = found["effects"].as_array().unwrap().iter().filter_map(|e| e.as_str()).collect();
        assert_eq!(named, wanted, "{name}: {said}");
        assert_eq!(found["verdict"], if wanted.is_empty() { "adequate" } else { "missing_effects" }, "{name}: {said}");
        assert!(said.contains("found behind the noise of its sensor"), "{name}: {said}");
    }
}
