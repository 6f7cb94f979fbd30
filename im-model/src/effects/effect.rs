//! What an effect is made of.

use num_complex::Complex;

use crate::error::Bound;
use crate::scalar::Scalar;

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
