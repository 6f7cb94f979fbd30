//! The simulation studies of Jadot et al. (2009), one command each:
//!
//! ```text
//! cargo run --release -p im-lab --example jadot_studies -- trajectory   # Figs. 3–5
//! cargo run --release -p im-lab --example jadot_studies -- drift        # Figs. 6, 7
//! cargo run --release -p im-lab --example jadot_studies -- reduced      # Figs. 9–11
//! cargo run --release -p im-lab --example jadot_studies -- experiment   # Figs. 13, 14, in simulation
//! cargo run --release -p im-lab --example jadot_studies -- thermal      # Figs. 15, 16, in simulation
//! ```
//!
//! Without a name all are run; `--out DIR` writes the figures as SVG. Fig. 3 is described in words only and rebuilt here: high speed
//! and low load from t₀ to t₂, load from t₂ on, low speed from t₅ on.

mod bench;

use std::path::{Path, PathBuf};

use bench::{Row, SPEED_RAD_S, Scheme, Study, TORQUE_NM};
use im_design::plot::{Series, chart};
use im_lab::jadot_experiment::{Experiment, Seen, cold, nameplate};
use im_model::simulation::Profile;
use im_model::write_atomically;

const SYMBOLS: [&str; 4] = ["R_req", "L", "R_s", "L_f"];
/// More than 20 % wrong, as the paper says.
const START: [f64; 4] = [1.25, 0.75, 1.3, 0.75];
/// t₀, t₂, t₅ and the end of the rebuilt Fig. 3, s.
const TIMES: [f64; 4] = [4.0, 8.0, 16.0, 26.0];

/// Straight lines through points of time and value.
fn along(points: &[[f64; 2]], t: f64) -> f64 {
    let after = points.partition_point(|p| p[0] <= t).clamp(1, points.len() - 1);
    let ([t0, a], [t1, b]) = (points[after - 1], points[after]);
    a + (b - a) * ((t - t0) / (t1 - t0)).clamp(0.0, 1.0)
}

fn speed(t: f64) -> f64 {
    // Slowly up, so that there is little torque before t₀.
    along(
        &[
            [0.5, 0.0],
            [3.5, 100.0],
            [13.0, 100.0],
            [14.0, 50.0],
            [16.0, 50.0],
            [17.0, 3.0],
            [22.0, 3.0],
            [23.0, 30.0],
            [26.0, 30.0],
        ],
        t,
    )
}

fn load(t: f64) -> f64 {
    along(&[[0.5, 3.0], [8.0, 3.0], [10.0, 100.0], [18.0, 100.0], [19.0, 50.0], [21.0, 50.0], [22.0, 100.0], [26.0, 100.0]], t)
}

fn trajectory() -> Study<'static> {
    Study { duration_s: TIMES[3], speed_percent: &speed, load_percent: &load, resistances: &|_| [1.0, 1.0], start: START }
}

/// A quantity of a row with its name.
type Named<'a> = (&'a str, &'a dyn Fn(&Row) -> f64);
/// Reproduces some figures.
type Reproduce = fn(&Figures) -> Result<(), String>;

struct Figures {
    directory: Option<PathBuf>,
}

impl Figures {
    fn draw(&self, name: &str, title: &str, y: &str, series: &[(&str, Vec<(f64, f64)>)]) -> Result<(), String> {
        let series: Vec<Series> = series.iter().map(|(name, points)| Series::line(*name, points.iter().copied())).collect();
        self.write(name, &chart(title, "t, s", y, &series))
    }

    fn write(&self, name: &str, svg: &str) -> Result<(), String> {
        let Some(directory) = &self.directory else { return Ok(()) };
        let path = directory.join(name);
        std::fs::create_dir_all(directory).map_err(|e| format!("{}: {e}", directory.display()))?;
        write_atomically(&path, |out| std::io::Write::write_all(out, svg.as_bytes())).map_err(|e| e.to_string())
    }
}

/// Points per curve, so that the pictures stay small.
const POINTS: usize = 260;

fn curve(rows: &[Row], from: f64, y: impl Fn(&Row) -> f64) -> Vec<(f64, f64)> {
    rows.iter().step_by(rows.len().div_ceil(POINTS)).filter(|r| r.t >= from).map(|r| (r.t, y(r))).collect()
}

