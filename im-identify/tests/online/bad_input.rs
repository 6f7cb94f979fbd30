//! Not a number, no excitation, no flux: estimates stay finite, are held, and say so; what comes after is learnt from again.

use crate::bench::{Bench, Point};
use im_identify::online::{
    Estimate, Fixed, Follower, FollowerGains, Identifier, IdentifierStatus, KenneResistances, KenneRotorResistance,
    KenneSettings, Lambda, Range, RegulationParameters, ResistancesSettings, Sample, SchemeSettings, TimeScale, TimeVarying,
};
use im_model::{Complex, TParameters};

const H: f64 = 1e-4;

fn table_i() -> TParameters<f64> {
    im_model::machines::JADOT_TABLE_I.parameters()
}

fn kenne() -> ResistancesSettings<f64> {
    let p = table_i();
    let (r_r, r_s) = (p.rotor_resistance_ohm, p.stator_resistance_ohm);
    let range = |r: f64| Range::try_new("range_ohm", 0.3 * r, 3.0 * r).unwrap();
    ResistancesSettings {
        rotor: KenneSettings {
            high_gain_per_s: 500.0,
            sliding_gain_a_per_s2: 1e6,
            averaging_time_s: 1e-3,
            rate_ohm_per_s: 10.0 * r_r,
            boundary_layer_ohm: 0.0,
            range_ohm: range(r_r),
            start_ohm: 0.8 * r_r,
            least_rotor_current_rate_a_per_s: 50.0,
            excitation_window_s: 0.05,
        },
        stator_rate_ohm_per_s: 5.0 * r_s,
        stator_boundary_layer_ohm: 0.0,
        stator_range_ohm: range(r_s),
        least_excitation: 1e-3,
    }
}

fn gains() -> FollowerGains<f64> {
    FollowerGains {
        pole_pairs: 2,
        current_proportional_ohm: 7.0,
        current_integral_per_s: 790.0,
        lambda: Lambda::Scheduled,
        sample_time_s: H,
    }
}

/// Half a second of running, with some samples spoilt, then a second of good ones.
fn spoil<const N: usize, I: Identifier<f64, N, Input = Sample<f64>>>(identifier: &I, truth: [f64; N], tolerance: f64) {
    let point = Point { omega_r: 250.0, omega_g: 7.0, flux_vs: 0.9 };
    let mut bench = Bench::new(table_i(), 2, H);
    bench.settle(&point);
    let mut state = identifier.start();
    let finite = |e: &Estimate<f64, N>| {
        e.values.iter().chain(&e.excitation.of_each).chain([&e.excitation.smallest]).all(|v| v.is_finite())
    };
    let bad = [
        Sample { i_s: Complex::new(f64::NAN, 0.0), u_s: Complex::new(1.0, 0.0), omega_m: 1.0 },
        Sample { i_s: Complex::new(1.0, 0.0), u_s: Complex::new(0.0, f64::INFINITY), omega_m: 1.0 },
        Sample { i_s: Complex::new(1.0, 0.0), u_s: Complex::new(1.0, 0.0), omega_m: f64::NEG_INFINITY },
        Sample { i_s: Complex::new(1e200, 1e200), u_s: Complex::new(-1e250, 0.0), omega_m: 1e180 },
    ];
    let mut n = 0;
    bench.hold(0.5, &point, |s, _| {
        n += 1;
        let before = identifier.step(&mut state, s);
        assert!(finite(&before), "{before:?}");
        if n % 500 == 0 {
            let lost = identifier.step(&mut state, &bad[n / 500 % 4]);
            assert!(finite(&lost), "{lost:?}");
            assert_eq!((lost.values, lost.adapting), (before.values, [false; N]), "{lost:?}");
            assert!(lost.status.is_frozen());
        }
    });
    let mut last = None;
    bench.hold(6.0, &point, |s, _| last = Some(identifier.step(&mut state, s)));
    let last = last.unwrap();
    for (k, t) in truth.into_iter().enumerate() {
        assert!((last.values[k] / t - 1.0).abs() < tolerance, "{k}: {last:?}");
    }
}

