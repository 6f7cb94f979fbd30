//! Each loop on its own plant answers as its equation says; typical gains and limits are what their documentation says.

use im_control::*;
use im_model::machines::ALL;
use im_model::simulation::Controller;
use im_model::{Complex, Machine};

type C = Complex<f64>;
const ZERO: C = C::new(0.0, 0.0);

/// Equal within a relative tolerance.
fn near(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * a.abs().max(b.abs())
}

mod current {
    use super::*;

    // Sampled so fast (aT = 0.004) that the loop is the continuous one within half a percent.
    const T: f64 = 1e-5;
    const A: f64 = 400.0;
    const L: f64 = 0.02;
    const R: f64 = 3.0;

    /// The current over time in a frame that turns at 100 rad/s: L di/dt = u − R i − jω_s L i − e − d, `d` unknown to the regulator.
    fn run(wanted: C, emf: C, disturbance: C, dc_voltage_v: f64, duration_s: f64) -> Vec<C> {
        let regulator = CurrentRegulator { bandwidth_rad_s: A, leakage_inductance_h: L, resistance_ohm: R, voltage_delay_s: 0.0 };
        let frame = Turning { direction: C::new(1.0, 0.0), omega_s: 100.0, dc_voltage_v, sample_time_s: T, overmodulates: false };
        let (mut i, mut x) = (ZERO, ZERO);
        (0..(duration_s / T) as usize)
            .map(|_| {
                let u = regulator.step(&mut x, &frame, wanted, i, emf).unwrap().u;
                i += (u - i * R - i * C::new(0.0, 100.0 * L) - emf - disturbance) * (T / L);
                i
            })
            .collect()
    }

    #[test]
    fn the_current_comes_as_a_first_order_lag_of_its_bandwidth() {
        let wanted = C::new(3.0, -8.0);
        let i = run(wanted, C::new(10.0, 60.0), ZERO, 0.0, 0.02);
        for t in [0.5 / A, 1.0 / A, 3.0 / A] {
            let expected = wanted * (1.0 - (-A * t).exp());
            let got = i[(t / T) as usize - 1];
            assert!((got - expected).norm() < 0.005 * wanted.norm(), "{t}: {got} {expected}");
        }
    }

    /// i = −(d/L) t e^{−at}: what is not known is damped as fast as what is asked for comes.
    #[test]
    fn an_unknown_voltage_is_driven_out_with_a_double_pole() {
        let d = C::new(20.0, 5.0);
        let i = run(ZERO, ZERO, d, 0.0, 0.02);
        for t in [0.5 / A, 1.0 / A, 3.0 / A] {
            let expected = -d * (t / L * (-A * t).exp());
            assert!((i[(t / T) as usize - 1] - expected).norm() < 0.01 * d.norm() / (L * A), "{t}");
        }
    }

    #[test]
    fn a_limited_voltage_winds_nothing_up() {
        let wanted = C::new(0.0, 12.0);
        // 60 V: the lag would ask for aLi* = 96 V; 12 A take 43 V in the end.
        let i = run(wanted, ZERO, ZERO, 60.0 * 3f64.sqrt(), 0.06);
        let most = i.iter().map(|i| i.im).fold(0.0, f64::max);
        assert!(most < 12.5 && (i[i.len() - 1] - wanted).norm() < 0.1, "{most} {}", i[i.len() - 1]);
        // 60 V drive 6.2 A through R and L within 1/a, of the 7.6 A of the lag.
        assert!(i[(1.0 / A / T) as usize].im < 6.8, "{}", i[(1.0 / A / T) as usize]);
    }

    /// dx/dt = a²L_σ (i* − i) + a (ū − u).
    #[test]
    fn the_integral_takes_back_what_the_link_does_not_give() {
        let regulator = CurrentRegulator { bandwidth_rad_s: A, leakage_inductance_h: L, resistance_ohm: R, voltage_delay_s: 0.0 };
        let frame =
            Turning { direction: C::new(1.0, 0.0), omega_s: 100.0, dc_voltage_v: 100.0, sample_time_s: T, overmodulates: false };
        let (wanted, i, emf, before) = (C::new(9.0, -30.0), C::new(2.0, 1.0), C::new(4.0, 20.0), C::new(-1.0, 7.0));
        let mut x = before;
        let out = regulator.step(&mut x, &frame, wanted, i, emf).unwrap();
        let asked = (wanted - i) * (A * L) - i * (A * L - R) + i * C::new(0.0, 100.0 * L) + emf + before;
        assert!(out.limited && near(out.wanted_v, asked.norm(), 1e-12) && out.u.norm() < 100.0 / 3f64.sqrt());
        let expected = before + ((wanted - i) * (A * A * L) + (out.u - asked) * A) * T;
        assert!((x - expected).norm() < 1e-12, "{x} {expected}");
    }

