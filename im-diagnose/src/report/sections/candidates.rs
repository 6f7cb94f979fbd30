//! The candidates, and which of them look alike.

use std::fmt::Write as _;

use im_model::EffectId;

use crate::statistics::cosine;

use super::super::page::{Section, figure, scale, shade, table, term};
use super::super::story::Story;
use super::super::svg::short;
use super::super::words::{escape, short_effect_name};
use crate::format::{number, quantity};

pub(crate) fn section(s: &Story) -> Section {
    let d = s.d;
    let head = vec![
        "effect".to_owned(),
        format!("#{}", term("score", "score")),
        "#threshold".into(),
        format!("#{}", term("size", "predicted size")),
        format!("#{}", term("detectable", "detectable size")),
        format!("#{}", term("keep", "keep")),
        "conclusion".into(),
    ];
    let rows: Vec<(bool, Vec<String>)> = d
        .ranking
        .iter()
        .map(|c| {
            let size = |x: f64| escape(&quantity(x, c.unit, 2));
            let score = if c.score > c.threshold { format!("<b>{}</b>", number(c.score, 3)) } else { number(c.score, 3) };
            (
                d.effects.contains(&c.effect),
                vec![
                    format!(r#"<span title="{}">{}</span>"#, escape(c.effect.card().what), escape(&short_effect_name(c.effect))),
                    score,
                    number(c.threshold, 3),
                    size(c.predicted_size),
                    size(c.detectable_size),
                    format!("{}\u{a0}%", number(100.0 * c.explained_share, 2)),
                    escape(&c.conclusion),
                ],
            )
        })
        .collect();
    let significant = d.ranking.iter().filter(|c| c.score > c.threshold).count();
    let said = match significant {
        0 => "No effect of the library is needed: no score is above its threshold.".to_owned(),
        _ => format!(
            "Before anything was added, {significant} of {} effects scored above their threshold. Effects resemble each other, so the leading ones were refitted and judged by what they leave, on the held-out recording too; scores then fall.",
            d.ranking.len()
        ),
    };
    let mut body = format!("<p>{said}</p>{}", table(&head, &rows));
    body += &trials(s);
    body += &alike(s);
    Section { id: "candidates", short: "candidates", title: "Candidates".into(), body }
}

/// Refits of the leading candidates, round by round.
fn trials(s: &Story) -> String {
    let mut rows = Vec::new();
    for (k, round) in s.d.course.rounds.iter().enumerate() {
        let chosen = s.d.effects.get(k);
        for (n, t) in round.trials.iter().enumerate() {
            let first = if n == 0 { format!("{}", k + 1) } else { String::new() };
            rows.push((
                chosen == Some(&t.effect),
                vec![
                    first,
                    escape(&short_effect_name(t.effect)),
                    super::super::words::floors(t.model.train()),
                    t.model.holdout.map_or("–".into(), super::super::words::floors),
                ],
            ));
        }
    }
    if rows.is_empty() {
        return String::new();
    }
    let head = ["round", "refitted with", "#training error, noise floors", "#held out, noise floors"].map(str::to_owned);
    format!("<h3>What the leading candidates leave when refitted</h3>{}", table(&head, &rows))
}

/// Cosines between signatures.
fn alike(s: &Story) -> String {
    let Some(round) = s.d.course.rounds.first() else { return String::new() };
    let scores: Vec<_> = round.scores.iter().filter(|x| !x.signature.is_empty()).collect();
    if scores.len() < 2 {
        return String::new();
    }
    let all: Vec<(EffectId, EffectId, f64)> = (0..scores.len())
        .flat_map(|a| (0..a).map(move |b| (a, b)))
        .map(|(a, b)| (scores[b].effect, scores[a].effect, cosine(&scores[a].signature, &scores[b].signature)))
        .collect();
    let mut near: Vec<_> = all.iter().filter(|x| x.2 > 0.8).collect();
    near.sort_by(|a, b| b.2.total_cmp(&a.2));
    // The leading ones, and those that are hard to tell apart.
    let mut chosen: Vec<usize> = (0..scores.len().min(6)).collect();
    for e in near.iter().flat_map(|x| [x.0, x.1]) {
        if let Some(k) = scores.iter().position(|x| x.effect == e).filter(|k| chosen.len() < 12 && !chosen.contains(k)) {
            chosen.push(k);
        }
    }
    chosen.sort_unstable();
    let n = chosen.len() as f64;
    let (left, cell) = (130.0, 230.0 / n);
    let height = 18.0 + n * cell;
    let mut picture = format!(
        r#"<svg class="chart" viewBox="0 0 364 {}" role="img" aria-label="which effects look alike">"#,
        short(height + 4.0)
    );
    for (r, &a) in chosen.iter().enumerate() {
        let y = 16.0 + r as f64 * cell;
        let name = short_effect_name(scores[a].effect);
        let _ = write!(
            picture,
            r#"<text class="small" x="{}" y="{}" text-anchor="end">{}&#160;{}</text>"#,
            short(left - 4.0),
            short(y + 0.5 * cell + 4.0),
            escape(&name),
            r + 1
        );
        let _ = write!(
            picture,
            r#"<text class="tick small" x="{}" y="11" text-anchor="middle">{}</text>"#,
            short(left + (r as f64 + 0.5) * cell),
            r + 1
        );
        for (c, &b) in chosen.iter().enumerate() {
            if c > r {
                continue;
            }
            let v = if r == c { 1.0 } else { cosine(&scores[a].signature, &scores[b].signature) };
            let x = left + c as f64 * cell;
            let _ = write!(
                picture,
                r#"<rect class="h{}" x="{}" y="{}" width="{}" height="{}"><title>{} and {}: {v:.2}</title></rect>"#,
                shade(v),
                short(x),
                short(y),
                short(cell - 1.0),
                short(cell - 1.0),
                escape(&name),
                escape(&short_effect_name(scores[b].effect)),
            );
            if r != c && v >= 0.3 {
                let high = if v > 0.55 { "high" } else { "" };
                let size = if cell > 24.0 { "small" } else { "tiny" };
                let _ = write!(
                    picture,
                    r#"<text class="{high} {size}" x="{}" y="{}" text-anchor="middle">{}</text>"#,
                    short(x + 0.5 * cell),
                    short(y + 0.5 * cell + 3.5),
                    format!("{v:.2}").trim_start_matches('0')
                );
            }
        }
    }
    picture.push_str("</svg>");
    let said = if near.is_empty() {
        "No two effects look alike in these recordings (all cosines below 0.8): whatever is missing can be named.".to_owned()
    } else {
        let pairs: Vec<String> = near
            .iter()
            .take(4)
            .map(|(a, b, v)| format!("{} and {} ({v:.2})", short_effect_name(*a), short_effect_name(*b)))
            .collect();
        format!("These recordings can hardly tell apart: {}. Their cards name the test that can.", pairs.join(", "))
    };
    format!(
        "<h3>Which effects {}</h3><p>{}</p>{}",
        term("alike", "look alike"),
        escape(&said),
        figure(
            &format!("{picture}{}", scale("0: nothing in common", "1: the same")),
            "Confusability of the leading candidates in these recordings, after a refit of the base parameters. Numbers from 0.3 up."
        )
    )
}
