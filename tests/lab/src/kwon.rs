//! The drive of Kwon et al., Sections VII to IX: least-current laws (30), (31), synchronous current regulator, delta modulation at 100 µs.
//!
//! Quantities are the delta windings': Table IV with the 35.9 A and 2.73 rad/s of the laws for 150 Nm gives those 150 Nm, at 1.71 Wb, which
//! is the flux of a winding at 460 V, 60 Hz. The dc link of 650 V then stands for √3·650 V of an equivalent star.

use im_design::mtpa::laws::{CurrentLaw, SlipLaw};
use im_model::machines::KWON_TABLE_IV;
use im_model::simulation::{
    Bridge, Command, Controller, DeltaModulator, Inverter, Load, Measured, Profile, Reference, References, Scenario, Simulation,
    Source,
};
use im_model::space_vector::unit;
use im_model::{Complex, Effects, Machine, Rating, TParameters};
use im_observers::{Basis, Estimate};

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

/// Around 1.7 Wb, the circuit that the paper fitted (Table V): Γ_m by the power law (1 % from 0 to 1.85 Wb), L_lr(1.75 Wb), R_r = 1/ΣyₐI.
pub fn table_v() -> Machine<f64> {
    let p = TParameters {
        stator_resistance_ohm: 0.22,
        rotor_resistance_ohm: 1.0 / (5.65 + 4.40e-2 + 3.17e-3),
        stator_leakage_inductance_h: 9.06e-4,
        rotor_leakage_inductance_h: 1.40e-4 + 4.15e-3 / (1.0 + 0.735 * 1.75f64.powf(2.59)),
        magnetizing_inductance_h: 0.1255,
        ..KWON_TABLE_IV.parameters()
    };
    let mut effects = Effects::none();
    effects.main_flux_saturation.excess = 0.378;
    effects.main_flux_saturation.exponent = 4.2;
    effects.main_flux_saturation.reference_flux_vs = 1.85;
    Machine::try_new(p, 2, effects).expect("valid")
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
        source: Source::Controller { name: "least current".to_owned(), references },
        inverter: Inverter::DeltaModulation(DeltaModulator { period_s: H }, Bridge::ideal(650.0 * 3f64.sqrt())),
        load: Load::none(),
        imposed_speed: imposed,
        ..Scenario::direct_on_line(1.0, 60.0, duration_s)
    };
    let mut drive = LeastCurrentDrive::default();
    let run = Simulation::new(&machine, &scenario).controlled_by(&mut drive).with_internals().run().expect("runs");
    Truth::from_run(run)
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
