//! When a switch closed between two samples, by what the currents do then.
//!
//! A start carries what the mean voltage of one row is off by, half of 327 V for 0.1 ms, as a field that stands still, for as long as the rotor's time
//! constant. What it does is known to first order only, and in a field that is a few per cent off the second order is seen.

use im_identify::offline::{ChannelKind, Experiment, predict};
use im_model::{Machine, State};

/// Moves the mean voltage of each row in which something was switched to what the current changes by, over what a fitted machine makes of it in `run`, the
/// same recording as it was fitted. It stays as unsure as it was: that change is no better known than the machine's leakage.
pub fn settle(e: &mut Experiment, machine: &Machine<f64>, (run, start): (&Experiment, &State<f64>)) {
    if e.voltage_noise.volts.switched.is_empty() {
        return;
    }
    let modelled = predict(machine, run, start);
    let of_row = |k: usize| run.current_vector(k, |c| run.channels[c].values[k] - modelled[c][k]);
    let left = |k: usize| if k < run.len() { of_row(k) } else { None };
    let volts_per_amp = machine.parameters().inverse_gamma().leakage_inductance_h / run.sample_time_s;
    let currents = run.channels.iter().filter(|c| matches!(c.kind, ChannelKind::Current { .. }));
    let sigma_a = currents.map(|c| c.sigma).fold(0.0, f64::max);
    // A difference of two readings.
    let noise_v2 = 2.0 * (volts_per_amp * sigma_a).powi(2);
    for (row, sigma_v) in &e.voltage_noise.volts.switched {
        let change = left(*row).zip(left(row + 1)).map(|(before, after)| after - before);
        if let Some(change) = change.filter(|i| i.is_finite()) {
            e.u_s[*row] += change * volts_per_amp * (sigma_v * sigma_v / (sigma_v * sigma_v + noise_v2));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_identify::offline::{VoltageNoise, Volts};
    use im_model::machines::MOTULATOR_2_2_KW as M;
    use im_model::{Complex, Recording};

    /// Whenever in its row a switch closed.
    #[test]
    fn a_switch_closes_where_the_currents_say() {
        let machine = Machine::base(M.parameters(), M.pole_pairs).unwrap();
        let (rows, t, row) = (400, 1e-4, 50);
        let mains = |k: usize| Complex::from_polar(326.0, 314.16 * t * k as f64);
        for part in [0.0, 0.3, 1.0] {
            let u_s =
                |part: f64| (0..rows).map(|k| mains(k) * if k == row { part } else { f64::from(u8::from(k > row)) }).collect();
            let r = Recording {
                name: "start".into(),
                start_s: 0.0,
                sample_time_s: t,
                u_s: u_s(part),
                i_s: vec![Complex::from(0.0); rows],
                omega_m: vec![0.0; rows],
                tau_load: Some(vec![0.0; rows]),
            };
            let mut e = Experiment::from_recording(&r, [0.02; 2], 0.1);
            let start = State::default();
            let all = predict(&machine, &e, &start);
            e.channels.iter_mut().zip(all).for_each(|(c, y)| c.values = y);
            e.u_s = u_s(0.5);
            e.voltage_noise = VoltageNoise::of(Volts { switched: vec![(row, 94.0), (rows - 1, 94.0)], ..Volts::default() });
            let run = e.clone();
            settle(&mut e, &machine, (&run, &start));
            let off = (e.u_s[row] - mains(row) * part).norm();
            assert!(off < 5.0, "{part}: {off}");
            assert_eq!((e.u_s[row + 1], e.u_s[rows - 1]), (run.u_s[row + 1], run.u_s[rows - 1]));
        }
    }
}
