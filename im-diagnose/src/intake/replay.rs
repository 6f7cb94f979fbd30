//! A recording as a drive would have seen it, sample by sample, for observers and on-line identifiers.

use im_identify::offline::{Channel, ChannelKind};
use im_model::space_vector::from_phases;
use im_model::{Complex, Recording};

use super::Intake;

const LOST: f64 = f64::NAN;

impl Intake {
    /// The rows in canonical form. What the checks left out, and a speed that was not measured, is NaN: a lost sample.
    pub fn replay(&self) -> Recording {
        let e = &self.experiment;
        let along = |phi: f64| {
            let is =
                |c: &&Channel| matches!(c.kind, ChannelKind::Current { direction_rad } if (direction_rad - phi).abs() < 1e-9);
            e.channels.iter().find(is)
        };
        let at = |c: Option<&Channel>, k: usize| c.filter(|c| c.is_valid(k)).map_or(LOST, |c| c.values[k]);
        let third = 2.0 * std::f64::consts::FRAC_PI_3;
        let [alpha, beta, b, c] = [0.0, std::f64::consts::FRAC_PI_2, third, 2.0 * third].map(along);
        let current = |k: usize| match beta {
            Some(_) => Complex::new(at(alpha, k), at(beta, k)),
            None => from_phases(completed([at(alpha, k), at(b, k), at(c, k)])),
        };
        let speed = e.channels.iter().find(|c| c.kind == ChannelKind::Speed);
        let omega_m = |k: usize| e.imposed_speed.as_ref().map_or_else(|| at(speed, k), |w| w[k]);
        Recording {
            name: e.name.clone(),
            start_s: self.start_s,
            sample_time_s: e.sample_time_s,
            u_s: e.u_s.clone(),
            i_s: (0..e.len()).map(current).collect(),
            omega_m: (0..e.len()).map(omega_m).collect(),
            tau_load: Some(e.tau_load.clone()),
        }
    }
}

/// Three currents, the one that is missing being what the others leave: the star point is not connected.
fn completed(mut i: [f64; 3]) -> [f64; 3] {
    if let Some(k) = i.iter().position(|x| x.is_nan()) {
        i[k] = -(i[(k + 1) % 3] + i[(k + 2) % 3]);
    }
    i
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intake::LoadPlan;
    use crate::intake::mapping::Begin;
    use im_identify::offline::{Experiment, Load, Start};
    use im_model::space_vector::to_phases;

    fn channel(name: &str, kind: ChannelKind, values: Vec<f64>, valid: Option<Vec<bool>>) -> Channel {
        Channel { name: name.into(), kind, values, valid, sigma: 1.0 }
    }

    fn intake(channels: Vec<Channel>) -> Intake {
        let n = channels[0].values.len();
        let experiment = Experiment {
            name: "run".into(),
            sample_time_s: 1e-3,
            supply_frequency_hz: None,
            u_s: vec![Complex::new(0.0, 0.0); n],
            is_smooth: false,
            voltage_noise: Default::default(),
            tau_load: vec![0.0; n],
            load: Load::Known,
            imposed_speed: None,
            speed_nudge: None,
            warmth: Vec::new(),
            inert: None,
            nudge_part: 1.0,
            channels,
            start: Start::Rest,
        };
        Intake {
            experiment,
            begin: Begin::Auto,
            load: LoadPlan::Known,
            start_s: 0.5,
            findings: Vec::new(),
            steady: false,
            draft: None,
        }
    }

    #[test]
    fn one_phase_that_is_left_out_is_what_the_others_leave_and_two_are_a_lost_sample() {
        let truth = Complex::new(3.0, -1.0);
        let third = 2.0 * std::f64::consts::FRAC_PI_3;
        let masks = [[true, true, true, true], [true, false, false, true], [true, true, false, true]];
        let phases = (0..3).map(|p| {
            let values = (0..4).map(|k| if masks[p][k] { to_phases(truth)[p] } else { 99.0 }).collect();
            channel("i", ChannelKind::Current { direction_rad: third * p as f64 }, values, Some(masks[p].to_vec()))
        });
        let r = intake(phases.collect()).replay();
        for k in [0, 1, 3] {
            assert!((r.i_s[k] - truth).norm() < 1e-12, "{k}: {}", r.i_s[k]);
        }
        assert!(!r.i_s[2].re.is_finite() && r.omega_m.iter().all(|w| w.is_nan()));
        assert_eq!(r.time_s(2), 0.502);
    }

    #[test]
    fn a_space_vector_and_a_speed_come_through_as_they_are() {
        let right = std::f64::consts::FRAC_PI_2;
        let r = intake(vec![
            channel("i_alpha_A", ChannelKind::Current { direction_rad: 0.0 }, vec![1.0, 2.0], Some(vec![true, false])),
            channel("i_beta_A", ChannelKind::Current { direction_rad: right }, vec![3.0, 4.0], Some(vec![true, false])),
            channel("omega_m_rad_s", ChannelKind::Speed, vec![5.0, 6.0], None),
        ])
        .replay();
        assert_eq!((r.i_s[0], r.omega_m[1]), (Complex::new(1.0, 3.0), 6.0));
        assert!(r.i_s[1].re.is_nan() && r.i_s[1].im.is_nan());
    }
}
