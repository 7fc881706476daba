use crate::error::FormatError;
use crate::space::TileIndex;

/// Length of the trailer in bytes.
pub const TRAILER_BYTES: usize = 64;

/// "VXTR", little-endian.
const MAGIC: u32 = 0x5254_5856;
const VERSION: u32 = 1;

/// What stands after the last entry of `iwlo_meta.bin`: which map, tile and moment the file belongs to, and
/// checksums of both files of the tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Trailer {
    /// Id of the map.
    pub map_id: [u8; 16],
    /// Which tile.
    pub tile: TileIndex,
    /// Number of the last scan that the map had taken when the file was written.
    pub scan_number: u64,
    /// CRC-32 of header and entries.
    pub table_crc: u32,
    /// CRC-32 of the tile's `octree.bt`.
    pub octree_crc: u32,
    /// Length of the tile's `octree.bt` in bytes.
    pub octree_bytes: u64,
}

impl Trailer {
    /// The trailer as bytes, the last four a CRC-32 of those before.
    pub fn to_bytes(&self) -> [u8; TRAILER_BYTES] {
        let mut bytes = [0; TRAILER_BYTES];
        bytes[0..4].copy_from_slice(&MAGIC.to_le_bytes());
        bytes[4..8].copy_from_slice(&VERSION.to_le_bytes());
        bytes[8..24].copy_from_slice(&self.map_id);
        for (axis, index) in self.tile.to_array().into_iter().enumerate() {
            bytes[24 + 4 * axis..28 + 4 * axis].copy_from_slice(&index.to_le_bytes());
        }
        bytes[36..44].copy_from_slice(&self.scan_number.to_le_bytes());
        bytes[44..48].copy_from_slice(&self.table_crc.to_le_bytes());
        bytes[48..52].copy_from_slice(&self.octree_crc.to_le_bytes());
        bytes[52..60].copy_from_slice(&self.octree_bytes.to_le_bytes());
        let crc = crc32fast::hash(&bytes[..60]);
        bytes[60..].copy_from_slice(&crc.to_le_bytes());
        bytes
    }

    /// The trailer from its bytes, which begin at `offset` of the file.
    ///
    /// # Errors
    ///
    /// A wrong magic number, version or checksum.
    pub fn from_bytes(bytes: &[u8; TRAILER_BYTES], offset: u64) -> Result<Self, FormatError> {
        let u32_at = |at: usize| u32::from_le_bytes(std::array::from_fn(|k| bytes[at + k]));
        let u64_at = |at: usize| u64::from_le_bytes(std::array::from_fn(|k| bytes[at + k]));
        if u32_at(60) != crc32fast::hash(&bytes[..60]) {
            return Err(FormatError::at_offset(offset, "the trailer does not match its checksum"));
        }
        if (u32_at(0), u32_at(4)) != (MAGIC, VERSION) {
            return Err(FormatError::at_offset(offset, "no trailer of version 1 after the last entry"));
        }
        Ok(Self {
            map_id: std::array::from_fn(|k| bytes[8 + k]),
            tile: TileIndex::new(u32_at(24) as i32, u32_at(28) as i32, u32_at(32) as i32),
            scan_number: u64_at(36),
            table_crc: u32_at(44),
            octree_crc: u32_at(48),
            octree_bytes: u64_at(52),
        })
    }
}
