//! An observer by name, and how it is made from a file's gains or from none.

use im_model::{Machine, Rating, Scalar};

use crate::basis::{Basis, Discretization};
use crate::error::ObserverError;
use crate::interface::Observer;

/// Gains as a file gives them, by key. Implemented by whoever reads files; [`StartingGains`] stands for no file.
pub trait Gains {
    /// A key that is not as it should be, or an observer that refuses its value.
    type Error: From<ObserverError>;
    /// The table that was found among [`Named::TABLES`]; none where there is no file, and nothing else is asked for then but numbers.
    fn table(&self) -> Option<&str>;
    /// A number that may be missing.
    fn number(&self, key: &str) -> Result<Option<f64>, Self::Error>;
    /// A number, or the one an observer starts from where the file has none.
    fn number_or(&self, key: &'static str, usual: f64) -> Result<f64, Self::Error> {
        let given = self.number(key)?;
        if given.is_none() && usual != 0.0 {
            self.note_usual(key, usual);
        }
        Ok(given.unwrap_or(usual))
    }
    /// Notes a number that a file does not have, for whoever must say so.
    fn note_usual(&self, _key: &'static str, _usual: f64) {}
    /// A number that must be there.
    fn needed(&self, key: &str) -> Result<f64, Self::Error>;
    /// [lower, upper].
    fn range(&self, key: &str) -> Result<[f64; 2], Self::Error>;
    /// Rows of two numbers.
    fn rows<const R: usize>(&self, key: &str) -> Result<[[f64; 2]; R], Self::Error>;

    /// The rule that the gains are proven for: forward Euler in the tables of a sampled design.
    fn discretization(&self) -> Discretization {
        match self.table() {
            Some(name) if name.starts_with("sampled") => Discretization::ForwardEuler,
            _ => Discretization::Implicit,
        }
    }
}

/// No file: every observer takes the gains one starts from.
#[derive(Clone, Copy, Debug)]
pub struct StartingGains;

impl Gains for StartingGains {
    type Error = ObserverError;
    fn table(&self) -> Option<&str> {
        None
    }
    fn number(&self, _: &str) -> Result<Option<f64>, ObserverError> {
        Ok(None)
    }
    fn needed(&self, _: &str) -> Result<f64, ObserverError> {
        Ok(f64::NAN)
    }
    fn range(&self, _: &str) -> Result<[f64; 2], ObserverError> {
        Ok([f64::NAN; 2])
    }
    fn rows<const R: usize>(&self, _: &str) -> Result<[[f64; 2]; R], ObserverError> {
        Ok([[f64::NAN; 2]; R])
    }
}

/// An observer with what the registry needs of it beside its step. It may be sent to another thread, as it is plain numbers.
pub trait Named<T: Scalar>: Observer<T, State: Send> + Clone + Send {
    /// On the command line.
    const NAME: &'static str;
    /// For people.
    const TITLE: &'static str;
    /// Whether it needs a measured speed.
    const NEEDS_SPEED: bool = false;
    /// Tables of a gains file that it reads, the first that is there.
    const TABLES: &'static [&'static str];

    /// What the proof of a certificate says of the gains that are not in it ([`Gains::number_or`]).
    const BESIDE_THE_PROOF: &'static str = "the proof is without them";

    /// The observer with gains from a file, or with those one starts from for the machine.
    fn made<G: Gains>(basis: Basis<T>, machine: &Machine<f64>, rating: &Rating, gains: &G) -> Result<Self, G::Error>;
}
