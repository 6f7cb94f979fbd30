//! Every reader as a function of bytes: it may refuse, it may not panic, and what it takes is finite.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use im_design::gains::GainSet;
use im_design::request::{Kind, design};
use im_design::{Certificate, DesignModel, LinearMachine};
use im_diagnose::intake::{self, SteadyTable};
use im_model::simulation::Scenario;
use im_model::toml_text::TomlText;
use im_model::{MotorFile, Recording};
use im_verify::{Block, Campaign, Journal, Machines};
use parquet::data_type::DoubleType;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;

pub mod mutate;

/// The motor of the examples.
pub const MOTOR: &str = include_str!("../../examples/motor.toml");

/// A reader, by name, and what to begin from.
pub struct Target {
    /// As in `fuzz_targets/`.
    pub name: &'static str,
    /// Reads.
    pub read: fn(&[u8]),
    /// True inputs.
    pub seeds: fn() -> Vec<Vec<u8>>,
}

/// All readers.
pub const TARGETS: [Target; 12] = [
    Target { name: "motor", read: motor, seeds: || texts([MOTOR, include_str!("../../examples/motor_kwon.toml")]) },
    Target { name: "recording", read: recording, seeds: || texts([&rows()]) },
    Target { name: "parquet", read: parquet, seeds: || vec![parquet_rows()] },
    Target { name: "formats", read: formats, seeds: formats_seeds },
    Target { name: "mapping", read: mapping, seeds: || texts([MAPPING]) },
    Target {
        name: "scenario",
        read: scenario,
        seeds: || {
            texts([
                include_str!("../../examples/scenario_dol.toml"),
                include_str!("../../examples/scenario_drive.toml"),
                include_str!("../../examples/scenario_vhz.toml"),
            ])
        },
    },
    Target { name: "table", read: table, seeds: || texts([TABLE]) },
    Target { name: "certificate", read: certificate, seeds: || texts([&sealed(Kind::Derdiyok), &sealed(Kind::Kubota)]) },
    Target { name: "gains", read: gains, seeds: || texts([Kind::Derdiyok, Kind::Kubota].map(|k| gains_of(&sealed(k)))) },
    Target {
        name: "region",
        read: region,
        seeds: || texts([Kind::Kubota, Kind::Derdiyok, Kind::Utkin, Kind::Kenne].map(Kind::example_region)),
    },
    Target { name: "diagnosis", read: diagnosis, seeds: || texts([DIAGNOSIS]) },
    Target { name: "journal", read: journal, seeds: || vec![blocks()] },
];

fn texts<S: AsRef<str>>(all: impl IntoIterator<Item = S>) -> Vec<Vec<u8>> {
    all.into_iter().map(|text| text.as_ref().as_bytes().to_vec()).collect()
}

const MAPPING: &str = "file = \"run.csv\"\n[time]\ncolumn = \"t\"\nunit = \"ms\"\n[voltage]\nab = \"u_ab\"\nbc = { column = \"u_bc\", gain = 2.0 }\n\
                       [current]\na = \"i_a\"\nb = { column = \"i_b\", offset = \"mean\" }\n[speed]\ncolumn = \"n\"\nunit = \"rpm\"\n";
const TABLE: &str =
    "V_LL_V,I_A,P_3ph_W,Q_3ph_var,n_rpm,T_Nm\n400,4.9,310,3300,1499,0\n400,6.1,1900,3500,1474,10\n400,8.0,3500,3800,1446,20\n";
const DIAGNOSIS: &str = "{\"schema\": 1, \"verdict\": \"missing_effects\", \"effects\": [\"iron_loss\"], \"alternatives\": {}, \"ranking\": [], \
                         \"steps\": [{\"effects\": [], \"train\": {\"chi2_per_sample\": 3.0, \"rmse\": {\"i_alpha_A\": 0.1}}, \
                         \"holdout\": null}], \"parameters\": {}}";

/// A short recording in canonical columns.
pub fn rows() -> String {
    let row = |k: u32| {
        let (t, w) = (f64::from(k) * 1e-4, 314.159 * f64::from(k) * 1e-4);
        format!("{t},{:.3},{:.3},{:.4},{:.4},{:.3},0.0\n", 326.0 * w.cos(), 326.0 * w.sin(), 5.0 * w.sin(), -5.0 * w.cos(), 150.0)
    };
    "t_s,u_alpha_V,u_beta_V,i_alpha_A,i_beta_A,omega_m_rad_s,tau_load_Nm\n".to_owned() + &(0..600).map(row).collect::<String>()
}

fn machine() -> DesignModel {
    let motor = MotorFile::parse(MOTOR, "motor.toml").expect("the example is one");
    DesignModel::Machine(LinearMachine::from(&motor.machine))
}

fn sealed(kind: Kind) -> String {
    design(kind, machine(), kind.example_region()).and_then(|c| Ok(c.to_text()?)).expect("the example is feasible")
}

/// The gains alone, as tables without a proof.
fn gains_of(certificate: &str) -> String {
    let (c, _) = Certificate::check_text(certificate).expect("it is sealed");
    GainSet::from(&c.design).to_toml()
}

/// The same recording as a Parquet file.
fn parquet_rows() -> Vec<u8> {
    let text = rows();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let values: Vec<Vec<f64>> = lines.map(|l| l.split(',').map(|x| x.parse().expect("a number")).collect()).collect();
    let fields: String = names.iter().map(|n| format!("required double {n}; ")).collect();
    let schema = parse_message_type(&format!("message run {{ {fields} }}")).expect("a schema");
    let mut writer = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::default()).expect("it can be begun");
    let mut group = writer.next_row_group().expect("a group");
    for k in 0..names.len() {
        let mut column = group.next_column().expect("a column").expect("a column");
        let x: Vec<f64> = values.iter().map(|row| row[k]).collect();
        column.typed::<DoubleType>().write_batch(&x, None, None).expect("it can be written");
        column.close().expect("it can be closed");
    }
    group.close().expect("it can be closed");
    writer.into_inner().expect("it can be closed")
}

