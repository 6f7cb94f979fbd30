//! The report of a model against recordings, without a diagnosis.

use im_identify::offline::{Experiment, predict, start_on};
use im_model::{MotorFile, State};
use maud::html;
use rayon::prelude::*;
use serde_json::json;

use super::overlay::{self, channel_words};
use super::page::{Row, Section, head, numbers, page, table, term, words};
use super::sections::{load_section, place, provenance};
use super::signals::SignalTable;
use super::story::{Shown, View};
use super::terminal::{Text, loads as loads_text, place as place_text};
use super::words::{file_name, in_sigma, voltage_noise};
use super::{Meta, Used};
use crate::case::Case;
use crate::consistency;
use crate::format::{number, sentence};
use crate::intake::joined;
use crate::intake::{Finding, FindingKind, Intake, Severity, findings};
use crate::left_error::half_widths;
use crate::loads::Loads;
use crate::localise::{Signals, localise};
use crate::residuals::{Errors, FITS, any_nudged, errors, nudged};
use crate::sources::{Refused, followed, meaningful};
use crate::steady_curve::{self, RatedSupply};

/// A model beside recordings: what it predicts, how far off it is, and where.
pub struct Comparison {
    /// The model.
    pub motor: MotorFile,
    /// The recordings, with the noise of their sensors.
    pub experiments: Vec<Experiment>,
    /// Error per recording.
    pub errors: Vec<Errors>,
    /// Error over all.
    pub total: Errors,
    loads: Loads,
    views: Vec<View>,
    shown: Vec<Shown>,
}

impl Comparison {
    /// Simulates the model on the recordings. Where there is a measured speed, the places of failure are sought with the simulated
    /// speed nudged towards it; errors and pictures are without nudging.
    pub fn new(motor: MotorFile, experiments: Vec<Experiment>) -> Self {
        let m = &motor.machine;
        let starts: Vec<State<f64>> = experiments.iter().map(|e| start_on(m, e, &motor.rating)).collect();
        let views = experiments
            .par_iter()
            .zip(&starts)
            .map(|(e, x)| {
                let predicted = predict(m, e, x);
                View {
                    experiment: e.clone(),
                    held_out: false,
                    number: None,
                    nudged: false,
                    band: motor
                        .prediction
                        .filter(|_| !e.is_table())
                        .map_or_else(Vec::new, |p| half_widths(e, &predicted, Some(&p))),
                    with_parameters: false,
                    predictions: vec![predicted],
                    start: *x,
                }
            })
            .collect();
        let each =
            experiments.iter().zip(&starts).map(|(e, x)| errors(m, std::slice::from_ref(e), std::slice::from_ref(x))).collect();
        let place = localise(&Signals::of(m, &nudged(&experiments), &starts));
        let total = errors(m, &experiments, &starts);
        let loads = Loads::of(m, &experiments, &starts);
        Self {
            errors: each,
            total,
            loads,
            views,
            shown: vec![Shown { name: "model", class: "refined", place }],
            experiments,
            motor,
        }
    }

    /// A motor beside recordings as they were taken in, with what was noticed about them.
    ///
    /// # Errors
    /// By a clock that is no motor's nothing can be simulated, unless it is wanted `anyway`; or the motor needs too many steps for a sample.
    pub fn of_intake(motor: &MotorFile, label: &str, taken: Vec<Intake>, anyway: bool) -> Result<(Self, Vec<Finding>), Refused> {
        let mut noticed = findings(taken.iter());
        // What else is wrong is what a comparison shows.
        let clock: Vec<Finding> = noticed.iter().filter(|f| f.kind == FindingKind::TimeUnit).cloned().collect();
        meaningful(&clock, anyway)?;
        taken.iter().try_for_each(|t| followed(motor, label, t))?;
        let mut case = Case::from_intake(motor.clone(), taken, None);
        if !noticed.iter().any(Finding::stops) {
            noticed.extend(consistency::check(&case));
        }
        case.judge_by(&motor.machine);
        let compared = Self::new(motor.clone(), case.train);
        // Signals that the model fits as it is are in the convention that they are read in.
        noticed.retain(|f| f.kind != FindingKind::Convention || !compared.fits(&f.recording));
        Ok((compared, noticed))
    }

    /// Whether the model as given explains a recording.
    fn fits(&self, recording: &str) -> bool {
        self.experiments.iter().zip(&self.errors).any(|(e, x)| e.name == recording && x.chi2_per_sample < FITS)
    }

    /// What stands out, one sentence each, strongest first.
    pub fn findings(&self) -> Vec<String> {
        self.shown[0].place.findings().iter().map(|f| sentence(f)).collect()
    }

