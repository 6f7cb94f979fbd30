//! What a report says: models, recordings with what each model says, where they fail, and the sentences. HTML and terminal share it.

use im_identify::offline::{Channel, Experiment, predict, start_on};
use im_model::{EffectId, MotorFile, Prediction, State};
use rayon::prelude::*;

use super::electrical_words;
use super::signals::SignalTable;
use super::words::{effect_name, in_sigma, sets_words, short_effect_name};
use super::{Meta, Used};
use crate::diagnosis::{Candidate, Diagnosis, Doubt, Step, Verdict};
use crate::format::{number, quantity};
use crate::left_error::{Left, half_widths};
use crate::localise::{Localisation, Signals, join, localise};
use crate::residual_tests::Dependence;
use crate::residuals::{Errors, UNSTABLE, any_nudged, errors, judged, nudged};
use crate::search::{Model, Stage};

/// Part of the last held-out error below which an earlier one is told.
const ONCE_LOWER: f64 = 0.9;

/// A model in the pictures.
#[derive(Clone, Debug)]
pub(crate) struct Shown {
    /// Its name in legends.
    pub name: &'static str,
    /// Its class in the style sheet.
    pub class: &'static str,
    /// Where it fails.
    pub place: Localisation,
}

/// A recording with what the models say.
#[derive(Clone, Debug)]
pub(crate) struct View {
    /// The recording as it is judged.
    pub experiment: Experiment,
    /// Whether no fit has seen it.
    pub held_out: bool,
    /// Which of the training recordings it is.
    pub number: Option<usize>,
    /// Whether the simulated speed is nudged towards the measured one.
    pub nudged: bool,
    /// Per model, per channel.
    pub predictions: Vec<Vec<Vec<f64>>>,
    /// State of the last model at the first row.
    pub start: State<f64>,
    /// Per channel: half the width of the band of prediction of the last model; empty where no fit says how far off it is.
    pub band: Vec<Vec<f64>>,
    /// Whether the uncertainty of the parameters is part of the band.
    pub with_parameters: bool,
}

impl View {
    /// The part of the band that is what a model leaves, channel by channel.
    pub(super) fn left_band(&self, prediction: Option<&Prediction>) -> Vec<Vec<f64>> {
        self.predictions.last().map_or_else(Vec::new, |p| half_widths(&self.experiment, p, prediction))
    }

    /// How many readings lie in the band, and how many there are.
    pub(super) fn inside(&self) -> (usize, usize) {
        let each = (0..self.band.len()).map(|c| (self.inside_of(c), self.compared(c).len()));
        each.fold((0, 0), |(inside, all), (i, n)| (inside + i, all + n))
    }

    /// The same of one channel.
    pub(super) fn inside_of(&self, c: usize) -> usize {
        let (Some(modelled), values) = (self.predictions.last(), &self.experiment.channels[c].values) else { return 0 };
        let lies = |k: &usize| (values[*k] - modelled[c][*k]).abs() <= self.band[c][*k];
        self.compared(c).into_iter().filter(lies).count()
    }

    /// Rows of a channel in which the last model can be held against a reading.
    pub(super) fn compared(&self, c: usize) -> Vec<usize> {
        let (channel, modelled) = (&self.experiment.channels[c], self.predictions.last());
        let rows = |p: &Vec<Vec<f64>>| (0..p[c].len()).filter(|&k| channel.is_valid(k) && p[c][k].is_finite()).collect();
        modelled.map_or_else(Vec::new, rows)
    }

    /// What the last model leaves.
    pub(super) fn left(&self) -> Left {
        self.predictions.last().map_or_else(Left::default, |p| Left::of(&self.experiment, p))
    }
}

/// Everything a report of a diagnosis needs: made once for page, terminal and files.
pub struct Story<'a> {
    pub(crate) d: &'a Diagnosis,
    pub(crate) meta: &'a Meta,
    /// Error of the motor as given, where it can be simulated.
    pub(crate) given: Option<(Errors, Option<Errors>)>,
    pub(crate) shown: Vec<Shown>,
    /// Recordings over time.
    pub(crate) views: Vec<View>,
    /// Tables of steady states.
    pub(crate) tables: Vec<View>,
}

