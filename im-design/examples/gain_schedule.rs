//! A gain scheduled over speed for a full-order flux observer, as small as the rate allows, for three rates. Prints the least gain beside
//! that of the closed form, and draws how gain and slowest pole go with speed:
//!
//!     cargo run --release -p im-design --example gain_schedule -- gain_schedule.svg

use im_chart::{Panel, Series, panels};
use im_design::kubota::{KubotaRequest, closed_form, least_norm};
use im_design::{DesignModel, LinearMachine};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let plant = DesignModel::Machine(LinearMachine::jadot_table_i());
    let c = plant.constants::<f64>();
    let speed_rad_s = [-165.0, 165.0];
    println!("no rate of {:.2} 1/s or more can be had: the fluxes decay at R_r/L_r", c.eta);

    let (mut size, mut decay) = (Vec::new(), Vec::new());
    for rate_per_s in [2.0, 4.0, 5.5] {
        // A flux error weighs by the current that it drives.
        let request = KubotaRequest { speed_rad_s, rate_per_s, flux_weight: c.beta * c.beta };
        let (least, certificate) = least_norm(plant, &request)?;
        let (closed, _) = closed_form(plant, &request)?;
        certificate.check()?;
        let name = format!("{rate_per_s} 1/s");
        println!(
            "{name}: |L| at 165 rad/s {:.3}, by the closed form {:.3}; proven {} obligations",
            least.gain_at(165.0).norm(),
            closed.gain_at(165.0).norm(),
            certificate.margins.len()
        );
        let speeds = || (-165..=165).step_by(5).map(f64::from);
        size.push(Series::line(&name, speeds().map(|w| (w, least.gain_at(w).norm()))));
        let slowest = |w: f64| {
            let poles = im_design::linalg::eigenvalues(&least.error_matrix(&c, w));
            -poles.into_iter().map(|p| p.0).fold(f64::NEG_INFINITY, f64::max)
        };
        decay.push(Series::line(&name, speeds().map(|w| (w, slowest(w)))));
    }
    if let Some(path) = std::env::args().nth(1) {
        let parts = [Panel::new("norm of L", size), Panel::new("slowest pole, 1/s", decay)];
        std::fs::write(path, panels("A gain affine in speed, for three proven rates", "mechanical speed, rad/s", &parts))?;
    }
    Ok(())
}
