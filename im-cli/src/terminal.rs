//! Output for people: wrapped text, numbers with few digits, a progress bar on long runs.

use std::io::{self, Write};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

/// The width that texts are wrapped to: what every terminal shows and every pipe passes.
pub const WIDTH: usize = 80;

/// The width of stories with tables in them.
pub const STORY_WIDTH: usize = 100;

/// Wraps `text` to [`WIDTH`] with `first` before its first line and spaces before the others.
pub fn wrapped(first: &str, text: &str) -> String {
    let rest = " ".repeat(first.chars().count());
    let words: Vec<&str> = text.split_whitespace().collect();
    let options = textwrap::Options::new(WIDTH).initial_indent(first).subsequent_indent(&rest).break_words(false);
    textwrap::fill(&words.join(" "), options) + "\n"
}

/// A message of several lines, each of them wrapped; what follows the mark of a list stands under its text.
pub fn lines_wrapped(text: &str) -> String {
    let one = |line: &str| match line.strip_prefix("  - ") {
        Some(item) => wrapped("  - ", item),
        None => wrapped("", line),
    };
    text.lines().map(one).collect()
}

/// The output for people and pipes. Names come from files: what would steer the terminal is written as its code.
pub fn stdout() -> Printable<io::StdoutLock<'static>> {
    Printable(io::stdout().lock())
}

/// Says something on stderr; if nobody can hear it, the work goes on.
pub fn say(text: &str) {
    let _ = Printable(io::stderr().lock()).write_all(text.as_bytes());
}

/// Writes text with its control characters as `\u001b`, which is what JSON makes of them too.
pub struct Printable<W: Write>(W);

impl<W: Write> Write for Printable<W> {
    fn write(&mut self, text: &[u8]) -> io::Result<usize> {
        self.write_all(text).map(|()| text.len())
    }

    fn write_all(&mut self, text: &[u8]) -> io::Result<()> {
        let steers = |c: char| c.is_control() && !matches!(c, '\n' | '\t');
        match std::str::from_utf8(text) {
            Ok(text) if text.contains(steers) => {
                let mut out = String::with_capacity(text.len() + 16);
                for c in text.chars() {
                    if steers(c) { out.push_str(&format!("\\u{:04x}", u32::from(c))) } else { out.push(c) }
                }
                self.0.write_all(out.as_bytes())
            }
            _ => self.0.write_all(text),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

/// A number to three digits: 0.00125, 12.3, 1.2e-5; a dash for what is none.
pub fn rounded(x: f64) -> String {
    if !x.is_finite() {
        return "–".to_owned();
    }
    let x: f64 = format!("{x:.2e}").parse().unwrap_or(x);
    if x != 0.0 && !(1e-4..1e6).contains(&x.abs()) { format!("{x:e}") } else { format!("{x}") }
}

/// A bar on stderr that appears once the work takes long, and only on a terminal.
pub struct Progress {
    begun: Instant,
    what: &'static str,
    bar: Option<ProgressBar>,
}

impl Progress {
    /// Patience before the bar appears.
    const AFTER: Duration = Duration::from_millis(800);

    /// Begins now.
    pub fn new(what: &'static str) -> Self {
        Self { begun: Instant::now(), what, bar: None }
    }

    /// `done` of `all` steps are done.
    pub fn show(&mut self, done: usize, all: usize) {
        if self.bar.is_none() && self.begun.elapsed() > Self::AFTER {
            // The bar is hidden by itself where stderr is no terminal.
            let bar = ProgressBar::new(all as u64);
            if let Ok(style) = ProgressStyle::with_template("{msg} [{bar:40}] {percent:>3} %, {eta} left") {
                bar.set_style(style.progress_chars("=> "));
            }
            bar.set_message(self.what);
            self.bar = Some(bar);
        }
        if let Some(bar) = &self.bar {
            bar.set_position(done as u64);
        }
    }

    /// The steps are done; what is left to do takes a while too.
    pub fn then(&self, what: &'static str) {
        if let Some(bar) = &self.bar {
            bar.set_message(what);
            bar.tick();
        }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_wrapped_and_numbers_short() {
        let text = wrapped("  what  ", &"word ".repeat(40));
        assert!(text.lines().all(|l| l.chars().count() <= WIDTH), "{text}");
        assert!(text.lines().skip(1).all(|l| l.starts_with("        word")), "{text}");
        for (x, s) in
            [(0.001_251, "0.00125"), (12.345, "12.3"), (0.000_012, "1.2e-5"), (0.0, "0"), (-2e7, "-2e7"), (1500.0, "1500")]
        {
            assert_eq!(rounded(x), s);
        }
    }

    #[test]
    fn lists_are_wrapped_item_by_item() {
        let text = lines_wrapped(&format!("error: {0}\n  - {0}\n  - b", "word ".repeat(20)));
        assert!(text.lines().all(|l| l.chars().count() <= WIDTH), "{text}");
        assert!(text.contains("\n  - word") && text.contains("\n    word") && text.ends_with("\n  - b\n"), "{text}");
    }

    #[test]
    fn what_would_steer_a_terminal_is_written_as_its_code() {
        let mut out = Printable(Vec::new());
        let [name, rest] = ["a\u{1b}[31mb", "\u{7}\u{9b}\r"];
        writeln!(out, "{name}\t{rest}").unwrap();
        assert_eq!(String::from_utf8(out.0).unwrap(), "a\\u001b[31mb\t\\u0007\\u009b\\u000d\n");
    }
}
