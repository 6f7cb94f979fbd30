//! Physical effects beyond the linear fifth-order machine.
//!
//! An effect is one file: a small struct with its own parameters, the physics at the place where it acts, and a [`Card`] for people.
//! Its *strength* parameters switch it on: with all of them zero the base machine is reproduced bit for bit. *Shape* parameters
//! matter only when the effect is on; *fixed* ones are not estimated. The registry at the end of this file is the closed list;
//! a new effect is one new file and one line there. Users add their own with [`register_effect!`](crate::register_effect)
//! and [`Effects::with_custom`], through the same trait [`Effect`].
//!
//! Places: flux-current map and extra branches ([`FluxMap`](crate::FluxMap)), windings, temperatures, torque balance and shaft
//! ([`Plant`](crate::Plant)), applied voltage, sensors ([`Bench`](crate::Bench)).

use num_complex::Complex;

use crate::error::{Bound, ModelError};
use crate::scalar::Scalar;

mod coulomb_friction;
mod current_sensor_gain;
mod current_sensor_offset;
mod custom;
mod inverter_nonlinearity;
mod iron_loss;
mod leakage_flux_saturation;
mod load_torque_ripple;
mod main_flux_saturation;
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
pub use inverter_nonlinearity::InverterNonlinearity;
pub use iron_loss::IronLoss;
pub(crate) use leakage_flux_saturation::Branch;
pub use leakage_flux_saturation::LeakageFluxSaturation;
pub use load_torque_ripple::LoadTorqueRipple;
pub use main_flux_saturation::MainFluxSaturation;
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

/// What a parameter of an effect does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Zero switches the effect off.
    Strength,
    /// Estimated together with the strength; without meaning when the effect is off.
    Shape,
    /// A small whole number: tried over its usual range, not refitted.
    Order,
    /// Part of the definition; not estimated.
    Fixed,
}

/// The machine quantity that a parameter is measured in, so that typical sizes fit a machine of any rating.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScaleOf {
    /// A pure number, or a time in s.
    One,
    /// Rated phase voltage, peak, V.
    Voltage,
    /// Rated phase current, peak, A.
    Current,
    /// Rated rotor flux, Vs.
    Flux,
    /// Rated torque, Nm.
    Torque,
    /// Rated torque over squared synchronous speed, Nm s².
    TorquePerSpeedSquared,
    /// Rated current over rated voltage, S.
    Conductance,
    /// Synchronous mechanical speed, rad/s.
    Speed,
    /// 1 K/s at rated stator copper loss, K/J.
    StatorHeating,
    /// 1 K/s at rated rotor copper loss, K/J.
    RotorHeating,
}

/// One parameter of an effect.
#[derive(Clone, Copy, Debug)]
pub struct ParameterInfo {
    /// Key in files, with the unit.
    pub key: &'static str,
    /// Unit; empty for pure numbers.
    pub unit: &'static str,
    /// What it means.
    pub meaning: &'static str,
    /// What it does.
    pub role: Role,
    /// What it is measured in.
    pub scale: ScaleOf,
    /// Value that the effect starts from, in units of `scale`; zero for strengths.
    pub default: f64,
    /// Smallest and largest usual magnitude, in units of `scale`. Beyond ten times the largest a fit is not believed.
    pub typical: (f64, f64),
    /// The hard limit, in the parameter's own unit.
    pub bound: Bound,
}

/// What people should know about an effect.
#[derive(Clone, Copy, Debug)]
pub struct Card {
    /// A short name.
    pub title: &'static str,
    /// What it is, with its equation.
    pub what: &'static str,
    /// How it shows in measurements.
    pub shows: &'static str,
    /// What it is mistaken for, and how to tell the two apart.
    pub rivals: &'static [(&'static str, &'static str)],
    /// A test that excites it.
    pub test: &'static str,
    /// Where it acts.
    pub place: &'static str,
    /// Where the model comes from.
    pub source: &'static str,
}

