//! Sinusoidal steady state: where every quantity turns with the supply.
//!
//! Solved as rates = 0 in the frame of the supply by Newton's method with exact derivatives, from the linear machine's circuit.
//! Effects without rotational symmetry (asymmetries, ripple, dead time, sensors) ripple around this state; temperatures are held.

use num_complex::Complex;
use num_traits::Zero;

use crate::dual::Dual;
use crate::effects::{EffectId, Extra, Role, StateKind, SteadyState, UNKNOWNS};
use crate::error::ModelError;
use crate::instant::PlantInput;
use crate::machine::Machine;
use crate::plant::Plant;
use crate::space_vector::j;
use crate::state::State;

const N: usize = UNKNOWNS;

/// What is held in the steady state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Held {
    /// The load torque, Nm; speed follows (the stable side of the torque curve).
    Load(f64),
    /// The mechanical speed, rad/s; the torque follows.
    Speed(f64),
}

/// The steady state at stator voltage `u_peak_v` (phase peak, along α at t = 0) and supply frequency `frequency_hz`.
pub fn steady_state(machine: &Machine<f64>, u_peak_v: f64, frequency_hz: f64, held: Held) -> Result<State<f64>, ModelError> {
    let omega = 2.0 * core::f64::consts::PI * frequency_hz;
    let symmetric = symmetric(machine)?;
    match held {
        Held::Speed(omega_m) => {
            let start = linear(&symmetric, u_peak_v, omega, omega_m);
            solve(&symmetric, u_peak_v, omega, held, start)
        }
        Held::Load(torque) => {
            let no_solution = ModelError::NoSteadyState { frequency_hz, torque_nm: torque };
            let omega_m = slip_for_load(&symmetric, u_peak_v, omega, torque).ok_or(no_solution)?;
            solve(&symmetric, u_peak_v, omega, held, linear(&symmetric, u_peak_v, omega, omega_m)).map_err(|_| no_solution)
        }
    }
}

/// The machine without the effects that break rotational symmetry.
fn symmetric(machine: &Machine<f64>) -> Result<Machine<f64>, ModelError> {
    let mut e = *machine.effects();
    for id in machine.effects().ids().filter(|id| id.about().steady_state == SteadyState::Ripples) {
        for (k, _) in id.parameters().iter().enumerate().filter(|(_, p)| p.role == Role::Strength) {
            e.set(id, k, 0.0);
        }
    }
    machine.with_effects(e)
}

/// The linear T circuit at a speed: (R_s + jωL_s) i_s + jωL_m i_r = u, jω_g L_m i_s + (R_r + jω_g L_r) i_r = 0.
fn linear(machine: &Machine<f64>, u: f64, omega: f64, omega_m: f64) -> State<f64> {
    let p = machine.parameters();
    let slip = omega - f64::from(machine.pole_pairs()) * omega_m;
    let (l_s, l_r, l_m) = (p.stator_inductance_h(), p.rotor_inductance_h(), p.magnetizing_inductance_h);
    let z_s = Complex::new(p.stator_resistance_ohm, omega * l_s);
    let z_r = Complex::new(p.rotor_resistance_ohm, slip * l_r);
    let det = z_s * z_r + omega * slip * l_m * l_m;
    let i_s = z_r * u / det;
    let i_r = -j(Complex::from(slip * l_m * u)) / det;
    let (psi_s, psi_r) = (i_s * l_s + i_r * l_m, i_s * l_m + i_r * l_r);
    State { psi_s, psi_r, ..State::turning(omega_m) }
}

