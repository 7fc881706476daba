use crate::store::tiles::file_checksum::FileChecksum;
use serde::{Deserialize, Serialize};

/// Catalog of kept scans as of a flush: a file and the length of its valid part. Later flushes append to the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct CatalogVersion {
    /// Number in the file's name; 0 if the map keeps its scans but has no catalog yet.
    pub generation: u64,
    /// Length of the valid part in bytes.
    pub bytes: u64,
    /// CRC-32 of the valid part.
    pub crc32: u32,
}

impl CatalogVersion {
    /// Version of a map without a catalog.
    pub const NONE: Self = Self { generation: 0, bytes: 0, crc32: 0 };
    /// Length in a record of the log.
    pub(in crate::store) const BYTES: usize = 20;

    /// Returns whether this catalog, as of flush `last`, can contain records of a flush: from the flush that created
    /// the catalog, its generation, up to `last`. A catalog that repair wrote for a snapshot is newer than `last` and
    /// has only records of its generation.
    pub(super) fn has_flush(self, flush_number: u64, last: u64) -> bool {
        (self.generation..=last.max(self.generation)).contains(&flush_number)
    }

    pub(super) fn checksum(self) -> FileChecksum {
        FileChecksum { bytes: self.bytes, crc: self.crc32 }
    }

    pub(in crate::store) fn is_there(self) -> bool {
        self != Self::NONE
    }

    pub(in crate::store) fn to_bytes(self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        bytes[..8].copy_from_slice(&self.generation.to_le_bytes());
        bytes[8..16].copy_from_slice(&self.bytes.to_le_bytes());
        bytes[16..].copy_from_slice(&self.crc32.to_le_bytes());
        bytes
    }

    pub(in crate::store) fn from_bytes(bytes: [u8; Self::BYTES]) -> Self {
        let number = |at: usize| u64::from_le_bytes(std::array::from_fn(|k| bytes[at + k]));
        let crc32 = u32::from_le_bytes(std::array::from_fn(|k| bytes[16 + k]));
        Self { generation: number(0), bytes: number(8), crc32 }
    }
}
