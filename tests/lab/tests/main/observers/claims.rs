//! What the paper claims of each observer, where its assumption holds and where it does not.

use im_design::kubota::{KubotaRequest, closed_form};
use im_design::matrix::Matrix;
use im_design::{DesignModel, LinearMachine, kubota_loop, sliding, thau_box};
use im_lab::observation::{C, Truth, basis, held, machine, scenario, volts_per_hertz};
use im_model::machines::{JADOT_TABLE_I, KWON_TABLE_IV, MOTULATOR_2_2_KW, NamedMachine};
use im_model::simulation::{Profile, Scenario};
use im_model::space_vector::{cross, unit};
use im_model::{BaseParameter, Machine, ParameterId};
use im_observers::*;
use proptest::prelude::*;

const H: f64 = 1e-4;
const MACHINES: [NamedMachine; 3] = [KWON_TABLE_IV, JADOT_TABLE_I, MOTULATOR_2_2_KW];

/// The design crate's machine with the parameters that an observer derives its constants from.
fn plant(m: &Machine<f64>) -> DesignModel {
    let w = m.parameters().windings();
    DesignModel::Machine(LinearMachine {
        stator_resistance_ohm: w.stator_resistance_ohm,
        rotor_resistance_ohm: w.rotor_resistance_ohm,
        stator_inductance_h: w.stator_inductance_h,
        rotor_inductance_h: w.rotor_inductance_h,
        mutual_inductance_h: w.mutual_inductance_h,
        pole_pairs: m.pole_pairs(),
        inertia_kg_m2: w.inertia_kg_m2,
        viscous_friction_n_m_s: w.viscous_friction_nm_s_per_rad,
    })
}

fn rows<const R: usize>(m: &Matrix<f64>) -> [[f64; 2]; R] {
    core::array::from_fn(|r| [m[(r, 0)], m[(r, 1)]])
}

/// In steady state at rated flux, an imposed speed and slip.
fn steady(m: &NamedMachine, speed: f64, slip: f64, duration_s: f64) -> Truth {
    Truth::of(&machine(m), &held(m, speed, slip, duration_s))
}

