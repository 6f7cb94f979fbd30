//! The closed list of effects, and a set of them.

use num_complex::Complex;

use super::*;
use crate::error::ModelError;
use crate::scalar::Scalar;

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