impl<'a> Story<'a> {
    /// Simulates what the report shows.
    pub fn new(d: &'a Diagnosis, meta: &'a Meta) -> Self {
        let (first, last) = (&d.steps[0], &d.steps[d.steps.len() - 1]);
        let models = if d.steps.len() > 1 { vec![first, last] } else { vec![last] };
        let starts = |of: &dyn Fn(&Step) -> State<f64>| models.iter().map(|m| of(m)).collect::<Vec<_>>();
        let train = d.case.train.iter().enumerate().map(|(k, e)| (e, Some(k), starts(&|m| m.starts[k])));
        let held_out = d.case.holdout.iter().map(|h| (h, None, starts(&|m| m.holdout_start.unwrap_or_default())));
        let recordings: Vec<_> = train.chain(held_out).collect();
        let view = |(e, number, starts): (&Experiment, Option<usize>, Vec<State<f64>>)| {
            let experiment = judged(e, &last.machine, &starts[starts.len() - 1], UNSTABLE);
            let nudged = experiment.speed_nudge.is_some();
            let predictions = models.iter().zip(&starts).map(|(m, x)| predict(&m.machine, &experiment, x)).collect();
            let start = starts[starts.len() - 1];
            View {
                experiment,
                held_out: number.is_none(),
                number,
                nudged,
                predictions,
                start,
                band: Vec::new(),
                with_parameters: false,
            }
        };
        // Where a model fails is looked for with the speed nudged, so that one error does not hide behind another.
        let nudged_runs = nudged(&d.case.train);
        let course = [&d.course.first().model, &d.course.last().model];
        let names: &[(&'static str, &'static str)] = if models.len() > 1 {
            &[("base model", "base"), ("refined model", "refined")]
        } else {
            &[("refitted model", "refined")]
        };
        let shown = |(&(name, class), m): (&(&'static str, &'static str), &&Model)| {
            let place = localise(&Signals::of(&m.fit.machine, &nudged_runs, &m.fit.starts));
            Shown { name, class, place }
        };
        let (views, shown) = rayon::join(
            || recordings.into_par_iter().map(view).collect::<Vec<View>>(),
            || names.par_iter().zip(course.par_iter()).map(shown).collect(),
        );
        let (tables, views): (Vec<View>, Vec<View>) = views.into_iter().partition(|v| v.experiment.is_table());
        let of = |held_out: bool| {
            let all = views.iter().chain(&tables).filter(|v| v.held_out == held_out);
            all.map(|v| v.experiment.clone()).collect::<Vec<_>>()
        };
        let as_given = |e: &[Experiment]| {
            let MotorFile { machine, rating, .. } = &d.case.motor;
            let starts: Vec<State<f64>> = e.par_iter().map(|e| start_on(machine, e, rating)).collect();
            errors(machine, e, &starts)
        };
        let (train, held) = (of(false), of(true));
        let (given, unseen) = rayon::join(|| as_given(&train), || (!held.is_empty()).then(|| as_given(&held)));
        let given = given.chi2_per_sample.is_finite().then_some((given, unseen));
        Self { d, meta, given, shown, views, tables }
    }

    /// The recordings over time with the band of prediction of the last model: for pages alone, as it costs what a step of a fit costs.
    pub(crate) fn views_with_bands(&self) -> Vec<View> {
        let machine = &self.d.steps[self.d.steps.len() - 1].machine;
        let band = |v: &View| {
            let mut band = v.left_band(self.d.refined.prediction.as_ref());
            let parameters = self.d.estimates.band_of_parameters(machine, &v.experiment, &v.start, v.number);
            for (w, p) in band.iter_mut().flatten().zip(parameters.iter().flatten()) {
                *w = w.hypot(*p);
            }
            band
        };
        self.views.par_iter().map(|v| View { band: band(v), with_parameters: true, ..v.clone() }).collect()
    }

