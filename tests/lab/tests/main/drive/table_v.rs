//! The drive of Kwon et al. on the machine of their Table V.

use im_control::MtpaLaw;
use im_design::mtpa::{AirGap, Aqdm, for_torque};
use im_model::space_vector::unit;
use im_observers::LoadTorqueModel;

use im_lab::aqdm::{AqdmPlant, SOURCES, SPEED_RAD_S, fitted, run_with};
use im_lab::kwon::sensorless;

/// On a rotating voltage, in steady state: Fig. 6 with (24).
#[test]
fn the_machine_of_table_v_settles_on_its_circuit() {
    for (voltage, slip) in [(330.0, 1.0), (330.0, 2.7), (150.0, 4.0), (330.0, 20.0)] {
        let mut plant = AqdmPlant::new(SPEED_RAD_S);
        let (omega, h) = (2.0 * SPEED_RAD_S + slip, 1e-4);
        for k in 0..80_000 {
            // The mean of a turning voltage over a step.
            let half = 0.5 * omega * h;
            plant.step(unit(omega * h * (f64::from(k) + 0.5)) * (voltage * half.sin() / half), h);
        }
        let now = plant.currents();
        let (current, torque) = Aqdm::kwon_table_v().operate(now.psi_m.norm(), slip);
        // The held voltage bends the current within a step by ωh·uh/12L = 8 mA; the third branch's time constant is the second's here.
        let (i, t) = (now.i_s.norm() / 2f64.sqrt(), plant.torque_nm());
        assert!((i - current).abs() < 1.2e-2 && (t / torque - 1.0).abs() < 1e-4, "{voltage} {slip}: {i} {current} {t} {torque}");
    }
}

/// With the speed measured, and with that of each observer, which knows but a T circuit of the machine.
#[test]
fn the_current_is_the_least_within_one_percent_with_the_speed_of_every_observer() {
    let (circuit, law) = (Aqdm::kwon_table_v(), fitted());
    for source in SOURCES {
        let s = run_with(source, &law, 1.0, 150.0).unwrap();
        let least = for_torque(&circuit, s.torque_nm).unwrap().current_rms_a;
        assert!(
            (s.current_rms_a / least - 1.0).abs() < 0.01 && (s.torque_nm / 150.0 - 1.0).abs() < 0.01,
            "{source}: {s:?}, least {least}"
        );
    }
}

/// (30), (31) as printed, from 20 to 200 Nm: the torque as exact as (30) is, with the least current for what it is.
#[test]
fn the_printed_laws_give_the_least_current_on_their_machine() {
    let circuit = Aqdm::kwon_table_v();
    for torque in [20.0, 200.0] {
        let s = run_with("sensor", &MtpaLaw::kwon_printed(), 1.0, torque).unwrap();
        let least = for_torque(&circuit, s.torque_nm).unwrap().current_rms_a;
        assert!(
            (s.current_rms_a / least - 1.0).abs() < 0.01 && (s.torque_nm / torque - 1.0).abs() < 0.03,
            "{torque}: {s:?}, least {least}"
        );
    }
}

/// Fig. 12.
#[test]
fn a_tenth_more_or_less_slip_gives_less_torque_with_the_speed_measured_and_estimated() {
    for source in ["sensor", "thau, balanced"] {
        let [less, law, more] = [0.9, 1.0, 1.1].map(|f| run_with(source, &fitted(), f, 150.0).unwrap().torque_nm);
        // The circuit has 148.4, 150.4, 148.8 Nm.
        assert!(law > less + 1.0 && law > more + 1.0, "{source}: {less} {law} {more}");
    }
}

/// The drive of Fig. 4 with ω̂ in the place of ω, from rest: it reaches the speed that its torque carries, and the observer with it.
#[test]
fn the_drive_of_fig_4_runs_without_its_speed_sensor() {
    for load in [LoadTorqueModel::EqualToTorque, LoadTorqueModel::Balanced] {
        let (truth, e) = sensorless(load, 3.0).unwrap();
        let last = truth.len() - 1;
        // 150 Nm less 0.1 N m s/rad of friction carry the load at 91.5 rad/s.
        assert!((truth.omega[last] / 91.5 - 1.0).abs() < 0.015, "{load:?}: {}", truth.omega[last]);
        for k in (truth.at(1.5)..truth.len()).step_by(100) {
            assert!((e[k].omega_m - truth.omega[k]).abs() < 1.0, "{load:?} {k}: {} {}", e[k].omega_m, truth.omega[k]);
        }
    }
}
