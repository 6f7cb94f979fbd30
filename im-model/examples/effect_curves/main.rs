//! The curves of `docs/effects.md`, one for each effect, as reports draw them: the machine without the effect, and with a large usual
//! size of it.
//!
//!     cargo run --release -p im-model --example effect_curves -- docs/images/effects

use im_chart::{Panel, Series, panels};
use im_model::effects::{Rated, Role};
use im_model::{EffectId, Effects, machines};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).ok_or("give the folder to draw into")?;
    std::fs::create_dir_all(&folder)?;
    let m = machines::MOTULATOR_2_2_KW;
    let p = m.parameters();
    let on = Rated::new(&p, m.pole_pairs, &m.rating);
    let without = Effects::scaled(&m.rating, &p, m.pole_pairs);
    for &effect in EffectId::ALL {
        let mut with = without;
        for (k, info) in effect.parameters().iter().enumerate().filter(|(_, p)| p.role == Role::Strength) {
            // Not at its largest, at which some curves are cut.
            let size = info.typical.0.powf(0.2) * info.typical.1.powf(0.8);
            with.set(effect, k, size * m.rating.unit_of(info.scale, &p, m.pole_pairs));
        }
        let Some(frame) = with.frame(effect, &on) else { continue };
        let (lo, hi) = frame.range;
        let at = |k: i32| {
            let t = f64::from(k) / 160.0;
            if frame.log { lo * (hi / lo).powf(t) } else { lo + (hi - lo) * t }
        };
        let line = |e: &Effects<f64>| {
            let points = (0..=160).map(at).map(|x| (x, e.law(effect, &on, x)));
            let shown = |(x, y): (f64, f64)| if frame.log { (x.log10(), y.log10()) } else { (x, y) };
            points.map(shown).collect::<Vec<_>>()
        };
        let label = |text: &str| if frame.log { format!("log₁₀ of {text}") } else { text.to_owned() };
        let panel =
            Panel::new(label(frame.y_label), [Series::dashed("without", line(&without)), Series::line("with", line(&with))]);
        std::fs::write(format!("{folder}/{}.svg", effect.name()), panels(frame.caption, &label(frame.x_label), &[panel]))?;
    }
    Ok(())
}
