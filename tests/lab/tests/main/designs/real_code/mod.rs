//! What is proven, seen on the observers and controllers themselves: their code, random machines, random errors inside the region.
//!
//! Linear errors are compared with the certified rate; what holds of "the machine stepped alike" meets a machine stepped by the same
//! rule, what holds of the machine itself one in continuous time.

mod controllers;
mod observers;

use im_design::matrix::Matrix;
use im_design::request::Kind;
use im_model::Complex;
use proptest::prelude::*;

type C = Complex<f64>;

/// √(eᵀPe).
fn size(p: &Matrix<f64>, e: &[f64]) -> f64 {
    let n = e.len();
    (0..n).flat_map(|k| (0..n).map(move |l| (k, l))).map(|(k, l)| e[k] * p[(k, l)] * e[l]).sum::<f64>().sqrt()
}

/// Per sample or per time: the size at the end against what the rate allows.
fn decays(sizes: &[f64], contraction: f64, slack: f64) -> Result<(), TestCaseError> {
    let allowed = sizes[0] * contraction.powf((1.0 - slack) * (sizes.len() - 1) as f64) * (1.0 + 1e-6);
    let last = sizes[sizes.len() - 1];
    prop_assert!(last <= allowed, "{last:e} is more than {allowed:e} of {:e} in {} samples", sizes[0], sizes.len());
    Ok(())
}

/// The kinds that these tests, `every_kind` and `kenne` see in simulation are all there are.
#[test]
fn no_kind_is_left_out() {
    let here = ["thau", "thau-box", "kubota", "kubota-loop", "derdiyok", "utkin", "kenne", "jadot", "sampled"];
    // mtpa is of the steady state: `mtpa_of_saturated_machines_is_proven` searches its circuit instead.
    let of_the_steady_state = ["mtpa"];
    assert!(Kind::ALL.iter().all(|(_, name)| here.contains(name) || of_the_steady_state.contains(name)));
}
