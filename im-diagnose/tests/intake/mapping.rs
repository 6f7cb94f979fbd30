//! What a mapping says is what is read, and what is wrong with it is said with line and key.

use std::path::Path;

use im_diagnose::case::Case;
use im_diagnose::intake::mapping::Mapping;
use im_diagnose::intake::{LoadPlan, SteadyTable};
use im_identify::offline::{ChannelKind, Experiment};
use im_model::Complex;
use im_model::simulation::{Scenario, Simulation};
use im_model::space_vector::to_phases;
use proptest::prelude::*;

use crate::simulated::{Folder, MAPPING, MOTOR, columns, csv, motor, start, take, taken};

fn error(text: &str) -> String {
    Mapping::parse(text, "run.recording.toml").unwrap_err().to_string()
}

#[test]
fn errors_of_a_mapping_name_line_key_and_cure() {
    assert!(Mapping::parse(MAPPING, "x").is_ok());
    let bad = |from: &str, to: &str| error(&MAPPING.replacen(from, to, 1));
    assert_eq!(
        bad("a = \"u1_V\"", "aa = \"u1_V\""),
        "run.recording.toml:4: unknown key aa in [voltage]; known there: a, b, c, ab, bc, ca, alpha, beta, d, q, duty_a, \
         duty_b, duty_c, dc_link, times, unit, gain, offset, instant, measured"
    );
    assert!(bad("[current]", "[curent]").contains("unknown key curent at the top of the file; did you mean current?"));
    assert!(bad("b = \"u2_V\"\n", "").contains("run.recording.toml:3: b is missing in [voltage]"));
    assert!(bad("\"u2_V\"", "2.5").contains("run.recording.toml:5: b is 2.5, expected a column"));
    assert!(
        bad("column = \"n_rpm\"", "column = \"n_rpm\"\nunit = \"knots\"").contains("unit is \"knots\", expected one of rad/s")
    );
    assert!(bad("column = \"n_rpm\"", "locked = true\ncolumn = \"n_rpm\"").contains("beside locked = true"));
    assert!(bad("column = \"t_s\"", "").contains("run.recording.toml:1: column is missing in [time]"));
    assert!(bad("c = \"u3_V\"", "c = \"u3_V\"\ninstant = \"now\"").contains("expected one of \"held_from_row\""));
    assert!(bad("c = \"u3_V\"", "alpha = \"u3_V\"").contains("several forms"));
    assert!(error("this is no TOML").contains("run.recording.toml:1"));
    assert!(error("").contains("time is missing at the top of the file"));
}

/// A file of another kind in the place of a recording or a table is said to be that, with the option that takes it.
#[test]
fn files_of_another_kind_are_said_to_be_that() {
    let folder = Folder::new("kinds");
    let motor = folder.put("motor.toml", MOTOR);
    for (path, said) in [
        (motor.clone(), "this is a motor file ([machine]); give it as --motor"),
        (
            folder.put("s.toml", "[scenario]\nduration_s = 1.0\n[load]\nquadratic_nm_s2 = 1e-4"),
            "this is a scenario of a simulation",
        ),
        (folder.put("diagnosis.json", "{\"schema\": 1, \"verdict\": \"adequate\"}"), "this is the diagnosis.json of im diagnose"),
        (folder.put("report.html", "<!DOCTYPE html><html></html>"), "this is a page for a browser"),
    ] {
        let error = take(&path).unwrap_err().to_string();
        assert!(error.contains("a recording, or what its columns mean, is expected here") && error.contains(said), "{error}");
    }
    let error = SteadyTable::read(&motor, None).unwrap_err().to_string();
    assert!(
        error.ends_with("a table of steady states is expected here, and this is a motor file ([machine]); give it as --motor"),
        "{error}"
    );
}

