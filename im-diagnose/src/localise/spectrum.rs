//! Errors over frequency, in the steadiest stretch there is, with the lines that have a name.

use std::f64::consts::TAU;

use im_model::Complex;
use realfft::RealFftPlanner;
use serde::Serialize;

use super::correlate::direction;
use super::{Quantity, Run, Signals, join, say};
use crate::statistics::median;

/// A line with a name.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line {
    /// What it would be.
    pub name: String,
    /// Where, Hz.
    pub frequency_hz: f64,
    /// Amplitude there, in the quantity's unit.
    pub amplitude: f64,
    /// Amplitude over that of the surroundings.
    pub prominence: f64,
}

/// Amplitudes of an error over frequency. The current error is seen from the rotating flux, so that the supply itself stands at zero,
/// a sensor offset at once, an unbalance at twice and dead time at six times the supply frequency.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Spectrum {
    /// Which error.
    pub quantity: Quantity,
    /// Name of the run.
    pub run: String,
    /// The stretch, s.
    pub window_s: [f64; 2],
    /// Frequency in Hz, amplitude in the quantity's unit.
    pub points: Vec<[f64; 2]>,
    /// Lines with a name.
    pub lines: Vec<Line>,
    /// Mean supply frequency in the stretch, Hz.
    pub supply_hz: f64,
    /// How far it strays, Hz.
    pub spread_hz: f64,
    /// One sentence.
    pub conclusion: String,
    /// How telling.
    pub strength: f64,
}

/// Lines this many times above their surroundings stand out.
const STANDS_OUT: f64 = 5.0;

#[derive(Clone, Copy)]
struct Stretch<'a> {
    run: &'a Run,
    from: usize,
    len: usize,
    supply_hz: f64,
    spread_hz: f64,
    rotor_hz: f64,
    slip_hz: f64,
}

pub(super) fn spectra(own: [&Signals; 2]) -> Vec<Spectrum> {
    let first = steadiest(own[0]);
    // Most often all channels have the same rows.
    let second = if std::ptr::eq(own[0], own[1]) { first } else { steadiest(own[1]) };
    let all = Quantity::ALL.into_iter().zip(own).zip([first, second]);
    all.filter_map(|((q, s), stretch)| spectrum(s, q, &stretch?)).collect()
}

/// Supply frequency over blocks: how fast the flux turns.
fn supply(run: &Run, from: usize, to: usize) -> f64 {
    let mut turned = 0.0;
    for w in run.rows[from..to].windows(2) {
        let z = w[1].flux * w[0].flux.conj();
        if z.norm() > 1e-12 {
            turned += z.arg();
        }
    }
    turned / (TAU * (to - from - 1) as f64 * run.sample_time_s)
}

fn steadiest(s: &Signals) -> Option<Stretch<'_>> {
    let mut best: Option<(f64, Stretch)> = None;
    for run in &s.runs {
        let second = (1.0 / run.sample_time_s) as usize;
        let wanted = second.min(run.rows.len() / 2).min(1 << 16);
        if wanted < 256 {
            continue;
        }
        let len = 1 << wanted.ilog2();
        let block = len / 8;
        let mut from = 0;
        while from + len <= run.rows.len() {
            let parts: Vec<f64> = (0..8).map(|k| supply(run, from + k * block, from + (k + 1) * block)).collect();
            let mean = parts.iter().sum::<f64>() / 8.0;
            let spread = (parts.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 8.0).sqrt();
            let rows = &run.rows[from..from + len];
            let average = |f: fn(&super::Row) -> f64| rows.iter().map(f).sum::<f64>() / len as f64;
            let power = rows.iter().filter_map(|r| Quantity::Current.squared(r)).sum::<f64>() / len as f64;
            let resolution = 1.0 / (len as f64 * run.sample_time_s);
            // Steady first; of the steady ones that turn, the one with the larger error.
            let unsteady = (spread / resolution).max(1.0) * if mean.abs() < 4.0 * resolution { 20.0 } else { 1.0 };
            let merit = power.max(1e-300).ln() - 4.0 * unsteady.ln();
            if best.as_ref().is_none_or(|b| merit > b.0) {
                let stretch = Stretch {
                    run,
                    from,
                    len,
                    supply_hz: mean.abs(),
                    spread_hz: spread,
                    rotor_hz: average(|r| r.speed).abs() / TAU,
                    slip_hz: average(|r| r.slip_hz).abs(),
                };
                best = Some((merit, stretch));
            }
            from += len / 4;
        }
    }
    best.map(|b| b.1)
}

