//! A channel: where its number stands in a record, and how it becomes a quantity.

use super::conversion::Conversion;
use super::{Block, FORMAT, Mdf};
use crate::FormatError;
use crate::cursor::Cursor;

/// What a channel is, by its type in the file.
const MASTER: u8 = 2;
const VIRTUAL_MASTER: u8 = 3;
const VIRTUAL: u8 = 6;
/// Of a master: it is a time.
const TIME: u8 = 1;

pub(super) struct Channel {
    pub name: String,
    pub unit: String,
    kind: u8,
    sync: u8,
    data_type: u8,
    bit_offset: u32,
    byte_offset: usize,
    bits: u32,
    flags: u32,
    invalidation_bit: usize,
    conversion: Conversion,
    unread: Option<&'static str>,
}

impl Channel {
    pub fn new(file: &Mdf<'_>, block: &Block<'_>) -> Result<Self, FormatError> {
        let mut c = Cursor::new(block.data, FORMAT);
        let what = "a channel";
        let (kind, sync, data_type, bit_offset) = (c.u8(what)?, c.u8(what)?, c.u8(what)?, c.u8(what)?);
        let (byte_offset, bits, flags, invalidation_bit) = (c.u32(what)?, c.u32(what)?, c.u32(what)?, c.u32(what)?);
        let (conversion, its_unit) = Conversion::new(file, block.link(4))?;
        let unit = if block.link(6) == 0 { its_unit } else { file.text(block.link(6))? };
        Ok(Self {
            name: file.text(block.link(2))?,
            unit,
            kind,
            sync,
            data_type,
            bit_offset: bit_offset.into(),
            byte_offset: byte_offset as usize,
            bits,
            flags,
            invalidation_bit: invalidation_bit as usize,
            conversion,
            unread: None,
        })
    }

    /// The same, which is left out because it is `why`.
    pub fn unread(self, why: &'static str) -> Self {
        Self { unread: Some(why), ..self }
    }

    pub fn is_time(&self) -> bool {
        matches!(self.kind, MASTER | VIRTUAL_MASTER) && self.sync == TIME
    }

    pub fn time_unit(&self) -> &str {
        if self.unit.is_empty() { "s" } else { &self.unit }
    }

    /// Its values in records of `record` bytes, of which `size` are data; or why there are none.
    pub fn values(&self, records: &[u8], record: usize, size: usize) -> Result<Vec<f64>, &'static str> {
        if let Some(why) = self.unread {
            return Err(why);
        }
        if let Conversion::Unread(why) = self.conversion {
            return Err(why);
        }
        let rows = records.chunks_exact(record);
        if matches!(self.kind, VIRTUAL_MASTER | VIRTUAL) {
            return Ok((0..rows.len()).map(|k| self.conversion.apply(k as f64)).collect());
        }
        let raw = self.reader()?;
        let bytes = (self.bit_offset + self.bits).div_ceil(8) as usize;
        if self.byte_offset.checked_add(bytes).is_none_or(|end| end > size) {
            return Err("beyond the end of its record");
        }
        let (byte, bit) = (size.saturating_add(self.invalidation_bit / 8), self.invalidation_bit % 8);
        let holds = |row: &[u8]| match self.flags & 3 {
            0 => true,
            2 => row.get(byte).is_none_or(|b| b >> bit & 1 == 0),
            _ => false,
        };
        let at = self.byte_offset..self.byte_offset + bytes;
        let value = |row: &[u8]| if holds(row) { self.conversion.apply(raw(&row[at.clone()])) } else { f64::NAN };
        Ok(rows.map(value).collect())
    }

    /// The number in the bytes of a channel.
    fn reader(&self) -> Result<impl Fn(&[u8]) -> f64, &'static str> {
        let (bits, shift) = (self.bits, self.bit_offset);
        let (big, kind) = match self.data_type {
            0..=5 => (self.data_type % 2 == 1, self.data_type / 2),
            6..=9 => return Err("text"),
            _ => return Err("no real number"),
        };
        let usable = if kind == 2 { shift == 0 && matches!(bits, 32 | 64) } else { (1..=64).contains(&bits) && shift < 8 };
        if !usable {
            return Err("numbers of an unusual width");
        }
        Ok(move |bytes: &[u8]| {
            let joined = |whole: u128, b: &u8| whole << 8 | u128::from(*b);
            let whole = if big { bytes.iter().fold(0, joined) } else { bytes.iter().rev().fold(0, joined) };
            let raw = (whole >> shift) as u64 & (u64::MAX >> (64 - bits));
            match kind {
                0 => raw as f64,
                1 => ((raw << (64 - bits)) as i64 >> (64 - bits)) as f64,
                _ if bits == 32 => f64::from(f32::from_bits(raw as u32)),
                _ => f64::from_bits(raw),
            }
        })
    }
}
