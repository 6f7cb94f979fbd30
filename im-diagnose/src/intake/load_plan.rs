//! What is known of a recording's load torque, and the experiment that follows from it.

use im_identify::offline::{self, Experiment, Size};
use im_model::MotorFile;

use super::mapping::{Load, Mapping, Speed};

/// What is known of the load torque of a recording beside its column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LoadPlan {
    /// The column is all of it, or there is none.
    Known,
    /// It may be anything: the measured speed drives the machine.
    Unknown,
    /// It may be anything, and no speed is measured: the speed that voltages and currents ask for drives the machine.
    Unseen,
    /// A constant and a fan's torque.
    Law {
        /// Nm.
        constant: Size,
        /// Nm s²/rad².
        fan: Size,
    },
}

impl LoadPlan {
    /// As a mapping says it.
    pub(super) fn of(mapping: &Mapping) -> Self {
        match (&mapping.load, &mapping.speed) {
            (Load::Unknown | Load::Unstated, Speed::Measured { .. } | Speed::Counts { .. }) => Self::Unknown,
            (Load::Unknown | Load::Unstated, Speed::Absent) => Self::Unseen,
            (&Load::Law { constant, fan }, _) => Self::Law { constant, fan },
            _ => Self::Known,
        }
    }

    /// The experiment so driven and loaded.
    pub fn apply(self, e: Experiment, motor: &MotorFile) -> Experiment {
        match self {
            Self::Known => e,
            Self::Unknown => e.driven_by_speed(),
            Self::Unseen => e.with_unmeasured_speed(&motor.machine, &motor.rating),
            Self::Law { constant, fan } => Experiment { load: offline::Load::Law { constant, fan }, ..e },
        }
    }
}
