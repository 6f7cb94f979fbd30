//! At and beyond the limits of voltage and current, and through a bridge with dead time.

use im_control::modulation::DeadTimeCompensation;
use im_control::{Drive, DriveStatus, Reports};
use im_model::simulation::{Bridge, CarrierPwm, Command, Controller, Inverter, Measured, Reference, Simulation, Source};
use im_model::{Complex, Machine, machines};

use super::common::{DriveCase, points};

fn case() -> (Machine<f64>, DriveCase) {
    let m = machines::JADOT_TABLE_I;
    let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
    let case = DriveCase::new(&machine, &m.rating, 0.0);
    (machine, case)
}

#[test]
fn above_rated_speed_the_flux_gives_way_and_the_speed_is_reached() {
    let (machine, case) = case();
    for (name, mut drive) in case.drives() {
        let s = case.scenario(points(&[[0.4, 0.0], [1.2, 260.0]]), points(&[[1.5, 0.0], [1.5, 6.0]]), 3.0);
        let run = Simulation::new(&machine, &s).controlled_by(drive.as_mut()).run().unwrap();
        assert!((run.state.omega_m - 260.0).abs() < 1.0, "{name}: {} rad/s", run.state.omega_m);
        // The voltage of 0.9 Vs at 520 rad/s would be 470 V; the link gives 355 V, of which 0.92 are used.
        let psi = run.state.psi_r.norm();
        assert!((0.5..0.7).contains(&psi), "{name}: {psi} Vs");
        let peak = run.recording.i_s.iter().fold(0.0f64, |p, i| p.max(i.norm()));
        assert!(peak < 1.15 * case.known.current_max_a, "{name}: {peak} A");
    }
}

/// Twice the rated torque for half a second, more than the current allows: the current is at its limit, the speed falls, and comes back.
#[test]
fn overload_is_carried_as_far_as_the_current_allows() {
    let (machine, case) = case();
    for (name, mut drive) in case.drives() {
        let load = points(&[[1.0, 0.0], [1.0, 60.0], [1.15, 60.0], [1.15, 5.0]]);
        let s = case.scenario(points(&[[0.4, 0.0], [0.8, 120.0]]), load, 2.5);
        let run = Simulation::new(&machine, &s).controlled_by(drive.as_mut()).run().unwrap();
        let (w, i) = (&run.recording.omega_m, &run.recording.i_s);
        let peak = i.iter().fold(0.0f64, |p, i| p.max(i.norm()));
        assert!(peak < 1.2 * case.known.current_max_a, "{name}: {peak} A of {}", case.known.current_max_a);
        assert!(w[11_400] < 90.0, "{name}: {} rad/s under overload", w[11_400]);
        assert!((run.state.omega_m - 120.0).abs() < 0.3, "{name}: {} rad/s after it", run.state.omega_m);
    }
}

/// A voltage, whatever is measured.
#[derive(Clone)]
struct Steady(Complex<f64>);

impl Controller<f64> for Steady {
    fn step(&mut self, _: &Measured<f64>, _: &Reference<f64>) -> Command<f64> {
        Command::Voltage(self.0)
    }
}
impl Reports for Steady {}

/// Direct voltage on a machine at rest, through a bridge whose dead time takes 24 V of every phase: compensated, the current is u/R_s.
#[test]
fn compensated_dead_time_does_not_show() {
    let (machine, case) = case();
    let bridge = Bridge { dead_time_s: 4e-6, ..Bridge::ideal(case.dc_voltage_v) };
    // More than the dead time takes: below that a phase can stay clamped at zero current, where nothing is known of the sign.
    for u in [Complex::new(40.0, 0.0), Complex::new(20.0, 36.0), Complex::new(-20.0, 38.0)] {
        let current = |compensated: bool| {
            let mut drive = Drive::try_new(Steady(u), &case.limits()).unwrap();
            if compensated {
                drive = drive.compensating(&DeadTimeCompensation::of(&bridge, 1e-4, 0.05)).unwrap();
            }
            let mut s = case.scenario(0.0.into(), 0.0.into(), 1.0);
            s.inverter = Inverter::CarrierPwm(CarrierPwm { half_period_s: 5e-5 }, bridge);
            s.imposed_speed = Some(0.0.into());
            *Simulation::new(&machine, &s).controlled_by(&mut drive).run().unwrap().recording.i_s.last().unwrap()
        };
        let expected = u / machine.parameters().stator_resistance_ohm;
        let [without, with] = [false, true].map(|c| (current(c) - expected).norm() / expected.norm());
        // The ripple of 10 kHz moves the zero crossings a little.
        assert!(with < 0.05 && without > 0.3, "{u}: {with} with, {without} without");
    }
}

#[test]
fn the_status_says_what_limits() {
    let (machine, case) = case();
    // The flux of an unloaded drive of least current is below what the voltage allows.
    for (name, mut drive) in case.drives().filter(|(name, _)| !name.starts_with("least")) {
        let mut s = case.scenario(points(&[[0.4, 0.0], [1.2, 260.0]]), 0.0.into(), 2.0);
        if let Source::Controller { name, .. } = &mut s.source {
            name.clear();
        }
        Simulation::new(&machine, &s).controlled_by(drive.as_mut()).run().unwrap();
        assert!(drive.status().has(DriveStatus::FIELD_WEAKENING), "{name}: {}", drive.status());
    }
}
