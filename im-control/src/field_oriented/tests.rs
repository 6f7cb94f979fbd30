use super::*;
use im_model::machines::{self, NamedMachine};
use im_model::simulation::{Inverter, Load, Profile, References, Scenario, Sensors, Simulation, Source, Start};
use im_model::{Effects, Machine};

fn scenario(speed: Profile, flux: f64, load: Profile, duration_s: f64, dc: Option<f64>) -> Scenario {
    Scenario {
        source: Source::Controller {
            name: "field_oriented".into(),
            references: References { speed_rad_s: speed, rotor_flux_vs: flux.into(), torque_nm: 0.0.into() },
        },
        inverter: Inverter::Averaged { dc_voltage_v: dc },
        load: Load { torque_nm: load, quadratic_nm_s2: 0.0 },
        start: Start::Rest,
        sensors: Sensors::default(),
        duration_s,
        ..Scenario::direct_on_line(0.0, 50.0, duration_s)
    }
}

fn data(m: &NamedMachine, overload: f64) -> (Machine<f64>, MachineData<f64>) {
    let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
    let current = overload * m.rating.current_peak_a(&m.parameters(), m.pole_pairs);
    (machine, MachineData::of(&machine, current))
}

const M: NamedMachine = machines::JADOT_TABLE_I;

#[test]
fn speed_and_flux_are_followed_from_zero_flux_through_a_load_step() {
    for direct in [false, true] {
        let (machine, known) = data(&M, 1.5);
        let gains = FieldOrientedGains::typical(&known, 0.9, 1e-4);
        let gains = if direct { gains.direct() } else { gains };
        let mut drive = FieldOriented::try_new(&known, &gains).unwrap();
        let speed = Profile::points([[0.0, 0.0], [0.3, 0.0], [0.3, 120.0]]).unwrap();
        let load = Profile::points([[0.0, 0.0], [1.0, 0.0], [1.0, 20.0]]).unwrap();
        let s = scenario(speed, 0.9, load, 1.6, Some(560.0));
        let run = Simulation::new(&machine, &s).controlled_by(&mut drive).with_internals().run().unwrap();
        let w = &run.recording.omega_m;
        let psi: Vec<f64> = run.internals.unwrap().states.iter().map(|x| x.psi_r.norm()).collect();
        assert!(w[..2900].iter().all(|w| w.abs() < 0.01), "still while it is magnetized");
        assert!((w[9900] - 120.0).abs() < 0.05, "{}", w[9900]);
        let dip = w[10_000..].iter().fold(0.0f64, |d, w| d.max((w - 120.0).abs()));
        // T/(J a e) for a step T: 20/(0.045·40·e) = 4.1 rad/s.
        assert!((3.0..5.0).contains(&dip), "{dip}");
        assert!((w[15_900] - 120.0).abs() < 0.05, "{}", w[15_900]);
        assert!(psi[3000..].iter().all(|p| (p / 0.9 - 1.0).abs() < 0.02), "flux apart from torque");
        assert!(run.recording.i_s.iter().all(|i| i.norm() < 1.05 * known.current_max_a));
        assert!((drive.torque_nm() - 20.0).abs() < 0.3);
    }
}

#[test]
fn the_flux_gives_way_above_rated_speed() {
    let (machine, known) = data(&M, 1.5);
    let mut drive = FieldOriented::try_new(&known, &FieldOrientedGains::typical(&known, 0.95, 1e-4)).unwrap();
    let speed = Profile::points([[0.0, 0.0], [0.4, 0.0], [0.4, 320.0]]).unwrap();
    let s = scenario(speed, 0.95, Profile::points([[0.5, 0.0], [0.5, 5.0]]).unwrap(), 3.0, Some(540.0));
    let run = Simulation::new(&machine, &s).controlled_by(&mut drive).with_internals().run().unwrap();
    assert!((run.state.omega_m - 320.0).abs() < 0.5, "{}", run.state.omega_m);
    let psi = run.state.psi_r.norm();
    // About u_max/ω_s = 0.92·540/√3/640.
    assert!((0.35..0.5).contains(&psi), "{psi}");
    assert!(drive.status().has(Status::FIELD_WEAKENING));
}

#[test]
fn a_turning_machine_is_caught_without_a_jolt() {
    let (machine, known) = data(&M, 1.5);
    let mut drive = FieldOriented::try_new(&known, &FieldOrientedGains::typical(&known, 0.9, 1e-4)).unwrap();
    let mut s = scenario(100.0.into(), 0.9, 0.0.into(), 1.0, Some(560.0));
    s.start = Start::State(im_model::State { omega_m: 100.0, omega_load: 100.0, ..im_model::State::default() });
    let run = Simulation::new(&machine, &s).controlled_by(&mut drive).run().unwrap();
    assert!(run.recording.omega_m.iter().all(|w| (w - 100.0).abs() < 0.5));
    assert!(run.recording.i_s.iter().all(|i| i.norm() < 1.05 * known.current_max_a));
}

#[test]
fn single_precision_gives_the_same_drive() {
    let (machine, known) = data(&M, 1.5);
    let gains = FieldOrientedGains::typical(&known, 0.9, 1e-4);
    let small = known.cast::<f32>();
    let mut wide = FieldOriented::try_new(&known, &gains).unwrap();
    let narrow = FieldOriented::try_new(&small, &FieldOrientedGains::typical(&small, 0.9, 1e-4)).unwrap();
    let mut narrow = im_model::simulation::SinglePrecision(narrow);
    let speed = Profile::points([[0.0, 0.0], [0.3, 0.0], [0.3, 120.0]]).unwrap();
    let s = scenario(speed, 0.9, Profile::points([[0.6, 0.0], [0.6, 10.0]]).unwrap(), 1.0, Some(560.0));
    let a = Simulation::new(&machine, &s).controlled_by(&mut wide).run().unwrap();
    let b = Simulation::new(&machine, &s).controlled_by(&mut narrow).run().unwrap();
    // Rounding of the flux model over ten thousand samples.
    let worst = a.recording.omega_m.iter().zip(&b.recording.omega_m).fold(0.0f64, |w, (a, b)| w.max((a - b).abs()));
    assert!(worst < 0.02, "{worst}");
}

#[test]
fn effects_unknown_to_the_controller_leave_the_speed_right() {
    let m = M;
    let mut e = Effects::scaled(&m.rating, &m.parameters(), m.pole_pairs);
    e.main_flux_saturation.excess = 0.6;
    e.inverter_nonlinearity.voltage_v = 8.0;
    e.voltage_delay.delay_s = 1e-4;
    let machine = Machine::try_new(m.parameters(), m.pole_pairs, e).unwrap();
    let known = data(&m, 1.5).1.delayed(1e-4);
    let mut drive = FieldOriented::try_new(&known, &FieldOrientedGains::typical(&known, 0.9, 1e-4)).unwrap();
    let speed = Profile::points([[0.0, 0.0], [0.4, 0.0], [0.4, 120.0]]).unwrap();
    let s = scenario(speed, 0.9, Profile::points([[0.8, 0.0], [0.8, 15.0]]).unwrap(), 2.0, Some(560.0));
    let run = Simulation::new(&machine, &s).controlled_by(&mut drive).run().unwrap();
    assert!((run.state.omega_m - 120.0).abs() < 0.1, "{}", run.state.omega_m);
}
