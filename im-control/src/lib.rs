//! Controllers of induction machines, modulation and drive logic.
//!
//! Every controller implements [`im_model::simulation::Controller`]: what was measured and what is asked for at the beginning of a
//! sample go in, the voltage or current for the sample comes out. `no_std`, without allocation, `f32` and `f64`.

#![cfg_attr(not(any(feature = "std", test)), no_std)]
