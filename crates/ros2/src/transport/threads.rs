use anyhow::Context as _;
use std::thread::JoinHandle;

/// Starts a thread.
///
/// # Errors
///
/// The system provides no thread.
pub fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> anyhow::Result<JoinHandle<()>> {
    std::thread::Builder::new().name(name.to_owned()).spawn(work).context("cannot start a thread")
}
