//! Work beside the interpreter: its lock is released, and Ctrl-C ends the work.

use crate::errors::exception;
use parking_lot::Mutex;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::any::Any;
use std::panic::resume_unwind;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};
use voxtile::{Result, Stop};

/// How often signals are looked for.
const BETWEEN_LOOKS: Duration = Duration::from_millis(50);

/// What unwinds work that cannot return early: nothing is wrong.
struct GivenUp;

/// Does work in a thread of its own, so that this one can see to signals. The work is asked to stop by a signal handler
/// that raises, and is waited for: nothing goes on behind the caller's back.
pub fn watched<T: Send>(py: Python<'_>, work: impl FnOnce(&Stop) -> Result<T> + Send) -> PyResult<T> {
    let stop = Stop::default();
    let (outcome, interrupt) = py.detach(|| {
        thread::scope(|scope| {
            let (running, is_running) = channel::<()>();
            let worker = scope.spawn(|| {
                let _running = running;
                work(&stop)
            });
            let mut interrupt = None;
            while is_running.recv_timeout(BETWEEN_LOOKS) == Err(RecvTimeoutError::Timeout) {
                if interrupt.is_none()
                    && let Err(raised) = Python::attach(|py| py.check_signals())
                {
                    stop.set();
                    interrupt = Some(raised);
                }
            }
            (worker.join(), interrupt)
        })
    });
    match (interrupt, outcome) {
        (Some(raised), _) => Err(raised),
        (None, Ok(done)) => done.map_err(|error| exception(py, &error)),
        (None, Err(panic)) => Err(defect(&*panic)),
    }
}

/// Short work on this thread: it takes less time than anybody would wait for Ctrl-C.
pub fn at_once<T: Send>(py: Python<'_>, work: impl FnOnce(&Stop) -> Result<T> + Send) -> PyResult<T> {
    py.detach(|| work(&Stop::default())).map_err(|error| exception(py, &error))
}

/// [`watched`] for work that says how far it is. A callback that raises ends the work, and so does Ctrl-C.
pub fn watched_with_progress<T: Send>(
    py: Python<'_>,
    callback: Option<Py<PyAny>>,
    work: impl FnOnce(&Stop, &Progress<'_>) -> Result<T> + Send,
) -> PyResult<T> {
    let raised = Mutex::new(None);
    let done = watched(py, |stop| {
        let progress = Progress { stop, callback: &callback, raised: &raised, told: Mutex::new(None) };
        work(stop, &progress)
    });
    match raised.into_inner() {
        Some(raised) => Err(raised),
        None => done,
    }
}

/// Tells a callback of Python how far the work is.
pub struct Progress<'a> {
    stop: &'a Stop,
    callback: &'a Option<Py<PyAny>>,
    raised: &'a Mutex<Option<PyErr>>,
    told: Mutex<Option<Instant>>,
}

impl Progress<'_> {
    /// Tells of `done` out of `all`, not more often than a person can see. Leaves the work by unwinding if it is to be
    /// given up: maps bear that anywhere, as they bear a crash.
    pub fn tell(&self, done: u64, all: u64) {
        if self.stop.is_set() {
            resume_unwind(Box::new(GivenUp));
        }
        let Some(callback) = self.callback else { return };
        let mut told = self.told.lock();
        if done < all && told.is_some_and(|told| told.elapsed() < BETWEEN_LOOKS) {
            return;
        }
        *told = Some(Instant::now());
        if let Err(raised) = Python::attach(|py| callback.call1(py, (done, all)).map(drop)) {
            *self.raised.lock() = Some(raised);
            resume_unwind(Box::new(GivenUp));
        }
    }
}

fn defect(panic: &(dyn Any + Send)) -> PyErr {
    let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
    PyRuntimeError::new_err(format!("a defect of voxtile: {}", text.unwrap_or("a panic without a text")))
}
