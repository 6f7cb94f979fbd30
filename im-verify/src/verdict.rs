//! What a claim says of a case.

/// Six digits, as powers of ten only where plain digits are long.
fn say(x: f64) -> String {
    let plain = (1e-3..1e6).contains(&x.abs()) || x == 0.0;
    if !plain {
        return format!("{x:.5e}");
    }
    let decimals = (5 - x.abs().max(1e-300).log10().floor() as i32).clamp(0, 8) as usize;
    let text = format!("{x:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// The answer of a property.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// It holds. The margin is 1 − (what is)/(what is allowed): 0 is just so, 1 is far.
    Holds {
        /// The margin, from 0.
        margin: f64,
    },
    /// It does not.
    Violated {
        /// The margin, below 0.
        margin: f64,
        /// What was found, in numbers.
        why: String,
    },
    /// An assumption of the claim is not met: the case says nothing.
    Outside,
}

impl Verdict {
    /// |is| ≤ allowed. What is not a number is violated.
    pub fn at_most(what: &str, is: f64, allowed: f64) -> Self {
        let margin = (1.0 - is / allowed).clamp(-1e300, 1e300);
        if margin >= 0.0 {
            return Self::Holds { margin };
        }
        // A number in place of NaN, which files of results cannot hold.
        Self::Violated { margin: margin.max(-1e300), why: format!("{what}: {}, allowed {}", say(is), say(allowed)) }
    }

    /// is ≥ needed, both positive.
    pub fn at_least(what: &str, is: f64, needed: f64) -> Self {
        let margin = (is / needed - 1.0).clamp(-1e300, 1e300);
        if margin >= 0.0 {
            return Self::Holds { margin };
        }
        Self::Violated { margin: margin.max(-1e300), why: format!("{what}: {}, needed {}", say(is), say(needed)) }
    }

    /// Something that could not be set up for a case in range: the claim is not shown to hold there.
    pub fn refused(why: impl std::fmt::Display) -> Self {
        Self::Violated { margin: -1e300, why: format!("cannot be set up: {why}") }
    }

    /// Both: the smaller margin.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        match (self.margin(), other.margin()) {
            (Some(a), Some(b)) if a <= b => self,
            (Some(_), Some(_)) => other,
            _ => Self::Outside,
        }
    }

    /// The margin; none where the case is outside.
    pub fn margin(&self) -> Option<f64> {
        match self {
            Self::Holds { margin } | Self::Violated { margin, .. } => Some(*margin),
            Self::Outside => None,
        }
    }

    /// Whether it is violated.
    pub fn is_violated(&self) -> bool {
        matches!(self, Self::Violated { .. })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_is_violated() {
        for is in [f64::NAN, f64::INFINITY] {
            assert!(Verdict::at_most("x", is, 1.0).is_violated(), "{is}");
        }
        assert!(Verdict::at_least("x", f64::NAN, 1.0).is_violated());
        let both = Verdict::at_most("x", 0.2, 1.0).and(Verdict::at_most("y", 2.0, 1.0));
        assert!(both.is_violated() && both.margin() == Some(-1.0));
        assert_eq!(Verdict::Outside.and(Verdict::Holds { margin: 1.0 }), Verdict::Outside);
    }
}
