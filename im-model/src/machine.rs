//! The machine: base parameters, pole pairs, effects, rating. Valid by construction.

use crate::air_gap::AirGapSaturation;
use crate::effects::{EffectId, Effects, ParameterInfo};
use crate::error::{Bound, ModelError};
use crate::parameters::{BaseParameter, TParameters};
use crate::rating::Rating;
use crate::scalar::Scalar;

/// A machine whose parameters and effects have been checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Machine<T> {
    parameters: TParameters<T>,
    pole_pairs: u32,
    effects: Effects<T>,
    air_gap: Option<AirGapSaturation<T>>,
}

impl<T: Scalar> Machine<T> {
    /// Checks everything: base parameters positive and finite, 1 to 100 pole pairs, effects within bounds.
    pub fn try_new(parameters: TParameters<T>, pole_pairs: u32, effects: Effects<T>) -> Result<Self, ModelError> {
        parameters.validate()?;
        Bound::Within(1.0, 100.0).check("pole_pairs", f64::from(pole_pairs))?;
        effects.validate()?;
        Ok(Self { parameters, pole_pairs, effects, air_gap: None })
    }

    /// The same machine with an air gap of its own, or without.
    ///
    /// # Errors
    /// The air gap does not suit the T circuit, or an effect that saturates the leakages by their own currents is on beside it.
    pub fn with_air_gap(&self, air_gap: Option<AirGapSaturation<T>>) -> Result<Self, ModelError> {
        if let Some(gap) = &air_gap {
            gap.validate(&self.parameters)?;
            let drop = self.effects.leakage_flux_saturation.drop.value();
            Bound::Within(0.0, 0.0)
                .check("leakage_flux_saturation.drop beside [machine.air_gap], which saturates the leakage itself,", drop)?;
        }
        Ok(Self { air_gap, ..*self })
    }

    /// The linear machine.
    pub fn base(parameters: TParameters<T>, pole_pairs: u32) -> Result<Self, ModelError> {
        Self::try_new(parameters, pole_pairs, Effects::none())
    }

    /// The same machine with other effects.
    pub fn with_effects(&self, effects: Effects<T>) -> Result<Self, ModelError> {
        Self::try_new(self.parameters, self.pole_pairs, effects)?.with_air_gap(self.air_gap)
    }

    /// The same machine with some effects switched off.
    pub fn without(&self, some: impl IntoIterator<Item = EffectId>) -> Result<Self, ModelError> {
        let mut effects = self.effects;
        some.into_iter().for_each(|e| effects.switch_off(e));
        self.with_effects(effects)
    }

    /// The same machine with other base parameters.
    pub fn with_parameters(&self, parameters: TParameters<T>) -> Result<Self, ModelError> {
        Self::try_new(parameters, self.pole_pairs, self.effects)?.with_air_gap(self.air_gap)
    }

    /// The base parameters.
    pub fn parameters(&self) -> &TParameters<T> {
        &self.parameters
    }
    /// The effects.
    pub fn effects(&self) -> &Effects<T> {
        &self.effects
    }
    /// How the air-gap flux saturates iron and leakage, where that is the machine's own and no effect.
    pub fn air_gap(&self) -> Option<&AirGapSaturation<T>> {
        self.air_gap.as_ref()
    }
    /// n_p.
    pub fn pole_pairs(&self) -> u32 {
        self.pole_pairs
    }

    /// Reads any parameter.
    pub fn get(&self, id: ParameterId) -> T {
        match id {
            ParameterId::Base(p) => self.parameters.values()[p as usize],
            ParameterId::Effect(e, k) => self.effects.get(e, k),
        }
    }

    /// The same machine with windings that are warmer or colder: R_s and R_r times a positive factor each.
    pub fn warmed(&self, [stator, rotor]: [f64; 2]) -> Self {
        let mut warm = *self;
        warm.parameters.stator_resistance_ohm = self.parameters.stator_resistance_ohm.scale(stator);
        warm.parameters.rotor_resistance_ohm = self.parameters.rotor_resistance_ohm.scale(rotor);
        warm
    }

