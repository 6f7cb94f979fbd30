//! The electrical side alone, where the torque column is wrong and where the currents are not explained.

use im_diagnose::diagnosis::Verdict;
use im_diagnose::report::{Meta, Story, terminal};
use im_model::EffectId;

use crate::cases::{missing, torque_column_off, unexplained};

#[test]
fn a_wrong_torque_column_is_told_from_the_electrical_side() {
    let d = torque_column_off(0.03, 1.5);
    assert_eq!(d.verdict, Verdict::Unexplained);
    let e = d.electrical_side.as_ref().unwrap();
    assert_eq!((e.verdict, e.effects.as_slice()), (Verdict::MissingEffects, &[EffectId::MainFluxSaturation][..]));
    assert!(e.error[1] < 1.1 && e.error[0] > 1.5, "{:?}", e.error);
    let c = e.torque_column.as_ref().unwrap();
    assert!((c.offset_nm.unwrap() - 1.5).abs() < 0.05 && c.scale.is_none(), "{c:?}");
    assert!((c.lag_s.unwrap() / 0.03 - 1.0).abs() < 0.1, "{c:?}");
    assert!(c.off_nm[1] < 0.3 * c.off_nm[0], "{c:?}");
    let meta = Meta::default();
    let story = Story::new(&d, &meta);
    let text = terminal(&story, 100).split_whitespace().collect::<Vec<_>>().join(" ");
    for words in [
        "What fails is at the shaft:",
        "the currents are explained: main-flux saturation brings their error",
        "too much at every load",
        "30 ms late",
        "The same recordings with the torque column corrected",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
    assert_eq!(story.to_json()["electrical_side"]["named"][0], "main_flux_saturation");
}

/// Slots are in the currents.
#[test]
fn currents_that_are_not_explained_are_no_matter_of_the_shaft() {
    let e = unexplained().electrical_side.unwrap();
    assert_eq!((e.verdict, e.effects.len(), e.torque_column), (Verdict::Unexplained, 0, None));
    assert!(missing().electrical_side.is_none());
}
