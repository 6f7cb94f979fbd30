//! Free-form effects: a quantity of the equations over a variable, as a smooth curve that no formula gives.
//!
//! Where nobody knows what is missing, it can still be learned: the torque balance lacks some τ(ω), the stator winding some R(t). Such an
//! effect is a place in the equations ([`Acts`]), what it depends on ([`Over`]), and eight coefficients, its strengths: of cubic B-splines
//! over a range, or of a Fourier series over an angle. It is scored, fitted, simulated and written to motor files like any other effect.
//!
//! Source: P-splines, Eilers and Marx, Statistical Science 11 (1996); the precision of the coefficients is their roughness penalty.

mod basis;
mod form;
mod lags;
mod parameters;

use lags::Lags;
use num_complex::Complex;

pub use form::FreeForm;
pub use parameters::{Acts, COEFFICIENTS, Over};

#[cfg(feature = "std")]
use super::CustomId;
use super::{
    About, BaseState, Card, CustomEffect, CustomHooks, Hook, HookSet, Hooks, Memory, Operating, ParameterInfo, Place, StateInfo,
    StateKind, SteadyState,
};
use crate::instant::{Currents, Output, Powers};
use crate::parameters::TParameters;
use crate::scalar::Scalar;
use crate::space_vector::{dot, from_phases, j, norm2, to_phases, unit};

/// Speed at which a loss current (electrical) or a friction has all but found its sense, rad/s.
const SENSE_RAD_S: f64 = 3.0;

/// The sense of a rotation: ±1, without a jump at standstill.
fn sense<T: Scalar>(omega: T) -> T {
    let turning = omega.scale(1.0 / SENSE_RAD_S);
    turning / (turning * turning + T::one()).sqrt()
}

/// L_ls + L_lr.
fn both_leakages<T: Scalar>(p: &TParameters<T>) -> T {
    p.stator_leakage_inductance_h + p.rotor_leakage_inductance_h
}

impl FreeForm {
    /// Whether it is an inductance that changes with the angle of the shaft.
    fn has_reluctance_torque(&self) -> bool {
        matches!((self.acts, self.over), (Acts::MagnetizingCurrent | Acts::LeakageCurrent, Over::ShaftAngle))
    }

    /// The precision of the coefficients of a curve of size one before any data; see [`SPREAD`](Self::SPREAD).
    pub fn precision(&self) -> [[f64; COEFFICIENTS]; COEFFICIENTS] {
        basis::precision(self.over.is_angle())
    }

    /// The value of the curve; `values` are those of the effect's parameters, `x` the variable, an angle in rad.
    pub fn value(&self, values: &[f64], x: f64) -> f64 {
        let curve = Curve { form: self, values };
        if self.over.is_angle() { curve.around(unit(x * values[FIRST])) } else { curve.at(x) }
    }

    /// What multiplies each coefficient in [`value`](Self::value).
    pub fn weights(&self, values: &[f64], x: f64) -> [f64; COEFFICIENTS] {
        let mut out = [0.0; COEFFICIENTS];
        for (k, w) in out.iter_mut().enumerate() {
            let mut one = [0.0; COEFFICIENTS + 3];
            one[COEFFICIENTS..].iter_mut().zip(&values[COEFFICIENTS..]).for_each(|(o, v)| *o = *v);
            one[k] = 1.0;
            *w = self.value(&one, x);
        }
        out
    }
}

/// The parameter that says where the curve lies: the beginning of the range, with its end next, or the order.
const FIRST: usize = FreeForm::SPREAD + 1;

/// The hooks of a free-form effect with given values.
struct Curve<'a, T> {
    form: &'a FreeForm,
    values: &'a [T],
}

