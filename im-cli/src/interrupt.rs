//! Ctrl-C: the program ends at once, and leaves whole files or none.

use std::process::exit;
use std::sync::{Mutex, PoisonError, TryLockError};
use std::thread::sleep;
use std::time::Duration;

use im_model::abandon_files;

use crate::terminal::say;

/// Taken while files that belong together are written.
static TOGETHER: Mutex<()> = Mutex::new(());

/// From here on an interrupt ends the program with status 130. Without a handler the system would, between two bytes of a file.
pub fn listen() {
    // Where no handler can be set the system's way has to do.
    let _ = ctrlc::set_handler(|| {
        // Files that belong together take some milliseconds; a disk that hangs is not waited for.
        let mut together = TOGETHER.try_lock();
        for _ in 0..25 {
            if !matches!(together, Err(TryLockError::WouldBlock)) {
                break;
            }
            sleep(Duration::from_millis(10));
            together = TOGETHER.try_lock();
        }
        // Held to the end: no file is begun or finished any more.
        let _none_more = abandon_files();
        say("\ninterrupted\n");
        exit(130);
    });
}

/// Writes several files that belong together: an interrupt comes before the first of them or after the last.
pub fn together<T>(write: impl FnOnce() -> T) -> T {
    let _held = TOGETHER.lock().unwrap_or_else(PoisonError::into_inner);
    write()
}
