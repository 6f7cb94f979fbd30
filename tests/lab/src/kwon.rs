//! The drive of Kwon et al., Sections VII to IX: least-current laws (30), (31), synchronous current regulator, delta modulation at 100 µs.
//!
//! Quantities are the delta windings': Table IV with the 35.9 A and 2.73 rad/s of the laws for 150 Nm gives those 150 Nm, at 1.71 Wb, which
//! is the flux of a winding at 460 V, 60 Hz. The dc link of 650 V then stands for √3·650 V of an equivalent star.

use im_control::{DriveLimits, MachineData, Mtpa, MtpaGains, MtpaLaw, Sensorless};
use im_design::mtpa::Aqdm;
use im_design::mtpa::laws::{CurrentLaw, SlipLaw, fit_log};
use im_model::machines::{KWON_TABLE_IV, KWON_TABLE_V};
use im_model::simulation::{
    Bridge, Command, Controller, DeltaModulator, Inverter, Load, Measured, Profile, Reference, References, Scenario, Simulation,
    Source,
};
use im_model::space_vector::unit;
use im_model::{Complex, Machine, Rating, TParameters};
use im_observers::{Basis, Estimate, LoadTorqueModel, Thau, ThauGains};

use crate::observation::Truth;

pub const H: f64 = 1e-4;
pub const RPM: f64 = core::f64::consts::PI / 30.0;
/// The torque asked for, Nm.
pub const TORQUE_NM: f64 = 150.0;

/// The rating of the windings.
pub const RATING: Rating =
    Rating { torque_nm: 200.7, electrical_frequency_hz: 60.0, phase_voltage_peak_v: 650.5, rotor_flux_vs: 1.7 };

/// Table IV.
pub fn table_iv() -> Machine<f64> {
    Machine::base(KWON_TABLE_IV.parameters(), 2).expect("valid")
}

/// Table V: the library's machine, whose T circuit holds at 1.75 Wb.
pub fn table_v() -> Machine<f64> {
    KWON_TABLE_V.machine(1.75).expect("valid")
}

/// Least current: (30), (31), and the regulator of Fig. 5 in front of the delta modulator.
pub struct LeastCurrentDrive {
    current: CurrentLaw,
    slip: SlipLaw,
    angle: f64,
    integral: Complex<f64>,
}

impl Default for LeastCurrentDrive {
    fn default() -> Self {
        Self { current: CurrentLaw::KWON, slip: SlipLaw::KWON, angle: 0.0, integral: Complex::new(0.0, 0.0) }
    }
}

impl Controller<f64> for LeastCurrentDrive {
    fn step(&mut self, m: &Measured<f64>, reference: &Reference<f64>) -> Command<f64> {
        let torque = reference.torque_nm.max(1e-3);
        let peak = self.current.at(torque) * core::f64::consts::SQRT_2;
        let turn = unit(self.angle);
        let wanted = Complex::new(peak, 0.0);
        // τ_scr is not printed: 20 ms; the limit is a quarter of the current.
        self.integral += (wanted - m.i_s * turn.conj()) * (m.sample_time_s / 0.02);
        if self.integral.norm() > 0.25 * peak {
            self.integral *= 0.25 * peak / self.integral.norm();
        }
        self.angle = (self.angle + (2.0 * m.omega_m + self.slip.at(torque)) * m.sample_time_s) % core::f64::consts::TAU;
        Command::Current((wanted + self.integral) * turn)
    }
}

/// The drive on a machine: free against τ_L = kω, or at an imposed speed.
pub fn run(machine: &Machine<f64>, load: f64, imposed: Option<Profile>, duration_s: f64) -> Truth {
    // kω as friction of the machine that is simulated; the observer does not know it but as a load.
    let p = *machine.parameters();
    let friction = p.viscous_friction_nm_s_per_rad + load;
    let machine = machine.with_parameters(TParameters { viscous_friction_nm_s_per_rad: friction, ..p }).expect("valid");
    let references = References { speed_rad_s: 0.0.into(), rotor_flux_vs: 0.0.into(), torque_nm: TORQUE_NM.into() };
    let scenario = Scenario {
        name: "Kwon et al.".to_owned(),
        source: Source::Controller { name: "least current".to_owned(), observer: None, references },
        inverter: Inverter::DeltaModulation(DeltaModulator { period_s: H }, Bridge::ideal(650.0 * 3f64.sqrt())),
        load: Load::none(),
        imposed_speed: imposed,
        ..Scenario::direct_on_line(1.0, 60.0, duration_s)
    };
    let mut drive = LeastCurrentDrive::default();
    let run = Simulation::new(&machine, &scenario).controlled_by(&mut drive).with_internals().run().expect("runs");
    Truth::from_run(run)
}