/// What an effect sees of the machine.
#[derive(Clone, Copy, Debug)]
pub struct Operating<T> {
    /// Stator current, stator frame, A.
    pub i_s: Complex<T>,
    /// Rotor current, stator frame, A.
    pub i_r: Complex<T>,
    /// Magnetizing flux linkage, Vs.
    pub psi_m: Complex<T>,
    /// Mechanical speed, rad/s.
    pub omega_m: T,
    /// Mechanical angle, rad.
    pub theta_m: T,
    /// Stator resistance at the present temperature, Ω.
    pub r_s: T,
    /// Rotor resistance at the present temperature, Ω.
    pub r_r: T,
    /// Pole pairs.
    pub n_p: T,
    /// Own states of a user's effect; zero for built-in effects.
    pub own: [T; 2],
}

/// An effect: its parameters and its physics at each place. A place left out is not touched.
///
/// Every hook receives what has been computed so far and returns it changed, so that an effect that is off returns it as it is.
pub trait Effect<T: Scalar>: Copy {
    /// The parameters, in the order of [`get`](Self::get).
    const PARAMETERS: &'static [ParameterInfo];
    /// The card.
    const CARD: Card;
    /// The identifier in files.
    const NAME: &'static str;
    /// Whether it is fixed to the shaft or the rotor: what it does then depends on the angle at which a recording happens to begin.
    const FIXED_TO_SHAFT: bool = false;

    /// Reads the parameter at `index` of [`PARAMETERS`](Self::PARAMETERS).
    fn get(&self, index: usize) -> T;
    /// Writes the parameter at `index`; an index out of range does nothing.
    fn set(&mut self, index: usize, value: T);

    /// Whether every strength is zero, derivatives included.
    #[inline]
    fn is_off(&self) -> bool {
        Self::PARAMETERS.iter().enumerate().all(|(k, p)| p.role != Role::Strength || self.get(k).is_zero())
    }

    /// Applied voltage: what reaches the terminals of what was commanded, V.
    #[inline(always)]
    fn applied_voltage(&self, u: Complex<T>, _i_s: Complex<T>) -> Complex<T> {
        u
    }
    /// Stator winding: adds a voltage drop in series, V.
    #[inline(always)]
    fn stator_drop(&self, drop: Complex<T>, _at: &Operating<T>) -> Complex<T> {
        drop
    }
    /// Rotor winding (in the stator frame): adds a voltage drop in series, V.
    #[inline(always)]
    fn rotor_drop(&self, drop: Complex<T>, _at: &Operating<T>) -> Complex<T> {
        drop
    }
    /// Torque balance: adds a torque that opposes positive rotation, Nm.
    #[inline(always)]
    fn braking_torque(&self, torque: T, _at: &Operating<T>) -> T {
        torque
    }
    /// Flux-current map: adds to μ in i_m = μ(|ψ_m|²) ψ_m/L_m, as (μ, dμ/d|ψ_m|²). The map must stay monotone.
    #[inline(always)]
    fn reluctance(&self, so_far: (T, T), _psi_m_squared: T) -> (T, T) {
        so_far
    }
    /// Current sensors: what they show, A.
    #[inline(always)]
    fn measured_current(&self, i: Complex<T>) -> Complex<T> {
        i
    }
    /// Speed sensor: what it shows, rad/s.
    #[inline(always)]
    fn measured_speed(&self, omega_m: T) -> T {
        omega_m
    }
    /// Rates of the two own states of a user's effect.
    #[inline(always)]
    fn own_rates(&self, _at: &Operating<T>) -> [T; 2] {
        [T::zero(); 2]
    }
}

