//! What a current error does in a single sample is what the equations say: against the same observer without a gain, and in the frame that they
//! are written in.

use im_lab::observation::{C, basis, machine};
use im_model::machines::{JADOT_TABLE_I, NamedMachine};
use im_observers::*;

const H: f64 = 1e-4;
const M: NamedMachine = JADOT_TABLE_I;
/// Entries of no meaning, all of which differ: rows ω, λ, i.
const L: [[f64; 2]; 5] = [[3.0, -7.0], [0.5, 0.2], [-0.3, 0.4], [300.0, -50.0], [80.0, 200.0]];
const ZERO: [[f64; 2]; 5] = [[0.0; 2]; 5];

/// λ̂, î and ω̂ of some instant under load.
const BEFORE: (C, C, f64) = (C::new(0.5, 0.75), C::new(-3.0, 8.0), 90.0);

fn input(k: usize) -> Input<f64> {
    // A current that is off by about an ampere from what the voltage gives.
    [Input::new(C::new(-190.0, 100.0), C::new(-2.2, 9.0)), Input::new(C::new(-195.0, 95.0), C::new(-3.5, 7.0))][k]
}

/// λ̂, î, ω̂ after so many samples.
fn after<O: Observer<f64>>(o: &O, samples: &[Input<f64>]) -> (C, C, f64) {
    let mut state = o.state_at(BEFORE.0, BEFORE.1, BEFORE.2);
    let mut last = BEFORE;
    for x in samples {
        let e = o.step(&mut state, x);
        let shown = if x.i_s.re.is_finite() { x.i_s - e.residual_a } else { last.1 };
        last = (e.rotor_flux_vs, shown, e.omega_m);
    }
    last
}

/// L e, rows ω, λ, i.
fn times(l: &[[f64; 2]; 5], e: C) -> (f64, C, C) {
    let row = |k: usize| l[k][0] * e.re + l[k][1] * e.im;
    (row(0), C::new(row(1), row(2)), C::new(row(3), row(4)))
}

fn same(got: ((C, C, f64), (C, C, f64)), by: (f64, C, C), what: &str) {
    let (with, without) = got;
    let off = [(with.0 - without.0 - by.1).norm(), (with.1 - without.1 - by.2).norm(), (with.2 - without.2 - by.0).abs()];
    assert!(off.iter().all(|x| *x < 1e-9), "{what}: {off:?} of {by:?}");
}

fn scaled((omega, lambda, i): (f64, C, C), h: f64) -> (f64, C, C) {
    (omega * h, lambda * h, i * h)
}

/// x̂ = x̂_p + hL(i − Cx̂): the error is that after the correction; by forward Euler, that before the sample. No measurement, no correction.
#[test]
fn thaus_correction_is_the_gain_times_the_error() {
    for load in [
        LoadTorqueModel::Proportional { coefficient_nm_s_per_rad: 0.1 },
        LoadTorqueModel::EqualToTorque,
        LoadTorqueModel::Balanced,
    ] {
        let make = |gain, how| Thau::discretized(basis(&M, H), ThauGains { gain }, load, how).unwrap();
        let run = |how, samples: &[Input<f64>]| (after(&make(L, how), samples), after(&make(ZERO, how), samples));
        let one = run(Discretization::Implicit, &[input(0)]);
        let e = input(0).i_s - one.0.1;
        assert!(e.norm() > 0.3, "{e}");
        same(one, scaled(times(&L, e), H), "implicit");
        let lost = Input::new(input(0).u_s, C::new(f64::NAN, 0.0));
        let (with, without) = run(Discretization::Implicit, &[lost]);
        assert_eq!((with.0, with.2), (without.0, without.2), "nothing was measured");
        // The first sample begins without an error: what it ends with is that of the second.
        let euler = Discretization::ForwardEuler;
        let (first, plain) = run(euler, &[input(0)]);
        assert_eq!(first, plain);
        let e = input(0).i_s - first.1;
        same(run(euler, &[input(0), input(1)]), scaled(times(&L, e), H), "forward Euler");
    }
}

/// The gain at |ω_f|.
fn at(speed: f64) -> [[f64; 2]; 5] {
    core::array::from_fn(|r| [0, 1].map(|k| L[r][k] * (1.0 + 3e-3 * speed)))
}

fn boxed(scale: f64) -> ThauBoxGains {
    ThauBoxGains {
        frame_rad_s: [5.0, 600.0],
        gain: L.map(|r| r.map(|x| scale * x)),
        gain_per_frame_speed: L.map(|r| r.map(|x| 3e-3 * scale * x)),
    }
}

