use super::bucket::{error_text, object_error};
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

/// One request to a store with all its attempts. It tracks progress and enforces the timeout.
///
/// An attempt in which fewer than [`PROGRESS_BYTES`] are transferred for half of the limit is aborted and retried. The
/// request fails if these idle times add up to the limit before an attempt gets further than all earlier ones. Bytes
/// that are sent again count neither as idle time nor as progress.
///
/// An upload has twice as much time: the whole limit per attempt. Bytes count as sent once the connection has accepted
/// them, and on a slow link they may remain in its buffers for long.
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
    /// Number of attempts in a row without progress.
    stalled: u32,
    /// Bytes of the object received so far, or sent by this attempt.
    moved: u64,
    /// Maximum of `moved` over all attempts, in steps of [`PROGRESS_BYTES`].
    max_moved: u64,
    /// Value of `moved` and time, at the last progress or at the start of this attempt.
    last_progress: (u64, Instant),
    /// Idle time of earlier attempts and the pauses between them since the last progress.
    idle: Duration,
    /// Server of the last attempt.
    address: Option<String>,
    /// HTTP status of the last answer.
    status: Option<u16>,
    /// Whether the last attempt could not connect to a server.
    is_unreachable: bool,
    last_failure: Option<String>,
}

/// Reason for the failure of an attempt.
pub(super) enum Failure {
    /// The connection broke, or the store is temporarily unavailable.
    Broken(object_store::Error),
    /// The store would refuse another attempt too.
    Refused(object_store::Error),
    /// Another attempt cannot help, for a reason outside the store.
    Fatal(io::Error),
    /// No bytes were transferred.
    Silent,
}

/// Number of bytes that count as progress. With fewer, a server that sends a few bytes a second could hold a request
/// for days.
pub(super) const PROGRESS_BYTES: u64 = 16 << 10;

/// Maximum number of attempts in a row without progress.
const MAX_STALLED: u32 = 20;

/// Maximum number of attempts while the store has never answered, so that a wrong address is reported within seconds.
const MAX_UNREACHABLE: u32 = 4;

const FIRST_PAUSE: Duration = Duration::from_millis(50);
const MAX_PAUSE: Duration = Duration::from_secs(5);

/// Time after which a wait is reported, or a quarter of the limit if that is less.
const FIRST_REPORT: Duration = Duration::from_secs(8);

