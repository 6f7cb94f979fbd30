//! im-observers: limits, gains and options of each, and a step with anything.

use im_lab::observation::{Truth, basis, every_observer, machine, volts_per_hertz};
use im_model::effects::InverterNonlinearity;
use im_observers::{
    Basis, CurrentModel, Derdiyok, DerdiyokGains, Discretization, Estimate, FullOrder, FullOrderGains, Input, Kalman,
    KalmanGains, Kubota, KubotaGains, Limits, LoadTorqueModel, Observer, Thau, ThauBoxGains, ThauGains, Utkin, UtkinGains,
};
use std::sync::OnceLock;

use super::*;

fn limits(f: &mut Fields) -> Limits<f64> {
    let l = Limits::of(&machine(&M), &M.rating);
    Limits {
        voltage_max_v: f.or(l.voltage_max_v),
        current_max_a: f.or(l.current_max_a),
        flux_max_vs: f.or(l.flux_max_vs),
        flux_min_vs: f.or(l.flux_min_vs),
        speed_max_rad_s: f.or(l.speed_max_rad_s),
        residual_max_a: f.or(l.residual_max_a),
        settling_s: f.or(l.settling_s),
    }
}

fn finite<T: Scalar>(e: &Estimate<T>) -> bool {
    is_finite(&[e.rotor_flux_vs.re, e.rotor_flux_vs.im, e.omega_m, e.torque_nm, e.residual_a.re, e.residual_a.im])
}

/// Ten milliseconds of turning field with some odd samples.
fn runs<T: Scalar, O: Observer<T>>(observer: &O, bad: &[f64; 5]) -> bool {
    let mut state = O::State::default();
    (0..100).all(|k| {
        let (s, c) = (0.0314 * f64::from(k)).sin_cos();
        let good = Input::new(vector(300.0 * c, 300.0 * s), vector(8.0 * s, -8.0 * c)).with_speed(T::from_f64(100.0));
        let spoilt = Input::new(vector(bad[0], bad[1]), vector(bad[2], bad[3])).with_speed(T::from_f64(bad[4]));
        finite(&observer.step(&mut state, if k % 30 == 20 { &spoilt } else { &good }))
    })
}

fn all_run<T: Scalar>(f: &Fields, bad: &[f64; 5], which: Discretization) -> Result<(), TestCaseError> {
    let mut f = f.clone();
    let known = machine(&M);
    let basis =
        Basis::<T>::try_new(&known, &super::machines::rating(&mut f), f.or_64(H)).and_then(|b| b.with_limits(limits(&mut f)));
    let inverter = InverterNonlinearity { voltage_v: f.or(2.0), zero_crossing_current_a: f.or(0.5), ..Default::default() };
    let Ok(basis) = basis.and_then(|b| b.with_inverter(inverter)) else { return Ok(()) };
    prop_assert!(runs(&CurrentModel::new(basis), bad), "current model, {basis:?}");
    let right = KubotaGains::for_machine(&known, &M.rating).unwrap();
    let rho = f.or(0.3);
    let stabilized = KubotaGains::stabilized(&known, rho, f.or(right.proportional), f.or(right.integral)).unwrap_or(right);
    let kubota = KubotaGains { fade_a: f.or(right.fade_a), ..stabilized };
    if let Ok(o) = Kubota::discretized(basis, kubota, which) {
        prop_assert!(runs(&o, bad), "{kubota:?} {basis:?}");
    }
    let d = DerdiyokGains::for_machine(&known, &M.rating);
    let derdiyok = DerdiyokGains {
        nu0: f.or(d.nu0),
        boundary_layer_a: f.or(d.boundary_layer_a),
        filter_rad_s: f.or(d.filter_rad_s),
        anchor_per_s: f.or(d.anchor_per_s),
    };
    if let Ok(o) = Derdiyok::discretized(basis, derdiyok, which) {
        prop_assert!(runs(&o, bad), "{derdiyok:?} {basis:?}");
    }
    Ok(())
}

fn more_run<T: Scalar>(f: &Fields, bad: &[f64; 5], which: Discretization) -> Result<(), TestCaseError> {
    let mut f = f.clone();
    let known = machine(&M);
    let basis = Basis::<T>::try_new(&known, &M.rating, H).unwrap();
    let u = UtkinGains::for_machine(&known, &M.rating);
    let utkin = UtkinGains {
        omega0_rad_s: f.or(u.omega0_rad_s),
        boundary_layer_avs: f.or(u.boundary_layer_avs),
        filter_rad_s: f.or(u.filter_rad_s),
    };
    if let Ok(o) = Utkin::discretized(basis, utkin, which) {
        prop_assert!(runs(&o, bad), "{utkin:?}");
    }
    let load = [
        LoadTorqueModel::Proportional { coefficient_nm_s_per_rad: f.or(0.01) },
        LoadTorqueModel::EqualToTorque,
        LoadTorqueModel::Balanced,
    ];
    let gain: [[f64; 2]; 5] = [[f.or(0.0), f.or(0.0)], [f.or(0.1), 0.0], [0.0, f.or(0.1)], [f.or(50.0), 0.0], [0.0, f.or(50.0)]];
    let slope: [[f64; 2]; 5] = [[0.0; 2], [f.or(1e-4), 0.0], [0.0; 2], [0.0; 2], [0.0, f.or(0.0)]];
    let boxed = ThauBoxGains { frame_rad_s: [f.or(30.0), f.or(300.0)], gain, gain_per_frame_speed: slope };
    for load in load {
        if let Ok(o) = Thau::discretized(basis, ThauGains { gain }, load, which) {
            prop_assert!(runs(&o, bad), "{gain:?} {load:?}");
        }
        if let Ok(o) = Thau::in_box_discretized(basis, boxed, load, which) {
            prop_assert!(runs(&o, bad), "{boxed:?} {load:?}");
        }
    }
    Ok(())
}

