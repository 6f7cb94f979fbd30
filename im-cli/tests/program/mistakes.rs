//! Reading mistakes and absurd numbers: the run ends before it fits or simulates anything, and says what is wrong.

use std::fs;

use crate::common::{Folder, demo, done, example, im, refused, text};

/// The demo's recording with every row's fields changed.
fn spoilt(change: impl Fn(usize, &mut [f64])) -> String {
    let whole = fs::read_to_string(demo("train1.csv")).unwrap();
    let mut lines = whole.lines();
    let mut out = lines.next().unwrap().to_owned() + "\n";
    for (k, line) in lines.enumerate() {
        let mut fields: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        change(k, &mut fields);
        out += &(fields.iter().map(f64::to_string).collect::<Vec<_>>().join(",") + "\n");
    }
    out
}

/// Columns: t, u_alpha, u_beta, i_alpha, i_beta, omega_m, tau_load.
#[test]
fn reading_mistakes_end_the_run_with_what_is_wrong() {
    let dir = Folder::new("mistakes");
    type Change = fn(usize, &mut [f64]);
    let mistakes: [(&str, Change, &[&str]); 13] = [
        ("time in us", |_, x| x[0] *= 1e6, &["unit = \"us\""]),
        ("time in ms", |_, x| x[0] *= 1e3, &["unit = \"ms\""]),
        ("time of no clock", |_, x| x[0] *= 1e30, &["Give the time in seconds"]),
        ("time in thousands of s", |_, x| x[0] *= 1e-6, &["Give the time in seconds"]),
        ("time in ks", |_, x| x[0] *= 1e-3, &["The voltage turns at", "where the motor is rated for 50 Hz"]),
        ("a dead speed sensor", |_, x| x[5] = 0.0, &["The speed stays at 0 rad/s", "sensor is dead"]),
        ("an axis of the voltage reversed", |_, x| x[2] = -x[2], &["turn against the voltages"]),
        ("the voltage reversed", |_, x| (x[1], x[2]) = (-x[1], -x[2]), &["against the voltages: turned back they would fit"]),
        ("current in mA", |_, x| (x[3], x[4]) = (1e3 * x[3], 1e3 * x[4]), &["unit = \"mA\""]),
        ("current in kA", |_, x| (x[3], x[4]) = (1e-3 * x[3], 1e-3 * x[4]), &["unit = \"kA\""]),
        ("a dead current sensor", |_, x| x[4] = 0.0, &["in every row", "sensor is dead"]),
        ("a current sensor of noise", |k, x| x[4] = 1e-4 * (k % 7) as f64, &["sensor is dead"]),
        ("a constant voltage", |_, x| x[1] = 230.0, &["in every row"]),
    ];
    for (name, change, said) in mistakes {
        let data = dir.file("run.csv", &spoilt(change));
        let (out, to) = (dir.path("out"), dir.path("m.toml"));
        let motor = demo("motor.toml");
        let base = ["--motor", &motor, "--train", &data];
        let fit = [&["fit"], &base[..], &["-o", &to]].concat();
        let diagnose = [&["diagnose"], &base[..], &["--out", &out]].concat();
        for command in [fit, diagnose] {
            let message = refused(&command);
            assert!(said.iter().all(|s| message.contains(s)), "{name}: {message}");
            assert!(message.contains("--anyway") && message.contains("serious"), "{name}: {message}");
        }
        assert!(!dir.has("m.toml") && !dir.has("out/report.html"), "{name}");
    }
}

/// Who asks for it gets the fit all the same, after what is wrong.
#[test]
fn anyway_goes_on() {
    let dir = Folder::new("anyway");
    let (data, to) = (dir.file("run.csv", &spoilt(|_, x| x[2] = -x[2])), dir.path("m.toml"));
    let o = im(&["fit", "--motor", &demo("motor.toml"), "--train", &data, "-o", &to, "--anyway"]);
    let said = text(&o.stderr);
    assert_eq!(o.status.code(), Some(0), "{said}");
    assert!(said.contains("turn against the voltages") && dir.has("m.toml"), "{said}");
}

