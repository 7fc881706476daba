use anyhow::Context;
use std::io;
use std::num::NonZero;
use std::sync::mpsc::{Sender, channel};
use std::thread::{self, available_parallelism};

/// Starts the mapping threads: `count`, or one per core, or as many as the system allows. If it allows none, the
/// current thread does all the work.
///
/// The threads start before rayon's pool is built. If rayon itself failed to start a thread, its pool would be unusable
/// for the rest of the process.
pub fn start(count: Option<u16>) -> anyhow::Result<()> {
    let wanted = count.map_or_else(default_threads, usize::from);
    let mut waiting: Vec<Sender<rayon::ThreadBuilder>> = Vec::new();
    for number in 0..wanted {
        let (work, work_in) = channel::<rayon::ThreadBuilder>();
        let body = move || {
            if let Ok(thread) = work_in.recv() {
                thread.run();
            }
        };
        match thread::Builder::new().name(format!("voxtile-map-{number}")).spawn(body) {
            Ok(_) => waiting.push(work),
            Err(error) => {
                log::warn!("mapping with {} of {wanted} threads: {error}", waiting.len().max(1));
                break;
            }
        }
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(waiting.len().max(1));
    let started = if waiting.is_empty() {
        pool.use_current_thread().build_global()
    } else {
        let no_thread = || io::Error::other("no thread is waiting");
        let give = |thread| {
            let work = waiting.pop().ok_or_else(no_thread)?;
            work.send(thread).map_err(|_| no_thread())
        };
        pool.spawn_handler(give).build_global()
    };
    started.with_context(|| format!("cannot start {wanted} threads"))
}

/// Returns rayon's default number of threads.
fn default_threads() -> usize {
    let from_environment = std::env::var("RAYON_NUM_THREADS").ok().and_then(|number| number.parse().ok());
    let cores = || available_parallelism().map_or(1, NonZero::get);
    from_environment.filter(|&number| (1..=1024).contains(&number)).unwrap_or_else(cores)
}
