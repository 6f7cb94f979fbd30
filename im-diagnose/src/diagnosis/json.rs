//! `diagnosis.json`.

use std::collections::BTreeMap;

use im_model::EffectId;
use serde_json::{Value, json};

use super::Diagnosis;
use crate::residuals::Errors;
use crate::steady_curve;

impl Diagnosis {
    /// `diagnosis.json`, in the shape that others read.
    pub fn to_json(&self) -> Value {
        let finite = |x: f64| if x.is_finite() { json!(x) } else { Value::Null };
        let errors = |e: &Errors| json!({"chi2_per_sample": finite(e.chi2_per_sample), "rms_in_sigma": finite(e.rms_in_sigma()), "rmse": e.rmse, "fit_percent": e.fit_percent});
        let names = |v: &[EffectId]| v.iter().map(|e| e.name()).collect::<Vec<_>>();
        let alternatives: BTreeMap<&str, Vec<&str>> =
            self.effects.iter().zip(&self.alternatives).map(|(e, a)| (e.name(), names(a))).collect();
        json!({
            "schema": 1,
            "verdict": self.verdict.name(),
            "effects": names(&self.effects),
            "named": names(self.named()),
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
                "unit": c.unit,
                "conclusion": c.conclusion,
            })).collect::<Vec<_>>(),
            "steps": self.steps.iter().map(|s| json!({
                "effects": names(&s.effects),
                "train": errors(&s.train),
                "holdout": s.holdout.as_ref().map(errors),
            })).collect::<Vec<_>>(),
            "parameters": self.parameters.iter().map(|p| (p.quantity.key(), json!({
                "before": finite(p.before), "after": finite(p.after), "std": p.std.map(finite), "unit": p.quantity.unit(),
                "leakage_ratio_held": p.std.is_none(),
            }))).collect::<serde_json::Map<_, _>>(),
            "covariance": self.estimates.to_json(),
            "leftover": self.leftover.iter().take(6).map(|d| json!({
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
            "torque_speed": steady_curve::to_json(&[("before", &self.case.motor), ("after", &self.refined)]),
            "noise": self.noise,
            "remarks": self.remarks(),
        })
    }
}
