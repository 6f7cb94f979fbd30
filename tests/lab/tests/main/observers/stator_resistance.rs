//! A wrong stator resistance at low stator frequency, motoring and braking.

use im_lab::observation::{Truth, held, machine};
use im_model::machines::{JADOT_TABLE_I, MOTULATOR_2_2_KW, NamedMachine};
use im_model::{BaseParameter, Machine, ParameterId};
use im_observers::*;

fn rated_slip(m: &NamedMachine) -> f64 {
    let r = &m.rating;
    r.torque_nm * m.parameters().rotor_resistance_ohm / (1.5 * f64::from(m.pole_pairs) * r.rotor_flux_vs * r.rotor_flux_vs)
}

fn believed(m: &NamedMachine, share: f64) -> Machine<f64> {
    let right = machine(m);
    let r_s = right.parameters().stator_resistance_ohm;
    right.with(&[(ParameterId::Base(BaseParameter::StatorResistance), share * r_s)]).unwrap()
}

/// Held at a stator frequency (Hz) and a share of rated torque; observers start right and have six seconds.
fn run(m: &NamedMachine, hertz: f64, load: f64) -> (Truth, f64) {
    let slip = load * rated_slip(m);
    let omega = (std::f64::consts::TAU * hertz - slip) / f64::from(m.pole_pairs);
    (Truth::of(&machine(m), &held(m, omega, slip, 6.0)), omega)
}

#[test]
fn the_full_order_observer_learns_a_stator_resistance_that_is_20_percent_wrong() {
    for m in [MOTULATOR_2_2_KW, JADOT_TABLE_I] {
        for (hertz, load) in [(2.0, -1.0), (5.0, -1.0), (5.0, 1.0)] {
            let (truth, omega) = run(&m, hertz, load);
            for share in [0.8, 1.2] {
                let machine = believed(&m, share);
                let basis = Basis::try_new(&machine, &m.rating, 1e-4).unwrap();
                let observer = FullOrder::try_new(basis, FullOrderGains::for_machine(&machine, &m.rating)).unwrap();
                let mut state = truth.state(&observer, 0);
                let last = (1..truth.len()).map(|k| observer.step(&mut state, &truth.input(k))).last().unwrap();
                let learnt = share * state.stator_resistance_ratio();
                assert!((learnt - 1.0).abs() < 0.03, "{} {hertz} Hz {load} {share}: {learnt}", m.name);
                assert!(
                    (last.omega_m - omega).abs() < 0.1 * rated_slip(&m),
                    "{} {hertz} {load} {share}: {}",
                    m.name,
                    last.omega_m - omega
                );
            }
        }
    }
}

/// The promise that a proof about a known machine does not keep: with R_s 20 % too small Kubota's observer, published and stabilized, loses the braking machine at 2 Hz.
#[test]
fn kubotas_observer_loses_the_braking_machine_at_2_hz_where_the_full_order_one_holds() {
    let m = MOTULATOR_2_2_KW;
    let (truth, omega) = run(&m, 2.0, -1.0);
    let machine = believed(&m, 0.8);
    let basis = Basis::try_new(&machine, &m.rating, 1e-4).unwrap();
    // The larger of the errors of speed, in rated slips, and of flux, in 30 % of rated.
    let off = |e: Vec<Estimate<f64>>| {
        let (last, flux) = (e.last().unwrap(), truth.flux[truth.len() - 1]);
        let speed = (last.omega_m - omega).abs() * f64::from(m.pole_pairs) / rated_slip(&m);
        speed.max((last.rotor_flux_vs - flux).norm() / (0.3 * m.rating.rotor_flux_vs))
    };
    let (p, i) = KubotaGains::speed_law(&machine, &m.rating, 400.0);
    for gains in [KubotaGains::without_feedback(p, i), KubotaGains::for_machine(&machine, &m.rating).unwrap()] {
        let kubota = Kubota::try_new(basis, gains).unwrap();
        assert!(off(truth.observe_from(&kubota, 1, truth.state(&kubota, 0))) > 1.0);
    }
    let full = FullOrder::try_new(basis, FullOrderGains::for_machine(&machine, &m.rating)).unwrap();
    assert!(off(truth.observe_from(&full, 1, truth.state(&full, 0))) < 0.1);
}
