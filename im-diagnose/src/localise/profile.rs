//! Errors over one quantity: flux, current, speed, slip.

use serde::Serialize;

use super::{Quantity, Row, Signals, join, say, stays};

/// Over what.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ProfileOver {
    /// Magnitude of the magnetizing flux linkage, Vs.
    Flux,
    /// Magnitude of the stator current, A.
    CurrentMagnitude,
    /// Magnitude of the speed, rad/s.
    Speed,
    /// Magnitude of the slip frequency, Hz.
    Slip,
}

impl ProfileOver {
    /// All.
    pub const ALL: [Self; 4] = [Self::Flux, Self::CurrentMagnitude, Self::Speed, Self::Slip];

    /// Name in sentences.
    pub fn name(self) -> &'static str {
        match self {
            Self::Flux => "flux",
            Self::CurrentMagnitude => "current",
            Self::Speed => "speed",
            Self::Slip => "slip frequency",
        }
    }

    /// Unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Flux => "Vs",
            Self::CurrentMagnitude => "A",
            Self::Speed => "rad/s",
            Self::Slip => "Hz",
        }
    }

    pub(crate) fn of(self, r: &Row) -> f64 {
        match self {
            Self::Flux => r.flux.norm(),
            Self::CurrentMagnitude => r.current.norm(),
            Self::Speed => r.speed.abs(),
            Self::Slip => r.slip_hz.abs(),
        }
    }

    /// What is held against it: whether the finding holds at every value of this.
    fn other(self) -> Self {
        match self {
            Self::Flux | Self::CurrentMagnitude | Self::Slip => Self::Speed,
            Self::Speed => Self::Flux,
        }
    }
}

/// Rows that share a value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bin {
    /// Mean value.
    pub at: f64,
    /// Root mean square error, in the quantity's unit.
    pub rms: f64,
    /// Rows.
    pub count: usize,
}

/// An error over one quantity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Profile {
    /// Which error.
    pub quantity: Quantity,
    /// Over what.
    pub over: ProfileOver,
    /// Bins of equally many rows.
    pub bins: Vec<Bin>,
    /// The noise level, in the quantity's unit.
    pub noise: f64,
    /// One sentence.
    pub conclusion: String,
    /// How telling: zero where there is only noise, or where there is no trend.
    pub strength: f64,
}

const BINS: usize = 16;

pub(super) fn profiles(s: &Signals) -> Vec<Profile> {
    Quantity::ALL.into_iter().flat_map(|q| ProfileOver::ALL.into_iter().filter_map(move |o| profile(s, q, o))).collect()
}

fn binned(mut rows: Vec<(f64, f64)>, bins: usize) -> Vec<Bin> {
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let n = rows.len();
    (0..bins)
        .filter_map(|k| {
            let part = &rows[k * n / bins..(k + 1) * n / bins];
            (part.len() >= 10).then(|| Bin {
                at: part.iter().map(|p| p.0).sum::<f64>() / part.len() as f64,
                rms: (part.iter().map(|p| p.1).sum::<f64>() / part.len() as f64).sqrt(),
                count: part.len(),
            })
        })
        .collect()
}

/// What a row of bins does.
enum Trend {
    Floor,
    Flat,
    /// Larger from this bin on.
    Grows(usize),
    /// Larger in the bins before this one.
    Falls(usize),
    /// Largest around this value.
    Peak(f64),
}

fn mean(x: &[Bin]) -> f64 {
    (x.iter().map(|b| b.rms * b.rms).sum::<f64>() / x.len().max(1) as f64).sqrt()
}

fn trend(bins: &[Bin], noise: f64) -> Trend {
    let least = bins.iter().map(|b| b.rms).fold(f64::INFINITY, f64::min);
    let Some(top) = bins.iter().max_by(|a, b| a.rms.total_cmp(&b.rms)) else { return Trend::Flat };
    if top.rms < 1.15 * noise {
        return Trend::Floor;
    }
    if top.rms < 1.5 * least {
        return Trend::Flat;
    }
    let n = bins.len();
    // The longest end of which every bin is clearly above all that comes before (or after) it, and the last one near its largest.
    let clear = |end: &[Bin], outermost: &Bin, rest: &[Bin]| {
        let usual = mean(rest);
        let most = end.iter().map(|b| b.rms).fold(0.0, f64::max);
        let stays = 1.5 * outermost.rms > most;
        (stays && most > 1.5 * usual && end.iter().all(|b| b.rms > 1.25 * usual)).then_some(most / usual)
    };
    let up = (1..n).find_map(|k| clear(&bins[k..], &bins[n - 1], &bins[..k]).map(|r| (k, r)));
    let down = (1..n).rev().find_map(|k| clear(&bins[..k], &bins[0], &bins[k..]).map(|r| (k, r)));
    match (up, down) {
        (Some((k, a)), d) if d.is_none_or(|d| a >= d.1) => Trend::Grows(k),
        (_, Some((k, _))) => Trend::Falls(k),
        _ => Trend::Peak(top.at),
    }
}

