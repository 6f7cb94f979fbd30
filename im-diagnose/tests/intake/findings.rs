//! Every fault is found where it was made, and none where there is none.

use im_diagnose::intake::{FindingKind, Intake, LoadPlan, Severity, findings, read};
use im_model::MotorFile;

use crate::simulated::{Folder, MAPPING, MOTOR, column, columns, csv, motor, of, start, take, taken};

fn only(name: &str, kind: FindingKind, change: impl FnOnce(&mut Vec<(&'static str, Vec<f64>)>)) -> String {
    with_mapping(name, kind, MAPPING, change)
}

fn with_mapping(name: &str, kind: FindingKind, mapping: &str, change: impl FnOnce(&mut Vec<(&'static str, Vec<f64>)>)) -> String {
    let mut all = columns();
    change(&mut all);
    let t = taken(name, &all, mapping);
    let found = of(&t.findings, kind);
    assert!(!found.is_empty(), "{name}: {:?}", t.findings);
    found.iter().map(|f| f.line()).collect::<Vec<_>>().join("\n")
}

#[test]
fn a_good_recording_has_nothing_to_be_said_about_it() {
    let t = taken("good", &columns(), MAPPING);
    assert_eq!(t.findings, []);
    let folder = Folder::new("canonical");
    let path = folder.0.path().join("run.csv");
    start().write_csv(&path).unwrap();
    let t = take(&path).unwrap();
    assert_eq!(t.findings, []);
}

/// A sensor that ends softly at 45 A while the start needs more, with a tail that decays: nothing wrong passes, little right is lost.
#[test]
fn a_sensor_that_saturates_is_left_out_until_it_recovers() {
    let mut all = columns();
    let truth = column(&mut all, "i2_A").clone();
    let mut limit = f64::INFINITY;
    for (k, x) in column(&mut all, "i2_A").iter_mut().enumerate() {
        // Above 45 A the core saturates and the reading decays, until the current itself falls below it.
        if truth[k].abs() > limit.min(45.0) {
            limit = if limit.is_finite() { limit * 0.985 } else { 45.0 };
            *x = limit * truth[k].signum();
        } else {
            limit = f64::INFINITY;
        }
    }
    let clipped: Vec<bool> = truth.iter().zip(column(&mut all, "i2_A").iter()).map(|(t, x)| (t - x).abs() > 1.5).collect();
    let count = clipped.iter().filter(|c| **c).count();
    assert!(count > 30, "the case is no case: {count}");
    let t = taken("soft", &all, MAPPING);
    let b = t.experiment.channels.iter().find(|c| c.name == "i_b_A").unwrap();
    let passed = (0..truth.len()).filter(|&k| clipped[k] && b.is_valid(k)).count();
    let lost = (0..truth.len()).filter(|&k| !clipped[k] && !b.is_valid(k)).count();
    assert!(passed == 0, "{passed} of {count} wrong rows passed");
    assert!(lost < count, "{lost} right rows were lost for {count}");
    let a = t.experiment.channels.iter().find(|c| c.name == "i_a_A").unwrap();
    // The sum is wrong by phase b: large readings of the others cannot be proven then.
    assert!(t.experiment.len() - a.count() < count, "phase a is right");
    assert_eq!(of(&t.findings, FindingKind::ClippedSensor).len(), 1);
}

#[test]
fn hard_limits_are_found_without_a_third_phase() {
    let two = MAPPING.replace("c = \"i3_A\"\n", "");
    let text = with_mapping("hard", FindingKind::ClippedSensor, &two, |all| {
        column(all, "i1_A").iter_mut().for_each(|x| *x = x.clamp(-40.0, 40.0));
    });
    assert!(text.contains("i1_A is cut off at 40 A"), "{text}");
}

#[test]
fn a_second_sensor_takes_the_place_of_a_clipped_one() {
    let mapping = MAPPING.replace("c = \"i3_A\"", "c = { column = \"i3_A\", alternate = \"i6_A\" }");
    let text = with_mapping("second", FindingKind::RedundantSensor, &mapping, |all| {
        let truth = column(all, "i3_A").clone();
        all.push(("i6_A", truth.iter().map(|x| 0.99 * x).collect()));
        column(all, "i3_A").iter_mut().for_each(|x| *x = x.clamp(-40.0, 40.0));
    });
    assert!(text.contains("i6_A is used instead"), "{text}");
}

#[test]
fn swapped_phases_and_turned_signs_are_distinguished() {
    let swapped = MAPPING.replace("b = \"i2_A\"\nc = \"i3_A\"", "b = \"i3_A\"\nc = \"i2_A\"");
    let text = with_mapping("swap", FindingKind::SwappedPhases, &swapped, |_| {});
    assert!(text.contains("two phases are exchanged"), "{text}");
    let turned = MAPPING.replace("c = \"i3_A\"", "c = \"i3_A\"\ngain = -1");
    let text = with_mapping("turn", FindingKind::SwappedPhases, &turned, |_| {});
    assert!(text.contains("gain = -1 in [current]"), "{text}");
    let shifted = MAPPING.replace("a = \"i1_A\"\nb = \"i2_A\"\nc = \"i3_A\"", "a = \"i2_A\"\nb = \"i3_A\"\nc = \"i1_A\"");
    let text = with_mapping("shift", FindingKind::SwappedPhases, &shifted, |_| {});
    assert!(text.contains("one phase off"), "{text}");
    let backwards = MAPPING.replace("column = \"n_rpm\"", "column = \"n_rpm\"\ngain = -1");
    let text = with_mapping("backwards", FindingKind::SwappedPhases, &backwards, |_| {});
    assert!(text.contains("gain = -1 in [speed]"), "{text}");
}

/// Line-to-line voltages lead those of the phases, here at no load and with 40 % of the rated torque.
#[test]
fn voltages_in_another_convention_are_named() {
    let text = only("ll", FindingKind::Convention, |all| {
        let [a, b, c] = ["u1_V", "u2_V", "u3_V"].map(|name| column(all, name).clone());
        let between = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x - y).collect();
        *column(all, "u1_V") = between(&a, &b);
        *column(all, "u2_V") = between(&b, &c);
        *column(all, "u3_V") = between(&c, &a);
    });
    assert!(text.contains("line to line, and read as those of the phases"), "{text}");
    let named = MAPPING.replace("a = \"u1_V\"\nb = \"u2_V\"\nc = \"u3_V\"", "ab = \"u1_V\"\nbc = \"u2_V\"");
    let text = with_mapping("phases", FindingKind::Convention, &named, |_| {});
    assert!(text.contains("those of the phases, and read as line to line"), "{text}");
}

#[test]
fn a_load_torque_that_the_power_contradicts_is_named() {
    let scaled = |by: f64| move |all: &mut Vec<(&'static str, Vec<f64>)>| column(all, "T_Nm").iter_mut().for_each(|x| *x *= by);
    let text = only("against", FindingKind::LoadTorque, scaled(-1.0));
    assert!(text.contains("serious") && text.contains("turn its sign, gain = -1 in [load]"), "{text}");
    let text = only("twice", FindingKind::LoadTorque, scaled(0.5));
    assert!(text.contains("warning") && text.contains("the gain and unit of the torque sensor"), "{text}");
    for (by, unit) in [(1e3, "mNm"), (1e-3, "kNm")] {
        let text = only(unit, FindingKind::LoadTorque, scaled(by));
        assert!(text.contains("serious") && text.contains(&format!("Are these {unit} read as Nm?")), "{text}");
    }
}

/// Rounded to a milliampere, most sums of three phases are zero, and the others one or two.
#[test]
fn rounded_currents_sum_to_zero() {
    let mut all = columns();
    let rest: Vec<f64> =
        column(&mut all, "i1_A").iter().zip(column(&mut columns(), "i2_A").iter()).map(|(a, b)| -a - b).collect();
    *column(&mut all, "i3_A") = rest;
    for name in ["i1_A", "i2_A", "i3_A"] {
        column(&mut all, name).iter_mut().for_each(|x| *x = (*x * 1e3).round() / 1e3);
    }
    assert_eq!(taken("rounded", &all, MAPPING).findings, []);
}

#[test]
fn an_inertia_in_another_unit_is_named() {
    for (inertia, asked) in [("30", "g m² read as kg m²"), ("300", "kg cm² read as kg m²")] {
        let text = MOTOR.replace("inertia_kg_m2 = 0.03", &format!("inertia_kg_m2 = {inertia}"));
        let motor = MotorFile::parse(&text, "motor.toml").unwrap();
        let folder = Folder::new(&format!("inertia-{inertia}"));
        folder.put("run.recording.toml", MAPPING);
        let all = read(&folder.put("run.csv", csv(&columns())), None, &motor).unwrap();
        let found = of(&all[0].findings, FindingKind::Inertia);
        assert!(found.len() == 1 && found[0].line().contains(asked), "{:?}", all[0].findings);
    }
}

#[test]
fn speed_in_another_unit_or_of_other_pole_pairs_is_named() {
    let wrong = MAPPING.replace("column = \"n_rpm\"", "column = \"n_rpm\"\nunit = \"rad/s\"");
    let text = with_mapping("unit", FindingKind::SpeedScale, &wrong, |_| {});
    assert!(text.contains("unit = \"rpm\""), "{text}");
    let text = only("pairs", FindingKind::WrongPolePairs, |all| column(all, "n_rpm").iter_mut().for_each(|n| *n *= 2.0 / 3.0));
    assert!(text.contains("The machine has 3 pole pairs"), "{text}");
    let text = only("turns", FindingKind::SpeedScale, |all| column(all, "n_rpm").iter_mut().for_each(|n| *n /= 60.0));
    assert!(text.contains("serious") && text.contains("unit = \"Hz\""), "{text}");
    let held = MAPPING.replace("column = \"n_rpm\"", "locked = true");
    let text = with_mapping("held", FindingKind::DeadChannel, &held, |_| {});
    assert!(text.contains("serious") && text.contains("said to be locked"), "{text}");
    let text = only("gain", FindingKind::SpeedScale, |all| column(all, "n_rpm").iter_mut().for_each(|n| *n *= 0.8));
    assert!(text.contains("Multiply its gain by 1.2"), "{text}");
}

/// A unit by which the values would be usual is named: 10³ in voltage and current, 2π/60 in speed, any in time.
#[test]
fn a_unit_that_fits_better_is_named() {
    let scaled = |names: [&'static str; 3], by: f64| {
        move |all: &mut Vec<(&'static str, Vec<f64>)>| {
            names.iter().for_each(|name| column(all, name).iter_mut().for_each(|x| *x *= by));
        }
    };
    let (u, i) = (["u1_V", "u2_V", "u3_V"], ["i1_A", "i2_A", "i3_A"]);
    for (name, columns, by, unit) in [("mV", u, 1e3, "mV"), ("kV", u, 1e-3, "kV"), ("mA", i, 1e3, "mA"), ("kA", i, 1e-3, "kA")] {
        let text = only(name, FindingKind::OutOfRange, scaled(columns, by));
        assert!(text.contains(&format!("Say unit = \"{unit}\"")) && text.contains("serious"), "{text}");
    }
    let wrong = MAPPING.replace("column = \"n_rpm\"", "column = \"n_rpm\"\nunit = \"rad/s\"");
    let text = with_mapping("rpm", FindingKind::OutOfRange, &wrong, |_| {});
    assert!(text.contains("Is it in rpm? Say unit = \"rpm\""), "{text}");
    let text = only("rad", FindingKind::SpeedScale, |all| {
        column(all, "n_rpm").iter_mut().for_each(|n| *n *= std::f64::consts::PI / 30.0);
    });
    assert!(text.contains("unit = \"rad/s\""), "{text}");
    for (name, by) in [("ms", 1e3), ("us", 1e6), ("ns", 1e9), ("min", 1.0 / 60.0)] {
        let text = only(name, FindingKind::TimeUnit, |all| column(all, "t_s").iter_mut().for_each(|t| *t *= by));
        assert!(text.contains("rows per period") || text.contains("leakage time constant"), "{text}");
        assert!(by < 1.0 || text.contains(&format!("Is the time in {name}?")), "{text}");
    }
}

/// Voltage and current in another convention, on the supply that the motor is rated for; and in the convention that is read, nothing.
#[test]
fn another_convention_is_named() {
    let scaled = |by: [f64; 2]| {
        move |all: &mut Vec<(&'static str, Vec<f64>)>| {
            for (names, by) in [(["u1_V", "u2_V", "u3_V"], by[0]), (["i1_A", "i2_A", "i3_A"], by[1])] {
                names.iter().for_each(|name| column(all, name).iter_mut().for_each(|x| *x *= by));
            }
        }
    };
    let (root2, root3) = (2f64.sqrt(), 3f64.sqrt());
    for (name, by, said) in [
        ("line", [root3, 1.0], "line to line"),
        ("u rms", [1.0 / root2, 1.0], "Is the voltage rms"),
        ("i rms", [1.0, 1.0 / root2], "Is the current rms"),
        ("power", [1.5f64.sqrt(), 1.5f64.sqrt()], "power-invariant"),
    ] {
        let text = only(name, FindingKind::Convention, scaled(by));
        assert!(text.contains(said) && text.contains("warning"), "{text}");
    }
}

#[test]
fn another_machine_is_noticed() {
    let text = only("other", FindingKind::DifferentMachine, |all| {
        for name in ["i1_A", "i2_A", "i3_A"] {
            column(all, name).iter_mut().for_each(|x| *x *= 4.0);
        }
    });
    assert!(text.contains("same machine"), "{text}");
}

/// Currents over the rated peak or rms value, and voltages over the rated peak: each is told with what to write, and stops a diagnosis.
#[test]
fn per_unit_values_are_noticed() {
    let motor = motor();
    let peak = motor.rating.current_peak_a(motor.machine.parameters(), motor.machine.pole_pairs());
    let volts = motor.rating.phase_voltage_peak_v;
    for (name, u, i, kind, said) in [
        ("pu i", 1.0, peak, FindingKind::DifferentMachine, "sizes of currents in per unit"),
        ("pu i rms", 1.0, peak / 2f64.sqrt(), FindingKind::DifferentMachine, "sizes of currents in per unit"),
        ("pu u", volts, 1.0, FindingKind::OutOfRange, "In per unit, say gain = 327."),
        ("pu", volts, peak, FindingKind::OutOfRange, "In per unit, say gain = 327."),
    ] {
        let text = only(name, kind, |all| {
            for (names, by) in [(["u1_V", "u2_V", "u3_V"], u), (["i1_A", "i2_A", "i3_A"], i)] {
                names.iter().for_each(|name| column(all, name).iter_mut().for_each(|x| *x /= by));
            }
        });
        assert!(text.contains(said) && text.contains("serious"), "{name}: {text}");
    }
}

#[test]
fn dead_missing_offset_and_out_of_range_channels_are_named() {
    let text = only("dead", FindingKind::DeadChannel, |all| column(all, "i2_A").fill(0.25));
    assert!(text.contains("i2_A is 0.25 A in every row"), "{text}");
    let no_load = MAPPING.replace("[load]\ncolumn = \"T_Nm\"\n", "");
    with_mapping("noload", FindingKind::MissingLoad, &no_load, |_| {});
    let no_speed = MAPPING.replace("[speed]\ncolumn = \"n_rpm\"\n", "");
    with_mapping("nospeed", FindingKind::MissingSpeed, &no_speed, |_| {});
    let text = only("offset", FindingKind::Offset, |all| column(all, "u2_V").iter_mut().for_each(|u| *u += 15.0));
    assert!(text.contains("u2_V has a mean of 15"), "{text}");
    let milli = MAPPING.replace("c = \"i3_A\"", "c = \"i3_A\"\nunit = \"mA\"");
    let text = with_mapping("milli", FindingKind::OutOfRange, &milli, |_| {});
    // The unit is that of all three, of which the same is said once.
    assert!(text.contains("i1_A, i2_A, i3_A never exceed") && text.contains("Are they in A? Say unit = \"A\""), "{text}");
    let text = with_mapping("milli-all", FindingKind::OutOfRange, MAPPING, |all| {
        for name in ["i1_A", "i2_A", "i3_A"] {
            column(all, name).iter_mut().for_each(|x| *x *= 1e3);
        }
    });
    assert!(text.contains("i1_A, i2_A, i3_A reach ") && text.contains("Are they in mA? Say unit = \"mA\""), "{text}");
}

/// An encoder that shows nothing for 20 ms, one that loses its counts, and single readings.
#[test]
fn a_speed_that_leaps_is_no_shafts() {
    let stop = |from: usize, to: usize| {
        let text = only("leap", FindingKind::Glitch, |all| column(all, "n_rpm")[from..to].fill(0.0));
        (text.contains("serious"), text)
    };
    let (serious, text) = stop(2000, 2100);
    assert!(serious && text.contains("at 0.4 s, and once more") && text.contains("to_s = 0.4"), "{text}");
    assert!(stop(2000, 3000).0);
    // What comes before, as the advice has it, is a good recording.
    let mut all = columns();
    column(&mut all, "n_rpm")[2000..2100].fill(0.0);
    let before = MAPPING.replace("column = \"t_s\"", "column = \"t_s\"\nto_s = 0.4");
    assert_eq!(taken("before", &all, &before).findings, []);
    let late = only("late", FindingKind::Glitch, |all| column(all, "n_rpm")[..500].iter_mut().for_each(|n| *n += 1000.0));
    assert!(late.contains("from_s = 0.1"), "{late}");
    let (serious, text) = stop(2000, 2001);
    assert!(!serious && text.contains("spikes = true"), "{text}");
    let repaired = MAPPING.replace("column = \"n_rpm\"", "column = \"n_rpm\"\nspikes = true");
    let mut all = columns();
    column(&mut all, "n_rpm")[2000] = 0.0;
    assert_eq!(taken("spike", &all, &repaired).findings, []);
    // A coarse encoder, in steps of 100 rpm.
    let mut all = columns();
    column(&mut all, "n_rpm").iter_mut().for_each(|n| *n = 100.0 * (*n / 100.0).round());
    assert!(of(&taken("coarse", &all, MAPPING).findings, FindingKind::Glitch).is_empty());
}

/// A sensor or a logger that stops, and what looks like it.
#[test]
fn a_noisy_signal_that_stays_at_one_value_has_stopped() {
    let stopped = |all: &mut Vec<(&'static str, Vec<f64>)>, name: &str, from: usize, to: usize| {
        let x = column(all, name);
        let last = x[from];
        x[from..to].fill(last);
    };
    for to in [2200, 3000] {
        let text = only("stopped", FindingKind::Glitch, |all| stopped(all, "n_rpm", 2000, to));
        assert!(text.contains("serious") && text.contains("n_rpm stays at") && text.contains("to_s = 0.4"), "{text}");
    }
    // From the first row on: what comes after is good.
    let text = only("late", FindingKind::Glitch, |all| {
        column(all, "n_rpm")[0] = 500.0;
        stopped(all, "n_rpm", 0, 1000);
    });
    assert!(text.contains("n_rpm stays at") && text.contains("from_s = 0.2"), "{text}");
    let two = MAPPING.replace("c = \"i3_A\"\n", "");
    let text = with_mapping("logger", FindingKind::Glitch, &two, |all| stopped(all, "i2_A", 2000, 2100));
    assert!(text.contains("serious") && text.contains("i2_A stays at"), "{text}");
    let glitches = |change: &dyn Fn(&mut f64)| {
        let mut all = columns();
        column(&mut all, "n_rpm").iter_mut().for_each(change);
        of(&taken("alike", &all, MAPPING).findings, FindingKind::Glitch).len()
    };
    // In steps, with and without hold; and zero where a drive does not look.
    assert_eq!(glitches(&|n| *n = 20.0 * (*n / 20.0).round()), 0);
    assert_eq!(glitches(&|n| *n = if n.abs() < 30.0 { 0.0 } else { *n }), 0);
}

#[test]
fn single_readings_far_off_are_said_with_the_key_that_replaces_them() {
    let spiked = |all: &mut Vec<(&'static str, Vec<f64>)>| {
        for k in [400, 1400, 2400] {
            column(all, "i2_A")[k] += 400.0;
        }
    };
    // Of three phases, whose sum shows such rows, they are left out.
    let two = MAPPING.replace("c = \"i3_A\"\n", "");
    let text = with_mapping("readings", FindingKind::Glitch, &two, spiked);
    assert!(text.contains("i2_A has 3 single readings") && text.contains("spikes = true"), "{text}");
    let mut all = columns();
    spiked(&mut all);
    let repaired = two.replace("b = \"i2_A\"", "b = { column = \"i2_A\", spikes = true }");
    assert_eq!(taken("replaced", &all, &repaired).findings, []);
}

/// The upper switch of a phase stays open from 0.3 s on: a note of it comes before a healthy machine is fitted to that.
#[test]
fn an_open_switch_stops_the_run() {
    let text = only("open", FindingKind::OpenPhase, |all| {
        for k in 1500..all[0].1.len() {
            let i = column(all, "i1_A")[k];
            if i > 0.0 {
                column(all, "i1_A")[k] = 0.0;
                column(all, "i2_A")[k] += 0.5 * i;
                column(all, "i3_A")[k] += 0.5 * i;
            }
        }
    });
    assert!(text.contains("serious") && text.contains("i1_A") && text.contains("never positive"), "{text}");
}

#[test]
fn currents_that_do_not_sum_to_zero_are_named() {
    let text = only("sum", FindingKind::CurrentSum, |all| column(all, "i3_A").iter_mut().for_each(|i| *i *= 0.8));
    assert!(text.contains("i3_A"), "{text}");
    let text = only("sign", FindingKind::CurrentSum, |all| column(all, "i3_A").iter_mut().for_each(|i| *i *= -1.0));
    assert!(text.contains("i3_A") && text.contains("sign"), "{text}");
}

#[test]
fn rows_that_are_missing_are_named_and_filled_when_asked() {
    let mut all = columns();
    for (_, x) in &mut all {
        x.drain(1500..1504);
    }
    let folder = Folder::new("gap");
    let path = folder.put("run.csv", csv(&all));
    folder.put("run.recording.toml", MAPPING);
    let e = take(&path).unwrap_err().to_string();
    assert!(e.contains("run.csv:1502: t_s advances by 0.001 s here") && e.contains("gaps = \"leave_out\""), "{e}");
    folder.put("run.recording.toml", MAPPING.replace("column = \"t_s\"", "column = \"t_s\"\ngaps = \"leave_out\""));
    let t = take(&path).unwrap();
    let c = &t.experiment.channels[0];
    assert_eq!((t.experiment.len(), c.values.len() - c.count()), (start().len(), 4));
    assert!(!c.is_valid(1500) && c.is_valid(1499) && c.is_valid(1504));
    assert_eq!(of(&t.findings, FindingKind::Gap)[0].rows, vec![1500..1504; 1]);
    // In between nothing is invented that is far off: 4 rows of 0.2 ms of a 50-Hz sine.
    assert!((t.experiment.u_s[1502] - start().u_s[1502]).norm() < 5.0);
}

#[test]
fn slow_uneven_and_repeated_sampling_is_noticed() {
    let thin = |all: &mut Vec<(&'static str, Vec<f64>)>, n: usize| {
        for (_, x) in all.iter_mut() {
            *x = x.iter().copied().step_by(n).collect();
        }
    };
    let text = only("slow", FindingKind::SlowSampling, |all| thin(all, 12));
    assert!(text.contains("8.3 rows per period"), "{text}");
    let text = only("uneven", FindingKind::IrregularSampling, |all| {
        column(all, "t_s").iter_mut().step_by(3).skip(1).for_each(|t| *t += 3e-5);
    });
    assert!(text.contains('%'), "{text}");
    let text = only("hold", FindingKind::SlowChannel, |all| {
        for name in ["i1_A", "i2_A", "i3_A"] {
            let x = column(all, name);
            (0..x.len()).for_each(|k| x[k] = x[k - k % 2]);
        }
    });
    assert!(
        text.contains("i1_A, i2_A, i3_A are sampled every 2 rows and held in between: only the samples are compared"),
        "{text}"
    );
    let text = only("twice", FindingKind::RepeatedRows, |all| {
        for (_, x) in all.iter_mut() {
            x.insert(100, x[99]);
        }
    });
    assert!(text.contains("1 rows stand twice"), "{text}");
}

/// A tachometer at a fifth of the rate, drawn to the rows of the currents: its samples alone count, with their noise.
#[test]
fn a_channel_of_a_lower_rate_is_compared_at_its_samples() {
    let mut all = columns();
    let speed = column(&mut all, "n_rpm");
    let samples: Vec<f64> = speed.iter().copied().step_by(5).collect();
    for (k, w) in speed.iter_mut().enumerate() {
        let (j, share) = (k / 5, (k % 5) as f64 / 5.0);
        let next = samples.get(j + 1).unwrap_or(&samples[j]);
        *w = samples[j] + share * (next - samples[j]);
    }
    let t = taken("drawn", &all, MAPPING);
    let found = of(&t.findings, FindingKind::SlowChannel);
    assert!(found.len() == 1 && found[0].severity == Severity::Note, "{found:?}");
    assert!(found[0].sentence.contains("n_rpm is sampled every 5 rows and drawn by straight lines"), "{found:?}");
    let e = &t.experiment;
    let [i, w] = [&e.channels[0], e.channels.last().unwrap()];
    assert!(i.valid.is_none() && (1..e.len() - 5).all(|k| w.is_valid(k) == (k % 5 == 0)));
    // Alike, the voltage is a guess between its samples.
    let mut all = columns();
    for name in ["u1_V", "u2_V", "u3_V"] {
        let x = column(&mut all, name);
        for k in 0..x.len() - 1 {
            if k % 2 == 1 {
                x[k] = 0.5 * (x[k - 1] + x[k + 1]);
            }
        }
    }
    let t = taken("drawn voltage", &all, MAPPING);
    assert!(of(&t.findings, FindingKind::SlowChannel).iter().any(|f| f.severity == Severity::Warning), "{:?}", t.findings);
}

/// A torque drawn between samples 5 ms apart is not what acts there: where that may show in the speed the load is unknown, and else it is the load.
#[test]
fn a_load_that_is_known_now_and_then_is_not_known() {
    let with_step = |step: f64| {
        let mut all = columns();
        let torque = column(&mut all, "T_Nm");
        let sample = |j: usize| 0.02 * (1.7 * (j * j * j) as f64).sin() + if j > 70 { step } else { 0.0 };
        for (k, x) in torque.iter_mut().enumerate() {
            let (j, share) = (k / 25, (k % 25) as f64 / 25.0);
            *x = sample(j) + share * (sample(j + 1) - sample(j));
        }
        taken("slow torque", &all, MAPPING)
    };
    let t = with_step(10.0);
    let found = of(&t.findings, FindingKind::SlowChannel);
    assert!(t.load == LoadPlan::Unknown && found.len() == 1, "{found:?}");
    assert!(found[0].sentence.starts_with("T_Nm is sampled every 25 rows and drawn by straight lines in between"), "{found:?}");
    // 10 Nm for half of 5 ms on 0.03 kg m².
    assert!(found[0].sentence.contains("may move the speed by 0.83 rad/s, where its sensor's noise is 0.1"), "{found:?}");
    let t = with_step(0.0);
    assert!(t.load == LoadPlan::Known && of(&t.findings, FindingKind::SlowChannel).is_empty(), "{:?}", t.findings);
}

#[test]
fn severities_say_what_must_be_corrected() {
    let turned = MAPPING.replace("c = \"i3_A\"", "c = \"i3_A\"\ngain = -1");
    let t = taken("severity", &columns(), &turned);
    assert_eq!(t.findings[0].severity, Severity::Serious);
    assert!(t.findings[0].line().starts_with("run: serious: "), "{}", t.findings[0].line());
}

#[test]
fn only_a_mean_that_persists_is_an_offset() {
    let mut all = columns();
    let t = column(&mut all, "t_s").clone();
    // A direct current that decays while the machine runs is no sensor's.
    for (name, share) in [("i1_A", 1.0), ("i2_A", -0.5), ("i3_A", -0.5)] {
        column(&mut all, name).iter_mut().zip(&t).for_each(|(i, t)| *i += share * 3.0 * (-t / 0.15).exp());
    }
    assert!(of(&taken("transient", &all, MAPPING).findings, FindingKind::Offset).is_empty());
    let shift = |all: &mut Vec<(&'static str, Vec<f64>)>| column(all, "i1_A").iter_mut().for_each(|i| *i += 0.5);
    let text = only("persistent", FindingKind::Offset, shift);
    let said = text.split("say offset = ").nth(1).and_then(|t| t.split(' ').next()?.parse::<f64>().ok());
    // Transients of the start and of the load step are not quite gone.
    assert!(text.contains("at every operating point") && said.is_some_and(|x| (x - 0.5).abs() < 0.05), "{text}");
    // What another recording of the same sensors does not show is not the sensors'.
    let mut all = columns();
    shift(&mut all);
    let (with, without) = (taken("with", &all, MAPPING), taken("without", &columns(), MAPPING));
    let offsets = |all: [&Intake; 2]| of(&findings(all.into_iter()), FindingKind::Offset).len();
    assert_eq!([offsets([&with, &with]), offsets([&with, &without])], [2, 0]);
}

/// A sample that a logger has lost is a row that is missing where gaps are left out, and refused where nobody says so.
#[test]
fn an_empty_field_is_a_gap_where_gaps_are_left_out() {
    let folder = Folder::new("empty-field");
    let text = csv(&columns());
    let holed = |k: usize, line: &str| {
        if [801, 802].contains(&k) { line.rsplit_once(',').unwrap().0.to_owned() + "," } else { line.to_owned() }
    };
    let text: Vec<String> = text.lines().enumerate().map(|(k, line)| holed(k, line)).collect();
    let path = folder.put("run.csv", text.join("\n") + "\n");
    folder.put("run.recording.toml", MAPPING);
    let e = take(&path).unwrap_err().to_string();
    assert!(e.contains("run.csv:802: T_Nm is empty") && e.contains("gaps = \"leave_out\""), "{e}");
    folder.put("run.recording.toml", MAPPING.replace("column = \"t_s\"", "column = \"t_s\"\ngaps = \"leave_out\""));
    let t = take(&path).unwrap();
    assert_eq!(of(&t.findings, FindingKind::Gap).len(), 1, "{:?}", t.findings);
    let valid: Vec<bool> = (798..804).map(|k| t.experiment.channels[0].is_valid(k)).collect();
    assert_eq!(valid, [true, true, false, false, true, true]);
}

/// The slip is free, so that no impedance tells: beside its leakages a main inductance in mH is none.
#[test]
fn a_main_inductance_in_another_unit_stops_the_run() {
    let folder = Folder::new("main-mh");
    let path = folder.put("run.csv", csv(&columns()));
    folder.put("run.recording.toml", MAPPING);
    let mut machine = motor();
    let mut p = *machine.machine.parameters();
    p.magnetizing_inductance_h *= 1e3;
    machine.machine = im_model::Machine::base(p, machine.machine.pole_pairs()).unwrap();
    let t = read(&path, None, &machine).unwrap().remove(0);
    let found = of(&t.findings, FindingKind::DifferentMachine);
    assert!(found.iter().any(|f| f.stops() && f.advice.contains("in mH")), "{found:?}");
}

/// One field that is empty makes a column no less a speed: the draft names it, and reading says where it is empty.
#[test]
fn a_column_with_an_empty_field_is_still_guessed() {
    let folder = Folder::new("empty-guess");
    let text = csv(&columns());
    let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let speed = header.iter().position(|n| *n == "n_rpm").unwrap();
    let holed = |(k, line): (usize, &str)| {
        let mut fields: Vec<&str> = line.split(',').collect();
        if k == 801 {
            fields[speed] = "";
        }
        fields.join(",")
    };
    let text: Vec<String> = text.lines().enumerate().map(holed).collect();
    let e = take(&folder.put("run.csv", text.join("\n") + "\n")).unwrap_err().to_string();
    assert!(e.contains("run.csv:802: n_rpm is empty"), "{e}");
}

/// Columns that were exchanged, and an inductance of the motor file in another unit, leave an impedance that no guess is off by.
#[test]
fn an_impedance_beyond_every_guess_stops_the_run() {
    let mut all = columns();
    for (k, (name, _)) in all.iter_mut().enumerate().skip(1).take(6) {
        *name = ["i1_A", "i2_A", "i3_A", "u1_V", "u2_V", "u3_V"][k - 1];
    }
    let found = taken("exchanged", &all, MAPPING).findings;
    let one = of(&found, FindingKind::DifferentMachine);
    assert!(one.len() == 1 && one[0].stops() && one[0].advice.contains("exchanged"), "{found:?}");
}

/// A spreadsheet that writes canonical names, and a text that is no table.
#[test]
fn canonical_names_with_decimal_commas_are_read_and_prose_is_not() {
    let folder = Folder::new("comma");
    let r = start();
    let mut text = String::from("t_s;u_alpha_V;u_beta_V;i_alpha_A;i_beta_A;omega_m_rad_s\n");
    for k in 0..r.len() {
        let row = [r.time_s(k), r.u_s[k].re, r.u_s[k].im, r.i_s[k].re, r.i_s[k].im, r.omega_m[k]];
        text += &(row.map(|x| format!("{x:?}").replace('.', ",")).join(";") + "\n");
    }
    let t = take(&folder.put("run.csv", text)).unwrap();
    assert!(t.draft.is_none() && t.experiment.u_s[1000] == r.u_s[1000]);
    let e = take(&folder.put("prose.csv", "Dear colleague\nall went\nvery well\nbest regards\n")).unwrap_err().to_string();
    assert!(e.contains("no two columns of numbers") && !folder.0.path().join("prose.recording.toml").exists(), "{e}");
}