impl<T: Scalar> Curve<'_, T> {
    fn coefficients(&self) -> &[T] {
        &self.values[..COEFFICIENTS]
    }

    /// Over a range.
    fn at(&self, x: T) -> T {
        basis::spline(self.coefficients(), self.values[FIRST], self.values[FIRST + 1], x)
    }

    /// Over an angle whose unit vector is given.
    fn around(&self, z: Complex<T>) -> T {
        basis::fourier(self.coefficients(), z)
    }

    /// A magnitude without a kink where the vector vanishes: a thousandth of the range is small.
    fn magnitude(&self, squared: T) -> T {
        let small = self.values[FIRST + 1].scale(1e-3);
        (squared + small * small).sqrt()
    }

    /// Over a speed or a slip frequency.
    fn over_speed(&self, omega: T) -> T {
        if self.form.acts.is_over_magnitude(self.form.over) { self.at(self.magnitude(omega * omega)) } else { self.at(omega) }
    }

    fn around_shaft(&self, theta_m: T) -> T {
        self.around(unit(self.values[FIRST] * theta_m))
    }

    /// The curve where the machine is.
    fn here(&self, at: &Operating<T>, own: &[T]) -> T {
        let x = at.state;
        match self.form.over {
            Over::Speed => self.over_speed(x.omega_m()),
            Over::Time => self.at(own[0]),
            Over::Current => self.at(self.magnitude(norm2(at.currents.i_s))),
            Over::Slip => {
                // dψ_r/dt seen from the rotor is −R_r i_r: its part across ψ_r turns the flux.
                let turning = dot(at.currents.i_r, j(x.psi_r())) * at.r_r;
                self.over_speed(-turning / (norm2(x.psi_r()) + T::from_f64(1e-9)))
            }
            Over::Flux => self.at(self.magnitude(norm2(at.currents.psi_m))),
            Over::ShaftAngle => self.around_shaft(x.theta_m()),
            Over::FluxDirection => self.in_direction(at.currents.psi_m),
            // Acts once per sample, in front of the terminals and behind the sensors.
            Over::Lag => T::zero(),
        }
    }

    fn in_direction(&self, psi: Complex<T>) -> T {
        self.around(self.direction(psi))
    }

    /// What the voltage path adds to the command.
    fn added_voltage(&self, at: &Operating<T>, own: &[T]) -> Complex<T> {
        if self.is(Acts::VoltageAngle) {
            j(at.input.u_s) * (self.here(at, own) * sense(at.state.omega_m()))
        } else {
            at.input.u_s * self.here(at, own)
        }
    }

    /// An inductance L/(1 + f(θ)) that changes with the angle stores (3/4) |ψ|²(1 + f)/L, and is turned to where that is least: dW/dθ against
    /// rotation.
    fn reluctance_torque(&self, psi: Complex<T>, inductance: T, at: &Operating<T>) -> T {
        let z = unit(self.values[FIRST] * at.state.theta_m());
        let slope = basis::fourier_slope(self.coefficients(), z) * self.values[FIRST];
        (norm2(psi) / inductance * slope).scale(0.75)
    }

    /// What an anisotropy adds to ψ/L: with an energy |ψ|²(1 + f(θ))/(2L) the current is its gradient, (f + j f′/2) ψ/L, or a turning flux
    /// would make energy of nothing.
    fn anisotropy(&self, psi: Complex<T>) -> Complex<T> {
        let z = self.direction(psi);
        let slope = basis::fourier_slope(self.coefficients(), z) * self.values[FIRST];
        Complex::new(self.around(z), slope.scale(0.5))
    }

    /// e^{jnθ} of a flux in direction θ, for a curve that repeats n times per turn.
    fn direction(&self, psi: Complex<T>) -> Complex<T> {
        let length = (norm2(psi) + T::from_f64(1e-12)).sqrt();
        let z = psi * (T::one() / length);
        // The order is a whole number: a power of the unit vector.
        let order = self.values[FIRST].value();
        let mut turn = z;
        let mut k = 1.0;
        while k < order {
            turn *= z;
            k += 1.0;
        }
        turn
    }

    /// A flux that turns with the shaft, as a part of another: complex.
    fn fixed_to_shaft(&self, theta_m: T) -> Complex<T> {
        basis::fourier_vector(self.coefficients(), unit(self.values[FIRST] * theta_m))
    }

    fn lags(&self) -> Lags<T> {
        Lags::new([self.values[FIRST], self.values[FIRST + 1]], |x| self.at(x))
    }

    fn is(&self, acts: Acts) -> bool {
        self.form.acts == acts
    }
}

