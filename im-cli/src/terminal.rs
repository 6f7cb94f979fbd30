//! Output for people: wrapped text, numbers with few digits, a progress bar on long runs.

use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

/// The width that texts are wrapped to: what every terminal shows and every pipe passes.
pub const WIDTH: usize = 80;

/// The width of stories with tables in them.
pub const STORY_WIDTH: usize = 100;

/// Wraps `text` to [`WIDTH`] with `first` before its first line and spaces before the others.
pub fn wrapped(first: &str, text: &str) -> String {
    let indent = first.chars().count();
    let mut out = String::from(first);
    let mut column = indent;
    for (k, word) in text.split_whitespace().enumerate() {
        let length = word.chars().count();
        if k > 0 && column + 1 + length > WIDTH {
            out.push('\n');
            out.push_str(&" ".repeat(indent));
            column = indent;
        } else if k > 0 {
            out.push(' ');
            column += 1;
        }
        out.push_str(word);
        column += length;
    }
    out.push('\n');
    out
}

/// A number to three digits: 0.00125, 12.3, 1.2e-5.
pub fn rounded(x: f64) -> String {
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
    pub fn tell(&mut self, done: usize, all: usize) {
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
}
