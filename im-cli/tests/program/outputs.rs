//! Where commands write: nothing that is read is destroyed, nothing is half written, nothing steers the terminal.

use std::fs;
use std::io::Write;
use std::process::{Command, Stdio};

use crate::common::{Folder, demo, done, example, im, refused, text};

/// Every command that writes a file, with that file among its inputs: refused before anything is done, the file as it was.
#[test]
fn no_output_is_an_input() {
    let dir = Folder::new("destroy");
    let motor = dir.file("motor.toml", &fs::read_to_string(demo("motor.toml")).unwrap());
    let run = dir.file("run.csv", &fs::read_to_string(demo("train1.csv")).unwrap());
    let scenario = dir.file("again.toml", "[scenario]\nname = \"again\"\n[recording]\nfile = \"run.csv\"\n");
    let region = dir.file("region.toml", "speed_rad_s = [-1.0, 1.0]\nrate_per_s = 0.8\n");
    fs::create_dir(dir.path("out")).unwrap();
    let refined = dir.file("out/motor.refined.toml", &fs::read_to_string(&motor).unwrap());
    let out = dir.path("out");
    let before = |path: &str| fs::read(path).unwrap();
    let (kept_motor, kept_run) = (before(&motor), before(&run));
    for (args, destroyed) in [
        (vec!["fit", "--motor", &motor, "--train", &run, "-o", &run], "run.csv"),
        (vec!["fit", "--motor", &motor, "--train", &run, "-o", &motor], "motor.toml"),
        (vec!["add", "--motor", &motor, "--effect", "iron_loss", "-o", &motor], "motor.toml"),
        (vec!["simulate", "--motor", &motor, "--scenario", &scenario, "-o", &motor], "motor.toml"),
        (vec!["simulate", "--motor", &motor, "--scenario", &scenario, "-o", &run], "run.csv"),
        (vec!["simulate", "--motor", &motor, "--scenario", &scenario, "-o", &scenario], "again.toml"),
        (vec!["diagnose", "--motor", &refined, "--train", &run, "--out", &out], "motor.refined.toml"),
        (vec!["next-test", "--motor", &motor, "--effect", "iron_loss", "-o", &motor], "motor.toml"),
        #[cfg(feature = "design")]
        (vec!["design", "kubota", "--motor", &motor, "--region", &region, "-o", &region], "region.toml"),
    ] {
        let message = refused(&args);
        assert!(message.contains("read by this command; write to another file") && message.contains(destroyed), "{message}");
    }
    let _ = &region;
    assert!(before(&motor) == kept_motor && before(&run) == kept_run);
}

/// The same file by another way: through `..`, through a link, through a second name.
#[cfg(unix)]
#[test]
fn the_same_file_is_known_by_every_name() {
    use std::os::unix::fs::symlink;
    let dir = Folder::new("names");
    let motor = dir.file("motor.toml", &fs::read_to_string(demo("motor.toml")).unwrap());
    fs::create_dir(dir.path("sub")).unwrap();
    symlink(&motor, dir.path("link.toml")).unwrap();
    fs::hard_link(&motor, dir.path("hard.toml")).unwrap();
    symlink(dir.path("sub"), dir.path("folder")).unwrap();
    for name in ["sub/../motor.toml", "folder/../motor.toml", "link.toml", "hard.toml"] {
        let message = refused(&["add", "--motor", &motor, "--effect", "iron_loss", "-o", &dir.path(name)]);
        assert!(message.contains("read by this command"), "{name}: {message}");
    }
    symlink(dir.path("nowhere.toml"), dir.path("dangling.toml")).unwrap();
    let message = refused(&["add", "--motor", &motor, "--effect", "iron_loss", "-o", &dir.path("dangling.toml")]);
    assert!(message.contains("it is a link to") && message.contains("which is not there"), "{message}");
    assert!(!dir.has("nowhere.toml") && fs::symlink_metadata(dir.path("dangling.toml")).unwrap().is_symlink());
}

#[test]
fn a_bad_second_path_leaves_no_first_file_and_two_outputs_are_two_files() {
    let dir = Folder::new("second");
    let (run, inside) = (dir.path("run.csv"), dir.path("none/inside.csv"));
    let (motor, scenario) = (example("motor.toml"), example("scenario_dol.toml"));
    let base = ["simulate", "--motor", &motor, "--scenario", &scenario, "-o", &run, "--internals"];
    assert!(refused(&[&base[..], &[&inside]].concat()).contains("cannot write it"));
    assert!(refused(&[&base[..], &[&run]].concat()).contains("is to be written there too"));
    assert!(!dir.has("run.csv"));
    #[cfg(feature = "design")]
    {
        let region = dir.file("region.toml", &done(&["design", "example-region", "kubota"]));
        let gains = dir.path("gains.toml");
        let base = ["design", "kubota", "--motor", &motor, "--region", &region, "-o", &gains];
        for more in [["--plot", &inside], ["--rust", &inside], ["--rust", &gains], ["--plot", &region]] {
            refused(&[&base[..], &more[..]].concat());
            assert!(!dir.has("gains.toml"), "{more:?}");
        }
    }
}

