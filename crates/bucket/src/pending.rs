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

/// What a request will answer, while others are made.
pub(super) struct Pending<T> {
    answer: Receiver<io::Result<T>>,
    request: Arc<Request>,
    stop: Arc<AtomicBool>,
    /// Ends the request.
    task: Option<AbortHandle>,
}

/// How often a wait looks whether it is to stop.
const LOOK_EVERY: Duration = Duration::from_millis(100);

impl<T: Send + 'static> Pending<T> {
    /// Begins a request on threads of its own, so that the caller may be on any thread, even one of another runtime.
    pub(super) fn begin<F: Future<Output = io::Result<T>> + Send + 'static>(
        about: Arc<Request>,
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
                let request = REQUEST.scope(about.clone(), request(about.clone()));
                Some(runtime.spawn(async move { out.send(request.await) }).abort_handle())
            }
            Err(error) => {
                let reason = format!("no threads for the network: {error}");
                let _ = out.send(Err(io::Error::other(reason)));
                None
            }
        };
        Self { answer, request: about, stop, task }
    }
}

impl<T> Pending<T> {
    /// Waits for the answer, and reports a long wait.
    ///
    /// # Errors
    ///
    /// Those of the request; [`Error::Stopped`] inside if the bucket's flag is set.
    pub(super) fn wait(self) -> io::Result<T> {
        self.wait_unless(&|| false).unwrap_or_else(|| Err(io::Error::other(Error::Stopped)))
    }

    /// Waits for the answer; `None` if that is to stop before it comes. Nothing of the request goes on then.
    pub(super) fn wait_unless(self, is_stopped: &dyn Fn() -> bool) -> Option<io::Result<T>> {
        let (since, mut report_at) = (Instant::now(), self.request.first_report());
        while !is_stopped() && !self.stop.load(Ordering::Relaxed) {
            match self.answer.recv_timeout(LOOK_EVERY) {
                Ok(answer) => return Some(answer),
                Err(RecvTimeoutError::Timeout) if since.elapsed() < report_at => {}
                Err(RecvTimeoutError::Timeout) => {
                    self.request.report(since.elapsed());
                    report_at *= 2;
                }
                Err(RecvTimeoutError::Disconnected) => {
                    return Some(Err(io::Error::other("the request was given up")));
                }
            }
        }
        self.give_up();
        None
    }

    /// Ends the request, and waits until nothing of it goes on.
    pub(super) fn give_up(self) {
        if let Some(task) = &self.task {
            task.abort();
        }
        // An answer after all, or the end of who would have sent one.
        let _ = self.answer.recv();
    }
}

impl<T> std::fmt::Debug for Pending<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Pending").field("request", &self.request).finish_non_exhaustive()
    }
}
