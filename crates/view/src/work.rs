use std::sync::Arc;
use tokio::sync::Semaphore;

/// Runs blocking work in threads, limited in number.
pub struct Work(Arc<Semaphore>);

impl Work {
    pub fn new(at_once: usize) -> Self {
        Self(Arc::new(Semaphore::new(at_once)))
    }

    /// Waits for a free thread; `None` if the server is stopping or the work panicked.
    pub async fn run<T: Send + 'static>(&self, work: impl FnOnce() -> T + Send + 'static) -> Option<T> {
        let permit = self.0.clone().acquire_owned().await.ok()?;
        // A thread cannot be cancelled: its slot remains in use until it ends, even without a receiver.
        let thread = tokio::task::spawn_blocking(move || {
            let done = work();
            drop(permit);
            done
        });
        thread.await.ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc;
    use std::time::Duration;
    use tokio::time::timeout;

    #[test]
    fn abandoned_work_keeps_its_slot_until_it_ends() {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let work = Work::new(1);
            let (begun, has_begun) = mpsc::channel();
            let (end, may_end) = mpsc::channel::<()>();
            let long = work.run(move || {
                begun.send(()).unwrap();
                may_end.recv().unwrap();
            });
            // The receiver is dropped.
            assert!(timeout(Duration::from_millis(50), long).await.is_err());
            has_begun.recv().unwrap();
            assert!(timeout(Duration::from_millis(50), work.run(|| 1)).await.is_err(), "two at once");
            end.send(()).unwrap();
            assert_eq!(work.run(|| 2).await, Some(2));
            // Panicked work releases its slot.
            assert_eq!(work.run(|| panic!("on purpose")).await, None::<u8>);
            assert_eq!(work.run(|| 3).await, Some(3));
        });
    }
}
