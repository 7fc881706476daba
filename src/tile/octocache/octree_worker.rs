use super::octree_statistics::{OctreeLedger, OctreeTimes};
use super::work_queue::{Job, WorkQueue};
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::thread::{Builder, JoinHandle};

/// Thread that writes the pointer trees of a mapper. It sleeps while the queue is empty. Dropping this value ends the
/// thread after the queue was emptied.
#[derive(Debug)]
pub(crate) struct OctreeWorker {
    queue: Arc<WorkQueue>,
    thread: Option<JoinHandle<()>>,
}

impl OctreeWorker {
    /// Starts the thread, with a queue of `limit_voxels` voxels.
    ///
    /// # Errors
    ///
    /// Fails if the system cannot start a thread.
    pub(crate) fn start(limit_voxels: u64, ledger: Arc<OctreeLedger>) -> io::Result<Self> {
        let queue = Arc::new(WorkQueue::new(limit_voxels));
        let thread = Builder::new().name("voxtile-octrees".to_owned()).spawn({
            let queue = queue.clone();
            move || work(&queue, &ledger)
        })?;
        Ok(Self { queue, thread: Some(thread) })
    }

    pub(crate) fn queue(&self) -> &Arc<WorkQueue> {
        &self.queue
    }
}

impl Drop for OctreeWorker {
    fn drop(&mut self) {
        self.queue.close();
        if let Some(thread) = self.thread.take() {
            // It cannot have panicked, because panics of jobs are caught.
            thread.join().unwrap_or_default();
        }
    }
}

fn work(queue: &WorkQueue, ledger: &OctreeLedger) {
    let do_job = |job: Job, worker_wait_ns| {
        ledger.add_times(OctreeTimes { worker_wait_ns, ..OctreeTimes::default() });
        // A partially written tree counts as broken and is rebuilt (`SharedTree`).
        if catch_unwind(AssertUnwindSafe(job)).is_err() {
            log::error!("an octree could not be updated; it will be rebuilt from its table at the next sync");
        }
    };
    while queue.do_next(do_job) {}
}
