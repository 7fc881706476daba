use super::request::{REQUEST, Request};
use std::future::Future;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};
use tokio::runtime::Runtime;
use tokio::task::AbortHandle;
use voxtile::Error;

/// A request that runs concurrently with others, and its future answer.
pub(super) struct Pending<T> {
    answer: Receiver<io::Result<T>>,
    request: Arc<Request>,
    stop: Arc<AtomicBool>,
    /// Aborts the request.
    task: Option<AbortHandle>,
}

/// Interval at which a wait checks whether to stop.
const STOP_CHECK_INTERVAL: Duration = Duration::from_millis(100);

impl<T: Send + 'static> Pending<T> {
    /// Starts a request on separate threads, so that the caller may be on any thread, even one of another runtime.
    pub(super) fn begin<F: Future<Output = io::Result<T>> + Send + 'static>(
        state: Arc<Request>,
        stop: Arc<AtomicBool>,
        request: impl FnOnce(Arc<Request>) -> F,
    ) -> Self {
        static RUNTIME: OnceLock<io::Result<Runtime>> = OnceLock::new();
        let new = || {
            let mut builder = tokio::runtime::Builder::new_multi_thread();
            builder.worker_threads(2).thread_name("voxtile-bucket").enable_all().build()
        };
        let (out, answer) = sync_channel(1);
        let task = match RUNTIME.get_or_init(new) {
            Ok(runtime) => {
                let request = REQUEST.scope(state.clone(), request(state.clone()));
                Some(runtime.spawn(async move { out.send(request.await) }).abort_handle())
            }
            Err(error) => {
                let reason = format!("cannot start the network threads: {error}");
                let _ = out.send(Err(io::Error::other(reason)));
                None
            }
        };
        Self { answer, request: state, stop, task }
    }
}

impl<T> Pending<T> {
    /// Waits for the answer. Logs a long wait.
    ///
    /// # Errors
    ///
    /// Errors of the request; [`Error::Stopped`] as the cause if the bucket's stop flag is set.
    pub(super) fn wait(self) -> io::Result<T> {
        self.wait_unless(&|| false).unwrap_or_else(|| Err(io::Error::other(Error::Stopped)))
    }

    /// Waits for the answer. Returns `None` if stopped before the answer arrives; the request is aborted then.
    pub(super) fn wait_unless(self, is_stopped: &dyn Fn() -> bool) -> Option<io::Result<T>> {
        let (since, mut report_at) = (Instant::now(), self.request.first_report());
        while !is_stopped() && !self.stop.load(Ordering::Relaxed) {
            match self.answer.recv_timeout(STOP_CHECK_INTERVAL) {
                Ok(answer) => return Some(answer),
                Err(RecvTimeoutError::Timeout) if since.elapsed() < report_at => {}
                Err(RecvTimeoutError::Timeout) => {
                    self.request.report(since.elapsed());
                    report_at *= 2;
                }
                Err(RecvTimeoutError::Disconnected) => {
                    return Some(Err(io::Error::other("the request was aborted")));
                }
            }
        }
        self.abort();
        None
    }

    /// Aborts the request, and waits until it has ended.
    pub(super) fn abort(self) {
        if let Some(task) = &self.task {
            task.abort();
        }
        // Wait for a late answer, or for the error that reports the end of the task.
        let _ = self.answer.recv();
    }
}

impl<T> std::fmt::Debug for Pending<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Pending").field("request", &self.request).finish_non_exhaustive()
    }
}
