use super::*;
use crate::tests::through;
use im_model::machines::{self, NamedMachine};
use im_model::simulation::Simulation;
use im_model::{Effects, Machine};
use proptest::prelude::*;

const M: NamedMachine = machines::JADOT_TABLE_I;

fn data() -> (Machine<f64>, MachineData<f64>) {
    let machine = Machine::base(M.parameters(), M.pole_pairs).unwrap();
    let current = 1.5 * M.rating.current_peak_a(&M.parameters(), M.pole_pairs);
    (machine, MachineData::of(&machine, current))
}

fn drive(known: &MachineData<f64>, slip_share: f64) -> VoltsPerHertz<f64> {
    let gains = VoltsPerHertzGains { slip_share, ..VoltsPerHertzGains::typical(known, 0.9) };
    VoltsPerHertz::try_new(known, &gains, 1e-4).unwrap()
}

/// The slip of a load is taken out, exactly with the right parameters; without compensation it is there, R_R τ/((3/2) n_p ψ_R²) to the drop of ψ_R.
#[test]
fn the_slip_of_a_load_is_compensated() {
    let (machine, known) = data();
    let s = through(&[[0.0, 0.0], [0.5, 0.0], [0.5, 100.0]], &[[0.0, 0.0], [2.0, 0.0], [2.2, 20.0]], 4.0);
    let speed = |share: f64| {
        let mut d = drive(&known, share);
        let run = Simulation::new(&machine, &s).controlled_by(&mut d).run().unwrap();
        assert!(run.recording.i_s.iter().all(|i| i.norm() < 1.1 * known.current_max_a));
        assert!((d.torque_nm() - 20.0).abs() < 1.0, "{}", d.torque_nm());
        assert_eq!(d.status(), DriveStatus::OK);
        (run.recording.omega_m[19_500], run.state.omega_m)
    };
    let (before, after) = speed(1.0);
    assert!((before - 100.0).abs() < 0.1 && (after - 100.0).abs() < 0.1, "{before} {after}");
    let (before, after) = speed(0.0);
    let slip = M.parameters().rotor_resistance_ohm * 20.0 / (1.5 * 2.0 * 0.9 * 0.9) / 2.0;
    assert!((before - 100.0).abs() < 0.3 && (100.0 - after - slip).abs() < 0.15 * slip, "{before} {after} {slip}");
}

/// Load for a moment beyond what the current limit carries (41 Nm): the frequency runs back with the shaft, the machine is not pulled out, and it is at its speed
/// again after the load.
#[test]
fn an_overload_slows_it_down_and_does_not_stall_it() {
    let (machine, known) = data();
    for (load, slowed) in [(35.0, 100.0), (50.0, 95.0)] {
        let s = through(
            &[[0.0, 0.0], [0.5, 0.0], [0.5, 100.0]],
            &[[0.0, 0.0], [2.0, 0.0], [2.2, load], [2.25, load], [2.35, 5.0]],
            5.0,
        );
        let mut d = drive(&known, 1.0);
        let run = Simulation::new(&machine, &s).controlled_by(&mut d).run().unwrap();
        let peak = run.recording.i_s.iter().fold(0.0f64, |p, i| p.max(i.norm()));
        assert!(peak < 1.3 * known.current_max_a, "{peak} of {}", known.current_max_a);
        let least = run.recording.omega_m[20_000..].iter().fold(f64::MAX, |l, w| l.min(*w));
        assert!(least > 20.0 && least < slowed, "{load}: {least}");
        assert!((run.state.omega_m - 100.0).abs() < 0.2, "{load}: {}", run.state.omega_m);
    }
}

/// What the droop is for: at half of the rated frequency without load, R_s compensated, the speed swings without it.
#[test]
fn without_droop_it_swings() {
    let (machine, known) = data();
    let s = through(&[[0.0, 0.0], [0.5, 0.0], [0.5, 50.0]], &[[0.0, 0.0]], 6.0);
    let swing = |droop: f64| {
        let gains = VoltsPerHertzGains { droop, ..VoltsPerHertzGains::typical(&known, 0.9) };
        let mut d = VoltsPerHertz::try_new(&known, &gains, 1e-4).unwrap();
        let run = Simulation::new(&machine, &s).controlled_by(&mut d).run().unwrap();
        run.recording.omega_m[50_000..].iter().fold(0.0f64, |x, w| x.max((w - 50.0).abs()))
    };
    let (with, without) = (swing(3.0), swing(0.0));
    assert!(with < 0.1 && without > 1.0, "{with} {without}");
}

/// Dead time, saturation and a sample of delay that it does not know: within a few per cent, and it does not oscillate at light load.
#[test]
fn it_is_damped_at_light_load_with_effects_that_it_does_not_know() {
    let (_, known) = data();
    let mut e = Effects::scaled(&M.rating, &M.parameters(), M.pole_pairs);
    e.main_flux_saturation.excess = 0.4;
    e.inverter_nonlinearity.voltage_v = 6.0;
    e.voltage_delay.delay_s = 1e-4;
    let machine = Machine::try_new(M.parameters(), M.pole_pairs, e).unwrap();
    for speed in [15.0, 40.0, 80.0] {
        let s = through(&[[0.0, 0.0], [0.5, 0.0], [0.5, speed]], &[[0.0, 0.0]], 4.0);
        let mut d = drive(&known.delayed(1e-4), 1.0);
        let run = Simulation::new(&machine, &s).controlled_by(&mut d).run().unwrap();
        let end = &run.recording.omega_m[35_000..];
        let (low, high) = end.iter().fold((f64::MAX, f64::MIN), |(l, h), w| (l.min(*w), h.max(*w)));
        assert!(high - low < 0.02 * speed && (low - speed).abs() < 0.07 * speed, "{speed}: {low} to {high}");
    }
}

#[test]
fn above_the_voltage_the_flux_gives_way() {
    let (machine, known) = data();
    let s = through(&[[0.0, 0.0], [0.5, 0.0], [0.5, 300.0]], &[[0.0, 0.0], [3.0, 0.0], [3.2, 4.0]], 6.0);
    let mut d = drive(&known, 1.0);
    let run = Simulation::new(&machine, &s).controlled_by(&mut d).run().unwrap();
    assert!((run.state.omega_m - 300.0).abs() < 3.0, "{}", run.state.omega_m);
    assert!(d.status().has(DriveStatus::FIELD_WEAKENING));
}

#[test]
fn what_is_no_gain_is_refused() {
    let (_, known) = data();
    let good = VoltsPerHertzGains::typical(&known, 0.9);
    for bad in [f64::NAN, -1.0, f64::INFINITY] {
        let refused = |g: VoltsPerHertzGains<f64>| VoltsPerHertz::try_new(&known, &g, 1e-4).is_err();
        assert!(refused(VoltsPerHertzGains { droop: bad, ..good }));
        assert!(refused(VoltsPerHertzGains { filter_rad_s: bad, ..good }));
        assert!(refused(VoltsPerHertzGains { slip_share: bad, ..good }));
        assert!(refused(VoltsPerHertzGains { voltage_share: bad, ..good }));
    }
    assert!(VoltsPerHertz::try_new(&known, &good, f64::NAN).is_err());
}

proptest! {
    #![proptest_config(crate::tests::cases(48))]
    /// Whatever comes in for 60 samples: every command is a voltage within the link, and the machine is at its speed again afterwards.
    #[test]
    fn whatever_comes_in_it_stays_finite_and_comes_back(bad in prop::collection::vec(prop::array::uniform6(crate::tests::anything()), 1..60)) {
        crate::tests::comes_back(|known| drive(known, 1.0), &bad)?;
    }
}
