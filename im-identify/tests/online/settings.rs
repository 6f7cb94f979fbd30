//! Settings to begin from are what their documentation says, and one sample of a law is what its equation says.

use im_identify::online::{
    Adaptation, DeadZone, FollowerGains, Identifier, IdentifierStatus, KenneSettings, Lambda, RegulationParameters,
    ResistancesSettings, SchemeSettings, TimeScale, TimeVarying, Tracking, steady_regressor,
};
use im_model::machines::{ALL, JADOT_TABLE_I};
use im_model::space_vector::dot;
use im_model::{Complex, Machine};

type C = Complex<f64>;
const H: f64 = 1e-4;

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * a.abs().max(b.abs())
}

fn parameters() -> RegulationParameters<f64> {
    Machine::<f64>::base(JADOT_TABLE_I.parameters(), 2).unwrap().parameters().inverse_gamma().into()
}

/// L_f s² + (R_s + R_req + K_P)s + K_PK_I = L_f (s² + √2 ω s + ω²), or where the resistances alone damp more, K_P = 0.3 L_f ω.
#[test]
fn gains_of_a_follower_place_the_poles_of_its_current_error() {
    let p = parameters();
    let (r, l_f) = (p.stator_resistance_ohm + p.rotor_resistance_ohm, p.leakage_inductance_h);
    for omega in [50.0, 300.0, 600.0, 2000.0] {
        let g = FollowerGains::for_bandwidth(&p, 2, omega, H);
        let free = 2f64.sqrt() * omega * l_f - r;
        assert!(near(g.current_proportional_ohm, free.max(0.3 * omega * l_f)), "{omega}: {}", g.current_proportional_ohm);
        assert!(near(g.current_proportional_ohm * g.current_integral_per_s, l_f * omega * omega), "{omega}");
        assert_eq!((g.pole_pairs, g.lambda, g.sample_time_s), (2, Lambda::Scheduled, H));
    }
}

/// v_r = −(R + λ(T_r⁻¹ + jω_r))Δi; scheduled, |v_r| ≤ 2R|Δi| at any speed.
#[test]
fn the_flux_correction_is_22() {
    let (r, a, delta) = (0.9, 6.0, C::new(0.4, -0.7));
    for omega_r in [-300.0, 0.0, 40.0] {
        let coupling = C::new(a, omega_r);
        let constant = Lambda::Constant(0.02).flux_correction(r, a, omega_r, delta);
        assert!((constant + (coupling * 0.02 + r) * delta).norm() < 1e-12);
        let scheduled = Lambda::Scheduled.flux_correction(r, a, omega_r, delta);
        assert!((scheduled + (coupling * (r / coupling.norm()) + r) * delta).norm() < 1e-12);
        assert!(scheduled.norm() <= 2.0 * r * delta.norm() + 1e-12);
    }
}

/// Filters of twice the rated frequency, the range and rates in shares of the nominal resistance, (34) with three times the rated rate of
/// the rotor current and three times the resistance.
#[test]
fn settings_of_kennes_identifier_follow_from_the_rating() {
    for m in ALL {
        let w = m.parameters().windings();
        let omega = std::f64::consts::TAU * m.rating.electrical_frequency_hz;
        let rate = m.rating.torque_nm / (1.5 * f64::from(m.pole_pairs) * m.rating.rotor_flux_vs) * omega;
        let (s, r_r) = (KenneSettings::for_rating(&w, m.pole_pairs, &m.rating, H), w.rotor_resistance_ohm);
        for (got, wanted) in [
            (s.high_gain_per_s, 2.0 * omega),
            (s.sliding_gain_a_per_s2, w.derived(m.pole_pairs).beta * (3.0 * rate) * (3.0 * r_r)),
            (s.averaging_time_s, 1e-3),
            (s.rate_ohm_per_s, 2.0 * r_r),
            (s.boundary_layer_ohm, 0.1 * r_r),
            (s.range_ohm.low(), r_r / 3.0),
            (s.range_ohm.high(), 3.0 * r_r),
            (s.start_ohm, r_r),
            (s.least_rotor_current_rate_a_per_s, 0.1 * rate),
            (s.excitation_window_s, 0.5),
        ] {
            assert!(near(got, wanted), "{}: {got} {wanted}", m.name);
        }
        // A mean is over two samples at least.
        assert!(near(KenneSettings::for_rating(&w, m.pole_pairs, &m.rating, 1e-3).averaging_time_s, 2e-3));
        let (both, r_s) = (ResistancesSettings::for_rating(&w, m.pole_pairs, &m.rating, H), w.stator_resistance_ohm);
        assert!(both.rotor == s && near(both.stator_rate_ohm_per_s, r_s) && near(both.stator_boundary_layer_ohm, 0.1 * r_s));
        assert!(near(both.stator_range_ohm.low(), 0.5 * r_s) && near(both.stator_range_ohm.high(), 2.0 * r_s));
    }
}

/// A machine under load at a steady point, flux along d: (15).
fn tracking(omega_r: f64, omega_g: f64) -> Tracking<f64> {
    let p = parameters();
    let phi = C::new(0.9, 0.0);
    let i_ref = C::new(p.inverse_rotor_time_constant(), omega_g) * phi / p.rotor_resistance_ohm;
    let zero = C::new(0.0, 0.0);
    Tracking { delta_i: zero, held_v: C::new(0.8, -0.5), i_ref, i_ref_rate: zero, phi_ref: phi, omega_r, omega_g, lost: false }
}

