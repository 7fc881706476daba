use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Name of a snapshot and of its file: 1 to 64 characters of `A-Z a-z 0-9 . _ -`, not starting with a dot. `now` is
/// reserved for the current map.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct SnapshotName(String);

/// Reserved name of the current map.
const NOW: &str = "now";

impl SnapshotName {
    /// Validates a name.
    ///
    /// # Errors
    ///
    /// An invalid name.
    pub fn new(name: impl Into<String>) -> Result<Self> {
        const MAX_LETTERS: usize = 64;
        let name = name.into();
        let is_letter = |letter: u8| letter.is_ascii_alphanumeric() || b"._-".contains(&letter);
        let is_good = (1..=MAX_LETTERS).contains(&name.len())
            && name.bytes().all(is_letter)
            && !name.starts_with('.')
            && name != NOW;
        if is_good {
            return Ok(Self(name));
        }
        let reason = format!(
            "{name:?} is not a valid snapshot name; use 1 to {MAX_LETTERS} characters of A-Z a-z 0-9 . _ -, not \
             starting with a dot; {NOW:?} is reserved for the current map"
        );
        Err(Error::argument("snapshot", reason))
    }

    /// Returns the name as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl FromStr for SnapshotName {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::new(name)
    }
}

impl TryFrom<String> for SnapshotName {
    type Error = Error;

    fn try_from(name: String) -> Result<Self> {
        Self::new(name)
    }
}

impl From<SnapshotName> for String {
    fn from(name: SnapshotName) -> Self {
        name.0
    }
}

impl fmt::Display for SnapshotName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_safe_file_names_are_accepted() {
        for good in ["a", "before-lunch", "2026.11.21_a", "-", "a.next", &"x".repeat(64)] {
            assert_eq!(SnapshotName::new(good).unwrap().as_str(), good);
        }
        for bad in ["", ".", "..", ".next", "a/b", "a\\b", "a b", "a@b", "ä", "now", "a\0", &"x".repeat(65)]
        {
            assert!(
                SnapshotName::new(bad).unwrap_err().to_string().contains("not a valid snapshot name"),
                "{bad:?}"
            );
        }
    }
}
