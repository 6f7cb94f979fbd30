//! Stability of the observer: eigenvalues of the error dynamics, written anew in the inverse-Γ form and linearised by differences, and of the real step.

use super::*;
use im_model::machines::{ALL, JADOT_TABLE_I, MOTULATOR_2_2_KW, NamedMachine};
use im_model::space_vector::unit;
use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;

type C = Complex<f64>;
type Vector<const N: usize> = SVector<f64, N>;

fn machine(m: &NamedMachine) -> Machine<f64> {
    Machine::base(m.parameters(), m.pole_pairs).unwrap()
}

/// A steady state: inverse-Γ parameters, flux, and how field and slip turn (electrical rad/s).
#[derive(Clone, Copy, Debug)]
struct Point {
    r_s: f64,
    r_r: f64,
    l_sigma: f64,
    l_m: f64,
    flux: f64,
    omega_s: f64,
    slip: f64,
}

impl Point {
    fn of(m: &NamedMachine, omega_s: f64, slip: f64) -> Self {
        let g = m.parameters().inverse_gamma();
        let c = m.parameters().windings().derived(m.pole_pairs);
        Self {
            r_s: g.stator_resistance_ohm,
            r_r: g.rotor_resistance_ohm,
            l_sigma: g.leakage_inductance_h,
            l_m: g.magnetizing_inductance_h,
            flux: m.rating.rotor_flux_vs * c.beta * c.sigma_l_s,
            omega_s,
            slip,
        }
    }

    /// (ψ̂_s, ψ̂_R, n_pω̂, R̂_s) of the machine itself, in the frame of its flux.
    fn right(&self) -> Vector<6> {
        let i = self.current();
        let psi_s = i * self.l_sigma + self.flux;
        Vector::from([psi_s.re, psi_s.im, self.flux, 0.0, self.omega_s - self.slip, self.r_s])
    }

    fn current(&self) -> C {
        C::new(self.r_r / self.l_m, self.slip) * self.flux / self.r_r
    }

    /// The equations at the head of the file in the frame that turns with ω_s, where machine and voltage stand still.
    fn rates(&self, g: &FullOrderGains, x: &Vector<6>) -> Vector<6> {
        let (psi_s, psi_r, omega, r_s) = (C::new(x[0], x[1]), C::new(x[2], x[3]), x[4], x[5]);
        let (i, turn, alpha) = (self.current(), C::new(0.0, self.omega_s), self.r_r / self.l_m);
        let u = i * self.r_s + turn * (i * self.l_sigma + self.flux);
        let e = i - (psi_s - psi_r) / self.l_sigma;
        let a = C::new(-alpha, omega);
        let along = psi_r / psi_r.norm();
        let (e_d, e_q, i_q) = ((e * along.conj()).re, (e * along.conj()).im, (i * along.conj()).im);
        let omega_s = omega + self.r_r * i_q / psi_r.norm();
        let b = g.flux_damping_per_s + g.flux_damping_per_frequency * omega_s.abs();
        let lambda = g.current_bandwidth_rad_s;
        let g_s = a.inv() * (-self.l_sigma * lambda * b);
        let g_r = g_s - C::new(lambda, omega) * self.l_sigma;
        let d_s = u - i * r_s + g_s * e - turn * psi_s;
        let d_r = i * self.r_r + a * psi_r + g_r * e - turn * psi_r;
        let d_omega = -g.speed_bandwidth_rad_s.powi(2) * self.l_sigma * e_q / psi_r.norm();
        let k = g.stator_resistance_per_s;
        let high = (omega_s / g.stator_resistance_frequency_rad_s).powi(4);
        let rate = k * omega_s.powi(2) / (omega_s.powi(2) + 8.0 * b * k) / (1.0 + high);
        let seen = i_q / (i_q * i_q + g.stator_resistance_current_a.powi(2));
        let d_r_s = -rate * e_d * self.l_sigma * (lambda + alpha) * omega_s / (2.0 * alpha) * seen;
        Vector::from([d_s.re, d_s.im, d_r.re, d_r.im, d_omega, d_r_s])
    }