    /// Measured, modelled by the last model, and residual, sample by sample.
    pub fn signals(&self) -> SignalTable {
        let machine = &self.d.steps[self.d.steps.len() - 1].machine;
        let mut table = SignalTable::default();
        for v in self.views.iter().chain(&self.tables) {
            table.add(machine, &v.start, &v.experiment, &v.predictions[v.predictions.len() - 1]);
        }
        table
    }

    /// Every channel of the recordings, once.
    pub(crate) fn channels(&self) -> Vec<&Channel> {
        let mut out: Vec<&Channel> = Vec::new();
        for c in self.views.iter().chain(&self.tables).flat_map(|v| &v.experiment.channels) {
            if out.iter().all(|o| o.name != c.name) {
                out.push(c);
            }
        }
        out
    }

    /// The noise of a channel over all recordings, as its errors are taken.
    pub(crate) fn noise_of(&self, c: &Channel) -> f64 {
        self.d.noise.get(&c.name).copied().unwrap_or(c.sigma)
    }

    /// The model that fails: the base model.
    pub(crate) fn base(&self) -> &Shown {
        &self.shown[0]
    }

    /// The title.
    pub(crate) fn title(&self) -> String {
        if self.meta.title.is_empty() { self.d.case.motor.name.clone() } else { self.meta.title.clone() }
    }

    /// The recordings, to be recognized.
    pub(crate) fn used(&self) -> Vec<Used> {
        let train = self.d.case.train.iter().map(|e| Used::of(e, "training"));
        train.chain(self.d.case.holdout.iter().map(|e| Used::of(e, "held out"))).collect()
    }

    /// Held-out error where there is one, else the training error: of the base model and of the last one, with the word for it.
    pub(crate) fn fall(&self) -> (f64, f64, &'static str) {
        let (a, b) = (&self.d.steps[0], &self.d.steps[self.d.steps.len() - 1]);
        match (&a.holdout, &b.holdout) {
            (Some(x), Some(y)) => (x.chi2_per_sample, y.chi2_per_sample, "held-out"),
            _ => (a.train.chi2_per_sample, b.train.chi2_per_sample, "training"),
        }
    }

    /// Where fewer of the effects leave a lower error on the held-out recording: with which, and how much.
    fn once_lower(&self) -> String {
        let steps = &self.d.steps;
        let of = |step: &Step| step.holdout.as_ref().map(|h| h.chi2_per_sample);
        let least = steps[1..].iter().filter_map(|s| Some((of(s)?, s))).min_by(|a, b| a.0.total_cmp(&b.0));
        match least.zip(of(&steps[steps.len() - 1])) {
            Some(((least, step), last)) if least < ONCE_LOWER * last => {
                format!(" (with {} alone to {})", names(&step.effects), in_sigma(least))
            }
            _ => String::new(),
        }
    }

    /// Effects that these recordings cannot show.
    pub(crate) fn unexcited(&self) -> Vec<&Candidate> {
        unexcited(self.d)
    }
}

/// Effects that these recordings cannot show at any usual size.
pub(crate) fn unexcited(d: &Diagnosis) -> Vec<&Candidate> {
    d.ranking.iter().filter(|c| !c.excited).collect()
}

/// The candidates in the order of a reader's interest: those added, as they were added; then by score over threshold.
pub(crate) fn candidates(d: &Diagnosis) -> Vec<&Candidate> {
    let mut all: Vec<&Candidate> = d.ranking.iter().collect();
    let place = |c: &Candidate| d.effects.iter().position(|e| *e == c.effect).unwrap_or(usize::MAX);
    let over = |c: &Candidate| c.score / c.threshold;
    all.sort_by(|a, b| place(a).cmp(&place(b)).then(over(b).total_cmp(&over(a))));
    all
}

