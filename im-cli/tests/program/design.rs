//! `im design`: what it writes, checks and refuses.

use std::fs;

use crate::common::{Folder, done, example, im, json, refused};

const KINDS: [&str; 10] = ["kubota", "kubota-loop", "thau", "thau-box", "derdiyok", "utkin", "kenne", "jadot", "sampled", "mtpa"];

#[test]
fn every_kind_is_made_from_its_example_and_an_altered_file_is_refused() {
    let dir = Folder::new("kinds");
    for kind in KINDS {
        let (region, gains, rust, svg) = (dir.path("region.toml"), dir.path("gains.toml"), dir.path("g.rs"), dir.path("p.svg"));
        let sample = done(&["design", "example-region", kind]);
        fs::write(&region, &sample).unwrap();
        let base = ["design", kind, "--motor", &example("motor.toml"), "--region", &region, "-o", &gains];
        let text = done(&[&base[..], &["--rust", &rust, "--scalar", "f64", "--plot", &svg]].concat());
        assert!(text.contains("decided in exact arithmetic") && text.contains("iron_loss"), "{text}");
        assert!(dir.read("g.rs").contains("pub const") && dir.read("p.svg").ends_with("</svg>\n"));
        let checked = done(&["design", "check", &gains, "--motor", &example("motor.toml")]);
        // Which machine, by its parameters and their digest, and what is claimed where.
        for said in [
            "true and unaltered",
            "Machine (SHA-256 ",
            "stator_resistance_ohm = 1.5",
            "the motor that was asked about",
            "claimed, and where",
        ] {
            assert!(checked.contains(said), "{kind}: {said}: {checked}");
        }
        // What design printed of gains, region and rates, check says of the file too, with the theorem and what is left out of it.
        for line in text.lines().take_while(|l| !l.is_empty()) {
            let (gain, meaning) = line.split_once("    # ").unwrap();
            assert!(checked.contains(&format!("  {gain}    {meaning}\n")), "{kind}: {line}: {checked}");
        }
        let claimed = claim(kind);
        let said = json(&["design", "check", &gains, "--motor", &example("motor.toml"), "--json"]);
        assert_eq!(said["valid"], true);
        assert!(said["claim"].as_str().unwrap().contains(claimed), "{kind}: {said}");
        assert!(
            checked.contains("proof leaves out: iron_loss.") && said["effects_left_out"][0] == "iron_loss",
            "{kind}: {checked}"
        );
        assert!(checked.split_whitespace().collect::<Vec<_>>().join(" ").contains(claimed), "{kind}: {checked}");
        assert!(!json(&[&base[..], &["--json"]].concat())["gains"].as_object().unwrap().is_empty());
        let altered = dir.read("gains.toml").replacen("stator_resistance_ohm = 1.5", "stator_resistance_ohm = 1.6", 1);
        fs::write(&gains, altered).unwrap();
        assert!(refused(&["design", "check", &gains]).contains("refused: altered"), "{kind}");
        let help = done(&["design", kind, "--help"]);
        assert!(
            help.contains("im design example-region")
                && help.contains(sample.lines().nth(1).unwrap().split(" =").next().unwrap())
        );
    }
}

/// Of what the check must say of a kind.
fn claim(kind: &str) -> &'static str {
    match kind {
        "kubota" | "sampled" => "At a known speed in the range",
        "kubota-loop" => "small errors about every operating point of the region the linearized loop",
        "thau" => "this Lipschitz constant",
        "thau-box" => "stay in the box",
        "derdiyok" => "slides on the measured one",
        "utkin" => "slides on zero",
        "kenne" => "the surfaces of speed and flux are reached",
        "jadot" => "With the parameters known",
        _ => "At every torque of the range",
    }
}

/// The gains in f32 are those of a certificate that is written, too, and that the source names.
#[test]
fn gains_rounded_for_firmware_come_with_their_certificate() {
    let dir = Folder::new("rounded");
    let (region, gains, rust) = (dir.path("region.toml"), dir.path("gains.toml"), dir.path("gains.rs"));
    fs::write(&region, done(&["design", "example-region", "kubota-loop"])).unwrap();
    let base = ["design", "kubota-loop", "--motor", &example("motor.toml"), "--region", &region, "-o", &gains];
    let said = done(&[&base[..], &["--rust", &rust]].concat());
    assert!(said.contains("gains.f32.toml: written, the certificate"), "{said}");
    let checked = done(&["design", "check", &dir.path("gains.f32.toml")]);
    assert!(checked.contains("true and unaltered"), "{checked}");
    let (source, file) = (dir.read("gains.rs"), dir.read("gains.f32.toml"));
    let digest = file.lines().find_map(|l| l.strip_prefix("digest = ")).unwrap().trim_matches('"');
    assert!(source.contains(&format!("proven as rounded (SHA-256 {digest})")), "{source}");
    assert!(source.contains("`im design check gains.f32.toml`"), "{source}");
    let table: toml::Table = file.parse().unwrap();
    let gain = table["design"]["kubota_loop"]["gains"]["gain"].as_array().unwrap();
    let first = gain[0][0].as_float().unwrap();
    assert!(f64::from(first as f32) == first && source.contains(&format!("{first:?}")), "{first}");
    // Nothing is overwritten by its name, and f64 has none.
    fs::remove_file(dir.path("gains.f32.toml")).unwrap();
    done(&[&base[..], &["--rust", &rust, "--scalar", "f64"]].concat());
    assert!(!dir.has("gains.f32.toml") && dir.read("gains.rs").contains("`im design check gains.toml`"));
    let named = dir.path("gains.f32.toml");
    fs::rename(&region, &named).unwrap();
    let message =
        refused(&["design", "kubota-loop", "--motor", &example("motor.toml"), "--region", &named, "-o", &gains, "--rust", &rust]);
    assert!(message.contains("read by this command"), "{message}");
}

