use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

/// Name of an object: the BLAKE3 of its content, as 64 hexadecimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct ObjectName(blake3::Hash);

/// Folder of all objects except the manifest.
pub(super) const OBJECTS: &str = "objects";

impl ObjectName {
    /// Returns the name of an object with this content.
    pub(super) fn of(content: &[u8]) -> Self {
        Self(blake3::hash(content))
    }

    /// Parses the digits of a name; `None` for any other text.
    pub(super) fn from_digits(digits: &str) -> Option<Self> {
        let name = Self(blake3::Hash::from_hex(digits).ok()?);
        (name.to_string() == digits).then_some(name)
    }

    /// Returns the key of the object below the map's prefix.
    pub(super) fn key(self) -> String {
        format!("{OBJECTS}/{self}")
    }
}

impl fmt::Display for ObjectName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.to_hex())
    }
}

impl Serialize for ObjectName {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for ObjectName {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let digits = String::deserialize(deserializer)?;
        let wanted = "an object's name must be 64 hexadecimal digits";
        Self::from_digits(&digits).ok_or_else(|| serde::de::Error::custom(wanted))
    }
}