/// The verdict in words, with a sign that does not need colour.
pub(crate) fn verdict_words(v: Verdict) -> (&'static str, &'static str) {
    match v {
        Verdict::Adequate => ("✓", "adequate"),
        Verdict::MissingEffects => ("◆", "missing effect found"),
        Verdict::Confounded => ("◇", "confounded"),
        Verdict::Inconclusive => ("?", "inconclusive"),
        Verdict::Unexplained => ("!", "unexplained"),
    }
}

/// The story in three answers.
pub(crate) struct Summary {
    /// The cause, in one sentence.
    pub cause: String,
    /// What has to be said beside it.
    pub beside: Option<String>,
    /// What the electrical side alone says.
    pub electrical: Option<String>,
    /// How sure.
    pub sure: Vec<String>,
    /// What would refute it.
    pub refute: Vec<String>,
}

fn names(effects: &[EffectId]) -> String {
    join(&effects.iter().map(|e| effect_name(*e)).collect::<Vec<_>>())
}

fn times(n: i32) -> String {
    if n == 1 { "once".into() } else { format!("{n} times") }
}

/// What a residual depends on, as a phrase.
pub(crate) fn dependence_words(x: &Dependence) -> String {
    use crate::residual_tests::Variable as V;
    let part = x.part.label().split(',').next().unwrap_or_default().to_owned();
    let unit = x.part.label().rsplit(", ").next().unwrap_or_default();
    let on = match x.variable {
        V::RotorAngle(n) => format!("the rotor angle, {} per revolution", times(n)),
        V::CurrentAngle(n) => format!("the angle of the stator current, {} per period", times(n)),
        v => format!("the {}", v.label().split(',').next().unwrap_or_default()),
    };
    format!("the error in {part} depends on {on} ({} rms)", quantity(x.size, unit, 2))
}

/// Of what is surely there, the dependence that makes up the largest error against the sensor's noise.
pub(crate) fn main_dependence(d: &Diagnosis) -> Option<&Dependence> {
    let noise = |x: &Dependence| {
        let speed = x.part == crate::residual_tests::Part::Speed;
        let of = d.noise.iter().filter(|(name, _)| name.starts_with("omega") == speed).map(|(_, s)| *s);
        of.fold(0.0, f64::max).max(1e-300)
    };
    let sure = d.dependences.iter().filter(|x| x.log_p > 6.0);
    sure.max_by(|a, b| (a.size / noise(a)).total_cmp(&(b.size / noise(b)))).or(d.dependences.first())
}

