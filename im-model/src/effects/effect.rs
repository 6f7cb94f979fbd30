//! What an effect is made of.

use super::about::{About, Card, ParameterInfo, Place, Role, StateInfo};
use super::hooks::Hooks;
use crate::scalar::Scalar;

/// An effect: its parameters, what is known about it, and its physics, the [`Hooks`].
pub trait Effect<T: Scalar>: Hooks<T> + Copy {
    /// The identifier in files.
    const NAME: &'static str;
    /// The card.
    const CARD: Card;
    /// What simulation, scoring and reports must know.
    const ABOUT: About = About::at(Place::Mechanics);
    /// The parameters, in the order of [`get`](Self::get).
    const PARAMETERS: &'static [ParameterInfo];
    /// The states that it adds to the machine.
    const STATES: &'static [StateInfo] = &[];
    /// How many filter states it adds to the speed sensor.
    const FILTERS: usize = 0;

    /// Reads the parameter at `index` of [`PARAMETERS`](Self::PARAMETERS).
    fn get(&self, index: usize) -> T;
    /// Writes the parameter at `index`; an index out of range does nothing.
    fn set(&mut self, index: usize, value: T);

    /// Whether every strength is zero, derivatives included.
    #[inline]
    fn is_off(&self) -> bool {
        Self::PARAMETERS.iter().enumerate().all(|(k, p)| p.role != Role::Strength || self.get(k).is_zero())
    }

    /// Changes fixed parameters of an effect that is off to what a sampling, s, can follow.
    fn suit_sampling(&mut self, _sample_time_s: T) {}
}

/// Defines the struct of an effect together with its parameter table, its card and its physics.
macro_rules! effect {
    (
        $(#[$meta:meta])*
        $name:ident, $id:literal,
        about: $about:expr,
        card: $card:expr,
        parameters: {
            $($(#[doc = $fdoc:literal])* $field:ident: $role:ident, default $default:expr, $unit:literal, $scale:ident,
                typical $lo:literal to $hi:literal, $bound:expr;)*
        },
        $(states: [$($state:literal: $kind:ident),*],)?
        $(filters: $filters:literal,)?
        hooks: { $($hooks:tt)* }
        $(, own: { $($own:tt)* })?
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
            const ABOUT: $crate::effects::About = $about;
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
            $(const STATES: &'static [$crate::effects::StateInfo] = &[
                $($crate::effects::StateInfo { name: $state, kind: $crate::effects::StateKind::$kind }),*
            ];)?
            $(const FILTERS: usize = $filters;)?

            fn get(&self, index: usize) -> T {
                [$(self.$field),*][index]
            }

            fn set(&mut self, index: usize, value: T) {
                if let Some(x) = [$(&mut self.$field),*].into_iter().nth(index) {
                    *x = value;
                }
            }

            $($($own)*)?
        }

        impl<T: $crate::Scalar> $crate::effects::Hooks<T> for $name<T> {
            $($hooks)*
        }
    };
}
pub(crate) use effect;
