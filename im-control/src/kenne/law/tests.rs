use super::*;
use crate::machine_data::MachineData;
use im_model::space_vector::{cross, dot, j, norm2, unit};
use im_model::{Machine, machines};
use proptest::prelude::*;

type C = Complex<f64>;

/// Flux, current and speed of (1), with references and a load that have rates.
#[derive(Clone, Copy)]
struct Motion {
    lambda: C,
    i: C,
    omega: f64,
    time: f64,
}

/// What is asked for and what brakes, around time zero.
#[derive(Clone, Copy)]
struct Around {
    speed: Shaped<f64>,
    flux2: [f64; 2],
    load: [f64; 2],
}

struct Bench {
    w: WindingParameters<f64>,
    pole_pairs: u32,
    gains: KenneGains<f64>,
}

impl Bench {
    fn new(index: usize) -> Self {
        let m = machines::ALL[index % machines::ALL.len()];
        let known = MachineData::of(&Machine::base(m.parameters(), m.pole_pairs).unwrap(), 20.0);
        let w = WindingParameters { viscous_friction_nm_s_per_rad: 0.03 * known.windings.inertia_kg_m2, ..known.windings };
        // No switching terms: v̂ alone.
        let gains = KenneGains {
            k_sq: 0.0,
            k_sd: 0.0,
            boundary_omega: 1.0,
            boundary_lambda: 1.0,
            equivalent_bandwidth_per_s: 0.0,
            ..KenneGains::typical(&known, 0.9, 540.0, 1e-4)
        };
        Self { w, pole_pairs: m.pole_pairs, gains }
    }

    fn torque(&self, x: &Motion) -> f64 {
        self.w.derived(self.pole_pairs).mu * self.w.inertia_kg_m2 * cross(x.lambda, x.i)
    }

    fn acceleration(&self, x: &Motion, a: &Around) -> f64 {
        let load = a.load[0] + a.load[1] * x.time;
        (self.torque(x) - self.w.viscous_friction_nm_s_per_rad * x.omega - load) / self.w.inertia_kg_m2
    }

    /// The machine after `h`, straight on.
    fn after(&self, x: &Motion, a: &Around, u: C, h: f64) -> Motion {
        let c = self.w.derived(self.pole_pairs);
        let turning = C::new(-c.eta, c.n_p * x.omega) * x.lambda;
        Motion {
            lambda: x.lambda + (turning + x.i * c.eta_l_m) * h,
            i: x.i + (-turning * c.beta - x.i * c.gamma + u / c.sigma_l_s) * h,
            omega: x.omega + self.acceleration(x, a) * h,
            time: x.time + h,
        }
    }

    /// s_ω and s_λ of (17).
    fn surfaces(&self, x: &Motion, a: &Around) -> [f64; 2] {
        let (g, c, t) = (&self.gains, self.w.derived(self.pole_pairs), x.time);
        let speed = a.speed.speed + a.speed.rate * t + 0.5 * a.speed.second * t * t;
        let rate = 2.0 * (c.eta_l_m * dot(x.lambda, x.i) - c.eta * norm2(x.lambda));
        [
            self.acceleration(x, a) - a.speed.rate - a.speed.second * t + g.c_omega * (x.omega - speed),
            rate - a.flux2[1] + g.c_lambda * (norm2(x.lambda) - a.flux2[0] - a.flux2[1] * t),
        ]
    }

    fn seen(&self, x: &Motion, a: &Around) -> Seen<f64> {
        Seen {
            omega_m: x.omega,
            flux_vs: x.lambda.norm(),
            x: dot(x.lambda, x.i),
            torque_nm: self.torque(x),
            i2: norm2(x.i),
            load: (a.load[0], a.load[1]),
            r_r: self.w.rotor_resistance_ohm,
        }
    }

    fn voltage(&self, x: &Motion, a: &Around, most: [f64; 2]) -> Voltage<f64> {
        let aims = Aims { speed: a.speed, flux2: a.flux2[0], flux2_rate: a.flux2[1], torque_max: most[0], i_d_max: most[1] };
        Law::new(&self.w, self.pole_pairs).voltage(&self.gains, &self.seen(x, a), &aims, &mut C::new(0.0, 0.0), 1e-4)
    }
}

