use crate::run::INTERRUPTED;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use signal_hook::iterator::Signals;
use std::io::Write;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, OnceLock};
use std::thread;
use std::time::{Duration, Instant};
use voxtile::scan::Stop;
use voxtile_pipeline::place::{stop_buckets_with, url_of};

/// A signal so soon after the first is no second one: a shell and what runs in it may both send one.
const GRACE: Duration = Duration::from_millis(500);

/// The stop of the signals that are caught.
static ASKED: OnceLock<Stop> = OnceLock::new();

/// Catches Ctrl-C and SIGTERM. The first asks to stop and says what a second will lose; the second ends the process at
/// once.
///
/// A thread of its own waits for them, so that nothing else that goes on keeps it from answering.
pub fn catch() -> anyhow::Result<Stop> {
    catch_saying(
        "stopping: what is mapped so far is made durable first; a second Ctrl-C or SIGTERM ends at once and loses what is not",
        "ended at once: scans since the last flush are not in the map",
    )
}

/// The same for work that is done as a whole or not at all.
pub fn catch_undone() -> anyhow::Result<Stop> {
    catch_saying("stopping: the map stays as it was", "ended at once: the map is as it was")
}

/// The same for a file or folder that is made beside its place, and takes it at the end.
pub fn catch_unfinished() -> anyhow::Result<Stop> {
    catch_saying(
        "stopping: the output stays as it was",
        "ended at once: the output is as it was; a temporary file or folder beside it may stay",
    )
}

/// The same for work that only reads. Where that is the files of a folder, nothing is to be removed in the end, and
/// signals do what they always do.
pub fn catch_if_fetched(scans: &Path) -> anyhow::Result<Stop> {
    match url_of(scans) {
        Some(_) => catch_saying(
            "stopping: what was fetched is removed first",
            "ended at once: what was fetched stays",
        ),
        None => Ok(Stop::default()),
    }
}

fn catch_saying(first_answer: &'static str, second_answer: &'static str) -> anyhow::Result<Stop> {
    let stop = ASKED.get_or_init(Stop::default).clone();
    stop_buckets_with(&stop);
    let mut signals = Signals::new([SIGINT, SIGTERM])?;
    let asked = stop.clone();
    let answer = move || {
        let mut first: Option<Instant> = None;
        for _ in signals.forever() {
            match first {
                None => {
                    first = Some(Instant::now());
                    asked.set();
                    say(first_answer);
                }
                Some(first) if first.elapsed() < GRACE => {}
                Some(_) => {
                    say(second_answer);
                    std::process::exit(i32::from(INTERRUPTED));
                }
            }
        }
    };
    if let Err(error) = thread::Builder::new().name("voxtile-signals".to_owned()).spawn(answer) {
        log::warn!("no thread for signals, which are answered a little later: {error}");
        catch_without_thread(&stop)?;
    }
    Ok(stop)
}

/// The first signal asks to stop, unannounced; the second ends the process.
fn catch_without_thread(stop: &Stop) -> anyhow::Result<()> {
    let asked: Arc<AtomicBool> = stop.flag();
    for signal in [SIGINT, SIGTERM] {
        flag::register_conditional_shutdown(signal, i32::from(INTERRUPTED), asked.clone())?;
        flag::register(signal, asked.clone())?;
    }
    Ok(())
}

fn say(line: &str) {
    // Where nobody listens there is nothing else to do.
    writeln!(std::io::stderr(), "voxtile: {line}").unwrap_or_default();
}