/// The three answers.
pub(crate) fn summary(s: &Story) -> Summary {
    let d = s.d;
    let (before, after, which) = s.fall();
    let fall = if after < before {
        format!("brings the {which} error from {} to {} rms{}", in_sigma(before), in_sigma(after), s.once_lower())
    } else {
        format!("does not lower the {which} error ({} rms, {} before)", in_sigma(after), in_sigma(before))
    };
    let is = |n: usize| if n == 1 { "is" } else { "are" };
    let nudged = if any_nudged(&d.case.train) { " with the speed nudged towards the measured one" } else { "" };
    let mut sure = Vec::new();
    let mut refute = Vec::new();
    let cause = match d.verdict {
        Verdict::MissingEffects => {
            format!(
                "{} {} missing from the model: adding {} {fall}",
                names(&d.effects),
                is(d.effects.len()),
                if d.effects.len() == 1 { "it" } else { "them" }
            )
        }
        Verdict::Confounded => {
            format!(
                "something is missing that these recordings do not let us name alone: {}. Adding {} {fall}",
                sets_words(&d.effects, &d.alternatives),
                match (d.effects.len(), d.alternatives[0].len()) {
                    (1, 1) => "either",
                    (1, _) => "any one of them",
                    _ => "them, with one of the rivals,",
                }
            )
        }
        Verdict::Unexplained => {
            let found = main_dependence(d).map_or("it shows no simple dependence".into(), dependence_words);
            let better = ["explains it better than the library", "explain it better than the library"];
            let curves = curves_words(d, "", better).map_or_else(String::new, |w| format!("; {w}"));
            let there = d.named();
            let missing = match there.len() {
                0 => "something is missing".to_owned(),
                n => format!("{} {} missing, and beside {} something", names(there), is(n), if n == 1 { "it" } else { "them" }),
            };
            format!("{missing} that the library of effects does not hold: {found}{curves}")
        }
        Verdict::Inconclusive => {
            let (error, but) = (in_sigma(after), doubts(s).join("; "));
            format!("these recordings cannot decide: nothing is seen to be missing ({which} error {error} rms), but {but}")
        }
        Verdict::Adequate => {
            format!(
                "nothing is missing: with its parameters refitted the model explains the recordings down to the sensor noise ({which} error {} rms)",
                in_sigma(after)
            )
        }
    };
    let beside = match d.verdict {
        Verdict::Unexplained if !d.effects.is_empty() && after < before => {
            Some(format!("adding {} {fall}; {}", names(&d.effects), beside_unknown_words(d)))
        }
        Verdict::MissingEffects | Verdict::Confounded => rest(d),
        _ => None,
    };
    sure.extend(likelihood(d));
    // Nothing speaks for an effect that may only imitate an unknown cause.
    for (k, &e) in d.effects.iter().enumerate().filter(|(_, e)| d.named().contains(e)) {
        let Some(Stage { round, .. }) = d.course.stages.get(k) else { continue };
        let mut words: Vec<String> = Vec::new();
        if let Some(score) = round.scores.iter().find(|x| x.effect == e) {
            let threshold = d.ranking.iter().find(|c| c.effect == e).map_or(f64::NAN, |c| c.threshold);
            if score.score > threshold {
                words.push(format!(
                    "its mark is in the error, and no other values of the parameters leave it (score {}; chance alone reaches {})",
                    number(score.score, 3),
                    number(threshold, 2)
                ));
            }
        }
        let model = |k: usize| d.course.stages.get(k).map(|s| &s.model);
        let train = |k: usize| model(k).map_or(f64::NAN, Model::train);
        let (without, with) = (train(k), train(k + 1));
        let others = round.trials.iter().filter(|t| t.effect != e && !d.effects.contains(&t.effect));
        let rival = others.min_by(|a, b| a.model.train().total_cmp(&b.model.train()));
        if let (true, Some(&next)) = (with >= without, d.effects.get(k + 1)) {
            let next = short_effect_name(next);
            words.push(format!("without {next} beside it a refit does not want it: the two were found together"));
        } else if let Some(rival) = rival {
            let (name, its, own) = (short_effect_name(rival.effect), in_sigma(rival.model.train()), in_sigma(with));
            let unseen = rival.model.holdout.zip(model(k + 1).and_then(|m| m.holdout)).filter(|(rival, own)| rival > own);
            // Nothing is made of a difference that does not show.
            words.push(if rival.model.train() >= 0.98 * with {
                format!("refitted{nudged}, it leaves {own} rms in training, the next best ({name}) {its}")
            } else if k + 1 < d.effects.len() {
                let all = in_sigma(train(d.effects.len()));
                format!(
                    "by itself {name} leaves less ({its} rms in training{nudged}, against {own}), but with what was added after it only {all} are left, which {name} does not reach"
                )
            } else if let Some((rival, own_unseen)) = unseen {
                format!(
                    "{name} leaves less in training ({its} rms{nudged}, against {own}), but more of the held-out recording ({}, against {})",
                    in_sigma(rival),
                    in_sigma(own_unseen)
                )
            } else {
                format!(
                    "{name} leaves less ({its} rms in training{nudged}, against {own}), but is less likely: more parameters, or less of what is left is like noise"
                )
            });
        }
        if !words.is_empty() {
            sure.push(format!("{}: {}", crate::format::sentence(&short_effect_name(e)).trim_end_matches('.'), words.join("; ")));
        }
        let card = e.card();
        let behaves = if EffectId::ALL.contains(&e) {
            format!("behave there as its card says (im effects show {})", e.name())
        } else {
            "follow its curve there".to_owned()
        };
        refute.push(format!("{} The error has to {behaves}; if it does not, this is not the cause.", test_of(e)));
        for a in &d.alternatives[k] {
            if let Some((_, how)) = card.rivals.iter().find(|r| r.0 == a.name()) {
                refute.push(format!("Against {}: {how}.", effect_name(*a)));
            } else {
                refute.push(format!("Against {}: {}", effect_name(*a), a.card().test));
            }
        }
    }
    match d.verdict {
        Verdict::Adequate => {
            if let Some(c) = candidates(d).first() {
                let why = if c.score > c.threshold { format!(": {}", c.conclusion) } else { String::new() };
                sure.push(format!(
                    "of {} effects {} stands out most, with a score of {}, where chance alone reaches {}{why}",
                    d.ranking.len(),
                    short_effect_name(c.effect),
                    number(c.score, 3),
                    number(c.threshold, 2)
                ));
            }
            let hidden = s.unexcited();
            if !hidden.is_empty() {
                sure.push(format!(
                    "not excited by these recordings, hence not excluded: {}",
                    join(&hidden.iter().map(|c| short_effect_name(c.effect)).collect::<Vec<_>>())
                ));
            }
            refute.push("A recording in another corner (higher flux, higher slip, standstill, longer time) whose error rises above the noise of the sensors.".into());
        }
        Verdict::Unexplained => {
            sure.push(format!("the {which} error stays at {} rms after every effect of the library was tried", in_sigma(after)));
            if let Some(x) = main_dependence(d) {
                sure.push(format!("that the dependence is chance has a probability {}", crate::format::chance(x.log_p)));
            }
            refute.push("An effect written by you, with the shape shown below, that brings the error down to the noise of the sensors on the held-out recording too.".into());
        }
        Verdict::Inconclusive => {
            if d.doubts.contains(&Doubt::HeldOutMissed) {
                refute.push(
                    "A recording of the kind of the held-out one among those to train on, and another one held out.".to_owned(),
                );
            }
            for c in s.unexcited().into_iter().take(6) {
                refute.push(format!(
                    "{}: {}",
                    crate::format::sentence(&short_effect_name(c.effect)).trim_end_matches('.'),
                    c.effect.card().test
                ));
            }
        }
        Verdict::MissingEffects if d.case.holdout.is_none() => {
            refute.push("No recording was held out: on one of another manoeuvre the error has to fall as well.".into());
        }
        _ => {}
    }
    let sentence = crate::format::sentence;
    let alone = s.d.electrical_side.as_ref().map(electrical_words::words);
    let cause = alone.as_ref().and_then(|a| a.cause.clone()).unwrap_or(cause);
    if let Some(more) = alone.as_ref().and_then(|a| a.refute.clone()) {
        refute = vec![more];
    }
    Summary {
        cause: sentence(&cause),
        beside: beside.map(|t| sentence(&t)),
        electrical: alone.map(|a| sentence(&a.beside)),
        sure: sure.iter().map(|t| sentence(t)).collect(),
        refute,
    }
}

