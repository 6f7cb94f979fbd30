//! Runs of the program with mutated inputs:
//! cargo run --release --manifest-path fuzz/Cargo.toml --bin commands -- target/release/im RUNS [SEED]
//!
//! Counts by kind: panics, hangs (20 s of processor time), numbers that are not finite printed or written with status 0, certificates
//! accepted that are not those written, other statuses. What does so is kept in `fuzz/artifacts`. Status 1 where any did.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use im_fuzz::mutate::{Dice, mutated};

const HANG_S: f64 = 20.0;

/// A command line in which `@name` is an input file; those in the second list are mutated.
struct Run {
    line: &'static str,
    inputs: &'static [&'static str],
}

impl Run {
    /// Whether it takes a second and more: done an eighth as often.
    fn is_long(&self) -> bool {
        ["diagnose", "next-test", "fleet"].iter().any(|command| self.line.starts_with(command))
    }
}

const RUNS: [Run; 27] = [
    Run { line: "simulate --motor @motor.toml --scenario @scenario.toml -o out.csv", inputs: &["motor.toml", "scenario.toml"] },
    Run { line: "simulate --motor @motor.toml --scenario @drive.toml -o out.csv", inputs: &["motor.toml", "drive.toml"] },
    Run { line: "compare --motor @motor.toml --data @run.csv", inputs: &["motor.toml", "run.csv"] },
    Run { line: "fit --motor @motor.toml --train @run.csv -o out.toml", inputs: &["motor.toml", "run.csv"] },
    Run { line: "fit --motor @motor.toml --table @table.csv -o out.toml", inputs: &["motor.toml", "table.csv"] },
    Run { line: "fit --motor @motor.toml --train @run.csv --anyway -o out.toml", inputs: &["run.csv"] },
    Run { line: "diagnose --motor @motor.toml --train @run.csv --out out", inputs: &["motor.toml", "run.csv"] },
    Run { line: "diagnose --motor @motor.toml --train @run.csv --anyway --out out", inputs: &["run.csv"] },
    Run { line: "diagnose --motor @motor.toml --table @table.csv --json --out out", inputs: &["motor.toml", "table.csv"] },
    Run { line: "fleet @plant.csv --out out", inputs: &["plant.csv", "own.csv"] },
    Run {
        line: "validate --before @motor.toml --after @other.toml --data @run.csv --json",
        inputs: &["motor.toml", "other.toml", "run.csv"],
    },
    Run { line: "add --motor @motor.toml --effect windage -o out.toml", inputs: &["motor.toml"] },
    Run {
        line: "observe --motor @motor.toml --data @run.csv --observer kubota --gains @gains.toml --out out",
        inputs: &["motor.toml", "run.csv", "gains.toml"],
    },
    Run { line: "observe --motor @motor.toml --data @run.csv --observer utkin --json", inputs: &["motor.toml", "run.csv"] },
    Run { line: "identify --motor @motor.toml --online --data @run.csv --out out", inputs: &["motor.toml", "run.csv"] },
    Run { line: "identify --motor @motor.toml --sensitivity-map --json", inputs: &["motor.toml"] },
    Run {
        line: "design kubota --motor @motor.toml --region @kubota.toml -o out.toml --rust out.rs",
        inputs: &["motor.toml", "kubota.toml"],
    },
    Run {
        line: "design derdiyok --motor @motor.toml --region @derdiyok.toml -o out.toml --rust out.rs --period 50e-6",
        inputs: &["motor.toml", "derdiyok.toml"],
    },
    Run { line: "design mtpa --motor @motor.toml --region @mtpa.toml -o out.toml", inputs: &["motor.toml", "mtpa.toml"] },
    Run { line: "design check @gains.toml", inputs: &["gains.toml"] },
    Run { line: "design check @layer.toml", inputs: &["layer.toml"] },
    Run {
        line: "observe --motor @motor.toml --data @run.csv --observer derdiyok --gains @plain.toml --json",
        inputs: &["plain.toml"],
    },
    Run {
        line: "compare --motor @motor.toml --data @foreign.csv --mapping @foreign.toml",
        inputs: &["foreign.csv", "foreign.toml"],
    },
    Run { line: "report @diagnosis.json -o out.html", inputs: &["diagnosis.json"] },
    Run { line: "next-test --motor @motor.toml --diagnosis @diagnosis.json -o out.toml", inputs: &["diagnosis.json"] },
    Run { line: "verify --claim 1 --cases 40 --out .", inputs: &["results.jsonl"] },
    Run { line: "verify --replay @case.toml", inputs: &["case.toml"] },
];