/// (34): θ̂' = −g θ̂ BᵀK_Pη/‖B‖², relative, weighted, and no faster than if the error were all of the parameter.
#[test]
fn a_sample_of_time_scale_adaptation_is_34() {
    let p = parameters();
    let settings = SchemeSettings { weights: [1.0, 0.5, 0.0, 2.0], ..SchemeSettings::full(p, H) };
    let law = TimeScale::try_new(&settings, 0.5).unwrap();
    for held in [C::new(0.8, -0.5), C::new(900.0, 2000.0)] {
        let t = Tracking { held_v: held, ..tracking(200.0, 5.0) };
        let b = steady_regressor(&p, t.phi_ref, t.i_ref, 205.0, 5.0);
        let size: f64 = b.iter().map(|b| b.norm_sqr()).sum();
        let mut x = law.start();
        let estimate = law.step(&mut x, &t);
        assert_eq!((estimate.status, estimate.adapting), (IdentifierStatus::Adapting, [true, true, false, true]));
        for (k, b) in b.into_iter().enumerate() {
            let error = (dot(b, held) / size).clamp(-1.0, 1.0);
            let change = settings.weights[k] * error * 0.5 * p.inverse_rotor_time_constant() * H;
            let got = estimate.values[k] / p.values()[k] - 1.0;
            assert!((got - change).abs() < 1e-12, "{k}: {got} {change}");
        }
        assert_eq!(law.parameters(&x).values(), estimate.values);
    }
}

/// (47): θ̂' = −f²L_f WᵀΔi/‖W‖² with W of (44) for filters at rest; v_r takes −χ'Δθ' (nothing, at rest); the integral forgets while it adapts.
#[test]
fn a_first_sample_of_time_varying_adaptation_is_47() {
    let p = parameters();
    let law = TimeVarying::try_new(&SchemeSettings::full(p, H), 100.0, 30.0).unwrap();
    let t = Tracking { delta_i: C::new(0.02, 0.05), i_ref_rate: C::new(40.0, -25.0), ..tracking(200.0, 5.0) };
    let by_l = t.phi_ref * p.inverse_rotor_time_constant();
    let by_r = t.i_ref * p.rotor_resistance_ohm - by_l;
    let w = [
        -by_r,
        -by_l,
        -t.i_ref * p.stator_resistance_ohm,
        -(t.i_ref * C::new(0.0, 205.0) + t.i_ref_rate) * p.leakage_inductance_h,
    ];
    let size: f64 = w.iter().map(|w| w.norm_sqr()).sum();
    let mut x = law.start();
    assert_eq!(law.integral_leak_per_s(&x), 0.0, "nothing has been learnt yet");
    let estimate = law.step(&mut x, &t);
    for (k, w) in w.into_iter().enumerate() {
        let change = 100.0 * 100.0 * H * p.leakage_inductance_h * dot(w, t.delta_i) / size;
        let got = estimate.values[k] / p.values()[k] - 1.0;
        assert!((got - change).abs() < 1e-12, "{k}: {got} {change}");
    }
    assert_eq!((law.flux_injection(&x), law.integral_leak_per_s(&x)), (C::new(0.0, 0.0), 30.0));
    // (42), implicit: after a sample χ = −h(drive)/(1 + h(T_r⁻¹ + jω_g)), and what the estimates move by then, v_r must give back.
    let before = law.parameters(&x).values();
    let slow = C::new(1.0 + H * parameters().inverse_rotor_time_constant(), H * 5.0);
    let chi = [by_r, by_l].map(|drive| -drive * H / slow);
    let second = law.step(&mut x, &t);
    let change = [0, 1].map(|k| second.values[k] / before[k] - 1.0);
    let expected = -(chi[0] * change[0] + chi[1] * change[1]) / H;
    assert!((law.flux_injection(&x) - expected).norm() < 1e-9 + 1e-6 * expected.norm(), "{} {expected}", law.flux_injection(&x));
}

/// (53): nothing is learnt where |T_rω_s| ≤ 4 or |T_rω_g| ≤ ¼, nor without a regressor, nor from what is lost.
#[test]
fn what_freezes_an_adaptation_is_said() {
    let p = parameters();
    let a = p.inverse_rotor_time_constant();
    assert_eq!(DeadZone::<f64>::of_the_paper(), DeadZone { least_turn: 4.0, least_slip: 0.25 });
    let law = TimeScale::try_new(&SchemeSettings::reduced(p, H), 0.5).unwrap();
    let status = |t: &Tracking<f64>| {
        let mut x = law.start();
        let e = law.step(&mut x, t);
        let learns = e.values != p.values();
        assert_eq!(e.adapting, [learns, learns, false, false]);
        assert_eq!(learns, e.status == IdentifierStatus::Adapting, "{:?}", e.status);
        e.status
    };
    for sign in [1.0, -1.0] {
        let slip = sign * 0.3 * a;
        assert_eq!(status(&tracking(sign * 4.05 * a - slip, slip)), IdentifierStatus::Adapting);
        assert_eq!(status(&tracking(sign * 3.95 * a - slip, slip)), IdentifierStatus::DeadZone);
        assert_eq!(status(&tracking(sign * 200.0, sign * 0.26 * a)), IdentifierStatus::Adapting);
        assert_eq!(status(&tracking(sign * 200.0, sign * 0.24 * a)), IdentifierStatus::DeadZone);
    }
    let good = tracking(200.0, 5.0);
    let zero = C::new(0.0, 0.0);
    assert_eq!(status(&Tracking { phi_ref: zero, i_ref: zero, ..good }), IdentifierStatus::NoExcitation);
    assert_eq!(status(&Tracking { lost: true, ..good }), IdentifierStatus::LostSample);
    assert_eq!(status(&Tracking { held_v: C::new(f64::NAN, 0.0), ..good }), IdentifierStatus::LostSample);
}
