//! The closed list of effects, and a set of them.

use super::{About, Hook, HookSet, Place, StateInfo};

/// Which effects are on: a bit for each; and the hooks that those of the user have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Active(u64, HookSet);

impl Active {
    /// None is.
    pub(crate) const NONE: Self = Self(0, HookSet::NONE);
    /// The first bit of the user's effects.
    const CUSTOM: u32 = 62;

    #[inline(always)]
    pub(super) const fn has(self, bit: u32) -> bool {
        self.0 >> bit & 1 == 1
    }
    #[inline(always)]
    pub(super) const fn with(self, bit: u32) -> Self {
        Self(self.0 | 1 << bit, self.1)
    }
    #[inline(always)]
    pub(super) const fn with_custom(self, slot: usize, hooks: HookSet) -> Self {
        let on = self.with(Self::CUSTOM + slot as u32);
        Self(on.0, self.1.and(hooks))
    }
    #[inline(always)]
    pub(crate) const fn any_custom(self) -> bool {
        self.1.any()
    }
    /// Whether any of the user's effects that are on has a hook.
    #[inline(always)]
    pub(crate) const fn any_custom_has(self, hook: Hook) -> bool {
        self.1.has(hook)
    }
    #[inline(always)]
    pub(super) const fn has_custom(self, slot: usize) -> bool {
        self.has(Self::CUSTOM + slot as u32)
    }
    /// Whether any of these is on, or a user's.
    #[inline(always)]
    pub(super) const fn meets(self, bits: u64) -> bool {
        self.0 & bits != 0 || self.any_custom()
    }
}

/// Whether an effect has a place in the equations of motion other than the flux-current map.
pub(super) const fn acts_in_equations(about: &About, states: &[StateInfo]) -> bool {
    !matches!(about.place, Place::FluxMap | Place::Command | Place::Sensors) || !states.is_empty()
}

