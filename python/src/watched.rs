//! Work beside the interpreter: its lock is released, and Ctrl-C ends the work.

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

/// How often signals are looked for.
pub const BETWEEN_LOOKS: Duration = Duration::from_millis(50);

/// How long after Ctrl-C work may go on before it is left to itself.
const PATIENCE: Duration = Duration::from_millis(500);

/// What unwinds work that cannot return early: nothing is wrong.
struct GivenUp;

/// Does work in a thread of its own, so that this one can see to signals. The work is asked to stop by a signal handler
/// that raises, and is waited for: nothing goes on behind the caller's back.
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

/// Does work that owns all it needs, in a thread of its own. After Ctrl-C it is asked to stop; if that takes longer
/// than anybody would wait, its thread finishes it and drops its answer. The interpreter waits for it before it exits.
pub fn left_to_itself<T: Send + 'static>(
    py: Python<'_>,
    stop: &Stop,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let (answer, answers) = channel();
    let counted = UnderWay::begin();
    let run = move || {
        let done = catch_unwind(AssertUnwindSafe(work));
        // Whoever asked may have gone; what nobody takes is dropped before the work counts as done.
        drop(answer.send(done));
        drop(answer);
        drop(counted);
    };
    thread::Builder::new().name("voxtile-work".to_owned()).spawn(run)?;
    match py.detach(move || answer_or_interrupt(&answers, stop, PATIENCE)) {
        (_, Some(raised)) => Err(raised),
        (Some(Ok(answer)), None) => Ok(answer),
        (Some(Err(panic)), None) => Err(defect(&*panic)),
        (None, None) => Err(defect(&"a thread without an answer")),
    }
}

/// [`left_to_itself`] for work of the library.
pub fn finished<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&Stop) -> Result<T> + Send + 'static,
) -> PyResult<T> {
    let stop = Stop::default();
    let of_work = stop.clone();
    left_to_itself(py, &stop, move || work(&of_work))?.map_err(|error| exception(py, &error))
}

/// Waits for an answer, or for the end of whoever was to send one. After a signal handler has raised, which sets the
/// stop, at most for `patience`.
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

/// Work that may outlive the call that began it.
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

/// Waits until nothing goes on that was interrupted; Ctrl-C ends the waiting.
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

/// Short work on this thread: it takes less time than anybody would wait for Ctrl-C.
pub fn at_once<T: Send>(py: Python<'_>, work: impl FnOnce(&Stop) -> Result<T> + Send) -> PyResult<T> {
    py.detach(|| work(&Stop::default())).map_err(|error| exception(py, &error))
}

/// Asks on this thread, which is cheaper than one of its own; `None` if that takes longer than [`BETWEEN_LOOKS`], for
/// then somebody may wait for Ctrl-C.
pub fn briefly<T: Send>(py: Python<'_>, ask: impl FnOnce(&Stop) -> Result<T> + Send) -> PyResult<Option<T>> {
    match py.detach(|| ask(&Stop::after(BETWEEN_LOOKS))) {
        Err(Error::Stopped) => Ok(None),
        answer => answer.map(Some).map_err(|error| exception(py, &error)),
    }
}

/// [`watched`] for work that says how far it is. A callback that raises ends the work, and so does Ctrl-C.
pub fn watched_with_progress<T: Send>(
    py: Python<'_>,
    callback: Option<Py<PyAny>>,
    work: impl FnOnce(&Stop, &Progress<'_>) -> Result<T> + Send,
) -> PyResult<T> {
    let stop = Stop::default();
    let teller = callback.map(|callback| Teller::new(stop.clone(), callback));
    let done = watched_by(py, &stop, |stop| work(stop, &Progress { stop, teller: teller.as_ref() }));
    match teller.and_then(|teller| teller.raised()) {
        Some(raised) => Err(raised),
        None => done,
    }
}

/// How far work is that cannot return early.
pub struct Progress<'a> {
    stop: &'a Stop,
    teller: Option<&'a Teller>,
}

impl Progress<'_> {
    /// Tells of `done` out of `all`. Leaves the work by unwinding if it is to be given up: maps bear that anywhere, as
    /// they bear a crash.
    pub fn tell(&self, done: u64, all: u64) {
        if let Some(teller) = self.teller {
            teller.tell(done, all);
        }
        if self.stop.is_set() {
            resume_unwind(Box::new(GivenUp));
        }
    }
}

/// Tells a callback of Python how far work is. A callback that raises stops the work.
pub struct Teller {
    stop: Stop,
    callback: Py<PyAny>,
    raised: Mutex<Option<PyErr>>,
    told: Mutex<Option<Instant>>,
}

impl Teller {
    /// Tells this callback.
    pub fn new(stop: Stop, callback: Py<PyAny>) -> Self {
        Self { stop, callback, raised: Mutex::new(None), told: Mutex::new(None) }
    }

    /// Tells of `done` out of `all`, not more often than a person can see, and nothing after a stop.
    pub fn tell(&self, done: u64, all: u64) {
        let mut told = self.told.lock();
        let is_soon = done != all && told.is_some_and(|told| told.elapsed() < BETWEEN_LOOKS);
        if self.stop.is_set() || is_soon {
            return;
        }
        *told = Some(Instant::now());
        if let Err(raised) = Python::attach(|py| self.callback.call1(py, (done, all)).map(drop)) {
            *self.raised.lock() = Some(raised);
            self.stop.set();
        }
    }

    /// What the callback raised.
    pub fn raised(&self) -> Option<PyErr> {
        self.raised.lock().take()
    }
}

fn defect(panic: &(dyn Any + Send)) -> PyErr {
    let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
    PyRuntimeError::new_err(format!("a defect of voxtile: {}", text.unwrap_or("a panic without a text")))
}
