//! Observers: the error of the code's own steps against the certified rate.

use super::{C, decays, size};
use crate::designs::support::{cases, machine, modelled, region, top_speed};
use im_design::certificate::Design;
use im_design::machine::Constants;
use im_design::matrix::Matrix;
use im_design::request::{Kind, Period, design, design_sampled};
use im_design::{DesignError, DesignModel, LinearMachine, linalg, model};
use im_model::Rating;
use im_model::space_vector::{cross, unit};
use im_observers::{
    Basis, Derdiyok, DerdiyokGains, Discretization, Input, Kubota, KubotaGains, Limits, LoadTorqueModel, Observer, Thau,
    ThauBoxGains, ThauGains, Utkin, UtkinGains,
};
use proptest::prelude::*;

/// Machines about that of Jadot et al.: of any machine not every region of the adaptive loop has a proof.
fn near_jadots() -> impl Strategy<Value = LinearMachine> {
    prop::array::uniform4(0.8..1.25f64).prop_map(|[r_s, r_r, l, j]| {
        let m = LinearMachine::jadot_table_i();
        LinearMachine {
            stator_resistance_ohm: r_s * m.stator_resistance_ohm,
            rotor_resistance_ohm: r_r * m.rotor_resistance_ohm,
            stator_inductance_h: l * m.stator_inductance_h,
            rotor_inductance_h: l * m.rotor_inductance_h,
            mutual_inductance_h: l * m.mutual_inductance_h,
            inertia_kg_m2: j * m.inertia_kg_m2,
            ..m
        }
    })
}

/// What an observer is built on, with limits that nothing here reaches.
fn basis(m: &LinearMachine, h: f64, flux_max_vs: f64) -> Basis<f64> {
    let machine = modelled(m);
    let rating = Rating::guess(machine.parameters(), m.pole_pairs);
    let limits = Limits {
        flux_max_vs,
        flux_min_vs: 1e-9,
        current_max_a: 1e9,
        voltage_max_v: 1e9,
        speed_max_rad_s: top_speed(m),
        ..Limits::of(&machine, &rating)
    };
    Basis::try_new(&machine, &rating, h).unwrap().with_limits(limits).unwrap()
}

fn rows<const R: usize>(m: &Matrix<f64>) -> [[f64; 2]; R] {
    std::array::from_fn(|r| [m[(r, 0)], m[(r, 1)]])
}

/// A machine at constant speed on the orbit that turns by θ per sample of forward Euler: flux, current and voltage at the start.
struct Orbit {
    flux: C,
    current: C,
    voltage: C,
    turn: f64,
}

impl Orbit {
    fn new(c: &Constants<f64>, h: f64, speed: f64, frequency: f64, flux: f64) -> Self {
        let (turn, flux) = (h * frequency, C::new(flux, 0.0));
        let s = (unit(turn) - 1.0) / h;
        let a = C::new(-c.eta, c.n_p * speed);
        let current = flux * (s - a) / c.eta_l_m;
        let voltage = (current * (s + c.gamma) + flux * a * c.beta) / c.inverse_sigma_l_s;
        Self { flux, current, voltage, turn }
    }

    /// Flux and current at sample `k`, and the voltage that led there.
    fn at(&self, k: usize) -> (C, C, C) {
        let now = unit(self.turn * k as f64);
        (self.flux * now, self.current * now, self.voltage * now * unit(-self.turn))
    }
}

/// Errors of flux and current, and the estimate of the speed.
type Seen = ([C; 2], f64);

/// Errors (flux, current), speed estimate, sample by sample, seen from the flux. The first current is lost on purpose: an observer by
/// forward Euler needs the one before.
fn errors<O: Observer<f64>>(observer: &O, orbit: &Orbit, mut state: O::State, samples: usize) -> Vec<Seen> {
    let mut seen = Vec::new();
    for k in 1..samples {
        let (flux, current, voltage) = orbit.at(k);
        let input = if k == 1 { Input::lost(voltage) } else { Input::new(voltage, current) };
        let e = observer.step(&mut state, &input);
        let back = unit(-orbit.turn * k as f64);
        if k > 3 {
            seen.push(([(flux - e.rotor_flux_vs) * back, e.residual_a * back], e.omega_m));
        }
    }
    seen
}

