//! What tests of several crates need.

use std::path::{Path, PathBuf};

/// What an operation that must fail says, with its cause.
pub fn message_of<T>(result: voxtile::Result<T>) -> String {
    match result {
        Ok(_) => panic!("it should have failed"),
        Err(error) => format!("{error:#}"),
    }
}

/// Whether tests take every case, and not the sample that a run of all tests takes: the environment says
/// `VOXTILE_TESTS=all`. Some ten minutes with optimised code.
fn is_every_case() -> bool {
    std::env::var_os("VOXTILE_TESTS").is_some_and(|wanted| wanted == "all")
}

/// The number of random cases: a few, or all where `VOXTILE_TESTS=all`.
pub fn cases(few: u64, all: u64) -> u64 {
    if is_every_case() { all } else { few }
}

/// One in so many of the moments at which something may go wrong, spread without a pattern; all of them where
/// `VOXTILE_TESTS=all`.
pub fn some_of<T>(moments: impl IntoIterator<Item = T>, one_in: u64) -> impl Iterator<Item = T> {
    let one_in = cases(one_in, 1);
    // Fibonacci hashing (Knuth): neighbours land far from each other.
    let is_taken =
        move |number: u64| (number.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40).is_multiple_of(one_in);
    (0..).zip(moments).filter(move |(number, _)| is_taken(*number)).map(|(_, moment)| moment)
}

/// A path in the repository.
pub fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}

/// A folder of small files that are in the repository.
pub fn fixtures(folder: &str) -> PathBuf {
    repository("tests/data").join(folder)
}

/// A folder of the data that is too large for the repository: under `$VOXTILE_DATA`, by default `../shared/data`
/// beside the repository. `None`, after saying so, where it is absent.
pub fn shared_data(folder: &str) -> Option<PathBuf> {
    let root = std::env::var_os("VOXTILE_DATA").map_or_else(|| repository("../shared/data"), PathBuf::from);
    let path = root.join(folder);
    if path.is_dir() {
        return Some(path);
    }
    println!("skipped: there is no {} (VOXTILE_DATA may name another folder)", path.display());
    None
}