#[test]
fn a_mapping_that_asks_for_what_is_not_there_is_refused() {
    let folder = Folder::new("absent");
    let path = folder.put("run.csv", csv(&columns()));
    let e = |mapping: String| {
        folder.put("run.recording.toml", mapping);
        take(&path).unwrap_err().to_string()
    };
    let text = e(MAPPING.replace("u2_V", "u2V"));
    assert!(text.contains("run.recording.toml:5: column u2V is missing; is u2_V meant for it?"), "{text}");
    let text = e(MAPPING.replace("\"u2_V\"", "99"));
    assert!(text.contains("column is 99, expected a column from 1 to 9"), "{text}");
    let text = e(MAPPING.replace("a = \"u1_V\"", "a = \"i1_A\""));
    assert!(text.contains("in A by its name"), "{text}");
    let text = e(MAPPING.replace("column = \"t_s\"", "column = \"t_s\"\nfrom_s = 7"));
    assert!(text.contains("rows in it: the recording goes from 0 s"), "{text}");
    folder.put("run.recording.toml", MAPPING);
    let folder_as_file = take(folder.0.path()).unwrap_err().to_string();
    assert!(folder_as_file.contains("a folder, not a recording"), "{folder_as_file}");
    let absent = take(&folder.0.path().join("none.csv")).unwrap_err().to_string();
    assert!(absent.contains("no such file"), "{absent}");
    for (text, expected) in [
        ("", "the file is empty"),
        ("t_s,u1_V\n", "is missing"),
        ("t_s,u1_V,u2_V,u3_V,i1_A,i2_A,i3_A,n_rpm,T_Nm\n0,1,2\n", "the file ends within this row"),
        ("t_s,u1_V,u2_V,u3_V,i1_A,i2_A,i3_A,n_rpm,T_Nm\n0,1,2,3,4,x,6,7,8\n1,1,2,3,4,5,6,7,8\n", "run.csv:2: i2_A is \"x\""),
        ("t_s,u1_V,u2_V,u3_V,i1_A,i2_A,i3_A,n_rpm,T_Nm\n0,1,2,3,4,nan,6,7,8\n1,1,2,3,4,5,6,7,8\n", "run.csv:2: i2_A is NaN"),
        ("t_s,u1_V,u2_V,u3_V,i1_A,i2_A,i3_A,n_rpm,T_Nm\n1,1,2,3,4,5,6,7,8\n0,1,2,3,4,5,6,7,8\n", "run.csv:3: t_s = 0 after 1"),
        ("t_s,u1_V,u1_V,u2_V,u3_V,i1_A,i2_A,i3_A,n_rpm,T_Nm\n", "column u1_V stands twice, as columns 2 and 3"),
    ] {
        let path = folder.put("run.csv", text);
        let e = take(&path).unwrap_err().to_string();
        assert!(e.contains(expected), "{e}");
    }
}

#[test]
fn a_mapping_names_its_recordings_and_one_beside_them_serves_all() {
    let folder = Folder::new("several");
    folder.put("one.csv", csv(&columns()));
    let two = folder.put("two.csv", csv(&columns()));
    let mapping = folder.put("recording.toml", format!("files = [\"one.csv\", \"two.csv\"]\n{MAPPING}"));
    let all = im_diagnose::intake::read(&mapping, None, &crate::simulated::motor()).unwrap();
    assert_eq!(all.iter().map(|t| t.experiment.name.as_str()).collect::<Vec<_>>(), ["one", "two"]);
    assert_eq!(take(&two).unwrap().experiment, all[1].experiment);
    // One of its own goes before the folder's.
    folder.put("two.recording.toml", "[time]\n");
    assert!(take(&two).unwrap_err().to_string().contains("two.recording.toml"));
}

