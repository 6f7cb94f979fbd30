use im_diagnose::diagnosis::{Diagnosis, Doubt, Verdict};
use im_diagnose::intake::{Finding, FindingKind, Severity};
use im_diagnose::next_test::ProfileTrace;
use im_diagnose::report::{
    Comparison, FILES, Files, Meta, NextTest, SideBySide, Story, compare_html, compare_terminal, html, side_by_side,
    side_by_side_terminal, terminal,
};
use im_model::EffectId;

use crate::cases;

pub fn meta() -> Meta {
    let clips = Finding::new(FindingKind::ClippedSensor, Severity::Note, "current sensor clips at ±20 A in 12 rows", "");
    Meta {
        program: "im 0.1.0".into(),
        command: Some("im diagnose --motor motor.toml --train first.csv".into()),
        seed: Some(7),
        quality: Some(vec![Finding { recording: "first.csv".into(), ..clips }]),
        next_test: Some(NextTest {
            text: "Step the flux from half to full at no load.".into(),
            settles: vec!["main-flux saturation against iron loss".into()],
            profile: vec![ProfileTrace {
                name: "flux".into(),
                unit: "Vs".into(),
                points: vec![[0.0, 0.5], [1.0, 0.5], [1.0, 1.0], [2.0, 1.0]],
            }],
        }),
        ..Meta::default()
    }
}

/// What every report must keep to.
fn check(d: &Diagnosis, name: &str) -> (String, String) {
    let page = html(&Story::new(d, &meta()));
    assert!(page.len() < 2_000_000, "{name}: {} bytes", page.len());
    for foreign in ["http:", "https:", "src=", "@import", "url("] {
        assert!(!page.replace("url(#", "").contains(foreign), "{name}: {foreign}");
    }
    for broken in ["NaN", ">inf", "_A<", "rad_s<", "\u{0}"] {
        let seen = page.split("id=\"recordings\"").next().unwrap();
        assert!(!seen.contains(broken), "{name}: {broken}");
    }
    assert!(page.contains("2.2 kW &lt;test&gt; &amp; &quot;co&quot;") && !page.contains("<test>"), "{name}: not escaped");
    // Tooltips lead somewhere on paper too.
    for key in page.split("href=\"#").skip(1).map(|s| s.split('"').next().unwrap()) {
        assert!(page.contains(&format!("id=\"{key}\"")), "{name}: nothing at #{key}");
    }
    // A closed path without a colour of its own is filled with black.
    for path in page.split("<path ").skip(1).map(|s| s.split("/>").next().unwrap()).filter(|p| p.contains("Z\"")) {
        assert!(path.contains("class=\"fill-"), "{name}: {}", path.chars().take(80).collect::<String>());
    }
    for width in [60, 100] {
        let text = terminal(&Story::new(d, &meta()), width);
        for line in text.lines() {
            assert!(line.chars().count() <= width, "{name}: {line}");
        }
        assert!(!text.contains('\u{1b}') && !text.contains('\u{a0}') && !text.contains("NaN"), "{name}: {text}");
    }
    // Equal input, equal file.
    assert_eq!(page, html(&Story::new(d, &meta())));
    (page, terminal(&Story::new(d, &meta()), 100))
}

#[test]
fn a_load_that_was_not_measured_is_drawn_with_its_band() {
    let (page, _) = check(&cases::without_load(), "without load");
    assert!(page.contains("Load torque, found") && page.contains("load torque over time"));
}

#[test]
fn a_missing_effect_is_reported_with_cause_certainty_and_refutation() {
    let d = cases::missing();
    assert_eq!(d.verdict, Verdict::MissingEffects, "{:?}", d.effects);
    let (page, text) = check(&d, "missing");
    assert!(page.contains("<h1>Main-flux saturation is missing from the model: adding it brings the held-out error from "));
    for part in [
        "How sure",
        "and no other values of the parameters leave it (score ",
        "What would refute it",
        "No-load flux steps or a slow voltage ramp",
        "+ main-flux saturation",
        "Saturation curve: magnetizing current over flux.",
        "The next test",
        "Step the flux from half to full at no load.",
        "current sensor clips at ±20 A in 12 rows",
        "hash of its numbers",
        "base model refitted",
        "look alike",
    ] {
        assert!(page.contains(part), "{part}");
    }
    let first = text.lines().find(|l| l.starts_with("Main-flux")).unwrap();
    assert!(
        first.starts_with("Main-flux saturation is missing from the model: adding it brings the held-out error from"),
        "{first}"
    );
    for part in ["sure because:", "would refute:", "  + main-flux saturation", "added", "Next test", "Where the base model fails"]
    {
        assert!(text.contains(part), "{part}\n{text}");
    }
}

