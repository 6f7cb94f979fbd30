//! An effect that the library does not hold: the loop says `unexplained` and shows on what the leftover depends; one writes the effect
//! (`im_tests::own_effect`, thirty lines), gives it to the loop, and it is named, sized and judged like a built-in one.
//!
//! cargo run --release -p imkit-tests --example own_effect_in_the_loop

use im_diagnose::diagnosis::{Diagnosis, diagnose};
use im_diagnose::refine::Options;
use im_model::effects::CustomId;
use im_model::{EffectId, ParameterId};
use im_tests::campaign::case_of;
use im_tests::hidden::{Case, EffectKind, Strength, simulate};
use im_tests::own_effect::TachometerScaleEffect;

fn tell(d: &Diagnosis) {
    let last = &d.steps[d.steps.len() - 1];
    let error = last.holdout.as_ref().map_or(f64::NAN, |e| e.chi2_per_sample);
    println!("  verdict: {}, effects {:?}", d.verdict.name(), d.effects.iter().map(|e| e.name()).collect::<Vec<_>>());
    println!("  held-out error: {error:.2} noise floors");
    for l in d.leftover.iter().take(2) {
        println!("  leftover: {} depends on {} (p = 1e-{:.0})", l.part.label(), l.variable.label(), l.log_p);
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Recordings of a machine whose tachometer shows too much; nothing below is told so.
    let trial = simulate(&Case::new(4, &[(EffectKind::SpeedSensorScale, Strength::Strong)], 11));

    println!("with the library alone:");
    tell(&diagnose(case_of(&trial), Options::default())?);

    println!("with an effect of one's own:");
    let own = CustomId(&TachometerScaleEffect);
    let mut case = case_of(&trial);
    let machine = &case.motor.machine;
    case.motor.machine = machine.with_effects(machine.effects().with_custom(own))?;
    let d = diagnose(case, Options::default())?;
    tell(&d);
    let gain = d.refined.machine.get(ParameterId::Effect(EffectId::Custom(own), 0));
    println!("  the tachometer shows {:.2} % of the true speed", 100.0 * (1.0 + gain));
    Ok(())
}