/// Of files that it does not name, and of canonical ones where it is about other columns, the folder's mapping says nothing.
#[test]
fn a_mapping_of_the_folder_is_not_for_canonical_files_and_those_it_does_not_name() {
    let folder = Folder::new("canonical-beside");
    folder.put("laboratory.csv", csv(&columns()));
    let drive = folder.0.path().join("drive.csv");
    start().write_csv(&drive).unwrap();
    let alone = take(&drive).unwrap();
    for files in ["", "file = \"laboratory.csv\"\n"] {
        folder.put("recording.toml", format!("{files}{MAPPING}"));
        assert_eq!(take(&drive).unwrap().experiment, alone.experiment, "{files}");
    }
    // A mapping of the canonical columns is meant for them.
    let text = MAPPING.replace("a = \"u1_V\"\nb = \"u2_V\"\nc = \"u3_V\"", "alpha = \"u_alpha_V\"\nbeta = \"u_beta_V\"");
    let text = text.replace("a = \"i1_A\"\nb = \"i2_A\"\nc = \"i3_A\"", "alpha = \"i_alpha_A\"\nbeta = \"i_beta_A\"\ngain = 2");
    let text = text.replace("n_rpm", "omega_m_rad_s").replace("T_Nm", "tau_load_Nm");
    folder.put("recording.toml", text);
    let (twice, once) = (take(&drive).unwrap().experiment, alone.experiment);
    assert_eq!(twice.channels[0].values[100], 2.0 * once.channels[0].values[100]);
}

/// The same voltage in every form.
#[test]
fn every_form_of_the_voltage_means_the_same() {
    let mut all = columns();
    let u: Vec<Vec<f64>> = (1..4).map(|c| all[c].1.clone()).collect();
    let line = |a: usize, b: usize| u[a].iter().zip(&u[b]).map(|(x, y)| x - y).collect::<Vec<f64>>();
    all.push(("ab_V", line(0, 1)));
    all.push(("bc_V", line(1, 2)));
    all.push(("ca_V", line(2, 0)));
    all.push(("dc_V", vec![700.0; u[0].len()]));
    for (name, x) in ["d1", "d2", "d3"].into_iter().zip(&u) {
        all.push((name, x.iter().map(|u| 0.5 + u / 700.0).collect()));
    }
    let truth = &start().u_s;
    let given = "a = \"u1_V\"\nb = \"u2_V\"\nc = \"u3_V\"";
    for (k, form) in [
        "ab = \"ab_V\"\nbc = \"bc_V\"",
        "ab = \"ab_V\"\nca = \"ca_V\"",
        "bc = \"bc_V\"\nca = \"ca_V\"",
        "ab = \"ab_V\"\nbc = \"bc_V\"\nca = \"ca_V\"",
        "a = \"u1_V\"\nb = \"u2_V\"",
        "duty_a = \"d1\"\nduty_b = \"d2\"\nduty_c = \"d3\"\ndc_link = \"dc_V\"",
    ]
    .into_iter()
    .enumerate()
    {
        let t = taken(&format!("form{k}"), &all, &MAPPING.replace(given, form));
        let off = t.experiment.u_s.iter().zip(truth).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(off < 1e-9, "{form}: {off}");
    }
}

/// A voltmeter's samples give the average over the sample as well as a drive's command does: to 2e-6 of a 50-Hz sine at 5 kHz.
#[test]
fn sampled_voltages_become_averages() {
    let n = 400;
    let (dt, w) = (2e-4, 2.0 * std::f64::consts::PI * 50.0);
    let t: Vec<f64> = (0..n).map(|k| f64::from(k) * dt).collect();
    let phase = |p: f64| t.iter().map(|t| 300.0 * (w * t - p * 2.0 * std::f64::consts::FRAC_PI_3).cos()).collect::<Vec<f64>>();
    let zero: Vec<f64> = t.iter().map(|t| (300.0 * t).sin()).collect();
    let all = vec![
        ("t_s", t.clone()),
        ("u1_V", phase(0.0)),
        ("u2_V", phase(1.0)),
        ("u3_V", phase(2.0)),
        ("i1_A", zero.clone()),
        ("i2_A", zero.iter().map(|x| -0.5 * x).collect()),
        ("i3_A", zero.iter().map(|x| -0.5 * x).collect()),
        ("n_rpm", zero.clone()),
        ("T_Nm", zero.clone()),
    ];
    let average = |from: f64| {
        let e = |t: f64| im_model::Complex::from_polar(300.0, w * t);
        (e(from + dt) - e(from)) / im_model::Complex::new(0.0, w * dt)
    };
    for (instant, shift, tolerance) in
        [("sample", 0.0, 2e-6 * 300.0), ("held_from_row", 0.5 * dt, 0.1), ("held_until_row", -0.5 * dt, 0.1)]
    {
        let mapping = MAPPING.replace("c = \"u3_V\"", &format!("c = \"u3_V\"\ninstant = {instant:?}"));
        let t = taken(instant, &all, &mapping).experiment;
        assert_eq!(t.len(), if instant == "held_from_row" { n as usize } else { n as usize - 1 });
        assert_eq!(t.is_smooth, instant == "sample");
        // The sample at t_k is the average about t_k of what is held around it.
        let skip = usize::from(instant == "held_until_row");
        for k in 1..t.len() - 2 {
            let off = (t.u_s[k] - average((k + skip) as f64 * dt - if instant == "sample" { 0.0 } else { 0.5 * dt })).norm();
            assert!(off < tolerance, "{instant} {k} (shift {shift}): {off}");
        }
    }
}

