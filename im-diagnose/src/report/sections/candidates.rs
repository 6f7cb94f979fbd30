//! The candidates, and which of them look alike.

use im_chart::short;
use im_model::EffectId;
use maud::{Markup, html};

use super::super::page::{Row, Section, figure, numbers, scale, shade, table, term, text, words};
use super::super::story::{Story, candidates, probability};
use super::super::words::{in_sigma, short_effect_name};
use crate::diagnosis::{Candidate, Verdict};
use crate::format::{number, quantity};
use crate::search::Weighed;
use crate::statistics::cosine;

pub(crate) fn section(s: &Story) -> Section {
    let d = s.d;
    let head = [
        words("effect"),
        words("conclusion"),
        numbers(term("score", "score")),
        numbers("threshold"),
        numbers(term("size", "predicted size")),
        numbers(term("detectable", "detectable size")),
        numbers(term("keep", "explained share")),
    ];
    let row = |c: &Candidate| {
        let size = |x: f64| text(quantity(x, c.unit, 2));
        let score = number(c.score, 3);
        let cells = [
            html! { span title=(c.effect.card().what) { (short_effect_name(c.effect)) } },
            text(&c.conclusion),
            html! { @if c.score > c.threshold { b { (score) } } @else { (score) } },
            text(number(c.threshold, 3)),
            if c.excited { size(c.predicted_size) } else { text("–") },
            if c.excited { size(c.detectable_size) } else { text("none usual") },
            text(format!("{}\u{a0}%", number(100.0 * c.explained_share, 2))),
        ];
        Row { hit: d.effects.contains(&c.effect), ..Row::new(cells) }
    };
    let rows: Vec<Row> = candidates(d).into_iter().map(row).collect();
    let significant = d.ranking.iter().filter(|c| c.score > c.threshold).count();
    let refitted = d.course.stages.iter().any(|s| !s.round.trials.is_empty());
    let said = match significant {
        _ if significant > 0 && !refitted => format!(
            "{significant} of {} effects scored above their threshold, none by as much as would be worth a refit.",
            d.ranking.len()
        ),
        0 => "No effect of the library is needed: no score is above its threshold.".to_owned(),
        _ => format!(
            "Before anything was added, {significant} of {} effects scored above their threshold. Effects resemble each other, so those that promise most were refitted and judged by what they leave{}; scores then fall.",
            d.ranking.len(),
            if d.case.holdout.is_some() { ", on the held-out recording too" } else { "" }
        ),
    };
    let order = if d.effects.is_empty() {
        "In the order of score over threshold."
    } else {
        "In the order of score over threshold; what was added stands first."
    };
    let body = html! { p { (said) " " (order) } (table(&head, &rows)) (sets(s)) (trials(s)) (alike(s)) };
    Section { id: "candidates", short: "candidates", title: "Candidates", body }
}

/// The likeliest sets of effects.
fn sets(s: &Story) -> Markup {
    let (d, posterior) = (s.d, &s.d.course.posterior);
    let tried = posterior.sets.len();
    let named = d.named();
    // One with a rival in the place of an effect, however much dearer it is.
    let exchanged = |k: usize| d.alternatives.get(k).into_iter().flatten().map(move |rival| (k, *rival));
    let rivals = (0..named.len()).flat_map(exchanged).filter_map(|(k, rival)| {
        let mut with = named.to_vec();
        with[k] = rival;
        posterior.set(&with)
    });
    let likely: Vec<&Weighed> = posterior.likely().take(6).collect();
    let rivals: Vec<&Weighed> = rivals.filter(|r| !likely.iter().any(|l| l.is(&r.effects))).collect();
    let said = if rivals.is_empty() {
        ""
    } else {
        " Rivals explain the recordings as well, and are less probable for their parameters alone."
    };
    let row = |set: &Weighed| {
        let names: Vec<String> = set.effects.iter().map(|e| short_effect_name(*e)).collect();
        let names = if names.is_empty() { "nothing is missing".to_owned() } else { names.join(" + ") };
        Row { hit: set.is(named), ..Row::of([names, probability(set.probability)]) }
    };
    let head = [words("the machine has"), numbers("probability")];
    html! {
        @if tried > 1 && d.verdict != Verdict::Unexplained {
            h3 { "Sets of effects, compared" }
            p { "Of " (tried) " sets of effects that were tried, those of at least one in a thousand." (said) }
            (table(&head, &likely.into_iter().chain(rivals).map(row).collect::<Vec<_>>()))
        }
    }
}

