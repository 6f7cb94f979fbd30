//! The drive cycle and what is measured on it.

use std::error::Error;

use im_control::modulation::DeadTimeCompensation;
use im_control::named::{Setting, named};
use im_control::{MachineData, MtpaLaw};
use im_design::mtpa::TCircuit;
use im_design::mtpa::laws::fit_log;
use im_model::simulation::{
    Bridge, CarrierPwm, Controller, DeltaModulator, Inverter, Load, Profile, References, Scenario, Sensors, Simulation, Source,
};
use im_model::{BaseParameter, Complex, Effects, Machine, ParameterId, Plant, PlantInput, machines};

/// As `im_control::named` has them.
pub const NAMES: [&str; 8] = [
    "indirect_field_orientation",
    "direct_field_orientation",
    "least_loss_field_orientation",
    "kenne",
    "jadot",
    "direct_torque",
    "volts_per_hertz",
    "mtpa",
];

const M: machines::NamedMachine = machines::JADOT_TABLE_I;
const FLUX: f64 = 0.9;
const T: f64 = 1e-4;
/// From here on the cycle counts: by then the machine is magnetized.
const BEGIN: usize = 5000;

/// The machines behind the controllers.
pub fn truths() -> Vec<(&'static str, Machine<f64>)> {
    let base = Machine::base(M.parameters(), M.pole_pairs).expect("a machine");
    let with = |p: BaseParameter, factor: f64| {
        let id = ParameterId::Base(p);
        base.with(&[(id, factor * base.get(id))]).expect("a machine")
    };
    let mut e = Effects::scaled(&M.rating, &M.parameters(), M.pole_pairs);
    e.main_flux_saturation.excess = 0.5;
    vec![
        ("as known", base),
        ("R_r + 50 %", with(BaseParameter::RotorResistance, 1.5)),
        ("R_s + 50 %", with(BaseParameter::StatorResistance, 1.5)),
        ("saturated", base.with_effects(e).expect("a machine")),
    ]
}

/// Up, loaded, slow under load, backwards, driven by the load.
const SPEED: [[f64; 2]; 7] = [[0.0, 0.0], [0.5, 0.0], [1.0, 140.0], [2.5, 140.0], [3.0, 20.0], [4.0, 20.0], [4.6, -100.0]];
const LOAD: [[f64; 2]; 7] = [[0.0, 0.0], [1.5, 0.0], [1.5, 20.0], [4.0, 20.0], [4.0, 0.0], [5.2, 0.0], [5.2, 15.0]];

/// The torque that the cycle takes: acceleration and load.
fn torque() -> Vec<[f64; 2]> {
    let load = Profile::points(LOAD).expect("points in order");
    let mut all = Vec::new();
    for k in 0..600 {
        let [from, to] = [0.01 * f64::from(k), 0.01 * f64::from(k + 1)];
        let speed = Profile::points(SPEED).expect("points in order");
        let torque = M.windings.inertia_kg_m2 * (speed.at(to) - speed.at(from)) / 0.01 + load.at(from + 1e-6);
        all.extend([[from, torque], [to, torque]]);
    }
    all
}

/// The cycle; a torque controller gets the torque, and the speed is held by a test bench.
fn scenario(delta: bool) -> Scenario {
    let p = |points: &[[f64; 2]]| Profile::points(points).expect("points in order");
    let bridge = Bridge { dead_time_s: 2e-6, ..Bridge::ideal(560.0) };
    Scenario {
        name: "cycle".into(),
        source: Source::Controller {
            name: String::new(),
            observer: None,
            references: References { speed_rad_s: p(&SPEED), rotor_flux_vs: FLUX.into(), torque_nm: p(&torque()) },
        },
        inverter: if delta {
            Inverter::DeltaModulation(DeltaModulator { period_s: T }, bridge)
        } else {
            Inverter::CarrierPwm(CarrierPwm { half_period_s: T / 2.0 }, bridge)
        },
        load: Load { torque_nm: p(&LOAD), quadratic_nm_s2: 0.0 },
        imposed_speed: delta.then(|| p(&SPEED)),
        sensors: Sensors { current_noise_a: 0.05, speed_noise_rad_s: 0.05, seed: 1, ..Sensors::default() },
        sample_time_s: T,
        ..Scenario::direct_on_line(0.0, 50.0, 6.0)
    }
}