/// Declares the effects: the module of each, the identifier enum, the set with one field per effect, and the way of every quantity
/// through their hooks.
macro_rules! registry {
    ($($variant:ident $field:ident),* $(,)?) => {
        $(mod $field; pub use $field::$variant;)*

        /// Names an effect, in files and in diagnosis.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum EffectId {
            $(#[allow(missing_docs)] $variant,)*
            /// An effect of the user's own.
            Custom(CustomId),
        }

        /// Places in the list.
        enum Index { $($variant,)* Count }

        const COUNT: usize = Index::Count as usize;
        const ABOUT: [About; COUNT] = [$(<$variant<f64> as Effect<f64>>::ABOUT),*];
        const STATES: [&[StateInfo]; COUNT] = [$(<$variant<f64> as Effect<f64>>::STATES),*];
        const FILTERS: [usize; COUNT] = [$(<$variant<f64> as Effect<f64>>::FILTERS),*];

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

            /// What simulation, scoring and reports must know.
            pub fn about(self) -> About {
                match self {
                    $(Self::$variant => ABOUT[Index::$variant as usize],)*
                    Self::Custom(c) => c.0.about(),
                }
            }

            /// The states that it adds.
            pub fn states(self) -> &'static [StateInfo] {
                match self {
                    $(Self::$variant => STATES[Index::$variant as usize],)*
                    Self::Custom(c) => c.0.states(),
                }
            }

            /// The card.
            pub fn card(self) -> Card {
                match self {
                    $(Self::$variant => <$variant<f64> as Effect<f64>>::CARD,)*
                    Self::Custom(c) => c.0.card(),
                }
            }

        }

        /// The states of all effects; those of effects that are off stay where they are.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct Extra<T> {
            $($field: [T; StateInfo::width_of(STATES[Index::$variant as usize])],)*
            custom: [[T; MAX_CUSTOM_STATES]; MAX_CUSTOM],
        }

        impl<T: Scalar> Default for Extra<T> {
            #[inline(always)]
            fn default() -> Self {
                let o = T::zero();
                Self { $($field: [o; StateInfo::width_of(STATES[Index::$variant as usize])],)* custom: [[o; MAX_CUSTOM_STATES]; MAX_CUSTOM] }
            }
        }

        impl<T> Extra<T> {
            /// The states of a built-in effect, in the order of [`Effect::STATES`], a space vector as two numbers; none for a user's effect.
            pub fn of(&self, effect: EffectId) -> &[T] {
                match effect {
                    $(EffectId::$variant => &self.$field,)*
                    EffectId::Custom(_) => &[],
                }
            }

            /// As [`of`](Self::of), to change them.
            pub fn of_mut(&mut self, effect: EffectId) -> &mut [T] {
                match effect {
                    $(EffectId::$variant => &mut self.$field,)*
                    EffectId::Custom(_) => &mut [],
                }
            }

            /// The states in other numbers.
            pub(crate) fn map<U>(&self, f: impl Fn(&T) -> U) -> Extra<U> {
                Extra { $($field: self.$field.each_ref().map(&f),)* custom: self.custom.each_ref().map(|own| own.each_ref().map(&f)) }
            }
        }

        impl<T: Scalar> Extra<T> {
            /// self = from + h·rates for the effects that are on.
            #[inline(always)]
            pub(crate) fn set_advanced(&mut self, from: &Self, rates: &Self, h: f64, on: Active) {
                $(if on.has(Index::$variant as u32) {
                    for (x, (from, rate)) in self.$field.iter_mut().zip(from.$field.iter().zip(&rates.$field)) { *x = *from + rate.scale(h); }
                })*
                if on.any_custom() {
                    let own = self.custom.iter_mut().flatten();
                    for (x, (from, rate)) in own.zip(from.custom.iter().flatten().zip(rates.custom.iter().flatten())) {
                        *x = *from + rate.scale(h);
                    }
                }
            }

            /// self += h·rates for the effects that are on.
            #[inline(always)]
            pub(crate) fn accumulate(&mut self, rates: &Self, h: f64, on: Active) {
                $(if on.has(Index::$variant as u32) {
                    for (x, rate) in self.$field.iter_mut().zip(&rates.$field) { *x += rate.scale(h); }
                })*
                if on.any_custom() {
                    for (x, rate) in self.custom.iter_mut().flatten().zip(rates.custom.iter().flatten()) { *x += rate.scale(h); }
                }
            }
        }

        /// The set of effects of a machine; all off by default.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct Effects<T> {
            $(#[allow(missing_docs)] pub $field: $variant<T>,)*
            custom: [Option<Custom<T>>; MAX_CUSTOM],
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

            /// Writes parameter `index` of `effect`; a user's effect is added where it is not there and a slot is free or held by one that is off.
            pub fn set(&mut self, effect: EffectId, index: usize, value: T) {
                match effect {
                    $(EffectId::$variant => self.$field.set(index, value),)*
                    EffectId::Custom(c) => {
                        if let Some(s) = self.slot_for(c) {
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
                        if let Some(s) = self.custom.iter_mut().flatten().find(|s| s.id == c) {
                            *s = Custom::off(c);
                        }
                    }
                }
            }

            /// A built-in effect as what is drawn.
            #[cfg(feature = "std")]
            pub(super) fn drawn(&self, effect: EffectId) -> Option<&dyn Drawn>
            where
                $($variant<T>: Drawn,)*
            {
                match effect {
                    $(EffectId::$variant => Some(&self.$field),)*
                    EffectId::Custom(_) => None,
                }
            }

            /// Changes fixed parameters of the effects that are off to what a sampling, s, can follow.
            pub fn suit_sampling(&mut self, sample_time_s: T) {
                $(if self.$field.is_off() { self.$field.suit_sampling(sample_time_s); })*
            }

            /// Those that are on.
            pub(crate) fn which(&self) -> Active {
                let mut on = Active::NONE;
                $(if !self.$field.is_off() { on = on.with(Index::$variant as u32); })*
                for (slot, c) in self.custom.iter().enumerate() {
                    if let Some(c) = c.as_ref().filter(|c| !c.is_off()) {
                        on = on.with_custom(slot, c.hooks);
                    }
                }
                on
            }

            /// The flux that the flux-current map is tabulated around, Vs.
            pub(crate) fn reference_flux(&self) -> T {
                let mut flux = T::one();
                $(flux = self.$field.reference_flux(flux);)*
                flux
            }

            $crate::effects::registry::through! { { $($variant $field),* }
                transport_delay [T] [];
                applied_voltage [Complex<T>] [i_s: Complex<T>];
                stator_resistance [T] [own];
                rotor_resistance [T] [own];
                stator_drop [Complex<T>] [at own];
                stator_mirrored_inductance [Complex<T>] [l_ls: T];
                rotor_mirrored_inductance [Complex<T>] [l_lr: T];
                rotor_drop [Complex<T>] [at own];
                braking_torque [T] [at own];
                shaft_torque [T] [at own];
                load_speed [T] [own];
                load_angle [T] [own];
                load_torque [T] [load_angle: T];
                rotor_inertia [T] [];
                reluctance [(T, T)] [psi_m_squared: T];
                leakage [Option<LeakageLaw<T>>] [inv_l: T];
                core_branch [T] [];
                core_source [Complex<T>] [own];
                stored_energy [T] [at own];
                measured_current [Complex<T>] [];
            }

            /// Carries a quantity through [`Hooks::measured_speed`].
            #[inline(always)]
            pub(crate) fn measured_speed(&self, on: Active, mut omega_m: T, filters: &[T; FILTER_STATES]) -> T {
                $(if on.has(Index::$variant as u32) {
                    omega_m = self.$field.measured_speed(omega_m, &filters[sizes::filters(Index::$variant as usize)]);
                })*
                self.through_custom(on, Hook::measured_speed, omega_m, |h, w, _| h.measured_speed(w, &[]))
            }

            /// Carries what the speed sensor shows back through [`Hooks::speed_behind`]. Linear filters and gains: their order does not matter.
            #[inline(always)]
            pub(crate) fn speed_behind(&self, on: Active, shown: [T; 3]) -> [T; 3] {
                let mut jet = self.through_custom(on, Hook::speed_behind, shown, |h, jet, _| h.speed_behind(jet));
                $(if on.has(Index::$variant as u32) { jet = self.$field.speed_behind(jet); })*
                jet
            }

            /// [`Hooks::filter`] of every effect.
            #[inline(always)]
            pub(crate) fn filter(&self, on: Active, filters: &mut [T; FILTER_STATES], before: T, now: T, t: T) {
                $(if on.has(Index::$variant as u32) {
                    self.$field.filter(&mut filters[sizes::filters(Index::$variant as usize)], before, now, t);
                })*
            }

            /// [`Hooks::powers`] of every effect.
            #[inline(always)]
            pub(crate) fn powers(&self, on: Active, powers: &mut Powers<T>, at: &Operating<T>, own: &Extra<T>) {
                $(if on.has(Index::$variant as u32) {
                    self.$field.powers(powers, at, &own.$field);
                })*
                if on.any_custom_has(Hook::powers) {
                    let (mut p, apart, own) = (*powers, Apart::new(at), own.custom);
                    let at = &apart.operating(at);
                    self.each_custom(on, Hook::powers, |h, slot| h.powers(&mut p, at, &own[slot]));
                    *powers = p;
                }
            }

            /// [`Hooks::rates`] of every effect.
            #[inline(always)]
            pub(crate) fn rates(
                &self,
                on: Active,
                rates: &mut Extra<T>,
                at: &Operating<T>,
                powers: &Powers<T>,
                own: &Extra<T>,
            ) {
                $(if on.has(Index::$variant as u32) {
                    self.$field.rates(&mut rates.$field, at, powers, &own.$field);
                })*
                if on.any_custom_has(Hook::rates) {
                    let (mut r, apart, powers, own) = (rates.custom, Apart::new(at), *powers, own.custom);
                    let at = &apart.operating(at);
                    self.each_custom(on, Hook::rates, |h, slot| h.rates(&mut r[slot], at, &powers, &own[slot]));
                    rates.custom = r;
                }
            }

            /// [`Hooks::settled`] of every effect.
            pub(crate) fn settled(&self, on: Active, own: &mut Extra<T>, at: &Operating<T>, psi_m_rate: Complex<T>) {
                $(if on.has(Index::$variant as u32) {
                    self.$field.settled(&mut own.$field, at, psi_m_rate);
                })*
                self.each_custom(on, Hook::settled, |h, slot| h.settled(&mut own.custom[slot], at, psi_m_rate));
            }

            /// Sum of [`Hooks::reluctance_integral`].
            pub(crate) fn reluctance_integral(&self, on: Active, psi_m_squared: T) -> T {
                let mut sum = T::zero();
                $(if on.has(Index::$variant as u32) { sum += self.$field.reluctance_integral(psi_m_squared); })*
                self.through_custom(on, Hook::reluctance, sum, |h, sum, _| sum + h.reluctance_integral(psi_m_squared))
            }

            /// The largest of [`Hooks::added_resistance`], Ω.
            pub(crate) fn added_resistance(&self, on: Active, cold_r_r: f64) -> f64 {
                let mut most = 0.0f64;
                $(if on.has(Index::$variant as u32) { most = most.max(self.$field.added_resistance(cold_r_r)); })*
                self.through_custom(on, Hook::added_resistance, most, |h, most, _| most.max(h.added_resistance(cold_r_r)))
            }

            /// The largest of [`Hooks::fastest_rate`], 1/s.
            pub(crate) fn fastest_rate(&self, on: Active, rotor_inertia: f64) -> f64 {
                let mut most = 0.0f64;
                $(if on.has(Index::$variant as u32) { most = most.max(self.$field.fastest_rate(rotor_inertia)); })*
                self.through_custom(on, Hook::fastest_rate, most, |h, most, _| most.max(h.fastest_rate(rotor_inertia)))
            }
        }
    };
}
pub(crate) use registry;