/// The speed on the stable side at which the linear machine carries the load and its friction.
fn slip_for_load(machine: &Machine<f64>, u: f64, omega: f64, torque: f64) -> Option<f64> {
    let n_p = f64::from(machine.pole_pairs());
    let plant = Plant::new(machine);
    // Torque surplus at relative slip s, by the acceleration of the plant.
    let surplus = |s: f64| {
        let mut x = linear(machine, u, omega, omega * (1.0 - s) / n_p);
        let input = PlantInput::new(Complex::from(u), torque);
        plant.settle(&mut x, &input);
        let e = plant.evaluate(&x, &input);
        // Against the direction of the field a motoring torque is negative.
        (e.torque - torque) * omega.signum() - e.powers.friction / x.omega_m.abs().max(1e-9)
    };
    // From synchronism outwards to the pull-out slip in the direction that the load asks for.
    let direction = if surplus(0.0) < 0.0 { 1.0 } else { -1.0 };
    // In large steps, and where those pass over a pull-out that is just enough, in small ones.
    let slip = bracketed(&surplus, direction, 1.25).or_else(|| bracketed(&surplus, direction, 1.03))?;
    Some(omega * (1.0 - slip) / n_p)
}

/// The first relative slip, near enough to begin from, at which the surplus turns, looked for in steps that grow so.
fn bracketed(surplus: &impl Fn(f64) -> f64, direction: f64, growth: f64) -> Option<f64> {
    let mut before = 0.0;
    let mut s = direction * 1e-4;
    while s.abs() <= growth {
        if surplus(s) * direction >= 0.0 {
            let (mut a, mut b) = (before, s);
            for _ in 0..12 {
                let m = 0.5 * (a + b);
                if surplus(m) * direction >= 0.0 { b = m } else { a = m }
            }
            return Some(b);
        }
        before = s;
        s *= growth;
    }
    None
}

fn solve(machine: &Machine<f64>, u: f64, omega: f64, held: Held, start: State<f64>) -> Result<State<f64>, ModelError> {
    let plant = Plant::new(&machine.cast::<Dual<N>>());
    let torque = if let Held::Load(t) = held { t } else { 0.0 };
    let input = PlantInput::new(Complex::from(Dual::constant(u)), Dual::constant(torque));
    let mut settled = start;
    Plant::new(machine).settle(&mut settled, &PlantInput::new(Complex::from(u), torque));
    let mut x = pack(&settled);
    let zero = Dual::<N>::zero();
    let mut before = f64::INFINITY;
    for _ in 0..60 {
        let seeded = unpack(core::array::from_fn(|k| Dual::seeded(x[k], k, 1.0)));
        let r = plant.rates_in_frame(&seeded, &input, zero, Dual::constant(omega));
        // Two masses at one speed: the motor's balance fixes ω_m, the load's the twist, the twist's the speed of the load.
        let mut residual = pack(&r);
        let mut place = 5;
        each_settling(&mut seeded.extra.clone(), |id, x| {
            // A state of an effect that is off stays where it is.
            if !machine.effects().is_on(id) {
                residual[place] = *x;
            }
            place += 1;
        });
        if let Held::Speed(w) = held {
            residual[SPEED] = seeded.omega_m - Dual::constant(w);
        }
        let jacobian = nalgebra::SMatrix::<f64, N, N>::from_fn(|row, col| residual[row].eps[col]);
        let rhs = nalgebra::SVector::<f64, N>::from_fn(|row, _| residual[row].re);
        let Some(step) = jacobian.lu().solve(&rhs) else { break };
        let mut size = 0.0f64;
        for k in 0..N {
            x[k] -= step[k];
            size = size.max(step[k].abs() / (1e-3 + x[k].abs()));
        }
        if !size.is_finite() {
            break;
        }
        // At the latest where steps are rounding and shrink no more.
        if size < 1e-12 || (size < 1e-9 && size > 0.5 * before) {
            let mut found = unpack(x);
            let speed = found.omega_m;
            found.change_speed(|w| *w = speed);
            return Ok(found);
        }
        before = size;
    }
    let frequency_hz = omega / (2.0 * core::f64::consts::PI);
    Err(ModelError::NoSteadyState { frequency_hz, torque_nm: torque })
}

