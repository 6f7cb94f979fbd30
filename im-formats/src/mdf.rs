//! MDF 4: blocks of links and data; groups of channels in records, packed or not, sorted or not.
//!
//! Source: ASAM MDF 4.1 (the blocks ID, HD, DG, CG, CN, CC, TX, MD, DT, DL, HL, DZ). Written here because records go across the ends of
//! data blocks and packed blocks are the rule, and of the crates there are `mf4-rs` and the channels of `mdf4-rs` read no packed block.

use std::collections::HashSet;

use crate::align::{Column, Group, table};
use crate::cursor::Cursor;
use crate::{Format, FormatError, Table};

mod channel;
mod conversion;
mod data;

use channel::Channel;

const FORMAT: Format = Format::Mdf;
/// Where the header stands.
const HEADER: u64 = 64;

/// Reads a whole file.
pub(crate) fn read(bytes: &[u8]) -> Result<Table, FormatError> {
    let version = String::from_utf8_lossy(bytes.get(8..16).unwrap_or_default()).trim().to_owned();
    if !version.starts_with('4') {
        let found = format!("of version {version}");
        let remedy = "save it as MDF 4.10, for example with asammdf: MDF(file).convert('4.10').save(name)";
        return Err(FormatError::Unsupported { format: FORMAT, found, remedy });
    }
    let file = Mdf { bytes, unfinished: bytes.starts_with(b"UnFinMF") };
    let mut left_out = Vec::new();
    let mut groups = Vec::new();
    let header = file.block(HEADER, &[b"##HD"])?;
    for data_group in file.list(header.link(0), b"##DG")? {
        let id_size = Cursor::new(data_group.data, FORMAT).u8("the size of record numbers")?;
        let described: Vec<Described> =
            file.list(data_group.link(1), b"##CG")?.iter().map(|g| file.described(g)).collect::<Result<_, _>>()?;
        let records = data::records(&file, data_group.link(2), id_size, &described)?;
        for (group, records) in described.into_iter().zip(records) {
            groups.extend(group.decoded(&records, &mut left_out));
        }
    }
    table(FORMAT, groups, left_out)
}

fn invalid(reason: String) -> FormatError {
    FormatError::Invalid { format: FORMAT, reason }
}

/// The file as blocks.
struct Mdf<'a> {
    bytes: &'a [u8],
    /// Its writer ended before it wrote the lengths.
    unfinished: bool,
}

/// A block: links to others, then data.
struct Block<'a> {
    id: &'a [u8],
    at: u64,
    links: Vec<u64>,
    data: &'a [u8],
}

impl Block<'_> {
    /// Link `k`; 0 where there is none.
    fn link(&self, k: usize) -> u64 {
        self.links.get(k).copied().unwrap_or(0)
    }
}

