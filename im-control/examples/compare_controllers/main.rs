//! All controllers on the same drive cycle: `cargo run --release -p im-control --example compare_controllers`.
//!
//! Prints the table of docs/controllers.md. The machine of Jadot et al., Table I, on a bridge with dead time, with noise; every controller
//! knows the base machine. Four truths: that machine; 50 % more rotor resistance; 50 % more stator resistance; saturated iron.

#[path = "../../benches/common/mod.rs"]
mod common;
mod cycle;

use std::time::Instant;

use common::{Loop, Visit};
use cycle::{Figures, NAMES, truths};
use im_model::simulation::Controller;

/// The least time of several runs, ns per step.
struct Cost(Vec<(String, f64)>);

impl Visit<f64> for Cost {
    fn visit<C: Controller<f64>>(&mut self, name: &str, mut l: Loop<f64, C>) {
        let least = (0..20)
            .map(|_| {
                let start = Instant::now();
                std::hint::black_box(l.run(20_000));
                start.elapsed().as_secs_f64() / 20_000.0 * 1e9
            })
            .fold(f64::MAX, f64::min);
        self.0.push((name.to_owned(), least));
    }
}

fn shown(x: f64, digits: usize, factor: f64) -> String {
    if x.is_finite() { format!("{:.digits$}", x * factor) } else { "–".into() }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut alone, mut closed) = (Cost(Vec::new()), Cost(Vec::new()));
    common::each(false, &mut alone);
    common::each(true, &mut closed);
    let truths = truths();
    print!("| controller | speed error rad/s | torque error Nm | torque ripple Nm | current A | losses W |");
    for (name, _) in &truths[1..] {
        print!(" {name} |");
    }
    println!(" step ns | closed loop ns |");
    println!("|{}", "---|".repeat(8 + truths.len() - 1));
    for name in NAMES {
        let figures = truths.iter().map(|(_, machine)| Figures::of(name, machine)).collect::<Result<Vec<_>, _>>()?;
        let f = &figures[0];
        let (speed, torque) = (shown(f.speed_rms, 2, 1.0), f.torque_rms);
        print!("| {name} | {speed} | {torque:.2} | {:.2} | {:.2} | {:.0} |", f.ripple_rms, f.current_rms, f.losses);
        for f in &figures[1..] {
            print!(" {}, {:.2}, {} |", shown(f.speed_rms, 2, 1.0), f.torque_rms, shown(f.flux_error, 0, 100.0));
        }
        let of = |cost: &Cost| cost.0.iter().find(|(n, _)| n == name).map_or("–".into(), |(_, ns)| format!("{ns:.0}"));
        println!(" {} | {} |", of(&alone), of(&closed));
    }
    if let Some((name, ns)) = closed.0.last() {
        println!("\n{name}: closed loop {ns:.0} ns");
    }
    println!("\nUnder each other truth: speed error rad/s, torque error Nm, mean error of the flux %.");
    Ok(())
}