/// Why the recordings cannot decide.
fn doubts(s: &Story) -> Vec<String> {
    let d = s.d;
    let mut all = Vec::new();
    let mut open = Vec::new();
    for doubt in &d.doubts {
        match *doubt {
            Doubt::HeldOutMissed => {
                all.push("the held-out recording is missed: it shows something that the training recordings do not".to_owned())
            }
            Doubt::NotExcited => all.push(format!(
                "{} of {} effects would not have shown in them at any usual size",
                s.unexcited().len(),
                d.ranking.len()
            )),
            Doubt::Hint(e) => {
                all.push(format!("{} would explain a little more than chance does, too little to be confirmed", effect_name(e)));
            }
            Doubt::Undetermined(p) => open.push(format!("{} ({})", p.symbol(), p.key())),
        }
    }
    if !open.is_empty() {
        all.push(format!("they tell {} no better than to 10 %", join(&open)));
    }
    all
}

/// What is known of effects beside an unknown cause.
fn beside_unknown_words(d: &Diagnosis) -> String {
    let (there, other): (Vec<EffectId>, Vec<EffectId>) = d.effects.iter().partition(|e| d.named().contains(e));
    if there.is_empty() {
        let they = if other.len() == 1 { "it" } else { "they" };
        return format!("beside an unknown cause {they} may only imitate it");
    }
    let (are, change) = if there.len() == 1 { ("is", "it changes") } else { ("are", "they change") };
    let other = if other.is_empty() { String::new() } else { format!("; {} may only imitate that cause", names(&other)) };
    format!(
        "{} {are} there whatever the unknown cause is, as less than a tenth (mean square) is left of what {change}{other}",
        names(&there)
    )
}

