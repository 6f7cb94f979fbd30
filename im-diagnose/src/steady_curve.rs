//! The steady states of a machine on a sinusoidal supply: its static torque-speed and current-speed curves, and what it does at its rated torque.

use im_model::effects::{Place, SteadyState};
use im_model::{Complex, Held, Machine, ModelError, MotorFile, Plant, PlantInput, Powers, steady_state};
use serde_json::{Map, Value, json};

/// Points of a curve in a file.
const POINTS: usize = 56;

/// The motor by itself on a sinusoidal supply: without what stands between a command and its terminals, without its sensors, and without what ripples.
/// Torque and powers are the motor's own then, and those of the state that they are taken at.
fn motor_alone(machine: &Machine<f64>) -> Result<Machine<f64>, ModelError> {
    machine.without(machine.effects().ids().filter(|id| {
        let about = id.about();
        let outside = matches!(about.place, Place::Voltage | Place::Command | Place::Sensors);
        outside || about.steady_state == SteadyState::Ripples
    }))
}

/// Speed, rad/s, electromagnetic torque, Nm, and peak stator current, A, from standstill to a tenth above synchronous speed; speeds without a
/// steady state are left out. Of the motor alone: what ripples (asymmetries, slots), inverter, supply and sensors are left out.
pub fn torque_speed(machine: &Machine<f64>, phase_voltage_peak_v: f64, frequency_hz: f64, points: usize) -> Vec<[f64; 3]> {
    let Ok(machine) = motor_alone(machine) else { return Vec::new() };
    let synchronous = std::f64::consts::TAU * frequency_hz / f64::from(machine.pole_pairs());
    let plant = Plant::new(&machine);
    let at = |k: usize| {
        let omega_m = 1.1 * synchronous * k as f64 / (points.max(2) - 1) as f64;
        let state = steady_state(&machine, phase_voltage_peak_v, frequency_hz, Held::Speed(omega_m)).ok()?;
        Some([omega_m, plant.torque(&state), plant.currents(&state).i_s.norm()])
    };
    (0..points.max(2)).filter_map(at).collect()
}

/// A motor on its rated supply.
#[derive(Clone, Debug, PartialEq)]
pub struct RatedSupply {
    /// Its [`torque_speed`] curve.
    pub curve: Vec<[f64; 3]>,
    /// At its rated torque; `None` where it cannot carry that.
    pub loaded: Option<RatedLoad>,
}

impl RatedSupply {
    /// Of a motor.
    pub fn of(motor: &MotorFile) -> Self {
        let r = &motor.rating;
        let curve = torque_speed(&motor.machine, r.phase_voltage_peak_v, r.electrical_frequency_hz, POINTS);
        Self { curve, loaded: RatedLoad::of(motor) }
    }
}

/// A motor on its rated supply, loaded with its rated torque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RatedLoad {
    /// Speed, rad/s.
    pub omega_m: f64,
    /// Stator current, peak, A.
    pub current_a: f64,
    /// Powers, W.
    pub powers: Powers<f64>,
}

impl RatedLoad {
    fn of(motor: &MotorFile) -> Option<Self> {
        let (r, machine) = (&motor.rating, motor_alone(&motor.machine).ok()?);
        let plant = Plant::new(&machine);
        let u = r.phase_voltage_peak_v;
        let state = steady_state(&machine, u, r.electrical_frequency_hz, Held::Load(r.torque_nm)).ok()?;
        let e = plant.evaluate(&state, &PlantInput::new(Complex::new(u, 0.0), r.torque_nm));
        Some(Self { omega_m: state.omega_m, current_a: e.currents.i_s.norm(), powers: e.powers })
    }

    /// Given to the load over taken in.
    pub fn efficiency(&self) -> f64 {
        self.powers.load / self.powers.electrical_input
    }

    fn to_json(self) -> Value {
        let p = &self.powers;
        json!({
            "omega_m_rad_s": self.omega_m, "i_s_A": self.current_a, "efficiency": self.efficiency(), "input_W": p.electrical_input,
            "stator_copper_W": p.stator_copper, "rotor_copper_W": p.rotor_copper, "iron_W": p.iron, "friction_W": p.friction,
            "load_W": p.load,
        })
    }
}

