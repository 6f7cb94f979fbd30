//! Kenné's law with switching gains proven by the design crate, on machines at the corners of the region they are proven for.

use im_control::kenne::{input_gains, switching_gain};
use im_control::{Kenne, KenneGains};
use im_design::DesignModel;
use im_design::kenne::{KenneRegion, design};
use im_model::simulation::Simulation;
use im_model::{BaseParameter, Machine, ParameterId, machines};

use super::common::{DriveCase, points};

fn region() -> KenneRegion {
    KenneRegion {
        flux_uncertainty: 0.05,
        stator_resistance_ratio: [0.8, 1.2],
        rotor_resistance_ratio: [0.9, 1.1],
        reference_max_rad_s3: 40_000.0,
        load_error_rad_s2: 50.0,
        load_rate_rad_s3: 1000.0,
        c_omega: 40.0,
        c_lambda: 30.0,
        reach_omega: 1000.0,
        ..KenneRegion::certain(130.0, [0.85, 0.95], 20.0, 330.0)
    }
}

#[test]
fn designed_gains_hold_on_the_corners_of_their_region() {
    let m = machines::JADOT_TABLE_I;
    let base = Machine::base(m.parameters(), m.pole_pairs).unwrap();
    let case = DriveCase::new(&base, &m.rating, 0.0);
    let (proven, certificate) = design(DesignModel::Machine(im_design::LinearMachine::jadot_table_i()), &region(), 0.05).unwrap();
    certificate.check().unwrap();
    let mut gains = KenneGains::typical(&case.known, 0.9, case.dc_voltage_v, case.sample_time_s);
    (gains.k_sq, gains.k_sd) = (proven.k_sq, proven.k_sd);
    gains.set_boundary_layers(&case.known, 0.9, 1500.0);
    for (r_s, r_r) in [(0.8, 0.9), (0.8, 1.1), (1.2, 0.9), (1.2, 1.1)] {
        let scaled = |p: BaseParameter, factor: f64| (ParameterId::Base(p), factor * base.get(ParameterId::Base(p)));
        let changes = [scaled(BaseParameter::StatorResistance, r_s), scaled(BaseParameter::RotorResistance, r_r)];
        let truth = base.with(&changes).unwrap();
        let mut drive = Kenne::try_new(&case.known, &gains).unwrap();
        let s = case.scenario(points(&[[0.4, 0.0], [0.8, 120.0]]), points(&[[1.2, 0.0], [1.2, 20.0]]), 2.0);
        let run = Simulation::new(&truth, &s).controlled_by(&mut drive).run().unwrap();
        assert!((run.state.omega_m - 120.0).abs() < 0.2, "{r_s} {r_r}: {} rad/s", run.state.omega_m);
    }
}

/// (25) as the controller's crate has it is what the design crate proves, for a region in which only the reach and the flux count.
#[test]
fn the_condition_of_the_controller_is_that_of_the_design() {
    let m = machines::JADOT_TABLE_I;
    let base = Machine::base(m.parameters(), m.pole_pairs).unwrap();
    let case = DriveCase::new(&base, &m.rating, 0.0);
    let exact = KenneRegion {
        flux_uncertainty: 0.0,
        stator_resistance_ratio: [1.0, 1.0],
        rotor_resistance_ratio: [1.0, 1.0],
        load_error_rad_s2: 0.0,
        load_rate_rad_s3: 0.0,
        ..region()
    };
    let (proven, _) = design(DesignModel::Machine(im_design::LinearMachine::jadot_table_i()), &exact, 0.05).unwrap();
    let [b_omega, b_lambda] = input_gains(&case.known, exact.flux_vs[0]);
    let k_sq = switching_gain(0.0, exact.reach_omega, [b_omega; 2], 1e3);
    let k_sd = switching_gain(0.0, exact.reach_lambda, [b_lambda; 2], 1e3);
    assert!(
        (proven.k_sq / k_sq - 1.0).abs() < 1e-9 && (proven.k_sd / k_sd - 1.0).abs() < 1e-9,
        "{} {k_sq} {} {k_sd}",
        proven.k_sq,
        proven.k_sd
    );
}
