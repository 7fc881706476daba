//! Helpers of the tests of several crates.

use std::path::{Path, PathBuf};

/// Message of an operation that must fail, with its causes.
pub fn message_of<T>(result: voxtile::Result<T>) -> String {
    match result {
        Ok(_) => panic!("it should have failed"),
        Err(error) => format!("{error:#}"),
    }
}

/// Returns whether tests run all cases instead of a sample (`VOXTILE_TESTS=all`); about ten minutes with optimised
/// code.
fn is_every_case() -> bool {
    std::env::var_os("VOXTILE_TESTS").is_some_and(|wanted| wanted == "all")
}

/// Number of random cases: `few`, or `all` with `VOXTILE_TESTS=all`.
pub fn cases(few: u64, all: u64) -> u64 {
    if is_every_case() { all } else { few }
}

/// A sample of about one in `one_in` moments at which a fault may occur, spread irregularly; all of them with
/// `VOXTILE_TESTS=all`.
pub fn some_of<T>(moments: impl IntoIterator<Item = T>, one_in: u64) -> impl Iterator<Item = T> {
    let one_in = cases(one_in, 1);
    // Fibonacci hashing (Knuth) spreads consecutive numbers.
    let is_taken =
        move |number: u64| (number.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40).is_multiple_of(one_in);
    (0..).zip(moments).filter(move |(number, _)| is_taken(*number)).map(|(_, moment)| moment)
}

/// A path in the repository.
pub fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}

/// A folder of small test files in the repository.
pub fn fixtures(folder: &str) -> PathBuf {
    repository("tests/data").join(folder)
}

/// A folder of test data that is too large for the repository: below `$VOXTILE_DATA`, by default `../shared/data` next
/// to the repository. Prints a line and returns `None` if it is missing.
pub fn shared_data(folder: &str) -> Option<PathBuf> {
    let root = std::env::var_os("VOXTILE_DATA").map_or_else(|| repository("../shared/data"), PathBuf::from);
    let path = root.join(folder);
    if path.is_dir() {
        return Some(path);
    }
    println!("skipped: {} is missing (set VOXTILE_DATA to use another folder)", path.display());
    None
}
