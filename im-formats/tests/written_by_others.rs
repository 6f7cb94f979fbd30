//! Files that other programs wrote (`make.py`) give the values that those programs read back.

use std::path::PathBuf;

use im_formats::{Format, Table, format_of, read};

fn data(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn expected(name: &str) -> Table {
    let text = std::fs::read_to_string(data(&format!("{name}.csv"))).unwrap();
    let mut lines = text.lines();
    let names: Vec<String> = lines.next().unwrap().split(',').map(str::to_owned).collect();
    let mut columns = vec![Vec::new(); names.len()];
    for line in lines {
        line.split(',').zip(&mut columns).for_each(|(x, c)| c.push(x.parse().unwrap()));
    }
    Table { names, columns, left_out: Vec::new() }
}

/// Every value to the rounding of one interpolation or scale.
fn agree(name: &str) -> Table {
    let (found, expected) = (read(&data(name)).unwrap(), expected(name));
    assert_eq!(found.names, expected.names, "{name}");
    for ((column, by_other), title) in found.columns.iter().zip(&expected.columns).zip(&found.names) {
        assert_eq!(column.len(), by_other.len(), "{name}, {title}");
        let largest = by_other.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for (k, (a, b)) in column.iter().zip(by_other).enumerate() {
            assert!((a - b).abs() <= 1e-12 * largest, "{name}, {title}, row {}: {a} instead of {b}", k + 1);
        }
    }
    found
}

#[test]
fn mat_5_packed_and_not_with_two_rates_and_a_scope() {
    for name in ["v6.mat", "v7.mat"] {
        assert_eq!(agree(name).left_out, ["R (one number)", "note (text)"]);
    }
    agree("matrix.mat");
}

#[cfg(feature = "hdf5")]
#[test]
fn mat_7_3_with_two_rates_a_matrix_and_a_scope_by_reference() {
    let mut left_out = agree("v73.mat").left_out;
    left_out.sort();
    assert_eq!(left_out, ["R (one number)", "note (text)"]);
    agree("plain.h5");
}

#[cfg(not(feature = "hdf5"))]
#[test]
fn mat_7_3_says_which_build_reads_it() {
    let error = read(&data("v73.mat")).unwrap_err().to_string();
    assert!(error.contains("--features hdf5") && error.contains("save -v7"), "{error}");
}

#[test]
fn mdf_4_plain_packed_and_turned_with_two_rates_and_units() {
    for name in ["plain.mf4", "packed.mf4", "turned.mf4"] {
        agree(name);
    }
}

#[test]
fn tdms_with_two_rates_chunks_interleaved_and_scaled() {
    for name in ["two_groups.tdms", "chunks.tdms", "interleaved.tdms"] {
        agree(name);
    }
}

#[test]
fn comtrade_as_text_and_in_each_binary_form_by_either_file() {
    for name in ["ascii", "binary", "binary32", "float32"] {
        let by_config = agree(&format!("{name}.cfg"));
        assert_eq!(by_config, read(&data(&format!("{name}.dat"))).unwrap());
        assert_eq!(by_config.left_out, ["1 status channels"]);
    }
}

#[test]
fn comtrade_in_one_file() {
    let folder = tempfile::tempdir().unwrap();
    for (name, kind) in [("ascii", "DAT ASCII"), ("float32", "DAT BINARY: 2000")] {
        let part = |ending: &str| std::fs::read(data(&format!("{name}.{ending}"))).unwrap();
        let mut all = b"--- file type: CFG ---\r\n".to_vec();
        all.extend(part("cfg"));
        all.extend(b"--- file type: INF ---\r\nnothing\r\n--- file type: HDR ---\r\n--- file type: ");
        all.extend(format!("{kind} ---\r\n").bytes());
        all.extend(part("dat"));
        let path = folder.path().join("one.cff");
        std::fs::write(&path, all).unwrap();
        assert_eq!(read(&path).unwrap(), read(&data(&format!("{name}.cfg"))).unwrap());
    }
}

#[test]
fn each_is_known_by_its_first_bytes_and_texts_are_none() {
    let of = |name: &str| format_of(&std::fs::read(data(name)).unwrap()[..128], &data(name));
    assert_eq!(of("v6.mat"), Some(Format::Mat5));
    assert_eq!(of("v73.mat"), Some(Format::Hdf5));
    assert_eq!(of("plain.h5"), Some(Format::Hdf5));
    assert_eq!(of("plain.mf4"), Some(Format::Mdf));
    assert_eq!(of("chunks.tdms"), Some(Format::Tdms));
    assert_eq!(of("ascii.cfg"), Some(Format::Comtrade));
    assert_eq!(of("ascii.dat"), Some(Format::Comtrade));
    assert_eq!(of("v6.mat.csv"), None);
    assert_eq!(format_of(b"t,u,i\n0,1,2\n", "run.dat".as_ref()), None);
}
