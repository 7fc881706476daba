use super::octree_statistics::{OctreeQueueCounts, nanoseconds};
use std::collections::VecDeque;
use std::fmt;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Bounded queue of jobs on voxels for one thread. A sender sleeps while the queue is full, the thread while it is
/// empty.
pub(crate) struct WorkQueue {
    state: Mutex<State>,
    has_work: Condvar,
    has_room: Condvar,
}

pub(crate) type Job = Box<dyn FnOnce() + Send>;

#[derive(Default)]
struct State {
    jobs: VecDeque<(Job, u64)>,
    /// Voxels of the jobs, including the one being executed.
    voxels: u64,
    is_busy: bool,
    is_closed: bool,
    counts: OctreeQueueCounts,
}

impl WorkQueue {
    /// Creates a queue that is full once it contains `limit_voxels`.
    pub(crate) fn new(limit_voxels: u64) -> Self {
        let counts = OctreeQueueCounts { limit_voxels, ..OctreeQueueCounts::default() };
        Self {
            state: Mutex::new(State { counts, ..State::default() }),
            has_work: Condvar::new(),
            has_room: Condvar::new(),
        }
    }

    pub(crate) fn counts(&self) -> OctreeQueueCounts {
        self.lock().counts
    }

    /// Enqueues a job for a number of voxels once there is space for it or the queue is empty. Returns the waiting time
    /// in nanoseconds, or the job if the queue is closed.
    pub(crate) fn push(&self, voxels: usize, job: Job) -> Result<u64, Job> {
        let voxels = voxels as u64;
        let mut state = self.lock();
        let mut wait_ns = 0;
        if !state.has_room_for(voxels) {
            let since = Instant::now();
            state.counts.waits += 1;
            state = wait_while(&self.has_room, state, |state| !state.has_room_for(voxels));
            wait_ns = nanoseconds(since.elapsed());
        }
        if state.is_closed {
            return Err(job);
        }
        state.jobs.push_back((job, voxels));
        state.voxels += voxels;
        let batches = state.jobs.len() as u64 + u64::from(state.is_busy);
        let (voxels_now, counts) = (state.voxels, &mut state.counts);
        counts.batches_in += 1;
        counts.voxels_in += voxels;
        counts.peak_batches = counts.peak_batches.max(batches);
        counts.peak_voxels = counts.peak_voxels.max(voxels_now);
        drop(state);
        self.has_work.notify_one();
        Ok(wait_ns)
    }

    /// Waits for a job and passes it to `do_job` with the waiting time in nanoseconds. Returns `false` once the queue
    /// is closed and empty.
    pub(crate) fn do_next(&self, do_job: impl FnOnce(Job, u64)) -> bool {
        let since = Instant::now();
        let is_idle = |state: &mut State| state.jobs.is_empty() && !state.is_closed;
        let mut state = wait_while(&self.has_work, self.lock(), is_idle);
        let Some((job, voxels)) = state.jobs.pop_front() else { return false };
        state.is_busy = true;
        drop(state);
        do_job(job, nanoseconds(since.elapsed()));
        let mut state = self.lock();
        state.is_busy = false;
        state.voxels -= voxels;
        state.counts.batches_out += 1;
        state.counts.voxels_out += voxels;
        drop(state);
        // Notify all, because there may be space for a small job while the one that has waited longest is large.
        self.has_room.notify_all();
        true
    }

    /// Closes the queue: no more jobs are accepted, and queued ones can still be executed.
    pub(crate) fn close(&self) {
        self.lock().is_closed = true;
        self.has_work.notify_all();
        self.has_room.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // No job runs under the lock, and no other code here can panic.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for WorkQueue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("WorkQueue").field("counts", &self.counts()).finish_non_exhaustive()
    }
}

impl State {
    fn has_room_for(&self, voxels: u64) -> bool {
        self.is_closed || self.voxels == 0 || self.voxels + voxels <= self.counts.limit_voxels
    }
}

fn wait_while<'a>(
    condition: &Condvar,
    state: MutexGuard<'a, State>,
    is_waiting: impl FnMut(&mut State) -> bool,
) -> MutexGuard<'a, State> {
    condition.wait_while(state, is_waiting).unwrap_or_else(PoisonError::into_inner)
}
