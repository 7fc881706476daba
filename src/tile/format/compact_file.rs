//! `tile.vxt`: a front part like the trailer of `iwlo_meta.bin`, then the table in compact form without its checksum.
//! The checksum is in the front part, because with a checksum directly after its data the checksum of the whole file
//! would be a constant. For the same reason the index contains the checksums of a table's parts before the parts.

use super::compact::{CRC_BYTES, CompactIndex, filter_compact, joined_crc, read_compact};
use super::gather::FilteredVoxels;
use super::reader::{Decoded, DecodedTable, read_layers, skip};
use super::trailer::Trailer;
use crate::error::{DecodeError, FormatError};
use crate::sensor::Evidence;
use crate::space::{MortonCode, VoxelBox};
use std::io::{self, BufReader, Read, Write};
use std::ops::Range;

/// Writes a table in compact form as `tile.vxt`, with the section of its layers
/// ([`CompactWriter::layer_section`](super::CompactWriter::layer_section)). The checksums of `front` are computed here;
/// the given values are ignored. The file has no octree.
///
/// # Errors
///
/// Returns errors from `out`, and fails if `compact` is too short for a compact table.
pub fn write_compact_file(
    compact: &[u8],
    layers: &[u8],
    front: Trailer,
    out: &mut impl Write,
) -> io::Result<()> {
    let Some((body, crc)) = compact.split_last_chunk::<{ CRC_BYTES as usize }>() else {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not a table in the compact form"));
    };
    let (octree_crc, octree_bytes) = (crc32fast::hash(layers), layers.len() as u64);
    let front = Trailer { table_crc: u32::from_le_bytes(*crc), octree_crc, octree_bytes, ..front };
    out.write_all(&front.to_bytes())?;
    out.write_all(body)?;
    out.write_all(layers)
}

/// Reads a `tile.vxt` of `file_bytes` bytes that belongs to the tile of `voxels`.
///
/// # Errors
///
/// Fails if the file violates the format; the error contains the offset.
pub fn read_compact_file(
    input: &mut impl Read,
    file_bytes: u64,
    voxels: &VoxelBox,
) -> Result<DecodedTable, DecodeError> {
    let mut input = BufReader::with_capacity(1 << 16, input);
    let (mut decoded, layer_bytes) =
        read_after_front(&mut input, file_bytes, |input, bytes| read_compact(&mut { input }, bytes, voxels))?;
    read_layers(&mut decoded.table, &mut input, file_bytes, layer_bytes, voxels)?;
    Ok(decoded)
}

/// Reads the observed voxels of a `tile.vxt` whose log-odds are at least `from`, in Morton order, without building a
/// table.
///
/// # Errors
///
/// Same errors as [`read_compact_file`].
pub fn read_compact_voxels_from(
    input: &mut impl Read,
    file_bytes: u64,
    voxels: &VoxelBox,
    from: f64,
) -> Result<Decoded<FilteredVoxels>, DecodeError> {
    let mut input = BufReader::with_capacity(1 << 16, input);
    let (decoded, layer_bytes) = read_after_front(&mut input, file_bytes, |input, bytes| {
        filter_compact(&mut { input }, bytes, voxels, from)
    })?;
    skip(&mut input, layer_bytes)?;
    Ok(decoded)
}

/// Reads front part and table; also returns the number of bytes that follow.
fn read_after_front<T>(
    input: &mut impl Read,
    file_bytes: u64,
    read: impl FnOnce(&mut dyn Read, u64) -> Result<T, DecodeError>,
) -> Result<(Decoded<T>, u64), DecodeError> {
    let front = read_compact_front(input, file_bytes)?;
    let (body_bytes, layer_bytes) = (body_bytes(&front, file_bytes), front.octree_bytes);
    let crc = front.table_crc.to_le_bytes();
    let mut compact = input.by_ref().take(body_bytes).chain(&crc[..]);
    let table =
        read(&mut compact, body_bytes + CRC_BYTES).map_err(|error| error.further_by(front.bytes()))?;
    Ok((Decoded { table, trailer: Some(front) }, layer_bytes))
}

/// Bytes of the table between front part and layers.
fn body_bytes(front: &Trailer, file_bytes: u64) -> u64 {
    file_bytes - front.bytes() - front.octree_bytes
}

/// Reads only the front part of a `tile.vxt`.
///
/// # Errors
///
/// Fails if the front part violates the format.
pub fn read_compact_front(input: &mut impl Read, file_bytes: u64) -> Result<Trailer, DecodeError> {
    let front = Trailer::read_in_front(input, file_bytes)?;
    if front.octree_bytes > file_bytes - front.bytes() {
        return Err(FormatError::at_offset(52, "the layers are longer than the file").into());
    }
    Ok(front)
}

/// Part of a `tile.vxt` before its groups.
#[derive(Debug)]
pub struct CompactFileIndex {
    /// Front part of the file.
    pub front: Trailer,
    /// CRC-32 of the whole file, computed from those of its parts. If it matches the recorded one, the parts are also
    /// valid.
    pub crc: u32,
    index: CompactIndex,
}

