//! Field orientation up to the voltage limit against the best that the circuit has: the steady state of the T circuit with saturated iron and its loss, in phasors,
//! searched over flux and slip. Nothing of the controllers' laws is in the search.

use im_control::{DriveLimits, FieldOriented, FieldOrientedGains, FluxAim, Iron, MachineData, Sensorless};
use im_model::machines::{self, NamedMachine};
use im_model::simulation::{Inverter, Load, Profile, References, Scenario, Simulation, Source};
use im_model::{Complex, Effects, Machine, Plant, PlantInput};
use im_observers::{Basis, FullOrder, FullOrderGains, Limits};

type C = Complex<f64>;
const M: NamedMachine = machines::MOTULATOR_2_2_KW;
const DC_V: f64 = 540.0;
const SHARE: f64 = 0.92;
/// Over the rated flux: the largest that is asked for.
const MOST: f64 = 1.2;
const OVERLOAD: f64 = 1.5;

fn machine() -> Machine<f64> {
    let mut e = Effects::scaled(&M.rating, &M.parameters(), M.pole_pairs);
    e.main_flux_saturation.excess = 0.5;
    e.iron_loss.conductance_s = 1.5e-3;
    Machine::try_new(M.parameters(), M.pole_pairs, e).unwrap()
}

fn current_max(machine: &Machine<f64>) -> f64 {
    OVERLOAD * M.rating.current_peak_a(machine.parameters(), M.pole_pairs)
}

/// A steady state.
#[derive(Clone, Copy, Debug, Default)]
struct Steady {
    torque_nm: f64,
    current_a: f64,
    voltage_v: f64,
    loss_w: f64,
    flux_vs: f64,
}

/// The circuit at a main flux, a slip frequency and a rotor speed (electrical).
fn steady(m: &Machine<f64>, psi_m: f64, slip: f64, omega_e: f64) -> Steady {
    let (p, e) = (m.parameters(), m.effects());
    let s = e.main_flux_saturation;
    let omega_s = omega_e + slip;
    let i_m = psi_m / p.magnetizing_inductance_h * (1.0 + s.excess * (psi_m / s.reference_flux_vs).powf(s.exponent));
    let i_r = C::new(0.0, -slip * psi_m) / C::new(p.rotor_resistance_ohm, slip * p.rotor_leakage_inductance_h);
    let i_fe = C::new(0.0, e.iron_loss.conductance_s * omega_s * psi_m);
    let i_s = C::new(i_m, 0.0) + i_fe - i_r;
    let u = i_s * p.stator_resistance_ohm + C::new(0.0, omega_s) * (i_s * p.stator_leakage_inductance_h + psi_m);
    let iron = 1.5 * e.iron_loss.conductance_s * (omega_s * psi_m).powi(2);
    let copper = 1.5 * (p.stator_resistance_ohm * i_s.norm_sqr() + p.rotor_resistance_ohm * i_r.norm_sqr());
    Steady {
        torque_nm: 1.5 * f64::from(M.pole_pairs) * p.rotor_resistance_ohm * i_r.norm_sqr() / slip,
        current_a: i_s.norm(),
        voltage_v: u.norm(),
        loss_w: copper + iron,
        flux_vs: (C::new(psi_m, 0.0) + i_r * p.rotor_leakage_inductance_h).norm(),
    }
}

/// Every steady state within voltage, current and the largest flux.
fn allowed(m: &Machine<f64>, omega_e: f64) -> impl Iterator<Item = Steady> {
    let (u, i, flux) = (SHARE * DC_V / 3f64.sqrt(), current_max(m), MOST * M.rating.rotor_flux_vs);
    let m = *m;
    (1..=260)
        .flat_map(move |a| (1..=600).map(move |b| steady(&m, 0.005 * f64::from(a), 0.25 * f64::from(b), omega_e)))
        .filter(move |s| s.voltage_v <= u && s.current_a <= i && s.flux_vs <= flux)
}

