//! Equations of motion of the machine with its effects, in the stator frame, and the fixed-step integration.
//!
//! dψ_s/dt = u_s − R_s i_s,   dψ_r/dt = jω_e ψ_r − R_r i_r,   τ_e = (3/2) n_p Im(ψ_r ī_r),   J dω_m/dt = τ_e − D ω_m − τ_L
//!
//! and the terms of the effects at their places. Every power is accounted for: [`Powers`] sums to the rate of the stored energy.

use num_complex::Complex;

use crate::effects::{EffectId, Effects, MAX_CUSTOM, Operating};
use crate::error::ModelError;
use crate::flux_map::{Currents, FluxMap};
use crate::machine::Machine;
use crate::parameters::TParameters;
use crate::scalar::Scalar;
use crate::space_vector::{cross, dot, j, norm2, unit};
use crate::state::{Parts, State};

/// What drives the machine during a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantInput<T> {
    /// Commanded stator voltage, V.
    pub u_s: Complex<T>,
    /// Load torque, Nm, positive against positive rotation.
    pub tau_load: T,
    /// When given, the rotor turns at this speed (rad/s at the start and at the end of the step) whatever the torque.
    pub imposed_speed: Option<[T; 2]>,
    /// When given as (ω, k), the speed is nudged towards ω, rad/s, at the rate k, 1/s: dω_m/dt gains k(ω − ω_m). Comparing with a
    /// recording, this keeps a wrong model from pulling out of step, and leaves its torque errors visible as speed errors.
    pub speed_nudge: Option<[T; 2]>,
}

impl<T: Scalar> PlantInput<T> {
    /// Voltage and load torque, speed free.
    pub fn new(u_s: Complex<T>, tau_load: T) -> Self {
        Self { u_s, tau_load, imposed_speed: None, speed_nudge: None }
    }
}

/// Powers at an instant, W; a loss is positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Powers<T> {
    /// Taken in at the commanded voltage.
    pub electrical_input: T,
    /// Between command and terminals (inverter, gain).
    pub inverter_loss: T,
    /// Stator winding.
    pub stator_copper: T,
    /// Rotor winding, both cages.
    pub rotor_copper: T,
    /// Iron.
    pub iron: T,
    /// Friction, windage, ripple and what user effects brake.
    pub friction: T,
    /// Damping in the shaft.
    pub shaft_damping: T,
    /// Given to the load.
    pub load: T,
}

impl<T: Scalar> Powers<T> {
    /// The values, in the order of the fields.
    pub fn values(&self) -> [T; 8] {
        [
            self.electrical_input,
            self.inverter_loss,
            self.stator_copper,
            self.rotor_copper,
            self.iron,
            self.friction,
            self.shaft_damping,
            self.load,
        ]
    }

    /// Input less losses and load: what goes into fields, masses and springs.
    pub fn net(&self) -> T {
        let [input, rest @ ..] = self.values();
        rest.into_iter().fold(input, |p, loss| p - loss)
    }
}

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

/// A valid machine prepared for stepping. Plain data, no allocation; steps cannot fail.
#[derive(Clone, Copy, Debug)]
pub struct Plant<T> {
    parameters: TParameters<T>,
    effects: Effects<T>,
    map: FluxMap<T>,
    parts: Parts,
    n_p: f64,
    /// (3/2) n_p.
    torque_factor: f64,
    /// 1/J, or 1/((1−f)J) with a compliant shaft.
    inv_inertia: T,
    /// 1/(fJ); zero without a compliant shaft.
    inv_load_inertia: T,
    /// 1/τ of the iron, the bars, the stator's and the rotor's temperature; zero where not in use.
    inv_times: [T; 4],
    /// Temperatures are tracked: R depends on them.
    heated: [bool; 2],
    /// Nothing is on outside the flux-current map: the short path is taken.
    plain: bool,
}

