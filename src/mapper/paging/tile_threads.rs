use crate::error::{Error, Result};
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::io;
use std::panic::resume_unwind;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::thread;

/// Threads that change tiles in parallel while the mapper holds the lock on the contents.
#[derive(Clone, Debug, Default)]
pub(super) enum TileThreads {
    /// The caller's rayon pool, used while no other thread waits for the lock.
    #[default]
    OfCaller,
    /// Dedicated threads. If all threads of the caller's pool waited for the lock, work queued in that pool would never
    /// start.
    Own(Arc<ThreadPool>),
}

/// Threads shared by all maps of the process; they end with the last map that uses them.
static SHARED: Mutex<Weak<ThreadPool>> = Mutex::new(Weak::new());

impl TileThreads {
    /// Starts dedicated threads, as many as the caller's pool has.
    ///
    /// # Errors
    ///
    /// Fails if the threads cannot be started; `folder` is the map's, for the error.
    pub(super) fn own(folder: &Path) -> Result<Self> {
        let mut shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(threads) = shared.upgrade() {
            return Ok(Self::Own(threads));
        }
        let threads = ThreadPoolBuilder::new()
            .num_threads(rayon::current_num_threads())
            .thread_name(|number| format!("voxtile-tiles-{number}"))
            .build();
        let threads =
            threads.map_err(|error| Error::io(folder, "start threads for", io::Error::other(error)))?;
        let threads = Arc::new(threads);
        *shared = Arc::downgrade(&threads);
        Ok(Self::Own(threads))
    }

    /// Runs `work` on each item in these threads; returns the results in the order of the items.
    pub(super) fn map<T: Send, R: Send>(&self, items: Vec<T>, work: impl Fn(T) -> R + Sync) -> Vec<R> {
        if items.len() < 2 {
            return items.into_iter().map(work).collect();
        }
        let all = || items.into_par_iter().map(&work).collect();
        match self {
            Self::OfCaller => all(),
            Self::Own(threads) if rayon::current_thread_index().is_none() => threads.install(all),
            Self::Own(threads) => install_idle(threads, all),
        }
    }
}

/// Runs `work` in a pool and waits for it on a plain thread.
///
/// A rayon worker that waits for another pool runs other jobs of its own pool meanwhile. Such a job may be a query that
/// needs the lock held by the mapper, which would be a deadlock.
fn install_idle<R: Send>(threads: &ThreadPool, work: impl FnOnce() -> R + Send) -> R {
    /// Stack size of the waiting thread.
    const STACK_BYTES: usize = 128 << 10;
    let work = Mutex::new(Some(work));
    let run = || {
        let work = work.lock().unwrap_or_else(PoisonError::into_inner).take();
        work.map(|work| threads.install(work))
    };
    let done = thread::scope(|scope| {
        let waiting = thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, run);
        waiting.ok().and_then(|waiting| waiting.join().unwrap_or_else(|panic| resume_unwind(panic)))
    });
    // If no thread can be started, this thread waits itself, which is better than a failure.
    done.or_else(run).expect("the work is done once, here or in the thread")
}