/// How sure the data are of the effects named, among the sets tried.
fn likelihood(d: &Diagnosis) -> Option<String> {
    if d.verdict == Verdict::Unexplained {
        return None;
    }
    let posterior = &d.course.posterior;
    let own = posterior.set(d.named()).filter(|s| !s.effects.is_empty())?;
    let next = posterior.likely().find(|s| !s.is(&own.effects));
    let next = next.map_or_else(String::new, |s| match s.effects.len() {
        0 => format!("; that nothing is missing has {}", probability(s.probability)),
        _ => format!("; the next, {}, has {}", names(&s.effects), probability(s.probability)),
    });
    let (tried, own) = (posterior.sets.len(), probability(own.probability));
    Some(match d.verdict {
        Verdict::Confounded => {
            "rivals fit the recordings as well; one with more parameters is only the less probable explanation for that"
                .to_owned()
        }
        _ => format!("of {tried} sets of effects tried, this one has a probability of {own}{next}"),
    })
}

/// A probability in words of a few digits; certainty is never claimed.
pub(crate) fn probability(p: f64) -> String {
    match p {
        p if p > 0.999 => "more than 0.999".into(),
        p if p < 0.001 => "less than 0.001".into(),
        p => format!("{p:.3}"),
    }
}

/// What the parameters and all that follows from them rest on, where the answer leaves something open.
pub(crate) fn rests_on(s: &Story) -> Option<String> {
    let d = s.d;
    let hidden = s.unexcited().len();
    match d.verdict {
        Verdict::Unexplained => Some(
            "Something is missing that is not in the model: the parameters have taken up part of what it does, and may be farther off than \
             their intervals say."
                .to_owned(),
        ),
        Verdict::Inconclusive if hidden > 0 => Some(format!(
            "{hidden} effects of the library cannot show in these recordings. If one of them is there, the parameters have taken up what it \
             does, and are farther off than their intervals say; so is what follows from them where nothing was recorded."
        )),
        Verdict::Confounded => {
            Some("With a rival in its place the parameters, and what follows from them, are others than here.".to_owned())
        }
        _ => None,
    }
}

/// What curves of no known form do, one or several.
fn curves_words(d: &Diagnosis, beside: &str, acts: [&str; 2]) -> Option<String> {
    match d.curves.len() {
        0 => None,
        1 => Some(format!("a curve of no known form{beside}, {}, {} (im learn draws it)", names(&d.curves), acts[0])),
        _ => Some(format!("curves of no known form{beside}, {}, {} (im learn draws them)", names(&d.curves), acts[1])),
    }
}

/// Said beside what was found, where the error that stays is more than noise.
fn rest(d: &Diagnosis) -> Option<String> {
    let r = d.residual_cause.as_ref()?;
    let suspect = match r.suspect {
        Some(e) => {
            format!(
                "the next suspect, not confirmed, is {} ({} rms in training with it)",
                effect_name(e),
                in_sigma(r.with_suspect)
            )
        }
        None => curves_words(d, " beside it", ["makes the recordings likelier", "make the recordings likelier"])
            .unwrap_or_else(|| "no effect of the library stands out as its cause".into()),
    };
    Some(format!(
        "what stays is still more than noise: something smaller is missing, or what was added has another form in the machine; {suspect}"
    ))
}

fn test_of(e: EffectId) -> String {
    format!("{}: {}", crate::format::sentence(&short_effect_name(e)).trim_end_matches('.'), e.card().test)
}
