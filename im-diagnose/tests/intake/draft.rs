//! Files that nobody described.

use std::path::Path;

use im_diagnose::intake::IntakeError;
use im_model::simulation::{Scenario, Simulation};
use im_model::space_vector::to_phases;
use im_model::{Complex, EffectId, Machine};

use crate::simulated::{Folder, column, columns, csv, motor, start, take, taken};

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

#[test]
fn a_workbook_is_said_to_be_one() {
    let folder = Folder::new("workbook");
    let e = take(&folder.put("run.xlsx", b"PK\x03\x04\x14\x00\x06\x00rest")).unwrap_err().to_string();
    assert!(e.contains("run.xlsx") && e.contains("save its sheet as CSV"), "{e}");
}

/// Another language and its letters in Latin-1, another separator, decimal commas, milliamperes, a line of units, phases in another order, a second sensor.
#[test]
fn a_spreadsheet_in_another_language_is_guessed() {
    let all = columns();
    let mut text = String::from(
        "Prüfstand 3, März\nZeit;U_L1;U_L2;U_L3;Strom 1;Strom 3;Strom 2;Drehzahl;Strom 3b\n(s);(V);(V);(V);(mA);(mA);(mA);(1/min);(mA)\n",
    );
    for k in 0..all[0].1.len() {
        let x = |c: usize| all[c].1[k];
        let row = [x(0), x(1), x(2), x(3), 1e3 * x(4), 1e3 * x(6), 1e3 * x(5), x(7), 990.0 * x(6)];
        text += &row.map(|x| format!("{x:.7}").replace('.', ",")).join(";");
        text.push('\n');
    }
    let folder = Folder::new("german");
    let latin_1: Vec<u8> = text.chars().map(|c| u8::try_from(c).unwrap()).collect();
    let t = take(&folder.put("run.csv", latin_1)).unwrap();
    let draft = t.draft.unwrap();
    let said = draft.guesses.join("\n");
    println!("{}\n{said}", draft.text);
    assert!(said.contains("second sensor") && said.contains("1/min"), "{said}");
    let r = start();
    assert!((t.experiment.u_s[2000] - r.u_s[2000]).norm() < 1e-3);
    let i = |k: usize| im_model::Complex::new(t.experiment.channels[0].values[k], t.experiment.channels[1].values[k]);
    assert!((i(2000) - r.i_s[2000]).norm() < 0.3, "{} {}", i(2000), r.i_s[2000]);
}

