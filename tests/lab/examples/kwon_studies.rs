//! The least-current drive of Kwon et al. (2005) on the machine of their Table V: Fig. 7 with what the drive settles at, and Fig. 12.
//!
//! ```text
//! cargo run --release -p im-lab --example kwon_studies [FOLDER]
//! ```
//!
//! Prints the tables of docs/background/controllers.md; with a folder, draws the curves into it. The speed is measured, or estimated by an observer that
//! knows a T circuit of the machine.

use std::error::Error;
use std::path::Path;

use im_control::MtpaLaw;
use im_design::mtpa::{AirGap, Aqdm, CurrentLaw, SlipLaw, for_torque};
use im_design::plot::{Series, chart};
use im_lab::aqdm::{SOURCES, STABILIZED, fitted, run_with};

const TORQUES_NM: [f64; 6] = [5.0, 20.0, 50.0, 100.0, 150.0, 200.0];
/// What is drawn: the speed measured, and by the paper's observer without and with a load torque that balances friction too.
const DRAWN: [&str; 3] = ["sensor", "thau", "thau, balanced"];

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).map(std::path::PathBuf::from);
    let drawn = fig_7()?;
    let others = fig_12()?;
    if let Some(folder) = folder {
        std::fs::create_dir_all(&folder)?;
        for (name, svg) in drawn.into_iter().chain(others) {
            write(&folder.join(name), &svg)?;
        }
    }
    Ok(())
}

fn write(path: &Path, svg: &str) -> Result<(), Box<dyn Error>> {
    Ok(im_model::write_atomically(path, |out| std::io::Write::write_all(out, svg.as_bytes()))?)
}

type Pictures = Vec<(&'static str, String)>;

/// Current and slip over torque: the circuit's optimum, the laws, the drive.
fn fig_7() -> Result<Pictures, Box<dyn Error>> {
    let circuit = Aqdm::kwon_table_v();
    println!("| speed by | law | {} |", TORQUES_NM.map(|t| format!("{t:.0} Nm")).join(" | "));
    println!("|---|---|{}", "---|".repeat(TORQUES_NM.len()));
    let mut marks: Vec<Vec<[f64; 3]>> = Vec::new();
    let mut errors = Vec::new();
    let laws = SOURCES.into_iter().chain([STABILIZED]).map(|source| (source, "fitted", fitted()));
    for (source, name, law) in std::iter::once((SOURCES[0], "(30), (31)", MtpaLaw::kwon_printed())).chain(laws) {
        let mut cells = Vec::new();
        let mut points = Vec::new();
        for torque in TORQUES_NM {
            if torque < law.torque_nm[0] {
                cells.push("–".to_owned());
                continue;
            }
            let s = run_with(source, &law, 1.0, torque)?;
            points.push([s.torque_nm, s.current_rms_a, s.slip_rad_s]);
            if torque == TORQUES_NM[4] {
                errors.push(format!("{source} {:+.3}", s.speed_error_rad_s));
            }
            // A drive that has lost the speed does not give the torque at all.
            cells.push(if s.torque_nm < 0.5 * torque {
                format!("{:.1} Nm, lost", s.torque_nm)
            } else {
                let least = for_torque(&circuit, s.torque_nm)?.current_rms_a;
                format!("{:.1}, {:+.2} %", s.torque_nm, 100.0 * (s.current_rms_a / least - 1.0))
            });
        }
        println!("| {source} | {name} | {} |", cells.join(" | "));
        if name == "fitted" && DRAWN.contains(&source) {
            marks.push(points);
        }
    }
    println!(
        "\nTorque, and fundamental of the current over the least for it. Errors of the speed at 150 Nm, rad/s: {}\n",
        errors.join(", ")
    );
    let torques: Vec<f64> = (1..=60).map(|k| 4.0 * f64::from(k)).collect();
    let best = torques.iter().map(|t| for_torque(&circuit, *t)).collect::<Result<Vec<_>, _>>()?;
    let printed = |of: &dyn Fn(f64) -> f64| torques.iter().filter(|t| **t >= 19.0).map(|t| (*t, of(*t))).collect::<Vec<_>>();
    let picture = |k: usize, title: &str, label: &str, law: &str, of: &dyn Fn(f64) -> f64| {
        let optimum = best.iter().map(|o| (o.torque_n_m, [o.current_rms_a, o.slip_rad_s][k]));
        let at = |n: usize| marks[n].iter().filter(|p| p[0] > 1.0).map(|p| (p[0], p[k + 1])).collect::<Vec<_>>();
        let mut all = vec![Series::line("optimum of Table V", optimum), Series::line(law, printed(of))];
        all.extend(DRAWN.iter().enumerate().map(|(n, source)| Series::crosses(format!("drive ({source})"), at(n))));
        chart(title, "torque, Nm", label, &all)
    };
    let current = picture(0, "Kwon et al., Fig. 7a", "winding current, A rms", "(30) as printed", &|t| CurrentLaw::KWON.at(t));
    let slip = picture(1, "Kwon et al., Fig. 7b", "slip, electrical rad/s", "(31) as printed", &|t| SlipLaw::KWON.at(t));
    Ok(vec![("kwon_fig7_current.svg", current), ("kwon_fig7_slip.svg", slip)])
}

/// Torque of the circuit at an rms current and slip: the flux by bisection, since the current grows with it.
fn torque_at(circuit: &Aqdm, current: f64, slip: f64) -> f64 {
    let (mut low, mut high) = (1e-6f64, 3.0f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if circuit.operate(middle, slip).0 < current { low = middle } else { high = middle }
    }
    circuit.operate(low, slip).1
}

/// Torque at the current for 150 Nm, over the slip.
fn fig_12() -> Result<Pictures, Box<dyn Error>> {
    let (circuit, law) = (Aqdm::kwon_table_v(), fitted());
    let (current, slip) = law.at(150.0);
    let factors = [0.6, 0.8, 0.9, 1.0, 1.1, 1.2, 1.4];
    println!("| slip over the law's | {} |", factors.map(|f| f.to_string()).join(" | "));
    println!("|---|{}", "---|".repeat(factors.len()));
    println!(
        "| circuit of Table V, Nm | {} |",
        factors.map(|f| format!("{:.2}", torque_at(&circuit, current, f * slip))).join(" | ")
    );
    let line = (50..=150).map(|k| 0.01 * f64::from(k)).map(|f| (f, torque_at(&circuit, current, f * slip)));
    let mut all = vec![Series::line("circuit of Table V", line)];
    for source in SOURCES {
        let points = factors
            .iter()
            .map(|f| Ok((*f, run_with(source, &law, *f, 150.0)?.torque_nm)))
            .collect::<Result<Vec<_>, Box<dyn Error>>>()?;
        println!("| {source}, Nm | {} |", points.iter().map(|p| format!("{:.2}", p.1)).collect::<Vec<_>>().join(" | "));
        if DRAWN.contains(&source) {
            all.push(Series::crosses(format!("drive ({source})"), points));
        }
    }
    let picture =
        chart("Kwon et al., Fig. 12: the current of 150 Nm at other slips", "slip over that of the law", "torque, Nm", &all);
    Ok(vec![("kwon_fig12.svg", picture)])
}
