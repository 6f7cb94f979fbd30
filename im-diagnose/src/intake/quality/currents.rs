//! The current sensors: which to believe, in which rows.

use super::Checked;
use super::clip::{Clipped, flat_tops, redundant, saturation};
use crate::format::number;
use crate::intake::finding::{Finding, FindingKind, Severity, ranges};
use crate::intake::mapping::CurrentForm;
use crate::intake::signals::Signals;
use crate::noise::white_sigma;

/// Chooses among second sensors, finds clipped rows, and looks at the sum.
pub fn check(s: &Signals) -> Checked {
    let n = s.len();
    let mut out = Checked { second: vec![false; s.current.len()], ..Checked::default() };
    let mut wrong: Vec<Vec<bool>> = vec![vec![false; n]; s.current.len()];
    let mut trusted = vec![false; s.current.len()];
    for (x, c) in s.current.iter().enumerate() {
        let Some(other) = &c.alternate else { continue };
        let (finding, use_second, vouched) = choose(&c.main.column, &c.main.values, &other.column, &other.values);
        out.second[x] = use_second;
        trusted[x] = vouched;
        out.findings.extend(finding);
    }
    let chosen: Vec<&super::super::trace::Trace> = s
        .current
        .iter()
        .zip(&out.second)
        .map(|(c, second)| c.alternate.as_ref().filter(|_| *second).unwrap_or(&c.main))
        .collect();
    for (x, c) in chosen.iter().enumerate() {
        let flat = flat_tops(&c.values);
        let rows = ranges(&flat);
        if !rows.is_empty() {
            let limit = rows.iter().map(|r| c.values[r.start].abs()).fold(0.0, f64::max);
            let count = flat.iter().filter(|f| **f).count();
            out.findings.push(
                Finding::new(
                    FindingKind::ClippedSensor,
                    Severity::Warning,
                    format!("{} is cut off at {} A in {count} rows, which are left out", c.column, number(limit, 3)),
                    "Record again with a larger range.",
                )
                .on(&c.column)
                .at(rows),
            );
            wrong[x] = flat;
        }
    }
    if matches!(s.current_form, CurrentForm::Phases(_)) {
        let i = [&chosen[0].values[..], &chosen[1].values, &chosen[2].values];
        let found = saturation(i, [trusted[0], trusted[1], trusted[2]]);
        out.findings.extend(sum(i, [0, 1, 2].map(|x| chosen[x].column.as_str()), &found));
        for x in 0..3 {
            let rows = ranges(&found.saturated[x]);
            if rows.is_empty() {
                continue;
            }
            let count: usize = rows.iter().map(ExactSizeIterator::len).sum();
            let column = &chosen[x].column;
            let limit = number(found.limit_a[x], 3);
            out.findings.push(
                Finding::new(
                    FindingKind::ClippedSensor,
                    Severity::Warning,
                    format!(
                        "{column} saturates from about ±{limit} A: the phase currents no longer sum to zero there. {count} rows, \
                         recovery included, are left out"
                    ),
                    "Record again with a larger range, or name a second sensor of the phase as its alternate.",
                )
                .on(column)
                .at(rows),
            );
            wrong[x].iter_mut().zip(&found.saturated[x]).for_each(|(w, s)| *w |= s);
        }
        let rows = ranges(&found.glitch);
        if !rows.is_empty() {
            let count: usize = rows.iter().map(ExactSizeIterator::len).sum();
            wrong.iter_mut().for_each(|w| w.iter_mut().zip(&found.glitch).for_each(|(w, g)| *w |= g));
            out.findings.push(
                Finding::new(
                    FindingKind::Glitch,
                    Severity::Note,
                    format!(
                        "In {count} rows the phase currents do not sum to zero without a sensor near its limit; they are left out"
                    ),
                    "",
                )
                .at(rows),
            );
        }
    }
    if wrong.iter().flatten().any(|w| *w) {
        out.valid = wrong.into_iter().map(|w| w.into_iter().map(|w| !w).collect()).collect();
    }
    out
}

