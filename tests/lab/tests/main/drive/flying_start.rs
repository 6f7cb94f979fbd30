//! Caught while turning, with whatever flux the machine still carries.

use im_control::named::Supervised;
use im_model::simulation::{Simulation, Start};
use im_model::{Complex, Machine, State, machines, space_vector};
use proptest::prelude::*;

use super::common::DriveCase;
use super::random_machines::{any_machine, with_effects};

/// What a start did: largest current over its limit, largest torque over rated torque, largest and last change of speed over synchronous speed.
#[derive(Debug)]
struct Jolt {
    current: f64,
    torque: f64,
    speed: f64,
    end: f64,
}

/// Coasting: no stator current, the rotor's own keeps the flux.
fn coasting(machine: &Machine<f64>, omega_m: f64, psi_r: Complex<f64>) -> State<f64> {
    let k = machine.parameters().magnetizing_inductance_h / machine.parameters().rotor_inductance_h();
    State { psi_r, psi_s: psi_r * k, ..State::turning(omega_m) }
}

fn caught(drive: &mut dyn Supervised, truth: &Machine<f64>, case: &DriveCase, omega_m: f64, psi_r: Complex<f64>) -> Jolt {
    let mut s = case.scenario(omega_m.into(), 0.0.into(), 0.6);
    s.start = Start::State(coasting(truth, omega_m, psi_r));
    let run = Simulation::new(truth, &s).controlled_by(drive).with_internals().run().unwrap();
    let most = |x: &mut dyn Iterator<Item = f64>| x.fold(0.0f64, |m, x| m.max(x.abs()));
    let w = case.speed_rad_s();
    Jolt {
        current: most(&mut run.recording.i_s.iter().map(|i| i.norm())) / case.known.current_max_a,
        torque: most(&mut run.internals.unwrap().torque_nm.into_iter()) / case.rating.torque_nm,
        speed: most(&mut run.recording.omega_m.iter().map(|x| x - omega_m)) / w,
        end: (run.state.omega_m - omega_m).abs() / w,
    }
}

/// (3/2) n_p ψ_R e(T + delay)/L_σ over rated torque, e = ω_eψ_R: the torque of the current that rises until the emf is known.
fn pulse(case: &DriveCase, omega_m: f64, flux: f64) -> f64 {
    let (w, n_p) = (&case.known.windings, f64::from(case.known.pole_pairs));
    let k_r = w.mutual_inductance_h / w.rotor_inductance_h;
    let l = w.stator_inductance_h - k_r * w.mutual_inductance_h;
    let rise = (n_p * omega_m).abs() * (case.sample_time_s + case.known.voltage_delay_s) / l;
    1.5 * n_p * (k_r * flux).powi(2) * rise / case.rating.torque_nm
}

proptest! {
    #![proptest_config(ProptestConfig { cases: std::env::var("PROPTEST_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(12), ..ProptestConfig::default() })]
    /// Any machine, speed, and residual flux up to rated in any direction; saturation, dead time and a sample of delay unknown to the drive.
    #[test]
    fn a_turning_machine_is_caught_without_a_jolt(
        (machine, rating) in any_machine(), speed in prop_oneof![4 => -1.0..1.0f64, 1 => -0.02..0.02f64],
        flux in 0.0..1.0f64, phase in -3.2..3.2f64
    ) {
        let truth = with_effects(&machine, &rating);
        let case = DriveCase::new(&machine, &rating, 1e-4);
        let (omega_m, flux) = (speed * case.speed_rad_s(), flux * rating.rotor_flux_vs);
        for (name, mut drive) in case.drives() {
            let jolt = caught(drive.as_mut(), &truth, &case, omega_m, space_vector::unit(phase) * flux);
            let pulse = pulse(&case, omega_m, flux);
            // The first pulse, as saturation and the tail of the regulator shape it, and what magnetizing at a wrong flux angle leaves.
            prop_assert!(jolt.current < 1.0 && jolt.torque < 1.2 * pulse + 0.15, "{name}: {jolt:?}, pulse {pulse}");
            prop_assert!(jolt.speed < 0.02 && jolt.end < 0.005, "{name}: {jolt:?}");
        }
    }
}

/// The drive of least current at an imposed speed, with 3 µs of dead time: without flux to know of, its current would drive or brake by chance.
#[test]
fn the_drive_of_least_current_catches_a_machine_too() {
    let machine = super::mtpa::machine();
    let m = machines::JADOT_TABLE_I;
    let case = DriveCase::new(&machine, &m.rating, 0.0);
    let law = super::mtpa::law(&machine);
    for (asked, speed, flux, phase) in [
        (0.0, 60.0, 0.9, 1.0),
        (10.0, 60.0, 0.9, -2.5),
        (10.0, -100.0, 0.5, 2.0),
        (-10.0, 120.0, 0.7, 0.3),
        (10.0, 80.0, 0.0, 0.0),
    ] {
        let mut s = super::mtpa::scenario(asked);
        (s.imposed_speed, s.duration_s) = (Some(f64::into(speed)), 1.5);
        s.start = Start::State(coasting(&machine, speed, space_vector::unit(phase) * flux));
        let mut drive = case.drive("mtpa", Some(law));
        let run = Simulation::new(&machine, &s).controlled_by(drive.as_mut()).with_internals().run().unwrap();
        let torque = run.internals.unwrap().torque_nm;
        // Means over 4 ms, for the ripple of decisions every 100 µs.
        let means: Vec<f64> = torque.chunks(40).map(|x| x.iter().sum::<f64>() / 40.0).collect();
        let [low, high] = means.iter().fold([0.0f64; 2], |[l, h], x| [l.min(*x), h.max(*x)]);
        let [against, along] = if asked < 0.0 { [-high, -low] } else { [low, high] };
        // With more flux than the torque needs the same current gives more; 3.5 Nm is what decisions every 100 µs leave at zero current.
        assert!(against > -3.5 && along < 1.4 * asked.abs() + 3.5, "{asked} Nm at {speed} rad/s: {low} to {high}");
        let last = means[means.len() - 20..].iter().sum::<f64>() / 20.0;
        assert!((last - asked).abs() < 0.8, "{last} of {asked} Nm in the end");
    }
}
/// At speeds where the flux's emf is beyond the link no controller begins before the flux has decayed: the current is what the voltage that is lacking
/// drives through the leakage, and falls with the flux.
#[test]
fn flux_beyond_the_link_is_left_to_decay() {
    let m = machines::JADOT_TABLE_I;
    let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
    let case = DriveCase::new(&machine, &m.rating, 0.0);
    for speed in [1.2, 1.4, 1.6] {
        for (name, mut drive) in case.drives() {
            let jolt = caught(drive.as_mut(), &machine, &case, speed * case.speed_rad_s(), Complex::new(0.9, 0.0));
            // (ωψ − U_dc/√3)/ωL_σ, beside the current that magnetizes.
            let (omega, k_r) = (speed * case.speed_rad_s() * 2.0, 0.975);
            let lacking = (omega * 0.9 * k_r - case.dc_voltage_v / 3f64.sqrt()).max(0.0) / (omega * 0.0079);
            assert!(jolt.current < 0.5 + lacking / case.known.current_max_a, "{speed} {name}: {jolt:?}, {lacking} A");
            assert!(jolt.speed < 0.05 && jolt.end < 0.001, "{speed} {name}: {jolt:?}");
        }
    }
}
