//! The direct-on-line start of the Modelica Standard Library.

use core::f64::consts::PI;
use std::path::Path;

use im_model::machines::MODELICA_IMC_DOL;
use im_model::space_vector::{from_phases, unit};
use im_model::{Effects, Machine, Plant, PlantInput, State};

#[test]
#[ignore = "needs the reference run in ../shared, which cannot be copied"]
fn the_modelica_start_is_followed() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/reference/modelica_imc_dol.csv");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |name: &str| header.iter().position(|h| *h == name).unwrap();
    let rows: Vec<Vec<f64>> = lines.map(|l| l.split(',').map(|x| x.parse().unwrap()).collect()).collect();
    let voltage = ["aimc.vs[1]", "aimc.vs[2]", "aimc.vs[3]"].map(column);
    let (time, speed, current) = (column("time"), column("aimc.wMechanical"), column("aimc.is[1]"));

    // The quadratic load 161.4 Nm (ω/ω_n)² is a windage.
    let mut e = Effects::none();
    let omega_n = 1440.45 * 2.0 * PI / 60.0;
    e.windage.coefficient_nm_s2 = 161.4 / (omega_n * omega_n);
    let m = &MODELICA_IMC_DOL;
    let plant = Plant::new(&Machine::try_new(m.parameters(), m.pole_pairs, e).unwrap());

    // Angle of the supply from a row with the switch closed.
    let w = 2.0 * PI * 50.0;
    let closed = rows.iter().find(|r| r[time] > 0.5).unwrap();
    let u = from_phases(voltage.map(|c| closed[c]));
    assert!((u.norm() - m.rating.phase_voltage_peak_v).abs() < 0.01, "windings see 100 V RMS: {}", u.norm());
    let angle = u.arg() - w * closed[time];

    let h = 1e-5;
    let hold = (0.5 * w * h).sin() / (0.5 * w * h);
    let mut x = State::default();
    let (mut k, mut worst_speed, mut worst_current) = (10_000u32, 0.0f64, 0.0f64);
    let last = rows.last().unwrap();
    for row in rows.iter().filter(|r| r[time] >= 0.1) {
        while f64::from(k) * h < row[time] - 0.5 * h {
            let u = unit(angle + w * h * (f64::from(k) + 0.5)) * (m.rating.phase_voltage_peak_v * hold);
            x = plant.step(&x, &PlantInput::new(u, 0.0), h);
            k += 1;
        }
        worst_speed = worst_speed.max((x.omega_m - row[speed]).abs());
        worst_current = worst_current.max((plant.currents(&x).i_s.re - row[current]).abs());
    }
    // The reference was solved to 1e-6 and its switches have 10 µΩ, 3e-4 of R_s: the speeds agree to 0.05 % of the final one
    // on the way and to 1e-5 at the end, currents to 0.1 % of the inrush peak of about 900 A.
    assert!(worst_speed < 5e-4 * last[speed], "speed is off by {worst_speed} rad/s on the way");
    assert!((x.omega_m / last[speed] - 1.0).abs() < 1e-5, "final speed {} against {}", x.omega_m, last[speed]);
    assert!(worst_current < 1.0, "winding current is off by {worst_current} A");
    assert!((plant.currents(&x).i_s.norm() / (2f64.sqrt() * 100.0) - 1.0).abs() < 1e-3);
    println!("worst speed error {worst_speed:.2e} rad/s, worst current error {worst_current:.2e} A");
}
