//! Data quality, the next test, and what was run.

use super::super::page::{Section, figure, list, table};
use super::super::svg::{Axis, Chart};
use super::super::words::escape;
use super::super::{DataFile, Meta};

/// What was noticed about the data.
pub(crate) fn quality(m: &Meta) -> Option<Section> {
    let found = m.quality.as_ref()?;
    let body = if found.is_empty() {
        "<p>Nothing was found wrong with the recordings: no clipping, no gaps, no dead or swapped channel.</p>".to_owned()
    } else {
        list(&found.iter().map(|q| escape(q)).collect::<Vec<_>>())
    };
    Some(Section { id: "quality", short: "data quality", title: "Data quality".into(), body })
}

/// The test to make next.
pub(crate) fn next_test(m: &Meta) -> Option<Section> {
    let t = m.next_test.as_ref()?;
    let settles = if t.settles.is_empty() {
        String::new()
    } else {
        format!("<p>It would settle:</p>{}", list(&t.settles.iter().map(|x| escape(x)).collect::<Vec<_>>()))
    };
    let charts: String = t
        .profile
        .iter()
        .filter(|p| !p.points.is_empty())
        .map(|p| {
            let label = if p.unit.is_empty() { p.name.clone() } else { format!("{}, {}", p.name, p.unit) };
            let mut chart = Chart::new(
                label.clone(),
                Axis::new(p.points[0][0], p.points[p.points.len() - 1][0], "time, s"),
                Axis::around(p.points.iter().map(|q| q[1]).chain([0.0]), label),
            )
            .sized(360.0, 170.0);
            chart.line(&p.points, "refined solid");
            figure(&chart.finish(), "")
        })
        .collect();
    Some(Section {
        id: "next",
        short: "next test",
        title: "The next test".into(),
        body: format!("<p class=\"say\">{}</p>{settles}<div class=\"grid2\">{charts}</div>", escape(&t.text)),
    })
}

/// What was run, on what.
pub(crate) fn run(m: &Meta, files: &[DataFile]) -> Section {
    let program = if m.program.is_empty() { format!("im-diagnose {}", env!("CARGO_PKG_VERSION")) } else { m.program.clone() };
    let mut facts = vec![(false, vec!["program".to_owned(), escape(&program)])];
    if let Some(c) = &m.command {
        facts.push((false, vec!["command".into(), format!("<code>{}</code>", escape(c))]));
    }
    let seed = m.seed.map_or("none: nothing in it is random".into(), |s| s.to_string());
    facts.push((false, vec!["seed".into(), seed]));
    if let Some(t) = &m.made {
        facts.push((false, vec!["made".into(), escape(t)]));
    }
    let head = ["recording", "used for", "#rows", "hash of the data"].map(str::to_owned);
    let rows = files
        .iter()
        .map(|f| {
            (false, vec![escape(&f.name), escape(&f.role), f.rows.to_string(), format!("<code>{}</code>", escape(&f.digest))])
        })
        .collect::<Vec<_>>();
    Section {
        id: "run",
        short: "what was run",
        title: "What was run".into(),
        body: format!("{}{}", table(&["".to_owned(), String::new()], &facts), table(&head, &rows)),
    }
}
