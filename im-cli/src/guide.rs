//! Every command that the README and the guide write down is one that the program takes: its subcommands and its options exist.

use std::path::Path;

use clap::Command;

/// What stands after `im` or `cargo run --release --` in a line of code: indented, fenced or between backquotes.
fn written(line: &str) -> Vec<&str> {
    const NAMES: [&str; 2] = ["im ", "cargo run --release -- "];
    let code = line.strip_prefix("    ").or(Some(line).filter(|l| NAMES.iter().any(|n| l.starts_with(n))));
    let quoted = line.split('`').skip(1).step_by(2);
    let named = |text| NAMES.iter().find_map(|n| str::strip_prefix(text, n));
    code.into_iter().chain(quoted).filter_map(named).map(|c| c.split(['#', '|', '>']).next().unwrap_or(c)).collect()
}

/// What a command line asks for that the program does not have. `KIND` and `…` stand for any subcommand.
fn unknown(program: &Command, line: &str) -> Option<String> {
    let mut commands = vec![program];
    for word in line.split_whitespace() {
        let any = word == "…" || word.chars().all(|c| c.is_ascii_uppercase());
        if let Some(option) = word.strip_prefix("--").map(|o| o.split('=').next().unwrap_or(o)) {
            let known = |c: &&Command| c.get_arguments().any(|a| a.get_long() == Some(option));
            if !commands.iter().any(known) && !["help", "version"].contains(&option) {
                return Some(format!("no option --{option}"));
            }
        } else if any && commands[0].has_subcommands() {
            commands = commands.into_iter().flat_map(|c| [c].into_iter().chain(c.get_subcommands())).collect();
        } else if let Some(next) = commands.iter().find_map(|c| c.find_subcommand(word)) {
            commands = vec![next];
        } else if std::ptr::eq(commands[0], program) && commands.len() == 1 {
            return Some(format!("no command {word:?}"));
        }
    }
    None
}

#[test]
fn every_command_of_the_guide_is_one_of_the_program() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let pages = std::fs::read_dir(root.join("docs")).unwrap().map(|e| e.unwrap().path());
    let pages = pages.filter(|p| p.extension().is_some_and(|e| e == "md")).chain([root.join("README.md")]);
    let program = crate::command_line();
    let (mut seen, mut wrong) = (0, Vec::new());
    for page in pages {
        let text = std::fs::read_to_string(&page).unwrap();
        for (number, line) in text.lines().enumerate() {
            for command in written(line) {
                seen += 1;
                let name = page.file_name().unwrap().to_string_lossy();
                wrong.extend(unknown(&program, command).map(|why| format!("{name}:{}: `im {command}`: {why}", number + 1)));
            }
        }
    }
    assert!(seen > 100, "{seen} commands");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_command_that_is_not_there_is_seen() {
    let program = crate::command_line();
    assert_eq!(written("write `im fit --motor m.toml` or `fit`"), ["fit --motor m.toml"]);
    assert_eq!(written("    im demo   # all"), ["demo   "]);
    assert_eq!(unknown(&program, "design kubota --rust gains.rs"), None);
    assert!(unknown(&program, "diagnose --trian a.csv").is_some());
    assert!(unknown(&program, "diagnos --train a.csv").is_some());
}