/// Absurd times, voltages, sampling times and inductances: refused, or answered in numbers; nothing that is none is printed or written.
#[test]
fn what_is_no_number_is_neither_printed_nor_written() {
    let dir = Folder::new("no-number");
    let (motor, copy) = (demo("motor.toml"), demo("motor.toml"));
    let is_number = |text: &str| {
        let words = text.split(|c: char| !(c.is_alphanumeric() || c == '_'));
        words.filter(|word| matches!(*word, "NaN" | "nan" | "inf" | "Infinity")).count() == 0
    };
    type Change = fn(usize, &mut [f64]);
    let absurd: [(&str, Change); 6] = [
        ("times", |_, x| x[0] *= 1e30),
        ("times", |_, x| x[0] *= 1e-12),
        ("voltages", |_, x| (x[1], x[2]) = (1e300 * x[1], 1e300 * x[2])),
        ("voltages", |_, x| (x[1], x[2]) = (1e-300 * x[1], 1e-300 * x[2])),
        ("currents", |_, x| (x[3], x[4]) = (1e200 * x[3], 1e200 * x[4])),
        ("torques", |_, x| x[6] = 1e300),
    ];
    for (what, change) in absurd {
        let data = dir.file("run.csv", &spoilt(change));
        for command in [
            &["validate", "--before", &motor, "--after", &copy, "--data", &data, "--json"][..],
            &["validate", "--before", &motor, "--after", &copy, "--data", &data, "--anyway"],
            &["compare", "--motor", &motor, "--data", &data, "--json"],
            &["observe", "--motor", &motor, "--data", &data, "--observer", "kubota", "--json"],
            &["identify", "--motor", &motor, "--online", "--data", &data, "--json"],
        ] {
            let o = im(command);
            let (printed, said) = (text(&o.stdout), text(&o.stderr));
            assert!(matches!(o.status.code(), Some(0 | 1)), "{what} {command:?}: {said}");
            assert!(is_number(&printed) && is_number(&said), "{what} {command:?}: {printed}{said}");
            // One line says which input it is.
            assert!(o.status.success() || said.contains("run"), "{what} {command:?}: {said}");
        }
    }
    let subnormal = fs::read_to_string(example("motor.toml")).unwrap();
    let subnormal = dir.file("subnormal.toml", &subnormal.replace("inductance_h = 0.156", "inductance_h = 1e-310"));
    #[cfg(feature = "verify")]
    {
        let message = refused(&["verify", "--claim", "1", "--cases", "5", "--motor", &subnormal]);
        assert!(message.contains("subnormal.toml:11: magnetizing_inductance_h = 1e-310 must be"), "{message}");
    }
    let _ = subnormal;
    // Steps of the clock that no drive has, by the recording's own times.
    let message = |change: Change| {
        let data = dir.file("odd.csv", &spoilt(change));
        refused(&["identify", "--motor", &motor, "--online", "--data", &data])
    };
    let slow = message(|_, x| x[0] *= 5e3);
    assert!(slow.contains("odd.csv") && slow.contains("sample_time_s = 1 must be"), "{slow}");
    let fast = message(|_, x| x[0] *= 1e-9);
    assert!(fast.contains("odd.csv") && fast.contains("sample_time_s = 2e-13 must be"), "{fast}");
}

/// Every number of every region file made huge, tiny or no number: the design is refused, or what is written is of numbers.
#[cfg(feature = "design")]
#[test]
fn gains_are_numbers_whatever_the_region() {
    let dir = Folder::new("regions");
    let (region, gains, rust) = (dir.path("region.toml"), dir.path("gains.toml"), dir.path("gains.rs"));
    for kind in ["kubota", "thau", "derdiyok", "utkin", "kenne", "jadot", "sampled"] {
        let sample = done(&["design", "example-region", kind]);
        let keys = sample.lines().filter(|l| !l.starts_with('#') && l.contains(" = "));
        for (key, line) in keys.filter_map(|line| Some((line.split(" = ").next()?, line))) {
            for odd in ["1e290", "-1e300", "1e-300", "inf", "nan"] {
                let value = if line.contains('[') { format!("{key} = [{odd}, {odd}]") } else { format!("{key} = {odd}") };
                fs::write(&region, sample.replace(line, &value)).unwrap();
                let _ = (fs::remove_file(&gains), fs::remove_file(&rust));
                let o =
                    im(&["design", kind, "--motor", &example("motor.toml"), "--region", &region, "-o", &gains, "--rust", &rust]);
                let said = text(&o.stderr);
                if o.status.code() == Some(1) {
                    assert!(said.contains("region.toml") || said.contains("infeasible"), "{kind} {value}: {said}");
                    assert!(!dir.has("gains.toml") && !dir.has("gains.rs"), "{kind} {value}");
                    continue;
                }
                assert_eq!(o.status.code(), Some(0), "{kind} {value}: {said}");
                for written in ["gains.toml", "gains.rs"] {
                    let text = dir.read(written).to_lowercase();
                    let none = |word: &str| matches!(word, "inf" | "nan" | "infinity");
                    assert!(!text.split(|c: char| !c.is_alphanumeric()).any(none), "{kind} {value}: {text}");
                }
            }
        }
    }
}

