//! Equations of motion of the machine with its effects, in the stator frame, and the fixed-step integration.
//!
//! dψ_s/dt = u_s − R_s i_s,   dψ_r/dt = jω_e ψ_r − R_r i_r,   τ_e = (3/2) n_p Im(ψ_r ī_r),   J dω_m/dt = τ_e − D ω_m − τ_L
//!
//! and the terms of the effects at their places. With an unbalanced leakage ψ_s is the flux of the winding and of L_a ī_s in series with it. Every power is accounted for: [`Powers`] sums to the rate of the stored energy.

use num_complex::Complex;
use num_traits::Zero;

use crate::effects::{Active, Effects, Hook, Operating, Role};
use crate::error::ModelError;
use crate::flux_map::FluxMap;
use crate::instant::{Currents, PlantInput, Powers};
use crate::machine::Machine;
use crate::parameters::TParameters;
use crate::scalar::Scalar;
use crate::space_vector::{cross, dot, j, norm2, unit};
use crate::state::State;

/// Rates of change, and what else is known at the same instant.
#[derive(Clone, Copy, Debug)]
pub struct Evaluation<T> {
    /// d/dt of the state.
    pub rates: State<T>,
    /// Currents and magnetizing flux.
    pub currents: Currents<T>,
    /// Electromagnetic torque, Nm.
    pub torque: T,
    /// Powers.
    pub powers: Powers<T>,
}

/// Steps per sample at most. Machines at usual sampling times take one to ten, with an inverter's steep characteristic up to a hundred.
pub const SUBSTEPS_MAX: u32 = 1000;

/// Unbalanced leakages, H: of fluxes L_a ī_s in the stator and, fixed to the rotor, L_b ī_r. Zero unless the phases' or the bars' differ.
#[derive(Clone, Copy, Debug)]
struct Mirrored<T> {
    stator: Complex<T>,
    rotor: Complex<T>,
    /// Either is not zero; that of the rotor is not.
    any: bool,
    turns: bool,
}

impl<T: Scalar> Mirrored<T> {
    fn new(effects: &Effects<T>, on: Active, p: &TParameters<T>) -> Self {
        let stator = effects.stator_mirrored_inductance(on, Complex::zero(), p.stator_leakage_inductance_h);
        let rotor = effects.rotor_mirrored_inductance(on, Complex::zero(), p.rotor_leakage_inductance_h);
        let turns = !rotor.is_zero();
        Self { stator, rotor, any: turns || !stator.is_zero(), turns }
    }

    /// Both seen from the stator, where that of the rotor turns with e^{j2θ_e}.
    #[inline(always)]
    fn at(&self, theta_e: T) -> [Complex<T>; 2] {
        [self.stator, if self.turns { self.rotor * unit(theta_e + theta_e) } else { self.rotor }]
    }

    fn size(&self) -> f64 {
        let of = |l: Complex<T>| Scalar::sqrt(norm2(l).value());
        of(self.stator) + of(self.rotor)
    }
}

/// A valid machine prepared for stepping. Plain data, no allocation; steps cannot fail.
#[derive(Clone, Copy, Debug)]
pub struct Plant<T> {
    parameters: TParameters<T>,
    effects: Effects<T>,
    map: FluxMap<T>,
    mirrored: Mirrored<T>,
    on: Active,
    n_p: f64,
    /// (3/2) n_p.
    torque_factor: f64,
    /// One over the inertia that turns with the rotor.
    inv_inertia: T,
    /// Nothing is on outside the flux-current map: the short path is taken.
    plain: bool,
}

impl<T: Scalar> Plant<T> {
    /// Prepares a machine.
    pub fn new(machine: &Machine<T>) -> Self {
        let (p, effects) = (*machine.parameters(), *machine.effects());
        let on = effects.which();
        let n_p = f64::from(machine.pole_pairs());
        let mirrored = Mirrored::new(&effects, on, &p);
        Self {
            parameters: p,
            effects,
            map: FluxMap::new(&p, &effects, machine.air_gap()),
            mirrored,
            on,
            n_p,
            torque_factor: 1.5 * n_p,
            inv_inertia: T::one() / effects.rotor_inertia(on, p.inertia_kg_m2),
            plain: !on.in_equations() && !mirrored.any,
        }
    }