/// Defines the struct of an effect together with its parameter table and card.
macro_rules! effect {
    (
        $(#[$meta:meta])*
        $name:ident, $id:literal, card: $card:expr,
        parameters: {
            $($(#[doc = $fdoc:literal])* $field:ident: $role:ident, default $default:expr, $unit:literal, $scale:ident,
                typical $lo:literal to $hi:literal, $bound:expr;)*
        },
        hooks: { $($hooks:tt)* }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $name<T> {
            $($(#[doc = $fdoc])* pub $field: T,)*
        }

        impl<T: $crate::Scalar> Default for $name<T> {
            fn default() -> Self {
                Self { $($field: T::from_f64($default),)* }
            }
        }

        impl<T: $crate::Scalar> $crate::effects::Effect<T> for $name<T> {
            const NAME: &'static str = $id;
            const CARD: $crate::effects::Card = $card;
            const PARAMETERS: &'static [$crate::effects::ParameterInfo] = &[
                $($crate::effects::ParameterInfo {
                    key: stringify!($field),
                    unit: $unit,
                    meaning: concat!($($fdoc),*),
                    role: $crate::effects::Role::$role,
                    scale: $crate::effects::ScaleOf::$scale,
                    default: $default,
                    typical: ($lo, $hi),
                    bound: $bound,
                },)*
            ];

            fn get(&self, index: usize) -> T {
                [$(self.$field),*][index]
            }

            fn set(&mut self, index: usize, value: T) {
                if let Some(x) = [$(&mut self.$field),*].into_iter().nth(index) {
                    *x = value;
                }
            }

            $($hooks)*
        }
    };
}
pub(crate) use effect;

/// Builds the closed list of effects: the identifier enum and the set with one field per effect.
macro_rules! registry {
    ($($variant:ident $field:ident),* $(,)?) => {
        /// Names an effect, in files and in diagnosis.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum EffectId {
            $(#[allow(missing_docs)] $variant,)*
            /// An effect of the user's own.
            Custom(CustomId),
        }

        impl EffectId {
            /// The built-in library.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];

            /// The identifier in files.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => <$variant<f64> as Effect<f64>>::NAME,)*
                    Self::Custom(c) => c.name(),
                }
            }

            /// The parameters, in order.
            pub fn parameters(self) -> &'static [ParameterInfo] {
                match self {
                    $(Self::$variant => <$variant<f64> as Effect<f64>>::PARAMETERS,)*
                    Self::Custom(c) => c.parameters(),
                }
            }

            /// Whether it is fixed to the shaft or the rotor ([`Effect::FIXED_TO_SHAFT`]).
            pub fn is_fixed_to_shaft(self) -> bool {
                match self {
                    $(Self::$variant => <$variant<f64> as Effect<f64>>::FIXED_TO_SHAFT,)*
                    Self::Custom(c) => c.0.is_fixed_to_shaft(),
                }
            }

            /// The card.
            pub fn card(self) -> Card {
                match self {
                    $(Self::$variant => <$variant<f64> as Effect<f64>>::CARD,)*
                    Self::Custom(c) => c.card(),
                }
            }
        }

        /// The set of effects of a machine; all off by default.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct Effects<T> {
            $(#[allow(missing_docs)] pub $field: $variant<T>,)*
            pub(crate) custom: [Option<Custom<T>>; MAX_CUSTOM],
        }

        impl<T: Scalar> Default for Effects<T> {
            fn default() -> Self {
                Self { $($field: $variant::default(),)* custom: [None; MAX_CUSTOM] }
            }
        }

        impl<T: Scalar> Effects<T> {
            /// Reads parameter `index` of `effect`.
            pub fn get(&self, effect: EffectId, index: usize) -> T {
                match effect {
                    $(EffectId::$variant => self.$field.get(index),)*
                    EffectId::Custom(c) => self.slot(c).map_or(T::from_f64(c.parameters()[index].default), |s| s.values[index]),
                }
            }

            /// Writes parameter `index` of `effect`; a user's effect must have been added before.
            pub fn set(&mut self, effect: EffectId, index: usize, value: T) {
                match effect {
                    $(EffectId::$variant => self.$field.set(index, value),)*
                    EffectId::Custom(c) => {
                        if let Some(s) = self.custom.iter_mut().flatten().find(|s| s.id == c) {
                            s.values[index] = value;
                        }
                    }
                }
            }

            /// Whether any strength of `effect` is nonzero.
            pub fn is_on(&self, effect: EffectId) -> bool {
                match effect {
                    $(EffectId::$variant => !self.$field.is_off(),)*
                    EffectId::Custom(c) => self.slot(c).is_some_and(|s| !s.is_off()),
                }
            }

            /// Resets `effect` to its defaults: off.
            pub fn switch_off(&mut self, effect: EffectId) {
                match effect {
                    $(EffectId::$variant => self.$field = $variant::default(),)*
                    EffectId::Custom(c) => {
                        for (k, p) in c.parameters().iter().enumerate() {
                            self.set(effect, k, T::from_f64(p.default));
                        }
                    }
                }
            }

            #[inline(always)]
            pub(crate) fn applied_voltage(&self, mut u: Complex<T>, i_s: Complex<T>) -> Complex<T> {
                $(u = self.$field.applied_voltage(u, i_s);)*
                for c in self.custom.iter().flatten() { u = c.hooks().applied_voltage(&c.values, u, i_s); }
                u
            }
            #[inline(always)]
            pub(crate) fn stator_drop(&self, mut drop: Complex<T>, at: &Operating<T>, own: &[[T; 2]; MAX_CUSTOM]) -> Complex<T> {
                $(drop = self.$field.stator_drop(drop, at);)*
                for (c, own) in self.custom_with(own) { drop = c.hooks().stator_drop(&c.values, drop, &Operating { own, ..*at }); }
                drop
            }
            #[inline(always)]
            pub(crate) fn rotor_drop(&self, mut drop: Complex<T>, at: &Operating<T>, own: &[[T; 2]; MAX_CUSTOM]) -> Complex<T> {
                $(drop = self.$field.rotor_drop(drop, at);)*
                for (c, own) in self.custom_with(own) { drop = c.hooks().rotor_drop(&c.values, drop, &Operating { own, ..*at }); }
                drop
            }
            #[inline(always)]
            pub(crate) fn braking_torque(&self, mut torque: T, at: &Operating<T>, own: &[[T; 2]; MAX_CUSTOM]) -> T {
                $(torque = self.$field.braking_torque(torque, at);)*
                for (c, own) in self.custom_with(own) { torque = c.hooks().braking_torque(&c.values, torque, &Operating { own, ..*at }); }
                torque
            }
            /// μ(|ψ_m|²) and its derivative.
            #[inline(always)]
            pub(crate) fn reluctance(&self, psi_m_squared: T) -> (T, T) {
                let mut mu = (T::one(), T::zero());
                $(mu = self.$field.reluctance(mu, psi_m_squared);)*
                for c in self.custom.iter().flatten() { mu = c.hooks().reluctance(&c.values, mu, psi_m_squared); }
                mu
            }
            #[inline(always)]
            pub(crate) fn measured_current(&self, mut i: Complex<T>) -> Complex<T> {
                $(i = self.$field.measured_current(i);)*
                for c in self.custom.iter().flatten() { i = c.hooks().measured_current(&c.values, i); }
                i
            }
            #[inline(always)]
            pub(crate) fn measured_speed(&self, mut omega_m: T) -> T {
                $(omega_m = self.$field.measured_speed(omega_m);)*
                for c in self.custom.iter().flatten() { omega_m = c.hooks().measured_speed(&c.values, omega_m); }
                omega_m
            }
        }
    };
}