/// As at rest, but with error and correction on the axes of λ̂_p and the gain at the speed that its flux turns with.
#[test]
fn a_box_gain_corrects_along_and_across_the_flux() {
    let run = |scale| after(&Thau::in_box(basis(&M, H), boxed(scale), LoadTorqueModel::Balanced).unwrap(), &[input(0)]);
    let (with, without) = (run(1.0), run(0.0));
    let c = M.parameters().windings().derived(M.pole_pairs);
    let (lambda, omega) = (without.0, without.2);
    let d = lambda / lambda.norm();
    let speed = c.n_p * omega + c.eta_l_m * (lambda.conj() * input(0).i_s).im / lambda.norm_sqr();
    let (omega, flux, current) = times(&at(speed), (input(0).i_s - with.1) * d.conj());
    same((with, without), scaled((omega, flux * d, current * d), H), "box");
}

/// z⁺ = e^{jhω_f}(z + h(ż − jω_fz)) with the ω_f, and the gain at it, that leave the flux on the d axis.
#[test]
fn forward_euler_with_a_box_gain_turns_with_the_flux() {
    let c = M.parameters().windings().derived(M.pole_pairs);
    let euler = |scale| {
        Thau::in_box_discretized(basis(&M, H), boxed(scale), LoadTorqueModel::Balanced, Discretization::ForwardEuler).unwrap()
    };
    for scale in [0.0, 1.0] {
        let (lambda, i, omega) = after(&euler(scale), &[input(0)]);
        let e = input(0).i_s - i;
        let d = lambda / lambda.norm();
        let a = C::new(-c.eta, c.n_p * omega);
        let own = a * lambda + i * c.eta_l_m;
        let corrected = |speed: f64| {
            let (w, flux, current) = times(&at(speed).map(|r| r.map(|x| scale * x)), e * d.conj());
            (w, flux * d, current * d)
        };
        // ω_f = Im λ̂'/λ̂ with the gain at ω_f: a contraction.
        let mut speed = c.n_p * omega;
        for _ in 0..200 {
            speed = ((own + corrected(speed).1) / lambda).im;
        }
        let (push, flux, current) = corrected(speed);
        let stepped = |z: C, rate: C| (z + (rate - C::new(0.0, speed) * z) * H) * C::from_polar(1.0, H * speed);
        let drive = input(1).u_s / c.sigma_l_s - i * (M.parameters().stator_resistance_ohm / c.sigma_l_s);
        let wanted = (stepped(lambda, own + flux), stepped(i, drive - own * c.beta + current), omega + H * push);
        let got = after(&euler(scale), &[input(0), input(1)]);
        let off = [(got.0 - wanted.0).norm(), (got.1 - wanted.1).norm(), (got.2 - wanted.2).abs()];
        assert!(off.iter().all(|x| *x < 1e-8) && (scale == 0.0 || e.norm() > 0.3), "{off:?}: {got:?} {wanted:?}");
    }
}

/// L/(1 + |e|²/fade²): a half where the error is the one that was named.
#[test]
fn kubotas_feedback_fades_with_the_error() {
    let full =
        KubotaGains { gain: [[0.3, 0.1], [-0.1, 0.3], [40.0, -20.0], [20.0, 40.0]], ..KubotaGains::without_feedback(0.01, 1.0) };
    let run = |g: KubotaGains, n: usize| {
        after(&Kubota::discretized(basis(&M, H), g, Discretization::ForwardEuler).unwrap(), &[input(0), input(1)][..n])
    };
    let none = KubotaGains { gain: [[0.0; 2]; 4], ..full };
    let e = (input(0).i_s - run(none, 1).1).norm();
    let moved = |fade_a: f64| (run(KubotaGains { fade_a, ..full }, 2).0 - run(none, 2).0).norm();
    for (fade_a, share) in [(e, 0.5), (0.5 * e, 0.2), (3.0 * e, 0.9), (0.0, 1.0)] {
        assert!((moved(fade_a) / moved(0.0) - share).abs() < 1e-9, "{fade_a}: {}", moved(fade_a) / moved(0.0));
    }
    assert!(moved(0.0) > 1e-6);
}

