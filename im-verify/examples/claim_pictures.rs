//! Draws the claims that fail: `cargo run --release -p im-verify --example claim_pictures docs/images/claims`.
//!
//! From the simplest counterexample (`tests/counterexamples`) one variable is taken through its range, the others staying: how far is what
//! is over what is allowed? Where another claim mends it, its curve stands beside. The axis is linear where the ratio stays small, and
//! logarithmic where it does not.

use std::error::Error;
use std::io::Write as _;
use std::path::Path;

use im_chart::{Series, chart_within};
use im_model::write_atomically;
use im_verify::{Claim, MACHINE, Machines, Point, Variable, case_file, claims};

/// A claim that fails, the variable, what it is, and the claim that mends it, with how, if it has the same variables.
type Picture = (u32, &'static str, &'static str, Option<(u32, &'static str)>);

const LOWEST: &str = "frequency over the lowest of the rule";

const PICTURES: [Picture; 28] = [
    (3, "flux_error_angle_rad", "angle of the flux error against the flux, rad", None),
    (6, "slip_share", "slip over rated slip", Some((7, "with the stabilized gain"))),
    (12, "speed_share", "speed over rated speed", Some((13, "with the anchor"))),
    (16, "slip_share", "slip over rated slip", None),
    (19, "flux_share", "flux over rated flux", None),
    (21, "inertia_share", "inertia over that usual for the power", None),
    (24, "torque_nm", "torque, N m", None),
    (26, "voltage_share", "voltage over rated voltage", Some((27, "without the m"))),
    (29, "voltage_share", "voltage over rated voltage", Some((30, "with its sign put right"))),
    (34, "flux_angle_rad", "angle of the flux, rad", None),
    (36, "voltage_share", "voltage over 311 V", None),
    (39, "slip_tenths", "slip over rated slip, tenths", None),
    (40, "order", "order of the method", None),
    (43, "load_share", "load over rated torque", None),
    (48, "acceleration_share", "acceleration over that by rated torque", None),
    (49, "input_share", "input over its largest", Some((50, "with K_P in the last term"))),
    (51, "distance_share", "distance at the start over the rated current", None),
    (54, "slip_share", "slip over rated slip", None),
    (59, "slip_2_over_rotor_rate", "slip at the second point over 1/T_r", Some((75, "with an integral action that forgets"))),
    (62, "power_w", "rated power, W", Some((55, "with the gains kept apart"))),
    (63, "frequency_over_speed", "ω_e/(n_pω)", Some((64, "with another gain of (3)"))),
    (73, "rotor_resistance_ratio", "R_r over the value known", None),
    (77, "frequency_ratio", LOWEST, None),
    (78, "frequency_ratio", LOWEST, None),
    (79, "frequency_ratio", LOWEST, None),
    (80, "load_share", "load over rated torque", None),
    (81, "frequency_ratio", LOWEST, None),
    (82, "frequency_ratio", LOWEST, None),
];

/// Ratios up to here are drawn on a linear axis.
const LINEAR: f64 = 4.0;

/// Powers of ten that a logarithmic axis may span; what lies beyond stands at its ends.
const DECADES: [f64; 2] = [-6.0, 40.0];

fn with(claim: &Claim, point: &Point, name: &str, x: f64) -> Point {
    let mut p = point.clone();
    if let Some(k) = claim.variables.iter().position(|v| v.name == name) {
        p.values[k] = x;
    } else if let (Some(k), Some(m)) = (MACHINE.iter().position(|v| v.name == name), &mut p.machine) {
        m[k] = x;
    }
    p
}

/// What is over what is allowed along the variable, where the assumptions of the claim are met.
fn curve(claim: &Claim, variable: &Variable, point: &Point, machines: &Machines, points: u32) -> Vec<(f64, f64)> {
    let shares = (0..points).map(|k| (f64::from(k) + 0.5) / f64::from(points));
    let ratio = |x| Some((x, 1.0 - claim.verdict(&with(claim, point, variable.name, x), machines).margin()?));
    shares.filter_map(|share| ratio(variable.at(share))).collect()
}

/// Brings the curves to the axis that suits them; its label and range.
fn scaled(series: &mut [Series]) -> (&'static str, [f64; 2]) {
    let extreme = |series: &[Series], by: fn(f64, f64) -> f64| series.iter().flat_map(|s| &s.points).fold(1.0, |m, p| by(m, p.1));
    let (least, most) = (extreme(series, f64::min), extreme(series, f64::max));
    if most <= LINEAR {
        // From zero on, or what happens around 1 in full.
        let room = 0.05 * (most - least);
        return ("what is over what is allowed", [if least > 0.8 { least - room } else { 0.0 }, most + room]);
    }
    for p in series.iter_mut().flat_map(|s| &mut s.points) {
        p.1 = p.1.max(f64::MIN_POSITIVE).log10().clamp(DECADES[0], DECADES[1]);
    }
    let (least, most) = (extreme(series, f64::min).min(-1.0), extreme(series, f64::max));
    ("what is over what is allowed, power of ten", [least - 0.03 * (most - least), most + 0.03 * (most - least)])
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("give the folder to draw into")?;
    std::fs::create_dir_all(&folder)?;
    let all = claims::all();
    let of = |number: u32| all.iter().find(|c| c.number == number).ok_or(format!("there is no claim {number}"));
    for (number, name, label, stabilized) in PICTURES {
        let claim = of(number)?;
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/counterexamples/{number:02}-{}.toml", claim.name));
        let (_, point, machines) = case_file::from_text(&std::fs::read_to_string(file)?, &all, None)?;
        let variable = claim.variables.iter().chain(&MACHINE).find(|v| v.name == name).ok_or(format!("{number}: no {name}"))?;
        let points = match claim.cost {
            im_verify::Cost::Long => 12,
            im_verify::Cost::Study => 24,
            _ => 120,
        };
        let mut series = vec![Series::line(format!("claim {number}"), curve(claim, variable, &point, &machines, points))];
        if let Some((stabilized, how)) = stabilized {
            series.push(Series::line(
                format!("claim {stabilized}, {how}"),
                curve(of(stabilized)?, variable, &point, &machines, points),
            ));
        }
        series.push(Series::line("allowed", [(variable.low, 1.0), (variable.high, 1.0)]));
        let (y_label, range) = scaled(&mut series);
        let title = format!("Claim {number}: {}", claim.name.replace('_', " "));
        let svg = chart_within(&title, label, y_label, range, &series);
        write_atomically(&Path::new(&folder).join(format!("{number:02}.svg")), |w| w.write_all(svg.as_bytes()))?;
    }
    Ok(())
}
