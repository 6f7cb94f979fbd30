//! What reports say of how they came about: program, command line, date, and the files that were read.

use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use im_diagnose::report::{InputFile, Meta};
use im_fleet::key::sha256;

use crate::output::Outputs;

/// Adds how and when this was run, and what `outputs` stand beside. `SOURCE_DATE_EPOCH`, seconds since 1970, takes the place of the clock where equal runs are to give equal files.
pub fn of_this_run(meta: Meta, outputs: &Outputs) -> Meta {
    let command: Vec<String> = std::env::args().enumerate().map(|(k, a)| if k == 0 { "im".into() } else { quoted(&a) }).collect();
    let fixed = std::env::var("SOURCE_DATE_EPOCH").ok().and_then(|s| s.parse().ok());
    let now = fixed.map_or_else(SystemTime::now, |s| UNIX_EPOCH + Duration::from_secs(s));
    let made = humantime::format_rfc3339_seconds(now).to_string().replace('T', " ").replace('Z', " UTC");
    let program = concat!("im ", env!("CARGO_PKG_VERSION")).to_owned();
    // What cannot be read by now has been refused, or was no file.
    let file = |path: &Path| Some(InputFile { name: path.display().to_string(), sha256: sha256(path).ok()? });
    let files = outputs.read().filter(|path| path.is_file()).filter_map(file).collect();
    Meta { program, command: Some(command.join(" ")), made: Some(made), files, ..meta }
}

/// An argument as a shell takes it.
fn quoted(argument: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=:,+@%".contains(c);
    if !argument.is_empty() && argument.chars().all(plain) {
        return argument.to_owned();
    }
    format!("'{}'", argument.replace('\'', "'\\''"))
}

#[cfg(test)]
mod tests {
    use super::quoted;

    #[test]
    fn a_command_can_be_pasted() {
        assert_eq!(quoted("--train=a.csv"), "--train=a.csv");
        assert_eq!(quoted("my run.csv"), "'my run.csv'");
        assert_eq!(quoted("it's"), "'it'\\''s'");
        assert_eq!(quoted(""), "''");
    }
}
