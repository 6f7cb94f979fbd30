//! Which instant a voltage belongs to, where nobody has said: the model is fitted with it held from its row, as a drive commands it, and
//! with it sampled at its row, as a voltmeter shows it, and the better one is taken. What its name says stands unless the model explains the data, and
//! clearly better otherwise: without the effects that are missing a fit does not know better.

use im_identify::offline::{Experiment, FitOptions, base_parameters_in, fit, guess_start, start_on, start_parameters};
use im_model::MotorFile;

use super::load_plan::LoadPlan;
use super::mapping::Instant;
use super::quality::convention::is_mains;
use crate::noise::white_sigma;
use crate::residuals::{FITS, nudged};

/// The mean square of the better fit must be below this part of the other's.
const CLEARLY: f64 = 0.9;
/// Rows that decide: some seconds, start included.
const ROWS: usize = 30_000;

/// How the two fit.
pub struct Choice {
    /// The better one, or held from the row where the data do not decide.
    pub instant: Instant,
    /// What was found, in a sentence.
    pub sentence: String,
}

/// Mean square of the residual, in σ², of the refitted model.
fn misfit(e: &Experiment, load: LoadPlan, motor: &MotorFile) -> Option<f64> {
    let mut e = e.clone();
    let rows = e.len().min(ROWS);
    e.u_s.truncate(rows);
    e.tau_load.truncate(rows);
    e.imposed_speed.iter_mut().for_each(|w| w.truncate(rows));
    for c in &mut e.channels {
        c.values.truncate(rows);
        c.valid.iter_mut().for_each(|v| v.truncate(rows));
        c.sigma = white_sigma(&c.values).max(1e-9);
    }
    e.start = guess_start(&e);
    let e = match load {
        LoadPlan::Unknown | LoadPlan::Unseen => load.apply(e, motor),
        LoadPlan::Known | LoadPlan::Law { .. } => e,
    };
    let mut all = nudged(&[e]);
    let e = &mut all[0];
    if let im_identify::offline::Start::Estimated(_) = e.start {
        e.start = im_identify::offline::Start::Estimated(start_on(&motor.machine, e, &motor.rating));
    }
    let mut free = base_parameters_in(&motor.machine, &all);
    free.extend(start_parameters(&all, &motor.rating, motor.machine.effects().any_fixed_to_shaft()));
    let options = FitOptions { iterations: 12, tolerance: 1e-3, ..FitOptions::default() };
    let found = fit(&motor.machine, &all, &free, &options).ok()?;
    Some(found.chi2_per_sample()).filter(|x| x.is_finite())
}

/// Whether samples explain the data, and clearly better than a held voltage.
fn refutes(held: Option<f64>, sample: Option<f64>) -> bool {
    sample.is_some_and(|s| s < FITS && held.is_none_or(|h| s < CLEARLY * h))
}

/// The better of the two: `experiment` makes the experiment with an instant; `held_by_name` is why the voltage's name says that it is held.
pub fn choose(
    experiment: impl Fn(Instant) -> Experiment,
    load: LoadPlan,
    motor: &MotorFile,
    held_by_name: Option<&str>,
) -> Choice {
    let [held, sample] = [Instant::HeldFromRow, Instant::Sample].map(|i| misfit(&experiment(i), load, motor));
    let better = |best: f64, other: f64, word: &str| {
        let number = |x: f64| crate::format::number(x.sqrt(), 3);
        let far = ". Neither is near the noise: something else is missing or wrong, and may have decided this. Ask who recorded it; the other one is worth a try where a diagnosis ends unexplained";
        let far = if best > FITS { far } else { "" };
        format!("refitted, the model fits better so, {} σ rms against {} σ with {word:?}{far}", number(best), number(other))
    };
    let by_name = held_by_name.filter(|_| !refutes(held, sample));
    let (instant, why) = match (by_name, held, sample) {
        (Some(why), ..) => (Instant::HeldFromRow, why.to_owned()),
        (_, Some(h), Some(s)) if s < CLEARLY * h => (Instant::Sample, better(s, h, "held_from_row")),
        (_, Some(h), Some(s)) if h < CLEARLY * s => (Instant::HeldFromRow, better(h, s, "sample")),
        // A voltmeter's samples: nobody commands the mains.
        _ if is_mains(motor, &experiment(Instant::Sample)) => (
            Instant::Sample,
            "these data do not decide, and it is that of the mains. For what a drive commands, write \"held_from_row\"".to_owned(),
        ),
        _ => (
            Instant::HeldFromRow,
            "these data do not decide. That is right for what a drive commands; for what a voltmeter or an oscilloscope shows, write \
             \"sample\""
                .to_owned(),
        ),
    };
    Choice { instant, sentence: format!("The voltages are taken as {:?}: {why}", instant.word()) }
}