fn same(a: &Experiment, b: &Experiment) -> Result<(), TestCaseError> {
    let close = |x: f64, y: f64| (x - y).abs() <= 1e-9 * (1.0 + x.abs().max(y.abs()));
    prop_assert_eq!(a.len(), b.len());
    for k in 0..a.len() {
        prop_assert!(close(a.u_s[k].re, b.u_s[k].re) && close(a.u_s[k].im, b.u_s[k].im), "u {}", k);
        prop_assert!(close(a.tau_load[k], b.tau_load[k]), "load {}", k);
        for (x, y) in a.channels.iter().zip(&b.channels) {
            prop_assert!(close(x.values[k], y.values[k]), "{} {}", x.name, k);
        }
    }
    Ok(())
}

/// Three currents through one converter, 50 µs after one another, and the period of an encoder's pulses in ticks of 100 ns, with lines lost.
#[test]
fn late_channels_and_periods_are_read_as_what_they_show() {
    const FINE: &str = "[scenario]\nduration_s = 0.5\nsample_time_s = 5e-5\n[mains]\nvoltage_peak_v = 326.6\nfrequency_hz = 50\n[load]\ntorque_nm = 5\n";
    let scenario = Scenario::parse(FINE, "scenario.toml", Path::new("")).unwrap();
    let r = Simulation::new(&motor().machine, &scenario).run().unwrap().recording;
    let rows: Vec<usize> = (0..r.len() - 4).step_by(4).collect();
    let phase = |x: &[Complex<f64>], p: usize, late: usize| rows.iter().map(|&k| to_phases(x[k + late])[p]).collect::<Vec<f64>>();
    let held: Vec<Complex<f64>> = rows.iter().map(|&k| r.u_s[k..k + 4].iter().sum::<Complex<f64>>() / 4.0).collect();
    let mut all = vec![("t_s", rows.iter().map(|&k| r.time_s(k)).collect::<Vec<f64>>())];
    for (p, name) in ["u1_V", "u2_V", "u3_V"].into_iter().enumerate() {
        all.push((name, held.iter().map(|u| to_phases(*u)[p]).collect()));
    }
    all.extend(["i1_A", "i2_A", "i3_A"].into_iter().enumerate().map(|(p, name)| (name, phase(&r.i_s, p, p))));
    // 1024 lines a turn; a counter that waited too long shows nothing.
    let ticks = |w: f64| if w < 0.5 { 0.0 } else { (std::f64::consts::TAU / 1024.0 / w * 1e7).round() };
    let mut period: Vec<f64> = rows.iter().map(|&k| ticks(r.omega_m[k])).collect();
    for k in [900, 1300, 1700] {
        period[k] *= 2.0;
    }
    all.push(("period", period));
    let read = |delays: [&str; 2], name: &str| {
        let [b, c] = delays;
        let mapping = format!(
            "[time]\ncolumn = \"t_s\"\n[voltage]\na = \"u1_V\"\nb = \"u2_V\"\nc = \"u3_V\"\n[current]\na = \"i1_A\"\n\
             b = {{ column = \"i2_A\"{b} }}\nc = {{ column = \"i3_A\"{c} }}\n[speed]\ncolumn = \"period\"\nreciprocal = true\n\
             gain = {}\nunit = \"rad/s\"\nspikes = true\n[load]\nconstant = 5\n",
            std::f64::consts::TAU / 1024.0 * 1e7
        );
        taken(name, &all, &mapping).experiment
    };
    // Late phases do not sum to zero, and are then compared each for itself.
    let current = |e: &Experiment| {
        let off = |k: usize| e.current_vector(k, |c| e.channels[c].values[k]).map(|i| (i - r.i_s[rows[k]]).norm_sqr());
        let all: Vec<f64> = (0..e.len()).filter_map(off).collect();
        (all.iter().sum::<f64>() / all.len() as f64).sqrt()
    };
    let (late, right) = (read(["", ""], "late"), read([", delay_s = 50e-6", ", delay_s = 100e-6"], "right"));
    let (before, after) = (current(&late), current(&right));
    assert!(after < 0.03 && before > 20.0 * after, "{before} A, {after} A");
    let shown = right.channels.iter().find(|c| c.kind == ChannelKind::Speed).unwrap();
    let off = shown.values.iter().enumerate().map(|(k, w)| (w - r.omega_m[rows[k]]).powi(2));
    let speed = (off.sum::<f64>() / shown.values.len() as f64).sqrt();
    assert!(speed < 0.2, "{speed} rad/s");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    /// However a recording is permuted, scaled, shifted and renamed, a mapping that says so gives the same experiment.
    #[test]
    fn a_mapping_undoes_what_was_done_to_a_recording(
        order in Just((0..9usize).collect::<Vec<_>>()).prop_shuffle(),
        gains in prop::collection::vec(prop_oneof![0.01..100.0f64, -100.0..-0.01f64], 9),
        offsets in prop::collection::vec(-5.0..5.0f64, 9),
        numbers in any::<bool>(),
        comma in any::<bool>(),
    ) {
        let all = columns();
        let truth = taken("truth", &all, MAPPING).experiment;
        // Time keeps its sign and its origin.
        let gain = |c: usize| if c == 0 { gains[0].abs() } else { gains[c] };
        let offset = |c: usize| if c == 0 { 0.0 } else { offsets[c] };
        let mut text = order.iter().map(|c| format!("channel {c}")).collect::<Vec<_>>().join(";") + "\n";
        for k in 0..all[0].1.len() {
            let field = |c: &usize| {
                let x = format!("{:?}", all[*c].1[k] / gain(*c) + offset(*c));
                if comma { x.replace('.', ",") } else { x }
            };
            text += &order.iter().map(field).collect::<Vec<_>>().join(";");
            text.push('\n');
        }
        let column = |c: usize| {
            let place = order.iter().position(|o| *o == c).unwrap() + 1;
            if numbers { place.to_string() } else { format!("\"channel {c}\"") }
        };
        let signal = |c: usize| format!("column = {}, gain = {:?}, offset = {:?}", column(c), gain(c), offset(c));
        let lines = |c: usize| signal(c).replace(", ", "\n");
        let mut mapping = format!("[text]\nseparator = \";\"\ndecimal = {:?}\n", if comma { "," } else { "." });
        // A time in other units: the gain is one that has a name.
        mapping += &format!("[time]\nsample_time_s = {:?}\n", start().sample_time_s);
        mapping += &format!("[voltage]\na = {{ {} }}\nb = {{ {} }}\nc = {{ {} }}\n", signal(1), signal(2), signal(3));
        mapping += &format!("[current]\na = {{ {} }}\nb = {{ {} }}\nc = {{ {} }}\n", signal(4), signal(5), signal(6));
        mapping += &format!("[speed]\n{}\nunit = \"rpm\"\n[load]\n{}\n", lines(7), lines(8));
        let folder = Folder::new("undo");
        folder.put("run.recording.toml", mapping);
        let t = take(&folder.put("run.csv", text)).unwrap();
        same(&t.experiment, &truth)?;
    }

    /// No bytes make the reading, the guessing or the checking panic.
    #[test]
    fn any_bytes_are_taken_in_or_refused(
        at in 0usize..4000,
        junk in prop::collection::vec(any::<u8>(), 0..40),
        cut in 1usize..60_000,
        mapped in any::<bool>(),
        line in 0usize..13,
        value in prop::sample::select(vec!["", "0", "-1", "\"i1_A\"", "[]", "{}", "true", "1e400", "\"mean\"", "{ column = 3, gain = 0 }"]),
    ) {
        let mut bytes = csv(&columns()).into_bytes();
        let at = at.min(bytes.len());
        bytes.splice(at..at, junk.iter().copied());
        bytes.truncate(cut);
        let folder = Folder::new("junk");
        if mapped {
            let mut lines: Vec<String> = MAPPING.lines().map(str::to_owned).collect();
            let k = line.min(lines.len() - 1);
            lines[k] = match lines[k].split_once('=') {
                Some((key, _)) => format!("{key} = {value}"),
                None => lines[k].clone(),
            };
            folder.put("run.recording.toml", lines.join("\n"));
        }
        let _ = take(&folder.put("run.csv", &bytes));
        let _ = take(&folder.put("junk.csv", &junk));
        let _ = Mapping::parse(&String::from_utf8_lossy(&junk), "x");
    }
}

