//! Sensors: what turns the true current and speed into measured ones.

use super::chance::Chance;
use super::plane::Vector;

/// Systematic errors of the sensors.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensors {
    /// Gains of the phase-current sensors.
    pub gain: [f64; 3],
    /// Offsets of the phase-current sensors, A.
    pub offset_a: [f64; 3],
    /// Only phases a and b are measured; c is taken as −a − b.
    pub two_phases: bool,
    /// Level at which the phase sensors clip, A.
    pub clip_a: Option<f64>,
    /// Factor on the measured speed, at standstill.
    pub speed_scale: f64,
    /// By what part of that the factor falls per rad/s: the armature reaction of a tachogenerator.
    pub speed_droop_s: f64,
    /// The speed is the turn of an encoder over this time, s.
    pub encoder_window_s: Option<f64>,
}

impl Default for Sensors {
    fn default() -> Self {
        Self {
            gain: [1.0; 3],
            offset_a: [0.0; 3],
            two_phases: false,
            clip_a: None,
            speed_scale: 1.0,
            speed_droop_s: 0.0,
            encoder_window_s: None,
        }
    }
}

impl Sensors {
    /// The measured speed, rad/s, without noise.
    pub fn speed(&self, true_rad_s: f64) -> f64 {
        self.speed_scale * true_rad_s * (1.0 - self.speed_droop_s * true_rad_s.abs())
    }

    /// The measured current vector, without noise.
    pub fn current(&self, true_current: Vector) -> Vector {
        let mut phases = true_current.phases();
        for (k, i) in phases.iter_mut().enumerate() {
            *i = self.gain[k] * *i + self.offset_a[k];
            if let Some(level) = self.clip_a {
                *i = i.clamp(-level, level);
            }
        }
        if self.two_phases {
            phases[2] = -phases[0] - phases[1];
        }
        Vector::from_phases(phases)
    }
}

/// Random errors of the sensors, relative to the machine's rating.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Standard deviation of the current (each axis) over rated peak current.
    pub current: f64,
    /// Standard deviation of the speed over synchronous speed.
    pub speed: f64,
    /// Standard deviation of the load torque over rated torque.
    pub load: f64,
    /// Coefficient φ of first-order colouring, from one sample to the next; zero is white.
    pub colour: f64,
    /// Step of quantization over the standard deviation, of current and speed; zero is none.
    pub quantum: f64,
}

impl Default for Noise {
    fn default() -> Self {
        Self { current: 0.003, speed: 0.0006, load: 0.0025, colour: 0.0, quantum: 0.0 }
    }
}

impl Noise {
    /// Sensors without random errors.
    pub const NONE: Self = Self { current: 0.0, speed: 0.0, load: 0.0, colour: 0.0, quantum: 0.0 };

    /// White noise coloured by x_k = φ x_{k−1} + √(1 − φ²) w_k.
    pub fn coloured(colour: f64) -> Self {
        Self { colour, ..Self::default() }
    }
}

/// Standard deviations in units, and the state of the colouring.
#[derive(Clone, Debug)]
pub struct NoiseSource {
    sigma: [f64; 4],
    colour: [f64; 4],
    quantum: [f64; 4],
    last: [f64; 4],
    chance: Chance,
}

impl NoiseSource {
    /// Noise with the given standard deviations of α and β current (A), speed (rad/s) and load torque (N m).
    ///
    /// The torque channel is always white: it is an input, and its noise would otherwise drive the shaft.
    pub fn new(noise: &Noise, current_a: f64, speed_rad_s: f64, torque_nm: f64, mut chance: Chance) -> Self {
        let sigma = [current_a, current_a, speed_rad_s, torque_nm];
        let last = sigma.map(|sigma| sigma * chance.normal());
        let quantum = [noise.quantum, noise.quantum, noise.quantum, 0.0];
        Self {
            sigma,
            colour: [noise.colour, noise.colour, noise.colour, 0.0],
            quantum: [0, 1, 2, 3].map(|k| quantum[k] * sigma[k]),
            last,
            chance,
        }
    }

    /// Adds noise to α and β current, speed and load torque.
    pub fn corrupt(&mut self, clean: [f64; 4]) -> [f64; 4] {
        let mut out = clean;
        for (k, value) in out.iter_mut().enumerate() {
            let phi = self.colour[k];
            self.last[k] = phi * self.last[k] + (1.0 - phi * phi).sqrt() * self.sigma[k] * self.chance.normal();
            *value += self.last[k];
            if self.quantum[k] > 0.0 {
                *value = (*value / self.quantum[k]).round() * self.quantum[k];
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colouring_keeps_the_variance() {
        let noise = Noise::coloured(0.9);
        let mut source = NoiseSource::new(&noise, 1.0, 1.0, 1.0, Chance::new(1, "noise"));
        let n = 200_000;
        let (mut square, mut product, mut last) = (0.0, 0.0, 0.0);
        for _ in 0..n {
            let [x, ..] = source.corrupt([0.0; 4]);
            square += x * x;
            product += x * last;
            last = x;
        }
        // Effective number of samples is about n (1 − φ²)/(1 + φ²) = n/9.5: standard error 1 %.
        assert!((square / f64::from(n) - 1.0).abs() < 0.04);
        assert!((product / square - 0.9).abs() < 0.01);
    }

    #[test]
    fn two_sensors_split_an_offset_differently_from_three() {
        let three = Sensors { offset_a: [0.0, 0.3, 0.0], ..Sensors::default() };
        let two = Sensors { two_phases: true, ..three.clone() };
        assert!((three.current(Vector::ZERO) - Vector::new(-0.1, 0.3 / 3.0_f64.sqrt())).length() < 1e-12);
        assert!((two.current(Vector::ZERO) - Vector::new(0.0, 0.6 / 3.0_f64.sqrt())).length() < 1e-12);
    }
}