fn main() {
    let mut arguments = std::env::args().skip(1);
    let im = arguments.next().map(PathBuf::from).and_then(|p| p.canonicalize().ok()).expect("first argument: the program");
    let count: usize = arguments.next().and_then(|x| x.parse().ok()).unwrap_or(1000);
    let seed = arguments.next().and_then(|x| x.parse().ok()).unwrap_or(1);
    let mut dice = Dice(seed);
    let folder = tempfile::tempdir().expect("a folder can be made");
    let true_inputs = inputs(&im, folder.path());
    let mut kinds: BTreeMap<&str, usize> = BTreeMap::new();
    let mut commands: BTreeMap<&str, [usize; 2]> = BTreeMap::new();
    let mut slowest = (0.0, "");
    let place = folder.path().join("run");
    // What is not changed is done.
    for run in &RUNS {
        prepare(&place, &true_inputs);
        let which = run.inputs[0];
        let (kind, _) = outcome(&im, run, &place, which, &true_inputs[which], &true_inputs);
        let said = fs::read_to_string(place.join(".stderr")).unwrap_or_default();
        assert!(kind == "done", "{}: {kind} with its true inputs: {said}", run.line);
    }
    for n in 0..count {
        let run = loop {
            let run = &RUNS[dice.below(RUNS.len())];
            if !run.is_long() || dice.below(8) == 0 {
                break run;
            }
        };
        restore(&place, &true_inputs);
        let which = dice.one(run.inputs);
        let changed = mutated(&true_inputs[which], &mut dice);
        replace(&place.join(which), &changed);
        let (kind, seconds) = outcome(&im, run, &place, which, &changed, &true_inputs);
        let all = commands.entry(run.line.split_whitespace().next().unwrap_or_default()).or_default();
        all[usize::from(kind != "done" && kind != "refused")] += 1;
        *kinds.entry(kind).or_default() += 1;
        if seconds > slowest.0 {
            slowest = (seconds, run.line);
        }
        if kind != "done" && kind != "refused" {
            let keep = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/artifacts")).join(format!("{kind}-{seed}-{n}"));
            let _ = fs::create_dir_all(&keep);
            let _ = fs::write(keep.join(which), &changed);
            let _ = fs::write(keep.join("command"), format!("{}\n{which} changed\n", run.line));
            println!("{n}: {kind}: {} ({which}), kept in {}", run.line, keep.display());
        }
        if n % 500 == 499 {
            println!("{}: {kinds:?}; longest {:.1} s of processor time ({})", n + 1, slowest.0, slowest.1);
        }
    }
    println!("{count} runs: {kinds:?}; longest {:.1} s of processor time ({})", slowest.0, slowest.1);
    println!("by command [fine, not]: {commands:?}");
    let bad = kinds.keys().any(|k| *k != "done" && *k != "refused");
    std::process::exit(i32::from(bad));
}

const FOREIGN: &str = "file = \"foreign.csv\"\n[text]\nseparator = \";\"\n[time]\ncolumn = \"time_ms\"\nunit = \"ms\"\n[voltage]\nab = \"U_ab\"\n\
                       bc = { column = \"U_bc\", gain = 1.0, offset = \"mean\" }\n[current]\na = \"I_1\"\nb = \"I_2\"\n[speed]\ncolumn = \"n\"\nunit = \"rpm\"\n";
const DIAGNOSIS: &str = "{\"schema\": 1, \"verdict\": \"missing_effects\", \"effects\": [\"iron_loss\"], \"alternatives\": {\"iron_loss\": [\"windage\"]}, \
                         \"ranking\": [], \"steps\": [{\"effects\": [], \"train\": {\"chi2_per_sample\": 3.0, \"rmse\": {\"i_alpha_A\": 0.1}}, \
                         \"holdout\": null}], \"parameters\": {}}";

/// A row of the demo as a laboratory would write it: ms, line-to-line voltages, two phase currents, rpm; a semicolon and a decimal point.
fn in_foreign_columns(row: &str) -> String {
    let x: Vec<f64> = row.split(',').map(|x| x.parse().expect("a number")).collect();
    let b = |re: f64, im: f64| -0.5 * re + 0.75f64.sqrt() * im;
    let (u_a, u_b, i_b) = (x[1], b(x[1], x[2]), b(x[3], x[4]));
    format!("{};{};{};{};{};{}\n", 1e3 * x[0], u_a - u_b, u_b - (-u_a - u_b), x[3], i_b, x[5] * 30.0 / std::f64::consts::PI)
}

/// A folder with the true inputs and nothing else.
fn prepare(place: &Path, true_inputs: &BTreeMap<&'static str, String>) {
    let _ = fs::remove_dir_all(place);
    fs::create_dir_all(place).expect("a folder can be made");
    for (name, text) in true_inputs {
        replace(&place.join(name), text);
    }
}

