//! Files of other programs: the same recording as from CSV, and the same messages. What `im-formats` reads is tested there.

use std::path::{Path, PathBuf};

use im_diagnose::intake::read;

use crate::simulated::{Folder, MAPPING, columns, csv, motor, take};

/// A MAT file of version 6: every column a vector N × 1 of doubles.
fn mat(all: &[(&str, Vec<f64>)]) -> Vec<u8> {
    let element = |kind: u32, data: &[u8]| {
        let mut e = [kind.to_le_bytes(), (data.len() as u32).to_le_bytes()].concat();
        e.extend_from_slice(data);
        e.resize(e.len().next_multiple_of(8), 0);
        e
    };
    let mut file = b"MATLAB 5.0 MAT-file".to_vec();
    file.resize(124, b' ');
    file.extend(b"\x00\x01IM");
    for (name, values) in all {
        let dims = [values.len() as i32, 1].map(i32::to_le_bytes).concat();
        let values: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        let parts = [element(6, &[6, 0, 0, 0, 0, 0, 0, 0]), element(5, &dims), element(1, name.as_bytes()), element(9, &values)];
        file.extend(element(14, &parts.concat()));
    }
    file
}

/// A COMTRADE recording as text: the configuration, and the samples beside it.
fn comtrade(folder: &Folder, all: &[(&str, Vec<f64>)]) -> PathBuf {
    let (time, channels) = all.split_first().unwrap();
    let mut config = format!("laboratory,recorder,1999\n{0},{0}A,0D\n", channels.len());
    for (k, (name, _)) in channels.iter().enumerate() {
        config += &format!("{},{name},,,,1,0,0,0,0,1,1,P\n", k + 1);
    }
    config += &format!("50\n0\n0,{}\n22/11/2026,12:00:00.0\n22/11/2026,12:00:00.0\nASCII\n1\n", time.1.len());
    let mut rows = String::new();
    for k in 0..time.1.len() {
        rows += &format!("{},{}", k + 1, (time.1[k] * 1e6).round());
        channels.iter().for_each(|(_, x)| rows += &format!(",{:?}", x[k]));
        rows += "\n";
    }
    folder.put("run.dat", rows);
    folder.put("run.cfg", config)
}

fn sample(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../im-formats/tests/data").join(name)
}

#[test]
fn a_recording_is_the_same_from_other_programs_files_as_from_csv() {
    let folder = Folder::new("formats-csv");
    folder.put("run.recording.toml", MAPPING);
    let from_csv = take(&folder.put("run.csv", csv(&columns()))).unwrap();

    let folder = Folder::new("formats-mat");
    folder.put("run.recording.toml", MAPPING);
    let path = folder.put("run.mat", mat(&columns()));
    assert_eq!(take(&path).unwrap().experiment, from_csv.experiment);
    // By its mapping, too: the file beside it is the MAT file.
    assert_eq!(read(&folder.0.path().join("run.recording.toml"), None, &motor()).unwrap()[0].experiment, from_csv.experiment);

    let folder = Folder::new("formats-comtrade");
    folder.put("run.recording.toml", MAPPING.replace("t_s", "t (s)"));
    let from_comtrade = take(&comtrade(&folder, &columns())).unwrap();
    assert_eq!(from_comtrade.experiment.u_s, from_csv.experiment.u_s);
    assert_eq!(from_comtrade.experiment.channels, from_csv.experiment.channels);
}

#[test]
fn an_unmapped_file_gets_a_draft_that_reads_it() {
    let folder = Folder::new("formats-draft");
    let taken = take(&folder.put("run.mat", mat(&columns()))).unwrap();
    folder.put("run.recording.toml", taken.draft.expect("a draft").text);
    assert_eq!(take(&folder.0.path().join("run.mat")).unwrap().experiment, taken.experiment);
}

#[test]
fn an_absent_number_and_a_torn_file_are_reported_as_in_a_csv() {
    let folder = Folder::new("formats-bad");
    folder.put("run.recording.toml", MAPPING);
    let mut all = columns();
    all[5].1[100] = f64::NAN;
    let message = take(&folder.put("run.mat", mat(&all))).map(|_| ()).unwrap_err().to_string();
    assert!(message.contains("run.mat:102") && message.contains("i2_A"), "{message}");

    let whole = mat(&columns());
    let message = take(&folder.put("torn.mat", &whole[..whole.len() / 2])).map(|_| ()).unwrap_err().to_string();
    assert!(message.contains("torn.mat") && message.contains("not a whole MAT file"), "{message}");
}

/// An essential column is missing in the samples, so that the draft asks for it: the file was read.
#[test]
fn every_format_comes_as_far_as_the_draft() {
    for name in ["v7.mat", "packed.mf4", "two_groups.tdms", "binary.cfg", "float32.dat"] {
        let message = take(&sample(name)).map(|_| ()).unwrap_err().to_string();
        assert!(!message.contains("not a whole") && !message.contains("UTF-8"), "{name}: {message}");
    }
}

#[cfg(not(feature = "hdf5"))]
#[test]
fn a_mat_file_of_version_7_3_says_which_build_reads_it() {
    let message = take(&sample("v73.mat")).map(|_| ()).unwrap_err().to_string();
    assert!(message.contains("--features hdf5"), "{message}");
}
