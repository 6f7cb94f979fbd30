//! No adaptation: the controller of Section III with parameters as they were given.

use super::super::{Estimate, Excitation, Identifier, IdentifierStatus};
use super::parameters::RegulationParameters;
use super::scheme::{Adaptation, Tracking};
use im_model::{ModelError, Scalar};

/// Parameters that stay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fixed<T>(RegulationParameters<T>);

impl<T: Scalar> Fixed<T> {
    /// These parameters.
    ///
    /// # Errors
    /// Names the one that is not positive.
    pub fn try_new(parameters: RegulationParameters<T>) -> Result<Self, ModelError> {
        parameters.validate()?;
        Ok(Self(parameters))
    }
}

impl<T: Scalar> Identifier<T, 4> for Fixed<T> {
    type State = ();
    type Input = Tracking<T>;

    fn start(&self) {}

    fn step(&self, (): &mut (), _: &Tracking<T>) -> Estimate<T, 4> {
        let excitation = Excitation::none(T::zero());
        let (values, never) = (self.0.values(), [false; 4]);
        Estimate { values, adapting: never, at_bound: never, excitation, status: IdentifierStatus::NoExcitation }
    }
}

impl<T: Scalar> Adaptation<T> for Fixed<T> {
    fn parameters(&self, (): &()) -> RegulationParameters<T> {
        self.0
    }
}
