//! File of one tile of a field.
//!
//! ```text
//! "VXDIST\0\1"   magic and version
//! 3 * i32        index of the tile
//! u32            voxels along an edge
//! u64            key
//! u64            length of the rest
//! u32            CRC-32 of the file without this number
//! rest           zstd: second differences along x of the stored distances, the low bytes of all, then the high bytes
//! ```
//!
//! All numbers are little-endian. Squared distances are parabolas along x, so their second differences are mostly
//! constant.

use super::tile_key::TileKey;
use std::io::Read;
use voxtile::{FormatError, TileIndex};

const MAGIC: [u8; 8] = *b"VXDIST\0\x01";
const HEADER_BYTES: usize = 44;
const CRC_AT: usize = 40;
/// Fast, and the second differences compress well at any level.
const ZSTD_LEVEL: i32 = 1;

/// Stored distances of a tile: by z, then y, then x.
pub(super) type TileDistances = Vec<i16>;

/// Encodes a tile.
pub(super) fn encode(
    tile: TileIndex,
    edge: usize,
    key: TileKey,
    distances: &[i16],
) -> std::io::Result<Vec<u8>> {
    let mut bytes = vec![0; 2 * distances.len()];
    let (low, high) = bytes.split_at_mut(distances.len());
    let out = low.chunks_mut(edge).zip(high.chunks_mut(edge));
    for (row, (low, high)) in distances.chunks(edge).zip(out) {
        let mut before = [0_i16; 2];
        for ((value, low), high) in row.iter().zip(low).zip(high) {
            let [last, earlier] = before;
            let difference = value.wrapping_sub(last).wrapping_sub(last.wrapping_sub(earlier));
            [*low, *high] = difference.to_le_bytes();
            before = [*value, last];
        }
    }
    let packed = zstd::bulk::compress(&bytes, ZSTD_LEVEL)?;
    let mut file = Vec::with_capacity(HEADER_BYTES + packed.len());
    file.extend(MAGIC);
    file.extend(tile.to_array().map(i32::to_le_bytes).as_flattened());
    file.extend((edge as u32).to_le_bytes());
    file.extend(key.to_le_bytes());
    file.extend((packed.len() as u64).to_le_bytes());
    file.extend([0; 4]);
    file.extend(packed);
    let crc = checksum(&file);
    file[CRC_AT..HEADER_BYTES].copy_from_slice(&crc.to_le_bytes());
    Ok(file)
}

/// Checks that a file is complete and belongs to a tile and key.
///
/// # Errors
///
/// Fails with the position and the problem.
pub(super) fn check(file: &[u8], tile: TileIndex, edge: usize, key: TileKey) -> Result<(), FormatError> {
    let damaged = |at: usize, reason: &str| {
        Err(FormatError::at_offset(
            at as u64,
            format!("{reason}; run `voxtile distance` again to replace the tile"),
        ))
    };
    if file.len() < HEADER_BYTES {
        return damaged(file.len(), "the file ends in its header");
    }
    if file[..8] != MAGIC {
        return damaged(0, "this is no tile of a distance field, or of another version");
    }
    let mut expected = Vec::with_capacity(CRC_AT);
    expected.extend(MAGIC);
    expected.extend(tile.to_array().map(i32::to_le_bytes).as_flattened());
    expected.extend((edge as u32).to_le_bytes());
    expected.extend(key.to_le_bytes());
    expected.extend(((file.len() - HEADER_BYTES) as u64).to_le_bytes());
    if let Some(at) = (8..CRC_AT).find(|&at| file[at] != expected[at]) {
        return damaged(at, "tile, key or length differ from those of the field");
    }
    if file[CRC_AT..HEADER_BYTES] != checksum(file).to_le_bytes() {
        return damaged(CRC_AT, "the checksum is wrong");
    }
    Ok(())
}

/// Decodes a file after [`check`].
///
/// # Errors
///
/// Fails with the position and the problem.
pub(super) fn decode(file: &[u8], edge: usize) -> Result<TileDistances, FormatError> {
    let broken = |reason: String| FormatError::at_offset(HEADER_BYTES as u64, reason);
    let count = edge * edge * edge;
    let mut bytes = Vec::new();
    let decoder = zstd::stream::Decoder::new(&file[HEADER_BYTES.min(file.len())..]);
    let decoder = decoder.map_err(|error| broken(error.to_string()))?;
    // Grows with the content, so a wrong length allocates nothing.
    let read = decoder.take(2 * count as u64 + 1).read_to_end(&mut bytes);
    read.map_err(|error| broken(error.to_string()))?;
    if bytes.len() != 2 * count {
        return Err(broken(format!("{} bytes of distances, not {}", bytes.len(), 2 * count)));
    }
    let (low, high) = bytes.split_at(count);
    let mut distances = vec![0; count];
    let rows = distances.chunks_mut(edge).zip(low.chunks(edge).zip(high.chunks(edge)));
    for (row, (low, high)) in rows {
        let mut before = [0_i16; 2];
        for ((value, low), high) in row.iter_mut().zip(low).zip(high) {
            let [last, earlier] = before;
            let difference = i16::from_le_bytes([*low, *high]);
            *value = difference.wrapping_add(last).wrapping_add(last.wrapping_sub(earlier));
            before = [*value, last];
        }
    }
    Ok(distances)
}

fn checksum(file: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&file[..CRC_AT]);
    hasher.update(&file[HEADER_BYTES..]);
    hasher.finalize()
}
