//! Cost of a step of each identifier: a thousand steps per iteration, so that a microsecond printed is a nanosecond per step.
#![allow(missing_docs)]

mod cases;

use criterion::{Criterion, criterion_group, criterion_main};
use im_identify::online::Identifier;
use im_model::Scalar;

fn step(c: &mut Criterion) {
    let mut group = c.benchmark_group("identifier_step_x1000");
    fn case<T: Scalar, const N: usize, I: Identifier<T, N>>(
        group: &mut criterion::BenchmarkGroup<criterion::measurement::WallTime>,
        name: &str,
        identifier: &I,
        inputs: &[I::Input],
    ) {
        let mut state = identifier.start();
        group.bench_function(name, |b| b.iter(|| cases::run(identifier, &mut state, inputs)));
    }
    case(&mut group, "kenne", &cases::kenne::<f64>(), &cases::samples());
    case(&mut group, "kenne_both", &cases::kenne_both::<f64>(), &cases::samples());
    case(&mut group, "time_scale", &cases::time_scale::<f64>(), &cases::tracking());
    case(&mut group, "reduced", &cases::reduced::<f64>(), &cases::tracking());
    case(&mut group, "time_varying", &cases::time_varying::<f64>(), &cases::tracking());
    case(&mut group, "follower_time_scale", &cases::follower::<f64>(), &cases::samples());
    case(&mut group, "kenne_f32", &cases::kenne::<f32>(), &cases::samples());
    case(&mut group, "time_scale_f32", &cases::time_scale::<f32>(), &cases::tracking());
    group.finish();
}

criterion_group!(benches, step);
criterion_main!(benches);
