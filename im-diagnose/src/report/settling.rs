//! The next test of a diagnosis: what would settle what it left open.

use im_model::EffectId;

use super::NextTest;
use crate::diagnosis::{Diagnosis, Verdict};
use crate::format::number;
use crate::next_test::{Limits, Sensing, Supply, WHY, propose};
use crate::worst_case::machines_after;

impl NextTest {
    /// The test for the rivals that a diagnosis left, or for what it could not see; `None` when nothing is open or nothing safe helps.
    pub fn after(found: &Diagnosis) -> Option<Self> {
        let mut open: Vec<EffectId> = found
            .effects
            .iter()
            .zip(&found.alternatives)
            .filter(|(_, a)| !a.is_empty())
            .flat_map(|(e, a)| a.iter().chain([e]))
            .copied()
            .collect();
        let are_rivals = !open.is_empty();
        if open.is_empty() && found.verdict == Verdict::Inconclusive {
            open.extend(found.ranking.iter().filter(|c| !c.excited).map(|c| c.effect));
        }
        if open.is_empty() {
            return None;
        }
        let as_json = found.to_json();
        let safe_for = machines_after(&found.refined, Some(&as_json), &open);
        let best = propose(
            &found.refined,
            &open,
            Sensing::after(&found.refined, Some(&as_json)),
            &Limits::on(Supply::of(None, Some(&as_json))),
            &safe_for,
        )
        .ok()?
        .into_iter()
        .next()?;
        let settles = best
            .detectable
            .iter()
            .map(|(e, x)| {
                let title = e.card().title;
                if !x.is_finite() {
                    return format!("{title}: still does not show it (other values of the parameters imitate it)");
                }
                let seen = if *x < 1.0 { "shows it" } else { "still does not show it" };
                format!("{title}: {seen} (it would be found from {} % of the largest usual size on)", number(100.0 * x, 2))
            })
            .chain(are_rivals.then(|| best.tells_apart()))
            .collect();
        let mut text = format!("{} im next-test writes it as a scenario. {WHY}", best.what);
        if let Some(why) = best.why_so_short() {
            text = format!("{text} {why}");
        }
        Some(Self { text, settles, profile: best.profile })
    }
}