registry! {
    MainFluxSaturation main_flux_saturation,
    LeakageFluxSaturation leakage_flux_saturation,
    RotorSkinEffect rotor_skin_effect,
    IronLoss iron_loss,
    StatorHeating stator_heating,
    RotorHeating rotor_heating,
    CoulombFriction coulomb_friction,
    Windage windage,
    // Order matters for the three on the voltage path: a delayed command is amplified, then loses the dead time.
    VoltageGain voltage_gain,
    VoltageDelay voltage_delay,
    InverterNonlinearity inverter_nonlinearity,
    // A sensor's gain acts before its offset.
    CurrentSensorGain current_sensor_gain,
    CurrentSensorOffset current_sensor_offset,
    SpeedSensorLag speed_sensor_lag,
    StatorAsymmetry stator_asymmetry,
    RotorAsymmetry rotor_asymmetry,
    ShaftCompliance shaft_compliance,
    LoadTorqueRipple load_torque_ripple,
}

impl EffectId {
    /// The built-in effect with this identifier.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|id| id.name() == name)
    }
}

impl core::fmt::Display for EffectId {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

impl<T: Scalar> Effects<T> {
    /// All effects off.
    pub fn none() -> Self {
        Self::default()
    }

    /// Adds a user's effect, off. At most [`MAX_CUSTOM`] fit; further ones are refused with `false`.
    pub fn add_custom(&mut self, id: CustomId) -> bool {
        if self.slot(id).is_some() {
            return true;
        }
        match self.custom.iter_mut().find(|s| s.is_none()) {
            Some(free) => {
                *free = Some(Custom::off(id));
                true
            }
            None => false,
        }
    }

