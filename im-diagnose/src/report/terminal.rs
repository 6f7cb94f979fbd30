//! The story in short, for a terminal or a file: no colours, no control codes.

use super::load_words::words as load_words;
use super::overlay::{channel_words, nudged};
use super::sections::{LOSSES_HEAD, fall_rows, losses_cells, parameter_warnings, parameters_note};
use super::story::{Shown, Story, candidates as by_interest, summary, verdict_words};
use super::text_plot::{columns, log_bar, spark, wrapped};
use super::words::{change_words, file_name, in_sigma, is_new, quantity_name, short_effect_name, voltage_noise};
use crate::diagnosis::{Diagnosis, Verdict};
use crate::format::{interval, number, quantity, sentence, side_by_side};
use crate::intake::joined;
use crate::loads::Loads;
use crate::localise::{ProfileOver, Quantity};
use crate::uncertainty::HALF_95;
use im_model::MotorFile;

/// The report as text, at most `width` (40 to 100) characters wide.
pub fn terminal(s: &Story, width: usize) -> String {
    let width = width.clamp(40, 100);
    let d = s.d;
    let mut out = Text { width, lines: Vec::new() };
    let (sign, word) = verdict_words(d.verdict);
    out.line(&format!("{} — {sign} {word}", s.title()));
    out.gap();
    let a = summary(s);
    out.paragraph("", &[Some(a.cause), a.electrical, a.beside].into_iter().flatten().collect::<Vec<_>>().join(" "));
    for t in &d.remarks() {
        out.paragraph("  ! ", &sentence(t));
    }
    for t in &a.sure {
        out.paragraph("  sure because: ", t);
    }
    for t in a.refute.iter().take(3) {
        out.paragraph(if d.verdict == Verdict::Inconclusive { "  would decide: " } else { "  would refute: " }, t);
    }
    // What is wrong with the data makes all that follows doubtful.
    if let Some(q) = s.meta.quality.as_ref().filter(|q| !q.is_empty()) {
        out.heading("Data");
        for t in joined(q) {
            out.paragraph("  ", &t.line());
        }
    }
    errors(&mut out, s);
    if !s.views.is_empty() {
        place(&mut out, &s.shown);
    }
    if d.verdict == Verdict::Unexplained {
        residual_tests(&mut out, d);
    }
    learned(&mut out, d);
    candidates(&mut out, d);
    parameters(&mut out, d);
    losses(&mut out, d);
    loads(&mut out, &s.d.loads, &d.case.motor);
    let hidden = s.unexcited();
    if !hidden.is_empty() && d.verdict != Verdict::Inconclusive {
        out.heading("Not excited by these recordings");
        for c in hidden.iter().take(6) {
            out.paragraph("  ", &format!("{}: {}", short_effect_name(c.effect), c.effect.card().test));
        }
    }
    if let Some(t) = &s.meta.next_test {
        out.heading("Next test");
        out.paragraph("  ", &t.text);
        for x in &t.settles {
            out.paragraph("  shows: ", x);
        }
    }
    out.finish()
}

pub(super) struct Text {
    pub width: usize,
    pub lines: Vec<String>,
}

impl Text {
    pub fn line(&mut self, t: &str) {
        let fits = t.chars().count() <= self.width;
        self.lines.push(if fits { t.to_owned() } else { t.chars().take(self.width - 1).chain(['…']).collect() });
    }

    pub fn gap(&mut self) {
        self.lines.push(String::new());
    }

    pub fn heading(&mut self, t: &str) {
        self.gap();
        self.line(t);
        self.line(&"─".repeat(t.chars().count()));
    }

    /// Text behind a label; further lines stand under the text.
    pub fn paragraph(&mut self, label: &str, t: &str) {
        let indent = label.chars().count();
        let text = wrapped(&t.replace('\u{a0}', " "), self.width - indent, 0);
        for (k, l) in text.lines().enumerate() {
            let head = if k == 0 { label.to_owned() } else { " ".repeat(indent) };
            self.line(&format!("{head}{l}"));
        }
    }

    pub fn table(&mut self, rows: &[Vec<String>], right: &[bool]) {
        for l in columns(rows, right, self.width - 2) {
            self.line(&format!("  {}", l.replace('\u{a0}', " ")));
        }
    }

