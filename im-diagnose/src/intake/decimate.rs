//! Recordings longer than a fit can use: fewer rows, with the same volt-seconds.

use im_identify::offline::{Experiment, VoltageNoise};
use im_model::Complex;

use super::finding::{Finding, FindingKind, Severity};

/// More rows are not kept: a fit of twenty parameters then holds half a gigabyte.
pub const MOST_ROWS: usize = 1_000_000;
/// Rows per period of the rated frequency that remain at least.
const PER_PERIOD: f64 = 40.0;

/// Keeps one row in several of a long recording, the voltage averaged over the rows between, and its first [`MOST_ROWS`] at most.
pub fn decimate(e: &mut Experiment, rated_frequency_hz: f64) -> Option<Finding> {
    let n = e.len();
    if n <= MOST_ROWS {
        return None;
    }
    let allowed = (1.0 / (PER_PERIOD * rated_frequency_hz * e.sample_time_s)).floor().max(1.0) as usize;
    let factor = n.div_ceil(MOST_ROWS).min(allowed);
    let kept = (n / factor).min(MOST_ROWS);
    let pick = |x: &[f64]| (0..kept).map(|k| x[k * factor]).collect::<Vec<f64>>();
    let mean = |k: usize| e.u_s[k * factor..(k + 1) * factor].iter().sum::<Complex<f64>>() / factor as f64;
    e.u_s = (0..kept).map(mean).collect();
    e.voltage_noise = VoltageNoise::of(e.voltage_noise.volts.every(factor));
    // A torque in between acts too.
    e.tau_load = (0..kept).map(|k| e.tau_load[k * factor..(k + 1) * factor].iter().sum::<f64>() / factor as f64).collect();
    e.imposed_speed = e.imposed_speed.as_deref().map(pick);
    for c in &mut e.channels {
        c.values = pick(&c.values);
        c.valid = c.valid.as_ref().map(|v| (0..kept).map(|k| v[k * factor]).collect());
    }
    e.sample_time_s *= factor as f64;
    let used = kept as f64 * e.sample_time_s;
    let every = if factor > 1 {
        format!("one row in {factor} of {n} is used, the voltage averaged in between")
    } else {
        format!("{n} rows are many")
    };
    let (text, advice) = if kept * factor + factor <= n {
        (
            format!("The recording is long: {every}; of these the first {kept}, {used:.0} s"),
            "Choose the part to use by from_s and to_s in [time].",
        )
    } else {
        (format!("The recording is long: {every}"), "")
    };
    Some(Finding::new(FindingKind::Decimated, Severity::Note, text, advice))
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_identify::offline::{Channel, ChannelKind, Load, Start};

    #[test]
    fn a_long_recording_keeps_its_volt_seconds_and_its_samples() {
        let n = 3 * MOST_ROWS;
        let ramp = |k: usize| k as f64;
        let mut e = Experiment {
            name: "long".into(),
            sample_time_s: 1e-4,
            supply_frequency_hz: None,
            u_s: (0..n).map(|k| Complex::new(ramp(k), 0.0)).collect(),
            is_smooth: false,
            voltage_noise: Default::default(),
            tau_load: vec![1.0; n],
            load: Load::Known,
            imposed_speed: None,
            speed_nudge: None,
            warmth: Vec::new(),
            inert: None,
            nudge_part: 1.0,
            channels: vec![Channel {
                name: "omega_m_rad_s".into(),
                kind: ChannelKind::Speed,
                values: (0..n).map(ramp).collect(),
                valid: None,
                sigma: 1.0,
            }],
            start: Start::Rest,
        };
        let finding = decimate(&mut e, 50.0).unwrap();
        assert!(e.len() == MOST_ROWS && (e.sample_time_s - 3e-4).abs() < 1e-12);
        assert_eq!((e.u_s[10].re, e.channels[0].values[10], e.tau_load[10]), (31.0, 30.0, 1.0));
        assert!(finding.sentence.contains("one row in 3") && finding.advice.is_empty(), "{finding:?}");
        // Forty rows per period remain: at 1 kHz rated nothing may be passed over, and the first million is taken.
        e = Experiment { sample_time_s: 1e-4, u_s: vec![Complex::new(1.0, 0.0); n], tau_load: vec![0.0; n], ..e };
        e.channels[0].values = vec![0.0; n];
        assert!(decimate(&mut e, 1000.0).unwrap().advice.contains("from_s"));
        assert_eq!(e.len(), MOST_ROWS);
    }
}