fn flat(e: &[C; 2]) -> [f64; 4] {
    [e[0].re, e[0].im, e[1].re, e[1].im]
}

/// Continuous machine at constant speed over a sample under a held voltage.
fn advance(c: &Constants<f64>, x: &mut [f64; 5], u: C, h: f64) {
    let n = (20.0 * h * c.gamma.max(500.0)).ceil();
    let speed = x[0];
    for _ in 0..n as u32 {
        im_lab::observer_error::rk4(x, h / n, |x| {
            let mut d = model::derivative(c, x, [u.re, u.im], 0.0);
            d[0] = 0.0;
            d
        });
        x[0] = speed;
    }
}

fn frozen(gain: &Matrix<f64>, slope: &Matrix<f64>) -> KubotaGains {
    KubotaGains {
        gain: rows(gain),
        gain_per_speed: rows(slope),
        proportional: 0.0,
        integral: im_model::Bound::SMALLEST,
        fade_a: 0.0,
    }
}

fn adaptive(gains: &im_design::kubota_loop::LoopGains) -> KubotaGains {
    let frozen = frozen(&gains.gain, &gains.gain_per_speed);
    KubotaGains { proportional: gains.proportional, integral: gains.integral, ..frozen }
}

proptest! {
    #![proptest_config(cases(2))]

    /// `kubota` (short steps) and `sampled` (every sample of its own): the observer, its speed held at the machine's.
    #[test]
    fn kubotas_flux_and_current_errors(m in machine(), at in -1.0..1.0f64, slip in -2.0..2.0f64, start in prop::array::uniform4(-1.0..1.0f64)) {
        let plant = DesignModel::Machine(m);
        let c = plant.constants::<f64>();
        let speed = at * top_speed(&m);
        let error = |i: usize| C::new(start[i], start[i + 1]);
        let run = |gains, h: f64, samples| {
            let orbit = Orbit::new(&c, h, speed, c.n_p * speed + slip * c.eta, 0.9);
            let observer = Kubota::discretized(basis(&m, h, 10.0), gains, Discretization::ForwardEuler).unwrap();
            let state = observer.state_at(orbit.flux + error(0) * 0.1, orbit.current + error(2) * 0.1 * c.beta, speed);
            errors(&observer, &orbit, state, samples)
        };
        let sampled = design(Kind::Sampled, plant, &region(Kind::Sampled, &m)).unwrap();
        let Design::Sampled(d) = &sampled.design else { unreachable!() };
        let sizes: Vec<f64> = run(frozen(&d.gain, &d.gain_per_speed), d.period_s, 400).iter().map(|(e, _)| size(&d.p, &flat(e))).collect();
        for pair in sizes.windows(2) {
            decays(pair, d.contraction, 0.0)?;
        }
        let continuous = design(Kind::Kubota, plant, &region(Kind::Kubota, &m)).unwrap();
        let Design::Kubota(d) = &continuous.design else { unreachable!() };
        // By the trapezoidal rule, two observers: their distance has no part of what the rule does to the machine's turning.
        let h = (0.02 / linalg::spectral_radius(&d.error_matrix(&c, speed))).clamp(1e-6, 1e-4);
        let orbit = Orbit::new(&c, h, speed, c.n_p * speed + slip * c.eta, 0.9);
        let observer = Kubota::try_new(basis(&m, h, 10.0), frozen(&d.gain, &d.gain_per_speed)).unwrap();
        let run = |off: [C; 2]| errors(&observer, &orbit, observer.state_at(orbit.flux + off[0], orbit.current + off[1], speed), 3000);
        let (one, other) = (run([C::new(0.0, 0.0); 2]), run([error(0) * 0.1, error(2) * 0.1 * c.beta]));
        let apart = |(a, b): (&Seen, &Seen)| size(&d.p, &flat(&[b.0[0] - a.0[0], b.0[1] - a.0[1]]));
        let sizes: Vec<f64> = one.iter().zip(&other).map(apart).collect();
        decays(&sizes, (-d.rate_per_s * h).exp(), 0.02)?;
    }

    /// `kubota-loop`, sampled and (at short steps) continuous: the adaptive observer near its machine, the speed law at work.
    #[test]
    fn the_adaptive_loop(m in near_jadots(), at in prop::array::uniform2(0.0..1.0f64), start in prop::array::uniform5(-1.0..1.0f64)) {
        let plant = DesignModel::Machine(m);
        let c = plant.constants::<f64>();
        let text = "speed_rad_s = [8.0, 20.0]\nslip_rad_s = [-8.0, 8.0]\nflux_vs = 0.9\nproportional = 0.05\nintegral = 20.0\nrho = 0.2";
        let run = |gains: &im_design::kubota_loop::LoopGains, p: &Matrix<f64>, flux: f64, h: f64, [speed, slip]: [f64; 2], samples| -> Vec<f64> {
            // Small: what is proven is the linearized loop. What is left of the rest is a millionth.
            let small = 1e-6;
            let orbit = Orbit::new(&c, h, speed, c.n_p * speed + slip, flux);
            let observer = Kubota::discretized(basis(&m, h, 1.2 * flux), adaptive(gains), Discretization::ForwardEuler).unwrap();
            let off = |i: usize| C::new(start[i], start[i + 1]) * small;
            let state = observer.state_at(orbit.flux + off(0), orbit.current + off(2) * c.beta, speed + start[4] * small * c.eta);
            let seen = errors(&observer, &orbit, state, samples);
            let state = |(e, omega): &Seen| {
                let epsilon = -c.n_p * c.beta * flux * e[1].im;
                let z = (omega - speed - gains.proportional * epsilon) / gains.integral;
                let [a, b, i, j] = flat(e);
                size(p, &[a, b, i, j, z])
            };
            seen.iter().map(state).collect()
        };
        let between = |[low, high]: [f64; 2], x: f64| low + x * (high - low);
        let continuous = design(Kind::KubotaLoop, plant, text).unwrap();
        let Design::KubotaLoop(d) = &continuous.design else { unreachable!() };
        let point = [between(d.speed_rad_s, at[0]), between(d.slip_rad_s, at[1])];
        let inside = |r: [f64; 2], x: f64| r[0] <= x && x <= r[1];
        let cell = d.cells.iter().find(|cell| inside(cell.speed_rad_s, point[0]) && inside(cell.slip_rad_s, point[1])).unwrap();
        let h = 2e-6;
        decays(&run(&d.gains, &cell.p, d.flux_vs, h, point, 3000), (-cell.rate_per_s * h).exp(), 0.05)?;
        let period = Period::At(5e-5);
        let sampled = design_sampled(Kind::KubotaLoop, plant, text, period).unwrap();
        let Design::SampledKubotaLoop(d) = &sampled.design else { unreachable!() };
        let h = d.period_s;
        let frequency = c.n_p * point[0] + point[1];
        let sampled_slip = 2.0 / h * (0.5 * h * frequency).tan() - c.n_p * point[0];
        let cell = d.cells.iter().find(|cell| inside(cell.speed_rad_s, point[0]) && inside(cell.sampled_slip_rad_s, sampled_slip)).unwrap();
        decays(&run(&d.gains, &cell.p, d.flux_vs, h, point, 1000), cell.contraction, 1e-3)?;
    }

    /// `derdiyok`: with the layer of its period the current error enters it, per sample by hβδ and within ‖s(0)‖/(βδ), and stays.
    #[test]
    fn derdiyoks_current_error(m in machine(), at in -1.0..1.0f64, slip in -2.0..2.0f64, start in prop::array::uniform2(-1.0..1.0f64), h in 5e-6..5e-5f64) {
        let plant = DesignModel::Machine(m);
        let c = plant.constants::<f64>();
        let h = h.min(0.2 / c.gamma);
        let text = region(Kind::Derdiyok, &m).replace("reserve = 1.0", "reserve = 20.0");
        let made = design_sampled(Kind::Derdiyok, plant, &text, Period::At(h)).unwrap();
        let Design::SampledDerdiyok(d) = &made.design else { unreachable!() };
        let speed = at * d.continuous.speed_max_rad_s;
        let orbit = Orbit::new(&c, h, speed, c.n_p * speed + slip * c.eta, 0.95 * d.continuous.flux_max_vs);
        let gains = DerdiyokGains { nu0: d.continuous.nu0, boundary_layer_a: d.boundary_layer_a, filter_rad_s: 0.0, anchor_per_s: 0.0 };
        let observer = Derdiyok::discretized(basis(&m, h, 10.0), gains, Discretization::ForwardEuler).unwrap();
        let off = C::new(start[0], start[1]) * 5.0 * d.boundary_layer_a;
        let state = observer.state_at(orbit.flux, orbit.current + off, speed);
        let samples = 50 + (off.norm() / (c.beta * d.continuous.reserve * h)) as usize;
        let seen = errors(&observer, &orbit, state, samples);
        let turned = |k: usize| seen[k].0[1] * unit(orbit.turn * (k + 4) as f64);
        let step = h * c.beta * d.continuous.reserve * (1.0 - 1e-9);
        for k in 1..seen.len() {
            let (before, now) = (turned(k - 1), turned(k));
            for (before, now) in [(before.re.abs(), now.re.abs()), (before.im.abs(), now.im.abs())] {
                prop_assert!(now <= (before - step).max(d.boundary_layer_a), "{before} {now} layer {}", d.boundary_layer_a);
            }
        }
        let last = turned(seen.len() - 1);
        prop_assert!(last.re.abs().max(last.im.abs()) <= d.boundary_layer_a, "it never came in");
    }

    /// `utkin`, on the machine in continuous time: outside its layer |s| falls every sample, inside it stays, while the errors are those of the region.
    #[test]
    fn utkins_surface(m in machine(), at in -1.0..1.0f64, slip in -1.0..1.0f64, start in prop::array::uniform4(-1.0..1.0f64), h in 2e-6..2e-5f64) {
        let plant = DesignModel::Machine(m);
        let c = plant.constants::<f64>();
        let h = h.min(0.05 / c.gamma);
        let made = design_sampled(Kind::Utkin, plant, &region(Kind::Utkin, &m), Period::At(h)).unwrap();
        let Design::SampledUtkin(d) = &made.design else { unreachable!() };
        let r = &d.continuous.region;
        let flux = 0.5 * (r.flux_min_vs + d.flux_max_vs);
        // A speed whose voltage is within the region's.
        let speed = 0.6 * at * r.speed_max_rad_s;
        let (_, mut x) = im_lab::observer_error::steady_voltage(&c, speed, slip * c.eta, flux, 0.0);
        let gains = UtkinGains { omega0_rad_s: d.continuous.omega0_rad_s, boundary_layer_avs: d.boundary_layer_avs, filter_rad_s: 0.0 };
        let observer = Utkin::discretized(basis(&m, h, d.flux_max_vs), gains, Discretization::ForwardEuler).unwrap();
        let off = C::new(start[0], start[1]) * 0.3 * r.flux_error_max_vs;
        let error = C::new(start[2], start[3]) * 0.6 * r.current_error_max_a;
        let mut state = observer.state_at(C::new(x[1], x[2]) + off, C::new(x[3], x[4]) + error, speed);
        let (mut before, mut checked): (Option<f64>, usize) = (None, 0);
        for k in 0..400 {
            let (u, _) = im_lab::observer_error::steady_voltage(&c, speed, slip * c.eta, flux, h * (f64::from(k) + 0.5));
            let u = C::new(u[0], u[1]);
            advance(&c, &mut x, u, h);
            let (truth, i) = (C::new(x[1], x[2]), C::new(x[3], x[4]));
            let input = if k == 0 { Input::lost(u) } else { Input::new(u, i) };
            let e = observer.step(&mut state, &input);
            let s = cross(e.rotor_flux_vs, -e.residual_a);
            if let (Some(before), true) = (before, k > 2) {
                prop_assert!(s.abs() <= before.max(d.boundary_layer_avs) * (1.0 + 1e-12), "{before} {s} layer {}", d.boundary_layer_avs);
                checked += 1;
            }
            let size = e.rotor_flux_vs.norm();
            let inside = (truth - e.rotor_flux_vs).norm() <= r.flux_error_max_vs
                && e.residual_a.norm() <= r.current_error_max_a
                && (r.flux_min_vs..=d.flux_max_vs).contains(&size)
                && i.norm() <= r.current_max_a
                && u.norm() <= d.voltage_max_v;
            before = inside.then_some(s.abs());
        }
        prop_assert!(checked > 20, "{checked} samples inside the region");
    }

    /// `thau`: where the states are so small that u₂ has the certified Lipschitz constant, the distance of machine and observer only falls.
    #[test]
    fn thaus_error_where_its_bound_holds(m in machine(), start in prop::array::uniform5(-1.0..1.0f64), off in prop::array::uniform5(-1.0..1.0f64)) {
        let plant = DesignModel::Machine(m);
        let c = plant.constants::<f64>();
        let h = 2e-5_f64.min(0.2 / c.gamma);
        let made = design_sampled(Kind::Thau, plant, "slack = 0.01", Period::At(h)).unwrap();
        let Design::SampledThau(d) = &made.design else { unreachable!() };
        // ‖Δu₂‖ ≤ 2r‖e‖ for states within r in every coordinate: each entry of the Jacobian of u₂ is one of them.
        let r = 0.2 * d.lipschitz;
        let mut x: [f64; 5] = start.map(|s| 0.5 * r * s);
        let observer = Thau::discretized(basis(&m, h, 10.0), ThauGains { gain: rows(&d.gain) }, LoadTorqueModel::Proportional { coefficient_nm_s_per_rad: 0.0 }, Discretization::ForwardEuler).unwrap();
        let y: [f64; 5] = std::array::from_fn(|k| x[k] + 0.1 * r * off[k]);
        let mut state = observer.state_at(C::new(y[1], y[2]), C::new(y[3], y[4]), y[0]);
        let mut before: Option<f64> = None;
        for k in 0..500 {
            let f = model::derivative(&c, &x, [0.0; 2], 0.0);
            x = std::array::from_fn(|k| x[k] + h * f[k]);
            let i = C::new(x[3], x[4]);
            let input = if k == 0 { Input::lost(C::new(0.0, 0.0)) } else { Input::new(C::new(0.0, 0.0), i) };
            let e = observer.step(&mut state, &input);
            let flux = C::new(x[1], x[2]) - e.rotor_flux_vs;
            let error = [x[0] - e.omega_m, flux.re, flux.im, e.residual_a.re, e.residual_a.im];
            let estimate = [x[0] - error[0], x[1] - error[1], x[2] - error[2], x[3] - error[3], x[4] - error[4]];
            let now = size(&d.p, &error);
            if let (Some(before), true) = (before, k > 2) {
                prop_assert!(now <= d.contraction * before * (1.0 + 1e-9), "{before:e} {now:e}");
            }
            let small = x.iter().chain(&estimate).all(|s| s.abs() <= 0.4 * d.lipschitz);
            before = small.then_some(now);
        }
    }

    /// `thau-box`: the observer in the frame of its own flux, on the machine at constant speed.
    #[test]
    fn the_box_observers_error(m in machine(), start in prop::array::uniform5(-1.0..1.0f64), at in prop::array::uniform2(0.3..0.7f64)) {
        // Without friction a load equal to the torque keeps the speed, in the observer as in the machine: with it, the observer slows
        // down beside a machine that is held, and both leave the box.
        let m = LinearMachine { viscous_friction_n_m_s: 0.0, ..m };
        let plant = DesignModel::Machine(m);
        let c = plant.constants::<f64>();
        let made = design(Kind::ThauBox, plant, &region(Kind::ThauBox, &m)).unwrap();
        let Design::ThauBox(d) = &made.design else { unreachable!() };
        let between = |[low, high]: [f64; 2], x: f64| low + x * (high - low);
        let (frame, slip) = (between(d.region.frame_rad_s, at[0]), between(d.region.slip_rad_s, at[1]));
        let (speed, flux) = ((frame - slip) / c.n_p, 0.95);
        let gains = ThauBoxGains { frame_rad_s: d.region.frame_rad_s, gain: rows(&d.gain), gain_per_frame_speed: rows(&d.gain_per_frame_speed) };
        let fast = (&d.gain + &d.gain_per_frame_speed.scaled(&frame)).norm() + c.gamma + frame;
        let h = (0.1 / fast).clamp(1e-6, 2e-5);
        let observer = Thau::in_box(basis(&m, h, 2.0), gains, LoadTorqueModel::EqualToTorque).unwrap();
        let (_, mut x) = im_lab::observer_error::steady_voltage(&c, speed, slip, flux, 0.0);
        // Two observers: their distance has no part of what holding the voltage costs. Small, so that the mean is the machine.
        let small = [0.01 * c.eta / c.n_p, 1e-3, 1e-3, 1e-3 * c.beta, 1e-3 * c.beta];
        let off: [f64; 5] = std::array::from_fn(|k| small[k] * start[k]);
        let state = |off: [f64; 5]| observer.state_at(C::new(x[1] + off[1], x[2] + off[2]), C::new(x[3] + off[3], x[4] + off[4]), speed + off[0]);
        let mut states = [state([0.0; 5]), state(off)];
        let samples = ((3.0 / d.rate_per_s / h) as usize).clamp(200, 20_000);
        let mut sizes = Vec::new();
        for k in 0..samples {
            let (u, _) = im_lab::observer_error::steady_voltage(&c, speed, slip, flux, h * (k as f64 + 0.5));
            let u = C::new(u[0], u[1]);
            advance(&c, &mut x, u, h);
            let i = C::new(x[3], x[4]);
            let input = if k == 0 { Input::lost(u) } else { Input::new(u, i) };
            let [a, b] = [0, 1].map(|n| observer.step(&mut states[n], &input));
            let d_axis = a.rotor_flux_vs / a.rotor_flux_vs.norm();
            let (dl, di) = ((a.rotor_flux_vs - b.rotor_flux_vs) * d_axis.conj(), (b.residual_a - a.residual_a) * d_axis.conj());
            if k > 2 {
                sizes.push(size(&d.p, &[a.omega_m - b.omega_m, dl.re, dl.im, di.re, di.im]));
            }
        }
        decays(&sizes, (-d.rate_per_s * h).exp(), 0.05)?;
    }

    /// `thau-box`, sampled: every sample the error of the observer's own step falls by the certified factor, on a machine stepped alike.
    #[test]
    fn the_sampled_box_observers_error(m in machine(), start in prop::array::uniform5(-1.0..1.0f64), at in prop::array::uniform2(0.3..0.7f64)) {
        let plant = DesignModel::Machine(m);
        let c = plant.constants::<f64>();
        let h = 2e-5_f64.min(0.2 / c.gamma);
        let text = region(Kind::ThauBox, &m) + &format!("\nrate_per_s = {}", 0.2 * c.eta);
        let made = match design_sampled(Kind::ThauBox, plant, &text, Period::At(h)) {
            // Not every machine has a gain over the whole box at this period.
            Err(DesignError::Infeasible { .. }) => return Err(TestCaseError::reject("no sampled gain over the box")),
            made => made.unwrap(),
        };
        let Design::SampledThauBox(d) = &made.design else { unreachable!() };
        let between = |[low, high]: [f64; 2], x: f64| low + x * (high - low);
        let (frame, slip) = (between(d.region.frame_rad_s, at[0]), between(d.region.slip_rad_s, at[1]));
        let gains = ThauBoxGains { frame_rad_s: d.region.frame_rad_s, gain: rows(&d.gain), gain_per_frame_speed: rows(&d.gain_per_frame_speed) };
        // A load torque that is the machine's own: its speed falls with friction alone.
        let observer = Thau::in_box_discretized(basis(&m, h, 2.0), gains, LoadTorqueModel::EqualToTorque, Discretization::ForwardEuler).unwrap();
        let (_, x) = im_lab::observer_error::steady_voltage(&c, (frame - slip) / c.n_p, slip, 0.95, 0.0);
        let (mut omega, mut lambda, mut i) = (x[0], C::new(x[1], x[2]), C::new(x[3], x[4]));
        // Small beside the slips of the box, as a current error turns the frame by what the gain makes of it.
        let wide = [0.01 * c.eta / c.n_p, 2e-3, 1e-3, 1e-3 * c.beta, 1e-3 * c.beta];
        let off: [f64; 5] = std::array::from_fn(|k| wide[k] * start[k]);
        let mut hat = (omega + off[0], lambda + C::new(off[1], off[2]), i + C::new(off[3], off[4]));
        let mut state = observer.state_at(hat.1, hat.2, hat.0);
        let seen = |hat: &(f64, C, C), omega: f64, lambda: C, i: C| {
            let d_axis = (hat.1 / hat.1.norm()).conj();
            let (dl, di) = ((hat.1 - lambda) * d_axis, (hat.2 - i) * d_axis);
            [hat.0 - omega, dl.re, dl.im, di.re, di.im]
        };
        let inside = |[low, high]: [f64; 2], x: f64| low <= x && x <= high;
        let mut checked = 0;
        for k in 0..400 {
            // The voltage that keeps the machine on its circle.
            let w = C::new(0.0, c.n_p * omega + slip);
            let a = C::new(-c.eta, c.n_p * omega);
            let u = (i * (w + c.gamma) + lambda * a * c.beta) / c.inverse_sigma_l_s;
            let before = (seen(&hat, omega, lambda, i), hat, omega, lambda);
            let (rate_lambda, rate_i) = (lambda * a + i * c.eta_l_m, i * w);
            // The machine at the end of the sample needs the frame that the observer takes: it keeps its flux on the d axis.
            let e = {
                let mut ahead = state;
                observer.step(&mut ahead, &Input::new(u, i))
            };
            let frame = (e.rotor_flux_vs * hat.1.conj()).arg() / h;
            let step = |z: C, rate: C| (z + (rate - z * C::new(0.0, frame)) * h) * unit(frame * h);
            (lambda, i) = (step(lambda, rate_lambda), step(i, rate_i));
            omega *= 1.0 - h * c.friction_rate;
            let e = observer.step(&mut state, &Input::new(u, i));
            hat = (e.omega_m, e.rotor_flux_vs, i - e.residual_a);
            let (was, hat_was, omega_was, lambda_was) = before;
            let mean = ((lambda_was + hat_was.1) * (hat_was.1 / hat_was.1.norm()).conj() * 0.5, 0.5 * (omega_was + hat_was.0));
            // The first sample has no current measured at its beginning.
            if k > 0 && inside(d.region.frame_rad_s, frame) && inside(d.region.slip_rad_s, frame - c.n_p * mean.1)
                && inside(d.region.flux_d_vs, mean.0.re) && inside(d.region.flux_q_vs, mean.0.im)
            {
                let (now, then) = (size(&d.p, &seen(&hat, omega, lambda, i)), size(&d.p, &was));
                prop_assert!(now <= d.contraction * then * (1.0 + 1e-9) + 1e-12, "{k}: {then:e} {now:e} factor {}", d.contraction);
                checked += 1;
            }
        }
        prop_assert!(checked > 20, "{checked} samples inside the box");
    }
}