    /// A copy in another scalar type, with `f` giving every parameter: how sensitivities are seeded.
    pub fn map<U: Scalar>(&self, mut f: impl FnMut(ParameterId, f64) -> U) -> Machine<U> {
        let mut values = [U::zero(); 7];
        for (v, p) in values.iter_mut().zip(BaseParameter::ALL) {
            let id = ParameterId::Base(p);
            *v = f(id, self.get(id).value());
        }
        let mut effects = self.effects.cast::<U>();
        for e in self.effects.ids() {
            for k in 0..e.parameters().len() {
                let id = ParameterId::Effect(e, k);
                effects.set(e, k, f(id, self.get(id).value()));
            }
        }
        let air_gap = self.air_gap.as_ref().map(AirGapSaturation::cast);
        Machine { parameters: TParameters::from_values(values), pole_pairs: self.pole_pairs, effects, air_gap }
    }

    /// The same machine in another scalar type.
    pub fn cast<U: Scalar>(&self) -> Machine<U> {
        self.map(|_, x| U::from_f64(x))
    }
}

impl Machine<f64> {
    /// The same machine with some parameters changed, checked again.
    pub fn with(&self, changes: &[(ParameterId, f64)]) -> Result<Self, ModelError> {
        let mut whole = *self;
        // A user's effect that is not there yet comes with its change.
        for (id, value) in changes {
            if let ParameterId::Effect(e @ EffectId::Custom(_), k) = *id {
                whole.effects.set(e, k, *value);
            }
        }
        let m = whole.map(|id, x| changes.iter().rev().find(|(c, _)| *c == id).map_or(x, |(_, v)| *v));
        Self::try_new(m.parameters, m.pole_pairs, m.effects)?.with_air_gap(m.air_gap)
    }
}

/// Names any parameter of a machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ParameterId {
    /// A base parameter.
    Base(BaseParameter),
    /// Parameter `1` of effect `0`.
    Effect(EffectId, usize),
}

impl ParameterId {
    /// The key in files.
    pub fn key(self) -> &'static str {
        match self {
            Self::Base(p) => p.key(),
            Self::Effect(e, k) => e.parameters()[k].key,
        }
    }
    /// The unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Base(p) => p.unit(),
            Self::Effect(e, k) => e.parameters()[k].unit,
        }
    }
    /// What is known about a parameter of an effect.
    pub fn info(self) -> Option<&'static ParameterInfo> {
        match self {
            Self::Base(_) => None,
            Self::Effect(e, k) => Some(&e.parameters()[k]),
        }
    }
    /// The hard limit.
    pub fn bound(self) -> Bound {
        match self {
            Self::Base(p) => p.bound(),
            Self::Effect(e, k) => e.parameters()[k].bound,
        }
    }
}

impl core::fmt::Display for ParameterId {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Base(p) => f.write_str(p.key()),
            Self::Effect(e, k) => write!(f, "{e}.{}", e.parameters()[*k].key),
        }
    }
}

impl Machine<f64> {
    /// The same machine, the effects that are off with their defaults for it ([`Effects::rescale`]).
    pub fn rescaled(&self, rating: &Rating) -> Result<Self, ModelError> {
        let mut effects = self.effects;
        effects.rescale(rating, &self.parameters, self.pole_pairs);
        self.with_effects(effects)
    }
}

impl Effects<f64> {
    /// Effects off, with defaults and fixed parameters scaled to a machine.
    pub fn scaled(rating: &Rating, p: &TParameters<f64>, pole_pairs: u32) -> Self {
        let mut e = Self::none();
        e.rescale(rating, p, pole_pairs);
        e
    }

    /// Sets every parameter of the effects that are off to its default for a machine.
    pub fn rescale(&mut self, rating: &Rating, p: &TParameters<f64>, pole_pairs: u32) {
        let ids: [Option<EffectId>; 32] = {
            let mut a = [None; 32];
            for (slot, id) in a.iter_mut().zip(self.ids()) {
                *slot = Some(id);
            }
            a
        };
        for id in ids.into_iter().flatten() {
            if !self.is_on(id) {
                for (k, info) in id.parameters().iter().enumerate() {
                    self.set(id, k, info.default * rating.unit_of(info.scale, p, pole_pairs));
                }
            }
        }
    }
}
