//! Cost of a step of machine, observers, controllers and identifiers: a thousand steps per iteration, so that a microsecond printed is a nanosecond
//! per step. `cargo bench -p im-lab -- observer` for one kind.
#![allow(missing_docs)]

use criterion::{Criterion, criterion_group, criterion_main};
use im_lab::cost::KINDS;

fn step(c: &mut Criterion) {
    for (kind, costs) in KINDS {
        let mut group = c.benchmark_group(format!("{kind}_x1000"));
        for cost in costs() {
            let name = cost.name.clone();
            let mut thousand = cost.prepared();
            group.bench_function(name, |b| b.iter(|| std::hint::black_box(thousand())));
        }
        group.finish();
    }
}

criterion_group!(benches, step);
criterion_main!(benches);
