//! All controllers on the same drive cycle: `cargo run --release -p im-lab --example compare_controllers`.
//!
//! Prints the table of docs/background/controllers.md. The machine of Jadot et al., Table I, on a bridge with dead time, with noise; every controller
//! knows the base machine. Four truths: that machine; 50 % more rotor resistance; 50 % more stator resistance; saturated iron.

mod cycle;

use std::collections::BTreeMap;
use std::time::Instant;

use cycle::{Figures, NAMES, truths};
use im_lab::cost;

/// The least time of twenty runs of twenty thousand steps, ns per step, of each controller by name.
fn step_times() -> BTreeMap<String, f64> {
    let least = |c: cost::Cost| {
        let (name, mut thousand) = (c.name.clone(), c.prepared());
        let run = |_| {
            let start = Instant::now();
            (0..20).for_each(|_| _ = std::hint::black_box(thousand()));
            start.elapsed().as_secs_f64() / 20_000.0 * 1e9
        };
        (name, (0..20).map(run).fold(f64::MAX, f64::min))
    };
    cost::of("controller").into_iter().map(least).collect()
}

fn shown(x: f64, digits: usize, factor: f64) -> String {
    if x.is_finite() { format!("{:.digits$}", x * factor) } else { "–".into() }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let times = step_times();
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
        let of = |name: &str| times.get(name).map_or("–".into(), |ns| format!("{ns:.0}"));
        println!(" {} | {} |", of(name), of(&format!("closed_{name}")));
    }
    let around = "drive(indirect_field_orientation)";
    println!("\n{around}: closed loop {:.0} ns", times[&format!("closed_{around}")]);
    println!("\nUnder each other truth: speed error rad/s, torque error Nm, mean error of the flux %.");
    Ok(())
}
