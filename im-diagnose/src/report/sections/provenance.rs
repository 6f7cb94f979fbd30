//! Data quality, the next test, and what was run.

use maud::{Markup, html};

use super::super::page::{Row, Section, drawn, figure, list, numbers, table, text, words};
use super::super::{InputFile, Meta, Used, text_digest};
use crate::intake::{Finding, joined};
use im_chart::{Axis, Chart};
use im_model::MotorFile;

/// What was noticed about the data.
pub(crate) fn quality(m: &Meta) -> Option<Section> {
    let found = m.quality.as_ref()?;
    let body = html! {
        @if found.is_empty() {
            p { "Nothing was found wrong with the recordings: no clipping, no gaps, no dead or swapped channel." }
        } @else { (list(&joined(found).iter().map(Finding::line).collect::<Vec<_>>())) }
    };
    Some(Section { id: "quality", short: "data quality", title: "Data quality", body })
}

/// The test to make next.
pub(crate) fn next_test(m: &Meta) -> Option<Section> {
    let t = m.next_test.as_ref()?;
    let profile = |p: &crate::next_test::ProfileTrace| {
        let label = if p.unit.is_empty() { p.name.clone() } else { format!("{}, {}", p.name, p.unit) };
        let mut chart = Chart::new(
            label.clone(),
            Axis::new(p.points[0][0], p.points[p.points.len() - 1][0], "time, s"),
            Axis::around(p.points.iter().map(|q| q[1]).chain([0.0]), label),
        )
        .sized(360.0, 170.0);
        chart.line(&p.points, "refined solid");
        figure(drawn(chart), "")
    };
    let body = html! {
        p.say { (t.text) }
        @if !t.settles.is_empty() { p { "It would settle:" } (list(&t.settles)) }
        div.grid2 { @for p in t.profile.iter().filter(|p| !p.points.is_empty()) { (profile(p)) } }
    };
    Some(Section { id: "next", short: "next test", title: "The next test", body })
}

/// What was run, on what.
pub(crate) fn run(m: &Meta, motor: &MotorFile, used: &[Used]) -> Section {
    let program = if m.program.is_empty() { format!("im-diagnose {}", env!("CARGO_PKG_VERSION")) } else { m.program.clone() };
    let fact = |name: &str, value: Markup| Row::new([text(name), value]);
    let mut facts = vec![fact("program", text(program))];
    facts.extend(
        m.command.as_ref().map(|c| fact("command", html! { code.words { @for word in c.split(' ') { span { (word) } " " } } })),
    );
    let digest = text_digest(&motor.to_toml());
    facts.push(fact("motor as given", html! { (motor.name) ", hash " code { (digest) } }));
    facts.push(fact("seed", text(m.seed.map_or("none: nothing in it is random".into(), |s| s.to_string()))));
    facts.extend(m.made.as_ref().map(|made| fact("made", text(made))));
    let read = |f: &InputFile| Row::new([text(&f.name), html! { code { (f.sha256) } }]);
    let read: Vec<Row> = m.files.iter().map(read).collect();
    let head = [words("recording"), words("used for"), numbers("rows"), words("hash of its numbers")];
    let row = |u: &Used| Row::new([text(&u.name), text(u.role), text(u.rows), html! { code { (u.digest) } }]);
    let rows: Vec<Row> = used.iter().map(row).collect();
    let body = html! {
        (table(&[words(""), words("")], &facts))
        @if !read.is_empty() { (table(&[words("file read"), words("SHA-256")], &read)) }
        (table(&head, &rows))
    };
    Section { id: "run", short: "what was run", title: "What was run", body }
}
