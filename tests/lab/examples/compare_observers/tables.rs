//! Tables as Markdown, maps as text, pictures as SVG.

use std::fmt::Write;

use im_design::plot::{Series, chart, chart_within};
use im_model::machines::JADOT_TABLE_I;
use im_model::simulation::Profile;
use im_model::space_vector::unit;
use im_observers::*;

use crate::study::{H, Kind, Maker, Study};
use im_lab::observation::{Truth, scenario};

/// Three figures: more are not known.
fn figure(x: f64) -> String {
    match x.abs() {
        x if !x.is_finite() || x > 999.0 => "off".into(),
        a if a >= 9.95 => format!("{x:.0}"),
        a if a >= 0.095 => format!("{x:.1}"),
        a if a >= 0.000_5 => format!("{x:.3}"),
        _ => "0".into(),
    }
}

fn maybe(x: Option<f64>, unit: &str, none: &str) -> String {
    x.map_or(none.into(), |x| format!("{}{unit}", figure(x)))
}

pub fn all(studies: &[Study]) -> String {
    let mut text = String::new();
    for s in studies {
        let _ = writeln!(text, "### {}\n", s.maker.named.name);
        let _ = writeln!(
            text,
            "| Observer | converges, s | steady error % | 1 % noise gives % | lowest speed % | regenerating % |\n| --- | --- | --- | --- | --- | --- |"
        );
        for (kind, f) in &s.figures {
            let _ = writeln!(
                text,
                "| {} | {} | {} | {} | {} | {} |",
                kind.name(),
                maybe(f.converges_s, "", "never"),
                figure(f.steady),
                figure(f.noise),
                maybe(f.lowest, "", "none"),
                figure(f.regenerating)
            );
        }
        let _ = writeln!(text, "\n| Observer | R_s × 0.5 | R_s × 1.5 | R_r × 0.5 | R_r × 2 |\n| --- | --- | --- | --- | --- |");
        for (kind, f) in &s.figures {
            let cells = f.parameters.map(|p| p.map(figure).join(" / ")).join(" | ");
            let _ = writeln!(text, "| {} | {cells} |", kind.name());
        }
        text.push('\n');
    }
    text
}

/// The largest speed error at the end of a run of an observer that starts 3° and 5 % off.
fn last_error<O: Observer<f64>>(observer: &O, truth: &Truth) -> f64 {
    let state = observer.state_at(truth.flux[0] * unit(0.05), truth.recording.i_s[0], 1.05 * truth.omega[0]);
    let e = truth.observe_from(observer, 1, state);
    e[e.len() - 1000..].iter().map(|e| (e.omega_m - truth.omega[0]).abs()).fold(0.0, f64::max)
}

/// Maps of convergence over speed and stator frequency.
pub fn maps() -> String {
    let maker = Maker::new(&JADOT_TABLE_I);
    let machine = maker.machine();
    let rating = maker.named.rating;
    let basis = Basis::try_new(&machine, &rating, H).expect("valid");
    let (p, i) = KubotaGains::speed_law(&machine, &rating, 100.0);
    let utkin = Utkin::try_new(basis, UtkinGains::for_machine(&machine, &rating)).expect("fits");
    let without = Kubota::try_new(basis, KubotaGains::without_feedback(p, i)).expect("fits");
    let stabilized = Kubota::try_new(basis, KubotaGains::stabilized(&machine, 0.5, p, i).expect("valid")).expect("fits");
    let speeds = [5.0, 10.0, 20.0, 40.0, 80.0, 120.0];
    let slips = [-24.0, -16.0, -12.0, -8.0, -4.0, 0.0, 4.0, 8.0, 16.0];
    let mut text = String::from(
        "### Where they converge: jadot_table_i, speed in rad/s down, slip in rad/s across\n\n`+` converges, `-` does not, `0` has |stator frequency| below 3 rad/s.\n\n```text\n",
    );
    let _ = writeln!(text, "{:>8}  {:<29} {:<29} Kubota, stabilized", "", "Utkin", "Kubota, L = 0");
    let heads: String = slips.iter().map(|s| format!("{s:>3.0}")).collect();
    let _ = writeln!(text, "{:>8}  {heads:<29} {heads:<29} {heads}", "");
    for speed in speeds {
        let _ = write!(text, "{speed:>8}  ");
        for which in 0..3 {
            let cells: String = slips
                .iter()
                .map(|&slip: &f64| {
                    if (2.0 * speed + slip).abs() < 3.0 {
                        return "  0";
                    }
                    let truth = maker.at(speed, slip, 3.0, 0.0);
                    let off = match which {
                        0 => last_error(&utkin, &truth),
                        1 => last_error(&without, &truth),
                        _ => last_error(&stabilized, &truth),
                    };
                    if off < 0.05 * speed { "  +" } else { "  -" }
                })
                .collect();
            let _ = write!(text, "{cells:<29} ");
        }
        text.push('\n');
    }
    text + "```\n\n"
}

