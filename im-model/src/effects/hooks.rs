//! The places where an effect can act.

use num_complex::Complex;

use super::leakage_law::LeakageLaw;
use crate::instant::{Currents, Output, PlantInput, Powers};
use crate::integral::integral;
use crate::parameters::TParameters;
use crate::scalar::Scalar;

/// Numbers that an effect in a sensor or in the voltage path keeps from sample to sample.
pub type Memory<T> = [Complex<T>; 8];

/// The states of the machine itself, without those that effects add, where they lie: with derivatives they are too large to be copied.
#[derive(Clone, Copy, Debug)]
pub struct BaseState<'a, T> {
    pub(crate) fluxes: [&'a Complex<T>; 2],
    pub(crate) motion: [&'a T; 2],
}

impl<T: Copy> BaseState<'_, T> {
    /// Stator flux linkage, Vs.
    #[inline(always)]
    pub fn psi_s(&self) -> Complex<T> {
        *self.fluxes[0]
    }
    /// Rotor flux linkage, Vs.
    #[inline(always)]
    pub fn psi_r(&self) -> Complex<T> {
        *self.fluxes[1]
    }
    /// Mechanical speed of the rotor, rad/s.
    #[inline(always)]
    pub fn omega_m(&self) -> T {
        *self.motion[0]
    }
    /// Mechanical angle of the rotor, rad.
    #[inline(always)]
    pub fn theta_m(&self) -> T {
        *self.motion[1]
    }
}

/// What an effect sees of the machine.
#[derive(Clone, Copy, Debug)]
pub struct Operating<'a, T> {
    /// Fluxes, speed and angle.
    pub state: BaseState<'a, T>,
    /// Currents and magnetizing flux.
    pub currents: &'a Currents<T>,
    /// Parameters, resistances cold.
    pub parameters: &'a TParameters<T>,
    /// Voltage and load torque.
    pub input: &'a PlantInput<T>,
    /// Load torque: what the input says, and what the law of the load and effects at the load add, Nm.
    pub tau_load: T,
    /// Stator resistance at the present temperature, Ω.
    pub r_s: T,
    /// Rotor resistance at the present temperature, Ω.
    pub r_r: T,
    /// Pole pairs.
    pub n_p: f64,
}

impl<T: Scalar> Operating<'_, T> {
    /// Electrical speed, rad/s.
    #[inline(always)]
    pub fn omega_e(&self) -> T {
        self.state.omega_m().scale(self.n_p)
    }
}

/// A copy of what a [`BaseState`] points to.
pub(super) struct BaseStateApart<T> {
    fluxes: [Complex<T>; 2],
    motion: [T; 2],
}

impl<T: Copy> BaseStateApart<T> {
    pub(super) fn new(x: &BaseState<T>) -> Self {
        Self { fluxes: x.fluxes.map(|psi| *psi), motion: x.motion.map(|x| *x) }
    }
    pub(super) fn seen(&self) -> BaseState<'_, T> {
        BaseState { fluxes: self.fluxes.each_ref(), motion: self.motion.each_ref() }
    }
}

/// Copies of what an [`Operating`] points to: for hooks behind a call that the compiler does not see into.
pub(crate) struct Apart<T> {
    state: BaseStateApart<T>,
    currents: Currents<T>,
    input: PlantInput<T>,
}

impl<T: Scalar> Apart<T> {
    pub(crate) fn new(at: &Operating<T>) -> Self {
        Self { state: BaseStateApart::new(&at.state), currents: *at.currents, input: *at.input }
    }
    pub(crate) fn operating<'a>(&'a self, at: &Operating<'a, T>) -> Operating<'a, T> {
        Operating { state: self.state.seen(), currents: &self.currents, input: &self.input, ..*at }
    }
}

/// Names the hooks of [`Hooks`], for an effect of the user's own that says which it has.
#[allow(non_camel_case_types, missing_docs, reason = "each is named like its hook")]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hook {
    transport_delay,
    applied_voltage,
    stator_resistance,
    rotor_resistance,
    stator_drop,
    stator_mirrored_inductance,
    rotor_mirrored_inductance,
    rotor_drop,
    braking_torque,
    shaft_torque,
    load_speed,
    load_angle,
    load_torque,
    rotor_inertia,
    reluctance,
    leakage,
    core_branch,
    core_source,
    added_currents,
    rates,
    settled,
    powers,
    stored_energy,
    measured_current,
    measured_speed,
    shown_speed,
    speed_behind,
    remember,
    recalled,
    passed_voltage,
    added_resistance,
    fastest_rate,
}

/// A set of hooks: those that an effect has. The others are not called, which saves most of what a call from afar costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HookSet(u32);

