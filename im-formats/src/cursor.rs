//! Reading numbers from bytes, either end first, never beyond their end.

use crate::{Format, FormatError};

/// A place in bytes.
#[derive(Clone)]
pub(crate) struct Cursor<'a> {
    pub data: &'a [u8],
    pub at: usize,
    pub big_endian: bool,
    pub format: Format,
}

impl<'a> Cursor<'a> {
    pub fn new(data: &'a [u8], format: Format) -> Self {
        Self { data, at: 0, big_endian: false, format }
    }

    pub fn rest(&self) -> usize {
        self.data.len() - self.at
    }

    /// The next `n` bytes, which are `what`.
    pub fn take(&mut self, n: usize, what: &'static str) -> Result<&'a [u8], FormatError> {
        let end = self.at.checked_add(n).filter(|end| *end <= self.data.len());
        let end = end.ok_or(FormatError::Truncated { format: self.format, what, at: self.at })?;
        let taken = &self.data[self.at..end];
        self.at = end;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self, what: &'static str) -> Result<[u8; N], FormatError> {
        let mut bytes = [0; N];
        bytes.copy_from_slice(self.take(N, what)?);
        if self.big_endian {
            bytes.reverse();
        }
        Ok(bytes)
    }

    pub fn u8(&mut self, what: &'static str) -> Result<u8, FormatError> {
        Ok(self.array::<1>(what)?[0])
    }

    pub fn u16(&mut self, what: &'static str) -> Result<u16, FormatError> {
        self.array(what).map(u16::from_le_bytes)
    }

    pub fn u32(&mut self, what: &'static str) -> Result<u32, FormatError> {
        self.array(what).map(u32::from_le_bytes)
    }

    pub fn u64(&mut self, what: &'static str) -> Result<u64, FormatError> {
        self.array(what).map(u64::from_le_bytes)
    }

    pub fn f64(&mut self, what: &'static str) -> Result<f64, FormatError> {
        self.array(what).map(f64::from_le_bytes)
    }

    /// A number that counts things in memory.
    pub fn size(&mut self, what: &'static str) -> Result<usize, FormatError> {
        let n = self.u64(what)?;
        usize::try_from(n).map_err(|_| FormatError::Truncated { format: self.format, what, at: self.at })
    }
}
