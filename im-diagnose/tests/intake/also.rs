//! One run on several instruments: `[[also]]`.

use im_diagnose::intake::{FindingKind, Intake, IntakeError, files};
use im_identify::offline::{ChannelKind, Experiment};

use crate::simulated::{Folder, MAPPING, columns, csv, of, take};

/// The clock of the second instrument is behind by this.
const BEHIND_S: f64 = 0.0373;

/// Voltages and currents at 5 kHz in one file; a current, speed and torque at 1 kHz in ms in another.
fn folder(name: &str, also: &str) -> Folder {
    let folder = Folder::new(name);
    let (electrical, mechanical): (Vec<_>, Vec<_>) = columns().into_iter().partition(|(n, _)| !["n_rpm", "T_Nm"].contains(n));
    folder.put("run.csv", csv(&electrical));
    let thin = |x: &[f64]| x[3..].iter().step_by(5).copied().collect::<Vec<f64>>();
    let mut slow = vec![
        ("t_ms", thin(&electrical[0].1).iter().map(|t| 1e3 * (t - BEHIND_S)).collect()),
        ("shunt", thin(&electrical.iter().find(|(n, _)| *n == "i1_A").unwrap().1)),
    ];
    slow.extend(mechanical.iter().map(|(n, x)| (*n, thin(x))));
    folder.put("log.csv", csv(&slow));
    folder.put("run.recording.toml", format!("{MAPPING}\n[[also]]\nfile = \"log.csv\"\ntime = \"t_ms\"\n{also}\n"));
    folder
}

fn taken(folder: &Folder) -> Result<Intake, IntakeError> {
    take(&folder.0.path().join("run.csv"))
}

#[test]
fn another_instruments_columns_come_on_the_recordings_axis() {
    for (name, also) in [("shifted", "shift_s = 0.0373"), ("aligned", "align = { column = \"shunt\", with = \"i1_A\" }")] {
        let folder = folder(name, also);
        let joined = taken(&folder).unwrap();
        let one = Folder::new(&format!("{name}_whole"));
        let path = one.put("run.csv", csv(&columns()));
        one.put("run.recording.toml", MAPPING);
        let whole = take(&path).unwrap().experiment;
        let speed = |e: &Experiment| e.channels.iter().find(|c| c.kind == ChannelKind::Speed).unwrap().values.clone();
        // The log begins three rows late.
        let first = (joined.start_s / whole.sample_time_s).round() as usize;
        let joined = joined.experiment;
        let (a, b) = (speed(&joined), &speed(&whole)[first..]);
        assert!((3..5).contains(&first) && a.len() + 10 > b.len(), "{first} {} {}", a.len(), b.len());
        let off = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64;
        assert!(off.sqrt() < 0.3, "{name}: {} rad/s", off.sqrt());
        assert_eq!(joined.u_s[..], whole.u_s[first..][..joined.u_s.len()]);
        assert!(files(&folder.0.path().join("run.csv"), None).unwrap().iter().any(|f| f.ends_with("log.csv")));
    }
}

#[test]
fn clocks_that_cannot_be_set_are_refused_with_the_place() {
    for (name, also, words) in [
        ("apart", "shift_s = 7", "rows of the recording in common"),
        ("unlike", "align = { column = \"T_Nm\", with = \"i1_A\" }", "not the same signal"),
        ("nothing", "align = { column = \"shunts\", with = \"i1_A\" }", "shunt"),
        ("both", "shift_s = 1\nalign = { column = \"shunt\", with = \"i1_A\" }", "one of them"),
        ("key", "shift = 1", "shift_s"),
    ] {
        let e = taken(&folder(name, also)).unwrap_err().to_string();
        assert!(e.contains(words) && e.contains("run.recording.toml"), "{name}: {e}");
    }
    let missing = folder("missing", "shift_s = 0");
    std::fs::remove_file(missing.0.path().join("log.csv")).unwrap();
    let e = taken(&missing).unwrap_err().to_string();
    assert!(e.contains("log.csv"), "{e}");
}

/// Some milliseconds between two clocks look like a sensor's lag: that nobody said them is told; and a second instrument's file by itself says where it
/// belongs.
#[test]
fn what_a_second_instrument_asks_for_is_said() {
    let kind = FindingKind::ClocksTakenAsOne;
    assert_eq!(of(&taken(&folder("unsaid", "")).unwrap().findings, kind).len(), 1);
    assert!(of(&taken(&folder("said", "shift_s = 0.0")).unwrap().findings, kind).is_empty());
    let (of_both, alone) = (folder("alone", ""), Folder::new("alone_log"));
    let path = alone.put("log.csv", std::fs::read(of_both.0.path().join("log.csv")).unwrap());
    let all = std::fs::read_to_string(&path).unwrap().replace("shunt", "level");
    std::fs::write(&path, all).unwrap();
    let said = take(&path).unwrap_err().to_string();
    assert!(said.contains("name it under [[also]]"), "{said}");
}
