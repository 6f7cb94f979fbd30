//! An effect that the library does not hold: the loop says `unexplained` and shows on what the residual depends; one writes the effect
//! (`im_tests::own_effect`, thirty lines), gives it to the loop, and it is named, sized and judged like a built-in one.
//!
//! cargo run --release -p im-tests --example own_effect_in_the_loop -- own_effect_in_the_loop.svg

use im_chart::{Series, chart};
use im_diagnose::diagnosis::{Diagnosis, diagnose};
use im_diagnose::search::Options;
use im_model::effects::CustomId;
use im_model::{EffectId, ParameterId};
use im_tests::campaign::case_of;
use im_tests::hidden::{EffectKind, Strength, TrialCase, simulate};
use im_tests::own_effect::SaturatedSensorsEffect;

fn tell(d: &Diagnosis) {
    let last = &d.steps[d.steps.len() - 1];
    let error = last.holdout.as_ref().map_or(f64::NAN, |e| e.rms_in_sigma());
    println!("  verdict: {}, effects {:?}", d.verdict.name(), d.effects.iter().map(|e| e.name()).collect::<Vec<_>>());
    println!("  held-out error: {error:.2} σ rms");
    for l in d.dependences.iter().take(2) {
        println!("  residual: {} depends on {} (p = 1e-{:.0})", l.part.label(), l.variable.label(), l.log_p);
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Recordings with current sensors that saturate.
    let trial = simulate(&TrialCase::new(4, &[(EffectKind::CurrentSensorSaturation, Strength::Strong)], 11));

    println!("with the library alone:");
    let alone = diagnose(case_of(&trial), Options::default())?;
    tell(&alone);

    println!("with an effect of one's own:");
    let own = CustomId(&SaturatedSensorsEffect);
    let mut case = case_of(&trial);
    let machine = &case.motor.machine;
    case.motor.machine = machine.with_effects(machine.effects().with_custom(own))?;
    let d = diagnose(case, Options::default())?;
    tell(&d);
    let level = 1.0 / d.refined.machine.get(ParameterId::Effect(EffectId::Custom(own), 0));
    println!("  the sensors show no more than {level:.2} A; in truth {:.2} A", trial.truth.effects[0].parameters[0].1);
    if let Some(path) = std::env::args().nth(1) {
        let errors = |name: &str, d: &Diagnosis| {
            let floors = d.steps.iter().filter_map(|s| Some(s.holdout.as_ref()?.chi2_per_sample.log10()));
            Series::line(name, floors.enumerate().map(|(k, e)| (k as f64, e)))
        };
        let series = [errors("the library alone", &alone), errors("with an effect of one's own", &d)];
        std::fs::write(path, chart("Current sensors that saturate", "effects added", "lg of the held-out error", &series))?;
    }
    Ok(())
}
