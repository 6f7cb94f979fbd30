//! Names of the hidden effects and their sizes.

use std::fmt;
use std::str::FromStr;

macro_rules! effects {
    ($($(#[$doc:meta])* $kind:ident $name:literal [$weak:literal, $medium:literal, $strong:literal],)*) => {
        /// A physical effect the base machine does not have.
        ///
        /// Some lie outside the library of effects that a diagnosis knows.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum EffectKind {
            $($(#[$doc])* $kind,)*
        }

        impl EffectKind {
            /// All effects.
            pub const ALL: &[Self] = &[$(Self::$kind,)*];

            /// Identifier in files and on the command line.
            pub fn name(self) -> &'static str {
                match self { $(Self::$kind => $name,)* }
            }

            /// Weak, medium and strong size; each effect says what its number means.
            pub fn sizes(self) -> [f64; 3] {
                match self { $(Self::$kind => [$weak, $medium, $strong],)* }
            }
        }
    };
}

effects! {
    /// Size: fraction by which the magnetizing inductance has fallen at rated flux.
    MainFluxSaturation "main_flux_saturation" [0.04, 0.12, 0.30],
    /// Size: fraction by which the leakage inductances have fallen at twice rated current.
    LeakageFluxSaturation "leakage_flux_saturation" [0.08, 0.18, 0.35],
    /// Size: share of the rotor conductance near the surface of the bars.
    RotorSkinEffect "rotor_skin_effect" [0.12, 0.25, 0.45],
    /// Size: iron loss at rated voltage and frequency over rated power.
    IronLoss "iron_loss" [0.02, 0.04, 0.08],
    /// Size: steady rise of the stator resistance at rated current, fraction.
    StatorHeating "stator_heating" [0.08, 0.2, 0.45],
    /// Size: steady rise of the rotor resistance at rated current, fraction.
    RotorHeating "rotor_heating" [0.15, 0.35, 0.7],
    /// Size: dry friction over rated torque.
    CoulombFriction "coulomb_friction" [0.01, 0.03, 0.08],
    /// Size: windage torque at synchronous speed over rated torque.
    Windage "windage" [0.02, 0.05, 0.12],
    /// Size: lost phase voltage over rated phase voltage.
    InverterNonlinearity "inverter_nonlinearity" [0.0015, 0.005, 0.02],
    /// Size: samples by which the voltage is late.
    VoltageDelay "voltage_delay" [0.3, 0.7, 1.5],
    /// Size: fraction by which the voltage is off.
    VoltageGain "voltage_gain" [0.01, 0.025, 0.06],
    /// Size: fraction by which one phase's current sensor is off.
    CurrentSensorGain "current_sensor_gain" [0.01, 0.025, 0.06],
    /// Size: offset of one phase's current sensor over rated peak current.
    CurrentSensorOffset "current_sensor_offset" [0.004, 0.012, 0.035],
    /// Size: delay of the measured speed, s.
    SpeedSensorLag "speed_sensor_lag" [0.0008, 0.002, 0.006],
    /// Size: extra resistance of one stator phase, fraction.
    StatorAsymmetry "stator_asymmetry" [0.03, 0.08, 0.2],
    /// Size: extra resistance of one rotor phase, fraction.
    RotorAsymmetry "rotor_asymmetry" [0.04, 0.1, 0.25],
    /// Size: shaft compliance relative to the one with 20 Hz torsional resonance.
    ShaftCompliance "shaft_compliance" [0.07, 0.25, 1.0],
    /// Size: torque ripple over rated torque.
    LoadTorqueRipple "load_torque_ripple" [0.015, 0.04, 0.1],
    /// Size: relative change of the main inductance from tooth to slot.
    RotorSlotting "rotor_slotting" [0.008, 0.02, 0.06],
    /// Size: coercive current over rated magnetizing current.
    HysteresisLoss "hysteresis_loss" [0.02, 0.05, 0.12],
    /// Size: stray-load loss at rated current and speed over rated power.
    StrayLoadTorque "stray_load_torque" [0.01, 0.025, 0.06],
    /// Size: one over the clipping level, in units of rated peak current.
    CurrentSensorSaturation "current_sensor_saturation" [0.75, 0.9, 1.15],
    /// Size: fraction by which the measured speed is off.
    SpeedSensorScale "speed_sensor_scale" [0.003, 0.01, 0.03],
    /// Size: fraction by which one phase's voltage is low; the others are high by half of it.
    SupplyUnbalance "supply_unbalance" [0.008, 0.02, 0.05],
    /// Size: voltage that one leg of the inverter makes too much, over rated voltage.
    VoltageOffset "voltage_offset" [0.0008, 0.002, 0.006],
    /// Size: relative difference of the main inductance between two stator axes, over two.
    MagneticAnisotropy "magnetic_anisotropy" [0.02, 0.06, 0.15],
    /// Size: torque of the slots over rated torque.
    CoggingTorque "cogging_torque" [0.05, 0.12, 0.3],
    /// Size: torque of the bump over rated torque.
    CamLoad "cam_load" [0.04, 0.1, 0.25],
    /// Size: largest torque over rated torque.
    EddyCurrentBrake "eddy_current_brake" [0.03, 0.08, 0.2],
    /// Size: torque at the start over rated torque.
    ColdGrease "cold_grease" [0.04, 0.1, 0.25],
    /// Size: what the stator resistance gains, fraction.
    LooseConnector "loose_connector" [0.08, 0.2, 0.5],
    /// Size: what the rotor resistance gains, fraction.
    OpenRingJoint "open_ring_joint" [0.08, 0.2, 0.5],
    /// Size: part of the voltage that the rated current costs.
    DcLinkSag "dc_link_sag" [0.01, 0.025, 0.06],
    /// Size: part of the voltage that is lost at synchronous speed.
    Overmodulation "overmodulation" [0.01, 0.025, 0.06],
    /// Size: part of the voltage that is lost at the deepest.
    SupplyDip "supply_dip" [0.01, 0.03, 0.08],
    /// Size: part of the stator leakage that rated flux takes.
    CrossSaturation "cross_saturation" [0.1, 0.2, 0.4],
    /// Size: part by which the shown speed swings over a turn.
    EccentricEncoder "eccentric_encoder" [0.003, 0.008, 0.02],
    /// Size: part of the shown speed that is lost at synchronous speed.
    BentTachogenerator "bent_tachogenerator" [0.004, 0.01, 0.025],
    /// Size: part of the current reading that eddy currents in the sensor's core hold back.
    SlowCurrentSensor "slow_current_sensor" [0.01, 0.03, 0.08],
}

impl EffectKind {
    /// Whether the effect is one that a diagnosis knows by name.
    pub fn in_library(self) -> bool {
        im_model::EffectId::from_name(self.name()).is_some()
    }

    /// Whether the effect takes seconds to show.
    pub fn is_thermal(self) -> bool {
        matches!(self, Self::StatorHeating | Self::RotorHeating)
    }

    /// Whether a steady state has other frequencies by the effect: harmonics, a negative sequence, zero frequency or side bands of the
    /// speed. The others change nothing there but the phasors of the fundamental and the mean speed, as parameters do.
    pub fn has_frequencies_of_its_own(self) -> bool {
        use EffectKind as E;
        let electric = matches!(
            self,
            E::InverterNonlinearity
                | E::SupplyUnbalance
                | E::VoltageOffset
                | E::StatorAsymmetry
                | E::RotorAsymmetry
                | E::LoadTorqueRipple
        );
        let sensors = matches!(self, E::CurrentSensorGain | E::CurrentSensorOffset | E::CurrentSensorSaturation);
        electric || sensors || matches!(self, E::RotorSlotting | E::HysteresisLoss | E::MagneticAnisotropy)
    }
}

impl fmt::Display for EffectKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A text that names no effect or no strength.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownName(pub String);

impl fmt::Display for UnknownName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "unknown name `{}`", self.0)
    }
}