/// Least loss, or current, for a torque: by the slip that gives it at each flux.
fn best(m: &Machine<f64>, torque: f64, omega_e: f64, aim: FluxAim) -> Option<Steady> {
    let u = SHARE * DC_V / 3f64.sqrt();
    let at = |psi: f64| {
        let (mut low, mut high) = (1e-3, 200.0);
        // The first slip with the torque lies below the pull-out.
        let pull_out = m.parameters().rotor_resistance_ohm / m.parameters().rotor_leakage_inductance_h;
        high = f64::min(high, pull_out);
        if steady(m, psi, high, omega_e).torque_nm < torque {
            return None;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if steady(m, psi, middle, omega_e).torque_nm < torque { low = middle } else { high = middle }
        }
        Some(steady(m, psi, high, omega_e))
    };
    let cost = |s: &Steady| if aim == FluxAim::LeastLoss { s.loss_w } else { s.current_a };
    (1..=1300)
        .filter_map(|k| at(0.001 * f64::from(k)))
        .filter(|s| s.voltage_v <= u && s.current_a <= current_max(m))
        .min_by(|a, b| cost(a).total_cmp(&cost(b)))
}

/// Means over the last 50 ms of the drive that holds a torque at a speed, when the flux has fallen to what it needs.
fn driven(m: &Machine<f64>, torque: f64, speed: f64, aim: FluxAim) -> Steady {
    let known = MachineData::of(m, current_max(m));
    let flux = MOST * M.rating.rotor_flux_vs;
    let gains = FieldOrientedGains { follows_torque: true, ..FieldOrientedGains::typical(&known, flux, 1e-4) };
    let mut drive = FieldOriented::try_new(&known, &gains.with_optimal_flux(aim, Iron::of(m))).unwrap();
    let torque_nm = Profile::points([[0.0, 0.0], [0.4, 0.0], [0.6, torque]]).unwrap();
    let scenario = Scenario {
        source: Source::Controller {
            name: "field_oriented".into(),
            observer: None,
            references: References { speed_rad_s: 0.0.into(), rotor_flux_vs: flux.into(), torque_nm },
        },
        inverter: Inverter::Averaged { dc_voltage_v: Some(DC_V) },
        imposed_speed: Some(speed.into()),
        ..Scenario::direct_on_line(0.0, 50.0, 5.0)
    };
    let run = Simulation::new(m, &scenario).controlled_by(&mut drive).with_internals().run().unwrap();
    let x = run.internals.unwrap();
    let n = x.torque_nm.len();
    let last = n - 500..n;
    let mean = |of: &dyn Fn(usize) -> f64| last.clone().map(of).sum::<f64>() / 500.0;
    let plant = Plant::new(m);
    Steady {
        torque_nm: mean(&|k| x.torque_nm[k]),
        current_a: mean(&|k| run.recording.i_s[k].norm()),
        voltage_v: mean(&|k| run.recording.u_s[k].norm()),
        loss_w: mean(&|k| {
            let p = plant.evaluate(&x.states[k], &PlantInput::new(run.recording.u_s[k], 0.0)).powers;
            p.stator_copper + p.rotor_copper + p.iron
        }),
        flux_vs: mean(&|k| x.states[k].psi_r.norm()),
    }
}

/// From a tenth of the rated speed to four times it: at the limits the drive has the torque that the circuit has, in every region.
#[test]
fn the_largest_torque_over_speed_is_that_of_the_circuit() {
    let m = machine();
    for speed in [15.0, 80.0, 150.0, 200.0, 300.0, 450.0, 600.0] {
        let omega_e = speed * f64::from(M.pole_pairs);
        let most = allowed(&m, omega_e).fold(Steady::default(), |a, b| if b.torque_nm > a.torque_nm { b } else { a });
        let got = driven(&m, 500.0, speed, FluxAim::LeastCurrent);
        assert!(got.torque_nm > 0.98 * most.torque_nm, "{speed} rad/s: {} of {} Nm", got.torque_nm, most.torque_nm);
        assert!(got.current_a < 1.01 * current_max(&m) && got.voltage_v < 1.02 * SHARE * DC_V / 3f64.sqrt(), "{got:?}");
    }
}