/// Δω = λ̂ × e/(hn_p(β|λ̂|² + λ̂·e) + layer), and its effect on flux and current; with no less than a tenth of hn_pβ|λ̂|² under it.
#[test]
fn utkins_speed_is_what_takes_the_error_across_the_flux_away() {
    let c = M.parameters().windings().derived(M.pole_pairs);
    let layer = 5.0;
    let gains = UtkinGains { omega0_rad_s: 1e5, boundary_layer_avs: layer, filter_rad_s: 0.0 };
    let o = Utkin::try_new(basis(&M, H), gains).unwrap();
    let u = input(0).u_s;
    let lost = Input::new(u, C::new(f64::NAN, 0.0));
    let (lambda, _, before) = after(&o, &[lost]);
    // What is measured, and what was predicted before the speed: î + βΔλ.
    let seen = |i_s: C| {
        let (flux, i, omega) = after(&o, &[Input::new(u, i_s)]);
        (flux, i + (flux - lambda) * c.beta, omega)
    };
    let predicted = seen(BEFORE.1).1;
    for (along, across) in [(0.0, 0.2), (2.0, -0.3), (-3.0, 0.1)] {
        let d = lambda / lambda.norm();
        let e = d * C::new(along, across);
        let (flux, shown, omega) = seen(predicted - e);
        assert!((shown - predicted).norm() < 1e-9, "{shown} {predicted}");
        let slope = H * c.n_p * (c.beta * lambda.norm_sqr() + (lambda.conj() * e).re);
        let change = (lambda.conj() * e).im / (slope + layer / 1e5);
        assert!((omega - before - change).abs() < 1e-6 * change.abs(), "{along} {across}: {} {change}", omega - before);
        assert!((flux - lambda - C::new(0.0, H * c.n_p * change) * lambda).norm() < 1e-9);
    }
}

/// s' = −(n_pβ|λ|²ω₀/layer)s: forward Euler needs h below twice the inverse of this rate.
#[test]
fn utkins_layer_is_wide_enough_for_forward_euler_or_refused() {
    let b = basis(&M, H);
    let c = M.parameters().windings().derived(M.pole_pairs);
    let good = UtkinGains::for_machine(&machine(&M), &M.rating);
    let flux = Limits::of(&machine(&M), &M.rating).flux_max_vs;
    let least = 0.5 * H * c.n_p * c.beta * flux * flux * good.omega0_rad_s;
    let make = |layer: f64, how| Utkin::discretized(b, UtkinGains { boundary_layer_avs: layer, ..good }, how);
    assert!(make(1.01 * least, Discretization::ForwardEuler).is_ok());
    let refused = make(0.5 * least, Discretization::ForwardEuler).unwrap_err();
    assert!(
        matches!(refused, ObserverError::StepTooLong { limit_s, .. } if (limit_s / (0.5 * H) - 1.0).abs() < 1e-9),
        "{refused}"
    );
    // A sign has no layer, and the rule here no limit.
    assert!(make(0.0, Discretization::ForwardEuler).is_ok() && make(0.5 * least, Discretization::Implicit).is_ok());
}

/// λ̂' = ηL_m i − ν with the ν that leaves −νφ/ν₀ of current error; ω̂ from the filtered pair, ν the mean of the sample and λ̂ its middle; the anchor
/// draws λ̂ along η + jn_pω̂ by what η̂ is wrong by, at most as far as an error of the size of the flux could be.
#[test]
fn a_sample_of_derdiyok_is_its_equations() {
    let c = M.parameters().windings().derived(M.pole_pairs);
    let phi = 0.5;
    let plain =
        DerdiyokGains { boundary_layer_a: phi, ..DerdiyokGains::published(&machine(&M), 1.5 * M.rating.rotor_flux_vs, 300.0) };
    let run = |g: DerdiyokGains, x: Input<f64>| after(&Derdiyok::try_new(basis(&M, H), g).unwrap(), &[x]);
    let (lambda, before, omega) = BEFORE;
    let filtered = DerdiyokGains { filter_rad_s: 200.0, ..plain };
    for x in [Input::new(input(0).u_s, C::new(-3.05, 8.02)), input(0)] {
        let (flux, i, speed) = run(filtered, x);
        let mean = (before + x.i_s) * 0.5;
        let nu = mean * c.eta_l_m - (flux - lambda) / H;
        let limited = [nu.re, nu.im].map(|n| n.abs() > plain.nu0 * (1.0 - 1e-9));
        let left = i - x.i_s + nu * (phi / plain.nu0);
        assert!([nu.re, nu.im].iter().all(|n| n.abs() < plain.nu0 * (1.0 + 1e-9)));
        assert!((limited[0] || left.re.abs() < 1e-9) && (limited[1] || left.im.abs() < 1e-9), "{left} {nu}");
        let share = 1.0 - (-200.0 * H).exp();
        let nu_before = C::new(c.eta, -c.n_p * omega) * lambda;
        let (nu, middle) = (nu_before + (nu - nu_before) * share, lambda + ((lambda + flux) * 0.5 - lambda) * share);
        let wanted = -(middle.conj() * nu).im / middle.norm_sqr() / c.n_p;
        assert!((speed - wanted).abs() < 1e-9 * wanted.abs(), "{speed} {wanted}");
        let eta = (middle.conj() * nu).re / middle.norm_sqr();
        let k = 20.0;
        let drawn = run(DerdiyokGains { anchor_per_s: k, ..filtered }, x);
        let (w, most) = (c.n_p * speed, c.eta + (c.n_p * speed).abs());
        let mismatch = (eta - c.eta).clamp(-most, most);
        let wanted = C::new(c.eta, w) * flux * (2.0 * k * mismatch / (c.eta * c.eta + w * w) * H);
        assert!((drawn.0 - flux - wanted).norm() < 1e-12 && wanted.norm() > 1e-9, "{} {wanted}", drawn.0 - flux);
    }
}

