//! Change of one motor over time: the last recording against those before it.
//!
//! d = x_last − x̄_before on logarithms, its variance that of both; by how much motors of the type change between recordings at all (the
//! winding is warmer today) is learned from all of them, as in [`population`](crate::population).

use std::collections::BTreeMap;

use crate::odd::{Odd, Value, find, measured};
use crate::population::Measured;
use crate::row::Row;

/// What changed in one motor.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Index of its last row.
    pub row: usize,
    /// The parameter.
    pub key: String,
    /// Last value over the mean of those before.
    pub ratio: f64,
    /// By how many standard deviations it changed more than others of its type.
    pub distance: f64,
    /// The chance of that.
    pub p: f64,
}

/// An effect that a motor did not have before.
#[derive(Clone, Debug, PartialEq)]
pub struct Appeared {
    /// Index of its last row.
    pub row: usize,
    /// The effect.
    pub effect: String,
    /// When it was first named.
    pub since: String,
}

/// The rows of every unit with several, by date.
fn histories(rows: &[Row]) -> Vec<Vec<usize>> {
    let mut units: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (k, row) in rows.iter().enumerate().filter(|(_, r)| r.error.is_empty()) {
        units.entry(&row.unit).or_default().push(k);
    }
    let mut all: Vec<Vec<usize>> = units.into_values().filter(|u| u.len() > 1).collect();
    all.iter_mut().for_each(|u| u.sort_by(|&a, &b| rows[a].date.cmp(&rows[b].date)));
    all
}

/// Parameters that changed by more than those of the type do, strongest first.
pub fn changes(rows: &[Row]) -> Vec<Change> {
    let mut values = Vec::new();
    for history in histories(rows) {
        let last = history[history.len() - 1];
        for p in &rows[last].parameters {
            let Some(now) = measured(&rows[last], &p.key) else { continue };
            let before: Vec<Measured> = history[..history.len() - 1].iter().filter_map(|&k| measured(&rows[k], &p.key)).collect();
            if before.is_empty() {
                continue;
            }
            let weight: f64 = before.iter().map(|m| 1.0 / m.variance).sum();
            let mean = before.iter().map(|m| m.x / m.variance).sum::<f64>() / weight;
            let measured = Measured { x: now.x - mean, variance: now.variance + 1.0 / weight };
            values.push(Value { group: (rows[last].kind.clone(), p.key.clone()), unit: last, measured });
        }
    }
    let (_, odd) = find(&values);
    let change = |o: Odd| {
        let v = &values[o.value];
        Change { row: v.unit, key: v.group.1.clone(), ratio: v.measured.x.exp(), distance: o.distance, p: o.p }
    };
    odd.into_iter().map(change).collect()
}

/// Effects that the last recording of a motor shows and its first did not.
pub fn appeared(rows: &[Row]) -> Vec<Appeared> {
    let mut out = Vec::new();
    for history in histories(rows) {
        let (first, last) = (history[0], history[history.len() - 1]);
        for effect in rows[last].effects.iter().filter(|e| !rows[first].effects.contains(e)) {
            let since = history.iter().find(|&&k| rows[k].effects.contains(effect)).map_or("", |&k| &rows[k].date);
            out.push(Appeared { row: last, effect: effect.clone(), since: since.to_owned() });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::Parameter;
    use im_trials::hidden::chance::Chance;

    /// Thirty motors, all warmer the second time; one has lost bars.
    #[test]
    fn a_motor_that_changed_is_distinguished_from_a_warm_day() {
        let mut chance = Chance::new(4, "days");
        let mut rows = Vec::new();
        for unit in 0..30 {
            let own = 1.0 + 0.05 * chance.normal();
            for (date, warm) in [("2026-01", 1.0), ("2026-02", 1.0), ("2026-03", 1.12)] {
                let lost = if unit == 17 && date == "2026-03" { 1.3 } else { 1.0 };
                let value = own * warm * lost * (1.0 + 0.01 * chance.normal());
                let effects = if lost > 1.0 { vec!["rotor_asymmetry".to_owned()] } else { Vec::new() };
                let parameters = vec![Parameter { key: "R".into(), value, std: Some(0.01 * value) }];
                let (unit, date) = (format!("m{unit:02}"), date.to_owned());
                rows.push(Row { unit, date, kind: "4 kW".into(), effects, parameters, ..Row::default() });
            }
        }
        let found = changes(&rows);
        assert_eq!(found.iter().map(|c| rows[c.row].unit.as_str()).collect::<Vec<_>>(), ["m17"]);
        assert!((found[0].ratio - 1.12 * 1.3).abs() < 0.06, "{found:?}");
        let new = appeared(&rows);
        assert_eq!((new.len(), rows[new[0].row].unit.as_str(), new[0].since.as_str()), (1, "m17", "2026-03"));
    }
}
