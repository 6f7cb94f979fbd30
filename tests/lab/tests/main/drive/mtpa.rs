//! The drive of Kwon et al. on a saturated machine: delta modulation, dead time, and the least current for the torque.

use im_control::mtpa::{LawForm, MtpaLaw};
use im_control::{FieldOriented, FieldOrientedGains, MachineData, Mtpa, MtpaGains, ReferenceShaper, SpeedLoop, SpeedRegulator};
use im_design::mtpa::laws::fit_log;
use im_design::mtpa::{TCircuit, for_torque};
use im_model::simulation::{
    Bridge, Controller, DeltaModulator, Inverter, Load, Profile, References, Scenario, Simulation, Source,
};
use im_model::{Effects, Machine, machines};
use proptest::prelude::*;

use super::common::DriveCase;
use super::random_machines::any_machine;

pub fn machine() -> Machine<f64> {
    let m = machines::JADOT_TABLE_I;
    let mut e = Effects::scaled(&m.rating, &m.parameters(), m.pole_pairs);
    e.main_flux_saturation.excess = 0.5;
    Machine::try_new(m.parameters(), m.pole_pairs, e).unwrap()
}

pub fn scenario(torque: f64) -> Scenario {
    let bridge = Bridge { dead_time_s: 3e-6, ..Bridge::ideal(560.0) };
    Scenario {
        source: Source::Controller {
            name: "mtpa".into(),
            observer: None,
            references: References { speed_rad_s: 0.0.into(), rotor_flux_vs: 0.0.into(), torque_nm: torque.into() },
        },
        inverter: Inverter::DeltaModulation(DeltaModulator { period_s: 1e-4 }, bridge),
        load: Load::none(),
        imposed_speed: Some(60.0.into()),
        ..Scenario::direct_on_line(0.0, 50.0, 2.5)
    }
}

/// Mean torque, and rms of the fundamental of the current, over the last half second.
pub fn settled(machine: &Machine<f64>, controller: &mut dyn Controller<f64>, scenario: &Scenario) -> [f64; 2] {
    let run = Simulation::new(machine, scenario).controlled_by(controller).with_internals().run().unwrap();
    let x = run.internals.unwrap();
    let n = x.torque_nm.len();
    let last = n - 5000..n;
    let torque = x.torque_nm[last.clone()].iter().sum::<f64>() / 5000.0;
    // In the frame of the rotor flux the fundamental stands still.
    let mean =
        last.map(|k| run.recording.i_s[k] * x.states[k].psi_r.conj() / x.states[k].psi_r.norm()).sum::<im_model::Complex<f64>>()
            / 5000.0;
    [torque, mean.norm() / 2f64.sqrt()]
}

pub fn law(machine: &Machine<f64>) -> MtpaLaw<f64> {
    let fit = fit_log(&TCircuit::from(machine), [1.0, 40.0], 0.003).unwrap();
    MtpaLaw::series(fit.torque_n_m, &fit.current, &fit.slip).unwrap()
}

#[test]
fn the_current_is_the_least_for_the_torque_within_one_percent() {
    let machine = machine();
    let known = MachineData::of(&machine, 30.0);
    let law = law(&machine);
    for wanted in [5.0, 15.0, 26.0, -15.0] {
        let mut drive = Mtpa::try_new(&known, &law, &MtpaGains::typical(&known)).unwrap();
        let [torque, current] = settled(&machine, &mut drive, &scenario(wanted));
        let least = for_torque(&TCircuit::from(&machine), torque.abs()).unwrap().current_rms_a;
        assert!((current / least - 1.0).abs() < 0.01, "{wanted}: {current} A for {torque} Nm, least {least} A");
        // The law lies within 0.3 % in current, the flux-frame mean and the ripple of 100 µs decisions leave the rest.
        assert!((torque / wanted - 1.0).abs() < 0.03, "{wanted}: {torque}");
    }
}

/// The paper's Fig. 12: at the same current, 0.9 and 1.1 times the slip give less torque.
#[test]
fn more_or_less_slip_gives_less_torque() {
    let machine = machine();
    let known = MachineData::of(&machine, 30.0);
    let law = law(&machine);
    let torque = |slip_factor| {
        let mut drive = Mtpa::try_new(&known, &law, &MtpaGains { slip_factor, ..MtpaGains::typical(&known) }).unwrap();
        settled(&machine, &mut drive, &scenario(15.0))[0]
    };
    let [less, law, more] = [0.9, 1.0, 1.1].map(torque);
    assert!(less < law && more < law, "{less} {law} {more}");
}