/// Escape codes and bells in a motor's name or a column's reach neither stdout nor stderr; in JSON they are what they were.
#[test]
fn names_do_not_steer_the_terminal() {
    let dir = Folder::new("steer");
    let name = "a\\u001b[31m\\u0007red\\u009b";
    let motor = fs::read_to_string(example("motor.toml")).unwrap();
    let line = motor.lines().find(|l| l.starts_with("name")).unwrap();
    let motor = dir.file("motor.toml", &motor.replace(line, &format!("name = \"{name}\"")));
    let scenario = example("scenario_dol.toml");
    let run = dir.path("run.csv");
    let steers = |t: &str| t.chars().any(|c| c.is_control() && !matches!(c, '\n' | '\t'));
    let printed = done(&["simulate", "--motor", &motor, "--scenario", &scenario, "-o", &run]);
    assert!(!steers(&printed), "{printed:?}");
    let page = done(&["compare", "--motor", &motor, "--data", &run, "--out", &dir.path("out")]);
    assert!(!steers(&page) && page.contains("\\u001b[31m"), "{page:?}");
    let column = dir.file("bad.csv", "t_s,u_\u{1b}[31mV,i_A\n0,1,2\n1,2,3\n2,3,4\n3,x,5\n");
    let message = refused(&["compare", "--motor", &motor, "--data", &column]);
    assert!(!steers(&message), "{message:?}");
    let json = done(&["simulate", "--motor", &motor, "--scenario", &scenario, "-o", &run, "--json"]);
    assert!(!steers(&json));
    let read: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(read["machine"], "a\u{1b}[31m\u{7}red\u{9b}");
}

#[test]
fn a_page_says_of_which_files_it_is() {
    let dir = Folder::new("read");
    let (motor, run) = (demo("motor.toml"), dir.file("run.csv", &fs::read_to_string(demo("train1.csv")).unwrap()));
    let page = || {
        done(&["compare", "--motor", &motor, "--data", &run, "--out", &dir.path("out")]);
        dir.read("out/compare.html")
    };
    let sha256 = |path: &str| im_fleet::key::sha256(std::path::Path::new(path)).unwrap();
    let (first, before) = (page(), sha256(&run));
    assert!(first.contains(&sha256(&motor)) && first.contains(&before), "{first}");
    // A comment changes the file, and no number in it.
    dir.file("run.csv", &format!("# once more\n{}", dir.read("run.csv")));
    let second = page();
    assert!(second.contains(&sha256(&run)) && !second.contains(&before), "{second}");
}

/// A motor's name with all that has a meaning in TOML, JSON, HTML, SVG or Rust is a name in each of them.
#[cfg(feature = "design")]
#[test]
fn a_name_is_a_name_in_every_output() {
    let dir = Folder::new("name");
    let name = "5\" </script><!--<script> & 'a' */ \\ \n# b {}";
    let motor = fs::read_to_string(demo("motor.toml")).unwrap();
    let line = motor.lines().find(|l| l.starts_with("name")).unwrap();
    let motor = dir.file("motor.toml", &motor.replace(line, &format!("name = {}", toml::Value::from(name))));
    let named = |path: &str| fs::read_to_string(path).unwrap().parse::<toml::Table>().unwrap()["machine"]["name"].clone();
    assert_eq!(named(&motor).as_str(), Some(name));
    let out = dir.path("out");
    let run = demo("train1.csv");
    done(&["compare", "--motor", &motor, "--data", &run, "--out", &out]);
    let page = dir.read("out/compare.html");
    assert!(!page.contains("<!--<script>") && page.contains("&lt;!--&lt;script&gt;"));
    assert_eq!(page.matches("<script").count(), page.matches("</script>").count());
    let added = dir.path("added.toml");
    let json = crate::common::json(&["add", "--motor", &motor, "--effect", "iron_loss", "-o", &added, "--json"]);
    assert!(json["effect"] == "iron_loss" && named(&added).as_str() == Some(name));
    let json =
        crate::common::json(&["observe", "--motor", &motor, "--data", &run, "--observer", "kubota", "--out", &out, "--json"]);
    assert_eq!(json["machine"], name);
    done(&["identify", "--motor", &motor, "--sensitivity-map", "--out", &out]);
    for picture in ["out/speed.svg", "out/sensitivity.svg"] {
        let svg = dir.read(picture);
        assert!(!svg.contains("<script") && !svg.contains("</script"), "{picture}");
    }
    let (region, gains, rust) = (dir.path("region.toml"), dir.path("gains.toml"), dir.path("gains.rs"));
    fs::write(&region, done(&["design", "example-region", "derdiyok"])).unwrap();
    done(&["design", "derdiyok", "--motor", &motor, "--region", &region, "-o", &gains, "--rust", &rust]);
    done(&["design", "check", &gains, "--motor", &motor]);
    // In source it is a comment, of one line.
    let source = dir.read("gains.rs");
    let lines: Vec<&str> = source.lines().filter(|l| l.contains("</script>")).collect();
    assert!(lines.len() == 1 && lines[0].trim_start().starts_with("//"), "{lines:?}");
    assert!(!source.lines().any(|l| l.trim_start().starts_with("# b")), "{source}");
}

