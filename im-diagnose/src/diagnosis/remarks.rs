//! What to check before the answer is believed.

use im_identify::offline::{Experiment, Load};
use im_model::{EffectId, ParameterId};

use super::{Diagnosis, Verdict};
use crate::format::{number, quantity, too_much};
use crate::intake::quality::convention::impedance_ratios;
use crate::intake::{Finding, FindingKind};
use crate::knowledge::contradicted;
use crate::residuals::FITS;
use crate::uncertainty::MachineQuantity;

/// A delay within this part of a sample of a half or of a whole one is suspicious.
const NEAR_SAMPLES: f64 = 0.1;
/// Mean square of the residual, in σ², below which the noise was taken too large.
const BELOW_NOISE: f64 = 0.8;

/// A gain this near, relative, to a factor between conventions is suspicious.
const NEAR_CONVENTION: f64 = 0.04;

/// Effects that are a gain of one kind of signal: the terminals' voltage, all currents.
const GAINS: [EffectId; 2] = [EffectId::VoltageGain, EffectId::CurrentSensorGain];

fn is_a_convention(gain: f64) -> bool {
    [2f64, 3.0]
        .iter()
        .map(|n| n.sqrt())
        .any(|f| (gain / f - 1.0).abs() < NEAR_CONVENTION || (gain * f - 1.0).abs() < NEAR_CONVENTION)
}

/// How far impedances and inertia may be from the motor file where no convention has been mistaken, as logarithms: √2 is 0.35.
const AS_GIVEN: [f64; 2] = [0.15, 0.25];

impl Diagnosis {
    /// What the user should check first, one sentence each.
    pub fn remarks(&self) -> Vec<String> {
        let found = [
            self.search_cut_short(),
            self.delay_of_whole_samples(),
            self.delay_of_a_measured_voltage(),
            self.gain_of_a_convention(),
            self.scale_of_the_torque(),
            self.error_below_noise(),
            self.noisy_voltage(),
        ];
        found.into_iter().flatten().chain(self.contradictions()).collect()
    }

    /// Values that were known, and that the fit has left.
    fn contradictions(&self) -> Vec<String> {
        let std = |id| self.parameters.iter().find(|p| p.quantity == MachineQuantity::Parameter(id)).map(|p| p.std);
        let all = contradicted(&self.case.motor, &self.refined.machine, std, |id| format!("`{id}`"));
        all.into_iter().map(|(_, said)| said).collect()
    }

    /// A search that had to end: nothing of the library leads on.
    fn search_cut_short(&self) -> Option<String> {
        let untried = "The search ended with sets of effects untried that may be likelier";
        let little = ": effects of the library explain little here. Check the channels, their units and the motor as given first";
        self.course.cut_short.then(|| format!("{untried}{}", if self.named().is_empty() { little } else { "" }))
    }

    /// A delay of half a sample or a whole one, found or, where the library does not explain the recordings, suggested: the recording's `instant`
    /// is likelier wrong than the drive late.
    fn delay_of_whole_samples(&self) -> Option<String> {
        let delay = EffectId::VoltageDelay;
        let suggested = || {
            let open = self.verdict == Verdict::Unexplained;
            self.ranking
                .iter()
                .find(|c| c.effect == delay && open && c.score > c.threshold)
                .map(|c| (c.predicted_size, "suggested"))
        };
        let found = (self.effects.contains(&delay)).then(|| (self.refined.machine.get(ParameterId::Effect(delay, 0)), "found"));
        let (delay_s, how) = found.or_else(suggested)?;
        let sampled = self.case.train.iter().filter(|e| !e.is_table());
        let of_an_instant = |x: &f64| [0.5, 1.0].iter().any(|n| (x.abs() - n).abs() < NEAR_SAMPLES);
        // Nothing acts before its cause, and nobody holds the mains.
        let is_early = delay_s < 0.0 && self.case.is_on_mains() && self.case.all().all(|e| !e.is_smooth);
        let samples = sampled.map(|e| delay_s / e.sample_time_s).find(|x| is_early || of_an_instant(x))?;
        Some(format!(
            "Check `instant` in [voltage] of the mapping first: the voltage delay {how}, {}, is {} samples, as when \"sample\", \"held_from_row\" and \"held_until_row\" are taken for each other",
            quantity(delay_s, "s", 3),
            number(samples, 2)
        ))
    }

    /// A delay of a voltage that was measured: nothing makes it late, but something may make the currents so.
    fn delay_of_a_measured_voltage(&self) -> Option<String> {
        let delay = EffectId::VoltageDelay;
        let is_measured = |e: &Experiment| e.inert == Some(EffectId::InverterNonlinearity);
        (self.effects.contains(&delay) && self.case.train.iter().all(is_measured)).then(|| {
            format!(
                "The voltage was measured, so it is the currents that are late, by {}: a filter or a transducer of narrow band makes them so. Ask for their bandwidth",
                quantity(self.refined.machine.get(ParameterId::Effect(delay, 0)), "s", 3)
            )
        })
    }

