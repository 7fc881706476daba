use crate::store::tiles::file_checksum::FileChecksum;
use serde::{Deserialize, Serialize};

/// The catalog of kept scans as of a flush: a file, and how far it counts. Later flushes append to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct CatalogVersion {
    /// The number in its name; 0 where the map keeps its scans and has no catalog yet.
    pub generation: u64,
    /// How many of its bytes count.
    pub bytes: u64,
    /// CRC-32 of these bytes.
    pub crc32: u32,
}

impl CatalogVersion {
    /// That of a map without a catalog.
    pub const NONE: Self = Self { generation: 0, bytes: 0, crc32: 0 };
    /// Length in a record of the log.
    pub(in crate::store) const BYTES: usize = 20;

    /// Whether a record of a flush can be among those that a flush sees: they are as old as the catalog at most. One
    /// that a repair gave a snapshot is of one flush.
    pub(super) fn has_flush(self, flush_number: u64, last: u64) -> bool {
        (self.generation..=last.max(self.generation)).contains(&flush_number)
    }

    /// Length and checksum of the bytes that count.
    pub(super) fn checksum(self) -> FileChecksum {
        FileChecksum { bytes: self.bytes, crc: self.crc32 }
    }

    /// Whether there is a catalog.
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
