//! A recording run through the identifiers, as a drive would have seen it.

use im_model::{ModelError, MotorFile, Recording};

use super::{
    Estimate, Follower, FollowerGains, Identifier, KenneResistances, KenneRotorResistance, KenneSettings, RegulationParameters,
    ResistancesSettings, Sample, SchemeSettings, TimeScale, TimeVarying,
};

/// Which of Jadot's adaptations follows the recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReplayScheme {
    /// (34), all four parameters.
    TimeScale,
    /// (47), all four parameters, the integral action forgetting.
    TimeVarying,
    /// (53), R_req and L only.
    Reduced,
}

/// What the identifiers say at a row. Rotor resistances are referred as the motor's T circuit is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReplayRow {
    /// Time, s.
    pub time_s: f64,
    /// R_r of [`KenneRotorResistance`], Ω.
    pub rotor: Estimate<f64, 1>,
    /// R_r, R_s of [`KenneResistances`], Ω.
    pub both: Estimate<f64, 2>,
    /// R_req, L, R_s, L_f of the adaptation, Ω and H.
    pub regulation: Estimate<f64, 4>,
}

/// Replays a recording; `keep` is asked for each row whether to return it.
///
/// # Errors
/// The motor's numbers, or the sampling time, are outside what an identifier can be made for.
pub fn replay(
    motor: &MotorFile,
    recording: &Recording,
    scheme: ReplayScheme,
    mut keep: impl FnMut(usize) -> bool,
) -> Result<Vec<ReplayRow>, ModelError> {
    let h = recording.sample_time_s;
    let (p, n_p) = (motor.machine.parameters(), motor.machine.pole_pairs());
    let windings = p.windings();
    let rotor = KenneRotorResistance::try_new(&windings, n_p, &KenneSettings::for_rating(&windings, n_p, &motor.rating, h), h)?;
    let settings = ResistancesSettings::for_rating(&windings, n_p, &motor.rating, h);
    let both = KenneResistances::try_new(&windings, n_p, &settings, h)?;
    let start = RegulationParameters::from(p.inverse_gamma());
    // As fast as the sampling allows, up to what the paper has.
    let gains = FollowerGains::for_bandwidth(&start, n_p, (0.25 / h).min(837.0), h);
    let least_regressor_v = 0.02 * motor.rating.phase_voltage_peak_v;
    let full = SchemeSettings { least_regressor_v, ..SchemeSettings::full(start, h) };
    let reduced = SchemeSettings { least_regressor_v, ..SchemeSettings::reduced(start, h) };
    let share = TimeScale::<f64>::PAPER_SHARE;
    let mut run = Replay { recording, keep: &mut keep, rotor, both };
    match scheme {
        ReplayScheme::TimeScale => run.through(Follower::try_new(gains, TimeScale::try_new(&full, share)?)?),
        ReplayScheme::Reduced => run.through(Follower::try_new(gains, TimeScale::try_new(&reduced, share)?)?),
        ReplayScheme::TimeVarying => {
            let frequency = TimeVarying::<f64>::PAPER_FREQUENCY.min(0.1 / h);
            run.through(Follower::try_new(gains, TimeVarying::try_new(&full, frequency, 1000.0f64.min(0.5 / h))?)?)
        }
    }
}

struct Replay<'a> {
    recording: &'a Recording,
    keep: &'a mut dyn FnMut(usize) -> bool,
    rotor: KenneRotorResistance<f64>,
    both: KenneResistances<f64>,
}

impl Replay<'_> {
    fn through<F: Identifier<f64, 4, Input = Sample<f64>>>(&mut self, follower: F) -> Result<Vec<ReplayRow>, ModelError> {
        let r = self.recording;
        let mut states = (self.rotor.start(), self.both.start(), follower.start());
        let mut rows = Vec::new();
        // Row k measures at t_k; the voltage of row k − 1 acted until then.
        for k in 1..r.len() {
            let sample = Sample { i_s: r.i_s[k], u_s: r.u_s[k - 1], omega_m: r.omega_m[k] };
            let rotor = self.rotor.step(&mut states.0, &sample);
            let both = self.both.step(&mut states.1, &sample);
            let regulation = follower.step(&mut states.2, &sample);
            if (self.keep)(k) {
                rows.push(ReplayRow { time_s: r.time_s(k), rotor, both, regulation });
            }
        }
        Ok(rows)
    }
}
