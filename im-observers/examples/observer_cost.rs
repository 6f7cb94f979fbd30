//! Runs one case of the step benchmark a given number of times: `observer_cost CASE THOUSANDS`, e.g. `observer_cost kubota_f32 10`. Without wall
//! time in it, for counting instructions (`scripts/step-cost`).

#[path = "../lab/cases.rs"]
mod cases;

use im_model::Scalar;

fn run<T: Scalar>(case: &str, thousands: u32) -> Option<f64> {
    let load = cases::load::<T>();
    macro_rules! among {
        ($($name:ident)*) => {
            match case {
                $(stringify!($name) => {
                    let case = cases::$name(&load);
                    Some((0..thousands).map(|_| case.run(std::hint::black_box(&load.inputs)).value()).sum())
                })*
                _ => None,
            }
        };
    }
    among!(current_model kubota kubota_euler kubota_full derdiyok utkin thau thau_box)
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_else(|| "kubota_f32".into());
    let n = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(1);
    let sum = match name.rsplit_once('_') {
        Some((case, "f32")) => run::<f32>(case, n),
        Some((case, "f64")) => run::<f64>(case, n),
        _ => None,
    };
    let Some(sum) = sum else {
        eprintln!("no case named {name}: a case of lab/cases.rs with _f32 or _f64");
        std::process::exit(2);
    };
    println!("{name}: {n} thousand steps, checksum {sum}");
}
