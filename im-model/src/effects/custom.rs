//! Effects written by users of the crate: the same trait [`Effect`], carried through every scalar type by reference.

use core::cmp::Ordering;
use core::hash::{Hash, Hasher};

use num_complex::Complex;

#[allow(unused_imports, reason = "named in the documentation")]
use super::Effect;
use super::{Card, Operating, ParameterInfo, Role};
use crate::dual::Dual;
use crate::scalar::Scalar;

/// How many effects of the user's own a machine can carry.
pub const MAX_CUSTOM: usize = 2;
/// How many parameters one of them may have.
pub const MAX_CUSTOM_PARAMETERS: usize = 4;

/// The hooks of [`Effect`] for one scalar type, with the parameter values passed in. Implemented by
/// [`register_effect!`](crate::register_effect), not by hand.
#[allow(missing_docs)]
pub trait Hooks<T: Scalar>: Send + Sync {
    fn applied_voltage(&self, values: &[T], u: Complex<T>, i_s: Complex<T>) -> Complex<T>;
    fn stator_drop(&self, values: &[T], drop: Complex<T>, at: &Operating<T>) -> Complex<T>;
    fn rotor_drop(&self, values: &[T], drop: Complex<T>, at: &Operating<T>) -> Complex<T>;
    fn braking_torque(&self, values: &[T], torque: T, at: &Operating<T>) -> T;
    fn reluctance(&self, values: &[T], so_far: (T, T), psi_m_squared: T) -> (T, T);
    fn measured_current(&self, values: &[T], i: Complex<T>) -> Complex<T>;
    fn measured_speed(&self, values: &[T], omega_m: T) -> T;
    fn own_rates(&self, values: &[T], at: &Operating<T>) -> [T; 2];
}

/// A user's effect in every scalar type that the workspace simulates in. Made by [`register_effect!`](crate::register_effect).
pub trait CustomEffect: Hooks<f32> + Hooks<f64> + Hooks<Dual<4>> + Hooks<Dual<6>> + Hooks<Dual<8>> {
    /// The identifier in files.
    fn name(&self) -> &'static str;
    /// The parameters, at most [`MAX_CUSTOM_PARAMETERS`].
    fn parameters(&self) -> &'static [ParameterInfo];
    /// Whether it is fixed to the shaft or the rotor.
    fn is_fixed_to_shaft(&self) -> bool;
    /// The card.
    fn card(&self) -> Card;
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
    /// The card.
    pub fn card(self) -> Card {
        self.0.card()
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
}

impl<T: Scalar> Custom<T> {
    pub(crate) fn off(id: CustomId) -> Self {
        let mut values = [T::zero(); MAX_CUSTOM_PARAMETERS];
        for (v, p) in values.iter_mut().zip(id.parameters()) {
            *v = T::from_f64(p.default);
        }
        Self { id, values }
    }

    pub(crate) fn is_off(&self) -> bool {
        self.id.parameters().iter().zip(&self.values).all(|(p, v)| p.role != Role::Strength || v.is_zero())
    }

    /// The hooks for this scalar; an effect that is off touches nothing.
    pub(crate) fn hooks(&self) -> &'static dyn Hooks<T> {
        static NOTHING: Nothing = Nothing;
        if self.is_off() { &NOTHING } else { T::hooks(self.id.0).unwrap_or(&NOTHING) }
    }
}

/// Touches nothing.
struct Nothing;

impl<T: Scalar> Hooks<T> for Nothing {
    fn applied_voltage(&self, _: &[T], u: Complex<T>, _: Complex<T>) -> Complex<T> {
        u
    }
    fn stator_drop(&self, _: &[T], drop: Complex<T>, _: &Operating<T>) -> Complex<T> {
        drop
    }
    fn rotor_drop(&self, _: &[T], drop: Complex<T>, _: &Operating<T>) -> Complex<T> {
        drop
    }
    fn braking_torque(&self, _: &[T], torque: T, _: &Operating<T>) -> T {
        torque
    }
    fn reluctance(&self, _: &[T], so_far: (T, T), _: T) -> (T, T) {
        so_far
    }
    fn measured_current(&self, _: &[T], i: Complex<T>) -> Complex<T> {
        i
    }
    fn measured_speed(&self, _: &[T], omega_m: T) -> T {
        omega_m
    }
    fn own_rates(&self, _: &[T], _: &Operating<T>) -> [T; 2] {
        [T::zero(); 2]
    }
}

/// Makes an effect type of the user's own, generic over the scalar, usable wherever a built-in one is.
///
/// `register_effect!(pub CoggingEffect: Cogging)` defines the unit struct `CoggingEffect`, for `CustomId(&CoggingEffect)`.
/// `Cogging<T>` implements [`Effect`](crate::effects::Effect)`<T>` and `Default` for every [`Scalar`](crate::Scalar).
#[macro_export]
macro_rules! register_effect {
    ($vis:vis $name:ident: $effect:ident) => {
        #[doc = concat!("The effect `", stringify!($effect), "`, registered.")]
        $vis struct $name;

        const _: () = {
            use $crate::effects::{Card, CustomEffect, Effect, Hooks, Operating, ParameterInfo};
            use $crate::{Complex, Scalar};

            fn of<T: Scalar>(values: &[T]) -> $effect<T> {
                let mut e = <$effect<T> as Default>::default();
                for (k, v) in values.iter().enumerate().take(<$effect<T> as Effect<T>>::PARAMETERS.len()) {
                    e.set(k, *v);
                }
                e
            }

            impl<T: Scalar> Hooks<T> for $name {
                fn applied_voltage(&self, v: &[T], u: Complex<T>, i_s: Complex<T>) -> Complex<T> {
                    of(v).applied_voltage(u, i_s)
                }
                fn stator_drop(&self, v: &[T], drop: Complex<T>, at: &Operating<T>) -> Complex<T> {
                    of(v).stator_drop(drop, at)
                }
                fn rotor_drop(&self, v: &[T], drop: Complex<T>, at: &Operating<T>) -> Complex<T> {
                    of(v).rotor_drop(drop, at)
                }
                fn braking_torque(&self, v: &[T], torque: T, at: &Operating<T>) -> T {
                    of(v).braking_torque(torque, at)
                }
                fn reluctance(&self, v: &[T], so_far: (T, T), psi_m_squared: T) -> (T, T) {
                    of(v).reluctance(so_far, psi_m_squared)
                }
                fn measured_current(&self, v: &[T], i: Complex<T>) -> Complex<T> {
                    of(v).measured_current(i)
                }
                fn measured_speed(&self, v: &[T], omega_m: T) -> T {
                    of(v).measured_speed(omega_m)
                }
                fn own_rates(&self, v: &[T], at: &Operating<T>) -> [T; 2] {
                    of(v).own_rates(at)
                }
            }

            impl CustomEffect for $name {
                fn name(&self) -> &'static str {
                    <$effect<f64> as Effect<f64>>::NAME
                }
                fn parameters(&self) -> &'static [ParameterInfo] {
                    <$effect<f64> as Effect<f64>>::PARAMETERS
                }
                fn is_fixed_to_shaft(&self) -> bool {
                    <$effect<f64> as Effect<f64>>::FIXED_TO_SHAFT
                }
                fn card(&self) -> Card {
                    <$effect<f64> as Effect<f64>>::CARD
                }
            }
        };
    };
}