/// Below the limits: the current, or the loss, for a torque at a speed is the least to be had, within a per cent and the torque within 1 %.
#[test]
fn current_and_loss_are_the_least_for_the_torque() {
    let m = machine();
    for aim in [FluxAim::LeastCurrent, FluxAim::LeastLoss] {
        for (torque, speed) in [(4.0, 30.0), (14.0, 30.0), (20.0, 30.0), (6.0, 140.0), (14.0, 140.0), (5.0, 280.0), (8.0, 280.0)]
        {
            let least = best(&m, torque, speed * f64::from(M.pole_pairs), aim).unwrap();
            let got = driven(&m, torque, speed, aim);
            assert!((got.torque_nm - torque).abs() < 0.01 * torque, "{torque} {}", got.torque_nm);
            let (cost, of) = match aim {
                FluxAim::LeastCurrent => (got.current_a * least.torque_nm / got.torque_nm, least.current_a),
                FluxAim::LeastLoss => (got.loss_w * (least.torque_nm / got.torque_nm).powi(2), least.loss_w),
            };
            assert!(cost < 1.01 * of, "{aim:?} {torque} Nm {speed} rad/s: {cost} of {of}");
        }
    }
}

/// Without a speed sensor: at rest, to twice the rated speed, loaded with 0.95 of what the circuit has there, and back; the observer knows the saturation, and not the iron
/// loss.
#[test]
fn a_sensorless_drive_reaches_the_torque_of_the_voltage_at_twice_the_rated_speed() {
    let m = machine();
    let speed = 300.0;
    let most = allowed(&m, speed * f64::from(M.pole_pairs)).fold(0.0f64, |a, s| a.max(s.torque_nm));
    let known = MachineData::of(&m, current_max(&m));
    let flux = MOST * M.rating.rotor_flux_vs;
    let gains = FieldOrientedGains::typical(&known, flux, 1e-4).with_optimal_flux(FluxAim::LeastLoss, Iron::of(&m));
    let controller = FieldOriented::try_new(&known, &gains).unwrap();
    let basis = Basis::try_new(&m, &M.rating, 1e-4).unwrap().with_saturation(&m);
    let basis = basis.with_limits(Limits { speed_max_rad_s: 500.0, ..Limits::of(&m, &M.rating) }).unwrap();
    let observer = FullOrder::try_new(basis, FullOrderGains::for_machine(&m, &M.rating)).unwrap();
    let limits = DriveLimits::generous(&known, M.rating.synchronous_speed_rad_s(M.pole_pairs), flux);
    let mut drive = Sensorless::try_new(controller, observer, &known, &limits, 1e-4).unwrap();
    let points = |p: &[[f64; 2]]| Profile::points(p).unwrap();
    let scenario = Scenario {
        source: Source::Controller {
            name: "sensorless".into(),
            observer: None,
            references: References {
                speed_rad_s: points(&[[0.0, 0.0], [0.4, 0.0], [2.0, speed], [4.5, speed], [6.0, 100.0]]),
                rotor_flux_vs: flux.into(),
                torque_nm: 0.0.into(),
            },
        },
        inverter: Inverter::Averaged { dc_voltage_v: Some(DC_V) },
        load: Load {
            torque_nm: points(&[[0.0, 0.0], [2.5, 0.0], [3.0, 0.95 * most], [4.4, 0.95 * most], [4.5, 2.0]]),
            quadratic_nm_s2: 0.0,
        },
        ..Scenario::direct_on_line(0.0, 50.0, 7.0)
    };
    let run = Simulation::new(&m, &scenario).controlled_by(&mut drive).run().unwrap();
    let w = &run.recording.omega_m;
    let mean = |t: f64| w[(1e4 * t) as usize - 500..(1e4 * t) as usize].iter().sum::<f64>() / 500.0;
    assert!((mean(4.4) - speed).abs() < 3.0, "{} rad/s under {} Nm", mean(4.4), 0.95 * most);
    assert!((mean(6.9) - 100.0).abs() < 1.0, "{}", mean(6.9));
    let peak = run.recording.i_s.iter().fold(0.0f64, |p, i| p.max(i.norm()));
    assert!(peak < 1.1 * current_max(&m), "{peak} of {}", current_max(&m));
}