#[cfg(not(feature = "parquet"))]
#[test]
fn a_parquet_file_says_which_build_reads_it() {
    let folder = Folder::new("no-parquet");
    let message = take(&folder.put("run.parquet", b"PAR1....PAR1")).map(|_| ()).unwrap_err().to_string();
    assert!(message.contains("run.parquet") && message.contains("--features parquet"), "{message}");
}

/// A spreadsheet's text: semicolons, decimal commas, a remark and a line of units.
fn spreadsheet() -> String {
    let text = csv(&columns());
    let rows: String = text.lines().skip(1).map(|l| l.replace(',', ";").replace('.', ",") + "\r\n").collect();
    let head = text.lines().next().unwrap().replace(',', ";");
    format!("Run 3;;\r\n{head}\r\n{rows}")
}

#[test]
fn a_mapping_that_names_no_column_is_completed_by_the_guess() {
    let folder = Folder::new("text alone");
    let path = folder.put("run.csv", spreadsheet());
    folder.put("run.recording.toml", "start = \"at_rest\"\nwinding_c = 40\n[text]\ndecimal = \",\"\nskip_lines = 1\n");
    let t = take(&path).unwrap();
    let draft = t.draft.unwrap();
    assert!(draft.completes.as_deref().is_some_and(|label| label.ends_with("run.recording.toml")));
    assert!(!draft.guesses.is_empty() && draft.text.contains("\nstart = \"at_rest\"\nwinding_c = 40.0\n"), "{}", draft.text);
    assert!(draft.text.contains("[text]\nseparator = \";\"\ndecimal = \",\"\nskip_lines = 1\n"), "{}", draft.text);
    assert_eq!(t.experiment.len(), start().u_s.len());
    // The draft reads what was guessed.
    let mapping = folder.put("whole.toml", draft.text_naming("run.csv", "run.csv"));
    let again = &im_diagnose::intake::read(&mapping, None, &motor()).unwrap()[0];
    assert!(again.draft.is_none() && again.experiment.u_s == t.experiment.u_s && again.begin == t.begin);
    // Canonical columns need no guess, only the text as it is said.
    let canonical =
        "t_s;u_alpha_V;u_beta_V;i_alpha_A;i_beta_A;omega_m_rad_s\n0,0;1,5;0;1;0;0\n0,001;1,5;0;1;0;0\n0,002;1,5;0;1;0;0\n";
    let path = folder.put("canonical.csv", canonical);
    folder.put("canonical.recording.toml", "[text]\ndecimal = \",\"\n");
    let t = take(&path).unwrap();
    assert!(t.draft.is_none() && t.experiment.u_s[0].re == 1.5);
    // With a column's table it is a mapping, and has to be whole.
    folder.put("canonical.recording.toml", "[text]\ndecimal = \",\"\n[load]\nnone = true\n");
    let e = take(&path).unwrap_err().to_string();
    assert!(e.contains("time is missing at the top of the file: [time] with column"), "{e}");
}

