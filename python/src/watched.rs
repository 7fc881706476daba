//! Work without the interpreter's lock. Ctrl-C ends the work.

use crate::errors::exception;
use parking_lot::{Condvar, Mutex};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};
use voxtile::{Error, Result, Stop};

/// Interval of checks for signals.
pub const BETWEEN_LOOKS: Duration = Duration::from_millis(50);

/// Time that work may continue after Ctrl-C before its thread is detached.
const PATIENCE: Duration = Duration::from_millis(500);

/// Panic payload that unwinds cancelled work.
struct Cancelled;

/// Runs `work` in another thread while this one checks for signals. If a signal handler raises, the stop is set and the
/// call waits for the work to end.
pub fn watched<T: Send>(py: Python<'_>, work: impl FnOnce(&Stop) -> Result<T> + Send) -> PyResult<T> {
    watched_by(py, &Stop::default(), work)
}

fn watched_by<T: Send>(
    py: Python<'_>,
    stop: &Stop,
    work: impl FnOnce(&Stop) -> Result<T> + Send,
) -> PyResult<T> {
    let (outcome, interrupt) = py.detach(|| {
        thread::scope(|scope| {
            let (running, is_running) = channel::<()>();
            let worker = scope.spawn(|| {
                let _running = running;
                work(stop)
            });
            let (_, interrupt) = answer_or_interrupt(&is_running, stop, Duration::MAX);
            (worker.join(), interrupt)
        })
    });
    match (interrupt, outcome) {
        (Some(raised), _) => Err(raised),
        (None, Ok(done)) => done.map_err(|error| exception(py, &error)),
        (None, Err(panic)) => Err(defect(&*panic)),
    }
}

/// Runs work that owns its data in another thread. After Ctrl-C the stop is set; if the work does not end soon, its
/// thread finishes it and drops the result. The interpreter waits for that thread before it exits.
pub fn run_detached<T: Send + 'static>(
    py: Python<'_>,
    stop: &Stop,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let (answer, answers) = channel();
    let counted = UnderWay::begin();
    let run = move || {
        let done = catch_unwind(AssertUnwindSafe(work));
        // The caller may have returned. An unreceived result is dropped before the work counts as done.
        drop(answer.send(done));
        drop(answer);
        drop(counted);
    };
    thread::Builder::new().name("voxtile-work".to_owned()).spawn(run)?;
    match py.detach(move || answer_or_interrupt(&answers, stop, PATIENCE)) {
        (_, Some(raised)) => Err(raised),
        (Some(Ok(answer)), None) => Ok(answer),
        (Some(Err(panic)), None) => Err(defect(&*panic)),
        (None, None) => Err(defect(&"a thread ended without a result")),
    }
}

/// [`run_detached`] for work of the library.
pub fn finished<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&Stop) -> Result<T> + Send + 'static,
) -> PyResult<T> {
    let stop = Stop::default();
    let of_work = stop.clone();
    run_detached(py, &stop, move || work(&of_work))?.map_err(|error| exception(py, &error))
}

/// Waits for a result, or for the sender to be dropped. After a signal handler has raised, which sets the stop, it
/// waits at most `patience`.
fn answer_or_interrupt<T>(
    answers: &Receiver<T>,
    stop: &Stop,
    patience: Duration,
) -> (Option<T>, Option<PyErr>) {
    let mut interrupt: Option<(PyErr, Instant)> = None;
    loop {
        let answer = match (answers.recv_timeout(BETWEEN_LOOKS), &interrupt) {
            (Ok(answer), _) => Some(answer),
            (Err(RecvTimeoutError::Disconnected), _) => None,
            (Err(RecvTimeoutError::Timeout), Some((_, since))) if since.elapsed() > patience => None,
            (Err(RecvTimeoutError::Timeout), Some(_)) => continue,
            (Err(RecvTimeoutError::Timeout), None) => {
                if let Err(raised) = Python::attach(|py| py.check_signals()) {
                    stop.set();
                    interrupt = Some((raised, Instant::now()));
                }
                continue;
            }
        };
        return (answer, interrupt.map(|(raised, _)| raised));
    }
}

/// Counter of work that may outlive the call that began it.
struct UnderWay;

static UNDER_WAY: Mutex<usize> = Mutex::new(0);
static ENDED: Condvar = Condvar::new();

