//! What a certificate is about: that its machine can be one, and whether it is a given one.

use super::check::CheckError;
use super::file::{Certificate, Design, DesignModel};
use super::validity;
use crate::LinearMachine;
use crate::machine::Constants;
use crate::mtpa::{Circuit, TCircuit};
use sha2::{Digest, Sha256};

/// A parameter in which a motor is not the machine of a certificate.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Its key.
    pub key: String,
    /// What the certificate says.
    pub certified: f64,
    /// What the motor has.
    pub motor: f64,
}

/// Equal but for the last digits of a float.
fn equal(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-12 * a.abs().max(b.abs())
}

impl DesignModel {
    /// That some machine has these parameters or constants, and that they are in range.
    ///
    /// # Errors
    /// What no machine has.
    pub fn check(&self) -> Result<(), CheckError> {
        let table = toml::Value::try_from(self).map_err(|e| CheckError::Malformed(e.to_string()))?;
        match self {
            DesignModel::Machine(machine) => {
                validity::check("plant", &table)?;
                machine.validate().map_err(|e| CheckError::Malformed(e.to_string()))
            }
            DesignModel::Constants(constants) => {
                let machine = machine_of(constants)?;
                machine.validate().map_err(|e| CheckError::Malformed(format!("the constants are those of no machine: {e}")))?;
                DesignModel::Machine(machine).check()
            }
        }
    }

    /// The machine, or the one that the constants are derived from.
    ///
    /// # Errors
    /// Constants that no machine has.
    pub fn machine(&self) -> Result<LinearMachine, CheckError> {
        match self {
            DesignModel::Machine(machine) => Ok(*machine),
            DesignModel::Constants(constants) => machine_of(constants),
        }
    }

