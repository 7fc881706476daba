use super::worker::Worker;
use crate::in_many_orders;
use shuttle::sync::Arc;
use shuttle::sync::atomic::{AtomicUsize, Ordering};
use shuttle::thread;

/// Results arrive in the order of the jobs, from both `wait` and `take`.
#[test]
fn each_job_returns_once_and_in_order() {
    in_many_orders(|| {
        let mut worker = Worker::new("doubling", |number: u32| 2 * number);
        let mut results = Vec::new();
        for number in 0..4 {
            worker.give(number);
            results.extend(worker.take());
            if number == 2 {
                results.extend(worker.wait());
            }
        }
        while let Some(done) = worker.wait() {
            results.push(done);
        }
        assert_eq!(results, [0, 2, 4, 6]);
        assert_eq!((worker.in_flight(), worker.take()), (0, None));
    });
}

/// Two concurrent workers whose owner drops them early: there is no deadlock, and no job runs after the drop.
#[test]
fn a_dropped_worker_runs_no_more_jobs() {
    in_many_orders(|| {
        let count = Arc::new(AtomicUsize::new(0));
        let worker = || {
            let count = count.clone();
            Worker::new("counting", move |by: usize| {
                thread::yield_now();
                count.fetch_add(by, Ordering::SeqCst)
            })
        };
        let (mut saver, mut loader) = (worker(), worker());
        for _ in 0..3 {
            saver.give(1);
            loader.give(100);
        }
        let first = saver.wait();
        assert!(first.is_some());
        drop(saver);
        drop(loader);
        let after = count.load(Ordering::SeqCst);
        thread::yield_now();
        assert_eq!(count.load(Ordering::SeqCst), after);
        assert!(after % 100 >= 1 && after % 100 <= 3 && after / 100 <= 3, "{after}");
    });
}