#[test]
fn what_was_found_is_not_said_to_be_all_where_more_is_left() {
    let d = cases::more_than_named();
    assert_eq!(
        (d.verdict, d.effects.as_slice()),
        (Verdict::MissingEffects, &[EffectId::MainFluxSaturation][..]),
        "{:?}",
        d.course.stages.iter().map(|s| s.round.significant.clone()).collect::<Vec<_>>()
    );
    assert_eq!(
        d.residual_cause.as_ref().and_then(|r| r.suspect),
        Some(EffectId::CoulombFriction),
        "{:?} {:?}",
        d.residual_cause,
        d.steps[1].train
    );
    let (page, text) = check(&d, "more");
    for words in [page, text] {
        let words = words.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(
            words.contains("What stays is still more than noise: something smaller is missing, or what was added has another form in the machine; the next suspect, not confirmed, is Coulomb friction"),
            "{words}"
        );
    }
    let ranked = d.ranking.iter().find(|c| c.effect == EffectId::CoulombFriction).unwrap();
    assert!(ranked.conclusion.starts_with("may be missing, too"), "{}", ranked.conclusion);
    assert_eq!(cases::missing().residual_cause, None);
}

#[test]
fn a_clean_case_says_so_and_what_it_cannot_exclude() {
    let d = cases::adequate();
    assert_eq!(d.verdict, Verdict::Adequate, "{:?}", d.effects);
    let (page, text) = check(&d, "adequate");
    assert!(page.contains(
        "<h1>Nothing is missing: with its parameters refitted the model explains the recordings down to the sensor noise"
    ));
    assert!(page.contains("No effect of the library is needed: no score is above its threshold."));
    assert!(text.contains("Its error does not depend on anything that was looked at."), "{text}");
}