/// Refits of the leading candidates, round by round.
fn trials(s: &Story) -> Markup {
    let holds = s.d.case.holdout.is_some();
    let mut rows = Vec::new();
    for (k, round) in s.d.course.stages.iter().map(|s| &s.round).enumerate() {
        let chosen = s.d.effects.get(k);
        for (n, t) in round.trials.iter().enumerate() {
            let first = if n == 0 { format!("{}", k + 1) } else { String::new() };
            let held_out = t.model.holdout.map_or("–".into(), in_sigma);
            let mut row = vec![first, short_effect_name(t.effect), in_sigma(t.model.train())];
            row.extend(holds.then_some(held_out));
            rows.push(Row { hit: chosen == Some(&t.effect), ..Row::of(row) });
        }
    }
    let mut head = vec![words("round"), words("refitted with"), numbers("training error, rms")];
    head.extend(holds.then(|| numbers("held out, rms")));
    html! { @if !rows.is_empty() {
        h3 { "What was refitted, and what it leaves" }
        p { "Those by whose score or slopes a refit may gain most beside what was there before." }
        (table(&head, &rows))
    } }
}

/// Cosines between signatures.
fn alike(s: &Story) -> Markup {
    let round = &s.d.course.first().round;
    let scores: Vec<_> = round.scores.iter().filter(|x| !x.signature.is_empty()).collect();
    if scores.len() < 2 {
        return html! {};
    }
    let all: Vec<(EffectId, EffectId, f64)> = (0..scores.len())
        .flat_map(|a| (0..a).map(move |b| (a, b)))
        .map(|(a, b)| (scores[b].effect, scores[a].effect, cosine(&scores[a].signature, &scores[b].signature)))
        .collect();
    let mut near: Vec<_> = all.iter().filter(|x| x.2 > 0.8).collect();
    near.sort_by(|a, b| b.2.total_cmp(&a.2));
    // The leading ones, and those that are hard to distinguish.
    let mut chosen: Vec<usize> = (0..scores.len().min(6)).collect();
    for e in near.iter().flat_map(|x| [x.0, x.1]) {
        if let Some(k) = scores.iter().position(|x| x.effect == e).filter(|k| chosen.len() < 12 && !chosen.contains(k)) {
            chosen.push(k);
        }
    }
    chosen.sort_unstable();
    let said = if near.is_empty() {
        "No two effects look alike in these recordings before a refit (all cosines below 0.8).".to_owned()
    } else {
        let pairs: Vec<String> = near
            .iter()
            .take(4)
            .map(|(a, b, v)| format!("{} and {} ({v:.2})", short_effect_name(*a), short_effect_name(*b)))
            .collect();
        format!("These recordings hardly distinguish {}. Their cards name the test that does.", pairs.join(", "))
    };
    let chosen: Vec<_> = chosen.into_iter().map(|k| (short_effect_name(scores[k].effect), &scores[k].signature[..])).collect();
    let caption =
        "Confusability of the leading candidates in these recordings, after a refit of the base parameters. Numbers from 0.3 up.";
    html! {
        h3 { "Which effects " (term("alike", "look alike")) }
        p { (said) }
        (figure(html! { (triangle(&chosen)) (scale("0: nothing in common", "1: the same")) }, caption))
    }
}

/// Cosines between all pairs of signatures, with the names beside the rows.
fn triangle(chosen: &[(String, &[f64])]) -> Markup {
    let n = chosen.len() as f64;
    // A letter of this size is at most six pixels wide; behind each name stands its number.
    let longest = chosen.iter().map(|c| c.0.chars().count()).max().unwrap_or(0) as f64 + 3.0;
    let (left, side) = (f64::max(152.0, 6.0 * longest), 230.0 / n);
    let cell = |r: usize, c: usize| {
        let v = if r == c { 1.0 } else { cosine(chosen[r].1, chosen[c].1) };
        let (x, y) = (left + c as f64 * side, 16.0 + r as f64 * side);
        // From the shade on where the other ink is easier to read, in light and dark.
        let class = format!("{} {}", if shade(v) >= 5 { "high" } else { "" }, if side > 24.0 { "small" } else { "tiny" });
        html! {
            rect class={ "h" (shade(v)) } x=(short(x)) y=(short(y)) width=(short(side - 1.0)) height=(short(side - 1.0)) {
                title { (chosen[r].0) " and " (chosen[c].0) ": " (format!("{v:.2}")) }
            }
            @if r != c && v >= 0.3 {
                text class=(class) x=(short(x + 0.5 * side)) y=(short(y + 0.5 * side + 3.5)) text-anchor="middle" {
                    (format!("{v:.2}").trim_start_matches('0'))
                }
            }
        }
    };
    html! {
        svg.chart viewBox={ "0 0 " (short(left + 234.0)) " " (short(22.0 + n * side)) } role="img" aria-label="which effects look alike" {
            @for (r, (name, _)) in chosen.iter().enumerate() {
                @let y = 16.0 + r as f64 * side;
                text.small x=(short(left - 4.0)) y=(short(y + 0.5 * side + 4.0)) text-anchor="end" { (name) "\u{a0}" (r + 1) }
                text.tick.small x=(short(left + (r as f64 + 0.5) * side)) y="11" text-anchor="middle" { (r + 1) }
                @for c in 0..=r { (cell(r, c)) }
            }
        }
    }
}