#[test]
fn what_is_wrong_with_a_mapping_that_nobody_wrote_as_lines_is_said_by_its_key() {
    let text = "time = { column = \"t_s\" }\nvoltage = { a = \"u1\", b = \"u2_V\", c = \"u3_V\" }\ncurrent = { a = \"i1_A\", b = \"i2_A\" }\n";
    let error = |text: &str| Mapping::parse_keys(text, "mapping").unwrap_err().to_string();
    let e = error(&text.replace("c = \"u3_V\"", "gain = 0"));
    assert!(e.starts_with("mapping[\"voltage\"]: gain is 0"), "{e}");
    let e = error(&text.replace("current", "curent"));
    assert!(e.starts_with("mapping[\"curent\"]: unknown key curent"), "{e}");
    let all = columns().into_iter().map(|(name, x)| (name.to_owned(), x)).collect();
    let mapping = Mapping::parse_keys(text, "mapping").unwrap();
    let frame = im_diagnose::intake::Columns::try_new("frame", all, Some(mapping)).unwrap();
    let e = im_diagnose::intake::read_columns(&frame, &motor()).unwrap_err().to_string();
    assert!(e.starts_with("mapping[\"voltage\"]: column u1 is missing; the file has t_s, u1_V"), "{e}");
}

#[test]
fn utf_16_and_times_of_day_are_read() {
    let folder = Folder::new("clock");
    let all = columns();
    let plain = taken("plain", &all, MAPPING);
    // The run begins a tenth of a second before midnight.
    let clock = |t: f64| {
        let s = (86_399.9 + t) % 86_400.0;
        format!("1.3.2026 {:02}:{:02}:{:09.6}", (s / 3600.0) as u32, (s / 60.0) as u32 % 60, s % 60.0)
    };
    let text = csv(&all);
    let rows = text.lines().skip(1).zip(&all[0].1).map(|(l, t)| format!("{},{}\n", clock(*t), l.split_once(',').unwrap().1));
    let text = format!("{}\n{}", text.lines().next().unwrap(), rows.collect::<String>());
    let bytes: Vec<u8> = [0xfeff].into_iter().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    let path = folder.put("run.csv", bytes);
    folder.put("run.recording.toml", MAPPING);
    let t = take(&path).unwrap();
    assert_eq!((&t.experiment.u_s, &t.experiment.channels), (&plain.experiment.u_s, &plain.experiment.channels));
    assert!(
        (t.start_s - 86_399.9).abs() < 1e-6 && (t.experiment.sample_time_s / plain.experiment.sample_time_s - 1.0).abs() < 1e-6
    );
    // A guess takes it for the time, whatever it is called.
    std::fs::remove_file(folder.0.path().join("run.recording.toml")).unwrap();
    folder.put("run.csv", text.replace("t_s", "when (ms)"));
    let draft = take(&path).unwrap().draft.unwrap();
    assert!(draft.text.contains("[time]\ncolumn = \"when (ms)\"\n\n"), "{}", draft.text);
}

/// Counts of an encoder show a speed as a column of it does: where the load is unknown, it drives the machine.
#[test]
fn an_unknown_load_is_driven_by_an_encoder_too() {
    let (counts_per_turn, mut turns) = (4096.0, 0.0);
    let mut all = columns();
    let dt = all[0].1[1] - all[0].1[0];
    for n in &mut all.iter_mut().find(|(n, _)| *n == "n_rpm").unwrap().1 {
        turns += *n / 60.0 * dt;
        *n = (turns * counts_per_turn).floor();
    }
    let unknown = MAPPING.replace("[load]\ncolumn = \"T_Nm\"\n", "[load]\nunknown = true\n");
    let t = taken("counts", &all, &unknown.replace("column = \"n_rpm\"", "column = \"n_rpm\"\ncounts_per_turn = 4096"));
    assert_eq!(t.load, LoadPlan::Unknown);
    let case = Case::from_intake(motor(), vec![t], None);
    assert!(case.train[0].speed_is_imposed() && case.train[0].channels.iter().all(|c| c.kind != ChannelKind::Speed));
}
