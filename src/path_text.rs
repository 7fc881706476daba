//! Serialization of paths to JSON, also for the command.

use serde::Serializer;
use std::path::Path;

/// Serializes a path as text. Bytes that are not UTF-8 become replacement characters.
///
/// # Errors
///
/// Errors of the serializer.
pub fn serialize<P: AsRef<Path>, S: Serializer>(path: &P, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&path.as_ref().display())
}
