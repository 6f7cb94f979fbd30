//! TDMS: segments, each of what changed in the list of channels and of raw data in chunks.
//!
//! Source: NI, TDMS File Format Internal Structure. Written here because the crate there is (`tdms-rs`) reads one chunk of a segment,
//! where LabVIEW appends many, and neither interleaved data nor numbers with the higher byte first.

use std::collections::HashMap;

use crate::align::{Column, Group, by_length, table};
use crate::cursor::Cursor;
use crate::{Format, FormatError, Table};

mod object;

use object::{Index, Object, Property, path};

const FORMAT: Format = Format::Tdms;
/// Bits of what a segment holds.
const METADATA: u32 = 1 << 1;
const NEW_LIST: u32 = 1 << 2;
const RAW_DATA: u32 = 1 << 3;
const INTERLEAVED: u32 = 1 << 5;
const BIG_ENDIAN: u32 = 1 << 6;
/// Before each segment.
const LEAD_IN: usize = 28;

/// Reads a whole file.
pub(crate) fn read(bytes: &[u8]) -> Result<Table, FormatError> {
    if bytes.starts_with(b"TDSh") {
        let found = "index, which has no values".to_owned();
        return Err(FormatError::Unsupported { format: FORMAT, found, remedy: "name the .tdms file beside it" });
    }
    let mut file = Contents::default();
    let mut start = 0;
    while start < bytes.len() {
        start = file.segment(bytes, start)?;
    }
    file.table()
}

fn invalid(reason: String) -> FormatError {
    FormatError::Invalid { format: FORMAT, reason }
}

#[derive(Default)]
struct Contents {
    objects: Vec<Object>,
    places: HashMap<String, usize>,
    /// The objects with data in the present segment, in order.
    list: Vec<usize>,
    left_out: Vec<String>,
}

impl Contents {
    /// Reads the segment at `start` and says where the next one begins.
    fn segment(&mut self, bytes: &[u8], start: usize) -> Result<usize, FormatError> {
        let mut c = Cursor { at: start, ..Cursor::new(bytes, FORMAT) };
        if c.take(4, "a segment")? != b"TDSm" {
            return Err(invalid(format!("no segment begins at byte {start}")));
        }
        let holds = c.u32("a segment")?;
        c.big_endian = holds & BIG_ENDIAN != 0;
        c.take(4, "a segment")?;
        let (length, raw) = (c.u64("a segment")?, c.size("a segment")?);
        // All ones: the writer ended before it knew.
        let length = if length == u64::MAX { c.rest() } else { usize::try_from(length).unwrap_or(usize::MAX) };
        let body = c.take(length, "a segment")?;
        if raw > body.len() {
            return Err(FormatError::Truncated { format: FORMAT, what: "the data of a segment", at: start + LEAD_IN });
        }
        if holds & METADATA != 0 {
            if holds & NEW_LIST != 0 {
                self.list.clear();
            }
            self.metadata(&mut Cursor { data: &body[..raw], at: 0, ..c.clone() })?;
        }
        if holds & RAW_DATA != 0 {
            self.raw_data(&body[raw..], holds & INTERLEAVED != 0, c.big_endian)?;
        }
        Ok(c.at)
    }

    fn metadata(&mut self, c: &mut Cursor<'_>) -> Result<(), FormatError> {
        for _ in 0..c.u32("the number of objects")? {
            let name = object::text(c)?;
            let place = *self.places.entry(name.clone()).or_insert(self.objects.len());
            if place == self.objects.len() {
                self.objects.push(Object::new(path(&name)));
            }
            let object = &mut self.objects[place];
            let index = Index::read(c, object.index)?;
            self.list.retain(|k| *k != place || index.is_some());
            if index.is_some() {
                object.index = index;
                if !self.list.contains(&place) {
                    self.list.push(place);
                }
            }
            for _ in 0..c.u32("the number of properties")? {
                let name = object::text(c)?;
                let value = Property::read(c)?;
                self.objects[place].properties.insert(name, value);
            }
        }
        Ok(())
    }

    fn raw_data(&mut self, raw: &[u8], interleaved: bool, big_endian: bool) -> Result<(), FormatError> {
        let parts: Vec<(usize, Index)> = self.list.iter().filter_map(|&k| Some((k, self.objects[k].index?))).collect();
        let parts: Vec<(usize, Index)> = parts.into_iter().filter(|(_, index)| index.bytes > 0).collect();
        let chunk = parts.iter().try_fold(0_usize, |n, (_, index)| n.checked_add(index.bytes));
        let chunk = chunk.filter(|n| *n <= raw.len() || raw.is_empty());
        let Some(chunk) = chunk else {
            return Err(FormatError::Truncated { format: FORMAT, what: "the values of a chunk", at: raw.len() });
        };
        if chunk == 0 {
            return Ok(());
        }
        if !raw.len().is_multiple_of(chunk) {
            self.left_out.push("the last, incomplete chunk".to_owned());
        }
        for whole in raw.chunks_exact(chunk) {
            let mut rest = whole;
            let row: usize = parts.iter().map(|(_, index)| index.size()).sum();
            let mut column = 0;
            for (k, index) in &parts {
                if interleaved {
                    let values = whole.chunks_exact(row.max(1)).map(|r| &r[column..column + index.size()]);
                    self.objects[*k].extend(values, big_endian);
                    column += index.size();
                } else {
                    let (own, others) = rest.split_at(index.bytes);
                    self.objects[*k].extend(std::iter::once(own), big_endian);
                    rest = others;
                }
            }
        }
        Ok(())
    }

    fn table(mut self) -> Result<Table, FormatError> {
        let mut starts: Vec<f64> = Vec::new();
        // Absolute times are large numbers: they count from the first second that is seen.
        let origin = self.objects.iter().find_map(Object::first_second).unwrap_or(0);
        for object in &self.objects {
            starts.extend(object.start(origin).filter(|_| object.increment().is_some()));
        }
        let earliest = starts.iter().copied().fold(f64::INFINITY, f64::min);
        let mut waves: Vec<([u64; 3], Group)> = Vec::new();
        let mut loose: Vec<(String, Vec<Column>)> = Vec::new();
        for object in &mut self.objects {
            let [group, channel] = object.path.as_slice() else { continue };
            let (group, channel) = (group.clone(), channel.clone());
            let values = match object.quantity(origin) {
                Ok(values) => values,
                Err(why) => {
                    self.left_out.push(format!("{channel} ({why})"));
                    continue;
                }
            };
            let column = Column::new(channel, object.unit(), values);
            let n = column.values.len();
            if let Some(step) = object.increment() {
                let from = object.start(origin).map_or(0.0, |s| s - earliest) + object.offset();
                let key = [from.to_bits(), step.to_bits(), n as u64];
                match waves.iter_mut().find(|(k, g)| *k == key && g.name == group) {
                    Some((_, wave)) => wave.columns.push(column),
                    None => {
                        let time = Column::new("t", "s", (0..n).map(|k| from + step * k as f64).collect());
                        waves.push((key, Group { name: group, time: Some(time), columns: vec![column] }));
                    }
                }
            } else {
                match loose.iter_mut().find(|(name, _)| *name == group) {
                    Some((_, columns)) => columns.push(column),
                    None => loose.push((group, vec![column])),
                }
            }
        }
        let groups = waves.into_iter().map(|(_, g)| g);
        let groups = groups.chain(loose.into_iter().flat_map(|(name, columns)| by_length(name, columns))).collect();
        table(FORMAT, groups, self.left_out)
    }
}
