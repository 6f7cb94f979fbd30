//! Parquet files: the same recording as from CSV, and the same messages.

use std::path::PathBuf;
use std::sync::Arc;

use im_diagnose::intake::{Intake, IntakeError, read};
use parquet::basic::Compression;
use parquet::data_type::DoubleType;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;

use crate::simulated::{Folder, MAPPING, columns, csv, motor, take};

/// Columns that may have empty places (NaN stands for one here).
fn put(folder: &Folder, all: &[(&str, Vec<f64>)], compression: Compression) -> PathBuf {
    let fields: String = all.iter().map(|(n, _)| format!("optional double {n}; ")).collect();
    let schema = Arc::new(parse_message_type(&format!("message run {{ {fields} }}")).unwrap());
    let properties = Arc::new(WriterProperties::builder().set_compression(compression).build());
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, properties).unwrap();
    // Two groups of rows, as a long recording has.
    let half = all[0].1.len() / 2;
    for rows in [0..half, half..all[0].1.len()] {
        let mut group = writer.next_row_group().unwrap();
        for (_, x) in all {
            let x = &x[rows.clone()];
            let there: Vec<i16> = x.iter().map(|v| i16::from(!v.is_nan())).collect();
            let values: Vec<f64> = x.iter().copied().filter(|v| !v.is_nan()).collect();
            let mut column = group.next_column().unwrap().unwrap();
            column.typed::<DoubleType>().write_batch(&values, Some(&there), None).unwrap();
            column.close().unwrap();
        }
        group.close().unwrap();
    }
    folder.put("run.parquet", writer.into_inner().unwrap())
}

fn from_csv(name: &str) -> Intake {
    let folder = Folder::new(name);
    folder.put("run.recording.toml", MAPPING);
    take(&folder.put("run.csv", csv(&columns()))).unwrap()
}

#[test]
fn a_recording_is_the_same_from_parquet_as_from_csv() {
    for (k, compression) in [Compression::UNCOMPRESSED, Compression::SNAPPY, Compression::LZ4_RAW].into_iter().enumerate() {
        let folder = Folder::new(&format!("parquet-{k}"));
        folder.put("run.recording.toml", MAPPING);
        let taken = take(&put(&folder, &columns(), compression)).unwrap();
        assert_eq!(taken.experiment, from_csv(&format!("parquet-csv-{k}")).experiment);
        // By its mapping, too: the file beside it is the Parquet one.
        let by_mapping = read(&folder.0.path().join("run.recording.toml"), None, &motor()).unwrap();
        assert_eq!(by_mapping[0].experiment, taken.experiment);
    }
}

#[test]
fn an_unmapped_parquet_file_gets_a_draft_that_reads_it() {
    let folder = Folder::new("parquet-draft");
    let taken = take(&put(&folder, &columns(), Compression::SNAPPY)).unwrap();
    let draft = taken.draft.expect("a draft");
    folder.put("run.recording.toml", &draft.text);
    assert_eq!(take(&folder.0.path().join("run.parquet")).unwrap().experiment, taken.experiment);
}

#[test]
fn an_absent_number_and_a_torn_file_are_reported_as_in_a_csv() {
    let folder = Folder::new("parquet-bad");
    folder.put("run.recording.toml", MAPPING);
    let mut all = columns();
    all[5].1[100] = f64::NAN;
    let message = take(&put(&folder, &all, Compression::SNAPPY)).map(|_| ()).unwrap_err().to_string();
    assert!(message.contains("run.parquet:102") && message.contains("i2_A"), "{message}");

    let whole = std::fs::read(put(&folder, &columns(), Compression::SNAPPY)).unwrap();
    let torn = folder.put("torn.parquet", &whole[..whole.len() / 2]);
    let error = take(&torn).map(|_| ()).unwrap_err();
    assert!(matches!(error, IntakeError::File(_)), "{error}");
    assert!(error.to_string().contains("not a whole Parquet file"), "{error}");
}
