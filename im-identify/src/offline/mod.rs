//! Off-line fitting: output error driven by the recorded voltage, Levenberg-Marquardt with exact forward sensitivities.
//!
//! An [`Experiment`] is what is known of a run: inputs, measured channels with their noise, how it starts. A [`Free`] parameter is
//! what may change. [`fit`] finds the machine that explains all experiments at once.

mod aqdm;
mod channel;
mod experiment;
mod fit;
mod free;
mod knowledge;
mod load;
mod load_torque;
mod simulate;
mod smoothness;
mod speed;
mod start;
mod steady;
pub mod stop;
mod thinned;
mod trend;

pub use aqdm::{AqdmFit, SteadyPoint, fit_aqdm, predicted as aqdm_at};
pub use channel::{Channel, ChannelKind};
pub use experiment::{Experiment, ExperimentError, Start};
pub use fit::{Fit, FitError, FitOptions, NOT_SEEN, cost, fit, fit_from, inverse_of_normal};
pub use free::{
    Free, Prior, Target, Transform, base_parameters, base_parameters_in, effect_parameters, effect_parameters_in, torques_balance,
};
pub use knowledge::{HALF_95, expecting, knowing, prior_cost, prior_terms};
pub use load::{Load, ShownSpeed, Size};
pub use load_torque::{LoadEstimate, load_torque};
pub use simulate::{Linearized, Residuals, linearize, outputs, predict, residuals};
pub use smoothness::{Smoothness, smoothness};
pub use speed::{FoundSpeed, HARMONICS, Stretch, VoltageNoise, Volts, Wander};
pub use start::{angle_on, guess_start, start_on, start_parameters};
pub use thinned::Thinned;
