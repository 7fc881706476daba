use super::CRC_BYTES;
use super::codebook_states::CodebookStates;
use super::column_reader::ColumnReader;
use super::group_columns::Columns;
use super::group_index::{ENTRY_BYTES, GroupIndex};
use super::group_reader::GroupReader;
use super::head::Head;
use super::header::{HEADER_BYTES, Header};
use super::input::Input;
use super::voxel_finder::VoxelFinder;
use crate::error::{DecodeError, FormatError};
use crate::sensor::Evidence;
use crate::space::{MortonCode, VoxelBox};
use std::io::Read;
use std::ops::Range;

/// Header, index and codebook of a compact table. With these, each group can be checked and read without the others.
#[derive(Debug)]
pub struct CompactIndex {
    voxels: VoxelBox,
    header: Header,
    index: GroupIndex,
    codebook: CodebookStates,
    crc: u32,
}

impl CompactIndex {
    /// Reads header, index and codebook of a table of `bytes` bytes that belongs to the tile of `voxels`; `None` for
    /// version 1, which has no index.
    ///
    /// # Errors
    ///
    /// Fails if any of these parts violates the format; the error contains the offset of the part.
    pub fn read(input: &mut impl Read, bytes: u64, voxels: &VoxelBox) -> Result<Option<Self>, DecodeError> {
        let mut input = Input::of_table(input, bytes)?;
        let head = Head::read(voxels, &mut ColumnReader::new()?, &mut input)?;
        let Head { header, index: Some(index), codebook, crc } = head else { return Ok(None) };
        let crc = index.crc_of_all(crc, &header);
        Ok(Some(Self { voxels: *voxels, header, index, codebook, crc }))
    }

    /// Checksum of the whole table, computed from those of its parts. If it matches the stored one, the parts are also
    /// valid.
    pub fn crc(&self) -> u32 {
        self.crc
    }

    /// Returns the byte range of the group that contains a voxel, if one can contain it.
    pub fn group_of(&self, voxel: MortonCode) -> Option<Range<u64>> {
        let number = self.index.group_of(voxel.brick())?;
        let head = HEADER_BYTES + self.index.groups.len() * ENTRY_BYTES + self.header.codebook_bytes;
        let begin = head as u64 + self.index.bytes_before(number);
        Some(begin..begin + u64::from(self.index.groups[number].bytes))
    }

    /// Returns the evidence of a voxel, read from the bytes of its group; `None` if it was not observed.
    ///
    /// # Errors
    ///
    /// Fails if the bytes do not match the index or violate the format. Offsets are relative to the group.
    pub fn evidence(&self, voxel: MortonCode, group: &[u8]) -> Result<Option<Evidence>, DecodeError> {
        let Some(number) = self.index.group_of(voxel.brick()) else { return Ok(None) };
        let announced = self.index.announced(number);
        if group.len() as u64 != announced.bytes {
            let reason = format!("a group of {} bytes instead of {}", group.len(), announced.bytes);
            return Err(FormatError::at_offset(0, reason).into());
        }
        let finder = VoxelFinder::new(&self.codebook, voxel);
        let mut groups = GroupReader::new(&self.header, &self.voxels, finder);
        let mut input = Input::new(group, announced.bytes + CRC_BYTES);
        groups.read(Some(announced), &mut Columns::default(), &mut ColumnReader::new()?, &mut input)?;
        Ok(groups.made())
    }
}
