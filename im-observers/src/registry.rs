//! Every observer on one line: the command line, the steps whose cost is measured, the tests of all observers and the proof that no step can panic
//! go through these lines, so that a new one takes part with its file and its line.

use im_model::Scalar;

use crate::named::Named;
use crate::{CurrentModel, Derdiyok, FullOrder, Kalman, Kubota, Thau, Utkin};

/// What is done with an observer, whichever it is.
pub trait Visit<T: Scalar> {
    /// For one observer.
    fn visit<O: Named<T> + 'static>(&mut self);
}

macro_rules! registry {
    ($($observer:ident),* $(,)?) => {
        /// Every observer, in turn.
        pub fn each<T: Scalar>(visit: &mut impl Visit<T>) {
            $(visit.visit::<$observer<T>>();)*
        }

        /// Their names, in the order of [`each`].
        pub const NAMES: [&str; [$(stringify!($observer)),*].len()] = [$(<$observer<f64> as Named<f64>>::NAME),*];
    };
}

registry! {
    CurrentModel,
    FullOrder,
    Kubota,
    Derdiyok,
    Utkin,
    Thau,
    Kalman,
}
