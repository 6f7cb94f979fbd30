//! Maximum torque per ampere (Kwon et al. (2005), Section VIII) from an equivalent circuit with saturation.
//!
//! * [`circuit`]: the air-gap side of the circuit: Table V, or a T circuit with main-flux saturation;
//! * [`optimum`]: current and slip of least current for a torque;
//! * [`laws`]: the laws (27), (29), fitted under (28); and better ones.

pub mod circuit;
pub mod laws;
pub mod optimum;

pub use circuit::{AirGap, Aqdm, TCircuit, of_machine};
pub use laws::{CurrentLaw, LogLaw, SlipLaw};
pub use optimum::{Optimum, for_current, for_torque};
