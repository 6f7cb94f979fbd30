//! What a whole fleet says: types, odd units, changes over time.

use std::collections::BTreeMap;
use std::path::Path;

use im_diagnose::format::signed;
use im_diagnose::report::key_words;
use im_diagnose::table_file::{self, Column};
use im_model::FileError;
use serde_json::{Value as Json, json};

use crate::change::{Appeared, Change, appeared, changes};
use crate::odd::{Odd, Value, find, measured};
use crate::population::Population;
use crate::row::{JobStatus, Row};
use crate::table::PARAMETERS;

/// The statistics of all rows.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    /// Every parameter of the last recording of each motor, as it was compared.
    pub values: Vec<Value>,
    /// What units of a type have in common: by type and parameter.
    pub types: BTreeMap<(String, String), Population>,
    /// Odd units, strongest first.
    pub odd: Vec<Odd>,
    /// Changes over time, strongest first.
    pub changes: Vec<Change>,
    /// Effects that appeared.
    pub appeared: Vec<Appeared>,
}

impl Summary {
    /// Of all rows.
    pub fn of(rows: &[Row]) -> Self {
        let value = |(unit, row): (usize, &Row), key: &str| {
            Some(Value { group: (row.kind.clone(), key.to_owned()), unit, measured: measured(row, key)? })
        };
        // As each motor is now: its last recording alone stands for it.
        let mut last: BTreeMap<&str, usize> = BTreeMap::new();
        for (k, row) in rows.iter().enumerate().filter(|(_, r)| r.status != JobStatus::Failed) {
            let now = last.entry(&row.unit).or_insert(k);
            if row.date >= rows[*now].date {
                *now = k;
            }
        }
        let values: Vec<Value> =
            last.into_values().flat_map(|k| PARAMETERS.iter().filter_map(move |key| value((k, &rows[k]), key))).collect();
        let (types, odd) = find(&values);
        Self { types, odd, changes: changes(rows), appeared: appeared(rows), values }
    }

    /// What was found about a row, a sentence each.
    pub fn of_row(&self, row: usize) -> Vec<String> {
        let odd = self.odd.iter().filter(|o| self.values[o.value].unit == row).map(|o| {
            let v = &self.values[o.value];
            let times = self.types.get(&v.group).map_or(f64::NAN, |t| (v.measured.x - t.mean).exp());
            format!("{} is {times:.2} times that of its type ({} σ)", key_words(&v.group.1), signed(o.distance, 1))
        });
        let changed = self.changes.iter().filter(|c| c.row == row);
        let changed = changed
            .map(|c| format!("{} became {:.2} times what it was ({} σ)", key_words(&c.key), c.ratio, signed(c.distance, 1)));
        let new =
            self.appeared.iter().filter(|a| a.row == row).map(|a| format!("{} since {}", a.effect.replace('_', " "), a.since));
        odd.chain(changed).chain(new).collect()
    }

    /// For programs.
    pub fn to_json(&self, rows: &[Row]) -> Json {
        let name = |k: usize| json!({"unit": rows[k].unit, "date": rows[k].date, "type": rows[k].kind, "key": rows[k].key});
        let count = |of: &dyn Fn(&Row) -> bool| rows.iter().filter(|r| of(r)).count();
        json!({
            "schema": 1,
            "rows": rows.len(),
            "screened": count(&|r| r.status == JobStatus::Screened),
            "diagnosed": count(&|r| r.status == JobStatus::Diagnosed),
            "failed": count(&|r| r.status == JobStatus::Failed),
            "flagged": count(&Row::is_flagged),
            "types": self.types.iter().map(|((kind, parameter), p)| json!({
                "type": kind, "parameter": parameter, "units": p.count, "middle": p.mean.exp(), "spread": p.spread,
            })).collect::<Vec<_>>(),
            "odd": self.odd.iter().map(|o| {
                let v = &self.values[o.value];
                json!({"of": name(v.unit), "parameter": v.group.1, "value": v.measured.x.exp(), "sigmas": o.distance, "p": o.p})
            }).collect::<Vec<_>>(),
            "changes": self.changes.iter().map(|c| {
                json!({"of": name(c.row), "parameter": c.key, "ratio": c.ratio, "sigmas": c.distance, "p": c.p})
            }).collect::<Vec<_>>(),
            "appeared": self.appeared.iter().map(|a| json!({"of": name(a.row), "effect": a.effect, "since": a.since})).collect::<Vec<_>>(),
        })
    }

    /// Writes every parameter of every row: as its own recordings have it, and with what it borrows from its type.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_parameters(&self, path: &Path, rows: &[Row]) -> Result<(), FileError> {
        let (mut words, mut numbers) = (vec![Vec::new(); 4], vec![Vec::new(); 4]);
        for row in rows.iter().filter(|r| r.status != JobStatus::Failed) {
            for key in PARAMETERS {
                let own = measured(row, key);
                let borrowed = self.types.get(&(row.kind.clone(), key.to_owned())).map(|t| t.borrowed(own)).or(own);
                for (column, word) in words.iter_mut().zip([&row.unit, &row.date, &row.kind, key]) {
                    column.push(word.to_owned());
                }
                let pair = |m: Option<crate::population::Measured>| {
                    m.map_or([f64::NAN; 2], |m| [m.x.exp(), m.x.exp() * m.variance.sqrt()])
                };
                for (column, x) in numbers.iter_mut().zip([pair(own), pair(borrowed)].concat()) {
                    column.push(x);
                }
            }
        }
        let names = ["unit", "date", "type", "parameter", "value", "std", "value_with_type", "std_with_type"].map(str::to_owned);
        let columns = words.into_iter().map(Column::Text).chain(numbers.into_iter().map(Column::Number)).collect();
        table_file::write(path, &names, &[columns])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::Parameter;
    use im_diagnose::report::Meta;

    /// Eight motors in two months; one of them is odd in the last month only, and one month of another could not be judged.
    #[test]
    fn a_motor_is_what_its_last_recording_says() {
        let row = |unit: usize, date: &str| {
            let odd = if unit == 3 && date == "2026-02" { 2.0 } else { 1.0 };
            let value = odd * (1.0 + 0.02 * ((unit * 5) % 8) as f64);
            let parameters = vec![Parameter { key: PARAMETERS[1].into(), value, std: Some(0.005) }];
            let status = if unit == 5 && date == "2026-02" { JobStatus::Failed } else { JobStatus::Screened };
            let (unit, date) = (format!("m{unit}"), date.to_owned());
            Row { unit, date, kind: "4 kW".into(), status, parameters, ..Row::default() }
        };
        let rows: Vec<Row> = (0..8).flat_map(|unit| ["2026-01", "2026-02"].map(|date| row(unit, date))).collect();
        let s = Summary::of(&rows);
        assert_eq!(s.values.len(), 8);
        let odd: Vec<&Row> = s.odd.iter().map(|o| &rows[s.values[o.value].unit]).collect();
        assert_eq!(odd.iter().map(|r| (r.unit.as_str(), r.date.as_str())).collect::<Vec<_>>(), [("m3", "2026-02")]);
        // The odd one is left out of its type.
        assert_eq!(s.types.values().next().map(|t| t.count), Some(7));
        let json = s.to_json(&rows);
        assert_eq!((&json["rows"], &json["failed"], &json["odd"][0]["of"]["unit"]), (&16.into(), &1.into(), &"m3".into()));
        let page = crate::report::html("plant", &rows, &s, &Meta::default());
        assert!(page.contains("times that of its type"), "{page}");
    }
}
