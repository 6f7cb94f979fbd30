//! What a fit costs, in simulations of its start: of data that no machine can have made, no more than twenty times the healthy fit, which takes about one
//! simulation for each parameter.

use super::*;

/// The most that a mistake may cost, times the healthy fit.
const MOST: f64 = 20.0;

fn cost(name: &str, spoil: impl Fn(&mut Experiment)) -> Option<f64> {
    let mut e = experiment(&recording(true));
    spoil(&mut e);
    let all = [e];
    match fit(&guess(), &all, &base_parameters_in(&guess(), &all), &FitOptions::default()) {
        Ok(f) => {
            assert!(f.cost.is_finite() && f.values().iter().all(|x| x.is_finite()), "{name}");
            println!("{name}: {:.0} simulations in {} iterations", f.work, f.iterations);
            Some(f.work)
        }
        Err(e) => {
            println!("{name}: {e}");
            None
        }
    }
}

/// What spoils a recording.
type Mistake = Box<dyn Fn(&mut Experiment)>;

/// Mistakes that the checks of a recording stop; here they are fitted all the same.
#[test]
fn a_recording_with_a_mistake_takes_no_more_than_twenty_times_the_work() {
    let healthy = cost("healthy", |_| ()).unwrap();
    let scaled = |k: usize, by: f64| move |e: &mut Experiment| e.channels[k].values.iter_mut().for_each(|x| *x *= by);
    let held = |k: usize, at: f64| move |e: &mut Experiment| e.channels[k].values.fill(at);
    let clock = |by: f64| move |e: &mut Experiment| e.sample_time_s *= by;
    let voltage = |of: fn(Complex<f64>) -> Complex<f64>| move |e: &mut Experiment| e.u_s.iter_mut().for_each(|u| *u = of(*u));
    let mistakes: [(&str, Mistake); 14] = [
        ("time in ms", Box::new(clock(1e3))),
        ("time in us", Box::new(clock(1e6))),
        ("time of no clock", Box::new(clock(1e30))),
        ("time in ks", Box::new(clock(1e-3))),
        ("an axis of the voltage reversed", Box::new(voltage(|u| u.conj()))),
        ("the voltage reversed", Box::new(voltage(|u| -u))),
        ("no voltage", Box::new(voltage(|u| u * 0.0))),
        ("voltage in kV", Box::new(voltage(|u| u * 1e-3))),
        ("a constant voltage", Box::new(voltage(|u| Complex::new(230.0, u.im)))),
        ("a current in mA", Box::new(scaled(0, 1e3))),
        ("a dead current sensor", Box::new(held(0, 0.0))),
        ("a current sensor that hangs", Box::new(held(1, 7.5))),
        ("a dead speed sensor", Box::new(held(2, 0.0))),
        ("a speed in rpm", Box::new(scaled(2, 30.0 / core::f64::consts::PI))),
    ];
    for (name, spoil) in mistakes {
        let Some(steps) = cost(name, spoil) else { continue };
        assert!(steps <= MOST * healthy, "{name}: {steps} simulations where {healthy} do");
    }
}

/// A clock that is wrong by this much is refused before a step is made.
#[test]
fn what_cannot_be_followed_is_refused_before_it_is_simulated() {
    for by in [1e6, 1e30] {
        let mut e = experiment(&recording(false));
        e.sample_time_s *= by;
        let all = [e];
        let refused = fit(&guess(), &all, &base_parameters_in(&guess(), &all), &FitOptions::default()).unwrap_err().to_string();
        assert!(refused.contains("leakage") || refused.contains("resistance"), "{refused}");
    }
}

/// Rows of a table that determine nothing, or that no machine has: as the checks stop them, here fitted all the same.
#[test]
fn a_table_with_a_mistake_takes_no_more_than_twenty_times_the_work_for_its_rows() {
    let cost = |name: &str, e: Experiment| {
        let all = [e];
        let free = base_parameters_in(&guess(), &all);
        let steps = fit(&guess(), &all, &free, &FitOptions::default()).map(|f| f.work);
        println!("{name}: {steps:?} simulations");
        steps.unwrap_or(0.0)
    };
    let whole = || tables::shown(&truth(), &[0.0, 3.0, 6.0, 9.0, 12.0, 15.0], None);
    let healthy = cost("six loads", whole());
    let changed = |change: fn(&mut Experiment)| {
        let mut e = whole();
        change(&mut e);
        e
    };
    for (name, e) in [
        ("three loads", tables::shown(&truth(), &[0.0, 8.0, 15.0], None)),
        ("one row twice", tables::shown(&truth(), &[5.0, 5.0], None)),
        ("torque all zero", changed(|e| e.tau_load.fill(0.0))),
        ("torque in Nmm", changed(|e| e.tau_load.iter_mut().for_each(|t| *t *= 1e3))),
        ("current in mA", changed(|e| e.channels[0].values.iter_mut().for_each(|i| *i *= 1e3))),
        ("power in kW", changed(|e| e.channels[1].values.iter_mut().for_each(|p| *p *= 1e-3))),
        ("speed stands", changed(|e| e.channels[3].values.fill(0.0))),
    ] {
        let steps = cost(name, e);
        assert!(steps <= MOST * healthy, "{name}: {steps} where {healthy} do");
    }
}