/// Nothing at all, then flux gone at speed: held and flagged.
fn starve<const N: usize, I: Identifier<f64, N, Input = Sample<f64>>>(identifier: &I) {
    let mut state = identifier.start();
    let zero = Complex::new(0.0, 0.0);
    let mut first = None;
    for k in 0..20_000 {
        let omega_m = if k < 10_000 { 0.0 } else { 150.0 };
        let e = identifier.step(&mut state, &Sample { i_s: zero, u_s: zero, omega_m });
        let start = *first.get_or_insert(e.values);
        assert!(e.values == start && e.status.is_frozen() && e.adapting == [false; N], "{e:?}");
        assert!(e.excitation.smallest < 1e-6 && e.excitation.smallest.is_finite());
    }
}

#[test]
fn kennes_identifiers_survive_bad_samples_and_learn_on() {
    let (s, p) = (kenne(), table_i());
    let w = p.windings();
    let one = KenneRotorResistance::try_new(&w, 2, &s.rotor, H).unwrap();
    let both = KenneResistances::try_new(&w, 2, &s, H).unwrap();
    spoil(&one, [p.rotor_resistance_ohm], 0.01);
    spoil(&both, [p.rotor_resistance_ohm, p.stator_resistance_ohm], 0.03);
    starve(&one);
    starve(&both);
}

#[test]
fn jadots_adaptations_survive_bad_samples_and_learn_on() {
    let truth = RegulationParameters::from(table_i().inverse_gamma());
    let start = truth.scaled([1.2, 0.85, 1.0, 1.0]);
    let s = SchemeSettings { weights: [1.0, 1.0, 0.0, 0.0], ..SchemeSettings::full(start, H) };
    let slow = Follower::try_new(gains(), TimeScale::try_new(&s, 2.0 / 3.0).unwrap()).unwrap();
    let fast = Follower::try_new(gains(), TimeVarying::try_new(&s, 36.0 * std::f64::consts::PI, 1000.0).unwrap()).unwrap();
    spoil(&slow, truth.values(), 0.01);
    spoil(&fast, truth.values(), 0.01);
    starve(&slow);
    starve(&fast);
}

#[test]
fn fixed_parameters_stay_and_do_not_claim_to_adapt() {
    let truth = RegulationParameters::from(table_i().inverse_gamma());
    let fixed = Follower::try_new(gains(), Fixed::try_new(truth).unwrap()).unwrap();
    spoil(&fixed, truth.values(), 1e-12);
}

/// One wrong reading in a good run: what it moves the estimates by, and that it is said.
fn jolt<const N: usize, I: Identifier<f64, N, Input = Sample<f64>>>(
    identifier: &I,
    spoilt: impl Fn(&Sample<f64>) -> Sample<f64>,
) {
    let point = Point { omega_r: 250.0, omega_g: 7.0, flux_vs: 0.9 };
    let mut bench = Bench::new(table_i(), 2, H);
    bench.settle(&point);
    let mut state = identifier.start();
    let mut before = None;
    bench.hold(4.0, &point, |s, _| before = Some(identifier.step(&mut state, s)));
    let before = before.unwrap();
    let mut n = 0;
    bench.hold(0.2, &point, |s, _| {
        n += 1;
        let e = identifier.step(&mut state, &if n == 5 { spoilt(s) } else { *s });
        if n == 5 {
            assert_eq!((e.status, e.values), (IdentifierStatus::LostSample, e.values));
        }
        for (a, b) in e.values.iter().zip(before.values) {
            assert!((a / b - 1.0).abs() < 0.01, "{n}: {e:?} after {before:?}");
        }
    });
    // 32 ms later, at 500 1/s, everything is as before.
    let mut last = None;
    bench.hold(0.01, &point, |s, _| last = Some(identifier.step(&mut state, s)));
    assert_eq!(last.unwrap().status, before.status);
}