fn near(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * a.abs().max(b.abs())
}

proptest! {
    /// (15) to (19): v̂ makes ds_ω/dt = ds_λ/dt = 0 along the machine's own motion, whatever state, references, friction and load are.
    #[test]
    fn the_equivalent_voltage_keeps_both_surfaces_still(
        machine in 0..6usize, omega in -150.0..150.0f64, flux in 0.3..1.2f64, angle in -3.0..3.0f64, i_d in -10.0..10.0f64,
        i_q in -10.0..10.0f64, asked in [-150.0..150.0f64, -300.0..300.0f64, -5000.0..5000.0f64],
        flux2 in [0.1..1.2f64, -3.0..3.0f64], load in [-20.0..20.0f64, -200.0..200.0f64]
    ) {
        let bench = Bench::new(machine);
        let d = unit(angle);
        let x = Motion { lambda: d * flux, i: d * C::new(i_d, i_q), omega, time: 0.0 };
        let a = Around { speed: Shaped { speed: asked[0], rate: asked[1], second: asked[2] }, flux2, load };
        let v = bench.voltage(&x, &a, [1e9, 1e9]);
        // Flux falls by itself no faster than without current.
        prop_assume!(flux2[1] - bench.gains.c_lambda * (flux * flux - flux2[0]) > -2.0 * bench.w.derived(1).eta * flux * flux);
        prop_assert!(!v.limited);
        let rates = |u: C| {
            // Central differences of smooth functions: exact to the square of the step.
            let h = 1e-6;
            let [to, from] = [h, -h].map(|h| bench.surfaces(&bench.after(&x, &a, u, h), &a));
            [(to[0] - from[0]) / (2.0 * h), (to[1] - from[1]) / (2.0 * h)]
        };
        let still = rates(v.v * d);
        // What a volt does, times the voltages that there are, is the scale of rounding and of the third derivative.
        let more = rates((v.v + C::new(1.0, 1.0)) * d);
        for k in 0..2 {
            let volt = (more[k] - still[k]).abs();
            prop_assert!(still[k].abs() < 1e-3 * volt * (1.0 + v.v.norm()), "{k}: {still:?} {more:?} {}", v.v);
        }
    }
}

/// A state of 0.8 Vs at 60 rad/s whose torque is `torque` and whose d current is `i_d`; no load.
fn at(bench: &Bench, torque: f64, i_d: f64) -> (Motion, Around) {
    let k = bench.w.derived(bench.pole_pairs).mu * bench.w.inertia_kg_m2;
    let x = Motion { lambda: C::new(0.8, 0.0), i: C::new(i_d, torque / (k * 0.8)), omega: 60.0, time: 0.0 };
    (x, Around { speed: Shaped::at(60.0), flux2: [0.64, 0.0], load: [0.0, 0.0] })
}

