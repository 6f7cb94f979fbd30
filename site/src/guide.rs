//! What keeps the guide a guide: its length, and lines that an editor shows whole.
//!
//! The guide is `README.md` and the pages of `docs`; proofs, reproductions and tables of campaigns stand in `docs/background`, which may be long.

use crate::Problem;

/// Words that the guide may have, counted as `wc -w` does.
const WORDS: usize = 20_000;
/// Characters of a line; tables, pictures and code may be wider.
const WIDEST: usize = 160;

/// Whether a page is one of the guide.
pub fn holds(file: &str) -> bool {
    file == "README.md" || file.strip_prefix("docs/").is_some_and(|f| !f.contains('/'))
}

/// What is too long in the pages, given with their file names.
pub fn too_long<'a>(pages: impl Iterator<Item = (&'a str, &'a str)>) -> Vec<Problem> {
    let mut problems = Vec::new();
    let mut words = 0;
    for (file, text) in pages.filter(|(file, _)| holds(file)) {
        words += text.split_whitespace().count();
        let mut code = false;
        for (k, line) in text.lines().enumerate() {
            code ^= line.trim_start().starts_with("```");
            let as_it_is = code || ["|", "![", "    ", "$$"].iter().any(|s| line.starts_with(s));
            let length = line.chars().count();
            if length > WIDEST && !as_it_is {
                problems.push(Problem {
                    file: file.into(),
                    line: k + 1,
                    what: format!("a line of {length} characters; wrap it at {WIDEST} or before"),
                });
            }
        }
    }
    if words > WORDS {
        let what = format!(
            "the guide (README.md and docs/*.md) has {words} words, more than {WORDS}; what is long belongs in docs/background"
        );
        problems.push(Problem { file: "README.md".into(), line: 1, what });
    }
    problems
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lines_and_long_guides_are_refused_and_the_background_is_not() {
        let long = format!("| {0} |\n{0}\n", "word ".repeat(40));
        let said = too_long([("docs/a.md", long.as_str()), ("docs/background/a.md", long.as_str())].into_iter());
        assert_eq!(said.len(), 1);
        assert_eq!((said[0].file.as_str(), said[0].line), ("docs/a.md", 2));
        let book = "word\n".repeat(WORDS + 1);
        assert!(too_long([("docs/a.md", book.as_str())].into_iter())[0].what.contains("20001 words"));
        assert!(too_long([("docs/background/a.md", book.as_str())].into_iter()).is_empty());
    }
}