impl<T: Scalar> Plant<T> {
    /// Prepares a machine.
    pub fn new(machine: &Machine<T>) -> Self {
        let (p, effects) = (*machine.parameters(), *machine.effects());
        let parts = Parts::of(&effects);
        let inertia = if parts.shaft {
            p.inertia_kg_m2 * (T::one() - effects.shaft_compliance.load_inertia_fraction)
        } else {
            p.inertia_kg_m2
        };
        let n_p = f64::from(machine.pole_pairs());
        let inverse = |on: bool, x: T| if on { T::one() / x } else { T::zero() };
        let heated = [effects.is_on(EffectId::StatorHeating), effects.is_on(EffectId::RotorHeating)];
        Self {
            parameters: p,
            effects,
            map: FluxMap::new(&p, &effects),
            parts,
            n_p,
            torque_factor: 1.5 * n_p,
            inv_inertia: T::one() / inertia,
            inv_load_inertia: inverse(parts.shaft, effects.shaft_compliance.load_inertia_fraction * p.inertia_kg_m2),
            inv_times: [
                inverse(parts.iron, effects.iron_loss.diffusion_time_s),
                inverse(parts.skin, effects.rotor_skin_effect.time_constant_s),
                inverse(heated[0], effects.stator_heating.time_constant_s),
                inverse(heated[1], effects.rotor_heating.time_constant_s),
            ],
            heated,
            plain: effects.active().all(|id| !acts_in_equations(id)),
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
    pub(crate) fn parts(&self) -> Parts {
        self.parts
    }
    /// Pole pairs, as a number.
    pub fn n_p(&self) -> T {
        T::from_f64(self.n_p)
    }

    /// Currents in a state.
    #[inline]
    pub fn currents(&self, x: &State<T>) -> Currents<T> {
        self.map.currents(x.psi_s, x.psi_r, x.psi_fe, &self.effects)
    }

    /// Electromagnetic torque in a state, Nm.
    pub fn torque(&self, x: &State<T>) -> T {
        cross(self.currents(x).i_r, x.psi_r).scale(self.torque_factor)
    }

    /// Rates, torque and powers at a state.
    pub fn evaluate(&self, x: &State<T>, input: &PlantInput<T>) -> Evaluation<T> {
        if self.plain { self.evaluate_as::<true>(x, input) } else { self.evaluate_as::<false>(x, input) }
    }

    /// `PLAIN` lets the compiler leave out every place but the flux-current map; the arithmetic that remains is the same.
    #[inline(always)]
    fn evaluate_as<const PLAIN: bool>(&self, x: &State<T>, input: &PlantInput<T>) -> Evaluation<T> {
        let parts = if PLAIN { Parts::default() } else { self.parts };
        let heated = if PLAIN { [false; 2] } else { self.heated };
        let (p, e) = (&self.parameters, &self.effects);
        let currents = self.map.currents(x.psi_s, x.psi_r, x.psi_fe, e);
        let Currents { i_s, i_r, psi_m } = currents;

        let r_s = if heated[0] {
            p.stator_resistance_ohm * (T::one() + e.stator_heating.temperature_coefficient_per_k * x.stator_rise_k)
        } else {
            p.stator_resistance_ohm
        };
        let r_r = if heated[1] {
            p.rotor_resistance_ohm * (T::one() + e.rotor_heating.temperature_coefficient_per_k * x.rotor_rise_k)
        } else {
            p.rotor_resistance_ohm
        };
        let at =
            Operating { i_s, i_r, psi_m, omega_m: x.omega_m, theta_m: x.theta_m, r_s, r_r, n_p: self.n_p(), own: [T::zero(); 2] };

        let u_s = if PLAIN { input.u_s } else { e.applied_voltage(input.u_s, i_s) };
        let stator_drop = if PLAIN { i_s * r_s } else { e.stator_drop(i_s * r_s, &at, &x.own) };
        let mut rotor_drop = if PLAIN { i_r * r_r } else { e.rotor_drop(i_r * r_r, &at, &x.own) };

        let mut rates = State::default();
        let omega_e = x.omega_m.scale(self.n_p);

        // Power stored in the bars does not leave: it is taken out of the rotor's copper loss below.
        let mut into_bars = T::zero();
        if parts.skin {
            let skin = &e.rotor_skin_effect;
            let inner = i_r - x.i_bar;
            let rise = skin.resistance_rise * p.rotor_resistance_ohm;
            rotor_drop += inner * rise;
            rates.i_bar = j(x.i_bar) * omega_e + inner * self.inv_times[1];
            into_bars = rise * dot(inner, x.i_bar);
        }
        let mut iron = T::zero();
        if parts.iron {
            let law = &e.iron_loss;
            rates.psi_fe = (psi_m - x.psi_fe) * self.inv_times[0];
            iron = (law.conductance_s * norm2(rates.psi_fe)).scale(1.5);
        }

        rates.psi_s = u_s - stator_drop;
        rates.psi_r = j(x.psi_r) * omega_e - rotor_drop;

        let torque = cross(i_r, x.psi_r).scale(self.torque_factor);
        let viscous = p.viscous_friction_nm_s_per_rad * x.omega_m;
        let braking = if PLAIN { viscous } else { e.braking_torque(viscous, &at, &x.own) };
        let mut shaft_damping = T::zero();
        let (tau_shaft, omega_load) = if parts.shaft {
            let law = &e.shaft_compliance;
            let slide = x.omega_m - x.omega_load;
            let spring = law.stiffness_nm_per_rad(p.inertia_kg_m2) * x.twist;
            let damper = law.damping_nm_s_per_rad(p.inertia_kg_m2) * slide;
            shaft_damping = damper * slide;
            rates.twist = slide;
            rates.omega_load = (spring + damper - input.tau_load) * self.inv_load_inertia;
            (spring + damper, x.omega_load)
        } else {
            (input.tau_load, x.omega_m)
        };
        rates.omega_m = (torque - braking - tau_shaft) * self.inv_inertia;
        if let Some([target, rate]) = input.speed_nudge {
            rates.omega_m += (target - x.omega_m) * rate;
        }
        rates.theta_m = x.omega_m;

        let stator_copper = dot(stator_drop, i_s).scale(1.5);
        let rotor_copper = (dot(rotor_drop, i_r) - into_bars).scale(1.5);
        if parts.thermal {
            let (s, r) = (&e.stator_heating, &e.rotor_heating);
            if heated[0] {
                rates.stator_rise_k = s.inverse_heat_capacity_k_per_j * stator_copper - x.stator_rise_k * self.inv_times[2];
            }
            if heated[1] {
                rates.rotor_rise_k = r.inverse_heat_capacity_k_per_j * rotor_copper - x.rotor_rise_k * self.inv_times[3];
            }
        }
        if parts.own {
            for (k, c) in e.custom.iter().enumerate() {
                if let Some(c) = c {
                    rates.own[k] = c.hooks().own_rates(&c.values, &Operating { own: x.own[k], ..at });
                }
            }
        }

        let powers = Powers {
            electrical_input: dot(input.u_s, i_s).scale(1.5),
            inverter_loss: dot(input.u_s - u_s, i_s).scale(1.5),
            stator_copper,
            rotor_copper,
            iron,
            friction: braking * x.omega_m,
            shaft_damping,
            load: input.tau_load * omega_load,
        };
        Evaluation { rates, currents, torque, powers }
    }

    /// One fourth-order Runge-Kutta step of length `h`, s, with inputs held.
    #[inline]
    pub fn step(&self, x: &State<T>, input: &PlantInput<T>, h: f64) -> State<T> {
        let mut next = *x;
        self.step_observed(&mut next, input, h, |_, _| ());
        next
    }

    /// As [`step`](Self::step), in place; `observe(weight, evaluation)` sees the four stages with their quadrature weights (sum
    /// `h`), so that integrals of powers are taken with the same rule as the state.
    #[inline(always)]
    pub fn step_observed(&self, x: &mut State<T>, input: &PlantInput<T>, h: f64, observe: impl FnMut(f64, &Evaluation<T>)) {
        if self.plain && input.imposed_speed.is_none() {
            self.step_as::<true>(x, input, h, observe);
        } else {
            self.step_as::<false>(x, input, h, observe);
        }
    }

    #[inline(always)]
    fn step_as<const PLAIN: bool>(
        &self,
        x: &mut State<T>,
        input: &PlantInput<T>,
        h: f64,
        mut observe: impl FnMut(f64, &Evaluation<T>),
    ) {
        let parts = if PLAIN { Parts::default() } else { self.parts };
        let (half, sixth, third) = (0.5 * h, h / 6.0, h / 3.0);
        // The parts that are not in use stay where they are: states with derivatives are too large to be copied in passing.
        let (from, mut at) = (*x, *x);
        // A loop, not four copies: with derivatives a copy fills a processor's instruction cache by itself.
        for (fraction, weight, next) in [(0.0, sixth, half), (0.5, third, half), (0.5, third, h), (1.0, sixth, h)] {
            if let (false, Some([a, b])) = (PLAIN, input.imposed_speed) {
                at.omega_m = a + (b - a).scale(fraction);
            }
            let e = self.evaluate_as::<PLAIN>(&at, input);
            observe(weight, &e);
            x.accumulate(&e.rates, weight, parts);
            if fraction < 1.0 {
                at.set_advanced(&from, &e.rates, next, parts);
            }
        }
        if let (false, Some([_, b])) = (PLAIN, input.imposed_speed) {
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
        rates.psi_fe -= j(x.psi_fe) * omega_k;
        rates.i_bar -= j(x.i_bar) * omega_k;
        rates
    }

    /// Energy in fields, masses and springs, J.
    pub fn stored_energy(&self, x: &State<T>) -> T {
        let (p, e) = (&self.parameters, &self.effects);
        let half = T::from_f64(0.5);
        let mut w = self.map.energy(x.psi_s, x.psi_r, x.psi_fe, e);
        if self.parts.skin {
            let skin = &e.rotor_skin_effect;
            // (3/2)·½ L_b|i_b|², i_b = z·k/(1+k), L_b = τR_r(1+k)²/k
            w += T::from_f64(0.75) * skin.time_constant_s * skin.resistance_rise * p.rotor_resistance_ohm * norm2(x.i_bar);
        }
        w += half * x.omega_m * x.omega_m / self.inv_inertia;
        if self.parts.shaft {
            let law = &e.shaft_compliance;
            w += half * law.load_inertia_fraction * p.inertia_kg_m2 * x.omega_load * x.omega_load;
            w += half * law.stiffness_nm_per_rad(p.inertia_kg_m2) * x.twist * x.twist;
        }
        w
    }

    /// An estimate of the fastest rate in the machine, 1/s, that a step must resolve: h ≤ 1/rate is accurate, h > 2.7/rate unstable.
    pub fn fastest_rate(&self) -> f64 {
        let p = self.parameters.cast::<f64>();
        let e = &self.effects;
        let leakage = p.stator_leakage_inductance_h + p.rotor_leakage_inductance_h;
        let drop = e.leakage_flux_saturation.drop.value();
        let rise = if self.parts.skin { e.rotor_skin_effect.resistance_rise.value() } else { 0.0 };
        let mut rate = (p.stator_resistance_ohm + p.rotor_resistance_ohm * (1.0 + rise)) * (1.0 + drop) / leakage;
        if !e.inverter_nonlinearity.is_zero_strength() {
            let slope = e.inverter_nonlinearity.voltage_v.value() / e.inverter_nonlinearity.zero_crossing_current_a.value();
            rate = rate.max((p.stator_resistance_ohm + p.rotor_resistance_ohm + slope) * (1.0 + drop) / leakage);
        }
        if self.parts.iron {
            rate = rate.max(1.0 / e.iron_loss.diffusion_time_s.value());
        }
        if self.parts.skin {
            rate = rate.max(1.0 / e.rotor_skin_effect.time_constant_s.value());
        }
        if self.parts.shaft {
            let f = e.shaft_compliance.load_inertia_fraction.value();
            rate = rate.max(e.shaft_compliance.antiresonance_rad_s.value() / (1.0 - f).sqrt());
        }
        if !e.coulomb_friction.torque_nm.is_zero() {
            let c = &e.coulomb_friction;
            let slope = c.torque_nm.value() * (1.0 + c.stribeck_rise.value()) / c.smoothing_speed_rad_s.value();
            rate = rate.max(slope * self.inv_inertia.value());
        }
        rate
    }

    /// How many steps a sample of length `sample_time_s` needs: each at most 0.8/[`fastest_rate`](Self::fastest_rate).
    pub fn substeps(&self, sample_time_s: f64) -> u32 {
        let n = (sample_time_s * self.fastest_rate() / 0.8).max(1.0);
        // Rounded up by hand: f64::ceil is not in core.
        let whole = n.min(1e6) as u32;
        if f64::from(whole) < n { whole + 1 } else { whole }
    }

    /// The number of own states that belong to user effects.
    pub const OWN_STATES: usize = 2 * MAX_CUSTOM;
}

/// Whether an effect has a place in the equations of motion other than the flux-current map: not sensors, not the sampled delay.
fn acts_in_equations(id: EffectId) -> bool {
    !matches!(
        id,
        EffectId::MainFluxSaturation
            | EffectId::LeakageFluxSaturation
            | EffectId::VoltageDelay
            | EffectId::CurrentSensorGain
            | EffectId::CurrentSensorOffset
            | EffectId::SpeedSensorLag
    )
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