impl CompactFileIndex {
    /// Reads the index from the beginning of a `tile.vxt` of `file_bytes` bytes that belongs to the tile of `voxels`;
    /// `None` for a table of version 1, which has to be read completely.
    ///
    /// # Errors
    ///
    /// Fails if these parts violate the format; the error contains the offset.
    pub fn read(
        input: &mut impl Read,
        file_bytes: u64,
        voxels: &VoxelBox,
    ) -> Result<Option<Self>, DecodeError> {
        let front = read_compact_front(input, file_bytes)?;
        let body_bytes = body_bytes(&front, file_bytes);
        let index = CompactIndex::read(input, body_bytes + CRC_BYTES, voxels)
            .map_err(|error| error.further_by(front.bytes()))?;
        let Some(index) = index else { return Ok(None) };
        if index.crc() != front.table_crc {
            let reason = "the table's parts do not match its checksum";
            return Err(FormatError::at_offset(44, reason).into());
        }
        let crc = joined_crc(crc32fast::hash(&front.to_bytes()), front.table_crc, body_bytes);
        let crc = joined_crc(crc, front.octree_crc, front.octree_bytes);
        Ok(Some(Self { front, crc, index }))
    }

    /// Returns the byte range in the file of the group that contains a voxel, if one can contain it.
    pub fn group_of(&self, voxel: MortonCode) -> Option<Range<u64>> {
        let group = self.index.group_of(voxel)?;
        Some(group.start + self.front.bytes()..group.end + self.front.bytes())
    }

    /// Returns the evidence of a voxel, read from the bytes of its group; `None` if it was not observed.
    ///
    /// # Errors
    ///
    /// Fails if the bytes do not match the index or violate the format.
    pub fn evidence(&self, voxel: MortonCode, group: &[u8]) -> Result<Option<Evidence>, DecodeError> {
        self.index.evidence(voxel, group)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::{BrickCode, TileIndex};
    use crate::tile::Table;
    use crate::tile::format::{CompactEffort, write_compact};

    const VOXELS: VoxelBox = VoxelBox { min: [0; 3], end: [16; 3] };

    fn table(log_odds: f64) -> Table {
        let mut table = Table::default();
        let state = |place| Evidence { log_odds: log_odds + f64::from(place % 3), observation_count: 2 };
        table.insert(
            BrickCode::of_voxel([8, 0, 0]),
            &(0..200).map(|place| (place as usize, state(place))).collect::<Vec<_>>(),
        );
        table
    }

    fn file(table: &Table, scan_number: u64) -> Vec<u8> {
        let (mut compact, mut file) = (Vec::new(), Vec::new());
        write_compact(table, CompactEffort::Fast, &mut compact).unwrap();
        let (map_id, tile, parameters) = ([3; 16], TileIndex::new(0, 0, 0), "{}".to_owned());
        let front =
            Trailer { map_id, tile, scan_number, table_crc: 9, octree_crc: 9, octree_bytes: 9, parameters };
        write_compact_file(&compact, &[], front, &mut file).unwrap();
        file
    }

    fn read(file: &[u8]) -> Result<DecodedTable, DecodeError> {
        read_compact_file(&mut &file[..], file.len() as u64, &VOXELS)
    }

    #[test]
    fn a_table_and_its_front_part_round_trip() {
        let (table, file) = (table(0.5), file(&table(0.5), 77));
        let decoded = read(&file).unwrap();
        assert!(decoded.table.iter().eq(table.iter()));
        let front = decoded.trailer.unwrap();
        assert_eq!((front.scan_number, front.octree_crc, front.octree_bytes), (77, 0, 0));
        assert_eq!(read_compact_front(&mut &file[..], file.len() as u64).unwrap(), front);
    }

    #[test]
    fn flipped_bits_and_wrong_lengths_are_errors() {
        let file = file(&table(0.5), 77);
        for at in 0..file.len() {
            for bit in 0..8 {
                let mut flipped = file.clone();
                flipped[at] ^= 1 << bit;
                assert!(read(&flipped).is_err(), "bit {bit} of byte {at}");
            }
            assert!(read(&file[..at]).is_err(), "{at} bytes");
        }
        assert!(read(&[&file[..], &[0]].concat()).is_err());
    }

    #[test]
    fn the_checksum_of_the_file_follows_from_its_parts() {
        let (table, file) = (table(0.5), file(&table(0.5), 77));
        let index = CompactFileIndex::read(&mut &file[..], file.len() as u64, &VOXELS).unwrap().unwrap();
        assert_eq!(index.crc, crc32fast::hash(&file));
        assert_eq!(index.front, read(&file).unwrap().trailer.unwrap());
        for (code, evidence) in table.iter() {
            let place = index.group_of(code).unwrap();
            let group = &file[place.start as usize..place.end as usize];
            assert_eq!(index.evidence(code, group).unwrap(), Some(evidence));
        }
    }

    #[test]
    fn errors_after_the_front_part_have_file_offsets() {
        let mut file = file(&table(0.5), 77);
        let front_bytes = 74;
        file[front_bytes] ^= 1;
        match read(&file) {
            Err(DecodeError::Format(error)) => assert_eq!(error.at, front_bytes as u64),
            other => panic!("{other:?}"),
        }
    }

    /// With a checksum directly after its data, the checksum of the whole file would be a constant.
    #[test]
    fn files_with_different_content_have_different_checksums() {
        let files = [0.5, 0.75].map(|log_odds| file(&table(log_odds), 77));
        assert_eq!(files[0].len(), files[1].len());
        assert_ne!(crc32fast::hash(&files[0]), crc32fast::hash(&files[1]));
    }

    #[test]
    fn bytes_that_are_not_a_compact_table_are_rejected() {
        let front = read(&file(&table(0.5), 1)).unwrap().trailer.unwrap();
        assert!(write_compact_file(&[1, 2, 3], &[], front, &mut Vec::new()).is_err());
    }
}