    /// Measured, modelled and residual, sample by sample.
    pub fn signals(&self) -> SignalTable {
        let mut table = SignalTable::default();
        for v in &self.views {
            table.add(&self.motor.machine, &v.start, &v.experiment, &v.predictions[0]);
        }
        table
    }

    /// Loads that no column holds, for programs.
    pub fn loads(&self) -> serde_json::Value {
        self.loads.to_json()
    }

    /// For programs: the errors of each recording and over all, what stands out and where, the loads, and the static torque-speed curve.
    pub fn to_json(&self) -> serde_json::Value {
        let each = self.experiments.iter().zip(&self.errors).map(|(e, x)| {
            let mut one = x.to_json();
            one["recording"] = json!(e.name);
            one["noise"] = e.channels.iter().map(|c| (c.name.clone(), json!(c.sigma))).collect::<serde_json::Map<_, _>>().into();
            one
        });
        json!({
            "schema": 1, "findings": self.findings(), "loads": self.loads(), "errors": each.collect::<Vec<_>>(), "total": self.total.to_json(),
            "torque_speed": steady_curve::to_json(&[("model", &RatedSupply::of(&self.motor))]), "localisation": self.localisation().to_json("model"),
        })
    }

    /// Where the model fails, in numbers.
    pub fn localisation(&self) -> &crate::localise::Localisation {
        &self.shown[0].place
    }

    /// Whether the simulation does: there is no error then to look into.
    fn diverges(&self) -> bool {
        !self.total.chi2_per_sample.is_finite()
    }

    fn said(&self) -> String {
        let x = self.total.chi2_per_sample;
        if self.diverges() {
            "The simulation of this model diverges on these recordings: check units, pole pairs and the sampling time.".into()
        } else if x < 1.1 {
            format!("The model is as good as the sensors can tell: its error is {} rms.", in_sigma(x))
        } else {
            format!(
                "The model misses the recordings by {} rms (1 σ, the noise of the sensors, would be as good as they can tell).",
                in_sigma(x)
            )
        }
    }