mod kubota {
    use super::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// (3) with ω̂ = ω: eᵀPe falls at the certified rate, sampled at 100 µs, whatever the error, speed and machine.
        #[test]
        fn flux_error_decays_at_the_certified_rate(which in 0..3usize, speed in -150.0..150.0f64, angle in 0.0..6.3f64, size in 0.01..0.3f64) {
            let m = MACHINES[which];
            let machine = machine(&m);
            let c = machine.parameters().windings().derived(2);
            let request = KubotaRequest { speed_rad_s: [-190.0, 190.0], rate_per_s: 0.5 * c.eta, flux_weight: c.beta * c.beta };
            let (design, _) = closed_form(plant(&machine), &request).unwrap();
            // A speed law so weak that ω̂ stays where it is put.
            let gains = KubotaGains { gain: rows(&design.gain), gain_per_speed: rows(&design.gain_per_speed), proportional: 0.0, integral: im_model::Bound::SMALLEST, fade_a: 0.0 };
            let truth = steady(&m, speed, 3.0, 0.6);
            let observer = Kubota::try_new(basis(&m, H), gains).unwrap();
            let first = truth.at(0.3);
            let state = observer.state_at(truth.flux[first] + unit(angle) * size, truth.recording.i_s[first], speed);
            let estimates = truth.observe_from(&observer, first + 1, state);
            // ‖e‖_P with P = diag(β², β², 1, 1).
            let norm = |k: usize| {
                let e = &estimates[k];
                (truth.flux[first + 1 + k] - e.rotor_flux_vs).norm().hypot(e.residual_a.norm() / c.beta)
            };
            let (begin, end) = (norm(0), norm(estimates.len() - 1));
            let t = H * (estimates.len() - 1) as f64;
            // Held input against a turning one costs an error floor of (hω)²/12 of the flux, 3e-4 λ at 190 rad/s.
            prop_assert!(end <= begin * (-request.rate_per_s * t).exp() + 1e-3, "{begin} {end}");
        }
    }

    /// V = |e|² + Δω²/α with ω̂' = αε falls as −eᵀQe if λ_aλ̂_b = λ̂_aλ_b, (5). Its derivative has the term 2n_pΔω λ × λ̂ besides.
    fn slope(c: &im_model::DerivedConstants<f64>, omega: f64, omega_hat: f64, lambda: C, e: [C; 2], l: [C; 2]) -> f64 {
        let lambda_hat = lambda - e[0];
        let a = C::new(-c.eta, c.n_p * omega);
        let push = C::new(0.0, c.n_p * (omega_hat - omega)) * lambda_hat;
        let de = [a * e[0] + (c.eta_l_m - l[0]) * e[1] - push, -a * c.beta * e[0] - (c.gamma + l[1]) * e[1] + push * c.beta];
        // (1/α)(Δω²)' = 2Δω ω̂'/α with the published law.
        let epsilon = -c.n_p * c.beta * cross(lambda_hat, e[1]);
        2.0 * (e[0].conj() * de[0] + e[1].conj() * de[1]).re + 2.0 * (omega_hat - omega) * epsilon
    }

    proptest! {
        /// With collinear fluxes and the gain of (3) the claim is right, for every machine, speed and error.
        #[test]
        fn lyapunov_function_falls_where_fluxes_are_collinear(
            which in 0..3usize, omega in -190.0..190.0f64, delta in -50.0..50.0f64, lambda in 0.1..1.2f64, share in -1.0..1.0f64,
            ia in -20.0..20.0f64, ib in -20.0..20.0f64,
        ) {
            let c = machine(&MACHINES[which]).parameters().windings().derived(2);
            // l₁ = ηL_m + β(η + jn_pω): the closed form at the true speed.
            let l = [C::new(c.eta_l_m + c.beta * c.eta, c.beta * c.n_p * omega), C::new(0.0, 0.0)];
            let (flux, e) = (C::new(lambda, 0.0), [C::new(lambda * share, 0.0), C::new(ia, ib)]);
            let q = 2.0 * c.eta * e[0].norm_sqr() + 2.0 * c.gamma * e[1].norm_sqr();
            let got = slope(&c, omega, omega + delta, flux, e, l);
            prop_assert!((got + q).abs() <= 1e-9 * (q + 1.0) * (1.0 + c.beta * delta.abs()), "{got} {q}");
        }
    }

    /// Where (5) fails: λ̂ 30° behind λ, no current error, ω̂ too high by 5 rad/s. V grows, with the very gain of (3).
    #[test]
    fn collinearity_assumption_fails_counterexample() {
        let c = machine(&KWON_TABLE_IV).parameters().windings().derived(2);
        let lambda = C::new(0.9, 0.0);
        let e = [lambda - lambda * unit(-30f64.to_radians()), C::new(0.0, 0.0)];
        let l = [C::new(c.eta_l_m + c.beta * c.eta, c.beta * c.n_p * 20.0), C::new(0.0, 0.0)];
        let up = slope(&c, 20.0, 25.0, lambda, e, l);
        let down = slope(&c, 20.0, 15.0, lambda, e, l);
        let extra = 2.0 * c.n_p * 5.0 * cross(lambda, lambda - e[0]).abs();
        assert!(up.max(down) > 0.0, "{up} {down}");
        assert!((up - down).abs() > 1.99 * extra * 0.99, "the term that was assumed away: {extra}");
    }

    /// Regenerating at low frequency: without feedback the observer leaves the machine, with the stabilized gain it comes back.
    #[test]
    fn regenerating_at_low_frequency_fails_without_feedback_and_works_stabilized() {
        let m = JADOT_TABLE_I;
        let machine = machine(&m);
        // 10 rad/s, n_pω = 20, slip −14: ω_e = 6 rad/s, inside 0 < ω_e/(n_pω) < 0.625.
        let truth = steady(&m, 10.0, -14.0, 4.0);
        let (p, i) = KubotaGains::speed_law(&machine, &m.rating, 100.0);
        let first = truth.at(1.5);
        let error = |gains: KubotaGains| {
            let observer = Kubota::try_new(basis(&m, H), gains).unwrap();
            let state = observer.state_at(truth.flux[first], truth.recording.i_s[first], 10.5);
            let e = truth.observe_from(&observer, first + 1, state);
            (e[e.len() - 1].omega_m - 10.0).abs()
        };
        let without = error(KubotaGains::without_feedback(p, i));
        let stabilized = error(KubotaGains::stabilized(&machine, 0.5, p, i).unwrap());
        assert!(without > 3.0, "{without}");
        assert!(stabilized < 0.05, "{stabilized}");
    }

    /// The closed form here is the one that is certified there.
    #[test]
    fn stabilized_gain_is_the_designed_one() {
        for m in MACHINES {
            let machine = machine(&m);
            let design = kubota_loop::stabilized(plant(&machine), 0.3, 0.0, 0.05, 20.0).unwrap();
            let here = KubotaGains::stabilized(&machine, 0.3, 0.05, 20.0).unwrap();
            for (a, b) in [(rows::<4>(&design.gain), here.gain), (rows(&design.gain_per_speed), here.gain_per_speed)] {
                for (x, y) in a.iter().flatten().zip(b.iter().flatten()) {
                    assert!((x - y).abs() <= 1e-9 * (1.0 + y.abs()), "{x} {y}");
                }
            }
        }
    }
}

