//! Errors in step with other signals, and with themselves a little later.

use im_model::Complex;
use serde::Serialize;

use super::{Quantity, Row, Signals, join, say};

/// How long an error lasts: its autocorrelation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Memory {
    /// Which error.
    pub quantity: Quantity,
    /// Lag in s, correlation coefficient.
    pub points: Vec<[f64; 2]>,
    /// Coefficients within ± this happen by chance in 95 of 100 cases.
    pub chance: f64,
    /// One sentence.
    pub conclusion: String,
}

/// Correlation coefficients of errors with signals.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Correlations {
    /// Signals, with unit.
    pub signals: Vec<&'static str>,
    /// Errors, with unit.
    pub errors: Vec<&'static str>,
    /// One line per error, one coefficient per signal; not a number where a signal never changes.
    pub coefficients: Vec<Vec<f64>>,
    /// Whether an error goes along with a signal.
    pub strong: bool,
    /// One sentence.
    pub conclusion: String,
}

/// The largest of hundreds of coefficients lies within so many times the band of one: 3.5 standard deviations.
const OF_MANY: f64 = 1.75;

/// Most products worth spending on one autocorrelation.
const PRODUCTS: usize = 100_000_000;

pub(super) fn memory(own: [&Signals; 2]) -> Vec<Memory> {
    Quantity::ALL.into_iter().zip(own).filter_map(|(q, s)| one_memory(s, q)).collect()
}

/// The error of a row as a vector: the current in the frame of the flux.
fn error(q: Quantity, r: &Row) -> Complex<f64> {
    match q {
        Quantity::Current => r.current_error.unwrap_or_default() * direction(r),
        Quantity::Speed => Complex::new(r.speed_error.unwrap_or(0.0), 0.0),
    }
}

/// e^{−jθ} of the magnetizing flux.
pub(super) fn direction(r: &Row) -> Complex<f64> {
    let n = r.flux.norm();
    if n > 1e-6 { r.flux.conj() / n } else { Complex::new(1.0, 0.0) }
}

/// Rows of the longest lag that is looked at: 50 ms, or a fifth of the longest run.
pub(super) fn longest_lag(sample_s: f64, longest: usize) -> usize {
    ((0.05 / sample_s).round() as usize).min(longest / 5).max(1)
}

fn one_memory(s: &Signals, q: Quantity) -> Option<Memory> {
    let sample = s.runs.first()?.sample_time_s;
    let longest = s.runs.iter().map(|r| r.rows.len()).max()?;
    let reach = longest_lag(sample, longest);
    let total: usize = s.runs.iter().map(|r| r.rows.len()).sum();
    // Every lag, or else an oscillation could hide between those looked at.
    let stride = (total * reach).div_ceil(PRODUCTS).max(1);
    let runs: Vec<Vec<Complex<f64>>> = s.runs.iter().map(|r| r.rows.iter().map(|x| error(q, x)).collect()).collect();
    let power: f64 = runs.iter().flatten().map(|e| e.norm_sqr()).sum();
    if power <= 0.0 {
        return None;
    }
    let points: Vec<[f64; 2]> = (0..=reach / stride)
        .map(|k| k * stride)
        .map(|lag| {
            let sum: f64 =
                runs.iter().map(|r| r.iter().zip(r.iter().skip(lag)).map(|(a, b)| a.re * b.re + a.im * b.im).sum::<f64>()).sum();
            [lag as f64 * sample, sum / power]
        })
        .collect();
    let n: usize = runs.iter().map(Vec::len).sum();
    let chance = 2.0 / (n as f64).sqrt();
    let strongest = points.iter().skip(1).map(|p| p[1].abs()).fold(0.0, f64::max);
    let last = points.iter().skip(1).rev().find(|p| p[1].abs() > (-1.0f64).exp()).map(|p| p[0]);
    let name = q.name();
    let conclusion = match last {
        _ if strongest < OF_MANY * chance => format!("the {name} error is new in every row, as sensor noise is"),
        None => format!("the {name} error is mostly sensor noise, with a trace of something that lasts"),
        Some(t) if t > 0.95 * reach as f64 * sample => {
            format!("the {name} error lasts longer than {} ms, so it is not sensor noise", say(reach as f64 * sample * 1e3))
        }
        Some(t) => format!("the {name} error lasts {} ms, so it is not sensor noise", say(t * 1e3)),
    };
    Some(Memory { quantity: q, points, chance, conclusion })
}

/// What a signal is at a row and a time.
type Signal = fn(&Row, f64) -> f64;
/// What an error is at a row, where there is one.
type Error = fn(&Row) -> Option<f64>;

const SIGNALS: [(&str, Signal); 8] = [
    ("voltage, V", |r, _| r.voltage.norm()),
    ("flux, Vs", |r, _| r.flux.norm()),
    ("current, A", |r, _| r.current.norm()),
    ("air-gap torque, Nm", |r, _| r.torque),
    ("load torque, Nm", |r, _| r.load),
    ("speed, rad/s", |r, _| r.speed),
    ("slip frequency, Hz", |r, _| r.slip_hz),
    ("time, s", |_, t| t),
];

pub(super) fn correlations(s: &Signals) -> Correlations {
    let errors: [(&'static str, Error); 3] = [
        ("current along the flux, A", |r| r.current_error.map(|e| (e * direction(r)).re)),
        ("current across the flux, A", |r| r.current_error.map(|e| (e * direction(r)).im)),
        ("speed, rad/s", |r| r.speed_error),
    ];
    let mut coefficients = Vec::new();
    let mut strong: Vec<(f64, String)> = Vec::new();
    for (name, error) in errors {
        let line: Vec<f64> = SIGNALS
            .iter()
            .map(|(_, signal)| {
                let mut m = [0.0; 6];
                for run in &s.runs {
                    for (k, r) in run.rows.iter().enumerate() {
                        let Some(e) = error(r) else { continue };
                        let x = signal(r, k as f64 * run.sample_time_s);
                        for (sum, v) in m.iter_mut().zip([1.0, x, e, x * x, e * e, x * e]) {
                            *sum += v;
                        }
                    }
                }
                let [n, x, e, xx, ee, xe] = m;
                let (vx, ve) = (xx - x * x / n, ee - e * e / n);
                if vx > 1e-9 * xx && ve > 0.0 { (xe - x * e / n) / (vx * ve).sqrt() } else { f64::NAN }
            })
            .collect();
        for (c, (signal, _)) in line.iter().zip(SIGNALS) {
            if c.abs() > 0.3 {
                let bare = |s: &str| s.split(',').next().unwrap_or(s).to_owned();
                strong.push((c.abs(), format!("the error in {} goes with {} ({})", bare(name), bare(signal), say(*c))));
            }
        }
        coefficients.push(line);
    }
    strong.sort_by(|a, b| b.0.total_cmp(&a.0));
    let any = !strong.is_empty();
    let conclusion = if strong.is_empty() {
        "no error goes along with any one signal (all coefficients below 0.3)".to_owned()
    } else {
        join(&strong.into_iter().take(3).map(|s| s.1).collect::<Vec<_>>())
    };
    Correlations {
        signals: SIGNALS.map(|s| s.0).to_vec(),
        errors: errors.map(|e| e.0).to_vec(),
        coefficients,
        strong: any,
        conclusion,
    }
}
