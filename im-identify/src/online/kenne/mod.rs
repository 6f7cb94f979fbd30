//! The resistance identifiers of Kenné et al. (2005), (27)–(38), in sampled time.

mod current_model;
mod resistances;
mod rotor_resistance;

pub use resistances::{KenneResistances, KenneResistancesState, ResistancesSettings};
pub use rotor_resistance::{KenneRotorResistance, KenneRotorResistanceState, KenneSettings};