    /// Poles of the error about the machine.
    fn poles(&self, g: &FullOrderGains) -> Vec<C> {
        let x = self.right();
        let scale = Vector::<6>::from([self.flux, self.flux, self.flux, self.flux, 100.0, self.r_s]);
        let a = SMatrix::<f64, 6, 6>::from_fn(|row, column| {
            let mut d = Vector::zeros();
            d[column] = 1e-5 * scale[column];
            (self.rates(g, &(x + d)) - self.rates(g, &(x - d)))[row] / (2e-5 * scale[row])
        });
        let with_r_s: Vec<C> = a.complex_eigenvalues().iter().copied().collect();
        if g.stator_resistance_per_s > 0.0 {
            return with_r_s;
        }
        a.fixed_view::<5, 5>(0, 0).into_owned().complex_eigenvalues().iter().copied().collect()
    }
}

fn slowest(poles: &[C]) -> f64 {
    poles.iter().map(|p| p.re).fold(f64::NEG_INFINITY, f64::max)
}

fn without_stator_law(g: FullOrderGains) -> FullOrderGains {
    FullOrderGains { stator_resistance_per_s: 0.0, ..g }
}

/// The machine is where the observer stands still.
#[test]
fn the_machine_is_an_equilibrium() {
    for m in ALL {
        let p = Point::of(&m, 20.0, -8.0);
        let g = FullOrderGains::for_machine(&machine(&m), &m.rating);
        let x = p.right();
        assert!(p.rates(&g, &x).amax() < 1e-9 * (1.0 + p.omega_s * x.amax()), "{}", m.name);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, ..ProptestConfig::default() })]

    /// Complete stability: any machine, any gains, any speed and load, motoring and regenerating, but for zero stator frequency.
    #[test]
    fn every_pole_decays_at_every_speed_and_load(
        which in 0..ALL.len(), size in -1.0..1.0f64, omega_s in -600.0..600.0f64, low in any::<bool>(), slip in -60.0..60.0f64,
        lambda in 1.0..3.5f64, omega_n in 0.5..3.0f64, b_0 in -1.0..2.5f64, b_1 in 0.0..2.0f64,
    ) {
        let ten = |x: f64| 10f64.powf(x);
        let omega_s = if low { 0.01 * omega_s } else { omega_s };
        prop_assume!(omega_s.abs() > 0.02);
        let m = &ALL[which];
        let p = Point { r_r: Point::of(m, 0.0, 0.0).r_r * ten(0.3 * size), ..Point::of(m, omega_s, slip) };
        let g = FullOrderGains {
            current_bandwidth_rad_s: ten(lambda),
            speed_bandwidth_rad_s: ten(omega_n),
            flux_damping_per_s: ten(b_0),
            flux_damping_per_frequency: b_1,
            stator_resistance_per_s: 0.0,
            ..FullOrderGains::for_machine(&machine(m), &m.rating)
        };
        let poles = p.poles(&g);
        // Differences leave 1e-9 of the fastest pole.
        let fastest = poles.iter().map(|p| p.norm()).fold(0.0, f64::max);
        prop_assert!(slowest(&poles) < 1e-9 * fastest, "{p:?} {poles:?}");
    }
}

/// With the usual gains the flux error decays no slower than the observer of reduced order, s² + bs + ω_s², by a half.
#[test]
fn the_usual_gains_decay_as_the_reduced_order_does() {
    for m in ALL {
        let g = without_stator_law(FullOrderGains::for_machine(&machine(&m), &m.rating));
        let rated = std::f64::consts::TAU * m.rating.electrical_frequency_hz;
        for share in [0.01, 0.03, 0.1, 0.3, 1.0] {
            for slip in [-10.0, -3.0, 0.0, 3.0, 10.0] {
                let (omega_s, b) = (share * rated, g.flux_damping_per_s + g.flux_damping_per_frequency * share * rated);
                let reduced = if b > 2.0 * omega_s { 0.5 * (b - (b * b - 4.0 * omega_s * omega_s).sqrt()) } else { 0.5 * b };
                let got = -slowest(&Point::of(&m, omega_s, slip).poles(&g));
                assert!(got > 0.5 * reduced, "{} at {omega_s} slip {slip}: {got} {reduced}", m.name);
            }
        }
    }
}

/// Electrical, rad/s.
fn rated_slip(m: &NamedMachine) -> f64 {
    let p = Point::of(m, 0.0, 0.0);
    m.rating.torque_nm * p.r_r / (1.5 * f64::from(m.pole_pairs) * p.flux.powi(2))
}