/// Each number of the states that are unknowns, in their order.
fn each_settling<T>(states: &mut Extra<T>, mut f: impl FnMut(EffectId, &mut T)) {
    states.each_mut(|id, kind, state| {
        if kind != StateKind::Drifts {
            state.iter_mut().for_each(|x| f(id, x));
        }
    });
}

/// Where the speed stands among the unknowns.
const SPEED: usize = 4;

fn pack<T: crate::Scalar>(x: &State<T>) -> [T; N] {
    let mut out = [T::zero(); N];
    out[..5].copy_from_slice(&[x.psi_s.re, x.psi_s.im, x.psi_r.re, x.psi_r.im, x.omega_m]);
    let mut place = 5;
    each_settling(&mut x.extra.clone(), |_, state| {
        out[place] = *state;
        place += 1;
    });
    out
}

fn unpack<T: crate::Scalar>(v: [T; N]) -> State<T> {
    let mut x = State { psi_s: Complex::new(v[0], v[1]), psi_r: Complex::new(v[2], v[3]), omega_m: v[SPEED], ..State::default() };
    let mut place = 5;
    each_settling(&mut x.extra, |_, state| {
        *state = v[place];
        place += 1;
    });
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machines;
    use crate::{Effects, Machine};
    use approx::assert_relative_eq;

    fn machine(change: impl Fn(&mut Effects<f64>)) -> Machine<f64> {
        let m = machines::JADOT_TABLE_I;
        let mut e = Effects::scaled(&m.rating, &m.parameters(), m.pole_pairs);
        change(&mut e);
        Machine::try_new(m.parameters(), m.pole_pairs, e).unwrap()
    }

    /// Run for a second from the computed state: fluxes turn, speed stays.
    fn stays(m: &Machine<f64>, held: Held, tau: f64) {
        let (u, f) = (320.0, 50.0);
        let x0 = steady_state(m, u, f, held).unwrap();
        let plant = Plant::new(m);
        let mut x = x0;
        let n = 20_000;
        let h = 1.0 / f64::from(n);
        for k in 0..n {
            // The voltage turns within the step: its value at the middle, over the sinc of half the step.
            let w = 2.0 * core::f64::consts::PI * f;
            let angle = w * h * (f64::from(k) + 0.5);
            let hold = (0.5 * w * h).sin() / (0.5 * w * h);
            x = plant.step(&x, &PlantInput::new(crate::space_vector::unit(angle) * u * hold, tau), h);
        }
        assert_relative_eq!(x.omega_m, x0.omega_m, max_relative = 2e-6);
        assert_relative_eq!(x.psi_s.norm(), x0.psi_s.norm(), max_relative = 1e-4);
        assert!((x.psi_s - x0.psi_s).norm() < 2e-3, "{} {}", x.psi_s, x0.psi_s);
    }

    #[test]
    fn a_computed_steady_state_stays() {
        stays(&machine(|_| ()), Held::Load(20.0), 20.0);
        stays(&machine(|_| ()), Held::Load(-20.0), -20.0);
        stays(
            &machine(|e| {
                e.main_flux_saturation.excess = 0.6;
                e.iron_loss.conductance_s = 2e-3;
                e.rotor_skin_effect.resistance_rise = 1.0;
                e.windage.coefficient_nm_s2 = 5e-5;
                e.shaft_compliance.load_inertia_fraction = 0.4;
            }),
            Held::Load(15.0),
            15.0,
        );
    }

    #[test]
    fn speed_can_be_held_and_overload_is_refused() {
        let m = machine(|_| ());
        let x = steady_state(&m, 320.0, 50.0, Held::Speed(150.0)).unwrap();
        assert_eq!(x.omega_m, 150.0);
        let e = steady_state(&m, 320.0, 50.0, Held::Load(500.0)).unwrap_err().to_string();
        assert!(e.contains("500"), "{e}");
    }
}
