use anyhow::Context;
use std::io;
use std::num::NonZero;
use std::sync::mpsc::{Sender, channel};
use std::thread::{self, available_parallelism};

/// Starts the threads that scans are mapped with: so many, or one a core, or as many as the system gives; where it
/// gives none, this one does all the work.
///
/// They are there before the pool is told of them. A pool that asks for a thread itself and gets none is no pool for
/// the rest of the process.
pub fn start(most: Option<u16>) -> anyhow::Result<()> {
    let wanted = most.map_or_else(default_threads, usize::from);
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

/// What rayon takes unless something else is asked for.
fn default_threads() -> usize {
    let asked_for = std::env::var("RAYON_NUM_THREADS").ok().and_then(|number| number.parse().ok());
    let cores = || available_parallelism().map_or(1, NonZero::get);
    asked_for.filter(|&number| (1..=1024).contains(&number)).unwrap_or_else(cores)
}
