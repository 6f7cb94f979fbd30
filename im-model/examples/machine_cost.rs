//! Runs one case of the step benchmark a given number of times: `machine_cost CASE THOUSANDS`. Without wall time in it, for counting
//! instructions (docs/performance.md).

#[path = "../benches/cases/mod.rs"]
mod cases;

use im_model::{Bench, Scalar};

fn run<T: Scalar>(mut bench: Bench<T>, thousands: u32) -> f64 {
    let u = cases::voltage();
    (0..thousands).map(|_| cases::run(&mut bench, &u).value()).sum()
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let case = arguments.next().unwrap_or_else(|| "base".into());
    let n = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(1);
    let (base, saturated, all) = (cases::base(), cases::saturated(), cases::all_effects());
    let shown = match case.as_str() {
        "base" => run(cases::running(&base), n),
        "main_flux_saturation" => run(cases::running(&saturated), n),
        "all_effects" => run(cases::running(&all), n),
        "base_f32" => run(cases::running_as(&base, |x, _| x as f32), n),
        "base_dual6" => run(cases::running_as(&base, cases::dual::<6>), n),
        "base_dual8" => run(cases::running_as(&base, cases::dual::<8>), n),
        "all_effects_dual8" => run(cases::running_as(&all, cases::dual::<8>), n),
        other => {
            eprintln!("no case named {other}");
            std::process::exit(2);
        }
    };
    println!("{case}: {n} thousand samples, checksum {shown}");
}
