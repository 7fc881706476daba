use std::fmt;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};

/// A thread that does one kind of work beside the one that maps, in the order in which it is given. It sleeps when
/// there is none, and ends with its owner: what was not begun by then is not done.
///
/// How much is under way at a time is for the owner to limit.
pub(super) struct SideWorker<Job, Done> {
    jobs: Option<Sender<Job>>,
    done: Receiver<Done>,
    under_way: usize,
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl<Job: Send + 'static, Done: Send + 'static> SideWorker<Job, Done> {
    /// Starts a thread.
    ///
    /// # Errors
    ///
    /// A system that gives none.
    pub(super) fn start(name: &str, work: impl Fn(Job) -> Done + Send + 'static) -> io::Result<Self> {
        let (jobs, jobs_in) = channel::<Job>();
        let (done_out, done) = channel();
        let is_over = Arc::new(AtomicBool::new(false));
        let is_over_there = is_over.clone();
        let thread = thread::Builder::new().name(name.to_owned()).spawn(move || {
            for job in jobs_in {
                if is_over_there.load(Ordering::Relaxed) || done_out.send(work(job)).is_err() {
                    return;
                }
            }
        })?;
        Ok(Self { jobs: Some(jobs), done, under_way: 0, is_over, thread: Some(thread) })
    }

    /// How many jobs were given of which the result was not taken.
    pub(super) fn under_way(&self) -> usize {
        self.under_way
    }

    /// Gives a job; back if the thread is gone.
    pub(super) fn give(&mut self, job: Job) -> Result<(), Job> {
        let Some(jobs) = &self.jobs else { return Err(job) };
        jobs.send(job).map_err(|lost| lost.0)?;
        self.under_way += 1;
        Ok(())
    }

    /// A result, if there is one already.
    pub(super) fn take(&mut self) -> Option<Done> {
        let done = self.done.try_recv().ok()?;
        self.under_way -= 1;
        Some(done)
    }

    /// The next result, waited for; `None` if none will come.
    pub(super) fn wait(&mut self) -> Option<Done> {
        if self.under_way == 0 {
            return None;
        }
        let done = self.done.recv().ok();
        self.under_way = if done.is_some() { self.under_way - 1 } else { 0 };
        done
    }
}

impl<Job, Done> Drop for SideWorker<Job, Done> {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        self.jobs = None;
        if let Some(thread) = self.thread.take() {
            // A thread that panicked is gone, too.
            let _ = thread.join();
        }
    }
}

impl<Job, Done> fmt::Debug for SideWorker<Job, Done> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SideWorker").field("under_way", &self.under_way).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_given_is_done_in_order_and_no_more_after_the_end() {
        let mut worker = SideWorker::start("doubling", |number: u32| 2 * number).unwrap();
        assert_eq!(worker.wait(), None);
        (0..100).for_each(|number| worker.give(number).unwrap());
        assert_eq!(worker.under_way(), 100);
        let done: Vec<u32> = std::iter::from_fn(|| worker.wait()).collect();
        assert_eq!(done, (0..100).map(|number| 2 * number).collect::<Vec<_>>());
        assert_eq!((worker.under_way(), worker.take()), (0, None));
    }

    #[test]
    fn dropping_does_not_wait_for_what_was_not_begun() {
        let count = Arc::new(std::sync::atomic::AtomicUsize::new(0));
        let counted = count.clone();
        let mut worker = SideWorker::start("slow", move |()| {
            counted.fetch_add(1, Ordering::Relaxed);
            thread::sleep(std::time::Duration::from_millis(20));
        })
        .unwrap();
        (0..1_000).for_each(|_| worker.give(()).unwrap());
        drop(worker);
        assert!(count.load(Ordering::Relaxed) < 1_000);
    }

    #[test]
    fn a_thread_that_is_gone_is_not_waited_for() {
        let mut worker = SideWorker::start("failing", |fails: bool| assert!(!fails)).unwrap();
        worker.give(true).unwrap();
        worker.give(false).ok();
        while worker.wait().is_some() {}
        assert_eq!(worker.under_way(), 0);
    }
}
