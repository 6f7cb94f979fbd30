//! What is known of a recording's load torque, and the experiment that follows from it.

use im_identify::offline::{self, Experiment, Size};

use super::mapping::{Load, Mapping, Speed};

/// What is known of the load torque of a recording beside its column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LoadPlan {
    /// The column is all of it, or there is none.
    Known,
    /// It may be anything: the measured speed drives the machine.
    Unknown,
    /// A constant and a fan's torque.
    Law {
        /// Nm.
        constant: Size,
        /// Nm s²/rad².
        fan: Size,
    },
}

impl LoadPlan {
    /// As a mapping says it. Without a measured speed an unknown load is taken as zero.
    pub(super) fn of(mapping: &Mapping) -> Self {
        match (&mapping.load, &mapping.speed) {
            (Load::Unknown | Load::Unstated, Speed::Measured { .. }) => Self::Unknown,
            (&Load::Law { constant, fan }, _) => Self::Law { constant, fan },
            _ => Self::Known,
        }
    }

    /// The experiment so driven and loaded.
    pub fn apply(self, e: Experiment) -> Experiment {
        match self {
            Self::Known => e,
            Self::Unknown => e.driven_by_speed(),
            Self::Law { constant, fan } => Experiment { load: offline::Load::Law { constant, fan }, ..e },
        }
    }
}
