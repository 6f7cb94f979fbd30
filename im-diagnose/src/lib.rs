//! The main job: compare the model with measurements, see where it fails, learn which physical effect is missing, add it, and watch
//! the error fall.

pub mod agreement;
pub mod case;
pub mod diagnosis;
pub mod intake;
pub mod leftover;
pub mod localise;
pub mod next_test;
pub mod noise;
pub mod refine;
pub mod report;
pub mod score;
pub mod tables;
