//! Section VI of Jadot et al. in simulation: a bench that the controller does not know.

use im_model::simulation::Profile;

use im_lab::jadot_experiment::{Experiment, Seen, cold, nameplate};

/// "A clear improvement … for the load torque and current estimation": from the nameplate's estimates, R_s measured, at speed and rated torque.
#[test]
fn adaptation_mends_the_torque_estimate_on_a_bench_with_saturation_and_dead_time() {
    let bench = Experiment {
        duration_s: 8.0,
        speed_rad_s: Profile::points([[0.5, 0.0], [2.0, 150.0]]).unwrap(),
        load_nm: Profile::points([[2.5, 0.0], [3.5, 26.0]]).unwrap(),
        heats: false,
        start: nameplate().scaled([1.0, 1.0, cold().values()[2] / nameplate().values()[2], 1.0]),
    };
    let last = |rows: &[Seen], y: &dyn Fn(&Seen) -> f64| rows[rows.len() - 20..].iter().map(y).sum::<f64>() / 20.0;
    let torque = |r: &Seen| r.torque_hat_nm / r.load_nm - 1.0;
    let [none, reduced] = [false, true].map(|adapts| bench.run(adapts));
    assert!(last(&none, &torque) > 0.25, "without: {}", last(&none, &torque));
    assert!(last(&reduced, &torque).abs() < 0.02, "with: {}", last(&reduced, &torque));
    // The saturated inductance of the flux that is there.
    let l = last(&reduced, &|r| r.estimates[1] / r.truth[2] - 1.0);
    assert!(l.abs() < 0.05, "{l}");
    // The current that the load needs at the flux that is asked for, not more.
    assert!(last(&none, &|r| r.current_a) > 1.05 * last(&reduced, &|r| r.current_a));
}