    pub fn finish(self) -> String {
        let mut out = String::new();
        for l in self.lines {
            out.push_str(l.trim_end());
            out.push('\n');
        }
        out
    }
}

fn errors(out: &mut Text, s: &Story) {
    out.heading("Error, rms in units of the sensor noise σ (bars are logarithmic)");
    let rows = fall_rows(s);
    let most = rows.iter().flat_map(|r| [Some(r.1.chi2_per_sample), r.2.as_ref().map(|h| h.chi2_per_sample)]).flatten();
    let hi = most.filter(|x| x.is_finite()).fold(2.0, f64::max);
    let bar = out.width.saturating_sub(52).clamp(6, 34);
    let mut table = Vec::new();
    for (name, train, hold) in &rows {
        table.push(vec![
            name.clone(),
            "training".into(),
            in_sigma(train.chi2_per_sample),
            log_bar(train.chi2_per_sample, 0.8, hi, bar),
        ]);
        if let Some(h) = hold {
            table.push(vec![
                String::new(),
                "held out".into(),
                in_sigma(h.chi2_per_sample),
                log_bar(h.chi2_per_sample, 0.8, hi, bar),
            ]);
        }
    }
    out.table(&table, &[false, false, true, false]);
    let nudged = nudged(&s.views);
    if !nudged.is_empty() {
        let text = format!("Judged with the speed nudged towards the measured one, all models alike: {nudged}.");
        out.paragraph("  ", &text);
    }
    out.gap();
    let judged =
        |e: &(String, crate::residuals::Errors, Option<crate::residuals::Errors>)| e.2.clone().unwrap_or_else(|| e.1.clone());
    let which = if rows[0].2.is_some() { "held-out" } else { "training" };
    let mut table = vec![vec![format!("{which} rms error"), "first".into(), "last".into(), "sensor noise".into()]];
    if let (Some(first), Some(last)) = (rows.first().map(judged), rows.last().map(judged)) {
        for c in s.channels() {
            let (name, unit) = channel_words(&c.name, c.kind);
            let of =
                |e: &crate::residuals::Errors| e.rmse.get(&c.name).map_or("–".into(), |x| format!("{} {unit}", number(*x, 3)));
            table.push(vec![name, of(&first), of(&last), format!("{} {unit}", number(s.noise_of(c), 3))]);
        }
    }
    out.table(&table, &[false, true, true, true]);
    if let Some(said) = voltage_noise(s.d.case.all()) {
        out.paragraph("  ", &said);
    }
}

/// Where it fails, with two small plots; the first model is the one that fails.
pub(super) fn place(out: &mut Text, shown: &[Shown]) {
    out.heading(&format!("Where the {} fails", shown[0].name));
    let place = &shown[0].place;
    let findings = place.findings();
    if findings.is_empty() {
        out.paragraph("  ", "Its error does not depend on anything that was looked at.");
    }
    for f in findings.iter().take(4) {
        out.paragraph("  - ", &sentence(f));
    }
    let bars = out.width.saturating_sub(44).clamp(10, 48);
    for t in place.time.iter().take(6) {
        let step = t.points.len().div_ceil(bars).max(1);
        let values: Vec<f64> = t
            .points
            .chunks(step)
            .map(|c| (c.iter().map(|p| p[1] * p[1]).sum::<f64>() / c.len() as f64).sqrt() / t.noise.max(1e-300))
            .collect();
        let top = values.iter().copied().fold(1.0, f64::max);
        let name = file_name(&t.run);
        let name: String = name.chars().take(14).collect();
        out.line(&format!("  {:<7} {name:<14} {} up to {} σ", t.quantity.name(), spark(&values, 0.0, top), number(top, 2)));
    }
    if let Some(p) = place.profiles.iter().find(|p| p.quantity == Quantity::Current && p.over == ProfileOver::Flux) {
        let values: Vec<f64> = p.bins.iter().map(|b| b.rms).collect();
        let top = values.iter().copied().fold(0.0, f64::max);
        if let (Some(a), Some(b)) = (p.bins.first(), p.bins.last()) {
            out.line(
                &format!(
                    "  current error over flux {} {} Vs {} {} Vs, up to {} A",
                    "",
                    number(a.at, 2),
                    spark(&values, 0.0, top),
                    number(b.at, 2),
                    number(top, 2)
                )
                .replace("  current error over flux  ", "  current error over flux: "),
            );
        }
    }
}

