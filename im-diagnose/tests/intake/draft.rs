//! Files that nobody described.

use im_diagnose::intake::IntakeError;

use crate::simulated::{Folder, column, columns, csv, start, take};

#[test]
fn a_foreign_file_is_guessed_and_read_as_if_it_had_been_described() {
    let folder = Folder::new("guess");
    let t = take(&folder.put("run.csv", csv(&columns()))).unwrap();
    let draft = t.draft.unwrap();
    let said = draft.guesses.join("\n");
    println!("{}\n{said}", draft.text);
    for word in [
        "u1_V, u2_V, u3_V are the voltages a, b, c",
        "i1_A, i2_A, i3_A are the currents",
        "n_rpm is the speed in rpm",
        "T_Nm is the load torque",
    ] {
        assert!(said.contains(word), "{word}: {said}");
    }
    let r = start();
    assert!((t.experiment.u_s[2000] - r.u_s[2000]).norm() < 1e-9);
    assert!((t.experiment.channels[2].values[2000] - r.omega_m[2000]).abs() < 1e-9);
    assert_eq!(t.findings, []);
}

/// Another language, another separator, decimal commas, milliamperes, a line of units, phases in another order, a second sensor.
#[test]
fn a_spreadsheet_in_another_language_is_guessed() {
    let all = columns();
    let mut text = String::from(
        "Messung vom 3. April\nZeit;U_L1;U_L2;U_L3;Strom 1;Strom 3;Strom 2;Drehzahl;Strom 3b\n(s);(V);(V);(V);(mA);(mA);(mA);(1/min);(mA)\n",
    );
    for k in 0..all[0].1.len() {
        let x = |c: usize| all[c].1[k];
        let row = [x(0), x(1), x(2), x(3), 1e3 * x(4), 1e3 * x(6), 1e3 * x(5), x(7), 990.0 * x(6)];
        text += &row.map(|x| format!("{x:.7}").replace('.', ",")).join(";");
        text.push('\n');
    }
    let folder = Folder::new("german");
    let t = take(&folder.put("run.csv", text)).unwrap();
    let draft = t.draft.unwrap();
    let said = draft.guesses.join("\n");
    println!("{}\n{said}", draft.text);
    assert!(said.contains("second sensor") && said.contains("1/min"), "{said}");
    let r = start();
    assert!((t.experiment.u_s[2000] - r.u_s[2000]).norm() < 1e-3);
    let i = |k: usize| im_model::Complex::new(t.experiment.channels[0].values[k], t.experiment.channels[1].values[k]);
    assert!((i(2000) - r.i_s[2000]).norm() < 0.3, "{} {}", i(2000), r.i_s[2000]);
}

#[test]
fn what_cannot_be_guessed_is_asked_for_with_its_key() {
    let mut all = columns();
    all.iter_mut().for_each(|(n, x)| {
        if *n == "n_rpm" {
            *n = "tacho";
            x.iter_mut().for_each(|n| *n *= 0.005);
        }
    });
    let folder = Folder::new("ask");
    let e = take(&folder.put("run.csv", csv(&all))).map(|t| t.findings).unwrap_err();
    assert!(e.to_string().contains("[speed] unit"), "{e}");
    let IntakeError::Unmapped { draft, .. } = e else { panic!("{e}") };
    assert!(draft.text.contains("FILL_IN"));
    all.retain(|(n, _)| !n.starts_with('i'));
    let e = take(&folder.put("run.csv", csv(&all))).unwrap_err().to_string();
    assert!(e.contains("[current] a, b, c"), "{e}");
}

/// A drive's log: commanded voltages as shares of the dc link, an observer's currents and speed beside the sensors', filtered and raw speed.
#[test]
fn commands_and_estimates_in_a_drive_log_are_no_sensors() {
    let all = columns();
    let x = |c: usize| all[c].1.clone();
    let r = start();
    let scaled = |x: Vec<f64>, by: f64| x.into_iter().map(|x| x * by).collect::<Vec<_>>();
    let (alpha, beta) = (r.u_s.iter().map(|u| u.re).collect::<Vec<_>>(), r.u_s.iter().map(|u| u.im).collect::<Vec<_>>());
    let link = vec![540.0; r.len()];
    let log = [
        ("t", x(0)),
        ("iA_est", scaled(x(4), 0.99)),
        ("ia", x(4)),
        ("ib", x(5)),
        ("omega_filt", r.omega_m.clone()),
        ("vel1", r.omega_m.clone()),
        ("omega_hat", r.omega_m.clone()),
        ("v_alpha_ref", scaled(alpha, 1.0 / 540.0)),
        ("v_beta_ref", scaled(beta, 1.0 / 540.0)),
        ("v_dc", link),
        ("id_ref", x(6)),
    ];
    let folder = Folder::new("drive-log");
    let t = take(&folder.put("run.csv", csv(&log))).unwrap();
    let draft = t.draft.unwrap();
    let said = draft.guesses.join("\n");
    for words in [
        "v_alpha_ref, v_beta_ref are the voltages alpha, beta (by their names; commanded, not measured)",
        "are shares of v_dc, the voltage of the dc link",
        "ia, ib are the currents a, b",
        "vel1 is the speed in rad/s",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    assert!(!said.contains("second sensor"), "{said}");
    assert!((t.experiment.u_s[2000] - r.u_s[2000]).norm() < 1e-3);
    // The same without the link: what one is must be said.
    let e = take(&folder.put("other.csv", csv(&log[..9]))).unwrap_err().to_string();
    assert!(e.contains("[voltage] gain"), "{e}");
}

#[test]
fn an_electrical_speed_without_a_unit_is_recognized() {
    let mut all = columns();
    all.iter_mut().for_each(|(n, x)| {
        if *n == "n_rpm" {
            *n = "omega_el";
            x.iter_mut().for_each(|n| *n *= 2.0 * std::f64::consts::PI / 30.0);
        }
    });
    let folder = Folder::new("electrical");
    let t = take(&folder.put("run.csv", csv(&all))).unwrap();
    let text = t.draft.unwrap().text;
    assert!(text.contains("electrical = true") && text.contains("unit = \"rad/s\""), "{text}");
    assert!((t.experiment.channels[2].values[2000] - start().omega_m[2000]).abs() < 1e-6);
}

/// The simulation's voltage is held over each sample; a voltmeter would have shown its value at the row.
#[test]
fn the_instant_of_a_voltage_is_decided_by_the_fit() {
    let folder = Folder::new("instant");
    let drafted = |name: &str, all: &[(&str, Vec<f64>)]| {
        let draft = take(&folder.put(name, csv(all))).unwrap().draft.unwrap();
        (draft.text, draft.guesses.join("\n"))
    };
    let (text, said) = drafted("held.csv", &columns());
    assert!(text.contains("instant = \"held_from_row\"") && said.contains("the model fits better so"), "{said}");
    let mut all = columns();
    for name in ["u1_V", "u2_V", "u3_V"] {
        let u = column(&mut all, name);
        let held = u.clone();
        u.iter_mut().skip(1).zip(held.windows(2)).for_each(|(u, w)| *u = 0.5 * (w[0] + w[1]));
    }
    let (text, said) = drafted("sampled.csv", &all);
    assert!(text.contains("instant = \"sample\"") && said.contains("the model fits better so"), "{said}");
}