#[test]
fn the_true_recording_of_the_same_test_is_not_stopped() {
    let dir = Folder::new("no-mistake");
    let data = dir.file("run.csv", &spoilt(|_, _| ()));
    let o = im(&["compare", "--motor", &demo("motor.toml"), "--data", &data, "--json"]);
    assert_eq!(o.status.code(), Some(0), "{}", text(&o.stderr));
    assert!(!text(&o.stdout).contains("\"serious\""), "{}", text(&o.stdout));
}

const TABLE: &str = "V_LL_V,I_A,P_3ph_W,n_rpm,T_Nm\n";

#[test]
fn tables_that_determine_nothing_end_the_run() {
    let dir = Folder::new("tables");
    let three = "400,4.9,310,1499,0\n400,6.1,1900,1474,10\n400,8.0,3500,1446,20\n";
    let no_torque = "V_LL_V,I_A,P_3ph_W,n_rpm\n400,4.9,310,1499\n400,5.2,900,1489\n400,5.6,1400,1481\n400,6.1,1900,1474\n\
                     400,7.0,2700,1460\n400,8.0,3500,1446\n";
    let zero = TABLE.to_owned() + &no_torque.lines().skip(1).map(|l| l.to_owned() + ",0\n").collect::<String>();
    for (name, rows, said) in [
        ("three rows", TABLE.to_owned() + three, "do not determine a machine"),
        ("one row twice", TABLE.to_owned() + &"400,4.9,310,1499,0\n".repeat(2), "do not determine a machine"),
        ("torque all zero", zero, "the torque is zero in every row"),
    ] {
        let table = dir.file("table.csv", &rows);
        for command in ["fit", "diagnose"] {
            let (out, file) = (dir.path("out"), dir.path("m.toml"));
            let to = if command == "fit" { ["-o", &file] } else { ["--out", &out] };
            let message = refused(&[&[command, "--motor", &example("motor.toml"), "--table", &table][..], &to].concat());
            assert!(message.contains(said), "{name}: {message}");
        }
    }
    // Where the speed is shown the torque is not needed for the windings; what such rows do not determine is marked.
    let table = dir.file("table.csv", no_torque);
    let out = done(&["fit", "--motor", &example("motor.toml"), "--table", &table, "-o", &dir.path("m.toml")]);
    assert!(out.contains("not determined by these recordings") && out.contains("held"), "{out}");
}

