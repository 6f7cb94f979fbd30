//! Off-line fitting: output error driven by the recorded voltage, Levenberg-Marquardt with exact forward sensitivities.
//!
//! An [`Experiment`] is what is known of a run: inputs, measured channels with their noise, how it starts. A [`Free`] parameter is
//! what may change. [`fit`] finds the machine that explains all experiments at once.

mod aqdm;
mod experiment;
mod fit;
mod free;
mod simulate;
mod start;
mod steady;

pub use aqdm::{AqdmFit, SteadyPoint, fit_aqdm, predicted as aqdm_at};
pub use experiment::{Channel, ChannelKind, Experiment, ExperimentError, Start};
pub use fit::{Fit, FitError, FitOptions, cost, fit, fit_from, inverse_of_normal};
pub use free::{Free, Target, Transform, base_parameters, base_parameters_in, effect_parameters};
pub use simulate::{Linearized, linearize, predict, residuals};
pub use start::{angle_on, guess_start, start_on, start_parameters};
