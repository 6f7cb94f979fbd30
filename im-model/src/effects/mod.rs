//! Physical effects beyond the linear fifth-order machine.
//!
//! An effect is one file: a small struct with its own parameters, the physics at the places where it acts (its [`Hooks`]), what the
//! workspace must know of it ([`About`]), and a [`Card`] for people. Its *strength* parameters switch it on: with all of them zero the
//! base machine is reproduced bit for bit. *Shape* parameters matter only when the effect is on; *fixed* ones are not estimated.
//!
//! **The list below is the registry**: a new effect is one new file and one line there. Users add their own with
//! [`register_effect!`](crate::register_effect) and [`Effects::with_custom`], through the same traits [`Effect`] and [`Hooks`].

mod about;
#[cfg(feature = "std")]
mod curve;
mod custom;
mod effect;
mod free_form;
mod hooks;
mod lag;
mod leakage_law;
mod registry;
mod set;
mod sizes;
#[cfg(test)]
mod trying;

use num_complex::Complex;

pub use about::{About, Card, ParameterInfo, Place, Role, ScaleOf, StateInfo, StateKind, SteadyState};
#[cfg(feature = "std")]
pub use curve::{Drawn, Frame, Rated};
pub use custom::{Custom, CustomEffect, CustomHooks, CustomId, MAX_CUSTOM, MAX_CUSTOM_PARAMETERS, MAX_CUSTOM_STATES};
pub use effect::Effect;
pub(crate) use effect::effect;
pub use free_form::{Acts, COEFFICIENTS, FreeForm, Over};
use hooks::Apart;
pub use hooks::{BaseState, Hook, HookSet, Hooks, Memory, Operating};
pub use leakage_law::LeakageLaw;
pub(crate) use registry::Active;
pub(crate) use set::Memories;
pub(crate) use sizes::{FILTER_STATES, UNKNOWNS};

use crate::instant::Powers;
use crate::scalar::Scalar;

// Formatting: `cargo fmt` does not see modules that a macro declares; `rustfmt im-model/src/effects/*.rs` does.
registry::registry! {
    MainFluxSaturation main_flux_saturation,
    LeakageFluxSaturation leakage_flux_saturation,
    RotorSkinEffect rotor_skin_effect,
    IronLoss iron_loss,
    StatorHeating stator_heating,
    RotorHeating rotor_heating,
    CoulombFriction coulomb_friction,
    Windage windage,
    StrayLoadTorque stray_load_torque,
    // Order matters for the voltage: what is amplified then loses the dead time.
    SupplyUnbalance supply_unbalance,
    VoltageGain voltage_gain,
    VoltageOffset voltage_offset,
    VoltageDelay voltage_delay,
    InverterNonlinearity inverter_nonlinearity,
    // A sensor's gain acts before its offset.
    CurrentSensorGain current_sensor_gain,
    CurrentSensorOffset current_sensor_offset,
    SpeedSensorLag speed_sensor_lag,
    SpeedSensorScale speed_sensor_scale,
    StatorAsymmetry stator_asymmetry,
    RotorAsymmetry rotor_asymmetry,
    ShaftCompliance shaft_compliance,
    LoadTorqueRipple load_torque_ripple,
}