    /// A voltage held over a sample that begins a delay later stands in the middle of it where it was asked for; d goes before q.
    #[test]
    fn a_voltage_is_turned_ahead_and_kept_within_the_link() {
        let direction = C::from_polar(1.0, 0.4);
        let frame = Turning { direction, omega_s: 300.0, dc_voltage_v: 540.0, sample_time_s: 1e-4, overmodulates: false };
        let u = C::new(-50.0, 200.0);
        let free = frame.to_stator(u, 2e-4);
        assert!(!free.limited && free.u == u && near(free.wanted_v, u.norm(), 1e-12));
        assert!((free.u_s - u * C::from_polar(1.0, 0.4 + 300.0 * 2.5e-4)).norm() < 1e-6 * u.norm());
        let cut = frame.to_stator(C::new(-250.0, 400.0), 2e-4);
        assert!(cut.limited && near(cut.u.re, -250.0, 1e-12) && near(cut.u.norm(), 540.0 / 3f64.sqrt(), 1e-3), "{cut:?}");
        assert!(near(cut.u_s.norm(), cut.u.norm(), 1e-9) && near(cut.wanted_v, 250f64.hypot(400.0), 1e-12));
    }
}

/// dψ/dt = a(u_max/|ω| − ψ): the limit settles where the voltage meets its share of the link, at the rate a.
#[test]
fn flux_gives_way_to_the_voltage_at_its_rate() {
    let law = FieldWeakening { bandwidth_per_s: 20.0, voltage_share: 0.9 };
    let (t, dc) = (1e-4, 540.0);
    let u_max = 0.9 * dc / 3f64.sqrt();
    for sign in [1.0, -1.0] {
        let omega = sign * 2.0 * u_max;
        let mut flux = 1.0;
        for k in 1..=5000 {
            let asked = omega.abs() * flux;
            law.step(&mut flux, 1.0, asked, omega, dc, t);
            let expected = 0.5 + 0.5 * (-20.0 * t * f64::from(k)).exp();
            assert!(near(flux, expected, 2e-3), "{k}: {flux} {expected}");
        }
    }
    // At standstill it comes back at a·ψ/0.3 and stops where it is wanted; however fast the field, a twentieth stays.
    let mut flux = 0.5;
    law.step(&mut flux, 1.0, 0.0, 0.0, dc, t);
    assert!(near(flux, 0.5 + 20.0 * t / 0.3, 1e-12), "{flux}");
    let after = |omega: f64| {
        (0..20_000).fold(0.5, |mut flux: f64, _| {
            let asked = omega * flux;
            law.step(&mut flux, 1.0, asked, omega, dc, t)
        })
    };
    assert_eq!((after(0.0), after(1e5)), (1.0, 0.05));
    // Without a link there is no limit.
    let mut flux = 0.1;
    assert_eq!((law.step(&mut flux, 0.8, 1e4, 300.0, 0.0, t), flux), (0.8, 0.8));
}

