//! Derivatives carried by dual numbers are those of the simulation.

use im_model::effects::Role;
use im_model::{BaseParameter, Bench, Bound, Complex, Dual, EffectId, Machine, ParameterId, PlantInput, Scalar, State};

use crate::lab::{self, Supply};

const SAMPLES: usize = 250;

/// What the sensors show during a start, a reversal of the load and a step of the voltage, with a fixed number of steps.
fn outputs<T: Scalar>(m: &Machine<T>, substeps: u32) -> Vec<[T; 3]> {
    let mut bench = Bench::new(m, State::default(), T::from_f64(lab::T)).with_substeps(substeps);
    assert_eq!(bench.substeps(), substeps, "finite differences need the same steps");
    let supply = Supply::rated_flux(50.0);
    let each = |k| {
        let u = supply.mean(k) * if k < 150 { 1.0 } else { 0.7 };
        let tau = if k < 150 { 5.0 } else { -5.0 };
        bench.advance(&PlantInput::new(Complex::new(T::from_f64(u.re), T::from_f64(u.im)), T::from_f64(tau)));
        let y = bench.output();
        [y.i_s.re, y.i_s.im, y.omega_m]
    };
    (0..SAMPLES).map(each).collect()
}

/// Steps per sample that suit the machine and its neighbours.
fn substeps(m: &Machine<f64>) -> u32 {
    2 * im_model::Plant::new(m).substeps(lab::T) + 2
}

/// The largest difference between two runs' derivatives, over the largest derivative, channel by channel (the worst).
fn mismatch(exact: &[[f64; 3]], approximate: &[[f64; 3]]) -> f64 {
    (0..3)
        .map(|c| {
            let size = exact.iter().map(|y| y[c].abs()).fold(0.0, f64::max);
            let worst = exact.iter().zip(approximate).map(|(a, b)| (a[c] - b[c]).abs()).fold(0.0, f64::max);
            if worst == 0.0 { 0.0 } else { worst / size }
        })
        .fold(0.0, f64::max)
}

fn by_dual(m: &Machine<f64>, id: ParameterId, substeps: u32) -> Vec<[f64; 3]> {
    let seeded = m.map(|p, x| if p == id { Dual::<1>::seeded(x, 0, 1.0) } else { Dual::constant(x) });
    outputs(&seeded, substeps).into_iter().map(|y| y.map(|x| x.eps[0])).collect()
}

fn at(m: &Machine<f64>, id: ParameterId, value: f64, substeps: u32) -> Vec<[f64; 3]> {
    outputs(&m.with(&[(id, value)]).unwrap(), substeps)
}

/// Central differences of fourth order with h = 5e-3 of the value: some h⁴ = 6e-10 of curvature, and rounding.
fn by_difference(m: &Machine<f64>, id: ParameterId, substeps: u32) -> Vec<[f64; 3]> {
    let (x, h) = (m.get(id), 5e-3 * m.get(id));
    let [a, b, c, d] = [-2.0, -1.0, 1.0, 2.0].map(|k| at(m, id, x + k * h, substeps));
    (0..SAMPLES).map(|s| [0, 1, 2].map(|q| (8.0 * (c[s][q] - b[s][q]) - (d[s][q] - a[s][q])) / (12.0 * h))).collect()
}

#[test]
fn derivatives_by_base_parameters_agree_with_finite_differences() {
    let mut p = lab::MACHINE.parameters();
    p.viscous_friction_nm_s_per_rad = 1e-3;
    let m = lab::base().with_parameters(p).unwrap();
    for parameter in BaseParameter::ALL {
        let id = ParameterId::Base(parameter);
        let n = substeps(&m);
        let error = mismatch(&by_dual(&m, id, n), &by_difference(&m, id, n));
        // The weakest one changes the speed by 1e-6 of itself: 1e-16/(1e-6·5e-3) of rounding.
        assert!(error < 1e-7, "{id}: {error:e}");
    }
}

#[test]
fn derivatives_by_every_parameter_of_every_effect_agree_with_finite_differences() {
    for &effect in EffectId::ALL {
        // Every strength on, so that every shape parameter has an effect.
        let m = lab::machine(|e| {
            let mut place = 0.4;
            for (k, info) in effect.parameters().iter().enumerate().filter(|(_, p)| p.role == Role::Strength) {
                let typical = (info.typical.0 * info.typical.1).sqrt() * (1.0 + place);
                e.set(effect, k, typical * lab::MACHINE.rating.unit_of(info.scale, &lab::MACHINE.parameters(), 2));
                place *= 0.5;
            }
        });
        let n = substeps(&m);
        // Whole numbers have no derivative.
        let smooth = |k: &usize| !matches!(effect.parameters()[*k].bound, Bound::Whole(..));
        for k in (0..effect.parameters().len()).filter(smooth) {
            let id = ParameterId::Effect(effect, k);
            let error = mismatch(&by_dual(&m, id, n), &by_difference(&m, id, n));
            // As above with weaker ones, and the saturation grid, whose nodes move with the reference flux, 5e-7.
            assert!(error < 2e-6, "{id}: {error:e}");
        }
    }
}

/// At strength zero an effect is off for f64 and on for a dual number that carries its derivative. The derivative is the limit of
/// one-sided differences. It does not exist for the compliant shaft: however small the far mass, the load torque reaches the rotor
/// through the spring's second-order lag, not at once (docs/effects.md).
#[test]
fn derivatives_exist_where_an_effect_sets_in() {
    for &effect in EffectId::ALL.iter().filter(|id| id.about().smooth_onset) {
        for (k, info) in effect.parameters().iter().enumerate().filter(|(_, p)| p.role == Role::Strength) {
            let m = lab::base();
            let id = ParameterId::Effect(effect, k);
            let h = 1e-3 * info.typical.0 * lab::MACHINE.rating.unit_of(info.scale, &lab::MACHINE.parameters(), 2);
            // The steps of the machine with the effect on.
            let n = substeps(&m.with(&[(id, 2.0 * h)]).unwrap());
            let runs = [at(&m, id, 0.0, n), at(&m, id, h, n), at(&m, id, 2.0 * h, n)];
            let one_sided: Vec<[f64; 3]> = (0..SAMPLES)
                .map(|s| [0, 1, 2].map(|c| (4.0 * runs[1][s][c] - runs[2][s][c] - 3.0 * runs[0][s][c]) / (2.0 * h)))
                .collect();
            let error = mismatch(&by_dual(&m, id, n), &one_sided);
            // Second order in h ≈ 1e-5 of the quantity that the effect changes, and rounding of 1e-16/h.
            assert!(error < 1e-5, "{id}: {error:e}");
        }
    }
}