/// s_ω = ω̇ − a*, a* kept within what the torque can do: a machine that gives all its torque is on the surface, however much is asked for.
#[test]
fn at_the_limit_of_torque_or_flux_current_nothing_switches() {
    let quiet = Bench::new(3);
    let c = quiet.w.derived(quiet.pole_pairs);
    let loud = Bench { gains: KenneGains { k_sq: 54.0, k_sd: 54.0, ..quiet.gains }, ..Bench::new(3) };
    let i_d = 0.8 / quiet.w.mutual_inductance_h;
    for sign in [1.0, -1.0] {
        let (x, mut a) = at(&quiet, sign * 25.0, i_d);
        a.speed.speed += sign * 1e4;
        a.load[0] = 7.0;
        let [v, switched] = [&quiet, &loud].map(|b| b.voltage(&x, &a, [25.0, 12.0]));
        assert!(v.limited && switched.limited && (v.v - switched.v).norm() < 1e-6, "{} {}", v.v, switched.v);
        // A little less torque than there may be: it is driven up with all of k.
        let [v, switched] = [&quiet, &loud].map(|b| b.voltage(&x, &a, [26.0, 12.0]));
        assert!((switched.v - v.v - j(C::new(sign * 54.0, 0.0))).norm() < 1e-6, "{} {}", v.v, switched.v);
    }
    // The squared flux rises by 2η(M i_d,max |λ| − |λ|²) at most, and falls by 2η|λ|² at most, without any current.
    for (i_d, wanted) in [(12.0, 1e6), (0.0, -1e6)] {
        let (x, mut a) = at(&quiet, 0.0, i_d);
        a.flux2[0] = wanted;
        let [v, switched] = [&quiet, &loud].map(|b| b.voltage(&x, &a, [25.0, 12.0]));
        assert!((v.v - switched.v).re.abs() < 1e-6, "{} {}", v.v, switched.v);
        // At a limit the aim stands still, so that v̂ keeps d|λ|²/dt where it is: ẋ M = d|λ|²/dt.
        let (h, rate) = (1e-6, 2.0 * c.eta * (quiet.w.mutual_inductance_h * 0.8 * i_d - 0.64));
        let product = |h: f64| {
            let y = quiet.after(&x, &a, v.v, h);
            dot(y.lambda, y.i)
        };
        assert!(near((product(h) - product(-h)) / (2.0 * h) * quiet.w.mutual_inductance_h, rate, 1e-3));
    }
}

/// v = v̂ − k sat(s/Φ) + v_e, dv_e/dt = −a_e k sat(s/Φ), |v_e| ≤ k.
#[test]
fn the_mean_of_the_switching_terms_is_fed_back_within_their_size() {
    let quiet = Bench::new(3);
    let gains = KenneGains {
        k_sq: 54.0,
        k_sd: 40.0,
        boundary_omega: 100.0,
        boundary_lambda: 2.0,
        equivalent_bandwidth_per_s: 150.0,
        ..quiet.gains
    };
    let (x, mut a) = at(&quiet, 0.0, 0.8 / quiet.w.mutual_inductance_h);
    // s_ω = ω̇ + c_ω e_ω: half a layer; s_λ three quarters of one.
    let braking = quiet.w.viscous_friction_nm_s_per_rad * 60.0 / quiet.w.inertia_kg_m2;
    a.speed.speed -= (50.0 + braking) / gains.c_omega;
    a.flux2[0] -= 1.5 / gains.c_lambda;
    let aims = Aims { speed: a.speed, flux2: a.flux2[0], flux2_rate: 0.0, torque_max: 1e9, i_d_max: 1e9 };
    let (law, seen) = (Law::new(&quiet.w, quiet.pole_pairs), quiet.seen(&x, &a));
    let hat = quiet.voltage(&x, &a, [1e9, 1e9]).v;
    let term = C::new(0.75 * 40.0, 0.5 * 54.0);
    let (mut lacking, t) = (C::new(0.0, 0.0), 1e-3);
    let step = term * (gains.equivalent_bandwidth_per_s * t);
    for k in 1..=3 {
        let v = law.voltage(&gains, &seen, &aims, &mut lacking, t).v;
        assert!((lacking + step * f64::from(k)).norm() < 1e-6, "{k}: {lacking} {step}");
        assert!((v - (hat - term + lacking)).norm() < 1e-6, "{k}: {v}");
    }
    // A limited voltage stands for a sample of no time: nothing is gathered.
    let before = lacking;
    law.voltage(&gains, &seen, &aims, &mut lacking, 0.0);
    assert_eq!(lacking, before);
    for _ in 0..10_000 {
        law.voltage(&gains, &seen, &aims, &mut lacking, t);
    }
    assert_eq!(lacking, C::new(-40.0, -54.0));
}

#[test]
fn a_layer_of_no_width_is_the_sign() {
    assert_eq!([-3.0, 0.0, 1e-9].map(|s: f64| saturation(s, 0.0)), [-1.0, 0.0, 1.0]);
    assert_eq!([-3.0, -2.0, -1.0, 0.5, 2.0, 9.0].map(|s: f64| saturation(s, 2.0)), [-1.0, -1.0, -0.5, 0.25, 1.0, 1.0]);
}