    /// The parameters.
    pub fn parameters(&self) -> &TParameters<T> {
        &self.parameters
    }
    /// The effects.
    pub fn effects(&self) -> &Effects<T> {
        &self.effects
    }
    /// Which effects are on.
    pub(crate) fn on(&self) -> Active {
        self.on
    }
    /// Pole pairs, as a number.
    pub fn n_p(&self) -> T {
        T::from_f64(self.n_p)
    }

    /// Currents in a state.
    #[inline]
    pub fn currents(&self, x: &State<T>) -> Currents<T> {
        self.currents_as::<false>(self.on, x)
    }

    #[inline(always)]
    fn currents_as<const PLAIN: bool>(&self, on: Active, x: &State<T>) -> Currents<T> {
        let core = self.effects.core_source(on, Complex::zero(), &x.extra);
        let mut currents = self.map.currents(x.psi_s, x.psi_r, core, &self.effects);
        if !PLAIN && self.mirrored.any {
            currents = self.behind_mirrored(currents, x, core);
        }
        if on.any_custom_has(Hook::added_currents) {
            self.effects.added_currents(on, currents, x.base(), &self.parameters, self.n_p)
        } else {
            currents
        }
    }

    /// The currents (i_s, i_r) = f(ψ_s − L_a ī_s, ψ_r − L_b ī_r) of the flux map f behind unbalanced leakages, from `linked` = f(ψ_s, ψ_r):
    /// Newton's method with the slopes Γ of the unsaturated map on either side, exact at once where one side is unbalanced and nothing
    /// saturates.
    #[inline(never)]
    fn behind_mirrored(&self, linked: Currents<T>, x: &State<T>, core: Complex<T>) -> Currents<T> {
        let [l_a, l_b] = self.mirrored.at(self.electrical_angle(x));
        let [g_s, g_r] = self.map.unsaturated_slopes();
        // Solves i + g ī = y.
        let solved = |y: Complex<T>, g: Complex<T>| (y - g * y.conj()) * (T::one() / (T::one() - norm2(g)));
        let (g_s, g_r) = (l_a * g_s, l_b * g_r);
        let (mut i_s, mut i_r) = (solved(linked.i_s, g_s), solved(linked.i_r, g_r));
        let mut currents = linked;
        // The error falls by |L_a|/L_l times what the slope is off, a hundredth or so, in each round.
        for _ in 0..20 {
            currents = self.map.currents(x.psi_s - l_a * i_s.conj(), x.psi_r - l_b * i_r.conj(), core, &self.effects);
            let residual = [currents.i_s - i_s, currents.i_r - i_r];
            i_s += solved(residual[0], g_s);
            i_r += solved(residual[1], g_r);
            if (norm2(residual[0]) + norm2(residual[1])).value() <= 1e-20 * (norm2(i_s) + norm2(i_r)).value() {
                break;
            }
        }
        currents
    }

    fn electrical_angle(&self, x: &State<T>) -> T {
        x.theta_m.scale(self.n_p)
    }

    /// Electromagnetic torque in a state, Nm.
    pub fn torque(&self, x: &State<T>) -> T {
        self.torque_of(x, &self.currents(x))
    }

    /// (3/2) n_p (ψ_r − L_b ī_r) × i_r: the flux of the rotor's own unbalanced leakage turns with the rotor and pulls at nothing else.
    #[inline(always)]
    fn torque_of(&self, x: &State<T>, currents: &Currents<T>) -> T {
        let linked = if self.mirrored.turns {
            x.psi_r - self.mirrored.at(self.electrical_angle(x))[1] * currents.i_r.conj()
        } else {
            x.psi_r
        };
        cross(currents.i_r, linked).scale(self.torque_factor)
    }

    /// What the current sensors show of a current, A.
    #[inline(always)]
    pub(crate) fn measured_current(&self, i_s: Complex<T>) -> Complex<T> {
        self.effects.measured_current(self.on, i_s)
    }

    /// The speed at which the rotor turns when its sensor shows this one, with its first and second derivative.
    pub fn speed_behind(&self, shown: [T; 3]) -> T {
        self.effects.speed_behind(self.on, shown)[0]
    }

