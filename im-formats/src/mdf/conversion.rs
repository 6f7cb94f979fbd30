//! From the number in a record to the quantity.

use super::{FORMAT, Mdf};
use crate::FormatError;
use crate::cursor::Cursor;

pub(super) enum Conversion {
    Identity,
    /// a + b x.
    Linear(f64, f64),
    /// (p₁x² + p₂x + p₃)/(p₄x² + p₅x + p₆).
    Rational([f64; 6]),
    /// Pairs of x and value, between them a line or the nearer one.
    Pairs {
        pairs: Vec<[f64; 2]>,
        lines: bool,
    },
    /// The value from a first to a last x, and elsewhere.
    Ranges(Vec<[f64; 3]>, f64),
    Unread(&'static str),
}

impl Conversion {
    /// The conversion of the block at `at`, and its unit.
    pub fn new(file: &Mdf<'_>, at: u64) -> Result<(Self, String), FormatError> {
        if at == 0 {
            return Ok((Self::Identity, String::new()));
        }
        let block = file.block(at, &[b"##CC"])?;
        let unit = file.text(block.link(1))?;
        let mut c = Cursor::new(block.data, FORMAT);
        let kind = c.u8("a conversion")?;
        // Precision, flags, number of links, number of values, range.
        c.take(23, "a conversion")?;
        let mut p = Vec::new();
        while c.rest() >= 8 {
            p.push(c.f64("a conversion")?);
        }
        let short = "a conversion that is cut short";
        let conversion = match (kind, p.as_slice()) {
            (0, _) => Self::Identity,
            (1, [a, b, ..]) => Self::Linear(*a, *b),
            (2, [a, b, c, d, e, f, ..]) => Self::Rational([*a, *b, *c, *d, *e, *f]),
            (3, _) => Self::Unread("converted by a formula"),
            (4 | 5, [_, _, ..]) => Self::Pairs { pairs: p.as_chunks().0.to_vec(), lines: kind == 4 },
            (6, [.., default]) => Self::Ranges(p.as_chunks().0.to_vec(), *default),
            (7.., _) => Self::Unread("text"),
            _ => Self::Unread(short),
        };
        Ok((conversion, unit))
    }

    pub fn apply(&self, x: f64) -> f64 {
        match self {
            Self::Identity => x,
            Self::Linear(a, b) => a + b * x,
            Self::Rational([a, b, c, d, e, f]) => (x * (a * x + b) + c) / (x * (d * x + e) + f),
            Self::Pairs { pairs, lines } => {
                let above = pairs.partition_point(|[key, _]| *key <= x).clamp(1, pairs.len().max(2) - 1);
                let [x0, y0] = pairs[above - 1];
                let [x1, y1] = pairs.get(above).copied().unwrap_or([x0, y0]);
                match () {
                    () if x <= x0 || x1 <= x0 => y0,
                    () if x >= x1 => y1,
                    () if *lines => y0 + (x - x0) / (x1 - x0) * (y1 - y0),
                    () if x - x0 <= x1 - x => y0,
                    () => y1,
                }
            }
            Self::Ranges(ranges, default) => {
                ranges.iter().find(|[from, to, _]| (*from..=*to).contains(&x)).map_or(*default, |[_, _, value]| *value)
            }
            Self::Unread(_) => f64::NAN,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_conversion_at_numbers_done_by_hand() {
        assert_eq!(Conversion::Linear(-1.0, 0.5).apply(4.0), 1.0);
        assert_eq!(Conversion::Rational([0.0, 0.0, 6.0, 0.0, 1.0, 1.0]).apply(2.0), 2.0);
        let pairs = vec![[0.0, 0.0], [2.0, 10.0], [3.0, 0.0]];
        let of = |lines: bool| Conversion::Pairs { pairs: pairs.clone(), lines };
        assert_eq!([-1.0, 0.5, 2.0, 2.5, 9.0].map(|x| of(true).apply(x)), [0.0, 2.5, 10.0, 5.0, 0.0]);
        assert_eq!([-1.0, 0.5, 1.5, 2.9, 9.0].map(|x| of(false).apply(x)), [0.0, 0.0, 10.0, 0.0, 0.0]);
        assert_eq!(Conversion::Pairs { pairs: vec![[1.0, 7.0]], lines: true }.apply(5.0), 7.0);
        let ranges = Conversion::Ranges(vec![[0.0, 1.0, 5.0], [2.0, 3.0, 6.0]], -1.0);
        assert_eq!([0.5, 3.0, 1.5].map(|x| ranges.apply(x)), [5.0, 6.0, -1.0]);
    }
}