    /// As [`add_custom`](Self::add_custom), chained.
    pub fn with_custom(mut self, id: CustomId) -> Self {
        self.add_custom(id);
        self
    }

    /// The user's effects present, on or off.
    pub fn custom_ids(&self) -> impl Iterator<Item = CustomId> + '_ {
        self.custom.iter().flatten().map(|c| c.id)
    }

    /// Every effect that can be addressed: the library and the user's own.
    pub fn ids(&self) -> impl Iterator<Item = EffectId> + '_ {
        EffectId::ALL.iter().copied().chain(self.custom_ids().map(EffectId::Custom))
    }

    /// The effects that are on.
    pub fn active(&self) -> impl Iterator<Item = EffectId> + '_ {
        self.ids().filter(|&id| self.is_on(id))
    }

    /// Whether any that is on is fixed to the shaft or the rotor.
    pub fn any_fixed_to_shaft(&self) -> bool {
        self.active().any(EffectId::is_fixed_to_shaft)
    }

    /// The same effects in another scalar type.
    pub fn cast<U: Scalar>(&self) -> Effects<U> {
        let mut out = Effects::<U>::default();
        for id in self.custom_ids() {
            out.add_custom(id);
        }
        for id in self.ids() {
            for k in 0..id.parameters().len() {
                out.set(id, k, U::from_f64(self.get(id, k).value()));
            }
        }
        out
    }

    /// Checks every parameter against its bound.
    pub fn validate(&self) -> Result<(), ModelError> {
        for id in self.ids() {
            for (k, p) in id.parameters().iter().enumerate() {
                p.bound.check(p.key, self.get(id, k).value())?;
            }
        }
        Ok(())
    }

    /// What the user's effects add to μ.
    pub(crate) fn custom_reluctance(&self, psi_m_squared: T) -> T {
        let start = (T::one(), T::zero());
        let add = |mu, c: &Custom<T>| c.hooks().reluctance(&c.values, mu, psi_m_squared);
        self.custom.iter().flatten().fold(start, add).0 - T::one()
    }

    fn slot(&self, id: CustomId) -> Option<&Custom<T>> {
        self.custom.iter().flatten().find(|s| s.id == id)
    }

    #[inline(always)]
    pub(crate) fn custom_with<'a>(&'a self, own: &'a [[T; 2]; MAX_CUSTOM]) -> impl Iterator<Item = (&'a Custom<T>, [T; 2])> {
        self.custom.iter().zip(own).filter_map(|(c, own)| c.as_ref().map(|c| (c, *own)))
    }
}
