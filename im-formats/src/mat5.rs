//! MAT files of version 5 to 7: elements of a tag and its data, packed or not, arrays and structures of arrays.
//!
//! Source: MathWorks, MAT-File Format (R2023b). Written here because the crate there is (`matfile`) reads neither structures nor texts,
//! and ends without a word at the first element that it does not know.

use crate::cursor::Cursor;
use crate::mat::{OBJECT, Value, workspace};
use crate::numbers::Number;
use crate::zlib::unpack;
use crate::{Format, FormatError, Table};

const FORMAT: Format = Format::Mat5;
const HEADER: usize = 128;
const MATRIX: u32 = 14;
const PACKED: u32 = 15;
/// How deep arrays may stand in arrays.
const DEPTH: usize = 16;

/// Reads a whole file.
pub(crate) fn read(bytes: &[u8]) -> Result<Table, FormatError> {
    let mut file = Cursor::new(bytes, FORMAT);
    file.big_endian = file.take(HEADER, "the header")?.ends_with(b"MI");
    let mut variables = Vec::new();
    while file.rest() >= 8 {
        let (kind, data) = element(&mut file)?;
        let unpacked;
        let data = match kind {
            PACKED => {
                unpacked = unpack(data, FORMAT)?;
                let mut inner = Cursor { data: &unpacked, at: 0, ..file.clone() };
                let (kind, data) = element(&mut inner)?;
                if kind != MATRIX {
                    continue;
                }
                data
            }
            MATRIX => data,
            _ => continue,
        };
        let (name, value) = array(&mut Cursor { data, at: 0, ..file.clone() }, 0)?;
        // Nameless: what objects refer to.
        if !name.is_empty() {
            variables.push((name, value));
        }
    }
    workspace(FORMAT, variables)
}

/// The type and the data of the next element; small ones stand in their tag.
fn element<'a>(from: &mut Cursor<'a>) -> Result<(u32, &'a [u8]), FormatError> {
    let tag = from.u32("a tag")?;
    if tag >> 16 != 0 {
        let data = from.take(4, "a small element")?;
        let n = (tag >> 16) as usize;
        if n > 4 {
            return Err(invalid(format!("a small element of {n} bytes")));
        }
        return Ok((tag & 0xffff, &data[..n]));
    }
    let n = from.u32("the length of an element")? as usize;
    let data = from.take(n, "an element")?;
    if tag != PACKED {
        let padding = n.next_multiple_of(8) - n;
        from.at += padding.min(from.rest());
    }
    Ok((tag, data))
}

fn number(kind: u32) -> Option<Number> {
    Some(match kind {
        1 => Number::I8,
        2 => Number::U8,
        3 => Number::I16,
        4 => Number::U16,
        5 => Number::I32,
        6 => Number::U32,
        7 => Number::F32,
        9 => Number::F64,
        12 => Number::I64,
        13 => Number::U64,
        _ => return None,
    })
}

fn numbers(from: &mut Cursor<'_>) -> Result<Vec<f64>, FormatError> {
    let (kind, data) = element(from)?;
    let number = number(kind).ok_or_else(|| invalid(format!("numbers of the unknown type {kind}")))?;
    Ok(number.all(data, from.big_endian).collect())
}

/// An array without its tag.
fn array(from: &mut Cursor<'_>, depth: usize) -> Result<(String, Value), FormatError> {
    if from.rest() == 0 {
        return Ok((String::new(), Value::Other("empty")));
    }
    if depth > DEPTH {
        return Err(invalid(format!("arrays in arrays more than {DEPTH} deep")));
    }
    let (_, flags) = element(from)?;
    let flags = Cursor { data: flags, at: 0, ..from.clone() }.u32("the flags of an array")?;
    let (class, complex) = (flags & 0xff, flags & 0x800 != 0);
    // An object has no dimensions, but its name.
    if class == 17 {
        let (_, name) = element(from)?;
        return Ok((text(name), Value::Other(OBJECT)));
    }
    let dims: Vec<usize> = numbers(from)?.iter().map(|d| *d as usize).collect();
    let count = dims.iter().try_fold(1_usize, |n, d| n.checked_mul(*d));
    let count = count.ok_or_else(|| invalid(format!("an array of dimensions {dims:?}")))?;
    let (_, name) = element(from)?;
    let name = text(name);
    let value = match class {
        6..=15 => {
            let values = numbers(from)?;
            if values.len() != count {
                return Err(invalid(format!("{name:?} has dimensions {dims:?} and {} values", values.len())));
            }
            if complex { Value::Other("complex numbers") } else { Value::Numbers { dims, values } }
        }
        4 => Value::Text(characters(from)?),
        2 => structure(from, count, depth)?,
        3 => Value::Other(OBJECT),
        1 => Value::Other("cells"),
        5 => Value::Other("a sparse matrix"),
        _ => Value::Other("neither numbers nor text"),
    };
    Ok((name, value))
}

fn structure(from: &mut Cursor<'_>, count: usize, depth: usize) -> Result<Value, FormatError> {
    let length = numbers(from)?.first().map_or(0, |n| *n as usize);
    let (_, names) = element(from)?;
    if length == 0 || !names.len().is_multiple_of(length) {
        return Err(invalid(format!("{} bytes of field names of {length} bytes each", names.len())));
    }
    let mut fields: Vec<(String, Vec<Value>)> = names.chunks_exact(length).map(|n| (text(n), Vec::new())).collect();
    for _ in 0..count {
        for (_, values) in &mut fields {
            // Every one takes a tag, so that a false count ends at the end of the data.
            let (_, data) = element(from)?;
            values.push(array(&mut Cursor { data, at: 0, ..from.clone() }, depth + 1)?.1);
        }
    }
    Ok(Value::Struct { fields })
}

fn characters(from: &mut Cursor<'_>) -> Result<String, FormatError> {
    let (kind, data) = element(from)?;
    Ok(match kind {
        4 | 17 => Number::U16.all(data, from.big_endian).map(|c| char::from_u32(c as u32).unwrap_or('?')).collect(),
        _ => String::from_utf8_lossy(data).into_owned(),
    })
}

/// Up to the first zero.
fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|b| *b == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}

fn invalid(reason: String) -> FormatError {
    FormatError::Invalid { format: FORMAT, reason }
}
