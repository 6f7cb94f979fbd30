//! How far readings lie from a model that was fitted to recordings: the half width of the band that holds 95 % of them.
//!
//! w(|i|) = √(w₀² + w₁² |i|²)
//!
//! |i| is the stator current as modelled, A peak. w₀ is what is left at no current, the noise of the sensor with it; w₁ what grows with the current.

use serde::Deserialize;
use toml::Spanned;

use crate::file_error::FileError;
use crate::recording::Recording;
use crate::toml_text::{NotNegative, TomlText};

/// The band of one quantity, in its unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorBand {
    /// w₀: half the width at no current.
    pub fixed: f64,
    /// w₁: what every ampere adds, at large currents.
    pub per_ampere: f64,
}

impl ErrorBand {
    /// Half the width of the band at a stator current, A peak.
    pub fn half_width(&self, current_a: f64) -> f64 {
        self.fixed.hypot(self.per_ampere * current_a)
    }
}

/// What a fitted model leaves of its recordings. It holds for the model that was fitted, and for currents like theirs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// Of a reading of the current, along any axis, A.
    pub current: ErrorBand,
    /// Of a reading of the speed, rad/s; none where none was compared.
    pub speed: Option<ErrorBand>,
}

/// The table `[prediction]` of a motor file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PredictionToml {
    current_a: NotNegative,
    current_per_ampere: NotNegative,
    speed_rad_s: Option<NotNegative>,
    speed_rad_s_per_ampere: Option<NotNegative>,
}

impl PredictionToml {
    /// What to write where a key is missing.
    pub(crate) const HINTS: [(&'static str, &'static str); 2] = [
        ("current_a", "half the width of the band of the current at no current, A"),
        ("current_per_ampere", "what every ampere adds to half the width of the band of the current"),
    ];
}

impl Prediction {
    /// From its table.
    ///
    /// # Errors
    /// One key of the speed without the other.
    pub(crate) fn read(toml: &TomlText<'_>, table: Spanned<PredictionToml>) -> Result<Self, FileError> {
        let at = table.span();
        let PredictionToml { current_a, current_per_ampere, speed_rad_s, speed_rad_s_per_ampere } = table.into_inner();
        let speed = match (speed_rad_s, speed_rad_s_per_ampere) {
            (None, None) => None,
            (Some(fixed), Some(per_ampere)) => Some(ErrorBand { fixed: fixed.0, per_ampere: per_ampere.0 }),
            (given, _) => {
                let missing = if given.is_none() { "speed_rad_s" } else { "speed_rad_s_per_ampere" };
                return Err(toml.missing(at, missing, "both keys of the speed, or none"));
            }
        };
        Ok(Self { current: ErrorBand { fixed: current_a.0, per_ampere: current_per_ampere.0 }, speed })
    }

    /// Its keys with their numbers.
    pub fn entries(&self) -> impl Iterator<Item = (&'static str, f64)> {
        let of = |keys: [&'static str; 2], b: ErrorBand| keys.into_iter().zip([b.fixed, b.per_ampere]);
        let speed = self.speed.map(|b| of(["speed_rad_s", "speed_rad_s_per_ampere"], b));
        of(["current_a", "current_per_ampere"], self.current).chain(speed.into_iter().flatten())
    }

    /// Columns to go with a simulated recording: half the width of the band at each row.
    pub fn columns(&self, r: &Recording) -> Vec<(&'static str, Vec<f64>)> {
        let column = |name, band: ErrorBand| (name, r.i_s.iter().map(|i| band.half_width(i.norm())).collect());
        let speed = self.speed.map(|band| column("omega_band_rad_s", band));
        std::iter::once(column("i_band_A", self.current)).chain(speed).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motor_file::MotorFile;
    use crate::simulation::{Scenario, Simulation};
    use proptest::prelude::*;

    fn with(table: &str) -> Result<MotorFile, FileError> {
        let text = MotorFile::parse(include_str!("../../examples/motor.toml"), "motor.toml").unwrap().to_toml();
        MotorFile::parse(&format!("{text}\n[prediction]\n{table}"), "motor.toml")
    }

    #[test]
    fn a_table_with_a_slip_is_refused_with_its_name() {
        assert!(with("current_a = 0.1\ncurrent_per_ampere = 0").is_ok_and(|m| m.prediction.unwrap().speed.is_none()));
        let refused = |table: &str| with(table).unwrap_err().to_string();
        let near = refused("current_a = 0.1\ncurrent_per_amper = 0");
        assert!(near.contains("unknown key current_per_amper in [prediction]; did you mean current_per_ampere?"), "{near}");
        let missing = refused("current_a = 0.1");
        assert!(missing.contains("current_per_ampere is missing in [prediction]: what every ampere adds"), "{missing}");
        let half = refused("current_a = 0.1\ncurrent_per_ampere = 0\nspeed_rad_s = 1");
        assert!(half.contains("speed_rad_s_per_ampere is missing in [prediction]: both keys of the speed, or none"), "{half}");
        let negative = refused("current_a = -0.1\ncurrent_per_ampere = 0");
        assert!(negative.contains("current_a = -0.1 must be zero or positive"), "{negative}");
    }

    #[test]
    fn columns_beside_a_recording_are_passed_over_when_it_is_read() {
        let motor = with("current_a = 0.3\ncurrent_per_ampere = 0.1\nspeed_rad_s = 0.5\nspeed_rad_s_per_ampere = 0").unwrap();
        let run = Simulation::new(&motor.machine, &Scenario::direct_on_line(325.0, 50.0, 0.01)).run().unwrap().recording;
        let mut text = Vec::new();
        run.to_csv_with(&motor.prediction.unwrap().columns(&run), &mut text).unwrap();
        let read = Recording::from_csv(text.as_slice(), &run.name).unwrap();
        assert_eq!(read, run);
        let text = String::from_utf8(text).unwrap();
        assert!(text.lines().next().unwrap().ends_with(",i_band_A,omega_band_rad_s"), "{text}");
        assert!(text.lines().nth(1).unwrap().ends_with(",0.3,0.5"), "at rest there is no current");
        let mut plain = Vec::new();
        run.to_csv(&mut plain).unwrap();
        let cut: Vec<&str> = text.lines().map(|l| l.rsplitn(3, ',').last().unwrap()).collect();
        assert_eq!(String::from_utf8(plain).unwrap().lines().collect::<Vec<_>>(), cut);
    }

    proptest! {
        /// For any band: it grows with the current, and is at least each of its parts and at most their sum.
        #[test]
        fn a_band_grows_with_the_current(fixed in 0.0..1e3f64, per_ampere in 0.0..10.0f64, i in 0.0..1e4f64, more in 0.0..1e3f64) {
            let band = ErrorBand { fixed, per_ampere };
            let w = band.half_width(i);
            prop_assert!(band.half_width(i + more) >= w);
            prop_assert!(w >= fixed.max(per_ampere * i) * (1.0 - 1e-12) && w <= (fixed + per_ampere * i) * (1.0 + 1e-12));
        }
    }
}