/// Mean of |y| between two times.
fn mean(rows: &[Row], from: f64, to: f64, y: impl Fn(usize, &Row) -> f64) -> f64 {
    let picked: Vec<f64> =
        rows.iter().enumerate().filter(|(_, r)| (from..to).contains(&r.t)).map(|(k, r)| y(k, r).abs()).collect();
    picked.iter().sum::<f64>() / picked.len().max(1) as f64
}

fn estimates_at(rows: &[Row], times: &[f64]) {
    println!("{:>8} {}", "t, s", SYMBOLS.map(|s| format!("{s:>8}")).join(" "));
    for t in times {
        if let Some(row) = rows.iter().rev().find(|r| r.t < *t) {
            println!("{t:>8.1} {}", row.estimates.map(|x| format!("{:>8.1}", 100.0 * x)).join(" "));
        }
    }
}

/// Torque and current estimates against the load and against what the current would be with the right parameters.
fn performance(name: &str, rows: &[Row], ideal: &[Row], spans: &[[f64; 2]]) {
    for [from, to] in spans {
        let torque = mean(rows, *from, *to, |_, r| r.torque_hat_nm / r.load_nm - 1.0);
        let current = mean(rows, *from, *to, |k, r| r.current_a / ideal[k].current_a - 1.0);
        println!("{name:<24} {from:>5.1} to {to:>5.1} s: torque {:>5.1} %, current {:>5.2} %", 100.0 * torque, 100.0 * current);
    }
}

fn figures_3_to_5(figures: &Figures) -> Result<(), String> {
    let study = trajectory();
    let ideal = study.run(Scheme::Ideal);
    let none = study.run(Scheme::None);
    let slow = study.run(Scheme::TimeScale);
    let fast = study.run(Scheme::TimeVarying);
    let printed = study.run(Scheme::TimeVaryingAsPrinted);
    let without = study.run(Scheme::TimeVaryingWithoutLeakage);
    println!("Estimates in percent of the parameters (Fig. 4); t0 {}, t2 {}, t5 {} s", TIMES[0], TIMES[1], TIMES[2]);
    let four = [
        ("time-scale", &slow),
        ("time-varying, forgetting", &fast),
        ("time-varying, (47) as printed", &printed),
        ("time-varying, (47) without L_f", &without),
    ];
    for (name, rows) in four {
        println!("{name}");
        estimates_at(rows, &[0.1, TIMES[0], TIMES[1], 10.0, 13.0, TIMES[2], 22.0, TIMES[3]]);
    }
    println!("\nMean deviations (Fig. 5): torque estimate from the load, current from the ideal one");
    // Speed constant, so that the torque is the load's.
    let spans = [[10.5, 13.0], [14.5, 16.0], [19.2, 20.9], [24.0, 26.0]];
    let all = [
        ("no adaptation", &none),
        ("time-scale", &slow),
        ("time-varying, forgetting", &fast),
        ("time-varying, (47) without L_f", &without),
    ];
    for (name, rows) in all {
        performance(name, rows, &ideal, &spans);
    }
    figures.draw(
        "fig3-reference.svg",
        "Reference trajectory (Fig. 3, rebuilt)",
        "percent",
        &[
            ("speed", curve(&ideal, 0.0, |r| 100.0 * r.speed_ref_rad_s / SPEED_RAD_S)),
            ("load", curve(&ideal, 0.0, |r| 100.0 * r.load_nm / TORQUE_NM)),
        ],
    )?;
    let plane = ideal.iter().step_by(ideal.len().div_ceil(POINTS));
    let visited = plane.map(|r| (100.0 * r.speed_ref_rad_s / SPEED_RAD_S, 100.0 * r.load_nm / TORQUE_NM));
    let series = [Series::line("the way through the operating points", visited)];
    figures.write("fig3-plane.svg", &chart("Operating points (Fig. 3, rebuilt)", "speed, percent", "load, percent", &series))?;
    for (k, symbol) in SYMBOLS.into_iter().enumerate() {
        let of = |rows: &[Row]| curve(rows, 0.0, |r| 100.0 * r.estimates[k]);
        figures.draw(
            &format!("fig4-{symbol}.svg"),
            &format!("{symbol} (Fig. 4)"),
            "estimate, percent of the truth",
            &[
                ("time-scale", of(&slow)),
                ("time-varying, forgetting", of(&fast)),
                ("time-varying, (47) as printed", of(&printed)),
                ("time-varying, (47) without L_f", of(&without)),
                ("first estimate", of(&none)),
            ],
        )?;
    }
    let from = 1.0;
    let three = [("no adaptation", &none), ("time-scale", &slow), ("time-varying, (47) without L_f", &without)];
    let torque: Vec<_> = three.map(|(n, rows)| (n, curve(rows, from, |r| r.torque_hat_nm))).into();
    let load = ("load", curve(&ideal, from, |r| r.load_nm));
    figures.draw("fig5-torque.svg", "Estimated load torque (Fig. 5)", "Nm", &[torque, vec![load]].concat())?;
    let current: Vec<_> = three.map(|(n, rows)| (n, curve(rows, from, |r| r.current_a))).into();
    let best = ("right parameters", curve(&ideal, from, |r| r.current_a));
    figures.draw("fig5-current.svg", "Current consumption (Fig. 5)", "A, peak", &[current, vec![best]].concat())
}