/// With the law for R_s, too: under torque all poles decay, without it R̂_s stands still.
#[test]
fn the_stator_law_is_stable_in_all_quadrants() {
    for m in ALL {
        let g = FullOrderGains::for_machine(&machine(&m), &m.rating);
        for omega_s in [0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0] {
            for load in [-1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5] {
                for sign in [1.0, -1.0] {
                    let poles = Point::of(&m, sign * omega_s, load * rated_slip(&m)).poles(&g);
                    assert!(slowest(&poles) < 1e-5, "{} at {omega_s}, load {load}: {poles:?}", m.name);
                }
            }
        }
    }
}

/// One sample of the real step about a steady state, seen from the frame that turns with it: (λ̂, î, ω̂, R̂_s).
fn sampled(m: &NamedMachine, p: &Point, gains: FullOrderGains, h: f64) -> SMatrix<f64, 6, 6> {
    let known = machine(m);
    let basis = Basis::<f64>::try_new(&known, &m.rating, h).unwrap();
    let observer = FullOrder::try_new(basis, gains).unwrap();
    let c = known.parameters().windings().derived(m.pole_pairs);
    let lambda = p.flux / (c.beta * c.sigma_l_s);
    let (i, n_p) = (p.current(), f64::from(m.pole_pairs));
    let turn = unit(p.omega_s * h);
    let middle = unit(0.5 * p.omega_s * h);
    // The mean voltage that keeps the steady state as the rule sees it: chosen so that the observer's own step stays.
    let u = (i * p.r_s + C::new(0.0, p.omega_s) * (i * p.l_sigma + p.flux)) * middle;
    let scale = [lambda, lambda, i.norm(), i.norm(), 100.0, 1.0];
    let step = |x: [f64; 6]| {
        let mut s = FullOrderState {
            lambda: C::new(x[0], x[1]),
            i_hat: C::new(x[2], x[3]),
            omega_m: x[4] / n_p,
            stator: x[5],
            watch: Watch::from_current(i),
        };
        observer.step(&mut s, &Input::new(u, i * turn));
        let (l, c) = (s.lambda * turn.conj(), s.i_hat * turn.conj());
        [l.re, l.im, c.re, c.im, n_p * s.omega_m, s.stator]
    };
    let right = [lambda, 0.0, i.re, i.im, p.omega_s - p.slip, 1.0];
    SMatrix::from_fn(|row, column| {
        let d = 1e-5 * scale[column];
        let at = |d: f64| {
            let mut x = right;
            x[column] += d;
            step(x)[row]
        };
        (at(d) - at(-d)) / (2e-5 * scale[row])
    })
}

/// The step's poles are e^{hs} of the continuous ones within the error of the rule, and inside the unit circle.
#[test]
fn the_sampled_poles_are_those_of_the_continuous_observer() {
    for m in [MOTULATOR_2_2_KW, JADOT_TABLE_I] {
        let gains = FullOrderGains::for_machine(&machine(&m), &m.rating);
        for (omega_s, slip) in [(10.0, 8.0), (10.0, -8.0), (-60.0, 5.0), (250.0, -5.0), (-2.0, -3.0)] {
            let p = Point::of(&m, omega_s, slip);
            for h in [5e-5, 1e-4, 2e-4] {
                let z: Vec<C> = sampled(&m, &p, gains, h).complex_eigenvalues().iter().copied().collect();
                assert!(z.iter().all(|z| z.norm() < 1.0), "{} {p:?} {h}: {z:?}", m.name);
                for s in p.poles(&gains) {
                    let wanted = (s * h).exp();
                    let off = z.iter().map(|z| (z - wanted).norm()).fold(f64::INFINITY, f64::min) / h;
                    // The speed law is explicit: half a sample late.
                    let bound = 0.02 * s.norm() + 1.5 * h * gains.speed_bandwidth_rad_s.powi(2) + 0.2;
                    assert!(off < bound, "{} {p:?} {h}: {s} off by {off} of {bound}", m.name);
                }
            }
        }
    }
}

#[test]
fn gains_out_of_bounds_and_steps_too_long_are_refused() {
    let m = MOTULATOR_2_2_KW;
    let usual = FullOrderGains::for_machine(&machine(&m), &m.rating);
    let basis = |h| Basis::<f32>::try_new(&machine(&m), &m.rating, h).unwrap();
    assert!(FullOrder::try_new(basis(1e-4), usual).is_ok());
    for bad in [f64::NAN, -1.0, 0.0, f64::INFINITY] {
        for k in 0..3 {
            let mut g = usual;
            *[&mut g.current_bandwidth_rad_s, &mut g.speed_bandwidth_rad_s, &mut g.flux_damping_per_s][k] = bad;
            assert!(FullOrder::try_new(basis(1e-4), g).is_err(), "{g:?}");
        }
    }
    let fast = FullOrderGains { speed_bandwidth_rad_s: 700.0, ..usual };
    let e = FullOrder::try_new(basis(1e-3), fast).unwrap_err();
    assert!(matches!(e, ObserverError::StepTooLong { .. }) && e.to_string().contains("speed_bandwidth_rad_s"), "{e}");
}

