//! MAT files of version 7.3, which are HDF5, and HDF5 files of plain vectors.
//!
//! MATLAB writes its dimensions turned, so that what HDF5 calls k × N is N × k in MATLAB and the first dimension is fastest in both
//! eyes. A file of another program has no attribute `MATLAB_class`; its rows are the first dimension.

use std::panic::{AssertUnwindSafe, catch_unwind};

use hdf5_pure::{AttrValue, DType, Dataset, File, Group, Object};

use crate::mat::{OBJECT, Value, workspace};
use crate::{Format, FormatError, Table};

const FORMAT: Format = Format::Hdf5;
const DEPTH: usize = 8;

/// Reads a whole file.
pub(crate) fn read(bytes: Vec<u8>) -> Result<Table, FormatError> {
    // What the values can be at most: deflate packs 1:1032 at best, and what was never written takes no room at all.
    let most = bytes.len().saturating_mul(1100).min(1 << 31);
    // The library is young, and a damaged file must end in a message whatever it does with it.
    let variables = catch_unwind(AssertUnwindSafe(|| {
        let file = File::from_bytes(bytes).map_err(|e| invalid(&e))?;
        members(&file.root(), most, 0)
    }));
    let damaged = || FormatError::Invalid { format: FORMAT, reason: "its structure is damaged".to_owned() };
    workspace(FORMAT, variables.map_err(|_| damaged())??)
}

fn invalid(e: &impl ToString) -> FormatError {
    FormatError::Invalid { format: FORMAT, reason: e.to_string() }
}

fn members(group: &Group, most: usize, depth: usize) -> Result<Vec<(String, Value)>, FormatError> {
    let mut all = Vec::new();
    for name in group.datasets().map_err(|e| invalid(&e))? {
        let dataset = group.dataset(&name).map_err(|e| invalid(&e))?;
        all.push((name, value(&dataset, most)?));
    }
    for name in group.groups().map_err(|e| invalid(&e))? {
        // `#refs#` and `#subsystem#` hold what cells and objects refer to.
        if name.starts_with('#') || depth == DEPTH {
            continue;
        }
        let inner = group.group(&name).map_err(|e| invalid(&e))?;
        all.push((name, record(&inner, most, depth)?));
    }
    Ok(all)
}

/// A structure: in each field a value, or references to those of all elements.
fn record(group: &Group, most: usize, depth: usize) -> Result<Value, FormatError> {
    let mut fields: Vec<(String, Vec<Value>)> = Vec::new();
    for (name, one) in members(group, most, depth + 1)? {
        let many = match (&one, group.dataset(&name)) {
            (Value::Other(REFERENCES), Ok(dataset)) => referred(&dataset, most, depth)?,
            _ => vec![one],
        };
        fields.push((name, many));
    }
    Ok(Value::Struct { fields })
}

const REFERENCES: &str = "cells";

fn referred(dataset: &Dataset, most: usize, depth: usize) -> Result<Vec<Value>, FormatError> {
    if depth == DEPTH {
        return Ok(Vec::new());
    }
    let objects = dataset.dereference().map_err(|e| invalid(&e))?;
    let one = |object: Object| match object {
        Object::Dataset(d) => value(&d, most),
        Object::Group(g) => record(&g, most, depth + 1),
        #[allow(unreachable_patterns)]
        _ => Ok(Value::Other("neither numbers nor text")),
    };
    objects.into_iter().map(one).collect()
}

fn value(dataset: &Dataset, most: usize) -> Result<Value, FormatError> {
    let attributes = dataset.attrs().map_err(|e| invalid(&e))?;
    let class = match attributes.get("MATLAB_class") {
        Some(AttrValue::AsciiString(s) | AttrValue::String(s)) => Some(s.as_str()),
        _ => None,
    };
    if attributes.contains_key("MATLAB_object_decode") {
        return Ok(Value::Other(OBJECT));
    }
    let kind = dataset.dtype().map_err(|e| invalid(&e))?;
    let shape = dataset.shape().map_err(|e| invalid(&e))?;
    let count = shape.iter().try_fold(1_u64, |n, d| n.checked_mul(*d)).filter(|n| n.saturating_mul(8) <= most as u64);
    let Some(count) = count else {
        return Err(FormatError::Invalid {
            format: FORMAT,
            reason: format!("an array of dimensions {shape:?} in a file of this size"),
        });
    };
    if attributes.contains_key("MATLAB_empty") || count == 0 {
        return Ok(Value::Other("empty"));
    }
    match kind {
        _ if class == Some("char") => {
            let units = dataset.read_u16().map_err(|e| invalid(&e))?;
            Ok(Value::Text(String::from_utf16_lossy(&units)))
        }
        DType::F32
        | DType::F64
        | DType::I8
        | DType::I16
        | DType::I32
        | DType::I64
        | DType::U8
        | DType::U16
        | DType::U32
        | DType::U64 => {
            let values = dataset.read_f64().map_err(|e| invalid(&e))?;
            if values.len() as u64 != count {
                return Err(FormatError::Invalid {
                    format: FORMAT,
                    reason: format!("dimensions {shape:?} and {} values", values.len()),
                });
            }
            let mut dims: Vec<usize> = shape.iter().map(|d| *d as usize).collect();
            dims.reverse();
            Ok(Value::Numbers { dims, values })
        }
        DType::ObjectReference => Ok(Value::Other(REFERENCES)),
        _ => Ok(Value::Other("neither real numbers nor text")),
    }
}
