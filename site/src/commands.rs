//! Commands in the text: examples, benches and scripts that they name must exist.

use std::path::Path;

use crate::Problem;
use crate::markdown::line_of;

/// What is named in `text` and is not there.
pub fn missing(root: &Path, file: &str, text: &str) -> Vec<Problem> {
    let mut problems = Vec::new();
    let mut report = |at: usize, what: String| problems.push(Problem { file: file.into(), line: line_of(text, at), what });
    for (option, folder) in [("--example ", "examples"), ("--bench ", "benches")] {
        for (at, _) in text.match_indices(option) {
            let name = word(&text[at + option.len()..]);
            if !name.is_empty() && !exists(root, folder, name) {
                report(at, format!("{option}{name}: no package has it"));
            }
        }
    }
    for (at, _) in text.match_indices("scripts/") {
        let before = text[..at].chars().next_back();
        let name = word(&text[at + "scripts/".len()..]);
        if !before.is_some_and(char::is_alphanumeric) && !name.is_empty() && !root.join("scripts").join(name).exists() {
            report(at, format!("scripts/{name}: no such script"));
        }
    }
    problems
}

/// Letters, digits, `_` and `-` at the beginning.
fn word(text: &str) -> &str {
    text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_' || c == '-')).next().unwrap_or_default()
}

/// Whether a package of the workspace has the target.
fn exists(root: &Path, folder: &str, name: &str) -> bool {
    let within = |at: &Path| std::fs::read_dir(at).into_iter().flatten().flatten().map(|p| p.path()).collect::<Vec<_>>();
    let packages = within(root).into_iter().chain(within(&root.join("tests")));
    packages.map(|p| p.join(folder)).any(|f| f.join(format!("{name}.rs")).exists() || f.join(name).is_dir())
}

#[cfg(test)]
mod tests {
    use super::missing;
    use std::path::Path;

    #[test]
    fn commands_name_what_there_is() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let text = "`cargo run --example own_effect`\n`cargo run --example nobody_wrote_this`\n";
        let said = missing(&root, "x.md", text);
        assert_eq!(said.len(), 1);
        assert_eq!((said[0].line, said[0].what.as_str()), (2, "--example nobody_wrote_this: no package has it"));
    }
}