/// Which of two sensors to use, and whether the choice is proven.
fn choose(first: &str, x: &[f64], second: &str, y: &[f64]) -> (Option<Finding>, bool, bool) {
    let found = redundant(x, y);
    let count = |rows: &[bool]| rows.iter().filter(|r| **r).count();
    let (short, long) = (count(&found.first_short), count(&found.second_short));
    let peak = |v: &[f64], rows: &[bool]| v.iter().zip(rows).filter(|(_, r)| **r).fold(0.0, |m: f64, (v, _)| m.max(v.abs()));
    let clipped = |name: &str, other: &str, v: &[f64], w: &[f64], rows: &[bool], verdict: String| {
        let (shown, true_) = (number(peak(v, rows), 3), number(peak(w, rows), 3));
        let text = format!(
            "{name} shows no more than {shown} A where {other} shows {true_} A, in {} rows: it saturates. {verdict}",
            count(rows)
        );
        Finding::new(FindingKind::RedundantSensor, Severity::Note, text, "").on(name).at(ranges(rows))
    };
    // A tail of a recovering sensor may exceed the truth for a while: four to one decides.
    if short >= 3 && short > 4 * long && peak(y, &found.first_short) > peak(x, &found.first_short) {
        (Some(clipped(first, second, x, y, &found.first_short, format!("{second} is used instead"))), true, true)
    } else if long >= 3 && long > 4 * short && peak(x, &found.second_short) > peak(y, &found.second_short) {
        (Some(clipped(second, first, y, x, &found.second_short, format!("{first} is used"))), false, true)
    } else if short + long > x.len() / 20 {
        let text = format!(
            "{first} and {second} are said to be sensors of one current and differ in {} of {} rows",
            short + long,
            x.len()
        );
        let advice = format!("Check gain, sign and offset of {second}; {first} is used.");
        (Some(Finding::new(FindingKind::RedundantSensor, Severity::Warning, text, advice).on(second)), false, false)
    } else {
        (None, false, true)
    }
}

/// A sum that saturation does not explain: a sign, a gain, or a current that flows elsewhere.
fn sum(i: [&[f64]; 3], names: [&str; 3], found: &Clipped) -> Option<Finding> {
    let n = i[0].len();
    let well = |k: &usize| !found.glitch[*k] && found.saturated.iter().all(|s| !s[*k]);
    let rows: Vec<usize> = (0..n).filter(well).collect();
    let rms = |f: &dyn Fn(usize) -> f64| (rows.iter().map(|&k| f(k).powi(2)).sum::<f64>() / rows.len().max(1) as f64).sqrt();
    let off = |k: usize| i[0][k] + i[1][k] + i[2][k] - found.sum_mean_a;
    let size = (0..3).map(|x| rms(&|k| i[x][k])).fold(0.0, f64::max);
    // Noise that comes and goes from row to row is no error of gain or order.
    let noise = white_sigma(&rows.iter().map(|&k| off(k)).collect::<Vec<_>>());
    let whole = (rms(&off).powi(2) - noise * noise).max(0.0).sqrt();
    if whole < 0.03 * size {
        return None;
    }
    // The gain of one sensor that brings the sum nearest to zero.
    let fits = (0..3).map(|x| {
        let (si, ii) = rows.iter().fold((0.0, 0.0), |(si, ii), &k| (si + off(k) * i[x][k], ii + i[x][k] * i[x][k]));
        let gain = 1.0 - si / ii.max(1e-300);
        (rms(&|k| off(k) + (gain - 1.0) * i[x][k]), x, gain)
    });
    let (left, x, gain) = fits.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let share = number(100.0 * whole / size, 2);
    let (text, advice) = if left < 0.4 * whole && (gain + 1.0).abs() < 0.1 {
        (
            format!("The phase currents do not sum to zero: {} has the wrong sign", names[x]),
            "Turn it: gain = -1 for this column.".to_owned(),
        )
    } else if left < 0.4 * whole && gain > 0.0 {
        (
            format!("The phase currents sum to {share} % of their size: {} is probably mis-scaled", names[x]),
            format!("Multiplied by {} it would fit the others.", number(gain, 3)),
        )
    } else {
        (
            format!("The phase currents {} do not sum to zero: {share} % of their size is left", names.join(", ")),
            "Check order, gains and signs, whether these are the currents of one machine, and whether its star point is connected.".to_owned(),
        )
    };
    let severity = if whole > 0.1 * size { Severity::Serious } else { Severity::Warning };
    Some(Finding::new(FindingKind::CurrentSum, severity, text, advice))
}