mod derdiyok {
    use super::*;

    /// The first estimate's residual is outside the band; does it enter it, and stay?
    fn slides(m: &NamedMachine, truth: &Truth, nu0: f64) -> bool {
        let gains = DerdiyokGains { nu0, boundary_layer_a: 0.0, filter_rad_s: 0.0, anchor_per_s: 0.0 };
        let observer = Derdiyok::try_new(basis(m, H), gains).unwrap();
        let first = truth.at(0.3);
        let state = observer.state_at(truth.flux[first], truth.recording.i_s[first] + C::new(1.0, -1.0), 0.0);
        let e = truth.observe_from(&observer, first + 1, state);
        e[e.len() / 2..].iter().all(|e| e.residual_a.norm() < 1e-6)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]

        /// ν₀ > |A_ωλ| (the corrected bound, without the extra β): the current error slides, exactly, at every speed.
        #[test]
        fn current_error_slides_above_the_bound_and_not_below(which in 0..3usize, speed in 20.0..150.0f64, slip in -4.0..4.0f64) {
            let m = MACHINES[which];
            let truth = steady(&m, speed, slip, 0.6);
            let c = machine(&m).parameters().windings().derived(2);
            let flux = truth.flux[truth.at(0.3)..].iter().map(|z| z.norm()).fold(0.0, f64::max);
            // A tenth more for the current's own ripple between samples.
            let (design, _) = sliding::derdiyok(plant(&machine(&m)), speed, 1.1 * flux, 1.0).unwrap();
            prop_assert!(slides(&m, &truth, design.nu0));
            // Each component of A_ωλ turns through its amplitude: half of it is not enough.
            prop_assert!(!slides(&m, &truth, 0.5 * flux * c.eta.hypot(c.n_p * speed)));
        }
    }

    /// As published the flux is a bare integral: an error at the start stays. The anchor takes it away at its rate.
    #[test]
    fn flux_error_stays_as_published_and_decays_with_the_anchor() {
        let m = MOTULATOR_2_2_KW;
        let truth = steady(&m, 120.0, 2.0, 1.2);
        let first = truth.at(0.6);
        let error_after = |anchor_per_s: f64| {
            let gains = DerdiyokGains { anchor_per_s, ..DerdiyokGains::published(&machine(&m), 1.5, 200.0) };
            let observer = Derdiyok::try_new(basis(&m, H), gains).unwrap();
            let off = C::new(0.05, 0.02);
            let state = observer.state_at(truth.flux[first] + off, truth.recording.i_s[first], 120.0);
            let e = truth.observe_from(&observer, first + 1, state);
            let at = |t: f64| (e[(t / H) as usize].rotor_flux_vs - truth.flux[first + 1 + (t / H) as usize]).norm() / off.norm();
            (at(0.2), at(0.5))
        };
        let (a, b) = error_after(0.0);
        assert!((a - 1.0).abs() < 0.02 && (b - 1.0).abs() < 0.02, "{a} {b}");
        let (a, b) = error_after(10.0);
        // e^{−2} and e^{−5}, averaged over turns of the field: the ripple within a turn is of the size k/ω.
        assert!((a / (-2f64).exp() - 1.0).abs() < 0.25 && b < 0.03, "{a} {b}");
    }

    /// "We have an estimate of the motor time constant": with the rotor twice as hot, the right η̂ is found, from the right flux.
    #[test]
    fn rotor_time_constant_is_estimated() {
        let m = JADOT_TABLE_I;
        let cold = machine(&m);
        let hot = cold.with(&[(ParameterId::Base(BaseParameter::RotorResistance), 1.8)]).unwrap();
        let s = scenario(&m, Profile::constant(40.0), Profile::constant(0.0), 1.5);
        let s = Scenario { imposed_speed: Some(Profile::constant(120.0)), ..s };
        let truth = Truth::of(&hot, &s);
        let gains = DerdiyokGains { filter_rad_s: 50.0, ..DerdiyokGains::published(&cold, 1.5, 200.0) };
        // The observer's η is the cold one, but for ηL_m i: give it the hot one, as the paper's equations do after adaptation.
        let hot_basis = Basis::try_new(&hot, &m.rating, H).unwrap();
        let observer = Derdiyok::try_new(hot_basis, gains).unwrap();
        let first = truth.at(1.0);
        let mut state = observer.state_at(truth.flux[first], truth.recording.i_s[first], 100.0);
        for k in first + 1..truth.len() {
            observer.step(&mut state, &truth.input(k));
        }
        let eta = state.inverse_rotor_time_constant_per_s();
        let expected = hot.parameters().windings().derived(2).eta;
        assert!((eta / expected - 1.0).abs() < 0.02, "{eta} {expected}");
    }
}