/// The same of a folder in which a command ran: what it wrote goes, and an input that was changed is what it was.
fn restore(place: &Path, true_inputs: &BTreeMap<&'static str, String>) {
    for entry in fs::read_dir(place).into_iter().flatten().flatten() {
        let path = entry.path();
        let name = entry.file_name();
        match name.to_str().and_then(|name| true_inputs.get(name)) {
            Some(text) if fs::read_to_string(&path).is_ok_and(|now| now == *text) => {}
            Some(text) => replace(&path, text),
            None if path.is_dir() => drop(fs::remove_dir_all(&path)),
            None => drop(fs::remove_file(&path)),
        }
    }
}

fn replace(path: &Path, text: &str) {
    fs::write(path, text).expect("it can be written");
}

/// True inputs, by name.
fn inputs(im: &Path, folder: &Path) -> BTreeMap<&'static str, String> {
    let example =
        |name: &str| fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(name)).expect("there");
    let demo = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../im-cli/data/demo/train1.csv")).expect("there");
    let run: String = demo.lines().take(600).map(|l| l.to_owned() + "\n").collect();
    let foreign: String =
        "time_ms;U_ab;U_bc;I_1;I_2;n\n".to_owned() + &demo.lines().skip(1).take(800).map(in_foreign_columns).collect::<String>();
    let table = "V_LL_V,I_A,P_3ph_W,n_rpm,T_Nm\n200,1.6,140,1498,0\n300,2.6,210,1499,0\n400,4.9,310,1499,0\n400,6.1,1900,1474,10\n\
                 400,7.0,2700,1460,15\n400,8.0,3500,1446,20\n";
    let short = |text: String| text.replace("duration_s = ", "duration_s = 0.2 #");
    let mut all = BTreeMap::from([
        ("motor.toml", example("motor.toml")),
        ("other.toml", example("motor.toml")),
        ("scenario.toml", short(example("scenario_dol.toml"))),
        ("drive.toml", short(example("scenario_drive.toml"))),
        ("run.csv", run),
        ("table.csv", table.to_owned()),
        ("foreign.csv", foreign),
        ("foreign.toml", FOREIGN.to_owned()),
        ("plant.csv", "unit,motor,recording\n1,motor.toml,own.csv\n2,other.toml,own.csv\n".to_owned()),
        ("plain.toml", "[derdiyok]\nnu0 = 400.0\nboundary_layer_a = 0.5\n".to_owned()),
        ("diagnosis.json", DIAGNOSIS.to_owned()),
    ]);
    // A recording of the motor itself.
    let path = |name: &str| folder.join(name).display().to_string();
    for name in ["motor.toml", "scenario.toml"] {
        replace(&folder.join(name), &all[name]);
    }
    let [motor, scenario, own] = ["motor.toml", "scenario.toml", "own.csv"].map(path);
    let made = Command::new(im).args(["simulate", "--motor", &motor, "--scenario", &scenario, "-o", &own]).output();
    assert!(made.expect("the program runs").status.success(), "the motor is simulated");
    all.insert("own.csv", fs::read_to_string(&own).expect("there"));
    // A failing case and a journal of claims.
    let out = folder.join("claims").display().to_string();
    let _ = Command::new(im).args(["verify", "--claim", "3", "--cases", "10000", "--keep", "1", "--out", &out]).output();
    let case = fs::read_dir(folder.join("claims/cases")).expect("there").next().expect("one").expect("readable");
    all.insert("case.toml", fs::read_to_string(case.path()).expect("there"));
    let out = folder.join("journal").display().to_string();
    let _ = Command::new(im).args(["verify", "--claim", "1", "--cases", "40", "--out", &out]).output();
    all.insert("results.jsonl", fs::read_to_string(folder.join("journal/results.jsonl")).expect("there"));
    for (kind, name) in [("kubota", "kubota.toml"), ("derdiyok", "derdiyok.toml"), ("mtpa", "mtpa.toml")] {
        let region = Command::new(im).args(["design", "example-region", kind]).output().expect("the program runs");
        // A narrow range of torque is proven soon.
        let text = String::from_utf8(region.stdout).expect("text").replace("[0.5, 50.0]", "[5.0, 20.0]");
        all.insert(name, text);
    }
    for (kind, name, more) in [("kubota", "gains.toml", &[][..]), ("derdiyok", "layer.toml", &["--period", "50e-6"][..])] {
        replace(&folder.join("region.toml"), &all[format!("{kind}.toml").as_str()]);
        let (region, out) = (path("region.toml"), path(name));
        let made =
            Command::new(im).args(["design", kind, "--motor", &motor, "--region", &region, "-o", &out]).args(more).output();
        assert!(made.expect("the program runs").status.success(), "{kind} is designed");
        all.insert(name, fs::read_to_string(&out).expect("there"));
    }
    all
}

