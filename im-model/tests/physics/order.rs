//! The fixed step against an adaptive solver of a library, and its order.

use im_model::{Complex, Effects, Machine, Plant, PlantInput, State};
use ode_solvers::{Dop853, OutputType, SVector, System};

use crate::lab;

/// The states of every machine, and the eight of the effects.
const N: usize = 6 + 8;
type Vector = SVector<f64, N>;

fn pack(x: &State<f64>) -> Vector {
    let machine = [x.psi_s.re, x.psi_s.im, x.psi_r.re, x.psi_r.im, x.omega_m, x.theta_m];
    Vector::from_iterator(machine.iter().chain(x.extra.values()).copied())
}

fn unpack(v: &Vector) -> State<f64> {
    let mut x = State {
        psi_s: Complex::new(v[0], v[1]),
        psi_r: Complex::new(v[2], v[3]),
        omega_m: v[4],
        theta_m: v[5],
        ..State::default()
    };
    let mut values = v.iter().skip(6);
    x.extra.each_mut(|_, _, state| state.iter_mut().zip(&mut values).for_each(|(x, v)| *x = *v));
    x
}

struct Held<'a>(&'a Plant<f64>, PlantInput<f64>);

impl System<f64, Vector> for Held<'_> {
    fn system(&self, _t: f64, y: &Vector, dy: &mut Vector) {
        *dy = pack(&self.0.evaluate(&unpack(y), &self.1).rates);
    }
}

/// The solver's answer after `t` seconds with the input held, to twelve digits.
fn adaptive(plant: &Plant<f64>, x: &State<f64>, input: PlantInput<f64>, t: f64) -> State<f64> {
    // Sparse output: the solver's own steps, not its interpolation, which is of lower order.
    let (rtol, atol, h_max, steps) = (1e-12, 1e-13, t, 100_000);
    let (safety, beta, least, most, first) = (0.9, 0.0, 0.333, 6.0, 0.0);
    let (f, y) = (Held(plant, input), pack(x));
    let mut solver =
        Dop853::from_param(f, 0.0, t, t, y, rtol, atol, safety, beta, least, most, h_max, first, steps, 1000, OutputType::Sparse);
    solver.integrate().unwrap();
    unpack(solver.y_out().last().unwrap())
}

fn distance(a: &State<f64>, b: &State<f64>) -> f64 {
    // Fluxes of the order of 1 Vs, speed in units of its synchronous value, temperatures in K.
    let (a, b) = (pack(a), pack(b));
    (0..14).map(|k| ((a[k] - b[k]) / if k == 4 || k == 10 { 157.0 } else { 1.0 + a[k].abs() }).abs()).fold(0.0, f64::max)
}

fn everything_smooth() -> Machine<f64> {
    lab::machine(|e: &mut Effects<f64>| {
        e.main_flux_saturation.excess = 0.5;
        e.leakage_flux_saturation.drop = 0.5;
        e.rotor_skin_effect.resistance_rise = 1.0;
        e.iron_loss.conductance_s = 2e-3;
        e.iron_loss.diffusion_time_s = 2e-4;
        e.stator_heating.inverse_heat_capacity_k_per_j = 0.02;
        e.rotor_heating.inverse_heat_capacity_k_per_j = 0.02;
        e.windage.coefficient_nm_s2 = 1e-5;
        e.stator_asymmetry.unbalance_alpha = 0.05;
        e.rotor_asymmetry.unbalance_direct = 0.05;
        e.shaft_compliance.load_inertia_fraction = 0.4;
        e.load_torque_ripple.cosine_nm = 1.0;
    })
}

/// A start, with the voltage turned once per millisecond and held between.
fn run(mut advance: impl FnMut(&State<f64>, PlantInput<f64>) -> State<f64>) -> State<f64> {
    let mut x = State::default();
    for k in 0..100 {
        let u = im_model::space_vector::unit(0.314 * f64::from(k)) * lab::RATED_V;
        x = advance(&x, PlantInput::new(u, if k < 50 { 0.0 } else { 5.0 }));
    }
    x
}

fn fixed(plant: &Plant<f64>, x: &State<f64>, input: PlantInput<f64>, steps: u32) -> State<f64> {
    let h = 1e-3 / f64::from(steps);
    (0..steps).fold(*x, |x, _| plant.step(&x, &input, h))
}

#[test]
fn fixed_steps_agree_with_an_adaptive_solver() {
    for machine in [lab::base(), everything_smooth()] {
        let plant = Plant::new(&machine);
        let exact = run(|x, input| adaptive(&plant, x, input, 1e-3));
        let ours = run(|x, input| fixed(&plant, x, input, 400));
        // h = 2.5 µs and λ = 5000 1/s, the iron's diffusion: (λh)⁴/120 is 2e-10.
        let error = distance(&ours, &exact);
        assert!(error < 1e-9, "{error:e}");
    }
}

#[test]
fn the_order_is_four() {
    for machine in [lab::base(), everything_smooth()] {
        let plant = Plant::new(&machine);
        let exact = run(|x, input| adaptive(&plant, x, input, 1e-3));
        let error = |steps| distance(&run(|x, input| fixed(&plant, x, input, steps)), &exact);
        let (coarse, fine) = (error(20), error(80));
        let order = (coarse / fine).log2() / 2.0;
        // Higher orders of the error add to 4, knees of the saturation grid take away.
        assert!((3.7..4.5).contains(&order), "order {order:.2}: {coarse:e} at 20 steps a millisecond, {fine:e} at 80");
    }
}
