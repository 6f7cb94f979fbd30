//! Which instant a voltage belongs to, where nobody has said: held from its row, as a drive commands it, or sampled at its row, as a voltmeter shows
//! it. The model is fitted with both and half way between: the data speak for one where it fits clearly better, and as well as anywhere on the way. What
//! the column is by name stands unless they speak for the other, and the model explains them: where effects are missing a fit does not know better.
//! Where neither says, the mains are samples. With the noise of a voltmeter they are, whatever a fit says.

use im_identify::offline::{Experiment, FitOptions, base_parameters_in, fit, guess_start, start_on, start_parameters};
use im_model::MotorFile;

use super::load_plan::LoadPlan;
use super::mapping::Instant;
use super::quality::supply::is_mains;
use super::quality::voltage_noise::is_metered;
use crate::noise::white_sigma;
use crate::residuals::{FITS, nudged};

/// The mean square of the better fit must be below this part of the other's.
const CLEARLY: f64 = 0.9;
/// So near to an instant, in the way from one to the other, the best fit lies that speaks for it.
const NEAR: f64 = 0.25;
/// Rows that decide: some seconds, start included.
const ROWS: usize = 30_000;

const FAR: &str = ". Neither is near the noise: something else is missing or wrong, and may have decided this. Ask who recorded it; the other one is worth a try where a diagnosis ends unexplained";

const OPEN: &str = "these data do not decide. That is right for what a drive commands; for what a voltmeter or an oscilloscope shows, write \"sample\"";

const METERED: &str = "they are the mains with the noise of a voltmeter, which shows the same instant as the currents. For means from row to row write \"held_from_row\"";

/// The instant that was chosen.
pub struct Choice {
    /// The better one, or held from the row where the data do not decide.
    pub instant: Instant,
    /// What was found, in a sentence.
    pub sentence: String,
}

impl Choice {
    fn new(instant: Instant, why: &str) -> Self {
        Self { instant, sentence: format!("The voltages are taken as {:?}: {why}", instant.word()) }
    }
}

/// Mean square of the residual, in σ², of the refitted model.
fn misfit(mut e: Experiment, load: LoadPlan, motor: &MotorFile) -> Option<f64> {
    e.end_after(ROWS);
    for c in &mut e.channels {
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

/// What a column's name says of its voltage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Named {
    /// A name of this project's files, whose voltages are means from their row to the next.
    Mean,
    /// What a drive commands.
    Command,
}

/// The instant that a voltage has by what its columns are, and why; `rows` has it as it stands in them.
fn expected(named: Option<Named>, motor: &MotorFile, rows: &Experiment) -> Option<(Instant, &'static str)> {
    match named {
        Some(Named::Command) => Some((Instant::HeldFromRow, "a drive holds what it commands")),
        Some(Named::Mean) => Some((Instant::HeldFromRow, "columns of these names are means from their row to the next")),
        None if is_mains(motor, rows) => {
            Some((Instant::Sample, "nobody commands the mains. For means from row to row write \"held_from_row\""))
        }
        None => None,
    }
}

/// How the refitted model fits with a voltage that is held, that is sampled, and half way between; in σ².
struct Misfits {
    held: f64,
    sample: f64,
    /// Where on the way from held, 0, to sampled, 1, it fits best: elsewhere, where what is missing imitates a delay.
    best: f64,
}

impl Misfits {
    fn of(held: Experiment, sample: Experiment, load: LoadPlan, motor: &MotorFile) -> Option<Self> {
        let mut half = held.clone();
        half.u_s.iter_mut().zip(&sample.u_s).for_each(|(u, s)| *u = (*u + s) * 0.5);
        let [h, s, m] = [held, sample, half].map(|e| misfit(e, load, motor));
        let (held, sample, half) = (h?, s?, m?);
        // The parabola through the three.
        let bend = held + sample - 2.0 * half;
        Some(Self { held, sample, best: 0.5 + (held - sample) / (4.0 * bend) })
    }

    /// The instant for which the data speak: the model fits clearly better with it, and as well as anywhere on the way.
    fn decided(&self) -> Option<Instant> {
        let near = |x: f64| (self.best - x).abs() < NEAR;
        if self.sample < CLEARLY * self.held && near(1.0) {
            Some(Instant::Sample)
        } else {
            (self.held < CLEARLY * self.sample && near(0.0)).then_some(Instant::HeldFromRow)
        }
    }

    /// Whether the model explains the data with one of them.
    fn fits(&self) -> bool {
        self.held.min(self.sample) < FITS
    }
}

/// The better of the two: `experiment` makes the experiment with an instant; `named` is what its columns are by name.
pub fn choose(experiment: impl Fn(Instant) -> Experiment, load: LoadPlan, motor: &MotorFile, named: Option<Named>) -> Choice {
    let (held, sample) = (experiment(Instant::HeldFromRow), experiment(Instant::Sample));
    if named != Some(Named::Command) && is_metered(motor, &held) {
        return Choice::new(Instant::Sample, METERED);
    }
    let expected = expected(named, motor, &held);
    let misfits = Misfits::of(held, sample, load, motor);
    let decided = misfits.as_ref().and_then(|m| Some((m.decided()?, m)));
    let speaks = |(instant, m): &(Instant, &Misfits)| named.is_none() || m.fits() || expected.is_some_and(|x| x.0 == *instant);
    let (instant, why) = match (decided.filter(speaks), expected) {
        (Some((instant, m)), _) => {
            let (best, other, word) = match instant {
                Instant::Sample => (m.sample, m.held, "held_from_row"),
                _ => (m.held, m.sample, "sample"),
            };
            let number = |x: f64| crate::format::number(x.sqrt(), 3);
            let far = if m.fits() { "" } else { FAR };
            let why = format!(
                "refitted, the model fits better so, {} σ rms against {} σ with {word:?}{far}",
                number(best),
                number(other)
            );
            (instant, why)
        }
        (None, Some((instant, why))) => (instant, why.to_owned()),
        (None, None) => (Instant::HeldFromRow, OPEN.to_owned()),
    };
    Choice::new(instant, &why)
}
