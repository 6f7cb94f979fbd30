//! Physical effects beyond the linear fifth-order machine.
//!
//! An effect is one file: a small struct with its own parameters, the physics at the place where it acts, and a [`Card`] for people.
//! Its *strength* parameters switch it on: with all of them zero the base machine is reproduced bit for bit. *Shape* parameters
//! matter only when the effect is on; *fixed* ones are not estimated. The list in `registry.rs` is closed; a new effect is one new
//! file and one line there. Users add their own with [`register_effect!`](crate::register_effect)
//! and [`Effects::with_custom`], through the same trait [`Effect`].
//!
//! Places: flux-current map and extra branches ([`FluxMap`](crate::FluxMap)), windings, temperatures, torque balance and shaft
//! ([`Plant`](crate::Plant)), applied voltage, sensors ([`Bench`](crate::Bench)).

mod coulomb_friction;
mod current_sensor_gain;
mod current_sensor_offset;
mod custom;
mod effect;
mod inverter_nonlinearity;
mod iron_loss;
mod leakage_flux_saturation;
mod load_torque_ripple;
mod main_flux_saturation;
mod registry;
mod rotor_asymmetry;
mod rotor_heating;
mod rotor_skin_effect;
mod shaft_compliance;
mod speed_sensor_lag;
mod stator_asymmetry;
mod stator_heating;
mod voltage_delay;
mod voltage_gain;
mod windage;

pub use coulomb_friction::CoulombFriction;
pub use current_sensor_gain::CurrentSensorGain;
pub use current_sensor_offset::CurrentSensorOffset;
pub use custom::{Custom, CustomEffect, CustomId, Hooks, MAX_CUSTOM, MAX_CUSTOM_PARAMETERS};
pub(crate) use effect::effect;
pub use effect::{Card, Effect, Operating, ParameterInfo, Role, ScaleOf};
pub use inverter_nonlinearity::InverterNonlinearity;
pub use iron_loss::IronLoss;
pub(crate) use leakage_flux_saturation::Branch;
pub use leakage_flux_saturation::LeakageFluxSaturation;
pub use load_torque_ripple::LoadTorqueRipple;
pub use main_flux_saturation::MainFluxSaturation;
pub use registry::{EffectId, Effects};
pub use rotor_asymmetry::RotorAsymmetry;
pub use rotor_heating::RotorHeating;
pub use rotor_skin_effect::RotorSkinEffect;
pub use shaft_compliance::ShaftCompliance;
pub use speed_sensor_lag::SpeedSensorLag;
pub use stator_asymmetry::StatorAsymmetry;
pub use stator_heating::StatorHeating;
pub use voltage_delay::VoltageDelay;
pub use voltage_gain::VoltageGain;
pub use windage::Windage;