/// For each quantity the method that carries it through the hooks of the effects that are on, in the order of the registry: the hook's
/// name, the quantity, and what else it needs. The user's effects, behind a call that is not known here, get copies: a place whose
/// address is given away cannot stay in registers.
macro_rules! through {
    ({ $($list:tt)* }) => {};
    ({ $($list:tt)* } $hook:ident [$t:ty] []; $($rest:tt)*) => {
        #[inline(always)]
        pub(crate) fn $hook(&self, on: Active, mut x: $t) -> $t {
            $crate::effects::registry::chain! { self on $hook x [] $($list)* }
            self.through_custom(on, Hook::$hook, x, |h, x, _| h.$hook(x))
        }
        $crate::effects::registry::through! { { $($list)* } $($rest)* }
    };
    ({ $($list:tt)* } $hook:ident [$t:ty] [$arg:ident: $a:ty]; $($rest:tt)*) => {
        #[inline(always)]
        pub(crate) fn $hook(&self, on: Active, mut x: $t, $arg: $a) -> $t {
            $crate::effects::registry::chain! { self on $hook x [$arg] $($list)* }
            self.through_custom(on, Hook::$hook, x, |h, x, _| h.$hook(x, $arg))
        }
        $crate::effects::registry::through! { { $($list)* } $($rest)* }
    };
    ({ $($list:tt)* } $hook:ident [$t:ty] [own]; $($rest:tt)*) => {
        #[inline(always)]
        pub(crate) fn $hook(&self, on: Active, mut x: $t, own: &Extra<T>) -> $t {
            $crate::effects::registry::chain! { self on $hook x [own] own $($list)* }
            if on.any_custom_has(Hook::$hook) {
                let own = own.custom;
                return self.through_custom(on, Hook::$hook, x, |h, x, slot| h.$hook(x, &own[slot]));
            }
            x
        }
        $crate::effects::registry::through! { { $($list)* } $($rest)* }
    };
    ({ $($list:tt)* } $hook:ident [$t:ty] [at own]; $($rest:tt)*) => {
        #[inline(always)]
        pub(crate) fn $hook(&self, on: Active, mut x: $t, at: &Operating<T>, own: &Extra<T>) -> $t {
            $crate::effects::registry::chain! { self on $hook x [at own] at own $($list)* }
            if on.any_custom_has(Hook::$hook) {
                let (apart, own) = (Apart::new(at), own.custom);
                let at = &apart.operating(at);
                return self.through_custom(on, Hook::$hook, x, |h, x, slot| h.$hook(x, at, &own[slot]));
            }
            x
        }
        $crate::effects::registry::through! { { $($list)* } $($rest)* }
    };
}
pub(crate) use through;

/// One quantity through the hooks of the built-in effects.
macro_rules! chain {
    ($self:ident $on:ident $hook:ident $x:ident [] $($v:ident $field:ident),*) => {
        $(if $on.has(Index::$v as u32) { $x = $self.$field.$hook($x); })*
    };
    ($self:ident $on:ident $hook:ident $x:ident [own] $own:ident $($v:ident $field:ident),*) => {
        $(if $on.has(Index::$v as u32) { $x = $self.$field.$hook($x, &$own.$field); })*
    };
    ($self:ident $on:ident $hook:ident $x:ident [at own] $at:ident $own:ident $($v:ident $field:ident),*) => {
        $(if $on.has(Index::$v as u32) { $x = $self.$field.$hook($x, $at, &$own.$field); })*
    };
    ($self:ident $on:ident $hook:ident $x:ident [$arg:ident] $($v:ident $field:ident),*) => {
        $(if $on.has(Index::$v as u32) { $x = $self.$field.$hook($x, $arg); })*
    };
}
pub(crate) use chain;
