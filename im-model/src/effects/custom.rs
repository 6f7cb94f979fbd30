//! Effects written by users of the crate: the same trait [`Effect`], carried through every scalar type by reference.

use core::any::Any;
use core::cmp::Ordering;
use core::hash::{Hash, Hasher};

#[allow(unused_imports, reason = "named in the documentation")]
use super::Effect;
use super::{About, Card, EffectId, FreeForm, HookSet, Hooks, ParameterInfo, Role, StateInfo, UNKNOWNS};
use crate::dual::{Dual, SingleDual};
use crate::scalar::Scalar;

/// How many effects of the user's own a machine can carry.
pub const MAX_CUSTOM: usize = 2;
/// How many parameters one of them may have.
pub const MAX_CUSTOM_PARAMETERS: usize = 11;
/// How many numbers the states of one of them may be.
pub const MAX_CUSTOM_STATES: usize = 2;

/// The physics of a user's effect in one scalar type. Implemented by [`register_effect!`](crate::register_effect), not by hand.
pub trait CustomHooks<T: Scalar>: Send + Sync {
    /// Calls `act` with the hooks of the effect with these parameter values.
    fn with(&self, values: &[T], act: &mut dyn FnMut(&dyn Hooks<T>));
}

/// A user's effect in every scalar type that the workspace simulates in. Made by [`register_effect!`](crate::register_effect).
pub trait CustomEffect:
    CustomHooks<f32>
    + CustomHooks<f64>
    + CustomHooks<SingleDual<4>>
    + CustomHooks<SingleDual<8>>
    + CustomHooks<SingleDual<12>>
    + CustomHooks<Dual<UNKNOWNS>>
{
    /// The identifier in files.
    fn name(&self) -> &'static str;
    /// The parameters, at most [`MAX_CUSTOM_PARAMETERS`].
    fn parameters(&self) -> &'static [ParameterInfo];
    /// What simulation and scoring must know.
    fn about(&self) -> About;
    /// Its states, at most [`MAX_CUSTOM_STATES`] numbers.
    fn states(&self) -> &'static [StateInfo];
    /// The card.
    fn card(&self) -> Card;
    /// The hooks that it has.
    fn hooks(&self) -> HookSet {
        HookSet::ALL
    }
    /// The effect as a curve that no formula gives, if it is one.
    fn free_form(&self) -> Option<&FreeForm> {
        None
    }
}

/// The hooks of a user's effect in a number type; none in a type that nothing is simulated in.
fn hooks_in<T: Scalar>(effect: &'static dyn CustomEffect) -> Option<&'static dyn CustomHooks<T>> {
    // The comparison of types folds at compile time.
    fn same<A: Copy + 'static, B: Copy + 'static>(hooks: A) -> Option<B> {
        (&hooks as &dyn Any).downcast_ref().copied()
    }
    same::<&'static dyn CustomHooks<f64>, _>(effect)
        .or_else(|| same::<&'static dyn CustomHooks<f32>, _>(effect))
        .or_else(|| same::<&'static dyn CustomHooks<SingleDual<4>>, _>(effect))
        .or_else(|| same::<&'static dyn CustomHooks<SingleDual<8>>, _>(effect))
        .or_else(|| same::<&'static dyn CustomHooks<SingleDual<12>>, _>(effect))
        .or_else(|| same::<&'static dyn CustomHooks<Dual<UNKNOWNS>>, _>(effect))
}

/// Names a user's effect.
#[derive(Clone, Copy)]
pub struct CustomId(pub &'static dyn CustomEffect);

impl CustomId {
    /// The identifier in files.
    pub fn name(self) -> &'static str {
        self.0.name()
    }
    /// The parameters.
    pub fn parameters(self) -> &'static [ParameterInfo] {
        self.0.parameters()
    }
}

impl EffectId {
    /// The effect as a curve that no formula gives, if it is one.
    pub fn free_form(self) -> Option<&'static FreeForm> {
        if let Self::Custom(c) = self { c.0.free_form() } else { None }
    }
}

impl core::fmt::Debug for CustomId {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}
impl PartialEq for CustomId {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}
impl Eq for CustomId {}
impl PartialOrd for CustomId {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for CustomId {
    fn cmp(&self, other: &Self) -> Ordering {
        self.name().cmp(other.name())
    }
}
impl Hash for CustomId {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.name().hash(state);
    }
}

/// A user's effect with its parameter values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Custom<T> {
    pub(crate) id: CustomId,
    pub(crate) values: [T; MAX_CUSTOM_PARAMETERS],
    pub(super) hooks: HookSet,
}

impl<T: Scalar> Custom<T> {
    pub(crate) fn off(id: CustomId) -> Self {
        let mut values = [T::zero(); MAX_CUSTOM_PARAMETERS];
        for (v, p) in values.iter_mut().zip(id.parameters()) {
            *v = T::from_f64(p.default);
        }
        Self { id, values, hooks: id.0.hooks() }
    }

    pub(crate) fn is_off(&self) -> bool {
        self.id.parameters().iter().zip(&self.values).all(|(p, v)| p.role != Role::Strength || v.is_zero())
    }

    /// Carries `so_far` through a hook.
    pub(crate) fn through<A: Copy>(&self, so_far: A, hook: impl Fn(&dyn Hooks<T>, A) -> A) -> A {
        let mut value = so_far;
        if let Some(effect) = hooks_in(self.id.0) {
            effect.with(&self.values, &mut |h| value = hook(h, value));
        }
        value
    }

    /// Lets a hook do what it does.
    pub(crate) fn act(&self, hook: &mut dyn FnMut(&dyn Hooks<T>)) {
        if let Some(effect) = hooks_in(self.id.0) {
            effect.with(&self.values, hook);
        }
    }
}

/// Makes an effect type of the user's own, generic over the scalar, usable wherever a built-in one is.
///
/// `register_effect!(pub CoggingEffect: Cogging)` defines the unit struct `CoggingEffect`, for `CustomId(&CoggingEffect)`.
/// `Cogging<T>` implements [`Effect`](crate::effects::Effect)`<T>`, its hooks and `Default` for every [`Scalar`](crate::Scalar).
#[macro_export]
macro_rules! register_effect {
    ($vis:vis $name:ident: $effect:ident) => {
        #[doc = concat!("The effect `", stringify!($effect), "`, registered.")]
        $vis struct $name;

        const _: () = {
            use $crate::effects::{About, Card, CustomEffect, CustomHooks, Effect, Hooks, ParameterInfo, StateInfo};

            impl<T: $crate::Scalar> CustomHooks<T> for $name {
                fn with(&self, values: &[T], act: &mut dyn FnMut(&dyn Hooks<T>)) {
                    let mut effect = <$effect<T> as Default>::default();
                    for (k, v) in values.iter().enumerate().take(<$effect<T> as Effect<T>>::PARAMETERS.len()) {
                        effect.set(k, *v);
                    }
                    act(&effect);
                }
            }

            impl CustomEffect for $name {
                fn name(&self) -> &'static str {
                    <$effect<f64> as Effect<f64>>::NAME
                }
                fn parameters(&self) -> &'static [ParameterInfo] {
                    <$effect<f64> as Effect<f64>>::PARAMETERS
                }
                fn about(&self) -> About {
                    <$effect<f64> as Effect<f64>>::ABOUT
                }
                fn states(&self) -> &'static [StateInfo] {
                    <$effect<f64> as Effect<f64>>::STATES
                }
                fn card(&self) -> Card {
                    <$effect<f64> as Effect<f64>>::CARD
                }
            }
        };
    };
}