/// A load torque shows as (T/J) t e^{−at}; a differentiable reference is followed as if there were no loop.
#[test]
fn a_load_step_shows_at_the_double_pole_of_the_speed_loop() {
    let (a, j, t) = (30.0, 0.05, 1e-5);
    let regulator = SpeedRegulator { bandwidth_rad_s: a, inertia_kg_m2: j };
    let (mut integral, mut omega) = (0.0, 0.0);
    for k in 0..40_000 {
        let time = f64::from(k) * t;
        let wanted = Shaped { speed: 100.0 * time, rate: 100.0, second: 0.0 };
        let torque = regulator.step(&mut integral, &wanted, omega, 100.0, t);
        omega += (torque - 6.0) / j * t;
        let now = time + t;
        let expected = -6.0 / j * now * (-a * now).exp();
        // The deepest is T/(Jae) = 1.47 rad/s.
        assert!((omega - 100.0 * now - expected).abs() < 0.005, "{time}: {} {expected}", omega - 100.0 * now);
    }
    // Half a second at its limit: the torque winds little up: the speed overshoots by 3 % at most, not by half as without ū − u.
    let (mut integral, mut omega, mut most) = (0.0, 0.0, 0.0f64);
    for _ in 0..100_000 {
        omega += regulator.step(&mut integral, &Shaped::at(100.0), omega, 10.0, t) / j * t;
        most = most.max(omega);
    }
    assert!(most < 103.0 && near(omega, 100.0, 1e-3), "{most} {omega}");
}

/// Around a controller that gives the torque it is asked for: from the speed that there is, along the shaped reference, within the torque
/// that it was given; what else is asked for goes through.
#[test]
fn a_speed_loop_asks_its_inner_controller_for_the_torque() {
    use im_model::simulation::{Command, Measured, Reference};
    struct Gives;
    impl Controller<f64> for Gives {
        fn step(&mut self, _: &Measured<f64>, r: &Reference<f64>) -> Command<f64> {
            Command::Current(C::new(r.torque_nm, r.rotor_flux_vs))
        }
    }
    let (j, t) = (0.05, 1e-4);
    let regulator = SpeedRegulator { bandwidth_rad_s: 30.0, inertia_kg_m2: j };
    let shaper = ReferenceShaper { bandwidth_rad_s: 100.0, acceleration_max_rad_s2: 200.0 };
    let mut speed = SpeedLoop::try_new(&regulator, &shaper, 15.0, Gives).unwrap();
    let mut omega = 60.0;
    let (mut most, mut last) = (0.0f64, 0.0);
    for k in 0..20_000 {
        let load = if k < 12_000 { 0.0 } else { 4.0 };
        let m = Measured { i_s: ZERO, omega_m: omega, u_s: ZERO, dc_voltage_v: 540.0, sample_time_s: t };
        let Command::Current(given) = speed.step(&m, &Reference { omega_m: 160.0, rotor_flux_vs: 0.7, torque_nm: -99.0 }) else {
            panic!("currents")
        };
        assert_eq!(given.im, 0.7);
        last = given.re;
        if k < 12_000 {
            most = most.max(last);
        }
        omega += (last - load) / j * t;
    }
    // 200 rad/s² on 0.05 kg m² are 10 Nm; in the end the load is carried.
    assert!((9.9..10.2).contains(&most) && near(omega, 160.0, 1e-4) && near(last, 4.0, 1e-3), "{most} {omega} {last}");
}

/// τ̂ = T(1 − (1 + at)e^{−at}), its rate with it, friction known.
#[test]
fn a_load_step_is_estimated_at_the_double_pole_of_the_observer() {
    let (a, j, d, t) = (80.0, 0.03, 0.02, 1e-5);
    let observer = LoadTorqueObserver { inertia_kg_m2: j, viscous_friction_nm_s_per_rad: d, bandwidth_per_s: a, limit_nm: 50.0 };
    let (mut state, mut omega) = (LoadTorqueEstimate::default(), 100.0);
    observer.step(&mut state, 2.0, omega, t);
    for k in 1..10_000 {
        omega += (2.0 - d * omega - 12.0) / j * t;
        observer.step(&mut state, 2.0, omega, t);
        let x = a * t * f64::from(k);
        let (expected, rate) = (12.0 * (1.0 - (1.0 + x) * (-x).exp()), 12.0 * a * x * (-x).exp());
        assert!((state.torque_nm - expected).abs() < 0.05, "{k}: {} {expected}", state.torque_nm);
        assert!((state.rate_nm_per_s - rate).abs() < 0.01 * 12.0 * a, "{k}: {} {rate}", state.rate_nm_per_s);
    }
    let capped = LoadTorqueObserver { limit_nm: 5.0, ..observer };
    let mut state = LoadTorqueEstimate::default();
    for _ in 0..10_000 {
        capped.step(&mut state, 0.0, 0.0, t);
        capped.step(&mut state, 100.0, 0.0, t);
    }
    assert_eq!(state.torque_nm, 5.0);
}

