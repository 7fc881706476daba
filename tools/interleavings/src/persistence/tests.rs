use super::worker::Worker;
use crate::in_many_orders;
use shuttle::sync::Arc;
use shuttle::sync::atomic::{AtomicUsize, Ordering};
use shuttle::thread;

/// Tiles come back in the order in which they were sent, whether they are waited for or taken when they are there.
#[test]
fn what_is_given_comes_back_once_and_in_order() {
    in_many_orders(|| {
        let mut worker = Worker::new("doubling", |number: u32| 2 * number);
        let mut came = Vec::new();
        for number in 0..4 {
            worker.give(number);
            came.extend(worker.take());
            if number == 2 {
                came.extend(worker.wait());
            }
        }
        while let Some(done) = worker.wait() {
            came.push(done);
        }
        assert_eq!(came, [0, 2, 4, 6]);
        assert_eq!((worker.in_flight(), worker.take()), (0, None));
    });
}

/// Two threads that carry beside each other, for an owner that goes away in the middle: nobody waits for ever, and
/// nothing is done after that.
#[test]
fn an_owner_that_goes_away_leaves_nothing_running() {
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
