//! Texts in UTF-16, as spreadsheets export "Unicode text", read as UTF-8.

use std::io::{self, Read};

/// Bytes that are turned together.
const BLOCK: usize = 1 << 14;

/// A source whose UTF-16, seen by its byte order mark, is read as UTF-8; everything else passes as it is.
pub struct AsUtf8<R> {
    source: R,
    order: Order,
    /// What is ready to be read, and how much of it was.
    ready: Vec<u8>,
    given: usize,
    /// The bytes of a character that is not whole yet.
    left: Vec<u8>,
}

#[derive(Clone, Copy)]
enum Order {
    Unseen,
    NoUtf16,
    Utf16(fn([u8; 2]) -> u16),
}

impl<R: Read> AsUtf8<R> {
    /// From its beginning.
    pub fn new(source: R) -> Self {
        Self { source, order: Order::Unseen, ready: Vec::new(), given: 0, left: Vec::new() }
    }

    fn begin(&mut self) -> io::Result<()> {
        self.source.by_ref().take(2).read_to_end(&mut self.ready)?;
        self.order = match self.ready[..] {
            [0xff, 0xfe] => Order::Utf16(u16::from_le_bytes),
            [0xfe, 0xff] => Order::Utf16(u16::from_be_bytes),
            _ => Order::NoUtf16,
        };
        if let Order::Utf16(_) = self.order {
            self.ready.clear();
        }
        Ok(())
    }

    fn turn(&mut self, unit: fn([u8; 2]) -> u16) -> io::Result<()> {
        let mut raw = std::mem::take(&mut self.left);
        let ended = self.source.by_ref().take(BLOCK as u64).read_to_end(&mut raw)? < BLOCK;
        let mut units: Vec<u16> = raw.chunks_exact(2).map(|b| unit([b[0], b[1]])).collect();
        if !ended && units.last().is_some_and(|u| (0xd800..0xdc00).contains(u)) {
            units.pop();
        }
        self.left = raw[if ended { raw.len() } else { 2 * units.len() }..].to_vec();
        let text: String = char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect();
        (self.ready, self.given) = (text.into_bytes(), 0);
        Ok(())
    }
}

impl<R: Read> Read for AsUtf8<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if let Order::Unseen = self.order {
            self.begin()?;
        }
        if self.given == self.ready.len() {
            match self.order {
                Order::Utf16(unit) => self.turn(unit)?,
                _ => return self.source.read(out),
            }
        }
        let n = (&self.ready[self.given..]).read(out)?;
        self.given += n;
        Ok(n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> String {
        let mut text = String::new();
        AsUtf8::new(bytes).read_to_string(&mut text).unwrap();
        text
    }

    #[test]
    fn utf_16_of_both_orders_is_read_as_utf_8_and_other_bytes_pass() {
        // Longer than a block, with characters of two units on every border.
        let text = "t_s\tu (µV)\r\n𝄞".repeat(BLOCK / 10);
        let little: Vec<u8> = [0xfeff].into_iter().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
        let big: Vec<u8> = [0xfeff].into_iter().chain(text.encode_utf16()).flat_map(u16::to_be_bytes).collect();
        assert!(read(&little) == text && read(&big) == text && read(text.as_bytes()) == text);
        assert_eq!((read(b""), read(b"1"), read(&[0xff, 0xfe]).as_str()), (String::new(), "1".into(), ""));
        assert_eq!(read(&[0xff, 0xfe, 0x41, 0, 0x00, 0xd8]), "A\u{fffd}");
    }
}