mod utkin {
    use super::*;

    fn converges(m: &NamedMachine, speed: f64, slip: f64) -> bool {
        let truth = steady(m, speed, slip, 3.5);
        let observer = Utkin::try_new(basis(m, H), UtkinGains::for_machine(&machine(m), &m.rating)).unwrap();
        let first = truth.at(1.5);
        let state = observer.state_at(truth.flux[first] * unit(0.05), truth.recording.i_s[first], speed);
        let e = truth.observe_from(&observer, first + 1, state);
        e[e.len() - 2000..].iter().all(|e| (e.omega_m - speed).abs() < 0.05 * speed.abs().max(5.0))
    }

    /// Points of the map in docs/background/observers.md: motoring everywhere, regenerating above the low frequencies only.
    #[test]
    fn converges_motoring_and_not_when_regenerating_at_low_frequency() {
        let m = JADOT_TABLE_I;
        for (speed, slip) in [(20.0, 6.0), (60.0, 6.0), (120.0, 6.0), (-60.0, -6.0), (120.0, -6.0)] {
            assert!(converges(&m, speed, slip), "{speed} {slip}");
        }
        for (speed, slip) in [(10.0, -14.0), (8.0, -8.0), (-10.0, 14.0)] {
            assert!(!converges(&m, speed, slip), "{speed} {slip}");
        }
    }
}

mod thau {
    use super::*;

    /// With the load torque equal to the estimated one and L = 0, Thau's observer is Kubota's integral law with K_I = μ/(n_pβ), to rounding.
    #[test]
    fn with_the_measured_current_it_is_kubotas_integral_law() {
        for m in [JADOT_TABLE_I, MOTULATOR_2_2_KW] {
            let c = machine(&m).parameters().windings().derived(2);
            let truth = Truth::of(&machine(&m), &volts_per_hertz(&m, 40.0, 0.3 * m.rating.torque_nm, 1.3));
            let thau = Thau::try_new(basis(&m, H), ThauGains::published(), LoadTorqueModel::Balanced).unwrap();
            let kubota = Kubota::try_new(basis(&m, H), KubotaGains::without_feedback(0.0, c.mu / (c.n_p * c.beta))).unwrap();
            for (a, b) in truth.observe(&thau).iter().zip(&truth.observe(&kubota)) {
                assert!((a.omega_m - b.omega_m).abs() < 1e-6, "{} {}", a.omega_m, b.omega_m);
            }
        }
    }

