//! What the noise of a measured input does to the outputs.

use im_identify::offline::{ChannelKind, Experiment, residuals};
use im_model::{Machine, State};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;

use crate::noise::white_sigma;
use crate::residuals::change;

/// Draws of the noise: their mean square is right to a fifth.
const DRAWS: u64 = 48;

/// A signal with one draw of noise: σ more or less at every row.
fn with_noise(values: &[f64], sigma: f64, seed: u64) -> Vec<f64> {
    let mut chance = Xoshiro256PlusPlus::seed_from_u64(seed);
    values.iter().map(|x| if chance.random::<bool>() { x + sigma } else { x - sigma }).collect()
}

/// What `seen` makes of the changes of the outputs of one recording, in σ, each under one draw of noise as rough as that of its load torque. The
/// torque moves the speed by what it sums up to, slowly: sample by sample, this looks like anything but noise. Empty where no torque is measured,
/// or without noise.
pub fn torque_noise<R: Send>(
    machine: &Machine<f64>,
    e: &Experiment,
    start: &State<f64>,
    seen: impl Fn(&[Vec<f64>]) -> R + Sync,
) -> Vec<R> {
    let sigma = white_sigma(&e.tau_load);
    if e.is_table() || e.imposed_speed.is_some() || sigma.is_nan() || sigma <= 0.0 {
        return Vec::new();
    }
    let here = residuals(machine, e, start);
    let draw = |seed: u64| {
        let tau_load = with_noise(&e.tau_load, sigma, seed);
        let change = change(&here, &residuals(machine, &Experiment { tau_load, ..e.clone() }, start));
        change.iter().flatten().all(|x| x.is_finite()).then(|| seen(&change))
    };
    (0..DRAWS).into_par_iter().filter_map(draw).collect()
}

/// Mean square of what the noise of the measured speeds does to the currents of machines that are nudged towards them, in σ²: the largest of some
/// recordings. 0 where none is nudged.
pub fn nudge_noise(machine: &Machine<f64>, experiments: &[Experiment], starts: &[State<f64>]) -> f64 {
    let one = |(e, start): (&Experiment, &State<f64>)| {
        let (speed, rate) = e.speed_nudge.as_ref()?;
        let sigma = e.channels.iter().find(|c| c.kind == ChannelKind::Speed)?.sigma;
        let rougher = Experiment { speed_nudge: Some((with_noise(speed, sigma, 0), *rate)), ..e.clone() };
        let change = change(&residuals(machine, e, start), &residuals(machine, &rougher, start));
        let currents = e.channels.iter().zip(&change).filter(|(c, _)| c.kind != ChannelKind::Speed);
        let all: Vec<f64> = currents.flat_map(|(_, x)| x.iter().map(|x| x * x)).filter(|x| x.is_finite()).collect();
        (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
    };
    experiments.par_iter().zip(starts).filter_map(one).reduce(|| 0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_identify::offline::predict;
    use im_model::machines::MOTULATOR_2_2_KW as M;
    use im_model::{BaseParameter, Complex, ParameterId, Recording};

    /// Without current only the shaft moves: a random walk of steps σh/J, forgotten with J/D.
    #[test]
    fn noise_of_the_torque_makes_the_speed_walk() {
        let friction = (ParameterId::Base(BaseParameter::ViscousFriction), 0.05);
        let machine = Machine::base(M.parameters(), M.pole_pairs).unwrap().with(&[friction]).unwrap();
        let (n, h, sigma) = (4000, 1e-4, 2.0);
        let none = vec![Complex::new(0.0, 0.0); n];
        // The fourth difference of a sign that changes at every row is ±16.
        let size = sigma * 70f64.sqrt() / 16.0 * 0.6745;
        let tau = (0..n).map(|k| if k % 2 == 0 { size } else { -size }).collect();
        let r = Recording {
            name: "coasting".into(),
            start_s: 0.0,
            sample_time_s: h,
            u_s: none.clone(),
            i_s: none,
            omega_m: vec![0.0; n],
            tau_load: Some(tau),
        };
        let e = Experiment::from_recording(&r, [1.0, 1.0], 1.0);
        let at = n - 1;
        let changes = torque_noise(&machine, &e, &State::default(), |change| change[2][at]);
        assert_eq!(changes.len(), DRAWS as usize);
        let p = machine.parameters();
        let (step, forgets) = (sigma * h / p.inertia_kg_m2, p.viscous_friction_nm_s_per_rad / p.inertia_kg_m2);
        let wanted = step * ((1.0 - (-2.0 * forgets * at as f64 * h).exp()) / (2.0 * forgets * h)).sqrt();
        let seen = (changes.iter().map(|c| c * c).sum::<f64>() / DRAWS as f64).sqrt();
        assert!((seen / wanted - 1.0).abs() < 0.3, "{seen} {wanted}");
        let exact = Experiment { tau_load: vec![3.0; n], ..e };
        assert!(torque_noise(&machine, &exact, &State::default(), |_| ()).is_empty());
    }

    /// What noise of the speed does to the currents of a nudged machine goes with its variance, and falls at least as the rate does.
    #[test]
    fn noise_of_the_speed_reaches_the_currents_of_a_nudged_machine() {
        let machine = Machine::base(M.parameters(), M.pole_pairs).unwrap();
        let (n, h) = (6000, 1e-4);
        let u_s: Vec<Complex<f64>> = (0..n).map(|k| Complex::from_polar(300.0, 314.0 * h * k as f64)).collect();
        let none = vec![Complex::new(0.0, 0.0); n];
        let r = Recording {
            name: "start".into(),
            start_s: 0.0,
            sample_time_s: h,
            u_s,
            i_s: none,
            omega_m: vec![0.0; n],
            tau_load: Some(vec![0.0; n]),
        };
        let seen = |sigma: f64, rate: f64| {
            let mut e = Experiment::from_recording(&r, [1.0, 1.0], sigma);
            let speed = predict(&machine, &e, &State::default())[2].clone();
            e.speed_nudge = Some((speed, rate));
            nudge_noise(&machine, &[e], &[State::default()])
        };
        let usual = seen(0.1, 30.0);
        assert!(usual > 0.0 && (seen(0.2, 30.0) / usual / 4.0 - 1.0).abs() < 0.05, "{usual}");
        assert!((0.05..0.26).contains(&(seen(0.1, 7.5) / usual)), "{usual} {}", seen(0.1, 7.5));
        assert_eq!(nudge_noise(&machine, &[Experiment::from_recording(&r, [1.0, 1.0], 1.0)], &[State::default()]), 0.0);
    }
}
