use super::priority::lower_priority;
use std::collections::VecDeque;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};

/// Background thread for one kind of job, which runs jobs in order. It starts with the first job, sleeps while there
/// are none, and ends with its owner. Jobs not started by then are dropped. If the system cannot start a thread, jobs
/// run on the caller's thread.
///
/// The owner limits the number of jobs in flight.
pub(crate) struct Worker<Job, Done> {
    name: &'static str,
    work: Arc<dyn Fn(Job) -> Done + Send + Sync>,
    thread: Option<Thread<Job, Done>>,
    has_no_thread: bool,
    has_low_priority: bool,
    done_here: VecDeque<Done>,
    in_flight: usize,
}

struct Thread<Job, Done> {
    jobs: Option<Sender<Job>>,
    done: Receiver<Done>,
    is_over: Arc<AtomicBool>,
    handle: Option<JoinHandle<()>>,
}

impl<Job: Send + 'static, Done: Send + 'static> Worker<Job, Done> {
    pub(crate) fn new(name: &'static str, work: impl Fn(Job) -> Done + Send + Sync + 'static) -> Self {
        let (work, done_here) = (Arc::new(work), VecDeque::new());
        Self {
            name,
            work,
            thread: None,
            has_no_thread: false,
            has_low_priority: false,
            done_here,
            in_flight: 0,
        }
    }

    /// Runs the jobs at low priority.
    pub(crate) fn with_low_priority(self) -> Self {
        Self { has_low_priority: true, ..self }
    }

    /// Number of submitted jobs whose result was not taken yet.
    pub(crate) fn in_flight(&self) -> usize {
        self.in_flight
    }

    pub(crate) fn give(&mut self, job: Job) {
        self.in_flight += 1;
        if self.thread.is_none() && !self.has_no_thread {
            self.start();
        }
        let jobs = self.thread.as_ref().and_then(|thread| thread.jobs.as_ref());
        let left = match jobs {
            Some(jobs) => jobs.send(job).err().map(|lost| lost.0),
            None => Some(job),
        };
        if let Some(job) = left {
            self.done_here.push_back((self.work)(job));
        }
    }

    /// Returns a result, if one is available.
    pub(crate) fn take(&mut self) -> Option<Done> {
        let there = self.thread.as_ref().and_then(|thread| thread.done.try_recv().ok());
        let done = there.or_else(|| self.done_here.pop_front())?;
        self.in_flight -= 1;
        Some(done)
    }

    /// Waits for the next result; `None` if there are no jobs.
    pub(crate) fn wait(&mut self) -> Option<Done> {
        if self.in_flight > self.done_here.len()
            && let Some(thread) = &self.thread
        {
            match thread.done.recv() {
                Ok(done) => {
                    self.in_flight -= 1;
                    return Some(done);
                }
                Err(_) => {
                    // A thread that panicked loses its jobs.
                    self.thread = None;
                    self.in_flight = self.done_here.len();
                }
            }
        }
        self.take()
    }

    fn start(&mut self) {
        let (jobs, jobs_in) = channel::<Job>();
        let (done_out, done) = channel();
        let is_over = Arc::new(AtomicBool::new(false));
        let (work, is_over_there, has_low_priority) =
            (self.work.clone(), is_over.clone(), self.has_low_priority);
        let handle = thread::Builder::new().name(self.name.to_owned()).spawn(move || {
            if has_low_priority {
                lower_priority();
            }
            for job in jobs_in {
                if is_over_there.load(Ordering::Relaxed) || done_out.send(work(job)).is_err() {
                    return;
                }
            }
        });
        match handle {
            Ok(handle) => {
                self.thread = Some(Thread { jobs: Some(jobs), done, is_over, handle: Some(handle) });
            }
            Err(error) => {
                log::warn!(
                    "cannot start a thread for {}; its work runs on the caller's thread: {error}",
                    self.name
                );
                self.has_no_thread = true;
            }
        }
    }
}

impl<Job, Done> Drop for Thread<Job, Done> {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        self.jobs = None;
        if let Some(handle) = self.handle.take() {
            // The thread may have panicked.
            let _ = handle.join();
        }
    }
}

impl<Job, Done> fmt::Debug for Worker<Job, Done> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, in_flight, .. } = self;
        f.debug_struct("Worker").field("name", name).field("in_flight", in_flight).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicUsize;
    use std::time::Duration;

    #[test]
    fn jobs_run_in_order() {
        let mut worker = Worker::new("doubling", |number: u32| 2 * number);
        assert_eq!(worker.wait(), None);
        (0..100).for_each(|number| worker.give(number));
        assert_eq!(worker.in_flight(), 100);
        let done: Vec<u32> = std::iter::from_fn(|| worker.wait()).collect();
        assert_eq!(done, (0..100).map(|number| 2 * number).collect::<Vec<_>>());
        assert_eq!((worker.in_flight(), worker.take()), (0, None));
    }

    #[test]
    fn without_a_thread_jobs_run_on_the_caller() {
        let mut worker = Worker::new("doubling", |number: u32| 2 * number);
        worker.has_no_thread = true;
        (0..5).for_each(|number| worker.give(number));
        assert_eq!(worker.done_here, [0, 2, 4, 6, 8]);
        assert_eq!((worker.take(), worker.wait(), worker.in_flight()), (Some(0), Some(2), 3));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn only_a_low_priority_worker_runs_below_its_owner() {
        let niceness = || rustix::process::getpriority_process(None).unwrap();
        let own = niceness();
        let mut equal = Worker::new("equal", move |()| niceness());
        let mut behind = Worker::new("behind", move |()| niceness()).with_low_priority();
        equal.give(());
        behind.give(());
        assert_eq!((equal.wait(), niceness()), (Some(own), own));
        assert_eq!(behind.wait(), Some((own + 10).min(19)));
    }

    #[test]
    fn dropping_does_not_wait_for_jobs_not_started() {
        let count = Arc::new(AtomicUsize::new(0));
        let counted = count.clone();
        let mut worker = Worker::new("slow", move |()| {
            counted.fetch_add(1, Ordering::Relaxed);
            thread::sleep(Duration::from_millis(20));
        });
        (0..1_000).for_each(|_| worker.give(()));
        drop(worker);
        assert!(count.load(Ordering::Relaxed) < 1_000);
    }

    #[test]
    fn waiting_for_a_panicked_thread_returns() {
        let mut worker = Worker::new("failing", |fails: bool| assert!(!fails));
        worker.give(true);
        while worker.wait().is_some() {}
        assert_eq!(worker.in_flight(), 0);
        worker.give(false);
        assert_eq!(worker.wait(), Some(()));
    }
}
