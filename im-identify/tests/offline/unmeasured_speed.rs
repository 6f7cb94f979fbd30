//! Runs without a speed sensor and without a known load: the speed is found from voltages and currents.

use im_identify::offline::Load;

use super::*;

fn unseen(r: &Recording, machine: &Machine<f64>) -> Experiment {
    experiment(&Recording { tau_load: None, ..r.clone() }).with_unmeasured_speed(machine, &M.rating)
}

fn found(e: &Experiment) -> (&[f64], &[f64]) {
    let Load::Unseen(speed) = &e.load else { panic!("no found speed") };
    (&speed.omega_m, &speed.std)
}

/// The machine with so many times each resistance, both leakages and the magnetizing inductance.
fn scaled(r_s: f64, r_r: f64, leakage: f64, magnetizing: f64) -> Machine<f64> {
    let p = M.parameters();
    let scaled = im_model::TParameters {
        stator_resistance_ohm: r_s * p.stator_resistance_ohm,
        rotor_resistance_ohm: r_r * p.rotor_resistance_ohm,
        stator_leakage_inductance_h: leakage * p.stator_leakage_inductance_h,
        rotor_leakage_inductance_h: leakage * p.rotor_leakage_inductance_h,
        magnetizing_inductance_h: magnetizing * p.magnetizing_inductance_h,
        ..p
    };
    truth().with_parameters(scaled).unwrap()
}

#[test]
fn the_speed_is_found_within_its_band_where_the_machine_is_right() {
    let r = recording(true);
    let e = unseen(&r, &truth());
    assert!(e.speed_is_imposed() && e.channels.len() == 2 && e.validate().is_ok());
    let (omega, std) = found(&e);
    let off: Vec<f64> = omega.iter().zip(&r.omega_m).map(|(a, b)| a - b).collect();
    // From the first flux on.
    let rms = (off[300..].iter().map(|d| d * d).sum::<f64>() / off[300..].len() as f64).sqrt();
    let inside = (300..off.len()).filter(|&k| off[k].abs() < 2.0 * std[k] + 0.3).count() as f64 / (off.len() - 300) as f64;
    println!("{rms} rad/s rms, inside {inside}, std {}", std[std.len() / 2]);
    assert!(rms < 1.0 && inside > 0.9, "{rms} rad/s, {inside}");
    // What is left is the noise of the sensors.
    let left = residuals(&truth(), &e, &e.start_state());
    let chi2 = left.iter().flatten().map(|r| r * r).sum::<f64>() / e.count() as f64;
    assert!((0.9..1.1).contains(&chi2), "{chi2}");
}

#[test]
fn electrical_parameters_are_found_without_speed_and_load() {
    let r = recording(true);
    let mut e = unseen(&r, &guess());
    let free = base_parameters_in(&guess(), std::slice::from_ref(&e));
    assert_eq!(free.len(), 4);
    let mut machine = guess();
    for _ in 0..4 {
        let f = fit(&machine, std::slice::from_ref(&e), &free, &FitOptions::near()).unwrap();
        println!("{} {:?} ± {:?}", f.chi2_per_sample(), f.values(), f.standard_deviations());
        e = e.with_speed_found_by(&f.machine, &f.starts[0]);
        machine = f.machine;
    }
    let (found, true_) = (machine.parameters().inverse_gamma(), M.parameters().inverse_gamma());
    for (a, b) in [
        (found.stator_resistance_ohm, true_.stator_resistance_ohm),
        (found.leakage_inductance_h, true_.leakage_inductance_h),
        (found.magnetizing_inductance_h, true_.magnetizing_inductance_h),
    ] {
        assert!((a / b - 1.0).abs() < 0.05, "{a} {b}");
    }
}

/// A speed that another machine was driven by, far from the rotor's: smoothing alone does not come back.
#[test]
fn a_speed_that_was_lost_is_searched_anew() {
    let r = recording(true);
    let other = scaled(3.0, 0.2, 1.0, 1.0);
    let lost = unseen(&r, &other);
    let e = lost.clone().with_speed_found_by(&truth(), &lost.start_state());
    let off = |e: &Experiment| {
        let (omega, _) = found(e);
        (omega[300..].iter().zip(&r.omega_m[300..]).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / omega[300..].len() as f64)
            .sqrt()
    };
    println!("{} {}", off(&lost), off(&e));
    assert!(off(&lost) > 15.0 && off(&e) < 1.0, "{} {}", off(&lost), off(&e));
}

/// A speed that another machine asked for bends as that machine's currents do. It is the speed that wanders little, not what it is off by: the true
/// machine does not pay for taking those bends out again.
#[test]
fn no_machine_is_favoured_by_a_speed_that_it_found() {
    let r = recording(true);
    for (r_s, r_r) in [(1.03, 1.0), (0.97, 1.03), (1.0, 0.95)] {
        let other = scaled(r_s, r_r, 1.0, 1.0);
        let e = unseen(&r, &other);
        let of = |machine: &Machine<f64>| cost(machine, std::slice::from_ref(&e), &[e.start_state()]) / e.count() as f64;
        println!("{r_s} {r_r}: the other machine {:.4}, the true one {:.4}", of(&other), of(&truth()));
        assert!(of(&truth()) < of(&other) && (0.95..1.05).contains(&of(&truth())));
    }
}

/// Whatever the motor file says, the run on the speed that it asks for can be fitted: what is wrong with the machine is not put on a shaft that no
/// torque could move so.
#[test]
fn a_wrong_machine_does_not_ask_for_an_absurd_speed() {
    let r = recording(true);
    for (resistance, leakage, magnetizing) in [(0.1, 0.3, 0.5), (5.0, 0.2, 3.0), (0.3, 5.0, 0.2), (8.0, 4.0, 1.0)] {
        let other = scaled(resistance, resistance, leakage, magnetizing);
        let e = unseen(&r, &other);
        let (omega, _) = found(&e);
        let fastest = omega.iter().fold(0.0, |most: f64, w| most.max(w.abs()));
        let left = cost(&other, std::slice::from_ref(&e), &[e.start_state()]);
        println!("{resistance} {leakage} {magnetizing}: up to {fastest} rad/s, {}", left / e.count() as f64);
        assert!(left.is_finite() && fastest < 1000.0, "{fastest} rad/s, {left}");
    }
}

/// A motor file is off by ten or twenty per cent: what that does to the currents is not put into the speed.
#[test]
fn a_machine_that_is_somewhat_wrong_asks_for_about_the_right_speed() {
    let r = recording(true);
    for (r_s, r_r, leakage, magnetizing) in [(1.2, 0.85, 1.2, 0.8), (0.8, 1.2, 0.8, 1.2), (1.1, 1.1, 0.9, 0.7)] {
        let e = unseen(&r, &scaled(r_s, r_r, leakage, magnetizing));
        let off = found(&e).0[300..].iter().zip(&r.omega_m[300..]).map(|(a, b)| (a - b).abs());
        let (sum, most) = off.clone().fold((0.0, 0.0), |(sum, most): (f64, f64), d| (sum + d * d, most.max(d)));
        let rms = (sum / off.len() as f64).sqrt();
        println!("{r_s} {r_r} {leakage} {magnetizing}: {rms} rad/s rms, {most} at most");
        assert!(rms < 5.0 && most < 30.0, "{rms} rad/s rms, {most} at most");
    }
}