/// Motors at their rated supply, each under a name.
pub fn to_json(motors: &[(&str, &RatedSupply)]) -> Value {
    let curves: Map<_, _> = motors.iter().map(|(name, m)| ((*name).to_owned(), json!(m.curve))).collect();
    let loaded: Map<_, _> =
        motors.iter().map(|(name, m)| ((*name).to_owned(), json!(m.loaded.map(RatedLoad::to_json)))).collect();
    json!({"columns": ["omega_m_rad_s", "torque_Nm", "i_s_A"], "curves": curves, "at_rated_torque": loaded})
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kloss: without stator resistance T/T_max = 2/(s/s_max + s_max/s) with s_max = R_R/(ω L_ℓ), in Γ parameters.
    #[test]
    fn the_curve_of_the_linear_machine_is_that_of_kloss() {
        let named = im_model::machines::ALL[0];
        let p = im_model::TParameters { stator_resistance_ohm: 1e-7, ..named.parameters() };
        let machine = Machine::base(p, named.pole_pairs).unwrap();
        let (u, f) = (300.0, 50.0);
        let omega = std::f64::consts::TAU * f;
        // Seen from the stator's terminals the branches of the Γ circuit are parallel: the rotor's alone makes torque.
        let gamma = p.gamma();
        let breakdown = gamma.rotor_resistance_ohm / (omega * gamma.leakage_inductance_h);
        let most = 1.5 * f64::from(named.pole_pairs) * u * u / (2.0 * omega * omega * gamma.leakage_inductance_h);
        for [w, torque, current] in torque_speed(&machine, u, f, 40) {
            let slip = 1.0 - w * f64::from(named.pole_pairs) / omega;
            if slip.abs() > 1e-9 {
                let kloss = 2.0 * most / (slip / breakdown + breakdown / slip);
                assert!((torque - kloss).abs() < 1e-4 * most, "{w}: {torque} instead of {kloss}");
            }
            let rotor = slip / Complex::new(gamma.rotor_resistance_ohm, omega * slip * gamma.leakage_inductance_h);
            let admittance = rotor + 1.0 / Complex::new(0.0, omega * gamma.stator_inductance_h);
            assert!((current - u * admittance.norm()).abs() < 1e-4 * current, "{w}: {current} A");
        }
    }

    /// A gain of the voltage, an inverter, a sensor or what ripples is none of the motor's: its curve and its efficiency stay. (They were those of the
    /// motor on another voltage, and of one instant of a ripple: an efficiency of 102 % could come out.)
    #[test]
    fn what_is_not_the_motors_or_ripples_moves_neither_curve_nor_powers() {
        use im_model::{EffectId, ParameterId, Rating};
        let named = im_model::machines::MOTULATOR_2_2_KW;
        let base = Machine::base(named.parameters(), named.pole_pairs).unwrap();
        let mut rating = Rating::guess(base.parameters(), base.pole_pairs());
        let breakdown = RatedSupply::of(&MotorFile::new("m", base, rating)).curve.iter().map(|p| p[1]).fold(0.0, f64::max);
        rating.torque_nm = 0.3 * breakdown;
        let base = base.rescaled(&rating).unwrap();
        let alone = RatedSupply::of(&MotorFile::new("m", base, rating));
        let mut left = 0;
        for &e in EffectId::ALL {
            let set: Vec<_> = e
                .parameters()
                .iter()
                .enumerate()
                .filter(|(_, p)| p.role == im_model::effects::Role::Strength)
                .map(|(k, p)| {
                    (ParameterId::Effect(e, k), p.typical.1 * rating.unit_of(p.scale, base.parameters(), base.pole_pairs()))
                })
                .collect();
            let with = RatedSupply::of(&MotorFile::new("m", base.with(&set).unwrap(), rating));
            let loaded = with.loaded.unwrap_or_else(|| panic!("{e} at {} Nm of {breakdown}", rating.torque_nm));
            assert!(
                (0.5..1.0).contains(&loaded.efficiency()) && loaded.powers.net().abs() < 1e-6 * loaded.powers.load,
                "{e}: {loaded:?}"
            );
            let about = e.about();
            if matches!(about.place, Place::Voltage | Place::Command | Place::Sensors)
                || about.steady_state == SteadyState::Ripples
            {
                assert_eq!(with, alone, "{e}");
                left += 1;
            }
        }
        assert!(left > 8, "{left}");
    }

    /// What goes in comes out or is lost, and is the product of torque and speed where it comes out.
    #[test]
    fn powers_at_rated_torque_balance() {
        let named = im_model::machines::MOTULATOR_2_2_KW;
        let machine = Machine::base(named.parameters(), named.pole_pairs).unwrap();
        let rating = im_model::Rating::guess(&named.parameters(), named.pole_pairs);
        let mut motor = MotorFile::new("m", machine, rating);
        let breakdown = RatedSupply::of(&motor).curve.iter().map(|p| p[1]).fold(0.0, f64::max);
        motor.rating.torque_nm = 1.1 * breakdown;
        assert_eq!(RatedLoad::of(&motor), None);
        motor.rating.torque_nm = 0.3 * breakdown;
        let rating = motor.rating;
        let loaded = RatedLoad::of(&motor).unwrap();
        let p = loaded.powers;
        assert!((p.load - rating.torque_nm * loaded.omega_m).abs() < 1e-9 * p.load, "{p:?}");
        assert!(p.net().abs() < 1e-6 * p.electrical_input, "{p:?}");
        assert!((0.5..1.0).contains(&loaded.efficiency()), "{}", loaded.efficiency());
    }
}
