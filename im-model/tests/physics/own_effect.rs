//! A user's effect is as good as a built-in one.

use im_model::effects::{Card, CustomId, Effect, Hooks, Operating, ParameterInfo, Role, ScaleOf, StateInfo, StateKind};
use im_model::{
    Bench, Bound, Complex, EffectId, Effects, Ledger, Machine, ParameterId, PlantInput, Powers, Scalar, SingleDual, State,
    register_effect,
};

use crate::lab;

const CARD: Card = Card { title: "", what: "", shows: "", rivals: &[], test: "", place: "", source: "" };

const fn strength(key: &'static str) -> ParameterInfo {
    ParameterInfo {
        key,
        unit: "",
        meaning: "",
        role: Role::Strength,
        scale: ScaleOf::One,
        default: 0.0,
        typical: (0.1, 1.0),
        bound: Bound::NotNegative,
    }
}

/// Windage again.
#[derive(Clone, Copy)]
pub struct Fan<T>(T);
impl<T: Scalar> Default for Fan<T> {
    fn default() -> Self {
        Self(T::zero())
    }
}
impl<T: Scalar> Effect<T> for Fan<T> {
    const NAME: &'static str = "fan";
    const PARAMETERS: &'static [ParameterInfo] = &[strength("coefficient")];
    const CARD: Card = CARD;
    fn get(&self, _: usize) -> T {
        self.0
    }
    fn set(&mut self, _: usize, value: T) {
        self.0 = value;
    }
}
impl<T: Scalar> Hooks<T> for Fan<T> {
    fn braking_torque(&self, torque: T, at: &Operating<T>, _own: &[T]) -> T {
        torque + self.0 * at.state.omega_m() * at.state.omega_m().abs()
    }
}
register_effect!(pub FanEffect: Fan);

/// Main-flux saturation again, with exponent 7 at 1 Vs.
#[derive(Clone, Copy)]
pub struct Iron<T>(T);
impl<T: Scalar> Default for Iron<T> {
    fn default() -> Self {
        Self(T::zero())
    }
}
impl<T: Scalar> Effect<T> for Iron<T> {
    const NAME: &'static str = "iron";
    const PARAMETERS: &'static [ParameterInfo] = &[strength("excess")];
    const CARD: Card = CARD;
    fn get(&self, _: usize) -> T {
        self.0
    }
    fn set(&mut self, _: usize, value: T) {
        self.0 = value;
    }
}
impl<T: Scalar> Hooks<T> for Iron<T> {
    fn reluctance(&self, (mu, dmu): (T, T), psi_m_squared: T) -> (T, T) {
        let half_s = T::from_f64(3.5);
        let extra = self.0 * psi_m_squared.powf(half_s);
        let slope = if psi_m_squared.value() > 0.0 { extra * half_s / psi_m_squared } else { T::zero() };
        (mu + extra, dmu + slope)
    }
}
register_effect!(pub IronEffect: Iron);

/// The heating of the stator again, with a state of its own.
#[derive(Clone, Copy)]
pub struct Warm<T>(T);
impl<T: Scalar> Default for Warm<T> {
    fn default() -> Self {
        Self(T::zero())
    }
}
impl<T: Scalar> Effect<T> for Warm<T> {
    const NAME: &'static str = "warm";
    const STATES: &'static [StateInfo] = &[StateInfo { name: "rise_K", kind: StateKind::Drifts }];
    const PARAMETERS: &'static [ParameterInfo] = &[strength("inverse_heat_capacity")];
    const CARD: Card = CARD;
    fn get(&self, _: usize) -> T {
        self.0
    }
    fn set(&mut self, _: usize, value: T) {
        self.0 = value;
    }
}
impl<T: Scalar> Hooks<T> for Warm<T> {
    fn stator_drop(&self, drop: Complex<T>, at: &Operating<T>, own: &[T]) -> Complex<T> {
        drop + at.currents.i_s * (at.r_s * own[0] * T::from_f64(0.00393))
    }
    fn rates(&self, rates: &mut [T], at: &Operating<T>, _powers: &Powers<T>, own: &[T]) {
        let r = at.r_s * (T::one() + own[0] * T::from_f64(0.00393));
        let loss = (at.currents.i_s.re * at.currents.i_s.re + at.currents.i_s.im * at.currents.i_s.im) * r * T::from_f64(1.5);
        rates[0] = self.0 * loss - own[0] / T::from_f64(20.0);
    }
}
register_effect!(pub WarmEffect: Warm);