impl<T: Scalar> Hooks<T> for Curve<'_, T> {
    fn stator_drop(&self, drop: Complex<T>, at: &Operating<T>, own: &[T]) -> Complex<T> {
        match self.form.acts {
            Acts::StatorResistance => drop + at.currents.i_s * (at.r_s * self.here(at, own)),
            Acts::Voltage | Acts::VoltageAngle => drop - self.added_voltage(at, own),
            _ => drop,
        }
    }

    fn rotor_drop(&self, drop: Complex<T>, at: &Operating<T>, own: &[T]) -> Complex<T> {
        if self.is(Acts::RotorResistance) { drop + at.currents.i_r * (at.r_r * self.here(at, own)) } else { drop }
    }

    fn braking_torque(&self, torque: T, at: &Operating<T>, own: &[T]) -> T {
        match self.form.acts {
            Acts::Torque => torque + self.here(at, own),
            Acts::Friction => torque + self.here(at, own) * sense(at.state.omega_m()),
            Acts::MagnetizingCurrent if self.form.has_reluctance_torque() => {
                torque + self.reluctance_torque(at.currents.psi_m, at.parameters.magnetizing_inductance_h, at)
            }
            Acts::LeakageCurrent if self.form.has_reluctance_torque() => {
                torque + self.reluctance_torque(at.state.psi_s() - at.state.psi_r(), both_leakages(at.parameters), at)
            }
            _ => torque,
        }
    }

    fn added_currents(&self, c: Currents<T>, x: BaseState<T>, p: &TParameters<T>, n_p: f64) -> Currents<T> {
        let psi_m = c.psi_m;
        let over = || match self.form.over {
            Over::Flux => self.at(self.magnitude(norm2(psi_m))),
            Over::Speed => self.over_speed(x.omega_m()),
            Over::Current => self.at(self.magnitude(norm2(c.i_s))),
            _ => self.around_shaft(x.theta_m()),
        };
        match self.form.acts {
            Acts::MagnetizingCurrent => {
                let part = match self.form.over {
                    Over::FluxDirection => self.anisotropy(psi_m),
                    _ => Complex::from(over()),
                };
                c.drawn_at_gap(psi_m * part * (T::one() / p.magnetizing_inductance_h), p)
            }
            Acts::ShaftFlux => {
                // Of the flux that the stator links, the windings' currents make what is left without it.
                let length = (norm2(x.psi_s()) + T::from_f64(1e-12)).sqrt();
                let through = self.fixed_to_shaft(x.theta_m()) * (length / both_leakages(p));
                Currents { i_s: c.i_s - through, i_r: c.i_r + through, ..c }
            }
            Acts::LossCurrent => {
                let sense = sense(x.omega_m().scale(n_p));
                let direction = psi_m * (T::one() / (norm2(psi_m) + T::from_f64(1e-12)).sqrt());
                c.drawn_at_gap(j(direction) * (over() * sense), p)
            }
            Acts::LeakageCurrent => {
                let through = (x.psi_s() - x.psi_r()) * (over() / both_leakages(p));
                Currents { i_s: c.i_s + through, i_r: c.i_r - through, ..c }
            }
            _ => c,
        }
    }

    fn rates(&self, rates: &mut [T], _at: &Operating<T>, _powers: &Powers<T>, _own: &[T]) {
        if self.form.over == Over::Time {
            rates[0] = T::one();
        }
    }

    fn powers(&self, powers: &mut Powers<T>, at: &Operating<T>, own: &[T]) {
        // What the voltage path keeps stands with the inverter, not with the winding.
        if !matches!(self.form.acts, Acts::Voltage | Acts::VoltageAngle) {
            return;
        }
        let power = dot(self.added_voltage(at, own), at.currents.i_s).scale(1.5);
        powers.stator_copper += power;
        powers.inverter_loss -= power;
    }

    fn remember(&self, memory: &mut Option<Memory<T>>, readings: [Output<T>; 2], t: T) {
        let readings = readings.map(|y| if self.is(Acts::SpeedSensor) { Complex::from(y.omega_m) } else { y.i_s });
        self.lags().follow(memory, readings, t);
    }

    fn recalled(&self, shown: Output<T>, memory: &Memory<T>) -> Output<T> {
        let behind = self.lags().behind(memory);
        if self.is(Acts::SpeedSensor) {
            Output { omega_m: shown.omega_m + behind.re, ..shown }
        } else {
            Output { i_s: shown.i_s + behind, ..shown }
        }
    }

    fn passed_voltage(&self, voltages: [Complex<T>; 2], memory: &mut Option<Memory<T>>, t: T) -> Complex<T> {
        self.lags().mean_passed(voltages, memory, t)
    }

    fn measured_current(&self, i: Complex<T>) -> Complex<T> {
        // Each phase has its own.
        if self.is(Acts::CurrentSensor) { from_phases(to_phases(i).map(|i| i + i * self.at(self.magnitude(i * i)))) } else { i }
    }

    fn shown_speed(&self, omega_m: T, theta_m: T) -> T {
        match (self.form.acts, self.form.over) {
            (Acts::SpeedSensor, Over::ShaftAngle) => omega_m + omega_m * self.around_shaft(theta_m),
            (Acts::SpeedSensor, _) => omega_m + omega_m * self.over_speed(omega_m),
            _ => omega_m,
        }
    }

    fn added_resistance(&self, cold_r_r: f64) -> f64 {
        let most = self.coefficients().iter().map(|c| c.value().abs()).fold(0.0, f64::max);
        match self.form.acts {
            Acts::StatorResistance | Acts::RotorResistance | Acts::LeakageCurrent => most * 2.0 * cold_r_r,
            _ => 0.0,
        }
    }
}

impl<T: Scalar> CustomHooks<T> for FreeForm {
    fn with(&self, values: &[T], act: &mut dyn FnMut(&dyn Hooks<T>)) {
        act(&Curve { form: self, values });
    }
}

