//! Ending long work from outside. The threads of a pool carry a flag; every simulation of a fit looks at it before it begins, and unwinds
//! without a message where it is raised. Whoever raises it catches [`Stopped`] where the work was handed to the pool.

use std::cell::RefCell;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

thread_local! {
    static FLAG: RefCell<Option<Arc<AtomicBool>>> = const { RefCell::new(None) };
}

/// What work unwinds with when it was asked to end.
#[derive(Clone, Copy, Debug)]
pub struct Stopped;

/// From here on this thread ends its work soon after the flag is raised.
pub fn carry(flag: Arc<AtomicBool>) {
    FLAG.set(Some(flag));
}

/// Unwinds with [`Stopped`] if this thread's flag is raised.
pub fn check() {
    if FLAG.with_borrow(|f| f.as_ref().is_some_and(|f| f.load(Ordering::Relaxed))) {
        resume_unwind(Box::new(Stopped));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_raised_flag_ends_the_work_of_its_thread_alone() {
        let flag = Arc::new(AtomicBool::new(false));
        let carried = flag.clone();
        let worker = std::thread::spawn(move || {
            carry(carried.clone());
            check();
            carried.store(true, Ordering::Relaxed);
            check();
        });
        assert!(worker.join().unwrap_err().is::<Stopped>());
        check();
    }
}
