//! A sign of life while work of unknown length runs.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Runs the work, with a spinner on stderr once it takes long, and only on a terminal.
pub fn spinning<T>(what: &'static str, work: impl FnOnce() -> T) -> T {
    spinning_on(ProgressDrawTarget::stderr(), what, work)
}

fn spinning_on<T>(target: ProgressDrawTarget, what: &'static str, work: impl FnOnce() -> T) -> T {
    let (done, finished) = channel::<()>();
    std::thread::scope(|scope| {
        scope.spawn(move || {
            // The work is over when its end of the channel is dropped.
            let runs_after = |ms| finished.recv_timeout(Duration::from_millis(ms)) == Err(RecvTimeoutError::Timeout);
            if !runs_after(800) {
                return;
            }
            let bar = ProgressBar::with_draw_target(None, target).with_message(what);
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

#[cfg(test)]
mod tests {
    use super::*;
    use indicatif::InMemoryTerm;

    #[test]
    fn long_work_says_what_it_does_and_leaves_nothing_behind() {
        let terminal = InMemoryTerm::new(5, 80);
        let target = || ProgressDrawTarget::term_like(Box::new(terminal.clone()));
        let shown = spinning_on(target(), "simulating", || {
            let waited = (0..100).find(|_| {
                std::thread::sleep(Duration::from_millis(100));
                !terminal.contents().is_empty()
            });
            (waited, terminal.contents())
        });
        assert!(shown.0.is_some() && shown.1.contains("simulating, "), "{shown:?}");
        assert_eq!(terminal.contents(), "");
        let short = spinning_on(target(), "reading", || 7);
        assert_eq!((short, terminal.contents()), (7, String::new()));
    }
}