/// Pictures: a manoeuvre with every sensorless observer, its errors, and the error of a wrong R_s over speed.
pub fn pictures() -> Vec<(&'static str, String)> {
    let maker = Maker::new(&JADOT_TABLE_I);
    let m = maker.named;
    let hz = Profile::points([[0.0, 0.0], [0.2, 0.0], [0.7, 40.0], [1.5, 40.0], [1.9, 5.0], [2.6, 5.0], [3.2, -40.0]])
        .expect("ordered");
    let load = Profile::points([[1.0, 0.0], [1.0, 10.0], [2.3, 10.0], [2.3, 0.0]]).expect("ordered");
    let truth = Truth::of(&maker.machine(), &scenario(&m, hz, load, 4.0));
    let shown = [Kind::FullOrder, Kind::Kubota, Kind::Derdiyok, Kind::Utkin, Kind::ThauPublished];
    let names = ["full-order", "Kubota, stabilized", "Derdiyok, anchored", "Utkin", "Thau, L = 0"];
    let rows = || (0..truth.len()).step_by(100);
    let line = |name: &str, points: Vec<_>| Series::line(name, points);
    let mut speeds = vec![line("true", rows().map(|k| (truth.time_s(k), truth.omega[k])).collect())];
    // One colour each in all pictures.
    let mut errors = vec![line("true", rows().map(|k| (truth.time_s(k), 0.0)).collect())];
    for (kind, name) in shown.into_iter().zip(names) {
        let e = maker.make(kind, 1.0, 1.0).over(&truth);
        speeds.push(line(name, rows().map(|k| (truth.time_s(k), e[k].omega_m)).collect()));
        errors.push(line(name, rows().map(|k| (truth.time_s(k), e[k].omega_m - truth.omega[k])).collect()));
    }
    let mut wrong: Vec<Series> = ["true"].iter().chain(&names).map(|name| line(name, Vec::new())).collect();
    for share in [0.01, 0.015, 0.02, 0.03, 0.04, 0.05, 0.07, 0.1, 0.15, 0.2] {
        let truth = maker.at(share * maker.speed(), maker.slip(0.4), 3.0, 0.0);
        wrong[0].points.push((100.0 * share, 0.0));
        for (kind, line) in shown.into_iter().zip(&mut wrong[1..]) {
            let e = maker.make(kind, 0.9, 1.0).over(&truth);
            let mean = e[e.len() - 5000..].iter().map(|e| e.omega_m).sum::<f64>() / 5000.0 - share * maker.speed();
            line.points.push((100.0 * share, 100.0 * mean / maker.speed()));
        }
    }
    let speed = "speed, rad/s";
    vec![
        ("manoeuvre.svg", chart("Start, load step, 5 Hz, reversal (jadot_table_i)", "t, s", speed, &speeds)),
        ("errors.svg", chart_within("Error of the estimated speed in it", "t, s", "rad/s", [-20.0, 20.0], &errors)),
        (
            "stator_resistance.svg",
            chart("R_s believed 10 % too small, 40 % torque", "speed, % of rated", "speed error, % of rated", &wrong),
        ),
    ]
}
