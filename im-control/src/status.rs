//! What a drive says about itself at each sample.

use core::fmt;

/// A set of conditions. Empty is all well.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DriveStatus(u16);

impl DriveStatus {
    /// All well.
    pub const OK: Self = Self(0);
    /// The current sample was not a number, or not plausible; a predicted one was used.
    pub const CURRENT_LOST: Self = Self(1);
    /// The speed sample was not a number, or not plausible; the last one was used.
    pub const SPEED_LOST: Self = Self(1 << 1);
    /// The dc voltage was not a number, or negative; the last one was used.
    pub const DC_VOLTAGE_LOST: Self = Self(1 << 2);
    /// A reference was not a number; the last one was used.
    pub const REFERENCE_LOST: Self = Self(1 << 3);
    /// A reference was outside its limits and was brought inside.
    pub const REFERENCE_LIMITED: Self = Self(1 << 4);
    /// The current is at its limit: torque or flux is less than asked for.
    pub const CURRENT_LIMITED: Self = Self(1 << 5);
    /// The voltage is at its limit.
    pub const VOLTAGE_LIMITED: Self = Self(1 << 6);
    /// The rotor flux is being built up; there is no torque yet.
    pub const MAGNETIZING: Self = Self(1 << 7);
    /// Too many samples were lost: the last command fades out until the measurement is back.
    pub const BLOCKED: Self = Self(1 << 8);
    /// The controller gave something that is no number; it was restarted.
    pub const RESTARTED: Self = Self(1 << 9);
    /// The measured current is beyond the limit of the drive, not only of the controller.
    pub const OVERCURRENT: Self = Self(1 << 10);
    /// The flux is below its reference for want of voltage.
    pub const FIELD_WEAKENING: Self = Self(1 << 11);
    /// A flying start: the current is held at zero until the flux that the machine carries is found.
    pub const CATCHING: Self = Self(1 << 12);

    /// The stator frequency is so low that no observer sees the speed from it: a sensorless drive passes here, and does not stay.
    pub const SPEED_UNSEEN: Self = Self(1 << 13);

    const NAMES: [&'static str; 14] = [
        "current_lost",
        "speed_lost",
        "dc_voltage_lost",
        "reference_lost",
        "reference_limited",
        "current_limited",
        "voltage_limited",
        "magnetizing",
        "blocked",
        "restarted",
        "overcurrent",
        "field_weakening",
        "catching",
        "speed_unseen",
    ];

    /// Whether every condition of `other` holds.
    pub const fn has(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// This and that.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// This, and that if `condition`.
    #[must_use]
    pub const fn and_if(self, condition: bool, other: Self) -> Self {
        if condition { self.and(other) } else { self }
    }

    /// The bits, for a fieldbus or a log: bit k is the k-th constant above.
    pub const fn bits(self) -> u16 {
        self.0
    }
}

impl fmt::Display for DriveStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut first = true;
        for (_, name) in Self::NAMES.iter().enumerate().filter(|(k, _)| self.0 & (1 << k) != 0) {
            if !first {
                f.write_str(", ")?;
            }
            f.write_str(name)?;
            first = false;
        }
        if first { f.write_str("ok") } else { Ok(()) }
    }
}

/// Says how it is doing, about the last sample.
pub trait Reports {
    /// The conditions that hold.
    fn status(&self) -> DriveStatus {
        DriveStatus::OK
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_are_named() {
        assert_eq!(DriveStatus::OK.to_string(), "ok");
        let s = DriveStatus::CURRENT_LOST.and(DriveStatus::BLOCKED).and_if(false, DriveStatus::OVERCURRENT);
        assert_eq!(s.to_string(), "current_lost, blocked");
        assert!(s.has(DriveStatus::BLOCKED) && !s.has(DriveStatus::OVERCURRENT));
        assert_eq!(DriveStatus::FIELD_WEAKENING.to_string(), "field_weakening");
    }
}