/// Machines and inverters that nobody has: refused by the number, with where such numbers lie.
#[test]
fn absurd_machines_are_refused_before_they_are_simulated() {
    let dir = Folder::new("absurd");
    let motor = fs::read_to_string(example("motor.toml")).unwrap();
    let scenario = example("scenario_dol.toml");
    let with = |from: &str, to: &str| {
        assert!(motor.contains(from), "{from}");
        let file = dir.file("motor.toml", &motor.replacen(from, to, 1));
        refused(&["simulate", "--motor", &file, "--scenario", &scenario, "-o", &dir.path("run.csv")])
    };
    let message = with("stator_leakage_inductance_h = 0.004", "stator_leakage_inductance_h = 1e-308");
    assert!(
        message.contains("stator_leakage_inductance_h = 1e-308 must be from 1e-8 to 10000, where all machines are"),
        "{message}"
    );
    let message = with("electrical_frequency_hz = 50.0", "electrical_frequency_hz = 1e20");
    assert!(message.contains("electrical_frequency_hz = 1e20 must be"), "{message}");
    let message = with("viscous_friction_nm_s_per_rad = 0.002", "viscous_friction_nm_s_per_rad = 1e6");
    assert!(message.contains("machine.viscous_friction_nm_s_per_rad = 1000000 makes the machine change within"), "{message}");
    let stiff = dir.file("stiff.toml", &(motor.clone() + "\n[effects.inverter_nonlinearity]\nvoltage_v = 1e19\n"));
    let message = refused(&["simulate", "--motor", &stiff, "--scenario", &scenario, "-o", &dir.path("run.csv")]);
    assert!(message.contains("stiff.toml:27: voltage_v = 1e19 must be from 1e-12 to 1e12"), "{message}");
    // A number that some machine might have, but none that can be simulated.
    let stiff = dir.file("stiff.toml", &(motor.clone() + "\n[effects.inverter_nonlinearity]\nvoltage_v = 1e11\n"));
    for of in
        [&["compare", "--data", &demo("train1.csv")][..], &["simulate", "--scenario", &scenario, "-o", &dir.path("run.csv")]]
    {
        let message = refused(&[of, &["--motor", &stiff]].concat());
        assert!(message.contains("inverter_nonlinearity.voltage_v = 1e11"), "{message}");
    }
    assert!(!dir.has("run.csv"));
}

#[test]
fn periods_of_no_clock_are_refused() {
    let dir = Folder::new("periods");
    let region = dir.path("region.toml");
    let of = |kind: &str, text: &str, more: &[&str]| {
        fs::write(&region, text).unwrap();
        let (motor, to) = (example("motor.toml"), dir.path("g.toml"));
        let base = ["design", kind, "--motor", &motor, "--region", &region, "-o", &to];
        im(&[&base[..], more].concat())
    };
    let o = of("kubota", "speed_rad_s = [-100.0, 100.0]\nrate_per_s = 3.0\n", &["--period", "1e-320"]);
    assert_eq!(o.status.code(), Some(2));
    assert!(text(&o.stderr).contains("usual are 20 to 500"), "{}", text(&o.stderr));
    for (period, said) in [("5e-324", "usual are 20 to 500"), ("0.3", "periods up to")] {
        let o = of("sampled", &format!("speed_rad_s = [-100.0, 100.0]\nperiod_s = {period}\nrate_per_s = 1.0\n"), &[]);
        assert_eq!(o.status.code(), Some(1));
        assert!(text(&o.stderr).contains(said), "{}", text(&o.stderr));
    }
    assert!(!dir.has("g.toml"));
}

#[test]
fn a_mapping_that_names_a_missing_file_says_so() {
    let dir = Folder::new("missing-file");
    let columns = "[time]\ncolumn = \"t\"\n[voltage]\nalpha = \"u\"\nbeta = \"v\"\n[current]\nalpha = \"i\"\nbeta = \"j\"\n";
    let mapping = dir.file("x.recording.toml", &format!("file = \"nope.csv\"\n{columns}"));
    let message = refused(&["compare", "--motor", &example("motor.toml"), "--data", &mapping]);
    assert!(message.contains("x.recording.toml: file is") && message.contains("nope.csv"), "{message}");
}

#[test]
fn a_training_recording_held_out_proves_nothing() {
    let dir = Folder::new("held-twice");
    let train = demo("train1.csv");
    let copy = dir.file("copy.csv", &fs::read_to_string(&train).unwrap());
    for held in [&train, &copy] {
        let message = refused(&["diagnose", "--motor", &demo("motor.toml"), "--train", &train, "--holdout", held]);
        assert!(message.contains("the same rows as the training recording"), "{message}");
    }
}

/// What is given twice would count twice.
#[test]
fn a_training_recording_is_not_taken_twice() {
    let f = Folder::new("twice");
    let [train, other] = ["train1.csv", "train2.csv"].map(demo);
    let copy = f.file("copy.csv", &fs::read_to_string(&train).unwrap());
    for again in [&train, &copy] {
        let message = refused(&["fit", "--motor", &demo("motor.toml"), "--train", &train, "--train", &other, "--train", again]);
        assert!(message.contains("the same rows as train1") && message.contains("give it once"), "{message}");
    }
}
