use super::load::check;
use crate::config::Storage;
use crate::sensor::Evidence;
use crate::space::{Grid, VoxelIndex, VoxelKey};
use crate::store::{FileChecksum, TileLocation, TileStore};
use crate::tile::format::CompactFileIndex;
use std::io::{self, BufReader, Read};

/// Result of reading one voxel.
pub(crate) struct FoundVoxel {
    /// `None` if the voxel was never observed.
    pub evidence: Option<Evidence>,
    /// Number of bytes read.
    pub bytes: u64,
}

/// Files up to this length are read at once, because another request to a bucket would take longer.
const SMALL_FILE_BYTES: u64 = 64 << 10;

/// Bytes of a longer file that are read first. With real scans they contain everything before the groups.
const FIRST_BYTES: usize = 8 << 10;

/// Reads one voxel from the part of its tile's file that contains it, and compares that part with the log. Returns
/// `None` if the file cannot be read in parts, or after any error: the caller then loads the tile, which reports the
/// error.
pub(crate) fn read_voxel(store: &TileStore, grid: &Grid, voxel: VoxelIndex) -> Option<FoundVoxel> {
    let tile = grid.tile_of_voxel(voxel);
    let location = store.tables().location_to_read(tile).ok()??;
    let (version, map_id) = (location.version()?, location.map_id()?);
    if location.storage() != Storage::Compact || !location.is_in_folder().ok()? {
        return None;
    }
    let file = version.table;
    let first = if file.bytes <= SMALL_FILE_BYTES { file.bytes as usize } else { FIRST_BYTES };
    let mut head = BufReader::with_capacity(first, FileStart { location: &location, read: 0 });
    let index = CompactFileIndex::read(&mut head, file.bytes, &grid.voxels_of_tile(tile)).ok()??;
    let found = FileChecksum { bytes: file.bytes, crc: index.crc };
    check(map_id, tile, Storage::Compact, Some(&index.front), found, Some(version)).ok()?;
    let bytes = head.get_ref().read;
    let code = VoxelKey::from_index(voxel).morton();
    let Some(place) = index.group_of(code) else { return Some(FoundVoxel { evidence: None, bytes }) };
    let begin = bytes - head.buffer().len() as u64;
    let ahead = place.start.checked_sub(begin).zip(place.end.checked_sub(begin));
    let ahead = ahead.and_then(|(from, to)| head.buffer().get(from.try_into().ok()?..to.try_into().ok()?));
    if let Some(group) = ahead {
        return Some(FoundVoxel { evidence: index.evidence(code, group).ok()?, bytes });
    }
    let length = usize::try_from(place.end - place.start).ok()?;
    let group = location.read_at(place.start, length).ok()?;
    Some(FoundVoxel { evidence: index.evidence(code, &group).ok()?, bytes: bytes + group.len() as u64 })
}

/// Stream of a file from its beginning.
struct FileStart<'a> {
    location: &'a TileLocation,
    /// Number of bytes read so far.
    read: u64,
}

impl Read for FileStart<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let bytes = self.location.read_at(self.read, buffer.len())?;
        buffer[..bytes.len()].copy_from_slice(&bytes);
        self.read += bytes.len() as u64;
        Ok(bytes.len())
    }
}
