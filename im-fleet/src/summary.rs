//! What a whole fleet says: types, odd units, changes over time.

use std::collections::BTreeMap;
use std::path::Path;

use im_diagnose::table_file::{self, Column};
use im_model::FileError;
use serde_json::{Value as Json, json};

use crate::change::{Appeared, Change, appeared, changes};
use crate::odd::{Odd, Value, find, measured};
use crate::population::Population;
use crate::row::{Row, Status};
use crate::table::PARAMETERS;

/// The statistics of all rows.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    /// Every parameter that a row has, as it was compared.
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
        let good = || rows.iter().enumerate().filter(|(_, r)| r.status != Status::Failed);
        let values: Vec<Value> = good().flat_map(|r| PARAMETERS.iter().filter_map(move |key| value(r, key))).collect();
        let (types, odd) = find(&values);
        Self { types, odd, changes: changes(rows), appeared: appeared(rows), values }
    }

    /// What was found about a row, a sentence each.
    pub fn of_row(&self, row: usize) -> Vec<String> {
        let odd = self.odd.iter().filter(|o| self.values[o.value].unit == row).map(|o| {
            let v = &self.values[o.value];
            let times = self.types.get(&v.group).map_or(f64::NAN, |t| (v.measured.x - t.mean).exp());
            format!("{} is {times:.2} times that of its type ({:+.1} σ)", v.group.1, o.distance)
        });
        let changed = self.changes.iter().filter(|c| c.row == row);
        let changed = changed.map(|c| format!("{} became {:.2} times what it was ({:+.1} σ)", c.key, c.ratio, c.distance));
        let new = self.appeared.iter().filter(|a| a.row == row).map(|a| format!("{} since {}", a.effect, a.since));
        odd.chain(changed).chain(new).collect()
    }

    /// For programs.
    pub fn to_json(&self, rows: &[Row]) -> Json {
        let name = |k: usize| json!({"unit": rows[k].unit, "date": rows[k].date, "type": rows[k].kind, "key": rows[k].key});
        let count = |of: &dyn Fn(&Row) -> bool| rows.iter().filter(|r| of(r)).count();
        json!({
            "schema": 1,
            "rows": rows.len(),
            "screened": count(&|r| r.status == Status::Screened),
            "diagnosed": count(&|r| r.status == Status::Diagnosed),
            "failed": count(&|r| r.status == Status::Failed),
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
        let own: BTreeMap<(usize, &str), &Value> = self.values.iter().map(|v| ((v.unit, v.group.1.as_str()), v)).collect();
        let (mut words, mut numbers) = (vec![Vec::new(); 4], vec![Vec::new(); 4]);
        for (k, row) in rows.iter().enumerate().filter(|(_, r)| r.status != Status::Failed) {
            for key in PARAMETERS {
                let own = own.get(&(k, key)).map(|v| v.measured);
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
