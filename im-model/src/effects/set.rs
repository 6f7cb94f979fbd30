//! A set of effects: what is the same whatever is on the list.

use num_complex::Complex;

use super::about::StateKind;
use super::hooks::BaseStateApart;
use super::registry::acts_in_equations;
use super::{
    ABOUT, Active, BaseState, COUNT, Custom, CustomId, EffectId, Effects, Extra, Hook, Hooks, MAX_CUSTOM, Memory, Place, STATES,
};
use crate::error::ModelError;
use crate::instant::{Currents, Output};
use crate::parameters::TParameters;
use crate::scalar::Scalar;

/// What each of the user's effects remembers.
pub(crate) type Memories<T> = [Option<Memory<T>>; MAX_CUSTOM];

impl<T> Extra<T> {
    /// The states of the built-in effects, in the order of the registry.
    pub fn values(&self) -> impl Iterator<Item = &T> {
        EffectId::ALL.iter().flat_map(|&id| self.of(id))
    }

    /// Each state of the built-in effects, with its kind; a space vector is two numbers.
    pub fn each_mut(&mut self, mut f: impl FnMut(EffectId, StateKind, &mut [T])) {
        for &id in EffectId::ALL {
            let mut rest = self.of_mut(id);
            for info in id.states() {
                let (state, more) = rest.split_at_mut(info.width());
                f(id, info.kind, state);
                rest = more;
            }
        }
    }
}

/// What of an effect the step asks for once, for all that are on.
#[derive(Clone, Copy)]
enum Trait {
    InEquations,
    InSensors,
    HasStates,
}

const fn bits(wanted: Trait) -> u64 {
    let (mut bits, mut k) = (0, 0);
    while k < COUNT {
        let is = match wanted {
            Trait::InEquations => acts_in_equations(&ABOUT[k], STATES[k]),
            Trait::InSensors => matches!(ABOUT[k].place, Place::Sensors),
            Trait::HasStates => !STATES[k].is_empty(),
        };
        if is {
            bits |= 1 << k;
        }
        k += 1;
    }
    bits
}

impl Active {
    /// Whether any acts in the equations of motion outside the flux-current map.
    pub(crate) const fn in_equations(self) -> bool {
        const BITS: u64 = bits(Trait::InEquations);
        self.meets(BITS)
    }
    /// Whether any acts in the sensors.
    pub(crate) const fn in_sensors(self) -> bool {
        const BITS: u64 = bits(Trait::InSensors);
        self.meets(BITS)
    }
    /// Whether any has states, whose rates may be those of losses.
    pub(crate) const fn have_states(self) -> bool {
        const BITS: u64 = bits(Trait::HasStates);
        self.meets(BITS)
    }
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

    /// Adds a user's effect, off. At most `MAX_CUSTOM` fit; further ones are refused with `false`.
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

    /// The slot of a user's effect, which is added where it is not there: in the place of one that is off, if all are taken.
    pub(super) fn slot_for(&mut self, id: CustomId) -> Option<&mut Custom<T>> {
        if !self.add_custom(id)
            && let Some(off) = self.custom.iter_mut().flatten().find(|s| s.is_off())
        {
            *off = Custom::off(id);
        }
        self.custom.iter_mut().flatten().find(|s| s.id == id)
    }

    /// Carries the currents through [`Hooks::added_currents`] of the user's effects that are on.
    #[inline(never)]
    pub(crate) fn added_currents(
        &self,
        on: Active,
        c: Currents<T>,
        x: BaseState<T>,
        p: &TParameters<T>,
        n_p: f64,
    ) -> Currents<T> {
        let (x, p) = (BaseStateApart::new(&x), *p);
        self.through_custom(on, Hook::added_currents, c, |h, c, _| h.added_currents(c, x.seen(), &p, n_p))
    }

    /// Carries the speed through [`Hooks::shown_speed`] of the user's effects that are on.
    pub(crate) fn shown_speed(&self, on: Active, omega_m: T, theta_m: T) -> T {
        self.through_custom(on, Hook::shown_speed, omega_m, |h, w, _| h.shown_speed(w, theta_m))
    }

    /// [`Hooks::remember`] of the user's effects that are on.
    pub(crate) fn remember(&self, on: Active, memories: &mut Memories<T>, readings: [Output<T>; 2], t: T) {
        self.each_custom(on, Hook::remember, |h, slot| h.remember(&mut memories[slot], readings, t));
    }

    /// Carries what the sensors show through [`Hooks::recalled`] of those that remember something.
    pub(crate) fn recalled(&self, on: Active, shown: Output<T>, memories: &Memories<T>) -> Output<T> {
        self.through_custom(on, Hook::recalled, shown, |h, shown, slot| match &memories[slot] {
            Some(memory) => h.recalled(shown, memory),
            None => shown,
        })
    }

    /// Carries a voltage through [`Hooks::passed_voltage`]; the one before the sample is given first.
    pub(crate) fn passed_voltage(&self, on: Active, voltages: [Complex<T>; 2], memories: &mut Memories<T>, t: T) -> Complex<T> {
        let [before, mut u] = voltages;
        self.each_custom(on, Hook::passed_voltage, |h, slot| u = h.passed_voltage([before, u], &mut memories[slot], t));
        u
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
        self.active().any(|id| id.about().fixed_to_shaft)
    }

    /// How often per turn of the shaft the fundamental repeats of each effect that is on and fixed to it: its order, or twice per turn of the
    /// field where it has none.
    pub fn orders_on_shaft(&self, pole_pairs: u32) -> impl Iterator<Item = f64> + '_ {
        self.active().filter(|id| id.about().fixed_to_shaft).map(move |id| {
            let order = id.parameters().iter().position(|p| p.key == "order");
            order.map_or(2.0 * f64::from(pole_pairs), |k| self.get(id, k).value().abs())
        })
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

    pub(super) fn slot(&self, id: CustomId) -> Option<&Custom<T>> {
        self.custom.iter().flatten().find(|s| s.id == id)
    }

    /// Carries a quantity through a hook of the user's effects that are on; the hook is given the effect's slot.
    #[inline(always)]
    pub(super) fn through_custom<A: Copy>(
        &self,
        on: Active,
        name: Hook,
        so_far: A,
        hook: impl Fn(&dyn Hooks<T>, A, usize) -> A,
    ) -> A {
        if on.any_custom_has(name) { self.through_each_custom(on, name, so_far, hook) } else { so_far }
    }

    #[inline(never)]
    fn through_each_custom<A: Copy>(&self, on: Active, name: Hook, so_far: A, hook: impl Fn(&dyn Hooks<T>, A, usize) -> A) -> A {
        let mut x = so_far;
        for (slot, c) in self.custom.iter().enumerate().filter(|(slot, _)| on.has_custom(*slot)) {
            if let Some(c) = c.as_ref().filter(|c| c.hooks.has(name)) {
                x = c.through(x, |h, x| hook(h, x, slot));
            }
        }
        x
    }

    /// Lets a hook of the user's effects that are on do what it does.
    pub(super) fn each_custom(&self, on: Active, name: Hook, mut hook: impl FnMut(&dyn Hooks<T>, usize)) {
        for (slot, c) in self.custom.iter().enumerate().filter(|(slot, _)| on.has_custom(*slot)) {
            if let Some(c) = c.as_ref().filter(|c| c.hooks.has(name)) {
                c.act(&mut |h| hook(h, slot));
            }
        }
    }
}
