//! Placeholder.
use super::{Trailer, read_table, write_table};
use crate::error::DecodeError;
use crate::space::{TileIndex, VoxelBox};
use crate::tile::Table;

/// Placeholder.
pub fn encode_compact(table: &Table) -> Vec<u8> {
    let mut out = Vec::new();
    let trailer = Trailer {
        map_id: [0; 16],
        tile: TileIndex::new(0, 0, 0),
        scan_number: 0,
        table_crc: 0,
        octree_crc: 0,
        octree_bytes: 0,
        parameters: String::new(),
    };
    write_table(table, trailer, &mut out).expect("memory");
    out
}

/// Placeholder.
pub fn decode_compact(bytes: &[u8], voxels: &VoxelBox) -> Result<Table, DecodeError> {
    Ok(read_table(&mut &*bytes, bytes.len() as u64, voxels)?.table)
}