/// So do those of the firmware to begin with.
#[test]
fn the_gains_of_the_firmware_example_are_those_of_its_certificate() {
    let file = |name: &str| format!("{}/../examples/firmware/{name}", env!("CARGO_MANIFEST_DIR"));
    let certificate = file("gains.f32.toml");
    let checked = json(&["design", "check", &certificate, "--motor", &example("motor.toml"), "--json"]);
    assert_eq!(checked["valid"], true);
    let text = fs::read_to_string(&certificate).unwrap();
    let digest = text.lines().find_map(|l| l.strip_prefix("digest = ")).unwrap().trim_matches('"');
    let source = fs::read_to_string(file("src/gains.rs")).unwrap();
    assert!(source.contains(digest), "{digest}");
    for gain in ["proportional", "integral"] {
        assert!(source.contains(&format!("{gain}: {:?},", checked["gains"][gain].as_f64().unwrap())), "{gain}");
    }
}

#[test]
fn gains_are_made_for_a_period_and_for_the_largest() {
    let dir = Folder::new("period");
    let (region, gains) = (dir.path("region.toml"), dir.path("gains.toml"));
    let made = |kind: &str, period: &str| {
        // A sampled box asks for the rate, which the example leaves out for the fastest.
        let sample = done(&["design", "example-region", kind]).replace("# rate_per_s", "rate_per_s");
        fs::write(&region, sample).unwrap();
        let base =
            ["design", kind, "--motor", &example("motor.toml"), "--region", &region, "-o", &gains, "--period", period, "--json"];
        let made = json(&base);
        assert!(done(&["design", "check", &gains]).contains("true and unaltered"), "{kind} {period}");
        made["gains"]["period_s"].as_f64().unwrap()
    };
    for kind in ["kubota", "kubota-loop", "thau", "thau-box", "derdiyok", "utkin", "kenne", "jadot"] {
        assert_eq!(made(kind, "20e-6"), 20e-6, "{kind}");
    }
    for kind in ["kubota", "thau-box"] {
        let largest = made(kind, "largest");
        assert!(largest > 20e-6, "{kind}: {largest} s, though 20 us are feasible");
        // A tenth beyond is not: the search ends within a hundredth of the largest.
        let beyond = (1.1 * largest).to_string();
        let text =
            refused(&["design", kind, "--motor", &example("motor.toml"), "--region", &region, "-o", &gains, "--period", &beyond]);
        assert!(text.contains("infeasible") && text.contains("periods up to"), "{kind}: {text}");
    }
    // A layer has a largest period, which a layer must be given for.
    fs::write(&region, done(&["design", "example-region", "utkin"])).unwrap();
    let base = ["design", "utkin", "--motor", &example("motor.toml"), "--region", &region, "-o", &gains, "--period", "largest"];
    assert!(refused(&base).contains("boundary_layer_avs is missing"));
    fs::write(&region, done(&["design", "example-region", "utkin"]).replace("# boundary", "boundary")).unwrap();
    assert!(done(&base).contains("period_s"));
    fs::write(&region, done(&["design", "example-region", "mtpa"])).unwrap();
    let text =
        refused(&["design", "mtpa", "--motor", &example("motor.toml"), "--region", &region, "-o", &gains, "--period", "20e-6"]);
    assert!(text.contains("steady state"), "{text}");
}

#[test]
fn bad_regions_are_refused_with_their_place_and_nothing_is_written() {
    let dir = Folder::new("bad");
    let (region, gains) = (dir.path("region.toml"), dir.path("gains.toml"));
    let with = |text: &str, more: &[&str]| {
        fs::write(&region, text).unwrap();
        refused(&[&["design", "kubota", "--motor", &example("motor.toml"), "--region", &region, "-o", &gains], more].concat())
    };
    let text = with("speed_rad_s = [-100.0, 100.0]\nrate = 3.0\n", &[]);
    assert!(
        text.contains("region.toml:2: unknown key rate at the top of the file") && text.contains("example-region kubota"),
        "{text}"
    );
    let text = with("speed_rad_s = [-100.0, 100.0]\nrate_per_s = 30.0\n", &[]);
    assert!(text.contains("infeasible") && text.contains("just below 5.625"), "{text}");
    let text = with("speed_rad_s = [-100.0, 100.0]\nrate_per_s = 3.0\n", &["--period", "5e-3"]);
    assert!(text.contains("periods up to"), "{text}");
    assert!(!dir.has("gains.toml"));
    assert!(refused(&["design", "check", &gains]).contains("no such file"));
    let o = im(&["design", "kubota", "--motor", &example("motor.toml"), "--region", &region, "-o", &gains, "--period", "soon"]);
    assert_eq!(o.status.code(), Some(2));
}