    /// Speed of what the load torque acts on, rad/s.
    pub fn load_speed(&self, x: &State<T>) -> T {
        self.effects.load_speed(self.on, x.omega_m, &x.extra)
    }

    /// Rates, torque and powers at a state.
    pub fn evaluate(&self, x: &State<T>, input: &PlantInput<T>) -> Evaluation<T> {
        if self.plain { self.evaluate_as::<true, true>(x, input) } else { self.evaluate_as::<false, true>(x, input) }
    }

    /// `PLAIN` lets the compiler leave out every place but the flux-current map; the arithmetic that remains is the same. Without `POWERS` they are
    /// zero where no state of an effect follows them.
    #[inline(always)]
    fn evaluate_as<const PLAIN: bool, const POWERS: bool>(&self, x: &State<T>, input: &PlantInput<T>) -> Evaluation<T> {
        let (p, e, own) = (&self.parameters, &self.effects, &x.extra);
        let on = if PLAIN { Active::NONE } else { self.on };
        let currents = self.currents_as::<PLAIN>(on, x);
        let Currents { i_s, i_r, .. } = currents;
        // Where nothing acts, nothing is prepared for what would.
        let at = if PLAIN { None } else { Some(self.operating(x, &currents, input)) };
        let (r_s, r_r) = match &at {
            Some(at) => (at.r_s, at.r_r),
            None => (p.stator_resistance_ohm, p.rotor_resistance_ohm),
        };
        let at = at.as_ref();

        // Not `map_or`, which is called and not inlined where derivatives are carried: without the step's wide vectors.
        let (u_s, stator_drop, rotor_drop) = match at {
            Some(at) => (
                e.applied_voltage(on, input.u_s, i_s),
                e.stator_drop(on, i_s * r_s, at, own),
                e.rotor_drop(on, i_r * r_r, at, own),
            ),
            None => (input.u_s, i_s * r_s, i_r * r_r),
        };

        let mut rates = State::default();
        let omega_e = x.omega_m.scale(self.n_p);
        rates.psi_s = u_s - stator_drop;
        rates.psi_r = j(x.psi_r) * omega_e - rotor_drop;

        let torque = if PLAIN { cross(i_r, x.psi_r).scale(self.torque_factor) } else { self.torque_of(x, &currents) };
        let viscous = p.viscous_friction_nm_s_per_rad * x.omega_m;
        let (braking, tau_load, tau_shaft) = match at {
            Some(at) => (e.braking_torque(on, viscous, at, own), at.tau_load, e.shaft_torque(on, at.tau_load, at, own)),
            None => {
                let tau_load = x.load.beside(input.tau_load, x.omega_m);
                (viscous, tau_load, tau_load)
            }
        };
        rates.omega_m = (torque - braking - tau_shaft) * self.inv_inertia;
        if let Some(nudging) = input.nudging(x.omega_m) {
            rates.omega_m += nudging;
        }
        rates.theta_m = x.omega_m;

        let mut powers = Powers::none();
        if POWERS || on.have_states() {
            powers = Powers {
                electrical_input: dot(input.u_s, i_s).scale(1.5),
                inverter_loss: dot(input.u_s - u_s, i_s).scale(1.5),
                stator_copper: dot(stator_drop, i_s).scale(1.5),
                rotor_copper: dot(rotor_drop, i_r).scale(1.5),
                iron: T::zero(),
                friction: braking * x.omega_m,
                shaft_damping: T::zero(),
                load: tau_load * e.load_speed(on, x.omega_m, own),
            };
            if let Some(at) = at {
                e.powers(on, &mut powers, at, own);
                e.rates(on, &mut rates.extra, at, &powers, own);
            }
        }
        Evaluation { rates, currents, torque, powers }
    }

