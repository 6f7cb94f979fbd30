//! The records of a data group: one piece or many, packed or not, of one group or of several mixed.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};

use super::{Block, Described, FORMAT, Mdf, invalid};
use crate::FormatError;
use crate::cursor::Cursor;
use crate::zlib::unpack;

/// What the records of a file may take.
const LIMIT: usize = 1 << 31;

/// The records of every group, each behind the other, without their numbers.
pub(super) fn records(file: &Mdf<'_>, first: u64, id_size: u8, groups: &[Described]) -> Result<Vec<Vec<u8>>, FormatError> {
    let all = joined(file, first)?;
    if id_size == 0 {
        if groups.len() > 1 {
            return Err(invalid(format!("{} groups share records that have no numbers", groups.len())));
        }
        return Ok(groups.iter().map(|_| all.to_vec()).collect());
    }
    let mut sorted = vec![Vec::new(); groups.len()];
    let places: HashMap<u64, usize> = groups.iter().enumerate().map(|(k, g)| (g.id, k)).collect();
    let mut c = Cursor::new(&all, FORMAT);
    while c.rest() > 0 {
        let what = "a record";
        let id = match id_size {
            1 => c.u8(what)?.into(),
            2 => c.u16(what)?.into(),
            4 => c.u32(what)?.into(),
            8 => c.u64(what)?,
            n => return Err(invalid(format!("record numbers of {n} bytes"))),
        };
        let place = *places.get(&id).ok_or_else(|| invalid(format!("a record of the group {id}, which there is not")))?;
        let length = if groups[place].variable { c.u32(what)? as usize } else { groups[place].record() };
        // The writer of an unfinished file ended within a record.
        if file.unfinished && length > c.rest() {
            break;
        }
        sorted[place].extend_from_slice(c.take(length, what)?);
    }
    Ok(sorted)
}

/// All pieces behind each other; records go across their ends.
fn joined<'a>(file: &Mdf<'a>, first: u64) -> Result<Cow<'a, [u8]>, FormatError> {
    let mut whole = Cow::Borrowed(&[][..]);
    let mut seen = HashSet::new();
    let mut next = first;
    while next != 0 {
        if !seen.insert(next) {
            return Err(invalid(format!("its data goes round in a circle at byte {next}")));
        }
        let block = file.block(next, &[b"##DT", b"##DZ", b"##DL", b"##HL", b"##DV", b"##LD"])?;
        next = 0;
        match block.id {
            b"##HL" => next = block.link(0),
            b"##DL" => {
                for &piece in block.links.iter().skip(1).filter(|p| **p != 0) {
                    let piece = file.block(piece, &[b"##DT", b"##DZ"])?;
                    append(&mut whole, piece_of(&piece)?)?;
                }
                next = block.link(0);
            }
            b"##DT" | b"##DZ" => append(&mut whole, piece_of(&block)?)?,
            _ => {
                let found = "with its data in columns (MDF 4.2)".to_owned();
                return Err(FormatError::Unsupported { format: FORMAT, found, remedy: "save it as MDF 4.10" });
            }
        }
    }
    Ok(whole)
}

fn append<'a>(whole: &mut Cow<'a, [u8]>, piece: Cow<'a, [u8]>) -> Result<(), FormatError> {
    if whole.len() + piece.len() > LIMIT {
        let found = "of over 2 GiB".to_owned();
        return Err(FormatError::Unsupported { format: FORMAT, found, remedy: "save the part that is needed" });
    }
    if whole.is_empty() {
        *whole = piece;
    } else {
        whole.to_mut().extend_from_slice(&piece);
    }
    Ok(())
}

fn piece_of<'a>(block: &Block<'a>) -> Result<Cow<'a, [u8]>, FormatError> {
    if block.id == b"##DT" {
        return Ok(Cow::Borrowed(block.data));
    }
    let mut c = Cursor::new(block.data, FORMAT);
    let what = "a packed block";
    c.take(2, what)?;
    let how = c.u8(what)?;
    c.take(1, what)?;
    let columns = c.u32(what)? as usize;
    let length = c.size(what)?;
    let packed = c.size(what)?;
    let bytes = match how {
        0 | 1 => unpack(c.take(packed, what)?, FORMAT)?,
        _ => {
            let found = "packed by other means than deflate".to_owned();
            return Err(FormatError::Unsupported {
                format: FORMAT,
                found,
                remedy: "save it as MDF 4.10, packed by deflate or not at all",
            });
        }
    };
    if bytes.len() != length {
        return Err(invalid(format!("a packed block of {length} bytes at byte {} holds {}", block.at, bytes.len())));
    }
    Ok(Cow::Owned(if how == 1 { turned(&bytes, columns) } else { bytes }))
}

/// Rows of `columns` bytes from their columns; what makes no whole row stands at the end as it is.
fn turned(bytes: &[u8], columns: usize) -> Vec<u8> {
    let Some(rows) = bytes.len().checked_div(columns) else { return bytes.to_vec() };
    let mut all: Vec<u8> = Vec::with_capacity(bytes.len());
    for row in 0..rows {
        all.extend((0..columns).map(|column| bytes[column * rows + row]));
    }
    all.extend_from_slice(&bytes[rows * columns..]);
    all
}