fn figures_6_and_7(figures: &Figures) -> Result<(), String> {
    // Up to (50 %, 50 %); then R_s + 30 %, R_r + 40 % over 30 s: slow against 1/T_r = 5.6 1/s, far faster than heat.
    let rise = |t: f64| ((t - 15.0) / 30.0).clamp(0.0, 1.0);
    let resistances = |t: f64| [1.0 + 0.3 * rise(t), 1.0 + 0.4 * rise(t)];
    let study = Study {
        duration_s: 60.0,
        speed_percent: &|t| along(&[[0.5, 0.0], [2.0, 50.0]], t),
        load_percent: &|_| 50.0,
        resistances: &resistances,
        start: [1.0; 4],
    };
    let slow = study.run(Scheme::TimeScale);
    let reduced = study.run(Scheme::Reduced);
    let none = study.run(Scheme::None);
    let tracking = |rows: &[Row], k: usize| mean(rows, 20.0, 60.0, |_, r| r.estimates[k] - 1.0);
    println!("Drift of the resistances at (50 %, 50 %): mean deviation of the estimates from 20 to 60 s, percent (Fig. 6)");
    for (name, rows) in [("no adaptation", &none), ("time-scale", &slow), ("reduced", &reduced)] {
        let all: Vec<String> = (0..4).map(|k| format!("{} {:>5.2}", SYMBOLS[k], 100.0 * tracking(rows, k))).collect();
        let torque = mean(rows, 45.0, 60.0, |_, r| r.torque_hat_nm / r.load_nm - 1.0);
        println!("{name:<16} {}; torque at the end {:.2} %", all.join(", "), 100.0 * torque);
    }
    // R_req, L, R_s over their values of Table I.
    let factor = |k: usize, t: f64| match k {
        0 => resistances(t)[1],
        2 => resistances(t)[0],
        _ => 1.0,
    };
    let percent = |rows: &[Row], k: usize| curve(rows, 5.0, |r| 100.0 * r.estimates[k] * factor(k, r.t));
    let truth = |k: usize| curve(&slow, 5.0, |r| 100.0 * factor(k, r.t));
    figures.draw(
        "fig6-drift.svg",
        "Estimates while the resistances drift (Fig. 6)",
        "percent of Table I",
        &[
            ("R_req", percent(&slow, 0)),
            ("L", percent(&slow, 1)),
            ("R_s", percent(&slow, 2)),
            ("L_f", percent(&slow, 3)),
            ("true R_req", truth(0)),
            ("true R_s", truth(2)),
        ],
    )?;
    let current = |rows: &[Row]| curve(rows, 5.0, |r| r.current_a);
    figures.draw(
        "fig7-current.svg",
        "Current consumption while the resistances drift (Fig. 7)",
        "A, peak",
        &[("no adaptation", current(&none)), ("time-scale", current(&slow)), ("reduced", current(&reduced))],
    )?;
    figures.draw(
        "fig7-torque.svg",
        "Estimated load torque while the resistances drift (Fig. 7)",
        "Nm",
        &[
            ("no adaptation", curve(&none, 5.0, |r| r.torque_hat_nm)),
            ("time-scale", curve(&slow, 5.0, |r| r.torque_hat_nm)),
            ("reduced", curve(&reduced, 5.0, |r| r.torque_hat_nm)),
            ("load", curve(&slow, 5.0, |r| r.load_nm)),
        ],
    )
}