impl HookSet {
    /// None.
    pub const NONE: Self = Self(0);
    /// All.
    pub const ALL: Self = Self(u32::MAX);

    /// These and one more.
    #[must_use]
    pub const fn with(self, hook: Hook) -> Self {
        Self(self.0 | 1 << hook as u32)
    }
    /// Both sets.
    pub(super) const fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
    /// Whether it has a hook.
    #[inline(always)]
    pub(super) const fn has(self, hook: Hook) -> bool {
        self.0 >> hook as u32 & 1 == 1
    }
    /// Whether it has any.
    #[inline(always)]
    pub(super) const fn any(self) -> bool {
        self.0 != 0
    }
}

/// The physics of an effect at each place; a place left out is not touched.
///
/// A hook is called only while a strength of the effect is nonzero. What has been computed so far goes in and comes back changed;
/// effects act in the order of the registry. `own` are the states of the effect, in the order of [`Effect::STATES`](super::Effect::STATES),
/// a space vector as two numbers.
pub trait Hooks<T: Scalar> {
    /// Transport delay of the commanded voltage, s.
    #[inline(always)]
    fn transport_delay(&self, delay: T) -> T {
        delay
    }
    /// Applied voltage: what reaches the terminals of what was commanded, V.
    #[inline(always)]
    fn applied_voltage(&self, u: Complex<T>, _i_s: Complex<T>) -> Complex<T> {
        u
    }
    /// Stator resistance at the present temperature, Ω.
    #[inline(always)]
    fn stator_resistance(&self, r: T, _own: &[T]) -> T {
        r
    }
    /// Rotor resistance at the present temperature, Ω.
    #[inline(always)]
    fn rotor_resistance(&self, r: T, _own: &[T]) -> T {
        r
    }
    /// Stator winding: adds a voltage drop in series, V.
    #[inline(always)]
    fn stator_drop(&self, drop: Complex<T>, _at: &Operating<T>, _own: &[T]) -> Complex<T> {
        drop
    }
    /// Stator winding: adds L of a flux L ī_s in series, H; the leakage L_ls is given. Less than the leakages in size.
    #[inline(always)]
    fn stator_mirrored_inductance(&self, l: Complex<T>, _l_ls: T) -> Complex<T> {
        l
    }
    /// Rotor winding: adds L of a flux L e^{j2θ_e} ī_r in series (as seen from the stator), H; the leakage L_lr is given. Less than the
    /// leakages in size.
    #[inline(always)]
    fn rotor_mirrored_inductance(&self, l: Complex<T>, _l_lr: T) -> Complex<T> {
        l
    }
    /// Rotor winding (in the stator frame): adds a voltage drop in series, V.
    #[inline(always)]
    fn rotor_drop(&self, drop: Complex<T>, _at: &Operating<T>, _own: &[T]) -> Complex<T> {
        drop
    }
    /// Torque balance: adds a torque that opposes positive rotation, Nm.
    #[inline(always)]
    fn braking_torque(&self, torque: T, _at: &Operating<T>, _own: &[T]) -> T {
        torque
    }
    /// The torque by which the load reaches the rotor, Nm.
    #[inline(always)]
    fn shaft_torque(&self, torque: T, _at: &Operating<T>, _own: &[T]) -> T {
        torque
    }
    /// Speed of what the load torque acts on, rad/s.
    #[inline(always)]
    fn load_speed(&self, omega: T, _own: &[T]) -> T {
        omega
    }
    /// Angle of what the load torque acts on, rad.
    #[inline(always)]
    fn load_angle(&self, theta: T, _own: &[T]) -> T {
        theta
    }
    /// Load: adds a torque that opposes positive rotation where the load is, at its angle, rad, Nm.
    #[inline(always)]
    fn load_torque(&self, torque: T, _load_angle: T) -> T {
        torque
    }
    /// Inertia that turns with the rotor, kg m².
    #[inline(always)]
    fn rotor_inertia(&self, inertia: T) -> T {
        inertia
    }