    /// SHA-256 over the machine as the file holds it, in hexadecimal digits.
    pub fn digest(&self) -> String {
        let text = toml::to_string(self).unwrap_or_default();
        Sha256::digest(text.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

/// The machine that has some derived constants; nine of them have eight parameters, so that one must follow from the others.
///
/// L_m = ηL_m/η, L_m/L_r = βσL_s =: k, R_r = ηL_r, L_s = σL_s + kL_m, R_s = (R_s/σL_s)σL_s, J = (3/2)n_p k/μ, D = (D/J)J,
/// and γ = R_s/σL_s + β ηL_m.
fn machine_of(c: &Constants<f64>) -> Result<LinearMachine, CheckError> {
    let none = |what: String| Err(CheckError::Malformed(format!("the constants are those of no machine: {what}")));
    let positive = [
        ("eta", c.eta),
        ("beta", c.beta),
        ("gamma", c.gamma),
        ("mu", c.mu),
        ("eta_l_m", c.eta_l_m),
        ("stator_rate", c.stator_rate),
        ("inverse_sigma_l_s", c.inverse_sigma_l_s),
        ("n_p", c.n_p),
    ];
    if let Some((key, x)) = positive.into_iter().find(|(_, x)| !(*x > 0.0 && x.is_finite())) {
        return none(format!("{key} = {x:e} must be positive"));
    }
    if c.n_p.fract() != 0.0 || c.n_p > 100.0 {
        return none(format!("n_p = {} must be a whole number up to 100", c.n_p));
    }
    if !equal(c.gamma, c.stator_rate + c.beta * c.eta_l_m) {
        return none(format!("gamma = {} must be stator_rate + beta eta_l_m = {}", c.gamma, c.stator_rate + c.beta * c.eta_l_m));
    }
    let sigma_l_s = 1.0 / c.inverse_sigma_l_s;
    let (l_m, k) = (c.eta_l_m / c.eta, c.beta * sigma_l_s);
    let inertia_kg_m2 = 1.5 * c.n_p * k / c.mu;
    Ok(LinearMachine {
        stator_resistance_ohm: c.stator_rate * sigma_l_s,
        rotor_resistance_ohm: c.eta * l_m / k,
        stator_inductance_h: sigma_l_s + k * l_m,
        rotor_inductance_h: l_m / k,
        mutual_inductance_h: l_m,
        pole_pairs: c.n_p as u32,
        inertia_kg_m2,
        viscous_friction_n_m_s: c.friction_rate * inertia_kg_m2,
    })
}

impl Certificate {
    /// In what a motor is not the machine that the certificate is about; nothing when it is that one.
    ///
    /// Of a design for the steady state with saturation the circuit is compared too, where it is the motor's own kind.
    ///
    /// # Errors
    /// A certificate whose machine is none.
    pub fn differences(&self, motor: &im_model::Machine<f64>) -> Result<Vec<Difference>, CheckError> {
        let parameters = |plant: &DesignModel| -> Result<Vec<(String, f64)>, CheckError> {
            let table = toml::Table::try_from(plant.machine()?).map_err(|e| CheckError::Malformed(e.to_string()))?;
            let number = |v: &toml::Value| v.as_float().or_else(|| v.as_integer().map(|x| x as f64));
            Ok(table.iter().filter_map(|(key, v)| Some((key.clone(), number(v)?))).collect())
        };
        let mut pairs = parameters(&self.plant)?;
        let mut own = parameters(&DesignModel::Machine(LinearMachine::from(motor)))?;
        if let Design::Mtpa(design) = &self.design
            && let Circuit::T(circuit) = &design.circuit
        {
            pairs.extend(circuit.effects());
            own.extend(TCircuit::from(motor).effects());
        }
        let close = match self.plant {
            DesignModel::Machine(_) => |a: f64, b: f64| equal(a, b),
            // Derived back from constants, with their rounding.
            DesignModel::Constants(_) => |a: f64, b: f64| (a - b).abs() <= 1e-9 * a.abs().max(b.abs()),
        };
        let differs = |((key, certified), (_, motor)): ((String, f64), (String, f64))| {
            (!close(certified, motor)).then_some(Difference { key, certified, motor })
        };
        Ok(pairs.into_iter().zip(own).filter_map(differs).collect())
    }

    /// Whether what is claimed holds for another machine as well: decided anew, as [`Certificate::prove`] does.
    ///
    /// # Errors
    /// The first obligation that is false for it.
    pub fn prove_for(&self, motor: &im_model::Machine<f64>) -> Result<(), CheckError> {
        Certificate { plant: DesignModel::Machine(LinearMachine::from(motor)), ..self.clone() }.prove().map(|_| ())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_lead_back_to_their_machine() {
        for machine in [LinearMachine::kwon_table_iv(), LinearMachine::jadot_table_i(), LinearMachine::kenne_appendix_ii()] {
            let back = machine_of(&machine.constants()).unwrap();
            let values =
                |m: &LinearMachine| [m.stator_resistance_ohm, m.rotor_resistance_ohm, m.stator_inductance_h, m.inertia_kg_m2];
            for (a, b) in values(&machine).into_iter().zip(values(&back)) {
                assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
            }
            assert_eq!(DesignModel::Constants(machine.constants()).check(), Ok(()));
        }
        assert_eq!(DesignModel::Constants(Constants::kwon_printed()).check(), Ok(()));
    }

    #[test]
    fn constants_of_no_machine_are_refused() {
        let c = LinearMachine::jadot_table_i().constants::<f64>();
        let refused = |c: Constants<f64>| DesignModel::Constants(c).check().is_err();
        assert!(refused(Constants { beta: -c.beta, ..c }) && refused(Constants { n_p: 0.0, ..c }));
        assert!(refused(Constants { n_p: 1.5, ..c }) && refused(Constants { gamma: 0.5 * c.gamma, ..c }));
        assert!(refused(Constants { eta: f64::INFINITY, ..c }) && refused(Constants { friction_rate: -1.0, ..c }));
        // One that leads to an inductance of 10⁹ H.
        assert!(refused(Constants { eta: 1e-9 * c.eta, eta_l_m: c.eta_l_m, ..c }));
    }
}