/// x = r(1 − (1 + ω_n t)e^{−ω_n t}) where the acceleration allows it, a ramp of it where not; the derivatives belong to the speed.
#[test]
fn a_reference_is_shaped_by_a_critically_damped_filter() {
    let (w, t) = (50.0, 1e-5);
    let free = ReferenceShaper { bandwidth_rad_s: w, acceleration_max_rad_s2: 1e6 };
    let (mut x, mut before) = (Shaped::at(20.0), Shaped::at(20.0));
    for k in 1..20_000 {
        free.step(&mut x, 120.0, t);
        let y = w * t * f64::from(k);
        assert!((x.speed - 20.0 - 100.0 * (1.0 - (1.0 + y) * (-y).exp())).abs() < 0.05, "{k}: {x:?}");
        assert!(near(x.speed - before.speed, x.rate * t, 1e-6) && near(x.rate - before.rate, x.second * t, 1e-6), "{k}");
        before = x;
    }
    let slow = ReferenceShaper { acceleration_max_rad_s2: 200.0, ..free };
    let mut x = Shaped::at(0.0);
    for _ in 0..20_000 {
        slow.step(&mut x, -120.0, t);
    }
    // 0.2 s at 200 rad/s², less the 1/ω_n·... that the filter takes to reach it: next to nothing.
    assert!(near(x.speed, -40.0, 0.01) && x.rate == -200.0, "{x:?}");
}

fn data() -> impl Iterator<Item = (MachineData<f64>, im_model::Rating)> {
    ALL.into_iter().map(|m| {
        let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
        (MachineData::of(&machine, 17.0).delayed(1e-4), m.rating)
    })
}

/// Torque that the current gives at a flux, all of it across: ³⁄₂ n_p (L_m/L_r) λ i.
fn torque_max(m: &MachineData<f64>, flux: f64) -> f64 {
    1.5 * f64::from(m.pole_pairs) * m.windings.mutual_inductance_h / m.windings.rotor_inductance_h * flux * m.current_max_a
}

#[test]
fn generous_limits_are_multiples_of_what_the_machine_can_do() {
    for (m, rating) in data() {
        let speed = rating.synchronous_speed_rad_s(m.pole_pairs);
        let flux = rating.rotor_flux_vs;
        let l = DriveLimits::generous(&m, speed, flux);
        let k_r = m.windings.mutual_inductance_h / m.windings.rotor_inductance_h;
        for (got, wanted) in [
            (l.current_range_a, 4.0 * 17.0),
            (l.overcurrent_a, 1.5 * 17.0),
            (l.speed_max_rad_s, 3.0 * speed),
            (l.speed_range_rad_s, 4.5 * speed),
            (l.rotor_flux_max_vs, 1.3 * flux),
            (l.torque_max_nm, torque_max(&m, flux)),
            // Full speed in 50 ms, full torque in 5 ms.
            (l.speed_slew_rad_s2 * 0.05, l.speed_max_rad_s),
            (l.torque_slew_nm_per_s * 0.005, l.torque_max_nm),
            // Three times the back-emf of rated flux at rated speed.
            (l.voltage_max_v, 3.0 * speed * f64::from(m.pole_pairs) * flux * k_r.max(1.0)),
        ] {
            assert!(near(got, wanted, 1e-12), "{got} {wanted}");
        }
    }
}

/// 200 µs of sampling and delay: the current loop at 0.15 over it, the others in their proportion to it, at most what is said.
#[test]
fn typical_gains_of_field_orientation_leave_room_between_the_loops() {
    for (m, rating) in data() {
        let flux = rating.rotor_flux_vs;
        let slow = FieldOrientedGains::typical(&m, flux, 1e-3);
        let current = 0.15 / 1.1e-3;
        assert!(near(slow.current_bandwidth_rad_s, current, 1e-12));
        for (got, wanted) in [
            (slow.flux_bandwidth_rad_s, current / 20.0),
            (slow.speed_bandwidth_rad_s, current / 20.0),
            (slow.reference.bandwidth_rad_s, current / 10.0),
            (slow.reference.acceleration_max_rad_s2, 0.8 * torque_max(&m, flux) / m.windings.inertia_kg_m2),
        ] {
            assert!(near(got, wanted, 1e-12), "{got} {wanted}");
        }
        let fast = FieldOrientedGains::typical(&m.delayed(0.0), flux, 1e-5);
        let got =
            [fast.current_bandwidth_rad_s, fast.flux_bandwidth_rad_s, fast.speed_bandwidth_rad_s, fast.reference.bandwidth_rad_s];
        assert_eq!(got, [2000.0, 30.0, 40.0, 100.0]);
    }
}

