//! A measured start of a 4-kW machine, direct on line, with a load step. What is known of the machine is what its tests without load and
//! with locked rotor give: R_s 1.267 Ω (direct current), locked 2.397 + j5.04 Ω, unloaded j42.95 Ω at 50 Hz.

use std::fmt::Write;
use std::path::Path;

use im_model::machines::NamedMachine;
use im_model::space_vector::from_phases;
use im_model::{Rating, WindingParameters};
use im_observers::Input;

use crate::study::{Kind, Maker};
use im_lab::observation::C;

fn machine() -> NamedMachine {
    let omega = 2.0 * core::f64::consts::PI * 50.0;
    let leakage = 0.5 * 5.04 / omega;
    let l_s = 42.95 / omega;
    let l_m = l_s - leakage;
    NamedMachine {
        name: "measured_4_kw",
        source: "",
        windings: WindingParameters {
            stator_resistance_ohm: 1.267,
            rotor_resistance_ohm: (2.397 - 1.267) * (l_s / l_m).powi(2),
            stator_inductance_h: l_s,
            rotor_inductance_h: l_s,
            mutual_inductance_h: l_m,
            inertia_kg_m2: 0.054,
            viscous_friction_nm_s_per_rad: 0.0,
        },
        pole_pairs: 2,
        rating: Rating { torque_nm: 26.0, electrical_frequency_hz: 50.0, phase_voltage_peak_v: 325.0, rotor_flux_vs: 0.95 },
    }
}

/// The error of each observer's mean speed unloaded and loaded, against the calibrated tachometer.
pub fn table(file: &Path) -> Result<String, Box<dyn std::error::Error>> {
    let text = std::fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()))?;
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|x| x.trim().parse::<f64>()).collect::<Result<Vec<_>, _>>())
        .collect::<Result<_, _>>()
        .map_err(|e| format!("{}: {e}", file.display()))?;
    if rows.len() < 2 || rows.iter().any(|r| r.len() < 11) {
        return Err(format!(
            "{}: time, three voltages, three currents, ..., the tachometer in column 11 were expected",
            file.display()
        )
        .into());
    }
    let period = rows[1][0] - rows[0][0];
    let mean = |column: usize, from: f64, to: f64| {
        let x: Vec<f64> = rows.iter().filter(|r| (from..to).contains(&r[0])).map(|r| r[column]).collect();
        x.iter().sum::<f64>() / x.len() as f64
    };
    // The tachometer: zero at standstill, a synchronous speed of 1500 rpm less a slip of 0.3 % without load.
    let (zero, unloaded) = (mean(10, 0.0, 0.03), mean(10, 0.5, 1.0));
    let gain = 0.997 * 157.08 / (unloaded - zero);
    let offsets: Vec<f64> = (1..7).map(|c| mean(c, 0.0, 0.03)).collect();
    let vector = |r: &[f64], first: usize| from_phases([0, 1, 2].map(|k| r[first + k] - offsets[first + k - 1]));
    let maker = Maker::new(&machine());
    let mut text = String::from(
        "### A measured start of a 4-kW machine\n\nMean error of the speed against the tachometer, rad/s, and how it scatters (the tachometer: 3 % of itself).\n\n\
         | Observer | no load, 0.6 to 1.0 s | loaded, 1.2 to 1.5 s | after, 1.7 to 2.0 s | valid, % of rows from 0.5 s |\n| --- | --- | --- | --- | --- |\n",
    );
    for kind in Kind::ALL {
        let mut observer = maker.make_at(kind, period);
        let mut before = C::new(0.0, 0.0);
        let (mut seen, mut valid) = (0usize, 0usize);
        let estimates: Vec<(f64, f64)> = rows
            .iter()
            .map(|r| {
                let (u, i) = (vector(r, 1), vector(r, 4));
                let omega = (r[10] - zero) * gain;
                // Instants, 0.2 ms apart: the mean over a sample is that of its ends.
                let e = observer.step(&Input::new((before + u) * 0.5, i).with_speed(omega));
                before = u;
                if r[0] > 0.5 {
                    (seen, valid) = (seen + 1, valid + usize::from(e.status.is_valid()));
                }
                (r[0], e.omega_m - omega)
            })
            .collect();
        let window = |from: f64, to: f64| {
            let x: Vec<f64> = estimates.iter().filter(|(t, _)| (from..to).contains(t)).map(|x| x.1).collect();
            let m = x.iter().sum::<f64>() / x.len() as f64;
            format!("{m:.2} ± {:.2}", (x.iter().map(|x| (x - m) * (x - m)).sum::<f64>() / x.len() as f64).sqrt())
        };
        let share = 100.0 * valid as f64 / seen as f64;
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {share:.0} |",
            kind.name(),
            window(0.6, 1.0),
            window(1.2, 1.5),
            window(1.7, 2.0)
        );
    }
    Ok(text + "\n")
}
