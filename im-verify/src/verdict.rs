//! What a claim says of a case.

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
        Self::Violated { margin: margin.max(-1e300), why: format!("{what}: {is:.6e}, allowed {allowed:.6e}") }
    }

    /// is ≥ needed, both positive.
    pub fn at_least(what: &str, is: f64, needed: f64) -> Self {
        let margin = (is / needed - 1.0).clamp(-1e300, 1e300);
        if margin >= 0.0 {
            return Self::Holds { margin };
        }
        Self::Violated { margin: margin.max(-1e300), why: format!("{what}: {is:.6e}, needed {needed:.6e}") }
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