fn controller(name: &str) -> Result<Box<dyn Controller<f64>>, Box<dyn Error>> {
    let base = Machine::base(M.parameters(), M.pole_pairs)?;
    let machine = MachineData::of(&base, 1.5 * M.rating.current_peak_a(&M.parameters(), M.pole_pairs));
    let fit = fit_log(&TCircuit::from(&base), [0.5, 40.0], 0.01)?;
    let mtpa = Some(MtpaLaw::series(fit.torque_n_m, &fit.current, &fit.slip)?);
    let bridge = Bridge { dead_time_s: 2e-6, ..Bridge::ideal(560.0) };
    let dead_time = Some(DeadTimeCompensation::of(&bridge, T, 0.3));
    let setting = Setting {
        machine,
        rating: M.rating,
        dc_voltage_v: 560.0,
        sample_time_s: T,
        dead_time,
        iron: im_control::Iron::ideal(),
        mtpa,
        observer: None,
    };
    struct Only(Box<dyn im_control::named::Supervised>);
    impl Controller<f64> for Only {
        fn step(
            &mut self,
            m: &im_model::simulation::Measured<f64>,
            r: &im_model::simulation::Reference<f64>,
        ) -> im_model::simulation::Command<f64> {
            self.0.step(m, r)
        }
    }
    Ok(Box::new(Only(named(name, &setting)?)))
}

/// What the table shows.
pub struct Figures {
    /// Rms of speed less reference, rad/s; not a number where the speed is held.
    pub speed_rms: f64,
    /// Rms of torque less what the cycle takes, Nm.
    pub torque_rms: f64,
    /// Rms of the torque about its mean over 5 ms, at constant speed and load, Nm.
    pub ripple_rms: f64,
    /// Rms of the phase current over the cycle, A.
    pub current_rms: f64,
    /// Mean of copper and iron losses over the cycle, W.
    pub losses: f64,
    /// Mean relative error of the rotor flux; not a number where no flux was asked for.
    pub flux_error: f64,
}

impl Figures {
    /// Runs a controller on a machine.
    pub fn of(name: &str, machine: &Machine<f64>) -> Result<Self, Box<dyn Error>> {
        let s = scenario(name == "mtpa");
        let Source::Controller { references, .. } = &s.source else { unreachable!() };
        let mut controller = controller(name)?;
        let run = Simulation::new(machine, &s).controlled_by(controller.as_mut()).with_internals().run()?;
        let x = run.internals.expect("asked for");
        let n = x.states.len();
        let mean = |of: &dyn Fn(usize) -> f64| (BEGIN..n).map(of).sum::<f64>() / (n - BEGIN) as f64;
        let error = |k: usize| x.states[k].omega_m - references.speed_rad_s.at(T * k as f64);
        let plant = Plant::new(machine);
        let loss = |k: usize| {
            let p = plant.evaluate(&x.states[k], &PlantInput::new(Complex::new(0.0, 0.0), 0.0)).powers;
            p.stator_copper + p.rotor_copper + p.iron
        };
        // Loaded and at speed, settled.
        let window = 23_000..24_800;
        let smooth = |k: usize| x.torque_nm[k - 25..=k + 25].iter().sum::<f64>() / 51.0;
        let ripple = window.clone().map(|k| (x.torque_nm[k] - smooth(k)).powi(2)).sum::<f64>() / window.len() as f64;
        let held = name == "mtpa";
        let torque_error = |k: usize| x.torque_nm[k] - references.torque_nm.at(T * k as f64);
        Ok(Self {
            speed_rms: if held { f64::NAN } else { mean(&|k| error(k).powi(2)).sqrt() },
            torque_rms: mean(&|k| torque_error(k).powi(2)).sqrt(),
            ripple_rms: ripple.sqrt(),
            current_rms: (mean(&|k| run.recording.i_s[k].norm_sqr()) / 2.0).sqrt(),
            losses: mean(&loss),
            flux_error: if held { f64::NAN } else { mean(&|k| (x.states[k].psi_r.norm() / FLUX - 1.0).abs()) },
        })
    }
}