#[test]
fn one_outlier_is_not_believed() {
    let (s, p) = (kenne(), table_i());
    let w = p.windings();
    let both = KenneResistances::try_new(&w, 2, &s, H).unwrap();
    let truth = RegulationParameters::from(p.inverse_gamma());
    let reduced = SchemeSettings { weights: [1.0, 1.0, 0.0, 0.0], ..SchemeSettings::full(truth, H) };
    let fast = Follower::try_new(gains(), TimeVarying::try_new(&reduced, 36.0 * std::f64::consts::PI, 1000.0).unwrap()).unwrap();
    type Spoil = fn(&Sample<f64>) -> Sample<f64>;
    let wrong: [Spoil; 4] = [
        |s| Sample { omega_m: 1e4, ..*s },
        |s| Sample { omega_m: -s.omega_m, ..*s },
        |s| Sample { i_s: Complex::new(1e6, 0.0), ..*s },
        |s| Sample { i_s: s.i_s + Complex::new(0.0, 500.0), ..*s },
    ];
    for spoilt in wrong {
        jolt(&both, spoilt);
        jolt(&fast, spoilt);
    }
}

/// A step that stays is the machine's: believed from the fourth sample on.
#[test]
fn what_stays_is_believed() {
    let truth = RegulationParameters::from(table_i().inverse_gamma());
    let fixed = Follower::try_new(gains(), Fixed::try_new(truth).unwrap()).unwrap();
    let mut state = fixed.start();
    let at = |omega_m: f64| Sample { i_s: Complex::new(1.0, 0.0), u_s: Complex::new(10.0, 0.0), omega_m };
    for _ in 0..10 {
        fixed.step(&mut state, &at(150.0));
    }
    let lost: Vec<bool> = (0..6).map(|_| fixed.step(&mut state, &at(-3000.0)).status == IdentifierStatus::LostSample).collect();
    assert_eq!(lost, [true, true, true, false, false, false]);
}

/// Settings out of bounds name their key.
#[test]
fn impossible_settings_are_named() {
    let (s, w) = (kenne(), table_i().windings());
    let message = |rotor: KenneSettings<f64>, h: f64| KenneRotorResistance::try_new(&w, 2, &rotor, h).unwrap_err().to_string();
    let bad = f64::NAN;
    for (key, text) in [
        ("high_gain_per_s", message(KenneSettings { high_gain_per_s: 0.0, ..s.rotor }, H)),
        ("sliding_gain_a_per_s2", message(KenneSettings { sliding_gain_a_per_s2: -1.0, ..s.rotor }, H)),
        ("averaging_time_s", message(KenneSettings { averaging_time_s: bad, ..s.rotor }, H)),
        ("rate_ohm_per_s", message(KenneSettings { rate_ohm_per_s: 0.0, ..s.rotor }, H)),
        ("start_ohm", message(KenneSettings { start_ohm: 1e3, ..s.rotor }, H)),
        ("sample_time_s", message(s.rotor, 0.0)),
    ] {
        assert!(text.starts_with(key), "{key}: {text}");
    }
    let truth = RegulationParameters::from(table_i().inverse_gamma());
    let full = SchemeSettings::full(truth, H);
    let message = |s: SchemeSettings<f64>| TimeScale::try_new(&s, 0.6).unwrap_err().to_string();
    for (key, text) in [
        ("leakage_inductance_h", message(SchemeSettings { start: truth.scaled([1.0, 1.0, 1.0, -1.0]), ..full })),
        ("stator_resistance_ohm", message(SchemeSettings { start: truth.scaled([1.0, 1.0, 9.0, 1.0]), ..full })),
        ("weights", message(SchemeSettings { weights: [1.0, -1.0, 0.0, 0.0], ..full })),
        ("least_regressor_v", message(SchemeSettings { least_regressor_v: 0.0, ..full })),
        ("excitation_window_s", message(SchemeSettings { excitation_window_s: bad, ..full })),
    ] {
        assert!(text.starts_with(key), "{key}: {text}");
    }
    assert_eq!(IdentifierStatus::default(), IdentifierStatus::Adapting);
}