/// s² + (k_p + R_s + R_req)/L_f s + k_p k_i/L_f of the current loop and s² + κφ²k_p (s + k_i) of the speed loop have a damping of 1/√2.
#[test]
fn typical_gains_of_jadot_place_the_poles_of_both_loops() {
    for (m, rating) in data() {
        let w = &m.windings;
        let k = w.mutual_inductance_h / w.rotor_inductance_h;
        let (r, l_f) =
            (w.stator_resistance_ohm + k * k * w.rotor_resistance_ohm, w.stator_inductance_h - k * w.mutual_inductance_h);
        // 0.15 over sampling time and delay of 100 µs, unless the resistances alone damp more: sampled slowly, they do.
        let free = 1.5 * r / (2f64.sqrt() * l_f);
        for (sample_time_s, wanted) in [(1e-4, 750f64.max(free)), (9.9e-3, 15f64.max(free))] {
            let g = JadotGains::typical(&m, rating.rotor_flux_vs, sample_time_s);
            let current = (l_f.recip() * g.current_proportional_ohm * g.current_integral_per_s).sqrt();
            assert!(near(current, wanted, 1e-12), "{current}");
            assert!(near((g.current_proportional_ohm + r) / l_f, 2f64.sqrt() * current, 1e-12));
        }
        let g = JadotGains::typical(&m, rating.rotor_flux_vs, 1e-4);
        let current = (l_f.recip() * g.current_proportional_ohm * g.current_integral_per_s).sqrt();
        let n_p = f64::from(m.pole_pairs);
        let kappa_flux2 =
            1.5 * n_p * n_p / w.inertia_kg_m2 * (k * rating.rotor_flux_vs).powi(2) / (k * k * w.rotor_resistance_ohm);
        let speed = (kappa_flux2 * g.speed_proportional * g.speed_integral_per_s).sqrt();
        assert!(near(kappa_flux2 * g.speed_proportional, 2f64.sqrt() * speed, 1e-12));
        assert!(near(speed, (current / 40.0).min(25.0).min(0.6 * r / l_f), 1e-12), "{speed}");
    }
}

/// ṡ = −b k s/Φ inside the layers: the rate 0.2 over sampling time and delay.
#[test]
fn typical_layers_of_kenne_decay_at_the_rate_that_sampling_allows() {
    for (m, rating) in data() {
        let flux = rating.rotor_flux_vs;
        let g = KenneGains::typical(&m, flux, 540.0, 1e-4);
        let c = m.windings.derived(m.pole_pairs);
        let (b_omega, b_lambda) = (c.mu * flux / c.sigma_l_s, 2.0 * c.eta_l_m * flux / c.sigma_l_s);
        assert!(
            near(b_omega * g.k_sq / g.boundary_omega, 1000.0, 1e-12)
                && near(b_lambda * g.k_sd / g.boundary_lambda, 1000.0, 1e-12)
        );
        assert_eq!((g.k_sq, g.k_sd, g.c_omega, g.c_lambda), (54.0, 54.0, 40.0, 30.0));
        assert!(near(g.reference.acceleration_max_rad_s2, 0.8 * torque_max(&m, flux) / m.windings.inertia_kg_m2, 1e-12));
    }
}

