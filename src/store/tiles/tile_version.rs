use super::file_checksum::FileChecksum;
use crate::space::{TileValue, put_number, skip_numbers, take_number, take_u32};
use crate::store::layout::TileFile;

/// Version of a tile in the log: identifies its files, and has its voxel counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TileVersion {
    /// Number of the last scan in the map when the version was written.
    pub scan_number: u64,
    /// File of the table: `iwlo_meta.bin`, or `tile.vxt` with compact storage.
    pub table: FileChecksum,
    /// `octree.bt`; zero with compact storage, which has no octree file.
    pub octree: FileChecksum,
    /// Number of observed voxels.
    pub voxels: u64,
    /// Number of occupied voxels.
    pub occupied: u64,
}

/// Highest valid number of a scan or flush. Numbers below it can be incremented without overflow.
pub(crate) const MAX_NUMBER: u64 = 1 << 62;

impl TileVersion {
    pub(in crate::store) const BYTES: usize = 48;

    /// Returns the checksum of one of the tile's files.
    pub const fn of(&self, file: TileFile) -> FileChecksum {
        match file {
            TileFile::Table => self.table,
            TileFile::Octree => self.octree,
        }
    }

    pub(in crate::store) fn to_bytes(self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        bytes[0..8].copy_from_slice(&self.scan_number.to_le_bytes());
        bytes[8..16].copy_from_slice(&self.table.bytes.to_le_bytes());
        bytes[16..20].copy_from_slice(&self.table.crc.to_le_bytes());
        bytes[20..28].copy_from_slice(&self.octree.bytes.to_le_bytes());
        bytes[28..32].copy_from_slice(&self.octree.crc.to_le_bytes());
        bytes[32..40].copy_from_slice(&self.voxels.to_le_bytes());
        bytes[40..48].copy_from_slice(&self.occupied.to_le_bytes());
        bytes
    }

    /// Returns `None` for impossible numbers. The limits also keep sums over all tiles of a map in range.
    pub(in crate::store) fn from_bytes(bytes: &[u8; Self::BYTES]) -> Option<Self> {
        const MAX_FILE_BYTES: u64 = 1 << 36;
        const MAX_VOXELS: u64 = 1 << 30;
        let version = Self::from_any_bytes(bytes);
        let is_possible = version.scan_number <= MAX_NUMBER
            && version.table.bytes <= MAX_FILE_BYTES
            && version.octree.bytes <= MAX_FILE_BYTES
            && version.occupied <= version.voxels
            && version.voxels <= MAX_VOXELS;
        is_possible.then_some(version)
    }

    fn from_any_bytes(bytes: &[u8; Self::BYTES]) -> Self {
        let u32_at = |at: usize| u32::from_le_bytes(std::array::from_fn(|k| bytes[at + k]));
        let u64_at = |at: usize| u64::from_le_bytes(std::array::from_fn(|k| bytes[at + k]));
        Self {
            scan_number: u64_at(0),
            table: FileChecksum { bytes: u64_at(8), crc: u32_at(16) },
            octree: FileChecksum { bytes: u64_at(20), crc: u32_at(28) },
            voxels: u64_at(32),
            occupied: u64_at(40),
        }
    }
}

impl TileValue for TileVersion {
    fn pack(self, before: Self, out: &mut Vec<u8>) {
        put_number(self.scan_number.wrapping_sub(before.scan_number) as i64, out);
        for file in [self.table, self.octree] {
            put_number(file.bytes, out);
            out.extend_from_slice(&file.crc.to_le_bytes());
        }
        put_number(self.voxels, out);
        put_number(self.occupied, out);
    }

    fn unpack(before: Self, input: &mut &[u8]) -> Self {
        let scan_number = before.scan_number.wrapping_add(take_number::<i64>(input) as u64);
        let file = |input: &mut &[u8]| {
            let bytes = take_number(input);
            FileChecksum { bytes, crc: take_u32(input) }
        };
        let (table, octree) = (file(input), file(input));
        Self { scan_number, table, octree, voxels: take_number(input), occupied: take_number(input) }
    }

    fn skip(input: &mut &[u8]) {
        skip_numbers(2, input);
        take_u32(input);
        skip_numbers(1, input);
        take_u32(input);
        skip_numbers(2, input);
    }
}
