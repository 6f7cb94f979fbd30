//! What an observer owes to the machine's symmetry: it has no preferred direction of rotation, and no preferred axis.

use im_lab::observation::{Running, Truth, basis, every_observer, held, machine, volts_per_hertz};
use im_model::machines::{JADOT_TABLE_I, NamedMachine};
use im_model::space_vector::unit;
use im_observers::*;

const H: f64 = 1e-4;
const M: NamedMachine = JADOT_TABLE_I;

/// Gains of no meaning, every entry of which counts.
fn boxed() -> ThauBoxGains {
    ThauBoxGains {
        frame_rad_s: [10.0, 400.0],
        gain: [[0.3, 2.0], [0.05, 0.02], [-0.03, 0.04], [30.0, -5.0], [5.0, 30.0]],
        gain_per_frame_speed: [[1e-3, 2e-3], [1e-4, -1e-4], [2e-4, 1e-4], [0.02, 0.05], [-0.05, 0.02]],
    }
}

/// The every_observer with what one starts from, and those with options that see more of the input.
fn all(b: Basis<f64>) -> Vec<Running> {
    let (machine, rating) = (machine(&M), &M.rating);
    let mut all = every_observer(&machine, rating, b);
    let (p, i) = KubotaGains::speed_law(&machine, rating, 100.0);
    let euler = Kubota::discretized(b, KubotaGains::without_feedback(p, i), Discretization::ForwardEuler);
    all.push(Running::from_rest("Kubota, Euler", euler.unwrap()));
    all.push(Running::from_rest("Thau in a box", Thau::in_box(b, boxed(), LoadTorqueModel::Balanced).unwrap()));
    let euler = Thau::in_box_discretized(b, boxed(), LoadTorqueModel::Balanced, Discretization::ForwardEuler);
    all.push(Running::from_rest("Thau in a box, Euler", euler.unwrap()));
    let layer = UtkinGains { boundary_layer_avs: 5.0, ..UtkinGains::for_machine(&machine, rating) };
    all.push(Running::from_rest("Utkin, layer", Utkin::try_new(b, layer).unwrap()));
    all
}

/// Currents, voltages and speed of the mirror image give the mirror image of the estimates, bit by bit but for the rounding of sums.
#[test]
fn a_machine_that_turns_backward_is_seen_as_the_mirror_image() {
    let truth = Truth::of(&machine(&M), &volts_per_hertz(&M, 40.0, 8.0, 1.3));
    for (mut forward, mut backward) in all(basis(&M, H)).into_iter().zip(all(basis(&M, H))) {
        for k in 0..truth.len() {
            let x = truth.input(k);
            let mirrored = Input::new(x.u_s.conj(), x.i_s.conj()).with_speed(-truth.omega[k]);
            let (a, b) = (forward.step(&x.with_speed(truth.omega[k])), backward.step(&mirrored));
            let off = (a.rotor_flux_vs - b.rotor_flux_vs.conj()).norm() + (a.omega_m + b.omega_m).abs();
            assert!(off < 1e-6 && a.status == b.status, "{} at row {k}: {off}", forward.name);
        }
    }
}

/// Axes turned by any angle turn what is estimated along. Not Derdiyok's: its signs belong to the axes.
#[test]
fn turned_axes_turn_the_estimates_along() {
    let truth = Truth::of(&machine(&M), &volts_per_hertz(&M, 40.0, 8.0, 1.3));
    let turn = unit(0.7);
    for (mut one, mut other) in all(basis(&M, H)).into_iter().zip(all(basis(&M, H))).filter(|(o, _)| o.name != "Derdiyok") {
        for k in 0..truth.len() {
            let x = truth.input(k);
            let turned = Input::new(x.u_s * turn, x.i_s * turn).with_speed(truth.omega[k]);
            let (a, b) = (one.step(&x.with_speed(truth.omega[k])), other.step(&turned));
            let off = (a.rotor_flux_vs * turn - b.rotor_flux_vs).norm() + (a.omega_m - b.omega_m).abs();
            assert!(off < 1e-6, "{} at row {k}: {off}", one.name);
        }
    }
}

/// A box gain is that of the speed the flux turns with, n_pω plus slip: one that vanishes at this very speed does nothing.
#[test]
fn a_box_gain_is_taken_at_the_speed_of_the_flux() {
    let (speed, slip) = (60.0, 12.0);
    let truth = Truth::of(&machine(&M), &held(&M, speed, slip, 0.5));
    // A resistance that is wrong by a fifth keeps the current error alive.
    let p = im_model::TParameters { stator_resistance_ohm: 1.2 * M.parameters().stator_resistance_ohm, ..M.parameters() };
    let wrong = Basis::<f64>::try_new(&im_model::Machine::base(p, M.pole_pairs).unwrap(), &M.rating, H).unwrap();
    let flux_after = |turns_at: f64| {
        let row = [0.0, 0.2];
        let slope = [[0.0; 2], row, row, [0.0; 2], [0.0; 2]];
        let gains = ThauBoxGains {
            frame_rad_s: [0.0, 400.0],
            gain: slope.map(|r| r.map(|x| -turns_at * x)),
            gain_per_frame_speed: slope,
        };
        let o = Thau::in_box(wrong, gains, LoadTorqueModel::Balanced).unwrap();
        let e = truth.observe_from(&o, 1, truth.state(&o, 0));
        let none = Thau::in_box(
            wrong,
            ThauBoxGains { gain: [[0.0; 2]; 5], gain_per_frame_speed: [[0.0; 2]; 5], ..gains },
            LoadTorqueModel::Balanced,
        );
        let n = truth.observe_from(&none.unwrap(), 1, truth.state(&o, 0));
        // Balanced, and without a gain for it, the speed stays where it is put.
        im_lab::observation::rms(e.iter().zip(&n).map(|(a, b)| (a.rotor_flux_vs - b.rotor_flux_vs).norm()))
    };
    let at = |slip: f64| flux_after(2.0 * speed + slip);
    let (right, no_slip, other_sign) = (at(slip), at(0.0), at(-slip));
    assert!(right < 0.4 * no_slip && right < 0.25 * other_sign, "{right} {no_slip} {other_sign}");
}