    /// What the effects see.
    #[inline(always)]
    fn operating<'a>(&'a self, x: &'a State<T>, currents: &'a Currents<T>, input: &'a PlantInput<T>) -> Operating<'a, T> {
        let (p, e, on, own) = (&self.parameters, &self.effects, self.on, &x.extra);
        let load = x.load.beside(input.tau_load, e.load_speed(on, x.omega_m, own));
        Operating {
            state: x.base(),
            currents,
            parameters: p,
            input,
            tau_load: e.load_torque(on, load, e.load_angle(on, x.theta_m, own)),
            r_s: e.stator_resistance(on, p.stator_resistance_ohm, own),
            r_r: e.rotor_resistance(on, p.rotor_resistance_ohm, own),
            n_p: self.n_p,
        }
    }

    /// Puts the states that follow the machine at once where they settle: those of a start in motion that nobody knows.
    pub fn settle(&self, x: &mut State<T>, input: &PlantInput<T>) {
        let any = self.effects.active().any(|id| !id.states().is_empty());
        // Those in the flux-current map pull at ψ_m by a few per cent of what the leakages do: each round leaves that share of the error.
        for _ in 0..if any { 6 } else { 0 } {
            let e = self.evaluate(x, input);
            let mut own = x.extra;
            // The stator's rate for that of ψ_m.
            self.effects.settled(self.on, &mut own, &self.operating(x, &e.currents, input), e.rates.psi_s);
            x.extra = own;
        }
    }

    /// One fourth-order Runge-Kutta step of length `h`, s, with inputs held, or linear where they say so.
    #[inline]
    pub fn step(&self, x: &State<T>, input: &PlantInput<T>, h: f64) -> State<T> {
        let mut next = *x;
        self.stepped::<false>(&mut next, input, h, |_, _| ());
        next
    }

    /// As [`step`](Self::step), in place; `observe(weight, evaluation)` sees the four stages with their quadrature weights (sum
    /// `h`), so that integrals of powers are taken with the same rule as the state.
    #[inline(always)]
    pub fn step_observed(&self, x: &mut State<T>, input: &PlantInput<T>, h: f64, observe: impl FnMut(f64, &Evaluation<T>)) {
        self.stepped::<true>(x, input, h, observe);
    }

    /// The same; without `POWERS`, `observe` sees none.
    #[inline(always)]
    pub(crate) fn stepped<const POWERS: bool>(
        &self,
        x: &mut State<T>,
        input: &PlantInput<T>,
        h: f64,
        observe: impl FnMut(f64, &Evaluation<T>),
    ) {
        match (self.plain, input.imposed_speed.is_some()) {
            (true, false) => self.step_as::<true, false, POWERS>(x, input, h, observe),
            (true, true) => self.step_as::<true, true, POWERS>(x, input, h, observe),
            (false, _) => self.step_as::<false, true, POWERS>(x, input, h, observe),
        }
    }

    #[inline(always)]
    fn step_as<const PLAIN: bool, const IMPOSED: bool, const POWERS: bool>(
        &self,
        x: &mut State<T>,
        input: &PlantInput<T>,
        h: f64,
        mut observe: impl FnMut(f64, &Evaluation<T>),
    ) {
        let on = if PLAIN { Active::NONE } else { self.on };
        let (half, sixth, third) = (0.5 * h, h / 6.0, h / 3.0);
        // The parts that are not in use stay where they are: states with derivatives are too large to be copied in passing.
        let (from, mut at) = (*x, *x);
        let mut rising = input.u_rise.map(|rise| (rise, *input));
        // A loop, not four copies: with derivatives a copy fills a processor's instruction cache by itself.
        for (fraction, weight, next) in [(0.0, sixth, half), (0.5, third, half), (0.5, third, h), (1.0, sixth, h)] {
            if let (true, Some([a, b])) = (IMPOSED, input.imposed_speed) {
                at.omega_m = a + (b - a).scale(fraction);
            }
            if let Some((rise, now)) = &mut rising {
                now.u_s = input.u_s + rise.scale(T::from_f64(fraction - 0.5));
            }
            let input = rising.as_ref().map_or(input, |r| &r.1);
            let here = self.evaluate_as::<PLAIN, POWERS>(&at, input);
            observe(weight, &here);
            x.accumulate(&here.rates, weight, on);
            if fraction < 1.0 {
                at.set_advanced(&from, &here.rates, next, on);
            }
        }
        if let (true, Some([_, b])) = (IMPOSED, input.imposed_speed) {
            x.omega_m = b;
        }
    }