/// Whether voltages are samples or means over the sample, a fit says; against what canonical names say only where the model explains the data.
#[test]
fn canonical_names_say_which_instant_a_voltage_belongs_to_unless_the_data_know_better() {
    let mut all = columns();
    for (name, x) in all.iter_mut().filter(|(n, _)| n.starts_with('u')) {
        // What a voltmeter shows at the row: half way between the means before and after it.
        *x = (0..x.len()).map(|k| 0.5 * (x[k.saturating_sub(1)] + x[k])).collect();
        *name = ["u1", "u2", "u3"][usize::from(name.as_bytes()[1] - b'1')];
    }
    let folder = Folder::new("instant");
    let guessed = |all: &[(&str, Vec<f64>)]| take(&folder.put("run.csv", csv(all))).unwrap().draft.unwrap().text;
    assert!(guessed(&all).contains("instant = \"sample\""), "{}", guessed(&all));
    for (name, _) in all.iter_mut().filter(|(n, _)| n.starts_with('u')) {
        *name = ["u_a_V", "u_b_V", "u_c_V"][usize::from(name.as_bytes()[1] - b'1')];
    }
    assert!(guessed(&all).contains("instant = \"sample\""), "{}", guessed(&all));
    for (name, x) in &mut all {
        // A saturated sensor that the model does not know.
        if name.starts_with('i') {
            x.iter_mut().for_each(|i| *i = 8.0 * (*i / 8.0).tanh());
        }
    }
    assert!(guessed(&all).contains("instant = \"held_from_row\""), "{}", guessed(&all));
    // A voltmeter's noise shows that they are samples, whatever is missing.
    let mut chance = 1_u64;
    for (_, x) in all.iter_mut().filter(|(n, _)| n.starts_with('u')) {
        x.iter_mut().for_each(|u| {
            chance = chance.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            *u += (chance >> 40) as f64 / 2f64.powi(24) - 0.5;
        });
    }
    assert!(guessed(&all).contains("instant = \"sample\""), "{}", guessed(&all));
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
    // Used as it is, the draft says what is still open.
    let open = folder.put("run.recording.toml", &draft.text);
    let e = take(&folder.put("run.csv", csv(&all))).map(|t| t.findings).unwrap_err().to_string();
    assert!(e.contains("run.recording.toml:") && e.contains("FILL_IN") && e.contains("unit"), "{e}");
    std::fs::remove_file(open).unwrap();
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
        "v_alpha_ref, v_beta_ref are the voltages alpha, beta, taken as V (by their names; commanded, not measured)",
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
fn a_share_of_a_rated_value_asks_for_that_value() {
    let mut all = columns();
    for (name, in_pu) in [("i1_A", "I1 [pu]"), ("i2_A", "I2 [pu]"), ("i3_A", "I3 [pu]")] {
        let one = all.iter_mut().find(|c| c.0 == name).unwrap();
        *one = (in_pu, one.1.iter().map(|x| x / 12.0).collect());
    }
    let folder = Folder::new("pu");
    let t = take(&folder.put("run.csv", csv(&all))).unwrap();
    let draft = t.draft.unwrap();
    let said = "in pu, and taken as A: write what one of them is in A as gain of [current]";
    assert!(draft.guesses.iter().any(|g| g.contains(said)), "{:?}", draft.guesses);
    assert!(draft.text.contains("gain = 1                     # what one pu is in A"), "{}", draft.text);
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

/// A table of a type test, given as a recording: what rises from row to row are a current and a power, and no time.
#[test]
fn a_table_is_sent_to_where_tables_go() {
    let folder = Folder::new("no-time");
    let rows: String = (0..300).map(|k| format!("400;{};{};1490\n", 5 + k, 1 + k)).collect();
    let path = folder.put("last.csv", format!("U (V);I (A);P (kW);n (rpm)\n{rows}"));
    let e = take(&path).unwrap_err().to_string();
    assert!(e.contains("no column advances from row to row") && e.contains("as --table"), "{e}");
}

/// d and q in a drive's frame, with its angle in turns; and duty cycles beside the voltage of the link.
#[test]
fn turning_frames_and_duty_cycles_are_what_they_stand_for() {
    let (all, r) = (columns(), start());
    let x = |c: usize| all[c].1.clone();
    let frame = |k: usize| std::f64::consts::TAU * 50.0 * k as f64 * r.sample_time_s;
    let turned = |x: &[im_model::Complex<f64>]| -> Vec<im_model::Complex<f64>> {
        x.iter().enumerate().map(|(k, x)| x * im_model::Complex::from_polar(1.0, -frame(k))).collect()
    };
    let (u, i) = (turned(&r.u_s), turned(&r.i_s));
    let angle = (0..r.len()).map(|k| (frame(k) / std::f64::consts::TAU).fract()).collect();
    let part = |x: &[im_model::Complex<f64>], re: bool| x.iter().map(|x| if re { x.re } else { x.im }).collect::<Vec<f64>>();
    let dq = [
        ("t_s", x(0)),
        ("ud_V", part(&u, true)),
        ("uq_V", part(&u, false)),
        ("id_A", part(&i, true)),
        ("iq_A", part(&i, false)),
        ("theta", angle),
        ("n_rpm", x(7)),
    ];
    let link = vec![650.0; r.len()];
    let leg = |c: usize| all[c].1.iter().map(|u| 0.5 + u / 650.0).collect::<Vec<f64>>();
    let duty = [
        ("t_s", x(0)),
        ("duty_a", leg(1)),
        ("duty_b", leg(2)),
        ("duty_c", leg(3)),
        ("v_dc", link),
        ("ia", x(4)),
        ("ib", x(5)),
        ("ic", x(6)),
        ("n_rpm", x(7)),
    ];
    let folder = Folder::new("frames");
    for (name, columns) in [("dq.csv", &dq[..]), ("duty.csv", &duty[..])] {
        let t = take(&folder.put(name, csv(columns))).unwrap();
        assert!((t.experiment.u_s[2000] - r.u_s[2000]).norm() < 1e-6, "{name}: {}", t.draft.unwrap().text);
        let i = im_model::Complex::new(t.experiment.channels[0].values[2000], t.experiment.channels[1].values[2000]);
        assert!((i - r.i_s[2000]).norm() < 0.3, "{name}: {i}");
    }
}

/// A time in milliseconds that does not say so, and currents of the other sign.
#[test]
fn the_unit_of_time_and_the_sign_of_the_currents_are_seen() {
    let (mut all, r) = (columns(), start());
    for (name, x) in &mut all {
        match *name {
            "t_s" => (*name, *x) = ("time", x.iter().map(|t| 1e3 * t).collect()),
            n if n.starts_with('i') => x.iter_mut().for_each(|i| *i = -*i),
            _ => {}
        }
    }
    let folder = Folder::new("signs");
    let t = take(&folder.put("run.csv", csv(&all))).unwrap();
    let said = t.draft.unwrap().guesses.join("\n");
    assert!(said.contains("time is in ms") && said.contains("turned back"), "{said}");
    // How often it is sampled is said in the unit that was settled, and not before.
    assert_eq!(said.matches("sampled at").count(), 1, "{said}");
    assert!((t.experiment.sample_time_s / r.sample_time_s - 1.0).abs() < 1e-6, "{}", t.experiment.sample_time_s);
    assert!((t.experiment.channels[0].values[2000] - r.i_s[2000].re).abs() < 0.3);
}

/// What a mapping can say of sensors: counts of an encoder, channels sampled one after the other, a voltmeter.
#[test]
fn counts_delays_and_measured_voltages_are_said_by_the_mapping() {
    let (all, r) = (columns(), start());
    let mut turn = 0.0;
    let counts = r.omega_m.iter().map(|w| {
        turn += w * r.sample_time_s / std::f64::consts::TAU;
        (turn * 4096.0).floor().rem_euclid(65536.0)
    });
    let mut with: Vec<(&str, Vec<f64>)> = all.clone();
    with.push(("enc", counts.collect()));
    let mapping = |more: &str| {
        format!(
            "[time]\ncolumn = \"t_s\"\n[voltage]\na = \"u1_V\"\nb = \"u2_V\"\nc = \"u3_V\"\n{more}[current]\na = \"i1_A\"\nb = \"i2_A\"\n\
             c = {{ column = \"i3_A\", delay_s = 0.0 }}\n[speed]\ncolumn = \"enc\"\ncounts_per_turn = 4096\n[load]\nnone = true\n"
        )
    };
    let t = taken("counts", &with, &mapping(""));
    let speed = t.experiment.channels.iter().find(|c| c.name == "omega_m_rad_s").unwrap();
    let off = (500..r.len() - 500).map(|k| (speed.values[k] - r.omega_m[k]).abs()).fold(0.0, f64::max);
    // A count over the window, and the speed's own noise.
    assert!(off < 1.5, "{off}");
    let inert = |name: &str, more: &str| taken(name, &with, &mapping(more)).experiment.inert;
    assert_eq!(t.experiment.inert, Some(EffectId::VoltageOffset));
    assert_eq!(inert("metered", "measured = true\n"), Some(EffectId::InverterNonlinearity));
    assert_eq!(inert("sampled", "instant = \"sample\"\n"), Some(EffectId::InverterNonlinearity));
}

/// A locked rotor at a fifth of the voltage, no load and a start, without a column of the speed: the first alone is taken for a standing rotor.
#[test]
fn a_standing_rotor_is_suggested_by_its_impedance() {
    let said = |name: &str, peak_v: f64, locked: bool| {
        let scenario = format!(
            "[scenario]\nduration_s = 0.8\nsample_time_s = 2e-4\n[mains]\nvoltage_peak_v = {peak_v}\nfrequency_hz = 50\n[sensors]\nseed = 1\n"
        );
        let scenario = Scenario::parse(&scenario, "scenario.toml", Path::new("")).unwrap();
        let mut p = *motor().machine.parameters();
        if locked {
            // What no torque of a test moves.
            p.inertia_kg_m2 = 1e4;
        }
        let machine = Machine::base(p, 2).unwrap();
        let r = Simulation::new(&machine, &scenario).run().unwrap().recording;
        let phases = |x: &[Complex<f64>], k: usize| x.iter().map(|v| to_phases(*v)[k]).collect::<Vec<f64>>();
        let mut all = vec![("t_s", (0..r.len()).map(|k| r.time_s(k)).collect())];
        all.extend(["u1_V", "u2_V", "u3_V"].into_iter().enumerate().map(|(k, n)| (n, phases(&r.u_s, k))));
        all.extend(["i1_A", "i2_A", "i3_A"].into_iter().enumerate().map(|(k, n)| (n, phases(&r.i_s, k))));
        let folder = Folder::new(name);
        take(&folder.put("run.csv", csv(&all))).unwrap().draft.unwrap().guesses.join("\n")
    };
    let (locked, free) = (said("locked", 65.0, true), said("free", 326.6, false));
    assert!(locked.contains("locked = true"), "{locked}");
    assert!(!free.contains("locked = true"), "{free}");
    assert!(!said("reduced", 150.0, false).contains("locked = true"));
}

/// Torques that a drive computes or demands are not what brakes the shaft.
#[test]
fn a_computed_torque_is_not_taken_for_the_load() {
    for name in ["T_est_Nm", "T_ref_Nm", "M_soll_Nm", "T_em_Nm", "torque_observed_Nm"] {
        let mut all = columns();
        all.iter_mut().find(|(n, _)| *n == "T_Nm").unwrap().0 = name;
        let folder = Folder::new(&format!("computed-{name}"));
        let t = take(&folder.put("run.csv", csv(&all))).unwrap();
        assert_eq!(t.load, im_diagnose::intake::LoadPlan::Unknown, "{name}");
        let said = t.draft.unwrap().guesses.join("\n");
        assert!(said.contains("not taken for the load") && said.contains(name), "{said}");
        // Beside a sensor that is the one.
        all.push(("T_Nm", column(&mut columns(), "T_Nm").clone()));
        let t = take(&folder.put("run.csv", csv(&all))).unwrap();
        assert!(t.draft.unwrap().guesses.join("\n").contains("T_Nm is the load torque, positive"), "{name}");
    }
}

/// Two currents of any two phases are three.
#[test]
fn two_of_three_currents_are_enough() {
    for (left_out, keys) in [("i1_A", "b, c"), ("i2_A", "a, c"), ("i3_A", "a, b")] {
        let mut all = columns();
        all.retain(|(n, _)| *n != left_out);
        let folder = Folder::new(&format!("two-currents-{left_out}"));
        let t = take(&folder.put("run.csv", csv(&all))).unwrap();
        let said = t.draft.unwrap().guesses.join("\n");
        assert!(said.contains(&format!("are the currents {keys}")), "{said}");
        let i = |k: usize| Complex::new(t.experiment.channels[0].values[k], t.experiment.channels[1].values[k]);
        assert!((i(2000) - start().i_s[2000]).norm() < 1e-9, "{left_out}");
    }
}

/// A counter of an encoder's lines is a speed: how many make a turn it says itself where it begins anew at each, and is asked where it does not.
#[test]
fn an_encoder_counter_is_recognized() {
    let r = start();
    let with = |range: f64, sign: f64| {
        let mut turn = 0.0;
        let counts = r.omega_m.iter().map(|w| {
            turn += sign * w * r.sample_time_s / std::f64::consts::TAU;
            (turn * 4096.0).floor().rem_euclid(range)
        });
        let mut all = columns();
        all.retain(|(n, _)| *n != "n_rpm");
        all.push(("encoder", counts.collect()));
        all
    };
    let folder = Folder::new("counter");
    let t = take(&folder.put("run.csv", csv(&with(4096.0, -1.0)))).unwrap();
    let draft = t.draft.unwrap();
    assert!(draft.text.contains("counts_per_turn = 4096") && draft.text.contains("gain = -1"), "{}", draft.text);
    let speed = t.experiment.channels.iter().find(|c| c.name == "omega_m_rad_s").unwrap();
    assert!((speed.values[2500] - r.omega_m[2500]).abs() < 1.5);
    let Err(IntakeError::Unmapped { draft, .. }) = take(&folder.put("run.csv", csv(&with(65536.0, 1.0)))) else {
        panic!("taken without its lines");
    };
    assert!(
        draft.missing.join("\n").contains("counts_per_turn: encoder counts an encoder's lines, about 40"),
        "{:?}",
        draft.missing
    );
}