fn start<T: Scalar>(m: &Machine<T>) -> (Vec<[T; 3]>, f64) {
    let mut bench = Bench::new(m, State::default(), T::from_f64(lab::T));
    let plant = *bench.plant();
    let mut ledger = Ledger::new(&plant, bench.state());
    let supply = lab::Supply::rated_flux(50.0);
    let rows = (0..2000)
        .map(|k| {
            let u = supply.mean(k);
            let input = PlantInput::new(Complex::new(T::from_f64(u.re), T::from_f64(u.im)), T::from_f64(5.0));
            bench.advance_observed(&input, |w, e| ledger.add(w, e));
            let y = bench.output();
            [y.i_s.re, y.i_s.im, y.omega_m]
        })
        .collect();
    (rows, (ledger.imbalance(&plant, bench.state()) / ledger.energies[0]).value())
}

/// The same law, built in and registered.
fn pairs() -> [(CustomId, f64, Machine<f64>); 3] {
    [
        (CustomId(&FanEffect), 2e-4, lab::machine(|e| e.windage.coefficient_nm_s2 = 2e-4)),
        (
            CustomId(&IronEffect),
            0.6,
            lab::machine(|e| {
                e.main_flux_saturation.excess = 0.6;
                e.main_flux_saturation.reference_flux_vs = 1.0;
            }),
        ),
        (CustomId(&WarmEffect), 0.05, lab::machine(|e| e.stator_heating.inverse_heat_capacity_k_per_j = 0.05)),
    ]
}

fn registered(custom: CustomId, size: f64) -> Machine<f64> {
    let mut e = Effects::none().with_custom(custom);
    e.set(EffectId::Custom(custom), 0, size);
    lab::base().with_effects(e).unwrap()
}

#[test]
fn a_registered_effect_gives_the_result_of_the_built_in_one() {
    for (custom, size, built_in) in pairs() {
        let ((ours, balance), (theirs, expected_balance)) = (start(&registered(custom, size)), start(&built_in));
        // The same law in another order of operations: rounding; the saturation's grids have other nodes, 1e-8.
        let tolerance = if custom.name() == "iron" { 1e-5 } else { 1e-9 };
        for (a, b) in ours.iter().zip(&theirs) {
            assert!((0..3).all(|c| (a[c] - b[c]).abs() < tolerance * (1.0 + b[c].abs())), "{}: {a:?} {b:?}", custom.name());
        }
        assert!((balance - expected_balance).abs() < 1e-6, "{}: {balance:e} {expected_balance:e}", custom.name());
    }
}

#[test]
fn a_registered_effect_carries_derivatives_and_is_absent_at_zero() {
    for (custom, size, built_in) in pairs() {
        let seed = |m: &Machine<f64>, strength: ParameterId| {
            let m = m.map(|id, x| if id == strength { SingleDual::<4>::seeded(x, 0, 1.0) } else { SingleDual::constant(x) });
            start(&m).0.last().unwrap().map(|x| f64::from(x.eps[0]))
        };
        let theirs = match custom.name() {
            "fan" => EffectId::Windage,
            "iron" => EffectId::MainFluxSaturation,
            _ => EffectId::StatorHeating,
        };
        let a = seed(&registered(custom, size), ParameterId::Effect(EffectId::Custom(custom), 0));
        let b = seed(&built_in, ParameterId::Effect(theirs, 0));
        for c in 0..3 {
            assert!((a[c] - b[c]).abs() < 1e-4 * b.iter().map(|x| x.abs()).fold(0.0, f64::max), "{}: {a:?} {b:?}", custom.name());
        }
        assert_eq!(start(&registered(custom, 0.0)).0, start(&lab::base()).0, "{}", custom.name());
        assert!(lab::base().with_effects(*registered(custom, size).effects()).is_ok());
        let mut bad = *registered(custom, size).effects();
        bad.set(EffectId::Custom(custom), 0, -1.0);
        assert!(lab::base().with_effects(bad).is_err(), "bounds of registered effects are checked");
    }
}
