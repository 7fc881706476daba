use super::bucket::{refused, told};
use super::store_health::StoreHealth;
use object_store::client::HttpError;
use object_store::path::Path as Key;
use parking_lot::Mutex;
use std::fmt;
use std::future::Future;
use std::io;
use std::pin::pin;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::time::{sleep, timeout_at};
use voxtile::{Error, Unanswered};

/// One request to a store with all its attempts: how far it is, and how long it may remain without progress.
///
/// An attempt in which fewer than [`PROGRESS_BYTES`] move for half of the limit is ended and begun again. The request
/// fails if such idle times add up to the limit before an attempt gets further than all earlier ones: bytes that are sent
/// again are neither idle time nor progress.
///
/// An upload has twice as much time, the whole limit for an attempt: bytes count as sent once the connection has taken
/// them, and on a slow link they may wait in its buffers for long.
#[derive(Debug)]
pub(super) struct Request {
    verb: &'static str,
    key: Key,
    limit: Duration,
    health: Arc<StoreHealth>,
    began: Instant,
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    attempts: u32,
    /// Attempts in a row that got no farther than an earlier one.
    fruitless: u32,
    /// Bytes of the object that have been received, or sent by this attempt.
    moved: u64,
    /// The farthest that an attempt has got, in steps of progress.
    farthest: u64,
    /// `moved` and the time when this attempt began or last moved enough.
    mark: (u64, Instant),
    /// How long earlier attempts and the pauses between them were idle since the last progress.
    idle: Duration,
    /// The server that the last attempt asked.
    address: Option<String>,
    /// What the server answered to the last attempt.
    status: Option<u16>,
    /// Whether the last attempt found no server.
    is_unreachable: bool,
    last_failure: Option<String>,
}

/// Why an attempt failed.
pub(super) enum Failure {
    /// The connection broke, or the store cannot answer now.
    Broken(object_store::Error),
    /// The store would refuse another attempt, too.
    Refused(object_store::Error),
    /// Something other than the store makes another attempt useless.
    Useless(io::Error),
    /// Nothing moved.
    Silent,
}

/// Fewer bytes are no progress: a server that drips a few bytes a second would hold a request for days.
pub(super) const PROGRESS_BYTES: u64 = 16 << 10;

/// Attempts in a row that get no farther than an earlier one.
const MAX_FRUITLESS: u32 = 20;

/// The same while the store has never answered: a wrong address is found in seconds.
const MAX_UNREACHABLE: u32 = 4;

const FIRST_PAUSE: Duration = Duration::from_millis(50);
const LONGEST_PAUSE: Duration = Duration::from_secs(5);

/// A wait is reported after so long, or a quarter of the limit.
const FIRST_REPORT: Duration = Duration::from_secs(8);

tokio::task_local! {
    /// The request that a task makes, for the client that counts what is sent.
    pub(super) static REQUEST: Arc<Request>;
}

impl From<object_store::Error> for Failure {
    fn from(error: object_store::Error) -> Self {
        Self::Broken(error)
    }
}

impl Request {
    pub(super) fn new(verb: &'static str, key: Key, limit: Duration, health: Arc<StoreHealth>) -> Arc<Self> {
        let now = Instant::now();
        let state = State {
            attempts: 0,
            fruitless: 0,
            moved: 0,
            farthest: 0,
            mark: (0, now),
            idle: Duration::ZERO,
            address: None,
            status: None,
            is_unreachable: false,
            last_failure: None,
        };
        Arc::new(Self { verb, key, limit, health, began: now, state: Mutex::new(state) })
    }

    /// Makes an attempt, which continues after the bytes that are kept of earlier ones.
    pub(super) async fn attempt<T>(
        &self,
        kept: u64,
        attempt: impl Future<Output = Result<T, Failure>>,
    ) -> Result<T, Failure> {
        self.state.lock().attempts += 1;
        let outcome = self.run(kept, attempt).await;
        if outcome.is_ok() {
            // A long file takes several ranges.
            self.state.lock().attempts = 0;
        }
        outcome
    }

    /// Asks the store on the way, within the same bound.
    pub(super) async fn ask<T>(
        &self,
        question: impl Future<Output = Result<T, Failure>>,
    ) -> Result<T, Failure> {
        self.run(0, question).await
    }

    async fn run<T>(
        &self,
        kept: u64,
        attempt: impl Future<Output = Result<T, Failure>>,
    ) -> Result<T, Failure> {
        self.begin(kept);
        let outcome = self.bounded(attempt).await;
        if outcome.is_err() {
            let mut state = self.state.lock();
            let idle = state.mark.1.elapsed();
            state.idle += if self.is_upload() { idle / 2 } else { idle };
        }
        outcome
    }

    async fn bounded<T>(&self, attempt: impl Future<Output = Result<T, Failure>>) -> Result<T, Failure> {
        let mut attempt = pin!(attempt);
        loop {
            let deadline = self.deadline();
            match timeout_at(deadline.into(), &mut attempt).await {
                Ok(Err(Failure::Broken(error))) => {
                    self.health.note(self.is_answer(&error));
                    let is_final = self.is_final(&error);
                    return Err(if is_final { Failure::Refused(error) } else { Failure::Broken(error) });
                }
                Ok(outcome) => {
                    self.health.note(true);
                    return outcome;
                }
                Err(_) if self.deadline() > deadline => {}
                Err(_) => return Err(Failure::Silent),
            }
        }
    }

