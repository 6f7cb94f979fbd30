//! The machines: eleven from 0.37 to 50 kW with 2, 4 and 6 poles, T circuit, star-equivalent.

use super::chance::Chance;
use std::fmt::Write as _;

/// Parameters of a machine without hidden effects, and its rating.
#[derive(Clone, Debug, PartialEq)]
pub struct CatalogueMachine {
    /// Name for people.
    pub name: String,
    /// Pole pairs.
    pub pole_pairs: u32,
    /// Stator resistance per phase, Ω.
    pub stator_resistance_ohm: f64,
    /// Rotor resistance per phase seen from the stator, Ω.
    pub rotor_resistance_ohm: f64,
    /// Stator leakage inductance, H.
    pub stator_leakage_h: f64,
    /// Rotor leakage inductance, H.
    pub rotor_leakage_h: f64,
    /// Magnetizing inductance, H.
    pub magnetizing_h: f64,
    /// Inertia of rotor and load, kg m².
    pub inertia_kg_m2: f64,
    /// Viscous friction, N m s/rad.
    pub friction_nm_s: f64,
    /// Rated torque, N m.
    pub rated_torque_nm: f64,
    /// Rated supply frequency, Hz.
    pub rated_frequency_hz: f64,
    /// Rated phase voltage, peak, V.
    pub rated_voltage_v: f64,
    /// Rotor flux at rating, V s.
    pub rated_rotor_flux_vs: f64,
}

