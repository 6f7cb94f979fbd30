use super::*;
use crate::tests::through;
use im_model::machines::{self, NamedMachine};
use im_model::simulation::{Profile, Scenario, Simulation, Source};
use im_model::space_vector::unit;
use im_model::{Effects, Machine};
use proptest::prelude::*;

const M: NamedMachine = machines::JADOT_TABLE_I;
const H: f64 = 2.5e-5;

fn data() -> (Machine<f64>, MachineData<f64>) {
    let machine = Machine::base(M.parameters(), M.pole_pairs).unwrap();
    let current = 1.5 * M.rating.current_peak_a(&M.parameters(), M.pole_pairs);
    (machine, MachineData::of(&machine, current))
}

fn drive(known: &MachineData<f64>, sample_time_s: f64) -> DirectTorque<f64> {
    DirectTorque::try_new(known, &DirectTorqueGains::typical(known, 0.9, 560.0, sample_time_s)).unwrap()
}

fn scenario(speed: &[[f64; 2]], load: &[[f64; 2]], duration_s: f64) -> Scenario {
    Scenario { sample_time_s: H, ..through(speed, load, duration_s) }
}

/// Every direction lies in the sector of the nearest vector.
#[test]
fn the_sector_is_that_of_the_nearest_vector() {
    for k in 0..720 {
        let x = 0.5 * f64::from(k) + 0.1;
        let nearest = ((x / 60.0).round() as usize) % 6;
        assert_eq!(sector(unit(x.to_radians())), nearest, "{x}");
        let v = vector(nearest, 1.5) - unit(60.0 * nearest as f64 * std::f64::consts::PI / 180.0);
        assert!(v.norm() < 1e-12);
    }
}

/// Speed and torque follow, the flux stays within its bands and the ripple of a sample, the current within its limit.
#[test]
fn speed_torque_and_flux_are_followed() {
    let (machine, known) = data();
    for delay in [0.0, H] {
        let mut e = Effects::none();
        e.voltage_delay.delay_s = delay;
        let machine = machine.with_effects(e).unwrap();
        let s = scenario(
            &[[0.0, 0.0], [0.3, 0.0], [0.3, 120.0], [2.0, 120.0], [2.0, -40.0]],
            &[[0.0, 0.0], [1.0, 0.0], [1.0, 20.0]],
            3.0,
        );
        let mut d = drive(&known.delayed(delay), H);
        let run = Simulation::new(&machine, &s).controlled_by(&mut d).with_internals().run().unwrap();
        let w = &run.recording.omega_m;
        let at = |t: f64| (t / H) as usize;
        let mean = |from: f64, to: f64| w[at(from)..at(to)].iter().sum::<f64>() / (at(to) - at(from)) as f64;
        assert!((mean(0.95, 1.0) - 120.0).abs() < 0.3, "{}", mean(0.95, 1.0));
        assert!((mean(1.9, 2.0) - 120.0).abs() < 0.3, "{}", mean(1.9, 2.0));
        assert!((mean(2.9, 3.0) + 40.0).abs() < 0.3, "{}", mean(2.9, 3.0));
        let x = run.internals.unwrap();
        let torque = x.torque_nm[at(1.8)..at(2.0)].iter().sum::<f64>() / (at(2.0) - at(1.8)) as f64;
        assert!((torque - 20.0 - M.parameters().viscous_friction_nm_s_per_rad * 120.0).abs() < 0.3, "{torque}");
        let flux = x.states[at(0.5)..].iter().map(|s| s.psi_r.norm());
        let (low, high) = flux.fold((f64::MAX, 0.0f64), |(l, h), p| (l.min(p), h.max(p)));
        assert!(low > 0.85 && high < 0.96, "{low} {high}");
        let peak = run.recording.i_s.iter().fold(0.0f64, |p, i| p.max(i.norm()));
        assert!(peak < 1.15 * known.current_max_a, "{peak} of {}", known.current_max_a);
    }
}

/// Torque from nothing to rated within 2 ms: there is no current loop in the way.
#[test]
fn torque_is_there_at_once() {
    let (machine, known) = data();
    let gains = DirectTorqueGains { follows_torque: true, ..DirectTorqueGains::typical(&known, 0.9, 560.0, H) };
    let mut d = DirectTorque::try_new(&known, &gains).unwrap();
    let mut s = scenario(&[[0.0, 0.0]], &[[0.0, 0.0]], 0.6);
    let torque_nm = Profile::points([[0.0, 0.0], [0.5, 0.0], [0.5, 25.0]]).unwrap();
    let Source::Controller { references, .. } = &mut s.source else { unreachable!() };
    references.torque_nm = torque_nm;
    s.imposed_speed = Some(100.0.into());
    let run = Simulation::new(&machine, &s).controlled_by(&mut d).with_internals().run().unwrap();
    let torque = run.internals.unwrap().torque_nm;
    let there = torque[(0.5 / H) as usize..].iter().position(|t| *t > 25.0).unwrap();
    assert!((there as f64) * H < 2e-3, "{there}");
    let mean = torque[(0.55 / H) as usize..].iter().sum::<f64>() / (0.05 / H);
    assert!((mean - 25.0).abs() < 0.8, "{mean}");
}

#[test]
fn what_is_no_gain_is_refused() {
    let (_, known) = data();
    let good = DirectTorqueGains::typical(&known, 0.9, 560.0, H);
    for bad in [f64::NAN, -1.0, f64::INFINITY] {
        let refused = |g: DirectTorqueGains<f64>| DirectTorque::try_new(&known, &g).is_err();
        assert!(refused(DirectTorqueGains { torque_band_nm: bad, ..good }));
        assert!(refused(DirectTorqueGains { flux_band: bad, ..good }));
        assert!(refused(DirectTorqueGains { crossover_rad_s: bad, ..good }));
        assert!(refused(DirectTorqueGains { dc_voltage_v: bad, ..good }));
    }
}

proptest! {
    #![proptest_config(crate::tests::cases(48))]
    /// Whatever comes in for 60 samples: every command is a voltage within the link, and the machine is at its speed again afterwards.
    #[test]
    fn whatever_comes_in_it_stays_finite_and_comes_back(bad in prop::collection::vec(prop::array::uniform6(crate::tests::anything()), 1..60)) {
        crate::tests::comes_back(|known| drive(known, 1e-4), &bad)?;
    }
}
