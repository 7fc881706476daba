use crate::logging::print_message;
use crate::run::INTERRUPTED;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use signal_hook::iterator::Signals;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, OnceLock};
use std::thread;
use std::time::{Duration, Instant};
use voxtile::scan::Stop;
use voxtile_pipeline::place::{stop_buckets_with, url_of};

/// Ignore a second signal within this time: a shell and its child may both send the same one.
const GRACE: Duration = Duration::from_millis(500);

/// Stop flag of the caught signals.
static STOP: OnceLock<Stop> = OnceLock::new();

/// Catches Ctrl-C and SIGTERM. The first signal requests a stop and logs what a second one would lose; the second exits
/// the process at once.
///
/// A separate thread waits for the signals, so that other work cannot delay the response.
pub fn catch() -> anyhow::Result<Stop> {
    catch_with_messages(
        "stopping after a flush of the scans so far; a second Ctrl-C or SIGTERM stops at once and loses them",
        "stopped at once: scans since the last flush are not in the map",
    )
}

/// Same as `catch`, for changes that are applied completely or not at all.
pub fn catch_undone() -> anyhow::Result<Stop> {
    catch_with_messages("stopping; the map does not change", "stopped at once; the map has not changed")
}

/// Same as `catch`, for output that is written next to its final path and renamed at the end.
pub fn catch_unfinished() -> anyhow::Result<Stop> {
    catch_with_messages(
        "stopping; the output does not change",
        "stopped at once; the output has not changed, but a temporary file or folder may remain next to it",
    )
}

/// Same as `catch`, for reading. If all scans are on this machine, there is nothing to remove and signals keep their
/// default action.
pub fn catch_if_fetched(scans: &[PathBuf]) -> anyhow::Result<Stop> {
    match scans.iter().find_map(|scans| url_of(scans)) {
        Some(_) => catch_with_messages(
            "stopping after removing the downloaded files",
            "stopped at once; the downloaded files remain",
        ),
        None => Ok(Stop::default()),
    }
}

fn catch_with_messages(first_message: &'static str, second_message: &'static str) -> anyhow::Result<Stop> {
    let stop = STOP.get_or_init(Stop::default).clone();
    stop_buckets_with(&stop);
    let mut signals = Signals::new([SIGINT, SIGTERM])?;
    let stop_flag = stop.clone();
    let handle = move || {
        let mut first: Option<Instant> = None;
        for _ in signals.forever() {
            match first {
                None => {
                    first = Some(Instant::now());
                    stop_flag.set();
                    print_message(format_args!("{first_message}"));
                }
                Some(first) if first.elapsed() < GRACE => {}
                Some(_) => {
                    print_message(format_args!("{second_message}"));
                    std::process::exit(i32::from(INTERRUPTED));
                }
            }
        }
    };
    if let Err(error) = thread::Builder::new().name("voxtile-signals".to_owned()).spawn(handle) {
        log::warn!("cannot start the signal thread, stopping may take longer: {error}");
        catch_without_thread(&stop)?;
    }
    Ok(stop)
}

/// Sets the stop flag at the first signal, without a message; the second exits the process.
fn catch_without_thread(stop: &Stop) -> anyhow::Result<()> {
    let stop_flag: Arc<AtomicBool> = stop.flag();
    for signal in [SIGINT, SIGTERM] {
        flag::register_conditional_shutdown(signal, i32::from(INTERRUPTED), stop_flag.clone())?;
        flag::register(signal, stop_flag.clone())?;
    }
    Ok(())
}
