//! Cost of one fourth-order Runge-Kutta sample, by what is switched on: a thousand samples per iteration, so that a microsecond
//! printed is a nanosecond per sample.
#![allow(missing_docs)]

mod cases;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use im_model::{Bench, Complex, Scalar};

fn step(c: &mut Criterion) {
    let mut group = c.benchmark_group("rk4_sample_x1000");
    fn case<T: Scalar>(group: &mut criterion::BenchmarkGroup<criterion::measurement::WallTime>, name: &str, bench: Bench<T>) {
        let u: Vec<Complex<T>> = cases::voltage();
        assert_eq!(bench.substeps(), 1, "one step per sample is what is timed");
        group.bench_function(name, |b| b.iter_batched_ref(|| bench, |bench| cases::run(bench, &u), BatchSize::SmallInput));
    }
    let (base, saturated, all) = (cases::base(), cases::saturated(), cases::all_effects());
    case(&mut group, "base", cases::running(&base));
    case(&mut group, "main_flux_saturation", cases::running(&saturated));
    case(&mut group, "all_effects", cases::running(&all));
    case(&mut group, "base_f32", cases::running_as(&base, |x, _| x as f32));
    case(&mut group, "base_dual6", cases::running_as(&base, cases::dual::<6>));
    case(&mut group, "base_dual8", cases::running_as(&base, cases::dual::<8>));
    case(&mut group, "all_effects_dual8", cases::running_as(&all, cases::dual::<8>));
    group.finish();
}

criterion_group!(benches, step);
criterion_main!(benches);
