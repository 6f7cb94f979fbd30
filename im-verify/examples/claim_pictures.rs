//! Draws the claims that fail: `cargo run --release -p imkit-verify --example claim_pictures docs/images/claims`.
//!
//! From the simplest counterexample (`tests/counterexamples`) one variable is taken through its range, the others staying: how far is what
//! is over what is allowed? Where another claim mends it, its curve stands beside.

use std::error::Error;
use std::io::Write as _;
use std::path::Path;

use im_design::plot::{Mark, Series, chart};
use im_model::write_atomically;
use im_verify::{Claim, MACHINE, Machines, Point, Variable, case_file, claims};

/// Number of the claim, the variable, and the claim that mends it, if it has the same variables.
const PICTURES: [(u32, &str, Option<u32>); 21] = [
    (3, "flux_error_angle_rad", None),
    (6, "slip_share", Some(7)),
    (12, "speed_share", Some(13)),
    (16, "slip_share", None),
    (19, "flux_share", None),
    (21, "inertia_share", None),
    (22, "slip_share", None),
    (24, "torque_nm", Some(25)),
    (26, "voltage_share", Some(27)),
    (29, "voltage_share", Some(30)),
    (34, "flux_angle_rad", None),
    (36, "voltage_share", None),
    (39, "slip_share", None),
    (40, "error", None),
    (43, "load_share", None),
    (48, "acceleration_share", None),
    (49, "input_share", Some(50)),
    (51, "distance_share", None),
    (54, "slip_share", None),
    (59, "l_error", Some(60)),
    (62, "power_w", Some(55)),
];

/// Where curves are cut: beyond this a claim fails, no matter how badly.
const TOP: f64 = 4.0;

fn with(claim: &Claim, point: &Point, name: &str, x: f64) -> Point {
    let mut p = point.clone();
    if let Some(k) = claim.variables.iter().position(|v| v.name == name) {
        p.values[k] = x;
    } else if let (Some(k), Some(m)) = (MACHINE.iter().position(|v| v.name == name), &mut p.machine) {
        m[k] = x;
    }
    p
}

fn curve(claim: &Claim, variable: &Variable, point: &Point, machines: &Machines, points: u32) -> Vec<(f64, f64)> {
    let shares = (0..points).map(|k| (f64::from(k) + 0.5) / f64::from(points));
    shares
        .filter_map(|share| {
            let x = variable.at(share);
            let margin = claim.verdict(&with(claim, point, variable.name, x), machines).margin()?;
            Some((x, (1.0 - margin).clamp(0.0, TOP)))
        })
        .collect()
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("give the folder to draw into")?;
    std::fs::create_dir_all(&folder)?;
    let all = claims::all();
    let of = |number: u32| all.iter().find(|c| c.number == number).ok_or(format!("there is no claim {number}"));
    for (number, name, mended) in PICTURES {
        let claim = of(number)?;
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/counterexamples/{number:02}-{}.toml", claim.name));
        let (_, point, machines) = case_file::from_text(&std::fs::read_to_string(file)?, &all, None)?;
        let variable = claim.variables.iter().chain(&MACHINE).find(|v| v.name == name).ok_or(format!("{number}: no {name}"))?;
        let points = match claim.cost {
            im_verify::Cost::Long => 12,
            im_verify::Cost::Study => 24,
            _ => 120,
        };
        let line = |name: String, points| Series { name, mark: Mark::Line, points };
        let mut series = vec![line(format!("claim {number}"), curve(claim, variable, &point, &machines, points))];
        if let Some(mended) = mended {
            series.push(line(format!("claim {mended}"), curve(of(mended)?, variable, &point, &machines, points)));
        }
        series.push(line("allowed".into(), vec![(variable.low, 1.0), (variable.high, 1.0)]));
        let title = format!("Claim {number}: {}", claim.name.replace('_', " "));
        let svg = chart(&title, &name.replace('_', " "), "what is over what is allowed", &series);
        write_atomically(&Path::new(&folder).join(format!("{number:02}.svg")), |w| w.write_all(svg.as_bytes()))?;
    }
    Ok(())
}