    /// Flux-current map: adds to μ in i_m = μ(|ψ_m|²) ψ_m/L_m, as (μ, dμ/d|ψ_m|²). The map must stay monotone.
    #[inline(always)]
    fn reluctance(&self, so_far: (T, T), _psi_m_squared: T) -> (T, T) {
        so_far
    }
    /// ∫ of what [`reluctance`](Self::reluctance) adds to μ, over |ψ_m|² from zero: by quadrature unless written.
    fn reluctance_integral(&self, psi_m_squared: T) -> T {
        integral(psi_m_squared, |q| self.reluctance((T::one(), T::zero()), q).0 - T::one())
    }
    /// The magnetizing flux that the map is tabulated around, Vs. Asked for when the effect is off, too.
    #[inline(always)]
    fn reference_flux(&self, flux: T) -> T {
        flux
    }
    /// How a leakage branch with 1/L_l, H⁻¹, saturates.
    #[inline(always)]
    fn leakage(&self, law: Option<LeakageLaw<T>>, _inv_l: T) -> Option<LeakageLaw<T>> {
        law
    }
    /// Flux-current map: adds 1/L of a branch i = (ψ_m − ψ)/L across the magnetizing branch, where ψ is a state of the effect, H⁻¹.
    #[inline(always)]
    fn core_branch(&self, inv_l: T) -> T {
        inv_l
    }
    /// Adds ψ/L of that branch, A.
    #[inline(always)]
    fn core_source(&self, source: Complex<T>, _own: &[T]) -> Complex<T> {
        source
    }

    /// Flux-current map: adds to the currents at given fluxes, after the map is solved: branches across the windings.
    #[inline(always)]
    fn added_currents(
        &self,
        currents: Currents<T>,
        _state: BaseState<T>,
        _parameters: &TParameters<T>,
        _n_p: f64,
    ) -> Currents<T> {
        currents
    }

    /// Rates of the own states, 1/s of them.
    #[inline(always)]
    fn rates(&self, _rates: &mut [T], _at: &Operating<T>, _powers: &Powers<T>, _own: &[T]) {}
    /// Where the own states lie when they follow the machine at once, for a start in motion. States that are left alone begin at zero,
    /// and speeds with the rotor's.
    #[inline(always)]
    fn settled(&self, _own: &mut [T], _at: &Operating<T>, _psi_m_rate: Complex<T>) {}
    /// Corrects the powers, W: what is stored is no loss, what is lost elsewhere stands in its own place.
    #[inline(always)]
    fn powers(&self, _powers: &mut Powers<T>, _at: &Operating<T>, _own: &[T]) {}
    /// Adds the energy in the own states, J.
    #[inline(always)]
    fn stored_energy(&self, energy: T, _at: &Operating<T>, _own: &[T]) -> T {
        energy
    }

    /// Current sensors: what they show, A.
    #[inline(always)]
    fn measured_current(&self, i: Complex<T>) -> Complex<T> {
        i
    }
    /// Speed sensor: what it shows, rad/s; `filter` are the states of its filters.
    #[inline(always)]
    fn measured_speed(&self, omega_m: T, _filter: &[T]) -> T {
        omega_m
    }
    /// Speed sensor: what its disc makes of the speed, rad/s, at an angle of the shaft, rad; before [`measured_speed`](Self::measured_speed).
    #[inline(always)]
    fn shown_speed(&self, omega_m: T, _theta_m: T) -> T {
        omega_m
    }
    /// The states of the sensor's filters after a sample of length `t`, s, in which the speed went from `before` to `now`, rad/s.
    #[inline(always)]
    fn filter(&self, _filter: &mut [T], _before: T, _now: T, _t: T) {}

    /// Speed sensor: the true speed behind what is shown, the inverse of what [`measured_speed`](Self::measured_speed) and
    /// [`filter`](Self::filter) make of it. Value, first and second derivative go in and come back, rad/s and per s.
    #[inline(always)]
    fn speed_behind(&self, shown: [T; 3]) -> [T; 3] {
        shown
    }

    /// Sensors, once per sample: the memory after a sample of length `t`, s, over which what is there to be shown went from the first to the
    /// second. No memory: the first sample. Of users' effects alone.
    #[inline(always)]
    fn remember(&self, _memory: &mut Option<Memory<T>>, _readings: [Output<T>; 2], _t: T) {}
    /// Sensors: what they show, given what is remembered.
    #[inline(always)]
    fn recalled(&self, shown: Output<T>, _memory: &Memory<T>) -> Output<T> {
        shown
    }
    /// Voltage path, once per sample: the mean over a sample of length `t`, s, of what passes of a voltage; the voltage before the sample and
    /// the one held over it are given. Of users' effects alone.
    #[inline(always)]
    fn passed_voltage(&self, voltages: [Complex<T>; 2], _memory: &mut Option<Memory<T>>, _t: T) -> Complex<T> {
        voltages[1]
    }

    /// Resistance that it adds to the windings for small changes, Ω, where it is largest.
    #[inline(always)]
    fn added_resistance(&self, _cold_r_r: f64) -> f64 {
        0.0
    }
    /// The fastest rate of its own, 1/s, for a rotor of the given inertia, kg m²: what steps must resolve.
    #[inline(always)]
    fn fastest_rate(&self, _rotor_inertia: f64) -> f64 {
        0.0
    }
}