impl<'a> Mdf<'a> {
    fn block(&self, at: u64, ids: &[&[u8; 4]]) -> Result<Block<'a>, FormatError> {
        let start = usize::try_from(at).unwrap_or(usize::MAX).min(self.bytes.len());
        let mut cursor = Cursor { at: start, ..Cursor::new(self.bytes, FORMAT) };
        let id = cursor.take(4, "a block")?;
        if !ids.iter().any(|i| *i == id) {
            let expected = String::from_utf8_lossy(ids[0]).into_owned();
            return Err(invalid(format!("at byte {at} stands {:?} instead of {expected:?}", String::from_utf8_lossy(id))));
        }
        cursor.take(4, "a block")?;
        let length = cursor.size("the length of a block")?;
        let count = cursor.size("the number of links")?;
        if count > cursor.rest() / 8 {
            return Err(invalid(format!("a block of {count} links at byte {at}")));
        }
        let links = (0..count).map(|_| cursor.u64("a link")).collect::<Result<Vec<u64>, _>>()?;
        let head = cursor.at - start;
        let rest = length.checked_sub(head).ok_or_else(|| invalid(format!("a block of {length} bytes at byte {at}")))?;
        // The length of the last block of an unfinished file was never written.
        let rest = if self.unfinished && id == b"##DT" && rest == 0 { cursor.rest() } else { rest };
        Ok(Block { id, at, links, data: cursor.take(rest, "the data of a block")? })
    }

    /// Blocks of which each names the next in its first link.
    fn list(&self, first: u64, id: &[u8; 4]) -> Result<Vec<Block<'a>>, FormatError> {
        let mut blocks = Vec::new();
        let mut seen = HashSet::new();
        let mut next = first;
        while next != 0 {
            if !seen.insert(next) {
                return Err(invalid(format!("its blocks go round in a circle at byte {next}")));
            }
            let block = self.block(next, &[id])?;
            next = block.link(0);
            blocks.push(block);
        }
        Ok(blocks)
    }

    /// A text, from its own block or from the `TX` of a comment.
    fn text(&self, at: u64) -> Result<String, FormatError> {
        if at == 0 {
            return Ok(String::new());
        }
        let block = self.block(at, &[b"##TX", b"##MD"])?;
        let end = block.data.iter().position(|b| *b == 0).unwrap_or(block.data.len());
        let text = String::from_utf8_lossy(&block.data[..end]).into_owned();
        let inner = text.split_once("<TX>").and_then(|(_, rest)| rest.split_once("</TX>")).map(|(inner, _)| inner.to_owned());
        Ok(if block.id == b"##MD" { inner.unwrap_or_default() } else { text })
    }

    fn described(&self, group: &Block<'_>) -> Result<Described, FormatError> {
        let mut cursor = Cursor::new(group.data, FORMAT);
        let id = cursor.u64("a record number")?;
        cursor.take(8, "the number of records")?;
        let variable = cursor.u16("the flags of a group")? & 1 != 0;
        cursor.take(6, "a group")?;
        let size = cursor.u32("the length of a record")? as usize;
        let invalidation = cursor.u32("the length of a record")? as usize;
        let mut channels = Vec::new();
        self.channels(group.link(1), &mut channels, 0)?;
        Ok(Described { name: self.text(group.link(2))?, id, variable, size, invalidation, channels })
    }

    /// A list of channels and what they are composed of.
    fn channels(&self, first: u64, into: &mut Vec<Channel>, depth: usize) -> Result<(), FormatError> {
        for block in self.list(first, b"##CN")? {
            if depth == DEPTH || into.len() > self.bytes.len() / 24 {
                return Err(invalid("channels within channels without end".to_owned()));
            }
            let inner = block.link(1);
            let channel = Channel::new(self, &block)?;
            if inner != 0 && self.block(inner, &[b"##CN", b"##CA"])?.id == b"##CN" {
                self.channels(inner, into, depth + 1)?;
            } else {
                into.push(if inner == 0 { channel } else { channel.unread("an array") });
            }
        }
        Ok(())
    }
}

/// How deep channels may stand in channels.
const DEPTH: usize = 8;

/// A group of channels, before its records are known.
struct Described {
    name: String,
    /// The number before each of its records, where several groups share their data.
    id: u64,
    /// Its records are one value of any length each.
    variable: bool,
    /// Bytes of a record, and those after it that say which values hold.
    size: usize,
    invalidation: usize,
    channels: Vec<Channel>,
}

impl Described {
    fn record(&self) -> usize {
        self.size.saturating_add(self.invalidation)
    }

    fn decoded(self, records: &[u8], left_out: &mut Vec<String>) -> Option<Group> {
        if self.variable || self.record() == 0 {
            return None;
        }
        let mut group = Group { name: self.name.clone(), ..Group::default() };
        for channel in &self.channels {
            match channel.values(records, self.record(), self.size) {
                Ok(values) if channel.is_time() => group.time = Some(Column::new("t", channel.time_unit(), values)),
                Ok(values) => group.columns.push(Column::new(&channel.name, &channel.unit, values)),
                Err(why) => left_out.push(format!("{} ({why})", channel.name)),
            }
        }
        Some(group)
    }
}