fn profile(s: &Signals, q: Quantity, over: ProfileOver) -> Option<Profile> {
    let noise = q.noise(s);
    let rows: Vec<(f64, f64, f64)> = s.rows().filter_map(|r| q.squared(r).map(|e| (over.of(r), e, over.other().of(r)))).collect();
    if rows.len() < 20 * BINS {
        return None;
    }
    let bins = binned(rows.iter().map(|r| (r.0, r.1)).collect(), BINS);
    let (first, last) = (bins.first()?, bins.last()?);
    if stays(first.at, last.at) {
        return None;
    }
    let (name, unit, on, on_unit) = (q.name(), q.unit(), over.name(), over.unit());
    let least = bins.iter().map(|b| b.rms).fold(f64::INFINITY, f64::min);
    let most = bins.iter().map(|b| b.rms).fold(0.0, f64::max);
    let trend = trend(&bins, noise);
    let everywhere = |at: f64, grows: bool| held(&rows, at, grows, over.other());
    let (mut strength, conclusion) = match trend {
        Trend::Floor => (0.0, format!("the {name} error is that of the noise ({} {unit}) at every {on}", say(noise))),
        Trend::Flat => (0.0, format!("the {name} error does not depend on {on} ({} to {} {unit})", say(least), say(most))),
        Trend::Grows(k) => (
            1.0,
            format!(
                "the {name} error is larger at {on} above {} {on_unit}, {} {unit} rms against {} {unit} below{}",
                say(bins[k].at),
                say(mean(&bins[k..])),
                say(mean(&bins[..k])),
                everywhere(bins[k].at, true)
            ),
        ),
        Trend::Falls(k) => (
            1.0,
            format!(
                "the {name} error is larger at {on} below {} {on_unit}, {} {unit} rms against {} {unit} above{}",
                say(bins[k - 1].at),
                say(mean(&bins[..k])),
                say(mean(&bins[k..])),
                everywhere(bins[k - 1].at, false)
            ),
        ),
        Trend::Peak(at) => (
            0.5,
            format!(
                "the {name} error is largest around {on} {} {on_unit} ({} {unit}, least {} {unit})",
                say(at),
                say(most),
                say(least)
            ),
        ),
    };
    strength *= (most / least.max(0.5 * noise)).ln();
    Some(Profile { quantity: q, over, bins, noise, conclusion, strength })
}

/// Whether the step at `at` is there in each third of the other quantity: ", at every speed" or ", at low speed".
fn held(rows: &[(f64, f64, f64)], at: f64, grows: bool, other: ProfileOver) -> String {
    let mut values: Vec<f64> = rows.iter().map(|r| r.2).collect();
    values.sort_by(f64::total_cmp);
    let edge = |p: f64| values[((values.len() - 1) as f64 * p) as usize];
    let edges = [f64::NEG_INFINITY, edge(1.0 / 3.0), edge(2.0 / 3.0), f64::INFINITY];
    let mut seen = Vec::new();
    for (k, word) in ["low", "middle", "high"].iter().enumerate() {
        let mut sums = [[0.0; 2]; 2];
        for r in rows.iter().filter(|r| r.2 > edges[k] && r.2 <= edges[k + 1]) {
            let side = &mut sums[usize::from(r.0 >= at)];
            side[0] += 1.0;
            side[1] += r.1;
        }
        if sums.iter().all(|x| x[0] >= 30.0) {
            let ratio = (sums[1][1] / sums[1][0]) / (sums[0][1] / sums[0][0]).max(1e-300);
            seen.push((*word, if grows { ratio > 1.5 } else { ratio < 1.0 / 1.5 }));
        }
    }
    let yes: Vec<String> = seen.iter().filter(|s| s.1).map(|s| s.0.to_owned()).collect();
    match (seen.len(), yes.len()) {
        (0 | 1, _) => String::new(),
        (_, 0) => String::new(),
        (a, b) if a == b && a == 3 => format!(", at every {}", other.name()),
        _ => format!(", at {} {}", join(&yes), other.name()),
    }
}
