//! The two simulation studies of Kenné et al. (2005), Section IV: `cargo run --release -p im-lab --example kenne_studies [FOLDER]`.
//!
//! Prints the figures of docs/background/controllers.md; with a folder, draws the curves of the paper's Fig. 1 and Fig. 2 into it.

use std::error::Error;
use std::f64::consts::PI;

use im_design::plot::{Series, chart};
use im_lab::kenne_study::{Law, Row, Study, designed_gains};

/// The paper's constants: flux reference (Wb², in the reference of its windings), speed, load, resistances.
const F_REF: f64 = 0.0645;
const SPEED: f64 = 145.0;
const LOAD: f64 = 6.89;
const R_R: f64 = 0.7;
const R_S: f64 = 8.65;
/// Of the machine's rating, V peak.
const VOLTAGE: f64 = 311.0;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).map(std::path::PathBuf::from);
    let constant = im_lab::kenne_study::constant(3.0);
    // The periods of the sines are not printed: 2 s here, with R_r between nominal and twice that.
    let slow = |t: f64| 2.0 * PI * t / 2.0;
    let varying = Study {
        duration_s: 6.0,
        speed: &|t| SPEED * (1.0 + 0.04 * slow(t).sin()),
        load: &|t| LOAD * (1.0 + 0.5 * slow(t).sin()),
        r_r: &|t| R_R * (1.5 - 0.5 * slow(t).cos()),
        r_s: &|t| if t < 2.0 { R_S } else { 1.5 * R_S },
        ..constant
    };
    // 8 % of the largest current.
    let noise_a = 0.08 * im_lab::kenne_study::CURRENT_A;
    let noisy = Study { noise_a, ..constant };
    let all = Study { noise_a, ..varying };
    let studies =
        [("constant", Some("fig1"), constant), ("varying", None, varying), ("noisy", None, noisy), ("all", Some("fig2"), all)];
    let [k_sq, k_sd] = designed_gains();
    println!("(25), (26) ask for k_vsq = {k_sq:.0} V, k_vsd = {k_sd:.0} V; Table I has 50 V and 5 V\n");
    println!("| study | law | speed within | after s | flux² within | after s | R_r within | after s | peak current A |");
    println!("|---|---|---|---|---|---|---|---|---|");
    for (name, figure, study) in studies {
        let laws = [("signs", Law::Signs, 0.0), ("layers", Law::Layers, 0.0), ("layers, designed", Law::Designed, 0.0)];
        let within = [
            ("signs, 311 V", Law::Signs, VOLTAGE),
            ("layers, 311 V", Law::Layers, VOLTAGE),
            ("designed, 311 V", Law::Designed, VOLTAGE),
        ];
        for (law, how, voltage_v) in laws.into_iter().chain(within.into_iter().filter(|_| figure.is_some())) {
            let rows = Study { voltage_v, ..study }.run(how);
            println!("| {name} | {law} | {} |", summary(&rows));
            // Fig. 1 with Table I within 311 V; Fig. 2 so, and with what it needs: gains that satisfy the paper's conditions, and voltage.
            let name = match (figure, law) {
                (Some("fig1"), "layers, 311 V") => "fig1",
                (Some("fig2"), "layers, designed") => "fig2",
                (Some("fig2"), "layers, 311 V") => "fig2_table_i",
                _ => continue,
            };
            if let Some(folder) = &folder {
                draw(folder, name, &rows)?;
            }
        }
    }
    Ok(())
}

/// The largest error of each quantity in the last half, and when it came within that (or a thousandth) for good.
fn summary(rows: &[Row]) -> String {
    let of = |error: &dyn Fn(&Row) -> f64| {
        let worst = rows[rows.len() / 2..].iter().fold(1e-3f64, |w, r| w.max(error(r).abs()));
        let settled = rows.iter().rev().find(|r| error(r).abs() > worst).map_or(0.0, |r| r.t);
        format!("{:.1} % | {settled:.2}", 100.0 * worst)
    };
    let (speed, flux) = (of(&|r| r.omega / r.omega_ref - 1.0), of(&|r| r.flux2 / F_REF - 1.0));
    let peak = rows.iter().fold(0.0f64, |p, r| p.max(r.current));
    format!("{speed} | {flux} | {} | {peak:.1}", of(&|r| r.r_r_hat / r.r_r - 1.0))
}

fn draw(folder: &std::path::Path, figure: &str, rows: &[Row]) -> Result<(), Box<dyn Error>> {
    let every = rows.len().div_ceil(300);
    let line = |name: &str, of: &dyn Fn(&Row) -> f64| Series::line(name, rows.iter().step_by(every).map(|r| (r.t, of(r))));
    let pictures = [
        (
            "flux",
            "Squared rotor flux, Wb²",
            vec![line("estimated", &|r| r.flux2_hat), line("reference", &|_| F_REF), line("of the machine", &|r| r.flux2)],
        ),
        ("torque", "Torque, Nm", vec![line("estimated", &|r| r.torque_hat), line("load", &|r| r.load)]),
        ("speed", "Speed, rad/s", vec![line("speed", &|r| r.omega), line("reference", &|r| r.omega_ref)]),
        ("resistance", "Rotor resistance, Ω", vec![line("estimated", &|r| r.r_r_hat), line("of the machine", &|r| r.r_r)]),
    ];
    for (name, label, series) in pictures {
        let title = format!("Kenné et al., {figure}: {name}").replace("fig", "Fig. ").replace("_table_i", ", Table I, 311 V");
        let svg = chart(&title, "Time, s", label, &series);
        im_model::write_atomically(&folder.join(format!("kenne_{figure}_{name}.svg")), |w| {
            std::io::Write::write_all(w, svg.as_bytes())
        })?;
    }
    Ok(())
}
