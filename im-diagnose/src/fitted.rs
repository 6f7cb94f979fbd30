//! The parameters of a motor from recordings, its effects as they are, and how well they are known.

use im_identify::offline::FitError;
use im_model::{BaseParameter, InverseGammaParameters, MotorFile, ParameterId};
use serde_json::{Map, Value, json};

use crate::case::Case;
use crate::form_error::RATIO_ERROR;
use crate::residuals::{Errors, errors};
use crate::search::{Model, Options, Refinement};
use crate::uncertainty::{Estimate, Estimates, MachineQuantity};

/// Parameters of the T circuit that depend on the ratio of the leakages.
pub const HELD: [BaseParameter; 4] = [
    BaseParameter::RotorResistance,
    BaseParameter::StatorLeakageInductance,
    BaseParameter::RotorLeakageInductance,
    BaseParameter::MagnetizingInductance,
];

/// A fitted motor.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The motor as given.
    pub before: MotorFile,
    /// The fitted one.
    pub after: MotorFile,
    /// Its error on the recordings it was fitted to.
    pub train: Errors,
    /// Mean squared residual of the held-out recording in σ².
    pub holdout: Option<f64>,
    /// What the recordings determine, with its covariance.
    pub estimates: Estimates,
    /// Size of the supply's voltage over the rated one, where it is steady.
    pub supply: Option<f64>,
}

impl Fitted {
    /// Fits the motor of a case to its recordings.
    ///
    /// # Errors
    /// The fit cannot be made.
    pub fn new(case: Case, options: Options) -> Result<Self, FitError> {
        let (refinement, model) = Refinement::new(case, options)?;
        Ok(Self::of_model(&refinement, &model))
    }

    /// Of a model that is fitted already.
    pub fn of_model(refinement: &Refinement, model: &Model) -> Self {
        let (before, fit) = (refinement.case().motor.clone(), &model.fit);
        let after = MotorFile { machine: fit.machine, ..before.clone() };
        let train = errors(&fit.machine, refinement.nudged(), &fit.starts);
        let estimates = Estimates::of_fit(&before, fit, refinement.nudged());
        Self { before, after, train, holdout: model.holdout, estimates, supply: refinement.case().supply() }
    }

    /// Standard deviations of the parameters of [`HELD`]: by those of the inverse-Γ circuit, and by the ratio of the leakages, which is known to a
    /// fifth over the design classes of cage rotors. NaN where the recordings determine no such circuit.
    pub fn held_std(&self) -> [f64; 4] {
        let of = |q: MachineQuantity| self.estimates.list.iter().position(|e| e.quantity == q);
        let circuit =
            [MachineQuantity::RotorResistance, MachineQuantity::LeakageInductance, MachineQuantity::MagnetizingInductance]
                .map(of);
        let [Some(r), Some(l), Some(m)] = circuit else { return [f64::NAN; 4] };
        let given = self.after.machine.parameters();
        let at = [r, l, m].map(|k| self.estimates.list[k].after);
        let t = |x: [f64; 4]| {
            let circuit = InverseGammaParameters {
                stator_resistance_ohm: given.stator_resistance_ohm,
                rotor_resistance_ohm: x[0],
                leakage_inductance_h: x[1],
                magnetizing_inductance_h: x[2],
            };
            let t = circuit.to_t(x[3], given.inertia_kg_m2, given.viscous_friction_nm_s_per_rad);
            HELD.map(|p| t.values()[p as usize])
        };
        let x = [at[0], at[1], at[2], given.leakage_ratio()];
        let slopes: [[f64; 4]; 4] = std::array::from_fn(|k| {
            let step = 1e-4 * x[k];
            let moved = |by: f64| t(std::array::from_fn(|j| if j == k { x[j] + by } else { x[j] }));
            let (low, high) = (moved(-step), moved(step));
            std::array::from_fn(|p| (high[p] - low[p]) / (2.0 * step))
        });
        let covariance = |a: usize, b: usize| match (a, b) {
            (3, 3) => (RATIO_ERROR * x[3]).powi(2),
            (3, _) | (_, 3) => 0.0,
            _ => self.estimates.covariance[([r, l, m][a], [r, l, m][b])],
        };
        std::array::from_fn(|p| {
            let mut variance = 0.0;
            for a in 0..4 {
                for b in 0..4 {
                    variance += slopes[a][p] * covariance(a, b) * slopes[b][p];
                }
            }
            variance.max(0.0).sqrt()
        })
    }

    /// What `im fit --json` prints, but for the quality of the data.
    pub fn to_json(&self) -> Value {
        let held = HELD.into_iter().zip(self.held_std());
        let held =
            held.map(|(p, std)| (MachineQuantity::Parameter(ParameterId::Base(p)), None, Some(std).filter(|s| s.is_finite())));
        let all = self.estimates.list.iter().map(|e| (e.quantity, Some(e), Some(e.std))).chain(held);
        let one = |(q, e, std): (MachineQuantity, Option<&Estimate>, Option<f64>)| {
            let value = json!({
                "before": q.of(&self.before.machine), "after": q.of(&self.after.machine), "std": std, "unit": q.unit(),
                "determined": e.map(|e| !e.is_open()), "leakage_ratio_held": e.is_none(),
            });
            (q.key(), value)
        };
        let parameters: Map<_, _> = all.map(one).collect();
        json!({
            "schema": 1, "chi2_per_sample": self.train.chi2_per_sample, "rmse": self.train.rmse, "fit_percent": self.train.fit_percent,
            "parameters": parameters, "covariance": self.estimates.to_json(), "holdout_chi2_per_sample": self.holdout,
        })
    }
}
