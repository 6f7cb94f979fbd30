//! Cost of a control step, alone and with averaged inverter and machine: a thousand steps per iteration, so that a microsecond printed is a
//! nanosecond per step.
#![allow(missing_docs)]

mod common;

use common::{Loop, Visit, each};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, criterion_group, criterion_main};
use im_model::Scalar;
use im_model::simulation::Controller;

struct Timed<'a>(BenchmarkGroup<'a, WallTime>);

impl<T: Scalar> Visit<T> for Timed<'_> {
    fn visit<C: Controller<T>>(&mut self, name: &str, mut l: Loop<T, C>) {
        self.0.bench_function(name, |b| b.iter(|| std::hint::black_box(l.run(1000))));
    }
}

fn step(c: &mut Criterion) {
    each::<f64>(true, &mut Timed(c.benchmark_group("closed_loop_x1000")));
    each::<f64>(false, &mut Timed(c.benchmark_group("controller_x1000")));
    each::<f32>(false, &mut Timed(c.benchmark_group("controller_f32_x1000")));
}

criterion_group!(benches, step);
criterion_main!(benches);