impl UnderWay {
    fn begin() -> Self {
        *UNDER_WAY.lock() += 1;
        Self
    }
}

impl Drop for UnderWay {
    fn drop(&mut self) {
        *UNDER_WAY.lock() -= 1;
        ENDED.notify_all();
    }
}

/// Waits until all interrupted work has ended; Ctrl-C ends the wait.
#[pyfunction]
pub fn wait_for_all(py: Python<'_>) -> PyResult<()> {
    loop {
        let is_done = py.detach(|| {
            let mut under_way = UNDER_WAY.lock();
            if *under_way > 0 {
                ENDED.wait_for(&mut under_way, BETWEEN_LOOKS);
            }
            *under_way == 0
        });
        if is_done {
            return Ok(());
        }
        py.check_signals()?;
    }
}

/// Runs short work on this thread, without checks for Ctrl-C.
pub fn at_once<T: Send>(py: Python<'_>, work: impl FnOnce(&Stop) -> Result<T> + Send) -> PyResult<T> {
    py.detach(|| work(&Stop::default())).map_err(|error| exception(py, &error))
}

/// Runs a query on this thread, which is cheaper than a thread of its own. Returns `None` if it takes longer than
/// [`BETWEEN_LOOKS`]: Ctrl-C would wait for it.
pub fn briefly<T: Send>(py: Python<'_>, ask: impl FnOnce(&Stop) -> Result<T> + Send) -> PyResult<Option<T>> {
    match py.detach(|| ask(&Stop::after(BETWEEN_LOOKS))) {
        Err(Error::Stopped) => Ok(None),
        answer => answer.map(Some).map_err(|error| exception(py, &error)),
    }
}

/// [`watched`] for work that reports its progress. A callback that raises ends the work, as Ctrl-C does.
pub fn watched_with_progress<T: Send>(
    py: Python<'_>,
    callback: Option<Py<PyAny>>,
    work: impl FnOnce(&Stop, &Progress<'_>) -> Result<T> + Send,
) -> PyResult<T> {
    let stop = Stop::default();
    let reporter = callback.map(|callback| Reporter::new(stop.clone(), callback));
    let done = watched_by(py, &stop, |stop| work(stop, &Progress { stop, reporter: reporter.as_ref() }));
    match reporter.and_then(|reporter| reporter.raised()) {
        Some(raised) => Err(raised),
        None => done,
    }
}

/// Progress of work that cannot return early.
pub struct Progress<'a> {
    stop: &'a Stop,
    reporter: Option<&'a Reporter>,
}

impl Progress<'_> {
    /// Reports `done` of `all`. Unwinds if the work was cancelled: maps tolerate that anywhere, like a crash.
    pub fn report(&self, done: u64, all: u64) {
        if let Some(reporter) = self.reporter {
            reporter.report(done, all);
        }
        if self.stop.is_set() {
            resume_unwind(Box::new(Cancelled));
        }
    }
}

/// Reports progress to a Python callback. A callback that raises stops the work.
pub struct Reporter {
    stop: Stop,
    callback: Py<PyAny>,
    raised: Mutex<Option<PyErr>>,
    reported: Mutex<Option<Instant>>,
}

impl Reporter {
    /// Reports to this callback.
    pub fn new(stop: Stop, callback: Py<PyAny>) -> Self {
        Self { stop, callback, raised: Mutex::new(None), reported: Mutex::new(None) }
    }

    /// Reports `done` of `all`, at most once per [`BETWEEN_LOOKS`], and nothing after a stop.
    pub fn report(&self, done: u64, all: u64) {
        let mut reported = self.reported.lock();
        let is_soon = done != all && reported.is_some_and(|reported| reported.elapsed() < BETWEEN_LOOKS);
        if self.stop.is_set() || is_soon {
            return;
        }
        *reported = Some(Instant::now());
        if let Err(raised) = Python::attach(|py| self.callback.call1(py, (done, all)).map(drop)) {
            *self.raised.lock() = Some(raised);
            self.stop.set();
        }
    }

    /// Takes the exception that the callback raised.
    pub fn raised(&self) -> Option<PyErr> {
        self.raised.lock().take()
    }
}

fn defect(panic: &(dyn Any + Send)) -> PyErr {
    let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
    PyRuntimeError::new_err(format!("a defect of voxtile: {}", text.unwrap_or("a panic without a message")))
}