/// As asammdf, SciPy and npTDMS write them.
fn formats_seeds() -> Vec<Vec<u8>> {
    let all: [&[u8]; 5] = [
        include_bytes!("../../im-formats/tests/data/v6.mat"),
        include_bytes!("../../im-formats/tests/data/v7.mat"),
        include_bytes!("../../im-formats/tests/data/plain.mf4"),
        include_bytes!("../../im-formats/tests/data/turned.mf4"),
        include_bytes!("../../im-formats/tests/data/two_groups.tdms"),
    ];
    all.map(<[u8]>::to_vec).to_vec()
}

/// Blocks of a campaign of claims.
fn blocks() -> Vec<u8> {
    let all = im_verify::claims::all();
    let quick = all.iter().take(2).copied().collect();
    let campaign =
        Campaign { claims: quick, machines: Machines::Random, cases: Some(3), seed: 1, shard: "1/1".parse().expect("a shard") };
    let mut out = String::new();
    let kept = campaign.run(&[], |block| {
        out += &serde_json::to_string(block).expect("a block is JSON");
        out.push('\n');
        Ok::<(), std::convert::Infallible>(())
    });
    kept.expect("it runs");
    out.into_bytes()
}

fn text(data: &[u8]) -> Option<&str> {
    std::str::from_utf8(data).ok()
}

/// In a file of its own, for readers that take a path.
fn in_file(data: &[u8], end: &str, read: impl FnOnce(&Path)) {
    let mut file = tempfile::Builder::new().suffix(end).tempfile().expect("a file can be made");
    file.write_all(data).expect("it can be written");
    read(file.path());
}

/// `motor.toml`.
pub fn motor(data: &[u8]) {
    let Some(Ok(motor)) = text(data).map(|t| MotorFile::parse(t, "motor.toml")) else { return };
    assert!(motor.machine.parameters().values().iter().all(|x| x.is_finite()) && motor.rating.validate().is_ok());
}

/// A recording in canonical columns.
pub fn recording(data: &[u8]) {
    if let Ok(r) = Recording::from_csv(data, "run.csv") {
        assert!(r.sample_time_s > 0.0 && r.sample_time_s.is_finite());
    }
    let motor = MotorFile::parse(MOTOR, "motor.toml").expect("the example is one");
    in_file(data, ".csv", |path| drop(intake::read(path, None, &motor)));
}

/// A recording in a Parquet file.
pub fn parquet(data: &[u8]) {
    let motor = MotorFile::parse(MOTOR, "motor.toml").expect("the example is one");
    in_file(data, ".parquet", |path| drop(intake::read(path, None, &motor)));
}

/// A recording in a file of another program.
pub fn formats(data: &[u8]) {
    let motor = MotorFile::parse(MOTOR, "motor.toml").expect("the example is one");
    in_file(data, ".cfg", |path| drop(intake::read(path, None, &motor)));
}

/// `recording.toml`.
pub fn mapping(data: &[u8]) {
    in_file(data, ".toml", |path| drop(intake::read_mapping(path)));
}

/// A scenario.
pub fn scenario(data: &[u8]) {
    let Some(Ok(s)) = text(data).map(|t| Scenario::parse(t, "scenario.toml", Path::new("."))) else { return };
    assert!(s.duration_s.is_finite() && s.samples() > 0);
}

/// A table of steady states.
pub fn table(data: &[u8]) {
    in_file(data, ".csv", |path| {
        let Ok(t) = SteadyTable::read(path, None) else { return };
        assert!(t.rows.iter().all(|r| r.current_rms_a.is_finite() && r.phase_voltage_rms_v.is_finite()));
    });
}

/// A certificate: what is taken is true.
pub fn certificate(data: &[u8]) {
    let Some(Ok((c, margins))) = text(data).map(Certificate::check_text) else { return };
    assert!(margins.iter().all(|m| m.margin > 0.0) && c.plant.check().is_ok());
}

/// Gains, with a proof or without: what is taken is of numbers.
pub fn gains(data: &[u8]) {
    let Some(text) = text(data) else { return };
    let toml = TomlText::new(text, "gains.toml", &[]);
    let Ok(tables) = toml.read::<BTreeMap<String, toml::Spanned<toml::Value>>>() else { return };
    if tables.contains_key("design") {
        let Ok((c, _)) = Certificate::check_text(text) else { return };
        let set = GainSet::from(&c.design).to_toml();
        assert!(!set.contains("nan") && !set.contains("inf"), "{set}");
    }
}

/// A journal of a campaign: what is taken is what was written, but for a torn last line.
pub fn journal(data: &[u8]) {
    in_file(data, ".jsonl", |path| drop(Journal::open::<Block>(path)));
}

/// A region file, of each design that is quick.
pub fn region(data: &[u8]) {
    let Some(text) = text(data) else { return };
    for kind in [Kind::Kubota, Kind::Derdiyok, Kind::Utkin, Kind::Kenne] {
        if let Ok(c) = design(kind, machine(), text) {
            assert!(c.check().is_ok());
        }
    }
}

/// `diagnosis.json`.
pub fn diagnosis(data: &[u8]) {
    let Some(text) = text(data) else { return };
    drop(im_diagnose::report::SideBySide::parse("diagnosis.json", text));
}
