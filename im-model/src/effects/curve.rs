//! The law of an effect as a curve: what reports draw, and `docs/effects.md`.

use super::{EffectId, Effects};
use crate::parameters::TParameters;
use crate::rating::Rating;

/// What a curve is drawn for.
#[derive(Clone, Copy, Debug)]
pub struct Rated<'a> {
    /// The parameters of the machine.
    pub parameters: &'a TParameters<f64>,
    /// Its rating.
    pub rating: &'a Rating,
    /// Peak phase current at rated torque, A.
    pub current_a: f64,
    /// Synchronous speed, rad/s.
    pub speed_rad_s: f64,
    /// Rated frequency, Hz.
    pub frequency_hz: f64,
}

impl<'a> Rated<'a> {
    /// The parameters of a machine with its rating.
    pub fn new(parameters: &'a TParameters<f64>, pole_pairs: u32, rating: &'a Rating) -> Self {
        Self {
            parameters,
            rating,
            current_a: rating.current_peak_a(parameters, pole_pairs),
            speed_rad_s: rating.synchronous_speed_rad_s(pole_pairs),
            frequency_hz: rating.electrical_frequency_hz,
        }
    }
}

/// The axes of a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Horizontal axis, with unit.
    pub x_label: &'static str,
    /// Vertical axis, with unit.
    pub y_label: &'static str,
    /// Where the curve begins and ends.
    pub range: (f64, f64),
    /// Whether both axes are logarithmic.
    pub log: bool,
    /// What it shows.
    pub caption: &'static str,
}

impl Frame {
    /// Linear axes.
    pub fn new(x_label: &'static str, y_label: &'static str, range: (f64, f64), caption: &'static str) -> Self {
        Self { x_label, y_label, range, log: false, caption }
    }
}

/// An effect whose law is drawn.
pub trait Drawn {
    /// The axes.
    fn frame(&self, on: &Rated) -> Frame;
    /// The law; that of the machine without the effect when the effect is off.
    fn law(&self, on: &Rated, x: f64) -> f64;
}

impl Effects<f64> {
    /// The axes of the curve of an effect; none for a user's, unless it is learned.
    pub fn frame(&self, effect: EffectId, on: &Rated) -> Option<Frame> {
        match effect.free_form() {
            Some(form) => {
                let (x_label, y_label) = form.labels();
                let caption = "Learned: what the recordings left, as a smooth curve that no formula gives. Dashed: without it.";
                Some(Frame::new(x_label, y_label, form.range(&self.values(effect), 360.0), caption))
            }
            None => self.drawn(effect).map(|e| e.frame(on)),
        }
    }
    /// The law of an effect; not a number for a user's, unless it is learned.
    pub fn law(&self, effect: EffectId, on: &Rated, x: f64) -> f64 {
        match effect.free_form() {
            Some(form) => {
                let x = if form.over().is_angle() { x.to_radians() } else { x };
                form.value(&self.values(effect), x)
            }
            None => self.drawn(effect).map_or(f64::NAN, |e| e.law(on, x)),
        }
    }

    /// The values of all parameters of an effect.
    fn values(&self, effect: EffectId) -> Vec<f64> {
        (0..effect.parameters().len()).map(|k| self.get(effect, k)).collect()
    }
}