    /// Zero initial conditions and the true load law: the copy follows, as (12) with e(0) = 0 says.
    #[test]
    fn a_copy_from_the_same_state_follows() {
        let m = KWON_TABLE_IV;
        let k = 0.3;
        // τ_L = kω is more friction: the machine carries it as such.
        let p = im_model::TParameters { viscous_friction_nm_s_per_rad: 0.1 + k, ..m.parameters() };
        let loaded = Machine::base(p, 2).unwrap();
        let truth = Truth::of(&loaded, &volts_per_hertz(&m, 40.0, 0.0, 1.5));
        let thau =
            Thau::try_new(basis(&m, H), ThauGains::published(), LoadTorqueModel::Proportional { coefficient_nm_s_per_rad: k })
                .unwrap();
        let e = truth.observe(&thau);
        // Two integrators of the same equations, 100 µs: their difference through a run-up.
        assert!(truth.speed_rms(&e, 0.0) < 0.05, "{}", truth.speed_rms(&e, 0.0));
    }

    /// The gain certified over a box brings a wrong speed in at the proven rate; L = 0 with the same load law waits for friction.
    #[test]
    fn box_gain_converges_at_the_proven_rate() {
        let m = JADOT_TABLE_I;
        let machine = machine(&m);
        let region = thau_box::BoxRegion {
            frame_rad_s: [100.0, 400.0],
            slip_rad_s: [-8.0, 8.0],
            flux_d_vs: [0.8, 1.1],
            flux_q_vs: [-0.05, 0.05],
            current_d_a: [0.0; 2],
            current_q_a: [0.0; 2],
        };
        let (design, _) = thau_box::fastest(plant(&machine), &region, 30.0, 1e4).unwrap();
        let gains = ThauBoxGains {
            frame_rad_s: region.frame_rad_s,
            gain: rows(&design.gain),
            gain_per_frame_speed: rows(&design.gain_per_frame_speed),
        };
        for direction in [1.0, -1.0] {
            let truth = steady(&m, direction * 100.0, direction * 3.0, 1.6);
            let observer = Thau::in_box(basis(&m, H), gains, LoadTorqueModel::Balanced).unwrap();
            let first = truth.at(0.9);
            let state = observer.state_at(truth.flux[first], truth.recording.i_s[first], direction * 97.0);
            let e = truth.observe_from(&observer, first + 1, state);
            let error = |t: f64| (e[(t / H) as usize].omega_m - direction * 100.0).abs();
            // ‖e‖_P falls at the rate; the speed alone by a factor of P's condition less: give it 10.
            let rate = design.rate_per_s;
            assert!(rate > 10.0, "{rate}");
            assert!(error(0.5) < 10.0 * 3.0 * (-rate * 0.5).exp() + 0.01, "{} at {rate} 1/s", error(0.5));
        }
    }

    /// The gain certified for the sampling time, stepped by forward Euler in the frame of the flux: on the machine itself, either way round.
    #[test]
    fn sampled_box_gain_converges_on_the_machine_itself() {
        let m = JADOT_TABLE_I;
        let region = thau_box::BoxRegion {
            frame_rad_s: [150.0, 250.0],
            slip_rad_s: [-5.0, 5.0],
            flux_d_vs: [0.8, 1.1],
            flux_q_vs: [-0.02, 0.02],
            current_d_a: [0.0; 2],
            current_q_a: [0.0; 2],
        };
        let (design, _) = im_design::sampled::over_box(plant(&machine(&m)), &region, Some(H), 5.0).unwrap();
        let gains = ThauBoxGains {
            frame_rad_s: region.frame_rad_s,
            gain: rows(&design.gain),
            gain_per_frame_speed: rows(&design.gain_per_frame_speed),
        };
        for direction in [1.0, -1.0] {
            let truth = steady(&m, direction * 100.0, direction * 3.0, 2.4);
            let euler = Discretization::ForwardEuler;
            let observer = Thau::in_box_discretized(basis(&m, H), gains, LoadTorqueModel::Balanced, euler).unwrap();
            let first = truth.at(0.9);
            let state = observer.state_at(truth.flux[first], truth.recording.i_s[first], direction * 97.0);
            let e = truth.observe_from(&observer, first + 1, state);
            let error = (e[e.len() - 1].omega_m - direction * 100.0).abs();
            // e^(−5·1.5) of 3 rad/s, and what Euler's step does otherwise than the machine: h²ω_f² of its currents at most.
            assert!(error < 0.05, "{error} rad/s off");
        }
    }
}