fn outcome(
    im: &Path,
    run: &Run,
    place: &Path,
    which: &str,
    changed: &str,
    true_inputs: &BTreeMap<&'static str, String>,
) -> (&'static str, f64) {
    let line = run.line.replace('@', "");
    let (out, err) = (place.join(".stdout"), place.join(".stderr"));
    let file = |p: &Path| Stdio::from(fs::File::create(p).expect("it can be made"));
    let mut child = Command::new(im)
        .args(line.split_whitespace())
        .current_dir(place)
        .stdin(Stdio::null())
        .stdout(file(&out))
        .stderr(file(&err))
        .spawn()
        .expect("the program runs");
    let (begun, mut used) = (Instant::now(), 0.0);
    let status = loop {
        if let Some(status) = child.try_wait().expect("it is our child") {
            break status;
        }
        used = processor_time(child.id()).unwrap_or(used);
        if used > HANG_S || begun.elapsed() > Duration::from_secs(600) {
            let _ = child.kill();
            let _ = child.wait();
            return ("hang", used);
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    let said = fs::read_to_string(&err).unwrap_or_default();
    if said.contains("panicked") || status.code() == Some(101) || status.code().is_none() {
        return ("panic", used);
    }
    match status.code() {
        // 3 is an answer too: a claim that is violated.
        Some(0 | 3) => {}
        Some(1 | 2) => return ("refused", used),
        _ => return ("status", used),
    }
    // The numbers of a certificate are what it says; comments and blanks are not.
    let meaning =
        |text: &str| text.lines().filter(|l| !l.trim_start().starts_with('#')).map(str::trim).collect::<Vec<_>>().join("\n");
    if run.line.starts_with("design check")
        && meaning(changed) != meaning(&true_inputs[which])
        && !same_values(changed, &true_inputs[which])
    {
        return ("false acceptance", used);
    }
    let written = files(place).into_iter().filter(|path| {
        let name = path.strip_prefix(place).unwrap_or(path).to_string_lossy();
        // A page holds scripts, in which such words are code; a journal is read and gone on with.
        !name.ends_with(".html") && (name == "results.jsonl" || !true_inputs.contains_key(name.as_ref()))
    });
    let texts: Vec<String> = written.filter(|path| *path != err).filter_map(|path| fs::read_to_string(path).ok()).collect();
    let names = names(which, changed);
    let unnamed = |text: &String| names.iter().fold(text.clone(), |text, name| text.replace(name, "name"));
    if texts.iter().any(|text| not_finite(&unnamed(text))) { ("not finite", used) } else { ("done", used) }
}

/// What an input calls things: a motor called "nan" is no number.
fn names(which: &str, text: &str) -> Vec<String> {
    let named = |line: &str| Some(line.strip_prefix("name = \"")?.split('"').next()?.to_owned());
    let mut all: Vec<String> = if which == "plant.csv" {
        text.lines().filter_map(|l| l.split(',').next()).map(str::to_owned).collect()
    } else {
        text.lines().filter_map(named).collect()
    };
    all.retain(|name| not_finite(name));
    all
}

/// All files below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let paths = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    paths.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

/// Two TOML texts that hold the same; -0 is 0, and 1 is 1.0.
fn same_values(a: &str, b: &str) -> bool {
    let read = |text: &str| text.parse::<toml::Table>().ok().map(toml::Value::Table);
    read(a).zip(read(b)).is_some_and(|(a, b)| same(&a, &b))
}

fn same(a: &toml::Value, b: &toml::Value) -> bool {
    let number = |v: &toml::Value| v.as_float().or_else(|| v.as_integer().map(|x| x as f64));
    match (a, b) {
        (toml::Value::Table(a), toml::Value::Table(b)) => {
            a.len() == b.len() && a.iter().all(|(key, x)| b.get(key).is_some_and(|y| same(x, y)))
        }
        (toml::Value::Array(a), toml::Value::Array(b)) => a.len() == b.len() && a.iter().zip(b).all(|(x, y)| same(x, y)),
        _ => number(a).zip(number(b)).map_or_else(|| a == b, |(x, y)| x == y),
    }
}

/// Whether NaN or infinity stands in a text as a word.
fn not_finite(text: &str) -> bool {
    text.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == '.'))
        .any(|word| matches!(word, "NaN" | "nan" | "inf" | "Infinity" | "infinity" | "1.#INF"))
}

/// User and system time of a process, s.
fn processor_time(pid: u32) -> Option<f64> {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    let fields: Vec<&str> = stat.rsplit(')').next()?.split_whitespace().collect();
    let ticks = |k: usize| fields.get(k)?.parse::<f64>().ok();
    Some((ticks(11)? + ticks(12)?) / 100.0)
}