/// 1.1 ms of sampling and delay: everything goes with the rate 0.2 over it; sampled fast it is at most what is said.
#[test]
fn typical_gains_of_kenne_go_with_the_sampling() {
    for (m, rating) in data() {
        let flux = rating.rotor_flux_vs;
        let rate = 0.2 / 1.1e-3;
        let list = |sample_time_s: f64, m: &MachineData<f64>| {
            let g = KenneGains::typical(m, flux, 540.0, sample_time_s);
            [
                g.c_omega,
                g.c_lambda,
                g.equivalent_bandwidth_per_s,
                g.load_bandwidth_per_s,
                g.reference.bandwidth_rad_s,
                g.magnetizing_bandwidth_rad_s,
                g.load_limit_nm,
            ]
        };
        let load = 1.5 * torque_max(&m, flux);
        let slow = [rate / 20.0, rate / 20.0, rate / 10.0, rate / 10.0, rate / 10.0, 0.15 / 1.1e-3, load];
        let fast = [40.0, 30.0, 150.0, 100.0, 100.0, 2000.0, load];
        for (got, wanted) in [(list(1e-3, &m), slow), (list(1e-5, &m.delayed(0.0)), fast)] {
            assert!(got.iter().zip(wanted).all(|(a, b)| near(*a, b, 1e-12)), "{got:?} {wanted:?}");
        }
    }
}

/// k ≥ (F + η)/b_min + |1 − b_max/b_min| |v̂| makes s s' ≤ −η|s| whatever b, b̂ within the bounds and |f̂ − f| ≤ F are: (23) to (25).
#[test]
fn the_switching_gain_reaches_the_surface_for_every_uncertainty_it_covers() {
    let (uncertainty, reach, b, v) = (30.0, 5.0, [2.0, 3.0], 12.0);
    let k = im_control::kenne::switching_gain(uncertainty, reach, b, v);
    let mut worst = f64::NEG_INFINITY;
    for b_true in b {
        for b_hat in b {
            for f_error in [-uncertainty, uncertainty] {
                for v_hat in [-v, v] {
                    // s' = f − f̂ + (b/b̂ − 1) b̂v̂ … with the voltage v̂ − k sign(s) for s > 0, v̂ made by b̂.
                    let rate = f_error + (b_true - b_hat) * v_hat - b_true * k;
                    worst = worst.max(rate);
                }
            }
        }
    }
    assert!(worst <= -reach + 1e-9, "{worst}");
    // Not much more than needed, either.
    assert!(worst > -reach - 1.0 * (b[1] - b[0]) * v, "{worst}");
}

#[test]
fn machine_data_survive_single_precision() {
    for (m, _) in data() {
        let back = m.cast::<f32>().cast::<f64>();
        let w = |m: &MachineData<f64>| {
            let w = &m.windings;
            [
                w.stator_resistance_ohm,
                w.rotor_resistance_ohm,
                w.stator_inductance_h,
                w.rotor_inductance_h,
                w.mutual_inductance_h,
                w.inertia_kg_m2,
                w.viscous_friction_nm_s_per_rad,
                m.current_max_a,
                m.voltage_delay_s,
            ]
        };
        assert!(w(&m).iter().zip(w(&back)).all(|(a, b)| near(*a, b, 1e-7)) && m.pole_pairs == back.pole_pairs);
    }
}

/// The torque asked for is within the law's range or it is said; the current it takes is within the limit or it is said.
#[test]
fn the_drive_of_least_current_says_what_is_beyond_it() {
    let (m, _) = data().next().unwrap();
    let law = MtpaLaw::kwon_printed();
    let step = |torque_nm: f64, current_max_a: f64| {
        let m = MachineData { current_max_a, ..m };
        let mut drive = Mtpa::try_new(&m, &law, &MtpaGains::typical(&m)).unwrap();
        let measured =
            im_model::simulation::Measured { i_s: ZERO, omega_m: 50.0, u_s: ZERO, dc_voltage_v: 540.0, sample_time_s: 1e-4 };
        drive.step(&measured, &im_model::simulation::Reference { omega_m: 0.0, rotor_flux_vs: 0.0, torque_nm });
        drive.status()
    };
    let [_, high] = law.torque_nm;
    for sign in [1.0, -1.0] {
        assert_eq!(step(sign * 0.9 * high, 1e6), DriveStatus::OK);
        assert_eq!(step(sign * 1.1 * high, 1e6), DriveStatus::REFERENCE_LIMITED);
        assert_eq!(step(sign * 0.9 * high, 1.0), DriveStatus::CURRENT_LIMITED);
    }
}
