use serde::Serializer;
use std::path::Path;

/// A path in JSON, which knows only text: what is not UTF-8 becomes a replacement character.
pub fn serialize<P: AsRef<Path>, S: Serializer>(path: &P, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&path.as_ref().display())
}
