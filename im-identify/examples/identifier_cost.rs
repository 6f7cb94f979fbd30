//! Runs one identifier a given number of times: `identifier_cost CASE THOUSANDS`. Without wall time in it, for counting instructions
//! (`scripts/step-cost`).

#[path = "../benches/cases/mod.rs"]
mod cases;

use im_identify::online::Identifier;
use im_model::Scalar;

fn run<T: Scalar, const N: usize, I: Identifier<T, N>>(identifier: &I, inputs: &[I::Input], thousands: u32) -> f64 {
    let mut state = identifier.start();
    (0..thousands).map(|_| cases::run(identifier, &mut state, inputs).value()).sum()
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let case = arguments.next().unwrap_or_else(|| "kenne".into());
    let n = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(1);
    let shown = match case.as_str() {
        "kenne" => run(&cases::kenne::<f64>(), &cases::samples(), n),
        "kenne_both" => run(&cases::kenne_both::<f64>(), &cases::samples(), n),
        "time_scale" => run(&cases::time_scale::<f64>(), &cases::tracking(), n),
        "reduced" => run(&cases::reduced::<f64>(), &cases::tracking(), n),
        "time_varying" => run(&cases::time_varying::<f64>(), &cases::tracking(), n),
        "follower_time_scale" => run(&cases::follower::<f64>(), &cases::samples(), n),
        "kenne_f32" => run(&cases::kenne::<f32>(), &cases::samples(), n),
        "time_scale_f32" => run(&cases::time_scale::<f32>(), &cases::tracking(), n),
        other => {
            eprintln!("no case named {other}");
            std::process::exit(2);
        }
    };
    println!("{case}: {n} thousand steps, checksum {shown}");
}