#[test]
fn an_unexplained_case_shows_the_shape_of_what_is_left() {
    let d = cases::unexplained();
    assert_eq!(d.verdict, Verdict::Unexplained, "{:?} {:?}", d.verdict, d.effects);
    let (page, text) = check(&d, "unexplained");
    assert!(page.contains("<h1>Something is missing that the library of effects does not hold: the error in current along the flux depends on the rotor angle, 26 times per revolution (0.28"), "{}", text);
    for part in [
        "These are the shapes of what is missing",
        "26 ripples per revolution",
        "angle within one of 26 ripples per revolution, °",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(text.contains("What is left, and its shape"), "{text}");
}

#[test]
fn rivals_are_reported_as_a_set_with_the_test_between_them() {
    let (page, text) = check(&cases::confounded(), "confounded");
    assert!(page.contains("<h1>Something is missing that these recordings do not let us name alone: either main-flux saturation or iron loss. Adding either brings"));
    assert!(page.contains("Against iron loss: adds current in phase with the voltage"));
    assert!(page.contains("could be this instead"));
    assert!(text.contains("confounded"), "{text}");
}

#[test]
fn an_inconclusive_case_names_the_tests_that_would_decide() {
    let (page, text) = check(&cases::inconclusive(), "inconclusive");
    assert!(page.contains("<h1>These recordings cannot decide: nothing is seen to be missing"));
    assert!(page.contains("What would decide") && page.contains("What these recordings cannot show"));
    assert!(page.contains("Slow reversals through standstill"));
    assert!(text.contains("would decide: "), "{text}");
}

#[test]
fn a_held_out_recording_that_is_missed_leaves_it_open() {
    let d = cases::held_out_missed();
    let last = d.steps.last().unwrap();
    assert!(last.train.chi2_per_sample < 1.05 && last.holdout.as_ref().unwrap().chi2_per_sample > 2.0, "{last:?}");
    assert_eq!((d.verdict, d.doubts.as_slice()), (Verdict::Inconclusive, &[Doubt::HeldOutMissed][..]));
    let (page, text) = check(&d, "missed");
    for words in [page, text] {
        let words = words.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(words.contains("but the held-out recording is missed: it shows something that the training recordings do not"));
    }
    assert_eq!(d.to_json()["doubts"], serde_json::json!(["held_out_missed"]));
}

#[test]
fn a_comparison_has_its_own_report() {
    let d = cases::unexplained();
    let c = Comparison::new(d.case.motor.clone(), d.case.train.clone());
    assert!(c.total.chi2_per_sample > 10.0 && !c.findings().is_empty());
    let page = compare_html(&c, &Meta::default());
    assert!(
        page.contains("The model misses the recordings by ") && page.contains("Where it fails") && !page.contains("Candidates")
    );
    assert!(page.len() < 2_000_000 && !page.contains("http:"));
    let text = compare_terminal(&c, &Meta::default(), 80);
    assert!(text.lines().all(|l| l.chars().count() <= 80) && text.contains("first.csv"), "{text}");
}

#[test]
fn a_model_that_diverges_gets_a_report_too() {
    let c = cases::diverging();
    let page = compare_html(&c, &Meta::default());
    assert!(page.contains("The simulation of this model diverges on these recordings"), "{}", c.total.chi2_per_sample);
    assert!(!page.split("id=\"recordings\"").next().unwrap().contains("NaN"));
    assert!(!compare_terminal(&c, &Meta::default(), 80).contains("NaN"));
}

#[test]
fn diagnoses_stand_side_by_side() {
    let [a, b] = [cases::missing(), cases::adequate()].map(|d| d.to_json().to_string());
    let both = [SideBySide::parse("before", &a).unwrap(), SideBySide::parse("after <repair>", &b).unwrap()];
    let page = side_by_side(&both, &Meta::default());
    for part in ["The verdicts differ.", "after &lt;repair&gt;", "Main-flux saturation: exponent", "last against first"] {
        assert!(page.contains(part), "{part}");
    }
    let other = a.replace("\"main_flux_saturation\"", "\"leakage_flux_saturation\"");
    let causes = [SideBySide::parse("one", &a).unwrap(), SideBySide::parse("other", &other).unwrap()];
    assert!(side_by_side(&causes, &Meta::default()).contains("They name different causes."));
    let text = side_by_side_terminal(&both, 100);
    assert!(text.contains("missing effects") && text.lines().all(|l| l.chars().count() <= 100), "{text}");
    // As many as there are: in parts, and nothing is cut.
    let four = [("one", &a), ("two", &b), ("three", &a), ("four", &b)].map(|(name, d)| SideBySide::parse(name, d).unwrap());
    let text = side_by_side_terminal(&four, 80);
    assert!(!text.contains('…') && ["one", "two", "three", "four"].iter().all(|n| text.contains(n)), "{text}");
    assert!(SideBySide::parse("x", "{}").unwrap_err().contains("is this a diagnosis.json?"));
    assert!(SideBySide::parse("x", "{").unwrap_err().starts_with("x: not JSON"));
    assert!(SideBySide::parse("x", "[machine]\n").unwrap_err().ends_with("this is a motor file ([machine]); give it as --motor"));
    // Files of others may lack anything.
    let bare = [SideBySide::parse("bare", r#"{"schema": 1}"#).unwrap()];
    assert!(side_by_side(&bare, &Meta::default()).contains("bare") && !side_by_side_terminal(&bare, 80).is_empty());
}

/// Every number of the page stands in a file: in `diagnosis.json`, as pairs for whoever wants to draw them anew.
#[test]
fn what_the_page_shows_is_in_the_answer() {
    let d = cases::missing();
    let said = meta();
    let a = Story::new(&d, &said).to_json();
    let count =
        |path: &str| a.pointer(path).map_or(0, |v| v.as_array().map_or_else(|| v.as_object().map_or(0, |o| o.len()), Vec::len));
    for (k, model) in ["base model", "refined model"].iter().enumerate() {
        assert_eq!(a["localisation"][k]["model"], *model);
        for part in ["time", "planes", "profiles", "spectra", "memory", "correlations/coefficients"] {
            assert!(count(&format!("/localisation/{k}/{part}")) > 0, "{model}: {part}");
        }
        assert!(count(&format!("/localisation/{k}/profiles/0/bins")) > 4);
    }
    for curve in ["before", "after"] {
        assert!(count(&format!("/torque_speed/curves/{curve}")) > 40, "{curve}");
    }
    let (of, effects) = (count("/covariance/of"), count("/look_alikes/effects"));
    assert!(of > 5 && of == count("/covariance/matrix") && of == count("/covariance/matrix/0"));
    assert!(effects > 1 && effects == count("/look_alikes/cosines"));
    assert!(count("/curves/main_flux_saturation/points") > 40 && count("/curves/main_flux_saturation/band") > 40);
    let files = d.case.train.iter().chain(&d.case.holdout).count();
    assert_eq!((count("/next_test/profile/0/points"), count("/run/files")), (4, files));
    assert_eq!(count("/rounds"), d.course.stages.len());
    assert!(count("/rounds/0") > 0 && a["rounds"][0][0]["train_chi2_per_sample"].as_f64() > Some(0.0));
    assert_eq!(a["data_quality"][0]["kind"], "clipped_sensor");
    let of = |key: &str| a["parameters"]["stator_resistance_ohm"][key].as_f64();
    assert!(["before", "base_model", "after", "std"].iter().all(|key| of(key) > Some(0.0)), "{}", a["parameters"]);
    let given = a["given"]["train"]["rms_in_sigma"].as_f64();
    assert!(given > a["steps"][0]["train"]["rms_in_sigma"].as_f64(), "{}", a["given"]);
    assert!(a["summary"]["cause"].as_str().is_some_and(|s| s.contains("missing")), "{}", a["summary"]);
}

#[test]
fn the_files_are_written_or_an_error_names_the_one() {
    let d = cases::missing();
    let dir = std::env::temp_dir().join(format!("im-diagnose-report-{}", std::process::id()));
    let w = Files::of(&Story::new(&d, &meta())).write(dir.join("out")).unwrap();
    let answer: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&w.diagnosis).unwrap()).unwrap();
    assert_eq!(answer["verdict"], "missing_effects");
    let motor = im_model::MotorFile::read(&w.motor).unwrap();
    assert!(motor.machine.effects().is_on(im_model::EffectId::MainFluxSaturation));
    assert!(std::fs::read_to_string(&w.report).unwrap().ends_with("</html>\n"));
    assert_eq!(std::fs::read_dir(dir.join("out")).unwrap().count(), FILES.len());
    std::fs::write(dir.join("file"), "").unwrap();
    let e = Files::of(&Story::new(&d, &meta())).write(dir.join("file")).unwrap_err().to_string();
    assert!(e.contains("motor.refined.toml"), "{e}");
    std::fs::remove_dir_all(&dir).unwrap();
}

/// Of a recording that no fit has seen, nineteen readings of twenty lie in the band of prediction of the right model, which the motor file has, too.
#[test]
fn the_band_of_prediction_holds_nineteen_readings_of_twenty() {
    let found = cases::missing();
    let page = html(&Story::new(&found, &Meta::default()));
    let shares: Vec<f64> = page
        .split(" % of the readings lie in the band")
        .filter_map(|before| before.rsplit([' ', '>']).next()?.parse().ok())
        .collect();
    assert_eq!(shares.len(), 3, "{shares:?}");
    // 7000 readings: ± 0.3 % by chance, more for errors that last.
    assert!(shares.iter().all(|s| (93.5..97.5).contains(s)), "{shares:?}");
    assert!(page.contains("third.csv (held out)"));
    assert!(page.contains(": sensors, parameters, and what the model does not explain"));
    let said = page.split("A band made from the training recordings alone holds ").nth(1).unwrap_or_default();
    let alone: f64 = said.split(' ').next().and_then(|x| x.parse().ok()).unwrap();
    assert!((93.5..97.5).contains(&alone), "{alone}");
    // The form has no slope where the effect is found: the noise is all that is left, and 1.96 σ of it.
    let band = found.refined.prediction.unwrap();
    let noise = found.noise["i_alpha_A"];
    assert!((1.9..2.1).contains(&(band.current.half_width(2.0) / noise)), "{band:?} {noise}");
    let compared = im_diagnose::report::Comparison::new(found.refined.clone(), found.case.train.clone());
    let page = im_diagnose::report::compare_html(&compared, &Meta::default());
    assert!(
        page.contains(": sensors, and what the model does not explain") && page.contains("% of the readings lie in the band.")
    );
    let plain = im_diagnose::report::Comparison::new(found.case.motor.clone(), found.case.train.clone());
    assert!(!im_diagnose::report::compare_html(&plain, &Meta::default()).contains("lie in the band"));
}

/// What the library does not hold is in the band: the model is far off, and says by how much.
#[test]
fn what_is_not_explained_is_in_the_band() {
    let found = cases::unexplained();
    let band = found.refined.prediction.unwrap();
    let last = &found.steps[found.steps.len() - 1];
    let error = last.holdout.as_ref().map_or(last.train.rmse["i_alpha_A"], |h| h.rmse["i_alpha_A"]);
    assert!(band.current.half_width(3.0) > error && error > 2.0 * found.noise["i_alpha_A"], "{band:?} {error}");
}

/// A right model that has not seen one of its recordings is the same within its intervals; of a recording that is none of them, it is the same.
#[test]
fn the_others_give_the_same_right_machine() {
    let found = cases::missing();
    let machine = &found.refined.machine;
    let without = |k: usize| found.estimates.without(machine, k);
    assert_eq!(without(found.case.train.len()), *machine);
    for k in 0..found.case.train.len() {
        let other = without(k);
        assert_ne!(other, *machine);
        for e in &found.estimates.list {
            let (here, there) = (e.quantity.of(machine), e.quantity.of(&other));
            assert!((there - here).abs() < 4.0 * e.std, "{:?}: {here} ± {}, {there}", e.quantity, e.std);
        }
    }
}
