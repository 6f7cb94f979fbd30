//! One of N equal parts of much work, for machines that share it.

use std::fmt;
use std::num::NonZeroU64;
use std::str::FromStr;

/// One of N equal parts of a campaign or a fleet; `k/N` as text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 1.
    pub part: u64,
    /// How many there are.
    pub of: NonZeroU64,
}

impl Shard {
    /// All of it.
    pub const WHOLE: Self = Self { part: 1, of: NonZeroU64::MIN };

    /// Whether a piece of the work belongs to it, by the piece's number.
    pub fn has(self, piece: u64) -> bool {
        piece % self.of == self.part - 1
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(s: &str) -> Result<Self, String> {
        let parts = s.split_once('/').and_then(|(k, n)| Some((k.parse().ok()?, n.parse().ok()?)));
        match parts {
            Some((part, of)) if (1..=NonZeroU64::get(of)).contains(&part) => Ok(Self { part, of }),
            _ => Err(format!("`{s}` must be k/N with k from 1 to N, such as 2/4")),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.part, self.of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_parts_of_a_whole_are_shards() {
        for bad in ["0/4", "5/4", "1", "1/0", "a/b", "-1/3", ""] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
        let shard = Shard { part: 2, of: NonZeroU64::new(4).unwrap() };
        assert_eq!("2/4".parse(), Ok(shard));
        assert_eq!(shard.to_string(), "2/4");
    }
}