    /// Rates in a frame at electrical angle `theta` turning with `omega_k`, rad/s; state and voltage are given in that frame.
    pub fn rates_in_frame(&self, x: &State<T>, input: &PlantInput<T>, theta: T, omega_k: T) -> State<T> {
        let still = x.in_frame(-theta);
        let input = PlantInput { u_s: input.u_s * unit(theta), ..*input };
        let mut rates = self.evaluate(&still, &input).rates.in_frame(theta);
        rates.psi_s -= j(x.psi_s) * omega_k;
        rates.psi_r -= j(x.psi_r) * omega_k;
        rates.extra.each_vector(&x.extra, |rate, v| rate - j(v) * omega_k);
        rates
    }

    /// Energy in fields, masses and springs, J.
    pub fn stored_energy(&self, x: &State<T>) -> T {
        let (e, own) = (&self.effects, &x.extra);
        let core = e.core_source(self.on, Complex::zero(), own);
        let currents = self.currents(x);
        let [l_a, l_b] = self.mirrored.at(self.electrical_angle(x));
        let (in_s, in_r) = (l_a * currents.i_s.conj(), l_b * currents.i_r.conj());
        let mirrored = (dot(in_s, currents.i_s) + dot(in_r, currents.i_r)).scale(0.75);
        let fields = self.map.energy(x.psi_s - in_s, x.psi_r - in_r, core, e) + mirrored;
        let rotor = T::from_f64(0.5) * x.omega_m * x.omega_m / self.inv_inertia;
        let input = PlantInput::new(Complex::zero(), T::zero());
        let at = self.operating(x, &currents, &input);
        e.stored_energy(self.on, fields + rotor, &at, own)
    }

    /// An estimate of the fastest rate in the machine, 1/s, that a step must resolve: h ≤ 1/rate is accurate, h > 2.7/rate unstable.
    pub fn fastest_rate(&self) -> f64 {
        let p = self.parameters.cast::<f64>();
        let leakage = p.stator_leakage_inductance_h + p.rotor_leakage_inductance_h - self.mirrored.size();
        let added = self.effects.added_resistance(self.on, p.rotor_resistance_ohm);
        let resistance = p.stator_resistance_ohm + p.rotor_resistance_ohm + added;
        let own = self.effects.fastest_rate(self.on, 1.0 / self.inv_inertia.value());
        let [friction, swing] = self.mechanical_rates();
        own.max(resistance * self.map.steepest_leakage() / leakage).max(friction).max(swing)
    }

    /// D/J, and how fast the rotor swings on the torque of a held flux, n_p ψ √((3/2)/(L_σ J)); 1/s.
    fn mechanical_rates(&self) -> [f64; 2] {
        // In Wb: machines from a hundred volts to some kilovolts have from half of it to ten times.
        const FLUX_VS: f64 = 1.0;
        let p = self.parameters.cast::<f64>();
        let (leakage, inverse) = (p.stator_leakage_inductance_h + p.rotor_leakage_inductance_h, self.inv_inertia.value());
        [p.viscous_friction_nm_s_per_rad * inverse, self.n_p * FLUX_VS * Scalar::sqrt(1.5 * inverse / leakage)]
    }

    /// How many steps a sample of length `sample_time_s` needs: each at most 0.8/[`fastest_rate`](Self::fastest_rate), and no more than
    /// [`SUBSTEPS_MAX`]. A machine that needs more is not followed; [`followed`](Self::followed) says so beforehand.
    pub fn substeps(&self, sample_time_s: f64) -> u32 {
        let n = (sample_time_s * self.fastest_rate() / 0.8).max(1.0);
        // Rounded up by hand: f64::ceil is not in core.
        let whole = n.min(f64::from(SUBSTEPS_MAX)) as u32;
        if f64::from(whole) < n && whole < SUBSTEPS_MAX { whole + 1 } else { whole.max(1) }
    }