    /// A gain that is the factor between two conventions, found or in the place of one that was: the mapping is likelier wrong than the sensor.
    fn gain_of_a_convention(&self) -> Option<String> {
        let gain = GAINS.iter().filter(|e| self.effects.contains(e)).map(|e| self.gain(*e)).find(|g| is_a_convention(*g))?;
        Some(format!(
            "Check the convention of voltage and current in the mapping first: a gain of {} is nearly √2 or √3 or its inverse, as when rms and peak, or line to line and phase, are taken for each other",
            number(gain, 3)
        ))
    }

    fn gain(&self, effect: EffectId) -> f64 {
        1.0 + self.refined.machine.get(ParameterId::Effect(effect, 0))
    }

    /// Flux times current is torque: what looks like a gain of the voltage or of all currents may be one of the torque sensor as well, with all
    /// impedances and the inertia scaled.
    fn scale_of_the_torque(&self) -> Option<String> {
        let of_either = |(e, rivals): (&EffectId, &Vec<EffectId>)| {
            (GAINS.contains(e) && rivals.iter().any(|r| GAINS.contains(r))).then_some(*e)
        };
        let effect = self.effects.iter().zip(&self.alternatives).find_map(of_either)?;
        let measured = |e: &Experiment| matches!(e.load, Load::Known) && e.tau_load.iter().any(|t| *t != 0.0);
        self.case.train.iter().any(measured).then(|| {
            let gain = self.gain(effect);
            let scale = if effect == EffectId::VoltageGain { gain } else { gain.recip() };
            format!(
                "Check the scale of the torque sensor, too: one that reads {} looks the same in every recording",
                too_much(scale)
            )
        })
    }

    /// An error clearly below what the noise alone makes.
    fn error_below_noise(&self) -> Option<String> {
        let last = self.steps.last()?;
        let least = last.holdout.iter().map(|e| e.chi2_per_sample).fold(last.train.chi2_per_sample, f64::min);
        (least < BELOW_NOISE).then(|| {
            let why = if self.case.train.iter().all(|e| e.is_table()) {
                "the instruments are better than the class that was taken, 0.5 % where no `class` is given in a table.toml"
            } else {
                "the noise was taken too large, as with signals that were rounded, currents that a switched voltage makes rough, or a speed that is a difference of angles"
            };
            format!("An error of {} σ rms is less than the noise alone makes: {why}", number(least.sqrt(), 2))
        })
    }

    /// A voltage whose noise is not counted: what it makes of the currents seems to be missing.
    fn noisy_voltage(&self) -> Option<String> {
        let machine = &self.refined.machine;
        let noisy = self.case.all().filter(|e| !e.is_table() && e.is_voltage_too_noisy(machine));
        let worst = noisy.max_by(|a, b| a.voltage_noise_in_a_row(machine).total_cmp(&b.voltage_noise_in_a_row(machine)))?;
        Some(format!(
            "The voltage was measured with {} V rms of noise, which from row to row makes {} of what the current sensors' noise does: too much to be counted as noise. What it makes of the currents is in what is left. Average it over the sample before it is written",
            number(worst.voltage_noise.volts.sigma_v, 2),
            number(worst.voltage_noise_in_a_row(machine), 2)
        ))
    }

    /// Whether the fit refutes a finding: an offset that no current sensor has once the model explains the recordings, or another convention
    /// of signals that a machine of the impedances and the inertia given explains.
    pub fn refutes(&self, finding: &Finding) -> bool {
        if finding.kind == FindingKind::Convention {
            return self.fits_as_given();
        }
        let offset = EffectId::CurrentSensorOffset;
        let current = self.case.train.iter().flat_map(|e| &e.channels).any(|c| c.name.starts_with("i_"));
        finding.kind == FindingKind::Offset
            && current
            && !self.effects.contains(&offset)
            && self.ranking.iter().any(|c| c.effect == offset && c.excited && c.score < c.threshold)
    }

    /// Whether the refined machine explains the recordings with impedances and an inertia that are, taken together, those of the motor file.
    fn fits_as_given(&self) -> bool {
        let (given, refined) = (self.case.motor.machine.parameters(), self.refined.machine.parameters());
        let mean = impedance_ratios(given, refined).iter().map(|r| r.ln()).sum::<f64>() / 4.0;
        let inertia = refined.inertia_kg_m2 / given.inertia_kg_m2;
        self.steps.last().is_some_and(|s| s.train.chi2_per_sample < FITS)
            && mean.abs() < AS_GIVEN[0]
            && inertia.ln().abs() < AS_GIVEN[1]
    }
}

#[cfg(test)]
mod tests {
    use super::is_a_convention;

    #[test]
    fn a_gain_between_two_conventions_is_told_from_one_of_a_sensor() {
        for gain in [2f64.sqrt(), 0.5f64.sqrt(), 3f64.sqrt(), 0.58] {
            assert!(is_a_convention(gain), "{gain}");
        }
        assert!([1.0, 1.1, 0.9, 0.8, 1.3, 2.0].iter().all(|g| !is_a_convention(*g)));
    }
}