/// What was true, and what an observer made of it.
pub type Followed = (Truth, Vec<Estimate<f64>>);

/// The drive of Fig. 4 without its speed sensor ([`Sensorless`]) on the machine of Table V, from rest against a load that is 150 Nm at 900 rpm: the run, and
/// what the observer in it said.
pub fn sensorless(load: LoadTorqueModel, duration_s: f64) -> Result<Followed, Box<dyn std::error::Error>> {
    let machine = KWON_TABLE_V.per_star().machine(1.75 / 3f64.sqrt())?;
    // Of the star that the delta is as good as.
    let rating = Rating { phase_voltage_peak_v: 375.6, rotor_flux_vs: 0.9815, ..RATING };
    let circuit = Aqdm::of(&machine).ok_or("Table V has an air gap of its own")?;
    let fit = fit_log(&circuit, [4.0, 300.0], 0.01)?;
    let law = MtpaLaw::series(fit.torque_n_m, &fit.current, &fit.slip)?;
    let known = MachineData::of(&machine, 120.0);
    let mtpa = Mtpa::try_new(&known, &law, &MtpaGains::typical(&known))?;
    let observer = Thau::try_new(Basis::try_new(&machine, &rating, H)?, ThauGains::published(), load)?;
    let references = References { speed_rad_s: 0.0.into(), rotor_flux_vs: 0.0.into(), torque_nm: TORQUE_NM.into() };
    let scenario = Scenario {
        name: "Kwon et al., Fig. 4".to_owned(),
        source: Source::Controller { name: "least current".to_owned(), observer: None, references },
        inverter: Inverter::DeltaModulation(DeltaModulator { period_s: H }, Bridge::ideal(650.0)),
        load: Load { torque_nm: 0.0.into(), quadratic_nm_s2: TORQUE_NM / (900.0 * RPM).powi(2) },
        ..Scenario::direct_on_line(1.0, 60.0, duration_s)
    };
    let limits = DriveLimits::generous(&known, rating.synchronous_speed_rad_s(machine.pole_pairs()), rating.rotor_flux_vs);
    let mut sensorless = Sensorless::try_new(mtpa, observer, &known, &limits, H)?.tracking_currents();
    let truth = Truth::from_run(Simulation::new(&machine, &scenario).controlled_by(&mut sensorless).with_internals().run()?);
    // The same samples through the same observer say the same again.
    let estimates = truth.observe(&observer);
    Ok((truth, estimates))
}

pub fn basis(machine: &Machine<f64>) -> Basis<f64> {
    Basis::try_new(machine, &RATING, H).expect("valid")
}

/// Rows of a table: time, true and estimated speed, error in per cent of the true one, current residual.
pub fn table(truth: &Truth, estimates: &[Estimate<f64>], times: &[f64]) {
    println!("   t s   speed rpm  estimate rpm   error %   |i - i_hat| A   torque Nm");
    for &t in times {
        let k = truth.at(t);
        let (e, w) = (&estimates[k], truth.omega[k]);
        let error = 100.0 * (e.omega_m - w) / w;
        let rpm = |x: f64| x / RPM;
        println!(
            "{t:6.2}  {:10.1}  {:12.1}  {error:8.2}  {:14.2}  {:10.1}",
            rpm(w),
            rpm(e.omega_m),
            e.residual_a.norm(),
            truth.torque[k]
        );
    }
}

/// The time from which the speed's error stays within a share of the true speed, s.
pub fn tracks_from(truth: &Truth, estimates: &[Estimate<f64>], share: f64) -> Option<f64> {
    let off = |k: usize| (estimates[k].omega_m - truth.omega[k]).abs() > share * truth.omega[k].abs();
    match (0..truth.len()).rev().find(|&k| off(k)) {
        None => Some(0.0),
        Some(k) if k + 1 < truth.len() => Some(truth.time_s(k + 1)),
        Some(_) => None,
    }
}
