//! The machines that claims are put before: random ones from 0.4 to 75 kW, named ones, a user's own.

use im_model::machines::{ALL, NamedMachine};
use im_model::{Machine, ModelError, MotorFile, Rating, TParameters};

use crate::variable::Variable;

/// A linear machine with its rating.
#[derive(Clone, Debug, PartialEq)]
pub struct Subject {
    /// How it is called.
    pub name: String,
    /// The machine, without effects: the papers' claims are about the linear model.
    pub machine: Machine<f64>,
    /// Its rating.
    pub rating: Rating,
}

/// What makes a random machine: per-unit parameters of standard machines at 400 V, 50 Hz.
pub const MACHINE: [Variable; 8] = [
    Variable::ratio("power_w", 400.0, 75e3, 4000.0),
    Variable::whole("pole_pairs", 1.0, 4.0, 2.0),
    Variable::even("stator_resistance_share", 0.02, 0.08),
    Variable::even("rotor_resistance_share", 0.02, 0.07).simplest_at(0.045),
    Variable::even("leakage_share", 0.06, 0.14).simplest_at(0.1),
    Variable::even("magnetizing_share", 1.5, 4.0).simplest_at(2.5),
    Variable::ratio("inertia_share", 0.3, 3.0, 1.0),
    Variable::ratio("friction_rate_per_s", 0.01, 1.0, 0.1),
];

impl Subject {
    /// The machine that the values of [`MACHINE`] stand for. Resistances in shares of the base impedance fall with the size.
    ///
    /// # Errors
    /// Values that make no machine: none within the ranges.
    pub fn random(values: &[f64; 8]) -> Result<Self, ModelError> {
        let [power, pairs, r_s, r_r, leakage, magnetizing, inertia, friction] = *values;
        let omega = 2.0 * std::f64::consts::PI * 50.0;
        // Apparent power at 70 % efficiency times power factor.
        let z = 400.0 * 400.0 / (power / 0.7);
        let small = (power / 1000.0).powf(-0.35).min(1.3);
        let speed = omega / pairs;
        let inertia_kg_m2 = inertia * 0.2 * power / (speed * speed);
        let parameters = TParameters {
            stator_resistance_ohm: z * small * r_s,
            rotor_resistance_ohm: z * small * r_r,
            stator_leakage_inductance_h: leakage * z / omega,
            rotor_leakage_inductance_h: 1.1 * leakage * z / omega,
            magnetizing_inductance_h: magnetizing * z / omega,
            inertia_kg_m2,
            viscous_friction_nm_s_per_rad: inertia_kg_m2 * friction,
        };
        let rating = Rating {
            torque_nm: power / (0.95 * speed),
            electrical_frequency_hz: 50.0,
            phase_voltage_peak_v: 400.0 * (2.0f64 / 3.0).sqrt(),
            rotor_flux_vs: 0.95,
        };
        Ok(Self { name: "random".into(), machine: Machine::base(parameters, pairs as u32)?, rating })
    }

    /// A machine of the papers or of a public reference.
    pub fn named(m: &NamedMachine) -> Self {
        let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap_or_else(|_| unreachable!("named machines are valid"));
        Self { name: m.name.into(), machine, rating: m.rating }
    }

    /// The base machine of a motor file. Whether it has effects, which are left out, is for the caller to say.
    ///
    /// # Errors
    /// None for a file that was read.
    pub fn of_motor(motor: &MotorFile) -> Result<Self, ModelError> {
        let machine = Machine::base(*motor.machine.parameters(), motor.machine.pole_pairs())?;
        Ok(Self { name: motor.name.clone(), machine, rating: motor.rating })
    }

    /// The named machine of this name.
    pub fn by_name(name: &str) -> Option<Self> {
        ALL.iter().find(|m| m.name == name).map(Self::named)
    }
}

/// Whose machines a campaign takes.
#[derive(Clone, Debug, PartialEq)]
pub enum Machines {
    /// Another random one for each case.
    Random,
    /// Always this one.
    One(Box<Subject>),
}

impl Machines {
    /// What tells results of different machines apart.
    pub fn label(&self) -> String {
        match self {
            Self::Random => "random".into(),
            Self::One(s) => {
                // The numbers and not the name alone: a motor file may change under its name.
                let digest = s.machine.parameters().values().iter().fold(u64::from(s.machine.pole_pairs()), |d, x| {
                    (d.rotate_left(7) ^ x.to_bits()).wrapping_mul(0x9e37_79b9_7f4a_7c15)
                });
                format!("{} {digest:016x}", s.name)
            }
        }
    }
}