/// Hann-windowed amplitudes of a real signal.
fn amplitudes(x: impl Iterator<Item = f64>, len: usize) -> Option<Vec<f64>> {
    let plan = RealFftPlanner::<f64>::new().plan_fft_forward(len);
    let mut input: Vec<f64> = x.collect();
    let mean = input.iter().sum::<f64>() / len as f64;
    for (k, v) in input.iter_mut().enumerate() {
        *v = (*v - mean) * 0.5 * (1.0 - (TAU * k as f64 / len as f64).cos());
    }
    let mut out = plan.make_output_vec();
    plan.process(&mut input, &mut out).ok()?;
    // Amplitude of a sine: 2/N over the window's mean of a half.
    Some(out.iter().map(|z| 4.0 * z.norm() / len as f64).collect())
}

fn spectrum(s: &Signals, q: Quantity, at: &Stretch) -> Option<Spectrum> {
    let rows = &at.run.rows[at.from..at.from + at.len];
    let error: Vec<Complex<f64>> = rows
        .iter()
        .map(|r| match q {
            Quantity::Current => r.current_error.map(|e| e * direction(r)),
            Quantity::Speed => r.speed_error.map(|e| Complex::new(e, 0.0)),
        })
        .map(Option::unwrap_or_default)
        .collect();
    if error.iter().all(|e| e.norm_sqr() == 0.0) {
        return None;
    }
    let d = amplitudes(error.iter().map(|e| e.re), at.len)?;
    let q_axis = amplitudes(error.iter().map(|e| e.im), at.len)?;
    let all: Vec<f64> = d.iter().zip(&q_axis).map(|(a, b)| a.hypot(*b)).collect();
    let step = 1.0 / (at.len as f64 * at.run.sample_time_s);
    let highest = (f64::max(60.0 * at.supply_hz.max(at.rotor_hz), 300.0).min(3000.0) / step).min((all.len() - 1) as f64) as usize;
    let points: Vec<[f64; 2]> = all[..=highest].iter().enumerate().skip(1).map(|(k, a)| [k as f64 * step, *a]).collect();

    // Of half an octave around, so that a line that the speed has drawn out is not its own background.
    let background = |k: usize| {
        let around = 24 + k / 2;
        let (a, b) = (k.saturating_sub(around).max(1), (k + around).min(all.len()));
        let mut near: Vec<f64> = all[a..b].to_vec();
        median(&mut near).max(1e-300)
    };
    let peak_near = |f: f64, spread: f64| {
        let reach = 1.5 * step + spread;
        let (a, b) = (((f - reach) / step).floor().max(1.0) as usize, ((f + reach) / step).ceil() as usize);
        (a..=b.min(all.len() - 1)).max_by(|&x, &y| all[x].total_cmp(&all[y]))
    };
    let (f, m, slip) = (at.supply_hz, at.rotor_hz, at.slip_hz);
    let mut named: Vec<(String, f64, f64)> = vec![
        ("supply".into(), f, at.spread_hz),
        ("2 × supply".into(), 2.0 * f, 2.0 * at.spread_hz),
        ("6 × supply".into(), 6.0 * f, 6.0 * at.spread_hz),
        ("12 × supply".into(), 12.0 * f, 12.0 * at.spread_hz),
        ("slip".into(), slip, at.spread_hz),
        ("2 × slip".into(), 2.0 * slip, 2.0 * at.spread_hz),
        ("rotor".into(), m, at.spread_hz),
        ("2 × rotor".into(), 2.0 * m, 2.0 * at.spread_hz),
    ];
    named.retain(|(_, f, _)| *f > 2.0 * step && *f < highest as f64 * step);
    // A peak has the name that is nearest to it.
    let peaks: Vec<Option<usize>> = named.iter().map(|(_, f, spread)| peak_near(*f, *spread)).collect();
    let away = |k: usize, n: usize| (k as f64 * step - named[n].1).abs() / (step + named[n].2);
    let nearest = |k: usize, n: usize| (0..named.len()).all(|o| peaks[o] != Some(k) || away(k, n) <= away(k, o));
    let lines: Vec<Line> = named
        .iter()
        .enumerate()
        .filter_map(|(n, (name, f, spread))| {
            let k = peaks[n].filter(|&k| nearest(k, n))?;
            // On the flank of another peak there is no line.
            let around = peak_near(*f, 4.0 * (1.5 * step + *spread)).map_or(0.0, |j| all[j]);
            let prominence = if around > 1.5 * all[k] { all[k] / around } else { all[k] / background(k) };
            Some(Line { name: name.clone(), frequency_hz: *f, amplitude: all[k], prominence })
        })
        .collect();
    // A peak that none of the names explains, with its order.
    let unnamed = (8..=highest)
        .filter(|&k| {
            let here = k as f64 * step;
            let named = |l: &Line| l.prominence > STANDS_OUT && (here - l.frequency_hz).abs() < 3.0 * step + 6.0 * at.spread_hz;
            !lines.iter().any(named) && all[k] >= all[k - 1] && all.get(k + 1).is_none_or(|a| all[k] >= *a)
        })
        .map(|k| (k, all[k] / background(k)))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .filter(|p| p.1 > 2.0 * STANDS_OUT);

    let noise = q.noise(s);
    // A sine hidden in white noise of σ has an amplitude of about 3σ·√(2·1.5/N) by chance.
    let by_chance = 3.0 * noise * (6.0 / at.len as f64).sqrt();
    let mut stand: Vec<&Line> = lines.iter().filter(|l| l.prominence > STANDS_OUT && l.amplitude > by_chance).collect();
    stand.sort_by(|a, b| b.amplitude.total_cmp(&a.amplitude));
    let unit = q.unit();
    let mut words: Vec<String> = stand
        .iter()
        .take(3)
        .map(|l| format!("at {} Hz ({}, {} {unit})", say(l.frequency_hz), l.name, say(l.amplitude)))
        .collect();
    let mut strength = stand.first().map_or(0.0, |l| 0.25 * l.prominence.ln());
    if let Some((k, prominence)) = unnamed.filter(|p| all[p.0] > by_chance) {
        let here = k as f64 * step;
        let mut orders = Vec::new();
        if f > 0.5 {
            orders.push(format!("{} × supply", say(here / f)));
        }
        if m > 0.5 {
            orders.push(format!("{} × rotor", say(here / m)));
        }
        let orders = if orders.is_empty() { String::new() } else { format!(", {}", orders.join(", ")) };
        let word = format!("at {} Hz ({} {unit}{orders})", say(here), say(all[k]));
        let place = stand.iter().take(3).filter(|l| l.amplitude >= all[k]).count();
        words.insert(place, word);
        strength = f64::max(strength, 0.25 * prominence.ln());
    }
    let seen = match q {
        Quantity::Current => "the current error, seen from the flux,",
        Quantity::Speed => "the speed error",
    };
    let conclusion = if words.is_empty() {
        format!("{seen} has no line that stands out of its surroundings")
    } else {
        format!("{seen} stands out {}", join(&words))
    };
    let t = |k: usize| k as f64 * at.run.sample_time_s;
    Some(Spectrum {
        quantity: q,
        run: at.run.name.clone(),
        window_s: [t(at.from), t(at.from + at.len)],
        points,
        lines,
        supply_hz: f,
        spread_hz: at.spread_hz,
        conclusion,
        strength,
    })
}