/// Loads that no column holds.
pub(super) fn loads(out: &mut Text, loads: &Loads, motor: &MotorFile) {
    if loads.is_empty() {
        return;
    }
    out.heading(loads.title());
    for f in &loads.found {
        out.paragraph("  - ", &load_words(f));
    }
    if let Some(note) = loads.note(motor) {
        out.paragraph("  ", &note);
    }
}

/// Rows of a terminal at most.
const ROWS: usize = 12;

/// Where the power of tables goes.
fn losses(out: &mut Text, d: &Diagnosis) {
    if d.losses.is_empty() {
        return;
    }
    out.heading("Losses in the rows that turn (± 95 %)");
    let cells: Vec<_> = d.losses.iter().take(ROWS).map(losses_cells).collect();
    let row = |(k, head): (usize, &&str)| ((*head).to_owned(), cells.iter().map(|c| c[k].clone()).collect());
    let rows: Vec<(String, Vec<String>)> = LOSSES_HEAD.iter().enumerate().map(row).collect();
    for line in side_by_side(&rows, out.width.saturating_sub(2)).lines() {
        out.line(&if line.is_empty() { String::new() } else { format!("  {line}") });
    }
    if d.losses.len() > ROWS {
        out.line(&format!("  … and {} more in diagnosis.json", d.losses.len() - ROWS));
    }
}

/// Curves that no formula of the library gives.
fn learned(out: &mut Text, d: &Diagnosis) {
    for c in &d.learned {
        out.heading(&format!("Learned: {}", c.effect.card().title));
        let values: Vec<f64> = c.points.iter().step_by(2).map(|p| p[1]).collect();
        let (lo, hi) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        out.line(&format!("      {}", spark(&values, lo, hi)));
        out.paragraph("  ", &sentence(&c.extent()));
        for t in c.meaning() {
            out.paragraph("  - ", &sentence(&t));
        }
        for r in &c.rivals {
            out.paragraph("  or: ", &short_effect_name(*r));
        }
    }
}

fn residual_tests(out: &mut Text, d: &Diagnosis) {
    out.heading("What is left, and its shape");
    for x in d.dependences.iter().take(4) {
        let values: Vec<f64> = x.curve.iter().map(|c| c[1]).collect();
        let (lo, hi) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        out.paragraph("  - ", &sentence(&super::story::dependence_words(x)));
        let unit = x.part.label().rsplit(", ").next().unwrap_or_default();
        out.line(&format!("      {} from {} to {} {unit}", spark(&values, lo, hi), number(lo, 2), number(hi, 2)));
    }
}

fn candidates(out: &mut Text, d: &Diagnosis) {
    out.heading("Candidates (before anything was added)");
    let mut table = vec![["effect", "score", "threshold", "size", "conclusion"].map(str::to_owned).to_vec()];
    for c in by_interest(d).into_iter().take(6) {
        table.push(vec![
            short_effect_name(c.effect),
            number(c.score, 3),
            number(c.threshold, 2),
            quantity(c.predicted_size, c.unit, 2),
            c.conclusion.clone(),
        ]);
    }
    out.table(&table, &[false, true, true, true, false]);
    if d.ranking.len() > 6 {
        out.line(&format!("  … and {} more", d.ranking.len() - 6));
    }
}

fn parameters(out: &mut Text, d: &Diagnosis) {
    out.heading("Parameters (± 95 %)");
    let mut table = Vec::new();
    for p in d.parameters.iter().filter(|p| !p.is_of_a_curve()) {
        let unit = p.quantity.unit();
        table.push(vec![
            quantity_name(p.quantity).0,
            if is_new(p, d) { "–".into() } else { quantity(p.before, unit, 4) },
            format!("{}{}", interval(p.after, HALF_95 * p.std, unit), if p.ratio_held { ", ratio held" } else { "" }),
            change_words(p, d),
        ]);
    }
    out.table(&table, &[false, true, true, true]);
    out.paragraph("  ", &parameters_note(d));
    for w in parameter_warnings(d) {
        out.paragraph("  ! ", &w);
    }
}
