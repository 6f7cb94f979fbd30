//! Cost of one step of each observer: a thousand samples per iteration, so that a microsecond printed is a nanosecond per step.
#![allow(missing_docs)]

#[path = "../lab/cases.rs"]
mod cases;

use criterion::{Criterion, criterion_group, criterion_main};
use im_model::Scalar;

fn all<T: Scalar>(c: &mut Criterion, precision: &str) {
    let mut group = c.benchmark_group(format!("step_x1000_{precision}"));
    let load = cases::load::<T>();
    macro_rules! case {
        ($($name:ident)*) => {$(
            let case = cases::$name(&load);
            group.bench_function(stringify!($name), |b| b.iter(|| case.run(std::hint::black_box(&load.inputs))));
        )*};
    }
    case!(current_model kubota kubota_euler kubota_full derdiyok utkin thau thau_box);
    group.finish();
}

fn steps(c: &mut Criterion) {
    all::<f32>(c, "f32");
    all::<f64>(c, "f64");
}

criterion_group!(benches, steps);
criterion_main!(benches);
