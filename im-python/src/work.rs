//! Long work: on threads of its own without Python's lock, with a sign of life, ended by Ctrl-C.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use im_identify::offline::stop::{self, Stopped};
use pyo3::prelude::*;
use rayon::ThreadPoolBuilder;

use crate::errors::refused;

/// How often Python is asked whether somebody pressed Ctrl-C.
const ASK_EVERY: Duration = Duration::from_millis(50);

/// Runs work without Python's lock. `threads` is how many it may use; zero: one for each processor.
pub fn work<T: Send>(py: Python<'_>, what: &str, threads: usize, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let stop = Arc::new(AtomicBool::new(false));
    let carried = stop.clone();
    let pool = ThreadPoolBuilder::new().num_threads(threads).start_handler(move |_| stop::carry(carried.clone()));
    let pool = pool.build().map_err(refused)?;
    let life = py.import("imkit._progress")?.getattr("Life")?.call1((what,))?.unbind();
    let (interrupted, result) = py.detach(|| {
        let (done, finished) = channel::<()>();
        std::thread::scope(|scope| {
            let worker = scope.spawn(|| {
                let result = catch_unwind(AssertUnwindSafe(|| pool.install(work)));
                // Its end of the channel says that the work is over.
                drop(done);
                result
            });
            let mut interrupted = None;
            while finished.recv_timeout(ASK_EVERY) == Err(RecvTimeoutError::Timeout) {
                if interrupted.is_none() {
                    interrupted = Python::attach(|py| shown(py, &life, "show").and_then(|()| py.check_signals())).err();
                }
                stop.store(interrupted.is_some(), Ordering::Relaxed);
            }
            (interrupted, worker.join().and_then(|result| result))
        })
    });
    shown(py, &life, "end")?;
    match (interrupted, result) {
        (Some(e), _) => Err(e),
        (None, Ok(result)) => Ok(result),
        (None, Err(panic)) => Err(unexpected(panic)),
    }
}

/// Work goes on where nobody can see that it lives; a Ctrl-C that comes while that is shown is one.
fn shown(py: Python<'_>, life: &Py<PyAny>, act: &str) -> PyResult<()> {
    life.call_method0(py, act)
        .map(|_| ())
        .or_else(|e| if e.is_instance_of::<pyo3::exceptions::PyException>(py) { Ok(()) } else { Err(e) })
}

/// A panic of the crates goes on as one: PyO3 makes an exception of it.
fn unexpected(panic: Box<dyn Any + Send>) -> PyErr {
    if panic.is::<Stopped>() { refused("stopped") } else { resume_unwind(panic) }
}
