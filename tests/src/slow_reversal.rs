//! What a sensorless drive has to hold: rated torque at 1 Hz of the stator, and a slow reversal through zero.
//!
//! From rest: up to a tenth of synchronous speed, rated torque for 5 s, in 2 s or more to 1 Hz, 4 s there, and in 2 s or more through zero to where the stator turns backwards
//! at a tenth of the rated frequency, which the load drives. (A small machine at minus a tenth of the speed would have a slip as large: no stator frequency at all, by which no
//! speed is seen.) Control is lost where the mean speed of 0.2 s is not within 5 % of synchronous speed of what was asked for at 1 Hz or at the end, or the current is beyond 1.5 times
//! its limit.

use std::f64::consts::TAU;

use im_model::simulation::Profile;
use im_model::{ModelError, Rating, TParameters};

/// The manoeuvre for a machine.
#[derive(Clone, Debug)]
pub struct SlowReversal {
    /// Speed that is asked for, rad/s.
    pub speed_rad_s: Profile,
    /// Load torque, Nm.
    pub load_nm: Profile,
    /// Ends of the means, at 1 Hz and after the reversal, s.
    pub judged_s: [f64; 2],
    /// Speeds that the means are compared with, rad/s.
    pub wanted_rad_s: [f64; 2],
    synchronous_rad_s: f64,
}

/// How a drive went through it.
#[derive(Clone, Copy, Debug)]
pub struct Held {
    /// Errors of the mean speed over synchronous speed, at 1 Hz and at the end.
    pub errors: [f64; 2],
    /// Largest current over its limit.
    pub peak: f64,
}

/// Time over which speed is averaged, s.
pub const MEAN_S: f64 = 0.2;

impl SlowReversal {
    /// For a machine with `p` that works at the rotor flux `flux`.
    ///
    /// # Errors
    /// Times that are no profile: parameters that are none.
    pub fn of(p: &TParameters<f64>, pole_pairs: u32, rating: &Rating, flux: f64) -> Result<Self, ModelError> {
        let speed = rating.synchronous_speed_rad_s(pole_pairs);
        let pairs = f64::from(pole_pairs);
        let slip = rating.torque_nm * p.rotor_resistance_ohm / (1.5 * pairs * flux * flux);
        let at_1_hz = (TAU - slip) / pairs;
        let slow = 0.1 * speed;
        let backwards = -slow - slip / pairs;
        let t_r = p.rotor_inductance_h() / p.rotor_resistance_ohm;
        let magnetized = (5.0 * t_r).clamp(0.5, 3.0);
        let on = magnetized + (2.0 * p.inertia_kg_m2 * slow / rating.torque_nm).max(0.3) + 0.5;
        let ramp = (2.0 * p.inertia_kg_m2 * (slow - backwards) / rating.torque_nm).max(2.0);
        let (low, held) = (on + 5.0 + ramp, on + 9.0 + ramp);
        let points = [
            [0.0, 0.0],
            [magnetized, 0.0],
            [on - 0.5, slow],
            [on + 5.0, slow],
            [low, at_1_hz],
            [held, at_1_hz],
            [held + ramp, backwards],
        ];
        Ok(Self {
            speed_rad_s: Profile::points(points)?,
            load_nm: Profile::points([[on, 0.0], [on + 0.3, rating.torque_nm]])?,
            judged_s: [held, held + ramp + 1.5],
            wanted_rad_s: [at_1_hz, backwards],
            synchronous_rad_s: speed,
        })
    }

    /// Its length, s.
    pub fn duration_s(&self) -> f64 {
        self.judged_s[1]
    }

    /// How it went, from the means of the true speed, rad/s, and the largest current over its limit.
    pub fn judge(&self, means: [f64; 2], peak: f64) -> Held {
        Held { errors: [0, 1].map(|k| (means[k] - self.wanted_rad_s[k]) / self.synchronous_rad_s), peak }
    }
}

impl Held {
    /// Why control was lost, if it was.
    pub fn lost(&self) -> Option<&'static str> {
        // What is no number is lost, too.
        let within = |x: f64, most: f64| x.abs() <= most;
        let [at_1_hz, at_the_end] = self.errors;
        if !within(self.peak, 1.5) {
            Some("current")
        } else if !within(at_1_hz, 0.05) {
            Some("at 1 Hz")
        } else if !within(at_the_end, 0.05) {
            Some("after the reversal")
        } else {
            None
        }
    }
}
