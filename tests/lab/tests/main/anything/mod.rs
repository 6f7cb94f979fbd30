//! Every public constructor and step of the crates for firmware, with numbers as faults and slips of the pen leave them: NaN, infinities,
//! zeros, subnormals, sizes that nobody has. A constructor refuses them with a typed error, or what it makes works in finite numbers, in
//! `f64` and in `f32`; a step never panics, and after one bad sample a state comes back.

use im_model::machines::{JADOT_TABLE_I, NamedMachine};
use im_model::{Complex, Scalar};
use proptest::prelude::*;
use proptest::sample::select;

mod controllers;
mod identifiers;
mod machines;
mod observers;
mod parts;

/// Cases of each property: `IM_CASES=10000` for a long run.
fn cases() -> ProptestConfig {
    let wanted = std::env::var("IM_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(96);
    ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(wanted) }
}

const M: NamedMachine = JADOT_TABLE_I;
const H: f64 = 1e-4;

const ODD: [f64; 24] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    0.0,
    -0.0,
    5e-324,
    1e-310,
    1e-300,
    1e-45,
    1e-38,
    1e-20,
    1e-9,
    1e-3,
    -1e-3,
    -1.0,
    1.0,
    1e3,
    1e6,
    1e9,
    1e20,
    1e38,
    1e300,
    f64::MAX,
    f64::MIN,
];

/// A number that is odd, or any at all.
fn odd() -> impl Strategy<Value = f64> {
    prop_oneof![4 => select(ODD.to_vec()), 1 => any::<f64>(), 1 => -1e3..1e3]
}

/// Fields of a structure, some of them odd in place of the right value.
#[derive(Clone, Debug)]
struct Fields(Vec<Option<f64>>);

impl Fields {
    /// The next: odd, or `right`.
    fn or<T: Scalar>(&mut self, right: f64) -> T {
        T::from_f64(self.0.pop().flatten().unwrap_or(right))
    }

    fn or_64(&mut self, right: f64) -> f64 {
        self.or(right)
    }

    fn are_all_right(&self) -> bool {
        self.0.iter().all(Option::is_none)
    }
}

/// Most of them right: one odd value in eight.
fn fields() -> impl Strategy<Value = Fields> {
    prop::collection::vec(prop_oneof![7 => Just(None), 1 => odd().prop_map(Some)], 24).prop_map(Fields)
}

fn is_finite<T: Scalar>(values: &[T]) -> bool {
    values.iter().all(|x| x.value().is_finite())
}

fn vector<T: Scalar>(re: f64, im: f64) -> Complex<T> {
    Complex::new(T::from_f64(re), T::from_f64(im))
}
