//! Arrays of numbers as they stand in files.

/// A type of number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Number {
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// Every number in `bytes`; a rest that is none is passed over.
    pub fn all(self, bytes: &[u8], big_endian: bool) -> impl Iterator<Item = f64> {
        bytes.chunks_exact(self.size()).map(move |b| self.one(b, big_endian))
    }

    fn one(self, bytes: &[u8], big_endian: bool) -> f64 {
        let mut b = [0; 8];
        b[..bytes.len()].copy_from_slice(bytes);
        if big_endian {
            b[..bytes.len()].reverse();
        }
        let whole = u64::from_le_bytes(b);
        // The lower bytes are the number, whatever its width.
        match self {
            Self::I8 => f64::from(whole as i8),
            Self::I16 => f64::from(whole as i16),
            Self::I32 => f64::from(whole as i32),
            Self::I64 => whole as i64 as f64,
            Self::U8 | Self::U16 | Self::U32 | Self::U64 => whole as f64,
            Self::F32 => f64::from(f32::from_bits(whole as u32)),
            Self::F64 => f64::from_bits(whole),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_and_either_end_first() {
        let one = |n: Number, bytes: &[u8], big| n.all(bytes, big).collect::<Vec<_>>();
        assert_eq!(one(Number::I16, &[0xfe, 0xff, 1, 0], false), [-2.0, 1.0]);
        assert_eq!(one(Number::I16, &[0xff, 0xfe, 0, 1], true), [-2.0, 1.0]);
        assert_eq!(one(Number::F32, &(-2.5_f32).to_be_bytes(), true), [-2.5]);
        assert_eq!(one(Number::I8, &[0x80], true), [-128.0]);
        assert_eq!(one(Number::U64, &[1, 0, 0, 0, 0, 0, 0, 0, 9], false), [1.0]);
    }
}