/// What is measured up to the largest current is believed, what lies beyond is a lost sample; so with the voltage.
#[test]
fn a_current_is_believed_up_to_its_limit() {
    let limits = Limits { current_max_a: 20.0, voltage_max_v: 300.0, ..Limits::of(&machine(&M), &M.rating) };
    let b = basis(&M, H).with_limits(limits).unwrap();
    let o = Thau::try_new(b, ThauGains::published(), LoadTorqueModel::EqualToTorque).unwrap();
    let status = |volts: f64, amperes: f64| {
        let mut x = o.state_at(BEFORE.0, BEFORE.1, BEFORE.2);
        o.step(&mut x, &Input::new(C::from_polar(volts, 1.0), C::from_polar(amperes, 2.0))).status
    };
    let good = status(299.9, 19.99);
    assert!(!good.contains(ObserverStatus::CURRENT_LOST) && !good.contains(ObserverStatus::VOLTAGE_LIMITED), "{good}");
    assert!(
        status(299.9, 20.01).contains(ObserverStatus::CURRENT_LOST)
            && status(300.1, 19.99).contains(ObserverStatus::VOLTAGE_LIMITED)
    );
}

/// Every gain of every observer that has bounds: out of them it is named, and no observer is made.
#[test]
fn gains_out_of_bounds_are_named() {
    let (b, m) = (basis(&M, H), machine(&M));
    let named = |e: ObserverError, what: &str| assert!(e.to_string().starts_with(what), "{what}: {e}");
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        let d = DerdiyokGains::for_machine(&m, &M.rating);
        let make = |g: DerdiyokGains| Derdiyok::try_new(b, g).unwrap_err();
        named(make(DerdiyokGains { nu0: bad, ..d }), "nu0");
        named(make(DerdiyokGains { boundary_layer_a: bad, ..d }), "boundary_layer_a");
        named(make(DerdiyokGains { filter_rad_s: bad, ..d }), "filter_rad_s");
        named(make(DerdiyokGains { anchor_per_s: bad, ..d }), "anchor_per_s");
        let u = UtkinGains::for_machine(&m, &M.rating);
        let make = |g: UtkinGains| Utkin::try_new(b, g).unwrap_err();
        named(make(UtkinGains { omega0_rad_s: bad, ..u }), "omega0_rad_s");
        named(make(UtkinGains { boundary_layer_avs: bad, ..u }), "boundary_layer_avs");
        named(make(UtkinGains { filter_rad_s: bad, ..u }), "filter_rad_s");
        let k = KubotaGains::for_machine(&m, &M.rating).unwrap();
        let make = |g: KubotaGains| Kubota::try_new(b, g).unwrap_err();
        named(make(KubotaGains { proportional: bad, ..k }), "proportional");
        named(make(KubotaGains { integral: bad, ..k }), "integral");
        named(make(KubotaGains { fade_a: bad, ..k }), "fade_a");
        let load = LoadTorqueModel::Proportional { coefficient_nm_s_per_rad: bad };
        named(Thau::try_new(b, ThauGains::published(), load).unwrap_err(), "coefficient_nm_s_per_rad");
        named(
            Thau::in_box(b, ThauBoxGains { frame_rad_s: [bad, 100.0], ..boxed(1.0) }, LoadTorqueModel::Balanced).unwrap_err(),
            "frame_rad_s (lower)",
        );
        named(
            Thau::in_box(b, ThauBoxGains { frame_rad_s: [50.0, bad], ..boxed(1.0) }, LoadTorqueModel::Balanced).unwrap_err(),
            "frame_rad_s (upper)",
        );
    }
    named(Derdiyok::try_new(b, DerdiyokGains { nu0: 0.0, ..DerdiyokGains::for_machine(&m, &M.rating) }).unwrap_err(), "nu0");
}