fn figures_9_to_11(figures: &Figures) -> Result<(), String> {
    let study = trajectory();
    let ideal = study.run(Scheme::Ideal);
    let full = study.run(Scheme::TimeScale);
    let reduced = study.run(Scheme::Reduced);
    println!("Reduced scheme (Fig. 9), percent of the parameters");
    estimates_at(&reduced, &[0.1, TIMES[0], TIMES[1], 10.0, 13.0, TIMES[2], 22.0, TIMES[3]]);
    println!("\nMean deviations (Fig. 10)");
    let spans = [[10.5, 13.0], [14.5, 16.0], [19.2, 20.9], [24.0, 26.0]];
    for (name, rows) in [("full", &full), ("reduced", &reduced)] {
        performance(name, rows, &ideal, &spans);
    }
    let apart = mean(&full, 10.5, 16.0, |k, r| reduced[k].torque_hat_nm / r.torque_hat_nm - 1.0);
    println!("reduced against full, 10.5 to 16 s: torque estimates {:.2} % apart", 100.0 * apart);
    let of = |rows: &[Row], k: usize| curve(rows, 0.0, |r| 100.0 * r.estimates[k]);
    let series = [
        ("R_req, full", of(&full, 0)),
        ("R_req, reduced", of(&reduced, 0)),
        ("L, full", of(&full, 1)),
        ("L, reduced", of(&reduced, 1)),
    ];
    figures.draw("fig9-estimates.svg", "Full and reduced scheme (Fig. 9)", "estimate, percent of the truth", &series)?;
    let torque = |rows: &[Row]| curve(rows, 1.0, |r| r.torque_hat_nm);
    let load = ("load", curve(&ideal, 1.0, |r| r.load_nm));
    let series = [("full", torque(&full)), ("reduced", torque(&reduced)), load];
    figures.draw("fig10-torque.svg", "Estimated load torque (Fig. 10)", "Nm", &series)?;
    let current = |rows: &[Row]| curve(rows, 1.0, |r| r.current_a);
    let series = [("full", current(&full)), ("reduced", current(&reduced)), ("right parameters", current(&ideal))];
    figures.draw("fig10-current.svg", "Current consumption (Fig. 10)", "A, peak", &series)?;
    let states: [Named<'_>; 4] = [
        ("phi_d", &|r| r.phi[0].re),
        ("phi_q", &|r| r.phi[0].im),
        ("phi_d ref", &|r| r.phi[1].re),
        ("phi_q ref", &|r| r.phi[1].im),
    ];
    let series = states.map(|(n, y)| (n, curve(&reduced, 0.0, y)));
    figures.draw("fig11-flux.svg", "Flux with the reduced scheme (Fig. 11)", "Vs", &series)?;
    let states: [Named<'_>; 4] =
        [("i_d", &|r| r.i[0].re), ("i_q", &|r| r.i[0].im), ("i_d ref", &|r| r.i[1].re), ("i_q ref", &|r| r.i[1].im)];
    let series = states.map(|(n, y)| (n, curve(&reduced, 0.0, y)));
    figures.draw("fig11-current.svg", "Current with the reduced scheme (Fig. 11)", "A", &series)?;
    let speed = |rows: &[Row], y: &dyn Fn(&Row) -> f64| curve(rows, 0.0, |r| 100.0 * y(r) / SPEED_RAD_S);
    let series = [
        ("full", speed(&full, &|r| r.speed_rad_s)),
        ("reduced", speed(&reduced, &|r| r.speed_rad_s)),
        ("reference", speed(&reduced, &|r| r.speed_ref_rad_s)),
    ];
    figures.draw("fig11-speed.svg", "Speed (Fig. 11)", "percent of synchronous speed", &series)?;
    let off = mean(&reduced, 4.0, 26.0, |_, r| (r.speed_rad_s - r.speed_ref_rad_s) / SPEED_RAD_S);
    println!("speed, mean deviation from its reference: {:.3} % of synchronous speed (Fig. 11)", 100.0 * off);
    for [from, to] in [[5.0, 8.0], [10.5, 13.0], [19.2, 20.9], [24.0, 26.0]] {
        let flux = mean(&reduced, from, to, |_, r| r.phi[0].norm() / r.phi[1].norm());
        println!("flux over its reference, {from} to {to} s: {flux:.3} (Fig. 11)");
    }
    Ok(())
}

/// A profile with points every tenth of a second.
fn profile(duration_s: f64, of: impl Fn(f64) -> f64) -> Profile {
    let points = (0..=(10.0 * duration_s) as u32).map(|k| 0.1 * f64::from(k)).map(|t| [t, of(t)]);
    Profile::points(points.collect::<Vec<_>>()).expect("times in order")
}

/// Means over as many rows as make few points of them.
fn picked(rows: &[Seen], y: impl Fn(&Seen) -> f64) -> Vec<(f64, f64)> {
    let mean = |rows: &[Seen]| rows.iter().map(&y).sum::<f64>() / rows.len() as f64;
    rows.chunks(rows.len().div_ceil(POINTS)).filter(|r| r[0].t >= 1.0).map(|r| (r[r.len() / 2].t, mean(r))).collect()
}

/// Means over a span: torque estimate over load and current estimate over current, less one; estimates of R_req and L, and the truth.
fn experienced(name: &str, rows: &[Seen], [from, to]: [f64; 2]) {
    let span: Vec<&Seen> = rows.iter().filter(|r| (from..to).contains(&r.t)).collect();
    let mean = |y: &dyn Fn(&Seen) -> f64| 100.0 * span.iter().map(|r| y(r)).sum::<f64>() / span.len() as f64;
    println!(
        "{name:<14} {from:>6.1} to {to:>6.1} s: torque {:>6.1} %, current {:>6.1} % ({:.2} A); R_req {:>5.1} of {:>5.1}, L {:>5.1} of {:>5.1}, \
         R_s of {:>5.1}",
        mean(&|r| r.torque_hat_nm / r.load_nm - 1.0),
        mean(&|r| r.current_hat_a / r.current_a - 1.0),
        mean(&|r| r.current_a) / 100.0,
        mean(&|r| r.estimates[0]),
        mean(&|r| r.truth[1]),
        mean(&|r| r.estimates[1]),
        mean(&|r| r.truth[2]),
        mean(&|r| r.truth[0]),
    );
}

fn figures_13_and_14(figures: &Figures) -> Result<(), String> {
    let duration_s = TIMES[3];
    let experiment = |start| Experiment {
        duration_s,
        speed_rad_s: profile(duration_s, |t| speed(t) * SPEED_RAD_S / 100.0),
        load_nm: profile(duration_s, |t| load(t) * TORQUE_NM / 100.0),
        heats: false,
        start,
    };
    let commissioned = nameplate().scaled([1.0, 1.0, cold().values()[2] / nameplate().values()[2], 1.0]);
    let first: [String; 4] =
        core::array::from_fn(|k| format!("{} {:.0} %", SYMBOLS[k], 100.0 * nameplate().values()[k] / cold().values()[k]));
    println!("The nameplate's guess, of Table I: {}", first.join(", "));
    let [none, reduced] = [false, true].map(|adapts| experiment(commissioned).run(adapts));
    let guessed = experiment(nameplate()).run(true);
    for span in [[10.5, 13.0], [14.5, 16.0], [19.2, 20.9], [24.0, 26.0]] {
        experienced("no adaptation", &none, span);
        experienced("reduced", &reduced, span);
        experienced("R_s guessed", &guessed, span);
    }
    let percent = |k: usize| picked(&reduced, |r| 100.0 * r.estimates[k]);
    let series = [
        ("R_req", percent(0)),
        ("L", percent(1)),
        ("true R_req", picked(&reduced, |r| 100.0 * r.truth[1])),
        ("true L", picked(&reduced, |r| 100.0 * r.truth[2])),
    ];
    figures.draw("jadot_fig13_estimates.svg", "Adaptation on the simulated bench (Fig. 13)", "percent of Table I", &series)?;
    let speeds = [("speed", picked(&reduced, |r| 100.0 * r.speed_rad_s / SPEED_RAD_S))];
    figures.draw("jadot_fig14_speed.svg", "Speed on the simulated bench (Fig. 14)", "percent of synchronous speed", &speeds)?;
    observed(figures, "jadot_fig14", "(Fig. 14, simulated)", &none, &reduced)
}

/// Torque and current, without and with adaptation.
fn observed(figures: &Figures, file: &str, figure: &str, none: &[Seen], reduced: &[Seen]) -> Result<(), String> {
    let torque = |rows| picked(rows, |r| r.torque_hat_nm);
    let series = [("no adaptation", torque(none)), ("reduced", torque(reduced)), ("load", picked(none, |r| r.load_nm))];
    figures.draw(&format!("{file}_torque.svg"), &format!("Estimated load torque {figure}"), "Nm", &series)?;
    let series = [
        ("estimated, no adaptation", picked(none, |r| r.current_hat_a)),
        ("measured", picked(none, |r| r.current_a)),
        ("estimated, reduced", picked(reduced, |r| r.current_hat_a)),
        ("measured, reduced", picked(reduced, |r| r.current_a)),
    ];
    figures.draw(&format!("{file}_current.svg"), &format!("Current consumption {figure}"), "A, peak", &series)
}

fn figures_15_and_16(figures: &Figures) -> Result<(), String> {
    let experiment = Experiment {
        duration_s: 1800.0,
        speed_rad_s: Profile::points([[0.5, 0.0], [2.0, 0.5 * SPEED_RAD_S]]).expect("times in order"),
        load_nm: Profile::points([[3.0, 0.0], [4.0, TORQUE_NM]]).expect("times in order"),
        heats: true,
        start: cold(),
    };
    let [none, reduced] = [false, true].map(|adapts| experiment.run(adapts));
    for span in [[20.0, 30.0], [300.0, 310.0], [900.0, 910.0], [1790.0, 1800.0]] {
        experienced("no adaptation", &none, span);
        experienced("reduced", &reduced, span);
    }
    let series = [
        ("R_req", picked(&reduced, |r| 100.0 * r.estimates[0])),
        ("L", picked(&reduced, |r| 100.0 * r.estimates[1])),
        ("true R_req", picked(&reduced, |r| 100.0 * r.truth[1])),
        ("true L", picked(&reduced, |r| 100.0 * r.truth[2])),
        ("true R_s", picked(&reduced, |r| 100.0 * r.truth[0])),
    ];
    figures.draw(
        "jadot_fig15_estimates.svg",
        "Adaptation while the windings heat up (Fig. 15, simulated)",
        "percent of Table I",
        &series,
    )?;
    observed(figures, "jadot_fig16", "(Fig. 16, simulated)", &none, &reduced)
}

fn main() -> Result<(), String> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let out = arguments.iter().position(|a| a == "--out").and_then(|k| arguments.get(k + 1));
    let figures = Figures { directory: out.map(|d| Path::new(d).to_owned()) };
    let name = arguments.first().filter(|a| *a != "--out").map_or("all", String::as_str);
    let studies: [(&str, Reproduce); 5] = [
        ("trajectory", figures_3_to_5),
        ("drift", figures_6_and_7),
        ("reduced", figures_9_to_11),
        ("experiment", figures_13_and_14),
        ("thermal", figures_15_and_16),
    ];
    let mut ran = false;
    for (study, run) in studies.into_iter().filter(|(study, _)| name == "all" || name == *study) {
        println!("== {study}");
        run(&figures)?;
        println!();
        ran = true;
    }
    if ran {
        Ok(())
    } else {
        Err(format!("no study named {name}: expected trajectory, drift, reduced, experiment, thermal or nothing"))
    }
}