    /// That [`substeps`](Self::substeps) are enough at a sampling time.
    ///
    /// # Errors
    /// [`ModelError::TooStiff`] with what makes the machine too fast.
    pub fn followed(&self, sample_time_s: f64) -> Result<(), ModelError> {
        let rate_per_s = self.fastest_rate();
        if sample_time_s * rate_per_s / 0.8 <= f64::from(SUBSTEPS_MAX) {
            return Ok(());
        }
        let (part, quantity, value) = self.stiffest();
        Err(ModelError::TooStiff { part, quantity, value, rate_per_s, sample_time_s })
    }

    /// The parameter to look at in a machine that is too fast: of the effect without which it is the slowest, that which is farthest from
    /// its usual size; without effects the leakage or the larger resistance.
    fn stiffest(&self) -> (&'static str, &'static str, f64) {
        let p = self.parameters.cast::<f64>();
        let leakage = p.stator_leakage_inductance_h + p.rotor_leakage_inductance_h;
        let (fastest, [friction, swing]) = (self.fastest_rate(), self.mechanical_rates());
        let mut found = if friction >= fastest {
            ("machine", "viscous_friction_nm_s_per_rad", p.viscous_friction_nm_s_per_rad)
        } else if swing >= fastest {
            ("machine", "inertia_kg_m2", p.inertia_kg_m2)
        } else if leakage < 1e-5 {
            ("machine", "stator_leakage_inductance_h + rotor_leakage_inductance_h", leakage)
        } else if p.stator_resistance_ohm > p.rotor_resistance_ohm {
            ("machine", "stator_resistance_ohm", p.stator_resistance_ohm)
        } else {
            ("machine", "rotor_resistance_ohm", p.rotor_resistance_ohm)
        };
        let mut least = 0.5 * fastest;
        for id in self.effects.active() {
            let mut effects = self.effects;
            for (k, _) in id.parameters().iter().enumerate().filter(|(_, info)| info.role == Role::Strength) {
                effects.set(id, k, T::zero());
            }
            let on = effects.which();
            let map = FluxMap::new(&self.parameters, &effects, self.map.air_gap());
            let mirrored = Mirrored::new(&effects, on, &self.parameters);
            let without = Self { map, mirrored, effects, on, ..*self };
            let rate = without.fastest_rate();
            if rate < least {
                least = rate;
                // In logarithms, as sizes go over decades.
                let far = |k: usize| {
                    let (x, usual) = (self.effects.get(id, k).value(), id.parameters()[k].typical.1.max(1e-300));
                    Scalar::ln((x.abs() / usual).max(1e-300)).abs()
                };
                let given = (0..id.parameters().len()).filter(|&k| self.effects.get(id, k).value() != 0.0);
                let k = given.max_by(|a, b| far(*a).total_cmp(&far(*b))).unwrap_or(0);
                found = (id.name(), id.parameters()[k].key, self.effects.get(id, k).value());
            }
        }
        found
    }
}

/// Integrals of the powers over a run, J: the energy balance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ledger<T> {
    /// Integrals of [`Powers`], in the order of its fields.
    pub energies: [T; 8],
    /// Stored energy at the start.
    pub stored_before: T,
}

impl<T: Scalar> Ledger<T> {
    /// Starts a ledger at a state.
    pub fn new(plant: &Plant<T>, x: &State<T>) -> Self {
        Self { energies: [T::zero(); 8], stored_before: plant.stored_energy(x) }
    }

    /// Adds an evaluation with its weight, s.
    pub fn add(&mut self, weight: f64, e: &Evaluation<T>) {
        for (sum, p) in self.energies.iter_mut().zip(e.powers.values()) {
            *sum += p.scale(weight);
        }
    }

    /// Input less losses, load and what is stored now, J: zero but for integration error.
    pub fn imbalance(&self, plant: &Plant<T>, x: &State<T>) -> T {
        let [input, rest @ ..] = self.energies;
        rest.into_iter().fold(input, |w, loss| w - loss) - (plant.stored_energy(x) - self.stored_before)
    }
}

/// A machine checked and prepared in one call.
impl<T: Scalar> TryFrom<(TParameters<T>, u32, Effects<T>)> for Plant<T> {
    type Error = ModelError;
    fn try_from((p, pole_pairs, effects): (TParameters<T>, u32, Effects<T>)) -> Result<Self, ModelError> {
        Ok(Self::new(&Machine::try_new(p, pole_pairs, effects)?))
    }
}
