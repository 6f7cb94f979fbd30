//! A sign of life while work of unknown length runs.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// Runs the work, with a spinner on stderr once it takes long, and only on a terminal.
pub fn spinning<T>(what: &'static str, work: impl FnOnce() -> T) -> T {
    let (done, finished) = channel::<()>();
    std::thread::scope(|scope| {
        scope.spawn(move || {
            // The work is over when its end of the channel is dropped.
            let runs_after = |ms| finished.recv_timeout(Duration::from_millis(ms)) == Err(RecvTimeoutError::Timeout);
            if !runs_after(800) {
                return;
            }
            let bar = ProgressBar::new_spinner().with_message(what);
            if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}, {elapsed}") {
                bar.set_style(style);
            }
            while runs_after(100) {
                bar.tick();
            }
            bar.finish_and_clear();
        });
        let result = work();
        drop(done);
        result
    })
}
