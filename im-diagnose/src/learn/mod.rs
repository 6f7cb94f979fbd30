//! The act after the last: where no effect of the library explains what is left, a curve that nobody wrote is learned.
//!
//! Free-form effects ([`im_model::effects::FreeForm`]) are effects to the search: scored, refitted and judged beside those of the library by the same
//! criterion, in which a curve counts as many parameters as the data determine of it. Where an effect of the library explains as much, it wins;
//! where a curve wins, the library is not said to explain the recordings, whether the curve is learned or not.
//! `places`: which curves may be missing. `curve`: what was learned, with its band. `forms`: which formula it looks like.

mod curve;
mod forms;
mod places;
mod rust;
mod words;
pub use places::places;

pub use curve::Curve;
pub use forms::Formula;
pub use rust::{own_effect, own_source};

use im_identify::offline::FitError;

use crate::residual_tests::{Dependence, dependences};
use crate::search::{Course, Refinement};

/// The course with curves of no known form among the candidates, where such a curve is part of the likeliest set: then the library alone does not
/// explain the recordings. The candidates are as before unless `keep`.
pub fn with_curves(loop_: &mut Refinement, course: &Course, keep: bool) -> Result<Option<Course>, FitError> {
    let (base, last) = (&course.first().model, &course.last().model);
    let dependences = ripples(loop_, course);
    let places = places::places(&last.fit.machine, &last.fit.starts, loop_.nudged(), &dependences);
    if places.is_empty() {
        return Ok(None);
    }
    let beside = if last.effects.is_empty() { vec![base] } else { vec![base, last] };
    loop_.consider(&places, &beside);
    let fitted = beside[1..].iter().copied().cloned().collect();
    let with = loop_.run_knowing(base.clone(), fitted)?;
    let wins = with.last().model.effects.iter().any(|e| places.contains(e));
    if !(wins && keep) {
        loop_.forget(&places);
    }
    Ok(wins.then_some(with))
}

/// What the residual of the base model depends on, and of the last: an effect that only imitates may have taken the strongest ripple.
fn ripples(loop_: &Refinement, course: &Course) -> Vec<Dependence> {
    let of = |m: &crate::search::Model| dependences(&m.fit.machine, &m.fit.starts, loop_.nudged());
    let mut all = of(&course.first().model);
    all.extend(of(&course.last().model));
    all.sort_by(|a, b| b.log_p.total_cmp(&a.log_p));
    all
}
