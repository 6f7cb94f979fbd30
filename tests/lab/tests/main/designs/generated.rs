//! The Rust source of every kind compiles, for f32 and f64, in a crate that depends on im-observers and im-control alone.

use super::support::{every, four_kilowatts};
use im_design::gains::{Precision, Provenance};
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

#[test]
fn gains_of_every_kind_compile_as_the_structs_of_their_crates() {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap();
    let folder = std::env::temp_dir().join(format!("im-generated-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("src")).unwrap();
    let from = Provenance {
        motor: "odd \"name\" */ {}\n#[x]".into(),
        effects_left_out: vec!["iron_loss".into()],
        file: Some("gains.toml".into()),
    };
    let mut source = String::from("#![no_std]\n#![deny(missing_docs)]\n//! Gains.\n");
    for (scalar, precision) in [("f32", Precision::F32), ("f64", Precision::F64)] {
        let _ = writeln!(source, "/// In this precision.\npub mod in_{scalar} {{");
        for (name, certificate) in every(&four_kilowatts()) {
            let text = certificate.to_rust(precision, &from).unwrap_or_else(|e| panic!("{name} in {scalar}: {e}"));
            assert!(text.contains(&certificate.digest) && text.contains("iron_loss"), "{text}");
            source.push_str(&text);
        }
        source.push_str("}\n");
    }
    // The structs are those that the crates take.
    source.push_str(
        "/// Used.\npub fn used() -> bool {\n    use in_f32::*;\n    let g = kubota::gains(0.1, 20.0, 0.0);\n    \
         const _: () = assert!(derdiyok::GAINS.anchor_per_s == 10.0 && utkin::gains(0.0).filter_rad_s == 0.0);\n    let _: im_control::JadotGains<f32> = jadot::GAINS;\n    \
         let _: im_control::MtpaLaw<f32> = mtpa::LAW;\n    g.fade_a == 0.0 && sampled_derdiyok::PERIOD_S > 0.0\n}\n",
    );
    std::fs::write(folder.join("src/lib.rs"), source).unwrap();
    let dependency = |name: &str| format!("{name} = {{ path = {:?}, default-features = false }}\n", workspace.join(name));
    let manifest = "[package]\nname = \"generated-gains\"\nversion = \"0.0.0\"\nedition = \"2024\"\n[workspace]\n[dependencies]\n"
        .to_owned() + &["im-observers", "im-control", "im-identify"].map(dependency).concat();
    std::fs::write(folder.join("Cargo.toml"), manifest).unwrap();
    std::fs::copy(workspace.join("Cargo.lock"), folder.join("Cargo.lock")).unwrap();
    let target = workspace.join("target/generated-gains");
    let run = Command::new(env!("CARGO"))
        .args(["check", "--offline", "--quiet"])
        .env("CARGO_TARGET_DIR", target)
        .current_dir(&folder)
        .output();
    let run = run.unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let _ = std::fs::remove_dir_all(&folder);
}

/// What f32 makes of the smallest gains is no smaller than they are, and proven.
#[test]
fn gains_in_f32_are_proven_as_rounded() {
    for (name, certificate) in every(&four_kilowatts()) {
        let rounded = certificate.in_f32().unwrap_or_else(|e| panic!("{name}: {e}"));
        rounded.check().unwrap();
        let set = im_design::gains::GainSet::from(&rounded.design);
        for gain in
            set.gains.iter().filter(|g| ["nu0", "omega0_rad_s", "k_sq", "boundary_layer_a", "gain"].contains(&g.name.as_str()))
        {
            let mut numbers = match &gain.value {
                im_design::gains::Value::Scalar(x) => vec![*x],
                im_design::gains::Value::Matrix(m) => (0..m.rows()).flat_map(|i| (0..m.cols()).map(move |j| m[(i, j)])).collect(),
                _ => Vec::new(),
            };
            numbers.retain(|x| f64::from(*x as f32) != *x);
            assert!(numbers.is_empty(), "{name}: {} is not an f32", gain.name);
        }
    }
}