/// (30) and (31) evaluate to the values of `im-design`, where they were checked against the optimum.
#[test]
fn the_printed_laws_are_those_of_the_design() {
    let law = MtpaLaw::<f64>::kwon_printed();
    assert!(matches!(law.form, LawForm::Kwon { .. }));
    for torque in [20.0, 50.0, 150.0, 215.0] {
        let (current, slip) = law.at(torque);
        assert!((current - im_design::mtpa::CurrentLaw::KWON.at(torque)).abs() < 1e-9);
        assert!((slip - im_design::mtpa::SlipLaw::KWON.at(torque)).abs() < 1e-12);
        assert_eq!(law.at(-torque), (current, -slip));
    }
    assert!((law.at(150.0).0 - 25.4).abs() < 0.1);
}

/// A torque controller within a speed loop follows speed: here field orientation, whose torque is as fast as its current.
#[test]
fn a_speed_loop_makes_a_speed_drive_of_a_torque_controller() {
    let m = machines::JADOT_TABLE_I;
    let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
    let known = MachineData::of(&machine, 20.0);
    let gains = FieldOrientedGains { follows_torque: true, ..FieldOrientedGains::typical(&known, 0.9, 1e-4) };
    let inner = FieldOriented::try_new(&known, &gains).unwrap();
    let regulator = SpeedRegulator { bandwidth_rad_s: 30.0, inertia_kg_m2: 0.045 };
    let shaper = ReferenceShaper { bandwidth_rad_s: 50.0, acceleration_max_rad_s2: 400.0 };
    let mut drive = SpeedLoop::try_new(&regulator, &shaper, 40.0, inner).unwrap();
    let mut s = scenario(0.0);
    (s.inverter, s.imposed_speed, s.duration_s) = (Inverter::Averaged { dc_voltage_v: Some(560.0) }, None, 2.0);
    let Source::Controller { references, .. } = &mut s.source else { unreachable!() };
    references.speed_rad_s = Profile::points([[0.5, 0.0], [0.5, 100.0]]).unwrap();
    references.rotor_flux_vs = 0.9.into();
    s.load.torque_nm = Profile::points([[1.2, 0.0], [1.2, 15.0]]).unwrap();
    let run = Simulation::new(&machine, &s).controlled_by(&mut drive).run().unwrap();
    assert!(
        (run.recording.omega_m[11_900] - 100.0).abs() < 0.1 && (run.state.omega_m - 100.0).abs() < 0.1,
        "{}",
        run.state.omega_m
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: std::env::var("PROPTEST_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(4), ..ProptestConfig::default() })]
    /// Any machine with saturated iron, which the law knows, from a quarter of rated torque to rated, driving or braking, at any speed up to two thirds:
    /// dead time, noise and quantized currents.
    #[test]
    fn any_machine_gives_its_torque_with_the_least_current(
        (base, rating) in any_machine(), load in 0.25..1.0f64, brakes in any::<bool>(), speed in -0.66..0.66f64
    ) {
        let mut e = Effects::scaled(&rating, base.parameters(), base.pole_pairs());
        e.main_flux_saturation.excess = 0.4;
        let machine = base.with_effects(e).unwrap();
        let case = DriveCase::new(&machine, &rating, 0.0);
        let circuit = TCircuit::from(&machine);
        let fit = fit_log(&circuit, [0.05 * rating.torque_nm, 1.2 * rating.torque_nm], 0.005).unwrap();
        let law = MtpaLaw::series(fit.torque_n_m, &fit.current, &fit.slip).unwrap();
        let wanted = load * rating.torque_nm * if brakes { -1.0 } else { 1.0 };
        let mut s = scenario(wanted);
        s.inverter = Inverter::DeltaModulation(
            DeltaModulator { period_s: 1e-4 },
            Bridge { dead_time_s: 3e-6, ..Bridge::ideal(case.dc_voltage_v) },
        );
        s.imposed_speed = Some((speed * case.speed_rad_s()).into());
        let known = case.known;
        s.duration_s = (6.0 * known.windings.rotor_inductance_h / known.windings.rotor_resistance_ohm).max(1.0) + 0.5;
        s.sensors.current_noise_a = 0.005 * known.current_max_a;
        s.sensors.current_step_a = 0.002 * known.current_max_a;
        let mut drive = case.drive("mtpa", Some(law));
        let [torque, current] = settled(&machine, drive.as_mut(), &s);
        let least = for_torque(&circuit, torque.abs()).unwrap().current_rms_a;
        // The law lies within 0.5 % of torque and slip; the rest is ripple.
        prop_assert!((torque / wanted - 1.0).abs() < 0.02 && (current / least - 1.0).abs() < 0.005, "{torque} of {wanted} Nm, {current} of {least} A");
    }
}