/// Those without a choice of rule, on a basis of which limits, rating and sampling time may be odd too.
fn implicit_run<T: Scalar>(f: &Fields, bad: &[f64; 5]) -> Result<(), TestCaseError> {
    let mut f = f.clone();
    let known = machine(&M);
    let g = FullOrderGains::for_machine(&known, &M.rating);
    let full_order = FullOrderGains {
        current_bandwidth_rad_s: f.or(g.current_bandwidth_rad_s),
        speed_bandwidth_rad_s: f.or(g.speed_bandwidth_rad_s),
        flux_damping_per_s: f.or(g.flux_damping_per_s),
        flux_damping_per_frequency: f.or(g.flux_damping_per_frequency),
        stator_resistance_per_s: f.or(g.stator_resistance_per_s),
        stator_resistance_frequency_rad_s: f.or(g.stator_resistance_frequency_rad_s),
        stator_resistance_current_a: f.or(g.stator_resistance_current_a),
    };
    let k = KalmanGains::for_machine(&known, &M.rating);
    let kalman = KalmanGains {
        current_noise_a: f.or(k.current_noise_a),
        voltage_noise_v: f.or(k.voltage_noise_v),
        rotor_noise_v: f.or(k.rotor_noise_v),
        speed_walk_rad_s: f.or(k.speed_walk_rad_s),
    };
    let rating = super::machines::rating(&mut f);
    let basis = Basis::<T>::try_new(&known, &rating, f.or_64(H)).and_then(|b| b.with_limits(limits(&mut f)));
    let Ok(basis) = basis else { return Ok(()) };
    if let Ok(o) = FullOrder::try_new(basis, full_order) {
        prop_assert!(runs(&o, bad), "{full_order:?} {basis:?}");
    }
    if let Ok(o) = Kalman::try_new(basis, &known, &rating, kalman) {
        prop_assert!(runs(&o, bad), "{kalman:?} {basis:?}");
    }
    Ok(())
}

/// Two seconds of a true run.
fn truth() -> &'static Truth {
    static RUN: OnceLock<Truth> = OnceLock::new();
    RUN.get_or_init(|| Truth::of(&machine(&M), &volts_per_hertz(&M, 40.0, 8.0, 2.0)))
}

proptest! {
    #![proptest_config(cases())]
    #[test]
    fn observers_are_refused_or_run(f in fields(), bad in [odd(), odd(), odd(), odd(), odd()], euler in any::<bool>()) {
        let which = if euler { Discretization::ForwardEuler } else { Discretization::Implicit };
        all_run::<f64>(&f, &bad, which)?;
        all_run::<f32>(&f, &bad, which)?;
        more_run::<f64>(&f, &bad, which)?;
        more_run::<f32>(&f, &bad, which)?;
        implicit_run::<f64>(&f, &bad)?;
        implicit_run::<f32>(&f, &bad)?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases().cases / 4, ..cases() })]
    /// One sample of anything at 1.5 s: finite then, valid and right again at 2 s.
    #[test]
    fn observers_come_back_from_one_sample_of_anything(bad in [odd(), odd(), odd(), odd(), odd()], which in 0u8..31) {
        let truth = truth();
        let spoilt = |good: Input<f64>| {
            let one = |k: usize, x: f64| if which >> k & 1 == 1 { x } else { bad[k] };
            let speed = one(4, good.omega_m.unwrap_or(0.0));
            Input::new(vector(one(0, good.u_s.re), one(1, good.u_s.im)), vector(one(2, good.i_s.re), one(3, good.i_s.im))).with_speed(speed)
        };
        for mut observer in every_observer(&machine(&M), &M.rating, basis(&M, H)) {
            let at = truth.at(1.5);
            let mut last = None;
            for k in 0..truth.len() {
                let good = truth.input(k);
                let e = observer.step(&if k == at { spoilt(good) } else { good });
                prop_assert!(finite(&e), "{} at row {k}: {e:?}", observer.name);
                last = Some(e);
            }
            let (e, omega) = (last.unwrap(), truth.omega[truth.len() - 1]);
            prop_assert!(e.status.is_valid() && (e.omega_m - omega).abs() < 2.0, "{}: {e:?} {omega}", observer.name);
        }
    }
}
