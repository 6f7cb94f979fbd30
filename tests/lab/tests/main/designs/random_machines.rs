//! Claims that must hold for every machine, on random machines from 0.4 to 75 kW.

use super::support::{cases, decay, machine, top_speed};
use im_design::certificate::{Certificate, Claim, Design, Obligation};
use im_design::kubota::{KubotaRequest, best_rate, closed_form, least_norm};
use im_design::matrix::Matrix;
use im_design::sliding::{UtkinRegion, derdiyok, utkin};
use im_design::{DesignModel, LinearMachine, jadot, kubota_loop, linalg, sampled, thau, thau_box};
use proptest::prelude::*;

/// Round trip through text; checked as a stranger would.
fn reread(certificate: &Certificate) -> Certificate {
    let (read, margins) = Certificate::check_text(&certificate.to_text().unwrap()).unwrap();
    assert!(margins.iter().all(|m| m.margin > 0.0));
    read
}

proptest! {
    #![proptest_config(cases(40))]

    #[test]
    fn kubotas_condition_is_always_feasible(machine in machine(), share in 0.0..0.95f64) {
        let plant = DesignModel::Machine(machine);
        let c = plant.constants::<f64>();
        let w = top_speed(&machine);
        let request = KubotaRequest { speed_rad_s: [-w, w], rate_per_s: share * c.eta, flux_weight: 1.0 };
        let (closed, certificate) = closed_form(plant, &request).unwrap();
        reread(&certificate);
        let weighted = KubotaRequest { flux_weight: c.beta * c.beta, ..request };
        reread(&closed_form(plant, &weighted).unwrap().1);
        let (least, certificate) = least_norm(plant, &weighted).unwrap();
        reread(&certificate);
        prop_assert!(least.gain_at(w).norm() <= closed.gain_at(w).norm());
    }

    #[test]
    fn errors_decay_at_least_at_the_certified_rate_while_speed_jumps(
        machine in machine(), start in prop::array::uniform4(-1.0..1.0f64), jumps in prop::collection::vec(-1.0..1.0f64, 4)
    ) {
        let plant = DesignModel::Machine(machine);
        let c = plant.constants::<f64>();
        let w = top_speed(&machine);
        let request = KubotaRequest { speed_rad_s: [-w, w], rate_per_s: 0.5 * c.eta, flux_weight: c.beta * c.beta };
        let (design, certificate) = least_norm(plant, &request).unwrap();
        reread(&certificate);
        let mut e = Matrix::from_fn(4, 1, |i, _| start[i] * if i < 2 { 1.0 / c.beta } else { 1.0 });
        for jump in jumps {
            let time = 2e-3;
            let (before, after) = decay(&design.error_matrix(&c, jump * w), &design.p, &mut e, time);
            prop_assert!(after <= before * (-design.rate_per_s * time).exp() * (1.0 + 1e-9));
        }
    }

    #[test]
    fn altered_certificates_are_refused(machine in machine(), which in 0usize..8, relative in 1e-12..1e-3f64) {
        let plant = DesignModel::Machine(machine);
        let c = plant.constants::<f64>();
        let request = KubotaRequest { speed_rad_s: [-100.0, 100.0], rate_per_s: 0.9 * c.eta, flux_weight: 1.0 };
        let (design, certificate) = closed_form(plant, &request).unwrap();
        let mut altered = certificate.clone();
        let mut changed = design.clone();
        changed.gain[(which / 2, which % 2)] += relative * (1.0 + design.gain.norm());
        altered.design = changed.into();
        prop_assert!(altered.check().is_err(), "any alteration is visible");
        // With digest and margins forged as well, only what is still true passes: a rate above η never is.
        let forged = im_design::kubota::KubotaDesign { rate_per_s: c.eta * (1.0 + relative), ..design };
        prop_assert!(Certificate::seal(plant, forged).is_err());
    }

    #[test]
    fn switching_gains_are_proven(machine in machine(), flux in 0.3..1.5f64, error in 0.0..0.3f64) {
        let plant = DesignModel::Machine(machine);
        let c = plant.constants::<f64>();
        let w = top_speed(&machine);
        reread(&derdiyok(plant, w, flux, 1.0).unwrap().1);
        let region = UtkinRegion {
            speed_max_rad_s: w,
            flux_min_vs: flux,
            flux_error_max_vs: error * flux,
            current_error_max_a: 0.5 * error * c.beta * flux,
            current_max_a: 3.0 * flux / machine.mutual_inductance_h,
        };
        let (design, certificate) = utkin(plant, &region).unwrap();
        reread(&certificate);
        prop_assert!(design.omega0_rad_s >= w);
    }

    #[test]
    fn thau_reaches_the_limit_and_never_passes_it(machine in machine()) {
        let plant = DesignModel::Machine(machine);
        let c = plant.constants::<f64>();
        let (design, certificate) = thau::maximize(plant, 1e-2).unwrap();
        reread(&certificate);
        let share = design.lipschitz / thau::limit(&c);
        prop_assert!(share < 1.0 && share > 0.95, "{}", share);
        let beyond = thau::ThauDesign { lipschitz: thau::limit(&c) * 1.0001, ..design };
        prop_assert!(Certificate::seal(plant, beyond).is_err());
    }

    #[test]
    fn any_box_below_friction(machine in machine(), flux in 0.1..3.0f64, share in 0.1..0.9f64) {
        let plant = DesignModel::Machine(machine);
        let c = plant.constants::<f64>();
        let rate = share * c.friction_rate.min(c.eta);
        reread(&thau_box::any_box(plant, 2.0 * top_speed(&machine), flux, rate).unwrap().1);
    }

    #[test]
    fn stabilized_loop_is_stable_at_random_points(
        machine in machine(), speed in -1.0..1.0f64, slip in -1.0..1.0f64, gain in 0.01..10.0f64, rho in 0.02..10.0f64
    ) {
        let plant = DesignModel::Machine(machine);
        let c = plant.constants::<f64>();
        let at = kubota_loop::Point {
            speed_rad_s: speed * top_speed(&machine),
            slip_rad_s: 5.0 * slip * c.eta,
            flux_vs: 0.9,
        };
        prop_assume!((c.n_p * at.speed_rad_s + at.slip_rad_s).abs() > 0.5);
        let unit = 1.0 / (c.n_p * c.beta * 0.9).powi(2);
        let (k_p, k_i) = (gain * unit * c.gamma, gain * unit * c.gamma * c.gamma);
        let gains = kubota_loop::stabilized(plant, rho, 0.0, k_p, k_i).unwrap();
        prop_assert!(gains.decay(plant, at) > 0.0, "{}", gains.decay(plant, at));
    }
}

