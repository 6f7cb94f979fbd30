//! The region that the gains of Kenné et al. hold over.

use serde::{Deserialize, Serialize};

/// Where the gains must hold, and how fast.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KenneRegion {
    /// |ω| up to this mechanical speed, rad/s.
    pub speed_max_rad_s: f64,
    /// Rotor flux linkage amplitudes, Wb.
    pub flux_vs: [f64; 2],
    /// Relative error of the estimated flux amplitude, below 1.
    pub flux_uncertainty: f64,
    /// |i_s| up to this, A.
    pub current_max_a: f64,
    /// |u_s| up to this, V (peak): 2/3 of the DC link's voltage for an inverter that may switch as it likes.
    pub voltage_max_v: f64,
    /// R_s over nominal.
    pub stator_resistance_ratio: [f64; 2],
    /// R_r over nominal, and R̂_r.
    pub rotor_resistance_ratio: [f64; 2],
    /// |dω/dt| up to this, rad/s².
    pub acceleration_max_rad_s2: f64,
    /// |ω̈_ref + c_ω ω̇_ref| up to this, rad/s³.
    pub reference_max_rad_s3: f64,
    /// Error of the load torque the law uses, over the inertia, rad/s².
    pub load_error_rad_s2: f64,
    /// |dT_L/dt|/J up to this, rad/s³.
    pub load_rate_rad_s3: f64,
    /// |dR_r/dt|/R_rn up to this, 1/s.
    pub rotor_resistance_rate_per_s: f64,
    /// c_ω of (17), 1/s.
    pub c_omega: f64,
    /// c_λ of (17), 1/s.
    pub c_lambda: f64,
    /// η_ω of (24), rad/s³: the surface is reached within |s_ω(0)|/η_ω.
    pub reach_omega: f64,
    /// η_λ of (24), Wb²/s²: the surface is reached within |s_λ(0)|/η_λ.
    pub reach_lambda: f64,
}

impl KenneRegion {
    /// A machine known exactly, under a steady load and at steady references, with surfaces of some 0.1 s: what is uncertain is set on top.
    /// Speed in rad/s (mechanical), flux amplitudes in Wb, current in A, voltage in V (peak).
    pub fn certain(speed_max_rad_s: f64, flux_vs: [f64; 2], current_max_a: f64, voltage_max_v: f64) -> Self {
        Self {
            speed_max_rad_s,
            flux_vs,
            flux_uncertainty: 0.0,
            current_max_a,
            voltage_max_v,
            stator_resistance_ratio: [1.0, 1.0],
            rotor_resistance_ratio: [1.0, 1.0],
            acceleration_max_rad_s2: 1000.0,
            reference_max_rad_s3: 0.0,
            load_error_rad_s2: 0.0,
            load_rate_rad_s3: 0.0,
            rotor_resistance_rate_per_s: 1.0,
            c_omega: 15.0,
            c_lambda: 10.0,
            reach_omega: 100.0,
            reach_lambda: 1.0,
        }
    }

    /// What is out of range, if anything is.
    pub(super) fn complaint(&self) -> Option<String> {
        let ordered = |[low, high]: [f64; 2]| 0.0 < low && low <= high && high.is_finite();
        let ranges = [
            ("flux_vs", self.flux_vs),
            ("stator_resistance_ratio", self.stator_resistance_ratio),
            ("rotor_resistance_ratio", self.rotor_resistance_ratio),
        ];
        let bad = ranges.into_iter().find(|(_, range)| !ordered(*range));
        let values = [
            ("speed_max_rad_s", self.speed_max_rad_s),
            ("current_max_a", self.current_max_a),
            ("voltage_max_v", self.voltage_max_v),
            ("acceleration_max_rad_s2", self.acceleration_max_rad_s2),
            ("reference_max_rad_s3", self.reference_max_rad_s3),
            ("load_error_rad_s2", self.load_error_rad_s2),
            ("load_rate_rad_s3", self.load_rate_rad_s3),
            ("rotor_resistance_rate_per_s", self.rotor_resistance_rate_per_s),
            ("c_omega", self.c_omega),
            ("c_lambda", self.c_lambda),
        ];
        if let Some((name, range)) = bad {
            Some(format!("{name} = {range:?} must be positive and ordered"))
        } else if !(0.0..1.0).contains(&self.flux_uncertainty) {
            Some(format!("flux_uncertainty = {} must lie in [0, 1)", self.flux_uncertainty))
        } else {
            let bad = values.iter().find(|(_, v)| !(*v >= 0.0 && v.is_finite()));
            bad.map(|(name, v)| format!("{name} = {v} must be finite and not negative"))
        }
    }
}
