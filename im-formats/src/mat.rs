//! MATLAB's variables as groups of channels.
//!
//! - vectors: channels; those of one length belong together, and the one named like a time and increasing is their time
//! - a matrix N × k: channels `name_1 … name_k`; with one row fewer than columns and more it is turned
//! - Simulink's "structure with time" (`time`, `signals.values`, `signals.label`): a group; "structure": its vectors as `name.field`
//! - any other structure: its vectors as `name.field`, its own time first

use crate::align::{Column, Group, by_length, table};
use crate::{Format, FormatError, Table};

/// A variable.
#[derive(Clone, Debug)]
pub(crate) enum Value {
    /// Numbers, the first dimension fastest.
    Numbers { dims: Vec<usize>, values: Vec<f64> },
    /// A text.
    Text(String),
    /// Fields of every element of an array of structures.
    Struct { fields: Vec<(String, Vec<Value>)> },
    /// What holds no numbers, by its class.
    Other(&'static str),
}

impl Value {
    fn field(&self, name: &str) -> Option<&[Value]> {
        let Self::Struct { fields } = self else { return None };
        fields.iter().find(|(f, _)| f == name).map(|(_, v)| v.as_slice())
    }

    fn vector(&self) -> Option<&[f64]> {
        match self {
            Self::Numbers { dims, values } if values.len() > 1 && dims.iter().filter(|d| **d > 1).count() == 1 => Some(values),
            _ => None,
        }
    }
}

/// The table of a workspace.
pub(crate) fn workspace(format: Format, variables: Vec<(String, Value)>) -> Result<Table, FormatError> {
    let mut groups = Vec::new();
    let mut left_out = Vec::new();
    let mut objects = false;
    let mut loose = Vec::new();
    for (name, value) in variables {
        match value {
            Value::Struct { .. } => structure(&name, &value, &mut groups, &mut left_out, 0),
            Value::Text(_) => left_out.push(format!("{name} (text)")),
            Value::Other(class) => {
                objects |= class == OBJECT;
                left_out.push(format!("{name} ({class})"));
            }
            numbers => channels(&name, &numbers, &mut loose, &mut left_out),
        }
    }
    let mut all = by_length(String::new(), loose);
    all.append(&mut groups);
    if objects && all.is_empty() {
        return Err(FormatError::Unsupported {
            format,
            found: "that holds nothing but objects (timeseries, timetable, Dataset)".to_owned(),
            remedy: "in MATLAB save them as vectors: t = ts.Time; u = ts.Data; save('run.mat', 't', 'u')",
        });
    }
    table(format, all, left_out)
}

/// The class of what only MATLAB can read.
pub(crate) const OBJECT: &str = "object";

/// The channels of a vector or matrix.
fn channels(name: &str, value: &Value, into: &mut Vec<Column>, left_out: &mut Vec<String>) {
    let Value::Numbers { dims, values } = value else { return };
    if let Some(vector) = value.vector() {
        into.push(Column::new(name, "", vector.to_vec()));
        return;
    }
    match dims.as_slice() {
        [n, k] if *n > 1 && *k > 1 => {
            let turned = n < k;
            let (rows, columns) = if turned { (*k, *n) } else { (*n, *k) };
            let at = |r: usize, c: usize| if turned { values[r * columns + c] } else { values[c * rows + r] };
            into.extend(
                (0..columns).map(|c| Column::new(format!("{name}_{}", c + 1), "", (0..rows).map(|r| at(r, c)).collect())),
            );
        }
        _ if values.len() < 2 => left_out.push(format!("{name} (one number)")),
        _ => left_out.push(format!("{name} (more than two dimensions)")),
    }
}

/// How deep structures are looked into.
const DEPTH: usize = 4;

fn structure(name: &str, value: &Value, groups: &mut Vec<Group>, left_out: &mut Vec<String>, depth: usize) {
    let Value::Struct { fields } = value else { return };
    if let (Some([time]), Some([signals])) = (value.field("time"), value.field("signals"))
        && signals.field("values").is_some()
    {
        groups.extend(simulink(name, time, signals, left_out));
        return;
    }
    let mut inside = Vec::new();
    for (field, values) in fields {
        let name = format!("{name}.{field}");
        match values.as_slice() {
            [Value::Struct { .. }] if depth == DEPTH => left_out.push(format!("{name} (nested too deep)")),
            [inner @ Value::Struct { .. }] => structure(&name, inner, groups, left_out, depth + 1),
            [numbers @ Value::Numbers { .. }] => channels(&name, numbers, &mut inside, left_out),
            [Value::Text(_)] => left_out.push(format!("{name} (text)")),
            [Value::Other(class)] => left_out.push(format!("{name} ({class})")),
            _ => left_out.push(format!("{name} (an array of structures)")),
        }
    }
    groups.extend(by_length(name.to_owned(), inside));
}

/// Scopes and "To Workspace" blocks: a time and an array of signals, each with values N × width.
fn simulink(name: &str, time: &Value, signals: &Value, left_out: &mut Vec<String>) -> Vec<Group> {
    let mut columns = Vec::new();
    for (k, values) in signals.field("values").unwrap_or_default().iter().enumerate() {
        let text = |field: &str| match signals.field(field).and_then(|f| f.get(k)) {
            Some(Value::Text(t)) if !t.trim().is_empty() => Some(t.clone()),
            _ => None,
        };
        let label = text("label").or_else(|| text("blockName")).unwrap_or_else(|| format!("{name}.signals{}", k + 1));
        channels(&label, values, &mut columns, left_out);
    }
    let rows = time.vector().map(<[f64]>::len);
    let mut groups = by_length(name.to_owned(), columns);
    for group in groups.iter_mut().filter(|g| g.columns.first().map(|c| c.values.len()) == rows) {
        group.time = time.vector().map(|t| Column::new("t", "s", t.to_vec()));
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vector(values: &[f64]) -> Value {
        Value::Numbers { dims: vec![values.len(), 1], values: values.to_vec() }
    }

    #[test]
    fn each_length_has_the_time_that_is_named_so_and_increases() {
        let all = workspace(
            Format::Mat5,
            vec![
                ("t_winding".into(), vector(&[20.0, 21.0, 20.5, 20.7, 20.1])),
                ("u".into(), vector(&[1.0, 2.0, 3.0, 4.0, 5.0])),
                ("t".into(), vector(&[0.0, 1.0, 2.0, 3.0, 4.0])),
                ("n_slow".into(), vector(&[0.0, 20.0, 40.0])),
                ("t_slow".into(), vector(&[0.0, 2.0, 4.0])),
                ("R".into(), vector(&[5.0])),
            ],
        )
        .unwrap();
        assert_eq!(all.names, ["t (s)", "t_winding", "u", "n_slow"]);
        assert_eq!(all.columns[3], [0.0, 10.0, 20.0, 30.0, 40.0]);
        assert_eq!(all.left_out, ["R (one number)"]);
    }

    #[test]
    fn objects_alone_say_how_to_save_them() {
        let error = workspace(Format::Mat5, vec![("out".into(), Value::Other(OBJECT))]).unwrap_err();
        assert!(error.to_string().contains("t = ts.Time"), "{error}");
    }
}