proptest! {
    /// No less at any sampling time, machine, speed and load: the poles of the real step are inside the unit circle, up to a field that turns by a radian in a sample.
    #[test]
    fn the_sampled_observer_is_stable(which in 0..ALL.len(), h in -5.0..-2.3f64, turn in -1.0..1.0f64, load in -1.5..1.5f64) {
        let (m, h) = (&ALL[which], 10f64.powf(h));
        let slip = load * rated_slip(m);
        let rated = std::f64::consts::TAU * m.rating.electrical_frequency_hz;
        let omega_s = turn * (1.0 / h).min(1.4 * rated);
        prop_assume!(omega_s.abs() > 1.0);
        let usual = FullOrderGains::for_machine(&machine(m), &m.rating);
        // The speed law as slow as the sampling time asks for.
        let most = (0.7 * usual.current_bandwidth_rad_s / h).sqrt();
        let gains = FullOrderGains { speed_bandwidth_rad_s: usual.speed_bandwidth_rad_s.min(most), ..without_stator_law(usual) };
        let p = Point::of(m, omega_s, slip);
        let z: Vec<C> = sampled(m, &p, gains, h).fixed_view::<5, 5>(0, 0).into_owned().complex_eigenvalues().iter().copied().collect();
        prop_assert!(z.iter().all(|z| z.norm() < 1.0), "{} {p:?} {h}: {z:?}", m.name);
    }
}

/// The voltage held over the samples bends the current between them; the observer knows, whatever the share of a turn that a sample takes: the trapezoidal rule in place of
/// the machine's own flow is (ω_sT)²/8 off in the flux, 1.2 % at 50 Hz and 1 ms.
#[test]
fn a_machine_in_step_is_where_the_observer_stands_at_any_ratio() {
    use im_model::{Bench, PlantInput, State};
    for m in [MOTULATOR_2_2_KW, JADOT_TABLE_I] {
        let known = machine(&m);
        let gains = without_stator_law(FullOrderGains::for_machine(&known, &m.rating));
        for (hertz, h) in [(50.0, 1e-4), (95.0, 1e-4), (50.0, 5e-4), (25.0, 1e-3), (50.0, 1e-3), (95.0, 1e-3)] {
            let (omega_s, parts) = (std::f64::consts::TAU * hertz, 50);
            let p = Point::of(&m, omega_s, 5.0);
            let speed = (omega_s - 5.0) / f64::from(m.pole_pairs);
            // Above the rated frequency there is no more voltage than that.
            let most = 1.2 * m.rating.phase_voltage_peak_v;
            let size = (p.current() * p.r_s + C::new(0.0, omega_s) * (p.current() * p.l_sigma + p.flux)).norm().min(most);
            let observer = FullOrder::try_new(Basis::try_new(&known, &m.rating, h).unwrap(), gains).unwrap();
            let mut bench = Bench::new(&known, State::turning(speed), h / f64::from(parts));
            let mut state = FullOrderState::default();
            for k in 0..(3.0 / h) as u32 {
                let u = unit((f64::from(k) + 0.5) * omega_s * h) * size;
                for _ in 0..parts {
                    bench.advance(&PlantInput { imposed_speed: Some([speed; 2]), ..PlantInput::new(u, 0.0) });
                }
                let (i_s, flux) = (bench.output().i_s, bench.state().psi_r);
                let time_s = h * f64::from(k);
                if time_s < 1.5 {
                    state = observer.state_at(flux, i_s, speed);
                    continue;
                }
                let e = observer.step(&mut state, &Input::new(u, i_s));
                // From Padé's quotient: (ω_sT)⁴/720 of what the leakage takes.
                let allowed = 1e-6 + 0.02 * (omega_s * h).powi(4);
                let off = (e.rotor_flux_vs - flux).norm() / flux.norm();
                assert!(
                    off < allowed && (e.omega_m - speed).abs() < allowed * speed,
                    "{} {hertz} {h}: {off} {}",
                    m.name,
                    e.omega_m
                );
            }
        }
    }
}
