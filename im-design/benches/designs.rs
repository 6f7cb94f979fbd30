//! How long designs take: a 5-state design (target 20 ms) and a box with 8 vertices (target 200 ms), exact checks included.

use criterion::{Criterion, criterion_group, criterion_main};
use im_design::kubota::{KubotaRequest, least_norm};
use im_design::mtpa::{self, Aqdm, Circuit, LawKind, MtpaRequest};
use im_design::sampled::over_box;
use im_design::thau_box::{BoxRegion, design};
use im_design::{DesignModel, LinearMachine, thau};
use std::hint::black_box;

fn designs(criterion: &mut Criterion) {
    let plant = DesignModel::Machine(LinearMachine::kwon_table_iv());
    criterion.bench_function("thau, 5 states, optimum and centred gain", |b| {
        b.iter(|| thau::maximize(black_box(plant), 1e-3));
    });
    let c = plant.constants::<f64>();
    let request = KubotaRequest { speed_rad_s: [-190.0, 190.0], rate_per_s: 1.0, flux_weight: c.beta * c.beta };
    criterion.bench_function("kubota, 4 states, least-norm schedule", |b| {
        b.iter(|| least_norm(black_box(plant), &request));
    });
    let plant = DesignModel::Machine(LinearMachine::jadot_table_i());
    let region = BoxRegion {
        frame_rad_s: [150.0, 314.0],
        slip_rad_s: [-5.0, 5.0],
        flux_d_vs: [0.85, 0.95],
        flux_q_vs: [0.0; 2],
        current_d_a: [0.0; 2],
        current_q_a: [0.0; 2],
    };
    assert_eq!(region.vertices().len(), 8);
    criterion.bench_function("observer over a box, 8 vertices", |b| {
        b.iter(|| design(black_box(plant), &region, 1.0, 1e5));
    });
    criterion.bench_function("the same for forward Euler at 20 us", |b| {
        b.iter(|| over_box(black_box(plant), &region, Some(20e-6), 1.0));
    });
    let circuit = Circuit::Aqdm(Aqdm::kwon_table_v());
    let law = MtpaRequest { torque_n_m: [1.0, 510.0], tolerance: 0.01, law: LawKind::Series, points: 25, aqdm: None };
    let kwon = DesignModel::Machine(LinearMachine::kwon_table_iv());
    criterion.bench_function("mtpa of Table V, 25 torques, with proof", |b| {
        b.iter(|| mtpa::design(black_box(kwon), circuit, &law));
    });
    let (_, laws) = mtpa::design(kwon, circuit, &law).expect("feasible");
    criterion.bench_function("check of these laws", |b| b.iter(|| black_box(&laws).check()));
    let (_, certificate) = design(plant, &region, 1.0, 1e5).expect("feasible");
    criterion.bench_function("exact check of that box", |b| b.iter(|| black_box(&certificate).check()));
}

criterion_group!(benches, designs);
criterion_main!(benches);
