//! The sections of the page, top to bottom.

mod against;
mod candidates;
mod cards;
mod errors;
mod intervals;
mod load;
mod losses;
mod meaning;
mod parameters;
pub(super) mod place;
pub(super) mod provenance;
mod residual_tests;
mod tables;
mod top;

use maud::html;

use super::overlay;
use super::page::{Section, page};
use super::story::Story;
use crate::diagnosis::Verdict;
use crate::residuals::any_nudged;

/// The whole page of a diagnosis.
pub(super) fn whole(s: &Story) -> String {
    let mut sections = vec![errors::section(s)];
    let models = overlay::models(&s.shown);
    let mut data = None;
    let views = s.views_with_bands();
    if let Some(w) = &overlay::worst(&views) {
        sections.push(Section {
            id: "overlay",
            short: "signals",
            title: "Measured and modelled, over time",
            body: html! { (overlay::body(&views, &models, w)) (against::section(&views, s.d.by_training.as_ref())) },
        });
        data = Some(overlay::data(&views, &models, w));
    }
    sections.extend(tables::section(s));
    if !s.views.is_empty() {
        sections.push(place::section(&s.shown, any_nudged(&s.d.case.train), s.d.case.holdout.is_some()));
    }
    let unexplained = s.d.verdict == Verdict::Unexplained;
    sections.extend(residual_tests::section(s, unexplained));
    sections.push(candidates::section(s));
    sections.push(parameters::section(s));
    sections.extend(meaning::section(s));
    sections.extend(losses::section(s));
    sections.extend(load::section(&s.d.loads, &s.d.case.motor));
    sections.extend(cards::section(s));
    sections.extend(cards::unexcited(s));
    sections.extend(provenance::quality(s.meta));
    sections.extend(provenance::next_test(s.meta));
    sections.push(provenance::run(s.meta, &s.d.case.motor, &s.used()));
    page(&s.title(), &top::top(s), &sections, data.as_deref())
}

pub(super) use errors::{Fall, key as fall_key, largest, rows as fall_rows, waterfall};
pub(super) use load::section as load_section;
pub(super) use losses::{HEAD as LOSSES_HEAD, cells as losses_cells};
pub(super) use parameters::{note as parameters_note, warning as parameter_warning, warnings as parameter_warnings};
pub use provenance::run_on_files;