    /// How much of the recordings lies in the band of the motor file, where it has one.
    fn in_band(&self) -> Option<String> {
        let (inside, all) = self.views.iter().map(View::inside).fold((0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        let banded = self.motor.prediction.is_some() && all > 0;
        banded.then(|| format!("{} % of the readings lie in the band.", number(100.0 * inside as f64 / all as f64, 3)))
    }

    fn title<'a>(&'a self, meta: &'a Meta) -> &'a str {
        if meta.title.is_empty() { &self.motor.name } else { &meta.title }
    }
}

/// Where σ comes from.
const NOISE: &str = "σ, the noise of a sensor, is the roughness of what the model leaves of its signal from row to row.";

/// What makes everything else doubtful.
fn serious(meta: &Meta) -> Vec<Finding> {
    let all = joined(meta.quality.as_deref().unwrap_or_default());
    all.into_iter().filter(|q| q.severity == Severity::Serious).collect()
}

/// The page.
pub fn compare_html(c: &Comparison, meta: &Meta) -> String {
    let top = html! {
        (head(c.title(meta), Some("comparison")))
        @for q in &serious(meta) { p.warn { "⚠ " (q.line()) } }
        h1 { (c.said()) }
        p.say { (c.findings().iter().take(3).cloned().collect::<Vec<_>>().join(" ")) }
    };
    let table_head = [
        words("recording"),
        words("signal"),
        numbers(term("rmse", "rms error")),
        numbers(term("noise", "sensor noise (σ)")),
        numbers(term("fit", "fit")),
        numbers(term("floor", "rms in σ")),
    ];
    let mut rows = Vec::new();
    for (e, x) in c.experiments.iter().zip(&c.errors) {
        for (k, ch) in e.channels.iter().enumerate() {
            let (name, unit) = channel_words(&ch.name, ch.kind);
            let value =
                |v: Option<&f64>| v.filter(|v| v.is_finite()).map_or("–".into(), |v| format!("{}\u{a0}{unit}", number(*v, 3)));
            let first = |text: String| if k == 0 { text } else { String::new() };
            let rmse = x.rmse.get(&ch.name).filter(|v| v.is_finite());
            let fit = x.fit_percent.get(&ch.name).filter(|v| v.is_finite() && rmse.is_some());
            let fit = fit.map_or("–".into(), |v| format!("{}\u{a0}%", number(*v, 4)));
            let (rmse, sigma) = (value(rmse), value(Some(&ch.sigma)));
            rows.push(Row::of([first(e.name.clone()), name, rmse, sigma, fit, first(in_sigma(x.chi2_per_sample))]));
        }
    }
    let mut sections = vec![Section {
        id: "errors",
        short: "error",
        title: "The error",
        body: html! { (table(&table_head, &rows)) p { (NOISE) @if let Some(said) = voltage_noise(c.experiments.iter()) { " " (said) } } },
    }];
    let models = overlay::models(&c.shown);
    let mut data = None;
    if let Some(w) = &overlay::worst(&c.views) {
        let body = html! { (overlay::body(&c.views, &models, w)) @if let Some(said) = c.in_band() { p { (said) } } };
        sections.push(Section { id: "overlay", short: "signals", title: "Measured and modelled, over time", body });
        data = Some(overlay::data(&c.views, &models, w));
    }
    if !c.diverges() {
        sections.push(place::section(&c.shown, any_nudged(&c.experiments), false));
    }
    sections.extend(load_section(&c.loads, &c.motor));
    sections.extend(provenance::quality(meta));
    sections.extend(provenance::next_test(meta));
    let used: Vec<Used> = c.experiments.iter().map(|e| Used::of(e, "compared")).collect();
    sections.push(provenance::run(meta, &c.motor, &used));
    page(c.title(meta), &top, &sections, data.as_deref())
}

/// The same in short, for a terminal.
pub fn compare_terminal(c: &Comparison, meta: &Meta, width: usize) -> String {
    let mut out = Text { width: width.clamp(40, 100), lines: Vec::new() };
    out.line(c.title(meta));
    out.gap();
    // What makes the rest doubtful stands before it.
    let serious = serious(meta);
    for q in &serious {
        out.paragraph("  ! ", &q.line());
    }
    if !serious.is_empty() {
        out.gap();
    }
    out.paragraph("", &c.said());
    out.heading("Error");
    let mut rows = vec![["recording", "signal", "rms error", "sensor noise", "rms in σ"].map(str::to_owned).to_vec()];
    for (e, x) in c.experiments.iter().zip(&c.errors) {
        let name = file_name(&e.name);
        for (k, ch) in e.channels.iter().enumerate() {
            let (what, unit) = channel_words(&ch.name, ch.kind);
            let rmse = x.rmse.get(&ch.name).map_or("–".into(), |v| format!("{} {unit}", number(*v, 3)));
            let first = if k == 0 { (name.clone(), in_sigma(x.chi2_per_sample)) } else { Default::default() };
            rows.push(vec![first.0, what, rmse, format!("{} {unit}", number(ch.sigma, 3)), first.1]);
        }
    }
    out.table(&rows, &[false, false, true, true, true]);
    if let Some(said) = voltage_noise(c.experiments.iter()) {
        out.paragraph("  ", &said);
    }
    // As good as they can tell, there is nothing to explain.
    if !c.diverges() && !(0.9..1.1).contains(&c.total.chi2_per_sample) {
        out.paragraph("  ", NOISE);
    }
    if !c.diverges() {
        place_text(&mut out, &c.shown);
    }
    loads_text(&mut out, &c.loads, &c.motor);
    for q in joined(meta.quality.as_deref().unwrap_or_default()).iter().filter(|q| q.severity != Severity::Serious) {
        out.paragraph("  ! ", &q.line());
    }
    out.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::simulation::{Scenario, Simulation};

    /// A motor on reduced voltage that its model explains: no convention is asked for. One that is not explained is another matter.
    #[test]
    fn what_the_model_fits_as_given_is_in_the_convention_that_is_read() {
        let motor = MotorFile::parse(include_str!("../../../examples/motor.toml"), "motor.toml").unwrap();
        let scenario = Scenario {
            sensors: im_model::simulation::Sensors {
                current_noise_a: 0.05,
                speed_noise_rad_s: 0.1,
                seed: 1,
                ..Default::default()
            },
            ..Scenario::direct_on_line(motor.rating.phase_voltage_peak_v * std::f64::consts::FRAC_1_SQRT_2, 50.0, 0.5)
        };
        let run = Simulation::new(&motor.machine, &scenario).run().unwrap().recording;
        let name = run.name.clone();
        let fits = |scale: f64| {
            let mut run = run.clone();
            run.i_s.iter_mut().for_each(|i| *i *= scale);
            Comparison::new(motor.clone(), Case::new(motor.clone(), &[run], None).train).fits(&name)
        };
        assert!(fits(1.0) && !fits(std::f64::consts::FRAC_1_SQRT_2));
    }
}
