//! Maximum torque per ampere (Kwon et al. (2005), Section VIII) from an equivalent circuit with saturation.
//!
//! * [`air_gap`]: what a search asks of a circuit; [`circuit`]: the air-gap side of the circuit, Table V; [`t_circuit`]: that of any machine model with its saturations;
//! * [`optimum`]: current and slip of least current for a torque;
//! * [`laws`]: the laws (27), (29), fitted under (28); and better ones; [`law`]: as a certificate holds them;
//! * [`request`]: laws asked for; [`proof`]: what their certificate claims and how it is decided.

pub mod air_gap;
pub mod circuit;
pub mod law;
pub mod laws;
pub mod optimum;
pub mod proof;
pub mod request;
pub mod t_circuit;

pub use air_gap::AirGap;
pub use circuit::{Aqdm, Circuit};
pub use law::Law;
pub use laws::{CurrentLaw, LogLaw, SlipLaw};
pub use optimum::{Optimum, for_current, for_torque};
pub use proof::{MtpaDesign, Witness};
pub use request::{AqdmTable, LawKind, MtpaRequest, design};
pub use t_circuit::TCircuit;