/// Nobody reads the messages: the status is still that of bad input, and of success.
#[cfg(unix)]
#[test]
fn a_closed_or_full_stderr_changes_no_status() {
    let full = || fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let status = |args: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_im"));
        command.args(args).stdout(Stdio::null()).stderr(full()).status().unwrap().code()
    };
    assert_eq!(status(&["simulate", "--motor", "/none.toml", "--scenario", "/none.toml", "-o", "-"]), Some(1));
    assert_eq!(status(&["effects"]), Some(0));
    assert_eq!(status(&["no-such-command"]), Some(2));
    let o = Command::new(env!("CARGO_BIN_EXE_im")).arg("effects").stdout(full()).output().unwrap();
    assert_eq!(o.status.code(), Some(1), "{}", text(&o.stderr));
    assert!(text(&o.stderr).contains("cannot write the output"));
}

/// A file without line ends, larger than what is read at once: refused with a short message, and without reading it all.
#[test]
fn endless_lines_and_huge_files_are_refused_with_a_short_message() {
    let dir = Folder::new("endless");
    let path = dir.path("endless.csv");
    let mut file = fs::File::create(&path).unwrap();
    file.write_all(b"t_s,u_alpha_V,").unwrap();
    // Sparse: three gigabytes without a line end, and none on the disk.
    file.set_len(3 << 30).unwrap();
    let motor = example("motor.toml");
    let journal = dir.path("journal");
    fs::create_dir(&journal).unwrap();
    fs::hard_link(&path, dir.path("journal/results.jsonl")).unwrap();
    for args in [
        vec!["compare", "--motor", &motor, "--data", &path],
        vec!["compare", "--motor", &path, "--data", &path],
        vec!["simulate", "--motor", &motor, "--scenario", &path, "-o", "-"],
        vec!["report", &path],
        #[cfg(feature = "verify")]
        vec!["verify", "--replay", &path],
        #[cfg(feature = "verify")]
        vec!["verify", "--claim", "1", "--out", &journal],
        vec!["next-test", "--motor", &motor, "--diagnosis", &path],
        vec!["fit", "--motor", &motor, "--table", &path],
        #[cfg(feature = "design")]
        vec!["design", "check", &path],
        #[cfg(feature = "design")]
        vec!["observe", "--observer", "kubota", "--motor", &motor, "--data", &demo("train1.csv"), "--gains", &path],
    ] {
        let mut limited = Command::new("sh");
        // Half a gigabyte of memory is plenty.
        limited.args(["-c", "ulimit -v 1500000; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_im")]).args(&args);
        let o = limited.output().unwrap();
        let message = text(&o.stderr);
        assert_eq!(o.status.code(), Some(1), "{args:?}: {message}");
        let named = message.contains("endless.csv") || message.contains("results.jsonl");
        assert!(named && message.len() < 1000, "{args:?}: {message}");
    }
}

#[test]
fn help_is_wrapped_once() {
    for command in [vec!["--help"], vec!["fit", "--help"], vec!["observe", "--help"], vec!["identify", "--help"]] {
        let o = im(&command);
        let help = text(&o.stdout);
        assert!(help.lines().all(|l| l.chars().count() <= 100), "{help}");
        // A line of a word or two within a paragraph is what a second wrapping leaves.
        let lines: Vec<&str> = help.lines().collect();
        let torn = lines.windows(3).find(|w| {
            let plain = |l: &str| !l.is_empty() && !l.starts_with(' ');
            w.iter().all(|l| plain(l)) && w[1].chars().count() < 40 && w[0].chars().count() > 60 && w[2].chars().count() > 60
        });
        assert!(torn.is_none(), "{command:?}: {torn:?}");
    }
}