proptest! {
    #![proptest_config(cases(10))]

    #[test]
    fn a_gain_for_a_period_contracts(machine in machine()) {
        let plant = DesignModel::Machine(machine);
        let c = plant.constants::<f64>();
        let w = top_speed(&machine);
        // A flux error turns at n_pω and decays at η: forward Euler needs h well below 2η/(n_pω)².
        let period = (0.4 * c.eta / (c.n_p * w).powi(2)).min(50e-6);
        let (design, certificate) = sampled::design(plant, [-w, w], period, 0.2 * c.eta).unwrap();
        reread(&certificate);
        for speed in [-w, 0.3 * w, w] {
            prop_assert!(linalg::spectral_radius(&design.step_matrix(&c, speed)) <= design.contraction);
        }
    }

    #[test]
    fn passivity_based_loop_is_proven(machine in machine()) {
        let plant = DesignModel::Machine(machine);
        let c = plant.constants::<f64>();
        let w = c.n_p * top_speed(&machine);
        let request = jadot::JadotRequest {
            electrical_speed_rad_s: [-w, w],
            slip_rad_s: [-2.0 * c.eta, 2.0 * c.eta],
            flux_vs: 0.9,
            current_bandwidth_rad_s: 2.0 * c.gamma + 300.0,
            speed_bandwidth_rad_s: 2.0 * c.eta,
            damping: 0.8,
        };
        let (design, certificate) = jadot::design(plant, &request).unwrap();
        reread(&certificate);
        prop_assert!(design.electrical_rate_per_s > 0.0 && design.outer_rate_per_s > 0.0);
    }

    #[test]
    fn a_turning_box_is_certified(machine in machine()) {
        let plant = DesignModel::Machine(machine);
        let c = plant.constants::<f64>();
        let w = c.n_p * top_speed(&machine);
        let region = thau_box::BoxRegion {
            frame_rad_s: [0.6 * w, w],
            slip_rad_s: [-0.5 * c.eta, 0.5 * c.eta],
            flux_d_vs: [0.85, 0.95],
            flux_q_vs: [-0.03, 0.03],
            current_d_a: [0.0; 2],
            current_q_a: [0.0; 2],
        };
        let (design, certificate) = thau_box::fastest(plant, &region, 5.0 * c.eta, 1e6).unwrap();
        reread(&certificate);
        prop_assert!(design.rate_per_s > 0.0);
    }
}

/// A common P also proves more than the P of the design: the best rate is never below it.
#[test]
fn best_rate_is_at_least_the_one_designed_for() {
    let plant = DesignModel::Machine(LinearMachine::jadot_table_i());
    let c = plant.constants::<f64>();
    let request = KubotaRequest { speed_rad_s: [-160.0, 160.0], rate_per_s: 3.0, flux_weight: c.beta * c.beta };
    let (design, _) = closed_form(plant, &request).unwrap();
    let (best, certificate) = best_rate(plant, &design).unwrap();
    reread(&certificate);
    assert!(best.rate_per_s > 3.0, "{}", best.rate_per_s);
}

/// The obligations over floats and over rationals are the same matrices.
#[test]
fn floats_and_rationals_state_the_same() {
    let plant = DesignModel::Machine(LinearMachine::jadot_table_i());
    let request = KubotaRequest { speed_rad_s: [-160.0, 160.0], rate_per_s: 3.0, flux_weight: 1.0 };
    let design: Design = closed_form(plant, &request).unwrap().0.into();
    let floats = design.obligations(&plant.constants::<f64>()).unwrap();
    let rationals = design.obligations(&plant.constants::<im_design::exact::Rational>()).unwrap();
    for pair in floats.iter().zip(&rationals) {
        if let (Obligation::Definite(_, a), Obligation::Definite(_, b)) = pair {
            assert!((a - &b.to_f64()).norm() < 1e-9 * a.norm());
        }
    }
}
