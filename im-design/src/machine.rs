//! The machine that a design is for: the parameters of Kwon et al. (2005), Table II, and the constants derived from them.

use crate::error::DesignError;
use crate::exact::Field;
use serde::{Deserialize, Serialize};

/// Parameters of a linear induction machine, as certificates record them. SI units, star equivalent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinearMachine {
    /// R_s, Ω.
    pub stator_resistance_ohm: f64,
    /// R_r, Ω.
    pub rotor_resistance_ohm: f64,
    /// L_s, H.
    pub stator_inductance_h: f64,
    /// L_r, H.
    pub rotor_inductance_h: f64,
    /// L_m, H; L_m² < L_s L_r.
    pub mutual_inductance_h: f64,
    /// n_p.
    pub pole_pairs: u32,
    /// J, kg m².
    pub inertia_kg_m2: f64,
    /// D, N m s/rad; zero is allowed.
    pub viscous_friction_n_m_s: f64,
}

impl LinearMachine {
    /// Check every parameter's physical range.
    ///
    /// # Errors
    /// [`DesignError::Machine`] with the first field out of range.
    pub fn validate(&self) -> Result<(), DesignError> {
        let positive = [
            ("stator_resistance_ohm", self.stator_resistance_ohm),
            ("rotor_resistance_ohm", self.rotor_resistance_ohm),
            ("stator_inductance_h", self.stator_inductance_h),
            ("rotor_inductance_h", self.rotor_inductance_h),
            ("mutual_inductance_h", self.mutual_inductance_h),
            ("inertia_kg_m2", self.inertia_kg_m2),
            ("pole_pairs", f64::from(self.pole_pairs)),
        ];
        for (field, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(DesignError::Machine { field, value, requirement: "must be positive" });
            }
        }
        let d = self.viscous_friction_n_m_s;
        if !(d >= 0.0 && d.is_finite()) {
            let requirement = "must not be negative";
            return Err(DesignError::Machine { field: "viscous_friction_n_m_s", value: d, requirement });
        }
        if self.mutual_inductance_h * self.mutual_inductance_h >= self.stator_inductance_h * self.rotor_inductance_h {
            let (value, requirement) = (self.mutual_inductance_h, "must be below the root of L_s L_r: leakage is positive");
            return Err(DesignError::Machine { field: "mutual_inductance_h", value, requirement });
        }
        Ok(())
    }

    /// The constants of Kwon et al., Table II; exact when `F` is rational.
    pub fn constants<F: Field>(&self) -> Constants<F> {
        let f = F::from_f64;
        let [r_s, r_r] = [f(self.stator_resistance_ohm), f(self.rotor_resistance_ohm)];
        let [l_s, l_r, l_m] = [f(self.stator_inductance_h), f(self.rotor_inductance_h), f(self.mutual_inductance_h)];
        let j = f(self.inertia_kg_m2);
        let n_p = f(f64::from(self.pole_pairs));
        let eta = r_r.clone() / l_r.clone();
        let sigma_l_s = l_s - l_m.clone() * l_m.clone() / l_r.clone();
        let ratio = l_m.clone() / l_r.clone();
        Constants {
            beta: ratio.clone() / sigma_l_s.clone(),
            gamma: (r_s.clone() + ratio.clone() * ratio.clone() * r_r) / sigma_l_s.clone(),
            mu: f(1.5) * n_p.clone() * ratio / j.clone(),
            eta_l_m: eta.clone() * l_m,
            stator_rate: r_s / sigma_l_s.clone(),
            friction_rate: f(self.viscous_friction_n_m_s) / j,
            inverse_sigma_l_s: F::one() / sigma_l_s,
            eta,
            n_p,
        }
    }

    /// L_f = σL_s, H.
    pub fn leakage_inductance_h(&self) -> f64 {
        self.stator_inductance_h - self.mutual_inductance_h * self.mutual_inductance_h / self.rotor_inductance_h
    }

    /// The machine that Kwon et al. (2005) simulate and test, Table IV with J corrected (D/J = 0.238).
    pub fn kwon_table_iv() -> Self {
        Self::from(&im_model::machines::KWON_TABLE_IV)
    }

    /// The machine of Jadot et al. (2009), Table I with inductances in H.
    pub fn jadot_table_i() -> Self {
        Self::from(&im_model::machines::JADOT_TABLE_I)
    }

    /// The machine of Kenné et al. (2005), Appendix II (rotor quantities unreferred).
    pub fn kenne_appendix_ii() -> Self {
        Self::from(&im_model::machines::KENNE_APPENDIX_II)
    }

    fn from_windings(w: &im_model::WindingParameters<f64>, pole_pairs: u32) -> Self {
        LinearMachine {
            stator_resistance_ohm: w.stator_resistance_ohm,
            rotor_resistance_ohm: w.rotor_resistance_ohm,
            stator_inductance_h: w.stator_inductance_h,
            rotor_inductance_h: w.rotor_inductance_h,
            mutual_inductance_h: w.mutual_inductance_h,
            pole_pairs,
            inertia_kg_m2: w.inertia_kg_m2,
            viscous_friction_n_m_s: w.viscous_friction_nm_s_per_rad,
        }
    }
}

