//! Gains for Kubota's adaptive observer that are stable where the published ones are not, with a proof that is checked in exact arithmetic; then the
//! certificate is altered, and refused. Prints the margins and the gains as Rust, and draws where the loop is stable:
//!
//!     cargo run --release -p im-design --example kubota_gains -- kubota_gains.svg

use im_design::certificate::{Certificate, Design};
use im_design::gains::{Precision, Provenance};
use im_design::request::{Kind, design};
use im_design::{DesignModel, LinearMachine, plot};

/// Regenerating at low speed, where the observer without feedback loses the machine.
const REGION: &str = "
speed_rad_s = [10.0, 40.0]
slip_rad_s = [-15.0, 15.0]
proportional = 0.05
integral = 20.0
rho = 0.2
flux_vs = 0.9
";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let plant = DesignModel::Machine(LinearMachine::jadot_table_i());
    let certificate = design(Kind::KubotaLoop, plant, REGION)?;

    // What goes into a file, and what anybody checks without the solver: every number a fraction, every obligation decided exactly.
    let text = certificate.to_text()?;
    let (_, margins) = Certificate::check_text(&text)?;
    for m in &margins {
        println!("holds: {:44} by {:.3e}", m.name, m.margin);
    }

    // A rate a thousand times too good is noticed twice: by the digest and, were that forged too, by the proof itself.
    let mut forged = certificate.clone();
    if let Design::KubotaLoop(d) = &mut forged.design {
        d.cells.iter_mut().for_each(|cell| cell.rate_per_s *= 1e3);
    }
    println!("altered: {}", forged.check().err().ok_or("an altered certificate must be refused")?);
    println!("sealed anew: {}", forged.prove().err().ok_or("a false claim must be refused")?);

    let from = Provenance { motor: "Table IV of Kwon et al.".into(), ..Provenance::default() };
    println!("\n{}", certificate.to_rust(Precision::F32, &from)?);
    if let Some(path) = std::env::args().nth(1) {
        std::fs::write(path, plot::picture(&certificate))?;
    }
    Ok(())
}