impl CustomEffect for FreeForm {
    fn name(&self) -> &'static str {
        parameters::row_of(self.acts, self.over).name
    }
    fn parameters(&self) -> &'static [ParameterInfo] {
        self.parameters
    }
    fn about(&self) -> About {
        let place = match self.acts {
            Acts::Voltage if self.over == Over::Lag => Place::Command,
            Acts::Torque | Acts::Friction => Place::Mechanics,
            Acts::StatorResistance | Acts::RotorResistance => Place::Windings,
            Acts::Voltage | Acts::VoltageAngle => Place::Voltage,
            Acts::MagnetizingCurrent | Acts::ShaftFlux | Acts::LossCurrent | Acts::LeakageCurrent => Place::FluxMap,
            Acts::CurrentSensor | Acts::SpeedSensor => Place::Sensors,
        };
        let steady_state = match self.over {
            Over::ShaftAngle | Over::FluxDirection => SteadyState::Ripples,
            Over::Time | Over::Lag => SteadyState::Hides,
            _ => SteadyState::Shows,
        };
        About { steady_state, fixed_to_shaft: self.over == Over::ShaftAngle, ..About::at(place) }
    }
    fn states(&self) -> &'static [StateInfo] {
        const CLOCK: &[StateInfo] = &[StateInfo { name: "time_s", kind: StateKind::Drifts }];
        if self.over == Over::Time { CLOCK } else { &[] }
    }
    fn card(&self) -> Card {
        parameters::card(self.acts, self.over)
    }
    fn hooks(&self) -> HookSet {
        if self.over == Over::Lag {
            let sensor = HookSet::NONE.with(Hook::remember).with(Hook::recalled);
            return if self.acts == Acts::Voltage { HookSet::NONE.with(Hook::passed_voltage) } else { sensor };
        }
        let hook = match self.acts {
            Acts::Torque | Acts::Friction => Hook::braking_torque,
            Acts::StatorResistance | Acts::Voltage | Acts::VoltageAngle => Hook::stator_drop,
            Acts::RotorResistance => Hook::rotor_drop,
            Acts::MagnetizingCurrent | Acts::ShaftFlux | Acts::LossCurrent | Acts::LeakageCurrent => Hook::added_currents,
            Acts::CurrentSensor => Hook::measured_current,
            Acts::SpeedSensor => Hook::shown_speed,
        };
        let own = HookSet::NONE.with(hook).with(Hook::added_resistance);
        let own = if self.has_reluctance_torque() { own.with(Hook::braking_torque) } else { own };
        let own = if matches!(self.acts, Acts::Voltage | Acts::VoltageAngle) { own.with(Hook::powers) } else { own };
        if self.over == Over::Time { own.with(Hook::rates) } else { own }
    }
    fn free_form(&self) -> Option<&FreeForm> {
        Some(self)
    }
}

#[cfg(feature = "std")]
impl FreeForm {
    /// Defines an effect whose curve lies on `range`, in the variable's unit. Over an angle the range is not looked at, and `order` is how
    /// often the fundamental repeats per turn (of the shaft, or of the flux, where it is a whole number).
    ///
    /// What is defined lives as long as the program: effects are named by reference.
    ///
    /// # Panics
    /// The pair is not one of [`all`](Self::all).
    pub fn define(acts: Acts, over: Over, range: (f64, f64), order: f64) -> CustomId {
        assert!(Self::all().any(|pair| pair == (acts, over)), "no free-form effect {acts:?} over {over:?}");
        let parameters = Box::leak(parameters::table(acts, over, range, order).into_boxed_slice());
        CustomId(Box::leak(Box::new(Self::with_parameters(acts, over, parameters))))
    }

    /// Where the curve lies; an angle over one `turn`, or over one period where there are too many in a turn to be seen.
    pub fn range(&self, values: &[f64], turn: f64) -> (f64, f64) {
        const SEEN: f64 = 4.0;
        if !self.over.is_angle() {
            return (values[FIRST], values[FIRST + 1]);
        }
        let order = values[FIRST].abs();
        let periods = if order > SEEN { 1.0 } else { order.max(1.0) };
        (0.0, turn * periods / order)
    }

    /// By how much what changes slowly comes late through lags with these values of the parameters, s.
    pub fn delay_s(&self, values: &[f64]) -> f64 {
        Curve { form: self, values }.lags().delay_s()
    }

    /// The names of the variable and of the quantity, with units.
    pub fn labels(&self) -> (&'static str, &'static str) {
        parameters::labels(self.acts, self.over)
    }

    /// The quantity and the variable of the free-form effect with this identifier.
    pub fn of_name(name: &str) -> Option<(Acts, Over)> {
        parameters::ROWS.iter().find(|r| r.name == name).map(|r| (r.acts, r.over))
    }
}

impl FreeForm {
    /// Every quantity with the variables that it may depend on.
    pub fn all() -> impl Iterator<Item = (Acts, Over)> {
        parameters::ROWS.iter().map(|r| (r.acts, r.over))
    }
}

#[cfg(all(test, feature = "std"))]
mod tests;
