//! `diagnosis.json`: the answer, and every number that the page shows beside it.

use serde_json::{Map, Value, json};

use super::curves::curve;
use super::sections::parameter_warning;
use super::story::{Story, summary};
use crate::residuals::Errors;
use crate::statistics::cosine;

impl Story<'_> {
    /// The answer ([`Diagnosis::to_json`](crate::diagnosis::Diagnosis::to_json)) with what the page shows beside it.
    pub fn to_json(&self) -> Value {
        let said = summary(self);
        let mut all = self.d.to_json();
        all["summary"] = json!({"cause": said.cause, "beside": said.beside, "electrical_side": said.electrical, "sure": said.sure, "would_refute": said.refute});
        all["given"] = self.given.as_ref().map_or(
            Value::Null,
            |(train, holdout)| json!({"train": train.to_json(), "holdout": holdout.as_ref().map(Errors::to_json)}),
        );
        all["localisation"] = self.localisation();
        all["rounds"] = self.rounds();
        all["look_alikes"] = self.look_alikes();
        all["curves"] = self.curves();
        let base = &self.d.steps[0].machine;
        for p in &self.d.parameters {
            let of = &mut all["parameters"][p.quantity.key()];
            of["base_model"] = json!(p.quantity.of(base));
            of["warning"] = json!(parameter_warning(p, self.d));
        }
        all["data_quality"] = json!(self.meta.quality);
        all["next_test"] = json!(self.meta.next_test);
        all["run"] = json!({
            "program": self.meta.program, "command": self.meta.command, "seed": self.meta.seed, "made": self.meta.made,
            "read": self.meta.files, "files": self.used(),
        });
        all
    }

    /// Where each model that is shown fails.
    fn localisation(&self) -> Value {
        let one = |s: &super::story::Shown| s.place.to_json(s.name);
        self.shown.iter().map(one).collect()
    }

    /// Round by round, the refits with one effect more.
    fn rounds(&self) -> Value {
        let trial = |t: &crate::search::Trial| {
            json!({
                "effect": t.effect.name(), "train_chi2_per_sample": t.model.train(), "holdout_chi2_per_sample": t.model.holdout,
            })
        };
        let stages = &self.d.course.stages;
        stages.iter().map(|s| s.round.trials.iter().map(trial).collect::<Value>()).collect()
    }

    /// Cosines between the signatures of the candidates in these recordings.
    fn look_alikes(&self) -> Value {
        let scores: Vec<_> = self.d.course.first().round.scores.iter().filter(|s| !s.signature.is_empty()).collect();
        let row =
            |a: &&crate::search::score::Score| scores.iter().map(|b| cosine(&a.signature, &b.signature)).collect::<Vec<f64>>();
        json!({
            "effects": scores.iter().map(|s| s.effect.name()).collect::<Vec<_>>(),
            "cosines": scores.iter().map(row).collect::<Vec<_>>(),
        })
    }

    /// The laws of the effects that the refined model holds.
    fn curves(&self) -> Value {
        let (fit, refined) = (&self.d.course.last().model.fit, &self.d.refined);
        let on = self.d.effects.iter().filter(|e| refined.machine.effects().is_on(**e));
        let drawn = on.filter_map(|&e| Some((e, curve(e, &refined.machine, fit, &refined.rating)?)));
        let one = |(e, c): (im_model::EffectId, super::curves::Curve)| {
            let value = json!({
                "x": c.x_label, "y": c.y_label, "shows": c.caption, "points": c.points, "without": c.without, "band": c.band,
            });
            (e.name().to_owned(), value)
        };
        drawn.map(one).collect::<Map<_, _>>().into()
    }
}