impl std::error::Error for UnknownName {}

impl FromStr for EffectKind {
    type Err = UnknownName;
    fn from_str(text: &str) -> Result<Self, UnknownName> {
        Self::ALL.iter().copied().find(|kind| kind.name() == text).ok_or_else(|| UnknownName(text.to_owned()))
    }
}

/// How strong an effect is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Strength {
    /// Near what sensor noise hides.
    Weak,
    /// Ordinary.
    Medium,
    /// At the upper end of what is found in practice.
    Strong,
    /// A multiple of the strong size; zero is no effect at all.
    Relative(f64),
}

impl Strength {
    /// The size of an effect at this strength.
    pub fn size(self, kind: EffectKind) -> f64 {
        let [weak, medium, strong] = kind.sizes();
        match self {
            Self::Weak => weak,
            Self::Medium => medium,
            Self::Strong => strong,
            Self::Relative(part) => part * strong,
        }
    }
}

impl FromStr for Strength {
    type Err = UnknownName;
    fn from_str(text: &str) -> Result<Self, UnknownName> {
        match text {
            "weak" => Ok(Self::Weak),
            "medium" => Ok(Self::Medium),
            "strong" => Ok(Self::Strong),
            other => other.parse().map(Self::Relative).map_err(|_| UnknownName(other.to_owned())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_read_back() {
        for &kind in EffectKind::ALL {
            assert_eq!(kind.name().parse(), Ok(kind));
        }
        for effect in im_model::EffectId::ALL {
            assert!(effect.name().parse::<EffectKind>().is_ok(), "{effect} has no trial");
        }
        assert!("saturation".parse::<EffectKind>().is_err());
    }
}
