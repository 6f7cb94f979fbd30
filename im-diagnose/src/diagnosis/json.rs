//! `diagnosis.json`.

use std::collections::BTreeMap;

use im_model::EffectId;
use serde_json::{Value, json};

use super::{Diagnosis, ElectricalSide};
use crate::residuals::Errors;
use crate::steady_curve;

impl Diagnosis {
    /// The answer for programs: what [`Story::to_json`](crate::report::Story::to_json) adds to is `diagnosis.json`.
    pub fn to_json(&self) -> Value {
        let finite = |x: f64| if x.is_finite() { json!(x) } else { Value::Null };
        let names = |v: &[EffectId]| v.iter().map(|e| e.name()).collect::<Vec<_>>();
        let alternatives: BTreeMap<&str, Vec<&str>> =
            self.effects.iter().zip(&self.alternatives).map(|(e, a)| (e.name(), names(a))).collect();
        json!({
            "schema": 1,
            "verdict": self.verdict.name(),
            "doubts": self.doubts.iter().map(|d| d.name()).collect::<Vec<_>>(),
            "on_mains": self.case.is_on_mains(),
            "effects": names(&self.effects),
            "named": names(self.named()),
            "unknown_curves": names(&self.curves),
            "alternatives": alternatives,
            "posterior": self.course.posterior.to_json(),
            "ranking": self.ranking.iter().map(|c| json!({
                "effect": c.effect.name(),
                "score": finite(c.score),
                "threshold": finite(c.threshold),
                "predicted_size": finite(c.predicted_size),
                "keep": finite(c.explained_share),
                "explained_share": finite(c.explained_share),
                "detectable_size": finite(c.detectable_size),
                "usual_size": finite(c.usual_size),
                "unit": c.unit,
                "excited": c.excited,
                "conclusion": c.conclusion,
            })).collect::<Vec<_>>(),
            "steps": self.steps.iter().map(|s| json!({
                "effects": names(&s.effects),
                "train": s.train.to_json(),
                "holdout": s.holdout.as_ref().map(Errors::to_json),
            })).collect::<Vec<_>>(),
            "parameters": self.parameters.iter().map(|p| (p.quantity.key(), json!({
                "before": finite(p.before), "after": finite(p.after), "std": finite(p.std), "unit": p.quantity.unit(),
                "leakage_ratio_held": p.ratio_held,
            }))).collect::<serde_json::Map<_, _>>(),
            "covariance": self.estimates.to_json(),
            "prediction": self.refined.prediction.map(|p| p.entries().collect::<BTreeMap<_, _>>()),
            "prediction_by_training": self.by_training.map(|p| p.entries().collect::<BTreeMap<_, _>>()),
            "residual_tests": self.dependences.iter().take(6).map(|d| json!({
                "depends_on": d.variable.label(), "part": d.part.label(), "log10_p": -d.log_p, "size": d.size, "curve": d.curve,
            })).collect::<Vec<_>>(),
            "learned": self.learned.iter().map(|c| json!({
                "effect": c.effect.name(),
                "over": c.effect.free_form().map(|f| f.labels().0),
                "adds": c.effect.free_form().map(|f| f.labels().1),
                "curve": c.points,
                "rivals": names(&c.rivals),
                "formulas": c.formulas.iter().take(5).map(|f| json!({
                    "name": f.name, "formula": f.text, "cost": finite(f.cost), "off": finite(f.off), "factors": f.factors, "shape": f.shape,
                })).collect::<Vec<_>>(),
                "means": c.meaning(),
            })).collect::<Vec<_>>(),
            "loads": self.loads.to_json(),
            "electrical_side": self.electrical_side.as_ref().map(ElectricalSide::to_json),
            "torque_speed": steady_curve::to_json(&[("before", &self.rated[0]), ("after", &self.rated[1])]),
            "losses": self.losses,
            "noise": self.noise,
            "remarks": self.remarks(),
        })
    }
}
