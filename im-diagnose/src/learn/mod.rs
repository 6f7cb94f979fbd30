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
use im_model::EffectId;

use crate::residual_tests::{Dependence, dependences};
use crate::search::{Answer, Course, Refinement, Sets};

/// The course with curves of no known form among the candidates, where such a curve is part of the likeliest set; the candidates are as before
/// where none is.
pub fn with_curves(loop_: &mut Refinement, course: &Course, sets: Sets) -> Result<Option<Course>, FitError> {
    let places = places_beside(loop_, course);
    if places.is_empty() {
        return Ok(None);
    }
    let sets = searched(loop_, course, sets, &places)?;
    let (course, _) = loop_.course(sets)?;
    let wins = course.last().model.effects.iter().any(|e| places.contains(e));
    if !wins {
        loop_.forget(&places);
    }
    Ok(wins.then_some(course))
}

/// Where curves are looked for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Depth {
    /// Beside the answer of the library alone: to show what is missing there.
    Beside,
    /// In all sets that may be likelier than that answer.
    Whole,
}

/// The likeliest set where curves of no known form are among the candidates: where one is part of it, the library alone does not explain the
/// recordings. `None` where there is no place for a curve. The candidates are as before.
pub fn contest(loop_: &mut Refinement, course: &Course, mut sets: Sets, depth: Depth) -> Result<Option<Answer>, FitError> {
    let places = places_beside(loop_, course);
    if places.is_empty() {
        return Ok(None);
    }
    let last = &course.last().model.effects;
    let sets = match depth {
        Depth::Beside => {
            loop_.consider(&places, &mut sets, &[last]);
            loop_.expanded(sets, last)
        }
        Depth::Whole => searched(loop_, course, sets, &places)?,
    };
    let answer = loop_.answer(sets)?;
    loop_.forget(&places);
    Ok(Some(answer))
}

fn places_beside(loop_: &Refinement, course: &Course) -> Vec<EffectId> {
    let last = &course.last().model;
    places::places(&last.fit.machine, &last.fit.starts, loop_.nudged(), &ripples(loop_, course))
}

/// Goes on with a search, with curves at some places among the candidates.
fn searched(loop_: &mut Refinement, course: &Course, mut sets: Sets, places: &[EffectId]) -> Result<Sets, FitError> {
    let last = &course.last().model.effects;
    let beside: &[&[EffectId]] = if last.is_empty() { &[&[]] } else { &[&[], last] };
    loop_.consider(places, &mut sets, beside);
    // An effect that only imitates may leave a curve little beside it, and give way to it alone.
    let sets = loop_.expanded(sets, &[]);
    loop_.search(sets)
}

/// What the residual of the base model depends on, and of the last: an effect that only imitates may have taken the strongest ripple.
fn ripples(loop_: &Refinement, course: &Course) -> Vec<Dependence> {
    let of = |m: &crate::search::Model| dependences(&m.fit.machine, &m.fit.starts, loop_.nudged());
    let mut all = of(&course.first().model);
    all.extend(of(&course.last().model));
    all.sort_by(|a, b| b.log_p.total_cmp(&a.log_p));
    all
}
