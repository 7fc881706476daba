use super::ENTRY_BYTES;
use crate::sensor::Evidence;
use crate::space::{BRICK_VOXELS, BrickCode, MortonCode};
use crate::tile::Table;

/// Approximate size of a chunk in bytes.
const CHUNK_BYTES: usize = 1 << 16;

/// Maximum size of the entries of one brick in bytes.
const BRICK_BYTES: usize = BRICK_VOXELS * ENTRY_BYTES as usize;

/// Encodes the entries of a table in chunks of some bricks; a chunk passed to `take` contains complete entries.
///
/// # Errors
///
/// Returns the first error of `take`.
pub fn encode_entries<E>(table: &Table, mut take: impl FnMut(&[u8]) -> Result<(), E>) -> Result<(), E> {
    let mut chunk = Vec::with_capacity((table.len() * ENTRY_BYTES as usize).min(CHUNK_BYTES + BRICK_BYTES));
    for brick in table.bricks() {
        let first = packed_key(brick, 0);
        table.for_each_in(brick, |place, evidence| {
            chunk.extend_from_slice(&entry(first | KEYS_IN_BRICK[place], evidence));
        });
        if chunk.len() >= CHUNK_BYTES {
            take(&chunk)?;
            chunk.clear();
        }
    }
    if chunk.is_empty() { Ok(()) } else { take(&chunk) }
}

/// A key as its six bytes, little-endian, in the lower 48 bits.
const fn packed_key(brick: BrickCode, place: usize) -> u64 {
    let [x, y, z] = MortonCode(brick.0 << 9 | place as u64).to_key().0;
    x as u64 | (y as u64) << 16 | (z as u64) << 32
}

/// Keys of the voxels of the first brick. The keys of another brick are these, combined with the key of its first
/// voxel.
static KEYS_IN_BRICK: [u64; BRICK_VOXELS] = {
    let mut keys = [0; BRICK_VOXELS];
    let mut place = 0;
    while place < BRICK_VOXELS {
        keys[place] = packed_key(BrickCode(0), place);
        place += 1;
    }
    keys
};

#[inline]
fn entry(key: u64, evidence: Evidence) -> [u8; ENTRY_BYTES as usize] {
    let (log_odds, count) = (evidence.log_odds.to_bits(), evidence.observation_count as u32);
    let mut entry = [0; ENTRY_BYTES as usize];
    entry[0..8].copy_from_slice(&(key | log_odds << 48).to_le_bytes());
    entry[8..16].copy_from_slice(&(log_odds >> 16 | u64::from(count) << 48).to_le_bytes());
    entry[16..18].copy_from_slice(&((count >> 16) as u16).to_le_bytes());
    entry
}
