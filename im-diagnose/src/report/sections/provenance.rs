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
        @if !t.settles.is_empty() { p { "What it shows:" } (list(&t.settles)) }
        div.grid2 { @for p in t.profile.iter().filter(|p| !p.points.is_empty()) { (profile(p)) } }
    };
    Some(Section { id: "next", short: "next test", title: "The next test", body })
}

fn fact(name: &str, value: Markup) -> Row {
    Row::new([text(name), value])
}

/// Program, command line and date.
fn made(m: &Meta) -> Vec<Row> {
    let program = if m.program.is_empty() { format!("im-diagnose {}", env!("CARGO_PKG_VERSION")) } else { m.program.clone() };
    let command = |c: &String| fact("command", html! { code.words { @for word in c.split(' ') { span { (word) } " " } } });
    let facts = [Some(fact("program", text(program))), m.command.as_ref().map(command)];
    facts.into_iter().flatten().chain(m.made.as_ref().map(|made| fact("made", text(made)))).collect()
}

/// The files that were read.
fn read(m: &Meta) -> Markup {
    let row = |f: &InputFile| Row::new([text(&f.name), html! { code { (f.sha256) } }]);
    let rows: Vec<Row> = m.files.iter().map(row).collect();
    html! { @if !rows.is_empty() { (table(&[words("file read"), words("SHA-256")], &rows)) } }
}

/// What was run, on files alone.
pub fn run_on_files(m: &Meta) -> Section {
    let body = html! { (table(&[words(""), words("")], &made(m))) (read(m)) };
    Section { id: "run", short: "what was run", title: "What was run", body }
}

/// What was run, on what.
pub(crate) fn run(m: &Meta, motor: &MotorFile, used: &[Used]) -> Section {
    let digest = text_digest(&motor.to_toml());
    let mut facts = made(m);
    facts.push(fact("motor as given", html! { (motor.name) ", hash " code { (digest) } }));
    facts.push(fact("seed", text(m.seed.map_or("none: nothing in it is random".into(), |s| s.to_string()))));
    let head = [words("recording"), words("used for"), numbers("rows"), words("hash of its numbers")];
    let row = |u: &Used| Row::new([text(&u.name), text(u.role), text(u.rows), html! { code { (u.digest) } }]);
    let rows: Vec<Row> = used.iter().map(row).collect();
    let body = html! {
        (table(&[words(""), words("")], &facts))
        (read(m))
        (table(&head, &rows))
    };
    Section { id: "run", short: "what was run", title: "What was run", body }
}