    /// Waits before the next attempt.
    ///
    /// # Errors
    ///
    /// The failure, if another attempt would not help; [`Error::NoAnswer`] inside if the bound is reached.
    pub(super) async fn retry_after(&self, failure: Failure) -> io::Result<()> {
        let reason = match failure {
            Failure::Useless(error) => return Err(error),
            Failure::Refused(error) => return Err(refused(&self.key, &error)),
            Failure::Broken(error) => told(&error),
            Failure::Silent => "the server does not answer".to_owned(),
        };
        let pause = {
            let mut state = self.state.lock();
            state.fruitless += 1;
            let lacks_keys = reason.starts_with("no keys");
            let most = match (state.is_unreachable && !self.health.has_answered()) || lacks_keys {
                true => MAX_UNREACHABLE,
                false => MAX_FRUITLESS,
            };
            let doublings = state.fruitless.saturating_sub(1).min(16);
            let pause = FIRST_PAUSE.saturating_mul(1 << doublings).min(LONGEST_PAUSE);
            state.idle += pause;
            let is_over = state.idle >= self.limit;
            state.last_failure = Some(reason.clone());
            if is_over || state.fruitless >= most { None } else { Some(pause) }
        };
        let Some(pause) = pause else { return Err(self.no_answer(reason)) };
        log::info!("{self}: {reason}; tried again in {pause:?}");
        sleep(pause).await;
        Ok(())
    }

    /// Notes bytes that were sent or received.
    pub(super) fn moved(&self, bytes: u64) {
        let mut state = self.state.lock();
        state.moved += bytes;
        if state.moved >= state.mark.0 + PROGRESS_BYTES {
            state.mark = (state.moved, Instant::now());
        }
        if state.moved >= state.farthest + PROGRESS_BYTES {
            (state.farthest, state.idle, state.fruitless) = (state.moved, Duration::ZERO, 0);
        }
    }

    /// Notes the server that is asked.
    pub(super) fn asks(&self, address: String) {
        self.state.lock().address = Some(address);
    }

    /// Notes the status of an answer.
    pub(super) fn answered(&self, status: u16) {
        self.state.lock().status = Some(status);
    }

    /// Notes that no connection could be made.
    pub(super) fn is_unreachable(&self) {
        self.state.lock().is_unreachable = true;
    }

    /// How long a thread waits before it reports what it waits for.
    pub(super) fn first_report(&self) -> Duration {
        FIRST_REPORT.min(self.limit / 4)
    }

    /// Reports what is waited for.
    pub(super) fn report(&self, waited: Duration) {
        if self.health.may_report() {
            log::warn!("waiting for {:.1} s: {self}", waited.as_secs_f64());
        }
    }

    fn begin(&self, kept: u64) {
        let mut state = self.state.lock();
        (state.moved, state.mark) = (kept, (kept, Instant::now()));
        (state.status, state.is_unreachable) = (None, false);
    }

    /// When this attempt ends unless there is progress before.
    fn deadline(&self) -> Instant {
        let state = self.state.lock();
        let most = (self.limit / 2).min(self.limit.saturating_sub(state.idle));
        state.mark.1 + if self.is_upload() { 2 * most } else { most }
    }

    fn is_upload(&self) -> bool {
        self.verb == "PUT"
    }

    /// Whether an error is the answer of a store, and not one of the way there.
    fn is_answer(&self, error: &object_store::Error) -> bool {
        self.state.lock().status.is_some() || !matches!(error, object_store::Error::Generic { .. })
    }

    /// Whether the same request would be refused again.
    fn is_final(&self, error: &object_store::Error) -> bool {
        match error {
            // The status was a refusal, and its text was cut off.
            object_store::Error::Generic { source, .. } if is_cut_off(&**source) => false,
            object_store::Error::Generic { .. } => {
                // 408 and 429 ask for another attempt. A store without HTTP says so of a range in words.
                matches!(self.state.lock().status, Some(300..=407 | 409..=428 | 430..=499))
                    || told(error).contains("but object was only")
            }
            object_store::Error::JoinError { .. } => false,
            _ => true,
        }
    }

    fn no_answer(&self, reason: String) -> io::Error {
        let state = self.state.lock();
        let error = Error::NoAnswer {
            path: self.health.url().into(),
            unanswered: Box::new(Unanswered {
                request: format!("{} {}", self.verb, self.key),
                server: state.address.clone(),
                waited: self.began.elapsed(),
                attempts: state.attempts,
                limit: self.limit,
            }),
            cause: io::Error::other(reason),
        };
        io::Error::new(io::ErrorKind::TimedOut, error)
    }
}

/// Whether a connection broke before an answer was complete.
fn is_cut_off(error: &(dyn std::error::Error + 'static)) -> bool {
    std::iter::successors(Some(error), |error| error.source()).any(|error| error.is::<HttpError>())
}

/// Makes attempts from the beginning until one succeeds, or another would not help.
pub(super) async fn retried<T, F: Future<Output = Result<T, Failure>>>(
    request: &Request,
    attempt: impl Fn() -> F,
) -> io::Result<T> {
    loop {
        match request.attempt(0, attempt()).await {
            Ok(value) => return Ok(value),
            Err(failure) => request.retry_after(failure).await?,
        }
    }
}

/// What is asked of which server, how far it is, and what happened last.
impl fmt::Display for Request {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let state = self.state.lock();
        write!(f, "{}: {} {}", self.health.url(), self.verb, self.key)?;
        if let Some(address) = &state.address {
            write!(f, " of {address}")?;
        }
        let (since, limit) = (self.began.elapsed().as_secs_f64(), self.limit.as_secs_f64());
        write!(f, ", begun {since:.1} s ago, attempt {}", state.attempts.max(1))?;
        if matches!(self.verb, "GET" | "PUT") {
            write!(f, ", {} bytes", state.moved)?;
        }
        write!(f, ", given up after {limit} s without progress")?;
        match &state.last_failure {
            Some(failure) => write!(f, "; the attempt before failed: {failure}"),
            None => Ok(()),
        }
    }
}
