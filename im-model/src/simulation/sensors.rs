//! What the data acquisition adds to what the sensors show: white noise from a seed, offsets, quantization.

use num_complex::Complex;

use crate::error::{Bound, ModelError};
use crate::instant::Output;

/// Imperfections of the data acquisition. `default` has none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sensors {
    /// Standard deviation of the noise on each of i_α, i_β, A.
    pub current_noise_a: f64,
    /// Standard deviation of the noise on the speed, rad/s.
    pub speed_noise_rad_s: f64,
    /// Standard deviation of the noise on the recorded load torque, Nm.
    pub torque_noise_nm: f64,
    /// Constant added to i_α and i_β, A.
    pub current_offset_a: [f64; 2],
    /// Step of the current's converter, A; zero for none.
    pub current_step_a: f64,
    /// Step of the speed, rad/s; zero for none.
    pub speed_step_rad_s: f64,
    /// Seed of the noise: the same seed gives the same noise on every platform.
    pub seed: u64,
}

impl Sensors {
    /// Checks the values: noise and steps not negative, offsets finite.
    ///
    /// # Errors
    /// Names the quantity out of bounds.
    pub fn validate(&self) -> Result<(), ModelError> {
        Bound::NotNegative.check("current_noise_a", self.current_noise_a)?;
        Bound::NotNegative.check("speed_noise_rad_s", self.speed_noise_rad_s)?;
        Bound::NotNegative.check("torque_noise_nm", self.torque_noise_nm)?;
        Bound::Within(-1e6, 1e6).check("current_offset_a", self.current_offset_a[0])?;
        Bound::Within(-1e6, 1e6).check("current_offset_a", self.current_offset_a[1])?;
        Bound::NotNegative.check("current_step_a", self.current_step_a)?;
        Bound::NotNegative.check("speed_step_rad_s", self.speed_step_rad_s)
    }

    pub(crate) fn reader(&self) -> Reader {
        // A stream of its own for each channel: switching one noise on leaves the others as they were.
        Reader { sensors: *self, noise: core::array::from_fn(|k| Noise::new(self.seed, k as u64)) }
    }
}

/// The sensors with their noise.
pub(crate) struct Reader {
    sensors: Sensors,
    noise: [Noise; 4],
}

impl Reader {
    pub fn read(&mut self, shown: Output<f64>) -> Output<f64> {
        let s = &self.sensors;
        let [alpha, beta, speed, _] = &mut self.noise;
        let channel = |x: f64, offset: f64, sigma: f64, step: f64, noise: &mut Noise| {
            let x = x + offset + if sigma > 0.0 { sigma * noise.normal() } else { 0.0 };
            if step > 0.0 { (x / step).round() * step } else { x }
        };
        let [o_alpha, o_beta] = s.current_offset_a;
        Output {
            i_s: Complex::new(
                channel(shown.i_s.re, o_alpha, s.current_noise_a, s.current_step_a, alpha),
                channel(shown.i_s.im, o_beta, s.current_noise_a, s.current_step_a, beta),
            ),
            omega_m: channel(shown.omega_m, 0.0, s.speed_noise_rad_s, s.speed_step_rad_s, speed),
        }
    }

    pub fn torque(&mut self, torque: f64) -> f64 {
        if self.sensors.torque_noise_nm > 0.0 { torque + self.sensors.torque_noise_nm * self.noise[3].normal() } else { torque }
    }
}

/// Normal numbers: splitmix64 (Steele, Lea, Flood 2014) and Marsaglia's polar method.
struct Noise {
    state: u64,
    spare: Option<f64>,
}

impl Noise {
    fn new(seed: u64, stream: u64) -> Self {
        let mut this = Self { state: seed ^ stream.wrapping_mul(0xd134_2543_de82_ef95), spare: None };
        this.state = this.bits();
        this
    }

    fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.state ^ (self.state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn normal(&mut self) -> f64 {
        if let Some(x) = self.spare.take() {
            return x;
        }
        loop {
            // 53 bits in [−1, 1).
            let mut unit = || (self.bits() >> 11) as f64 / (1u64 << 52) as f64 - 1.0;
            let (a, b) = (unit(), unit());
            let r2 = a * a + b * b;
            if r2 > 0.0 && r2 < 1.0 {
                let scale = (-2.0 * r2.ln() / r2).sqrt();
                self.spare = Some(b * scale);
                return a * scale;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STILL: Output<f64> = Output { i_s: Complex::new(1.0, -2.0), omega_m: 100.0 };

    #[test]
    fn without_imperfections_nothing_changes() {
        assert_eq!(Sensors::default().reader().read(STILL), STILL);
    }

    #[test]
    fn noise_is_white_normal_and_repeatable() {
        let s = Sensors { current_noise_a: 0.1, speed_noise_rad_s: 0.5, seed: 7, ..Sensors::default() };
        let draw = |s: &Sensors| {
            let mut r = s.reader();
            (0..20_000).map(|_| r.read(STILL)).collect::<Vec<_>>()
        };
        let rows = draw(&s);
        assert_eq!(rows, draw(&s));
        assert_ne!(rows, draw(&Sensors { seed: 8, ..s }));
        let x: Vec<f64> = rows.iter().map(|r| (r.i_s.re - 1.0) / 0.1).collect();
        let y: Vec<f64> = rows.iter().map(|r| (r.i_s.im + 2.0) / 0.1).collect();
        let n = x.len() as f64;
        let mean = |f: &dyn Fn(usize) -> f64| (0..x.len()).map(f).sum::<f64>() / n;
        // Five standard errors of each statistic.
        let tolerance = 5.0 / n.sqrt();
        assert!(mean(&|k| x[k]).abs() < tolerance);
        assert!((mean(&|k| x[k] * x[k]) - 1.0).abs() < 1.5 * tolerance);
        assert!((mean(&|k| x[k].powi(4)) - 3.0).abs() < 10.0 * tolerance);
        assert!(mean(&|k| x[k] * x[(k + 1) % x.len()]).abs() < tolerance, "no memory");
        assert!(mean(&|k| x[k] * y[k]).abs() < tolerance, "channels are independent");
    }

    #[test]
    fn offset_and_quantization() {
        let s = Sensors { current_offset_a: [0.03, -0.02], current_step_a: 0.1, speed_step_rad_s: 3.0, ..Sensors::default() };
        let r = s.reader().read(STILL);
        assert!((r.i_s.re - 1.0).abs() < 1e-12 && (r.i_s.im + 2.0).abs() < 1e-12 && r.omega_m == 99.0, "{r:?}");
    }
}