impl From<&im_model::machines::NamedMachine> for LinearMachine {
    fn from(named: &im_model::machines::NamedMachine) -> Self {
        LinearMachine::from_windings(&named.windings, named.pole_pairs)
    }
}

impl From<&im_model::Machine<f64>> for LinearMachine {
    /// The linear machine under the effects: gains are designed for the base model.
    fn from(machine: &im_model::Machine<f64>) -> Self {
        LinearMachine::from_windings(&machine.parameters().windings(), machine.pole_pairs())
    }
}

/// Derived constants: everything the matrices of Kwon et al. are made of.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Constants<F> {
    /// η = R_r/L_r, 1/s.
    pub eta: F,
    /// β = L_m/(σ L_s L_r), 1/H.
    pub beta: F,
    /// γ, 1/s.
    pub gamma: F,
    /// μ, 1/(kg m²).
    pub mu: F,
    /// η L_m, Ω.
    pub eta_l_m: F,
    /// R_s/(σ L_s) = γ − β η L_m, 1/s.
    pub stator_rate: F,
    /// D/J, 1/s.
    pub friction_rate: F,
    /// 1/(σ L_s), 1/H.
    pub inverse_sigma_l_s: F,
    /// n_p.
    pub n_p: F,
}

impl Constants<f64> {
    /// The constants that Kwon et al. print in A, B₁ and B₂ of Section VII. They do not follow from Table IV.
    pub fn kwon_printed() -> Self {
        let (eta_l_m, beta, gamma) = (0.109, 195.861 / 2.0, 42.044);
        Constants {
            eta: 11.946,
            beta,
            gamma,
            mu: 4.907,
            eta_l_m,
            stator_rate: gamma - beta * eta_l_m,
            friction_rate: 0.238,
            inverse_sigma_l_s: 142.454,
            n_p: 2.0,
        }
    }

    /// The same constants, exactly, over another field.
    pub fn over<F: Field>(&self) -> Constants<F> {
        let f = F::from_f64;
        Constants {
            eta: f(self.eta),
            beta: f(self.beta),
            gamma: f(self.gamma),
            mu: f(self.mu),
            eta_l_m: f(self.eta_l_m),
            stator_rate: f(self.stator_rate),
            friction_rate: f(self.friction_rate),
            inverse_sigma_l_s: f(self.inverse_sigma_l_s),
            n_p: f(self.n_p),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact::Rational;

    #[test]
    fn stator_rate_is_gamma_less_beta_eta_l_m_exactly() {
        let c = LinearMachine::kwon_table_iv().constants::<Rational>();
        assert_eq!(c.stator_rate, c.gamma - c.beta * c.eta_l_m);
    }

    #[test]
    fn impossible_machines_are_refused_by_name() {
        let mut m = LinearMachine::jadot_table_i();
        m.mutual_inductance_h = 0.16;
        assert!(matches!(m.validate(), Err(DesignError::Machine { field: "mutual_inductance_h", .. })));
    }
}