/// Name, pole pairs, R_s, R_r (Ω), L_ls, L_lr, L_m (H), J (kg m²), B (N m s), torque (N m), frequency (Hz), voltage (V), flux (V s).
type Row = (&'static str, u32, [f64; 11]);

const MACHINES: [Row; 11] = [
    ("0.37 kW 4-pole", 2, [27.0, 22.0, 0.06, 0.06, 0.9, 0.0008, 2.0e-4, 2.5, 50.0, 325.0, 0.89]),
    ("0.75 kW 2-pole", 1, [9.5, 7.5, 0.025, 0.028, 0.75, 0.001, 1.2e-4, 2.5, 50.0, 325.0, 0.94]),
    ("1.5 kW 6-pole", 3, [4.3, 3.6, 0.02, 0.021, 0.19, 0.013, 2.4e-3, 15.3, 50.0, 325.0, 0.88]),
    ("3 kW 4-pole", 2, [2.1, 1.7, 0.0085, 0.0085, 0.2, 0.016, 2.0e-3, 20.0, 50.0, 325.0, 0.94]),
    ("5.5 kW 4-pole", 2, [0.95, 0.65, 0.0042, 0.0042, 0.125, 0.042, 3.4e-3, 36.0, 50.0, 325.0, 0.96]),
    ("7.5 kW 2-pole", 1, [0.72, 0.5, 0.0034, 0.0036, 0.17, 0.025, 1.3e-3, 24.7, 50.0, 325.0, 0.97]),
    ("11 kW 6-pole", 3, [0.52, 0.38, 0.0034, 0.0034, 0.062, 0.17, 0.013, 109.0, 50.0, 325.0, 0.93]),
    ("18.5 kW 4-pole", 2, [0.24, 0.17, 0.0017, 0.0017, 0.055, 0.16, 0.009, 121.0, 50.0, 325.0, 0.96]),
    ("30 kW 4-pole 60 Hz", 2, [0.125, 0.09, 0.00105, 0.00105, 0.037, 0.3, 0.011, 162.0, 60.0, 375.0, 0.94]),
    ("45 kW 6-pole", 3, [0.075, 0.06, 0.0008, 0.0008, 0.0225, 1.2, 0.045, 440.0, 50.0, 325.0, 0.96]),
    ("50 kW 2-pole", 1, [0.062, 0.045, 0.0007, 0.0007, 0.034, 0.34, 0.006, 161.0, 50.0, 325.0, 0.98]),
];

impl CatalogueMachine {
    /// How many machines there are.
    pub const COUNT: usize = MACHINES.len();

    /// The machine of the list, as the catalogue has it.
    ///
    /// # Panics
    /// If `index` is not below [`CatalogueMachine::COUNT`].
    pub fn catalogue(index: usize) -> Self {
        let (name, pole_pairs, [r_s, r_r, l_ls, l_lr, l_m, j, b, torque, frequency, voltage, flux]) = MACHINES[index];
        Self {
            name: name.to_owned(),
            pole_pairs,
            stator_resistance_ohm: r_s,
            rotor_resistance_ohm: r_r,
            stator_leakage_h: l_ls,
            rotor_leakage_h: l_lr,
            magnetizing_h: l_m,
            inertia_kg_m2: j,
            friction_nm_s: b,
            rated_torque_nm: torque,
            rated_frequency_hz: frequency,
            rated_voltage_v: voltage,
            rated_rotor_flux_vs: flux,
        }
    }

    /// The seven parameters, in the order of `motor.toml`.
    fn parameters_mut(&mut self) -> [&mut f64; 7] {
        [
            &mut self.stator_resistance_ohm,
            &mut self.rotor_resistance_ohm,
            &mut self.stator_leakage_h,
            &mut self.rotor_leakage_h,
            &mut self.magnetizing_h,
            &mut self.inertia_kg_m2,
            &mut self.friction_nm_s,
        ]
    }

    /// The machine with each parameter off by a factor between 1 − `part` and 1 + `part`.
    pub fn scattered(&self, part: f64, chance: &mut Chance) -> Self {
        let mut other = self.clone();
        for parameter in other.parameters_mut() {
            *parameter *= 1.0 + chance.between(-part, part);
        }
        other
    }

    /// Rated electrical frequency, rad/s.
    pub fn rated_electrical_rad_s(&self) -> f64 {
        std::f64::consts::TAU * self.rated_frequency_hz
    }

    /// Mechanical speed at rated frequency without slip, rad/s.
    pub fn synchronous_speed_rad_s(&self) -> f64 {
        self.rated_electrical_rad_s() / f64::from(self.pole_pairs)
    }

    /// Magnetizing current of the rated flux, peak, A.
    pub fn rated_magnetizing_a(&self) -> f64 {
        self.rated_rotor_flux_vs / self.magnetizing_h
    }

    /// Stator current at rated torque and rotor flux, peak, A.
    pub fn rated_current_a(&self) -> f64 {
        let coupling = self.magnetizing_h / (self.magnetizing_h + self.rotor_leakage_h);
        let torque_current = self.rated_torque_nm / (1.5 * f64::from(self.pole_pairs) * coupling * self.rated_rotor_flux_vs);
        self.rated_magnetizing_a().hypot(torque_current)
    }

    /// Rated mechanical power (without slip), W.
    pub fn rated_power_w(&self) -> f64 {
        self.rated_torque_nm * self.synchronous_speed_rad_s()
    }

    /// The machine as a `motor.toml` text.
    pub fn motor_toml(&self, name: &str) -> String {
        let mut text = format!("# {name}\n# nameplate-grade parameters of the machine under test; star-equivalent, T circuit\n");
        text += &format!("[machine]\nname = \"{name}\"\npole_pairs = {}\n\n[machine.parameters]\n", self.pole_pairs);
        let parameters = [
            ("stator_resistance_ohm", self.stator_resistance_ohm),
            ("rotor_resistance_ohm", self.rotor_resistance_ohm),
            ("stator_leakage_inductance_h", self.stator_leakage_h),
            ("rotor_leakage_inductance_h", self.rotor_leakage_h),
            ("magnetizing_inductance_h", self.magnetizing_h),
            ("inertia_kg_m2", self.inertia_kg_m2),
            ("viscous_friction_nm_s_per_rad", self.friction_nm_s),
        ];
        let rating = [
            ("torque_nm", self.rated_torque_nm),
            ("electrical_frequency_hz", self.rated_frequency_hz),
            ("phase_voltage_peak_v", self.rated_voltage_v),
            ("rotor_flux_vs", self.rated_rotor_flux_vs),
        ];
        for (key, value) in parameters {
            let _ = writeln!(text, "{key} = {}", super::table::significant(value, 6));
        }
        text += "\n[machine.rating]\n";
        for (key, value) in rating {
            let _ = writeln!(text, "{key} = {value:?}");
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hidden::steady::steady_state;

    #[test]
    fn every_machine_pulls_out_at_about_two_to_four_times_its_rated_torque() {
        for index in 0..CatalogueMachine::COUNT {
            let m = CatalogueMachine::catalogue(index);
            let torque = |slip: f64| steady_state(&m, m.rated_voltage_v, m.rated_electrical_rad_s(), slip).torque_nm;
            let pull_out = (1..400).map(|k| torque(f64::from(k) / 400.0)).fold(0.0, f64::max);
            let ratio = pull_out / m.rated_torque_nm;
            assert!((2.0..4.5).contains(&ratio), "{}: {ratio}", m.name);
        }
    }

    #[test]
    fn scatter_stays_inside_its_bounds() {
        let m = CatalogueMachine::catalogue(3);
        let mut other = m.scattered(0.1, &mut Chance::new(3, "machine"));
        let mut base = m.clone();
        for (a, b) in other.parameters_mut().into_iter().zip(base.parameters_mut()) {
            assert!((*a / *b - 1.0).abs() <= 0.1 && *a != *b);
        }
    }
}
