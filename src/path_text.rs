//! Paths in JSON, for the command too.

use serde::Serializer;
use std::path::Path;

/// A path as text, which is all that JSON knows: what is not UTF-8 becomes a replacement character.
///
/// # Errors
///
/// Those of the serializer.
pub fn serialize<P: AsRef<Path>, S: Serializer>(path: &P, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&path.as_ref().display())
}