tokio::task_local! {
    /// Request of the current task, for the client that counts the bytes sent.
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
            stalled: 0,
            moved: 0,
            max_moved: 0,
            last_progress: (0, now),
            idle: Duration::ZERO,
            address: None,
            status: None,
            is_unreachable: false,
            last_failure: None,
        };
        Arc::new(Self { verb, key, limit, health, began: now, state: Mutex::new(state) })
    }

    /// Makes an attempt, which continues after `kept` bytes of earlier attempts.
    pub(super) async fn attempt<T>(
        &self,
        kept: u64,
        attempt: impl Future<Output = Result<T, Failure>>,
    ) -> Result<T, Failure> {
        self.state.lock().attempts += 1;
        let outcome = self.run(kept, attempt).await;
        if outcome.is_ok() {
            // Attempts are counted for each range of a large file anew.
            self.state.lock().attempts = 0;
        }
        outcome
    }

    /// Runs another query within the same limits.
    pub(super) async fn query<T>(
        &self,
        query: impl Future<Output = Result<T, Failure>>,
    ) -> Result<T, Failure> {
        self.run(0, query).await
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
            let idle = state.last_progress.1.elapsed();
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
                    self.health.record(self.is_answer(&error));
                    let is_final = self.is_final(&error);
                    return Err(if is_final { Failure::Refused(error) } else { Failure::Broken(error) });
                }
                Ok(outcome) => {
                    self.health.record(true);
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
    /// The failure, if another attempt cannot help; [`Error::NoAnswer`] as the cause if a limit is reached.
    pub(super) async fn retry_after(&self, failure: Failure) -> io::Result<()> {
        let reason = match failure {
            Failure::Fatal(error) => return Err(error),
            Failure::Refused(error) => return Err(object_error(&self.key, &error)),
            Failure::Broken(error) => error_text(&error),
            Failure::Silent => "the server does not answer".to_owned(),
        };
        let pause = {
            let mut state = self.state.lock();
            state.stalled += 1;
            let lacks_keys = reason.starts_with("no keys");
            let max_attempts = match (state.is_unreachable && !self.health.has_answered()) || lacks_keys {
                true => MAX_UNREACHABLE,
                false => MAX_STALLED,
            };
            let doublings = state.stalled.saturating_sub(1).min(16);
            let pause = FIRST_PAUSE.saturating_mul(1 << doublings).min(MAX_PAUSE);
            state.idle += pause;
            let is_over = state.idle >= self.limit;
            state.last_failure = Some(reason.clone());
            if is_over || state.stalled >= max_attempts { None } else { Some(pause) }
        };
        let Some(pause) = pause else { return Err(self.no_answer(reason)) };
        log::info!("{self}: {reason}; retry in {pause:?}");
        sleep(pause).await;
        Ok(())
    }

    /// Adds bytes that were sent or received.
    pub(super) fn add_bytes(&self, bytes: u64) {
        let mut state = self.state.lock();
        state.moved += bytes;
        if state.moved >= state.last_progress.0 + PROGRESS_BYTES {
            state.last_progress = (state.moved, Instant::now());
        }
        if state.moved >= state.max_moved + PROGRESS_BYTES {
            (state.max_moved, state.idle, state.stalled) = (state.moved, Duration::ZERO, 0);
        }
    }

    /// Records the server of the attempt.
    pub(super) fn set_server(&self, address: String) {
        self.state.lock().address = Some(address);
    }

    /// Records the status of an answer.
    pub(super) fn set_status(&self, status: u16) {
        self.state.lock().status = Some(status);
    }

    /// Records that no connection could be made.
    pub(super) fn set_unreachable(&self) {
        self.state.lock().is_unreachable = true;
    }

    /// Returns the time after which a waiting thread logs its first report.
    pub(super) fn first_report(&self) -> Duration {
        FIRST_REPORT.min(self.limit / 4)
    }

    /// Logs a wait for this request, unless another wait was just reported.
    pub(super) fn report(&self, waited: Duration) {
        if self.health.may_report() {
            log::warn!("waiting for {:.1} s: {self}", waited.as_secs_f64());
        }
    }

    fn begin(&self, kept: u64) {
        let mut state = self.state.lock();
        (state.moved, state.last_progress) = (kept, (kept, Instant::now()));
        (state.status, state.is_unreachable) = (None, false);
    }

    /// Returns the time when this attempt ends if there is no further progress.
    fn deadline(&self) -> Instant {
        let state = self.state.lock();
        let remaining = (self.limit / 2).min(self.limit.saturating_sub(state.idle));
        state.last_progress.1 + if self.is_upload() { 2 * remaining } else { remaining }
    }

    fn is_upload(&self) -> bool {
        self.verb == "PUT"
    }

    /// Returns whether an error is an answer of the store, not a failure of the connection.
    fn is_answer(&self, error: &object_store::Error) -> bool {
        self.state.lock().status.is_some() || !matches!(error, object_store::Error::Generic { .. })
    }

    /// Returns whether the store would refuse the same request again.
    fn is_final(&self, error: &object_store::Error) -> bool {
        match error {
            // The answer was truncated, so its status is not final.
            object_store::Error::Generic { source, .. } if is_cut_off(&**source) => false,
            object_store::Error::Generic { .. } => {
                // 408 and 429 permit another attempt. Stores without HTTP report an invalid range only in the text.
                matches!(self.state.lock().status, Some(300..=407 | 409..=428 | 430..=499))
                    || error_text(error).contains("but object was only")
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

/// Returns whether the connection broke before an answer was complete.
fn is_cut_off(error: &(dyn std::error::Error + 'static)) -> bool {
    std::iter::successors(Some(error), |error| error.source()).any(|error| error.is::<HttpError>())
}

/// Makes attempts from the beginning until one succeeds, or another cannot help.
pub(super) async fn retry<T, F: Future<Output = Result<T, Failure>>>(
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

/// Shows the request, the server, the progress and the last failure.
impl fmt::Display for Request {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let state = self.state.lock();
        write!(f, "{}: {} {}", self.health.url(), self.verb, self.key)?;
        if let Some(address) = &state.address {
            write!(f, " at {address}")?;
        }
        let (since, limit) = (self.began.elapsed().as_secs_f64(), self.limit.as_secs_f64());
        write!(f, ", started {since:.1} s ago, attempt {}", state.attempts.max(1))?;
        if matches!(self.verb, "GET" | "PUT") {
            write!(f, ", {} bytes", state.moved)?;
        }
        write!(f, ", fails after {limit} s without progress")?;
        match &state.last_failure {
            Some(failure) => write!(f, "; the previous attempt failed: {failure}"),
            None => Ok(()),
        }
    }
}
