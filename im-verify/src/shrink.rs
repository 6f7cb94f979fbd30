//! Makes a failing case simple: every value as near to its simplest as the failure allows, then with few digits. It stays a clear failure:
//! what is over what is allowed exceeds 1 by half of what it did in the case found, so that no counterexample ends at the rounding of a
//! tolerance.

use crate::claim::{Claim, Point};
use crate::subject::{MACHINE, Machines};
use crate::variable::Variable;

/// Bisections towards the simplest value, per value and round.
const BISECTIONS: u32 = 5;

/// What is left of the excess over what is allowed, at least.
const KEPT_EXCESS: f64 = 0.5;

/// The simplest clearly failing case found from a failing one; itself, if it does not fail.
pub fn shrunk(claim: &Claim, point: &Point, machines: &Machines) -> Point {
    let mut left = claim.cost.shrinking();
    let mut best = point.clone();
    // A violated margin is less than zero by the excess.
    let found = claim.verdict(&best, machines);
    let Some(clear) = found.margin().filter(|_| found.is_violated()).map(|margin| KEPT_EXCESS * margin) else { return best };
    let mut fails = |p: &Point| {
        if left == 0 {
            return false;
        }
        left -= 1;
        let verdict = claim.verdict(p, machines);
        verdict.is_violated() && verdict.margin().is_some_and(|margin| margin <= clear)
    };
    let count = if best.machine.is_some() { MACHINE.len() } else { 0 } + best.values.len();
    loop {
        let before = best.clone();
        for k in 0..count {
            let (variable, now) = (variable(claim, &best, k), value(&best, k));
            for candidate in std::iter::once(variable.simple).chain((1..=3).filter_map(|n| rounded(variable, now, n))) {
                if candidate == value(&best, k) || nearer(variable, value(&best, k), candidate) {
                    continue;
                }
                let trial = with(&best, k, candidate);
                if fails(&trial) {
                    best = trial;
                }
            }
            // Between what fails and what is too simple to.
            let mut passes = variable.simple;
            for _ in 0..BISECTIONS {
                let middle = variable.between(value(&best, k), passes);
                let middle = rounded(variable, middle, 3).unwrap_or(middle);
                if middle == value(&best, k) || middle == passes || nearer(variable, value(&best, k), middle) {
                    break;
                }
                let trial = with(&best, k, middle);
                if fails(&trial) {
                    best = trial;
                } else {
                    passes = middle;
                }
            }
        }
        if best == before {
            return best;
        }
    }
}

/// Whether `a` is at least as near to the simplest value as `b`.
fn nearer(v: &Variable, a: f64, b: f64) -> bool {
    // Few digits are worth a hundredth of the range.
    (a - v.simple).abs() + 0.01 * (v.high - v.low) * f64::from(u8::from(digits(a) > digits(b))) <= (b - v.simple).abs()
}

/// Significant digits, up to 6.
fn digits(x: f64) -> usize {
    (1..6).find(|n| format!("{x:.*e}", n - 1).parse::<f64>() == Ok(x)).unwrap_or(6)
}

fn rounded(v: &Variable, x: f64, digits: usize) -> Option<f64> {
    format!("{x:.*e}", digits - 1).parse().ok().filter(|x| v.admits(*x))
}

fn variable<'a>(claim: &'a Claim, p: &Point, k: usize) -> &'a Variable {
    let machine = if p.machine.is_some() { MACHINE.len() } else { 0 };
    // The claim's own values first: they say more than the machine does.
    if k < claim.variables.len() { &claim.variables[k] } else { &MACHINE[(k - claim.variables.len()).min(machine - 1)] }
}

fn value(p: &Point, k: usize) -> f64 {
    match &p.machine {
        Some(m) if k >= p.values.len() => m[k - p.values.len()],
        _ => p.values[k],
    }
}

fn with(p: &Point, k: usize, x: f64) -> Point {
    let mut p = p.clone();
    match &mut p.machine {
        Some(m) if k >= p.values.len() => m[k - p.values.len()] = x,
        _ => p.values[k] = x,
    }
    p
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::claim::{Cost, Found, Origin, Paper};
    use crate::verdict::Verdict;

    /// x² + y² ≤ 1, whatever the machine.
    fn circle() -> Claim {
        const XY: [Variable; 2] = [Variable::even("x", -3.0, 3.0), Variable::even("y", -3.0, 3.0)];
        Claim {
            number: 1,
            name: "circle",
            paper: Paper::Kwon,
            place: "",
            origin: Origin::Says(""),
            statement: "",
            assumptions: "",
            found: Found::Fails { rate: 0.5 },
            finding: "",
            cost: Cost::Equation,
            variables: &XY,
            check: |case| {
                let [x, y] = case.values();
                Verdict::at_most("r", x.hypot(y), 1.0)
            },
        }
    }

    #[test]
    fn a_failing_case_shrinks_to_a_clear_failure_with_the_simplest_machine() {
        let claim = circle();
        let from = Point { machine: Some([12_345.6, 3.0, 0.03, 0.06, 0.07, 3.3, 2.2, 0.5]), values: vec![2.345_67, -1.2345] };
        let to = shrunk(&claim, &from, &Machines::Random);
        assert_eq!(to.machine, Some(MACHINE.map(|v| v.simple)));
        let r = to.values[0].hypot(to.values[1]);
        // √(2.346² + 1.235²) = 2.651: half of the excess is 0.825.
        assert!(r > 1.825 && r < 2.0, "{to:?}");
        assert!(to.values.iter().all(|x| digits(*x) <= 3), "{to:?}");
    }

    #[test]
    fn a_case_that_holds_stays() {
        let inside = Point { machine: Some(MACHINE.map(|v| v.simple)), values: vec![0.1, 0.2] };
        assert_eq!(shrunk(&circle(), &inside, &Machines::Random), inside);
    }
}
