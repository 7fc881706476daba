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

/// What a compact table has before its groups: any of these is checked and read with it, without the others.
#[derive(Debug)]
pub struct CompactIndex {
    voxels: VoxelBox,
    header: Header,
    index: GroupIndex,
    codebook: CodebookStates,
    crc: u32,
}

impl CompactIndex {
    /// Reads header, index and codebook of a table of `bytes` bytes that belongs to the tile of `voxels`; `None` if it
    /// is of version 1, which has no index.
    ///
    /// # Errors
    ///
    /// Anything in these parts that violates the format, with the offset of the part.
    pub fn read(input: &mut impl Read, bytes: u64, voxels: &VoxelBox) -> Result<Option<Self>, DecodeError> {
        let mut input = Input::of_table(input, bytes)?;
        let head = Head::read(voxels, &mut ColumnReader::new()?, &mut input)?;
        let Head { header, index: Some(index), codebook, crc } = head else { return Ok(None) };
        let crc = index.crc_of_all(crc, &header);
        Ok(Some(Self { voxels: *voxels, header, index, codebook, crc }))
    }

    /// The checksum that the table ends with, from those of its parts: if it is the right one, so are they.
    pub fn crc(&self) -> u32 {
        self.crc
    }

    /// Where in the table the group is that has a voxel, if one has it.
    pub fn group_of(&self, voxel: MortonCode) -> Option<Range<u64>> {
        let number = self.index.group_of(voxel.brick())?;
        let head = HEADER_BYTES + self.index.groups.len() * ENTRY_BYTES + self.header.codebook_bytes;
        let begin = head as u64 + self.index.bytes_before(number);
        Some(begin..begin + u64::from(self.index.groups[number].bytes))
    }

    /// The evidence of a voxel, from the bytes of its group; `None` if it was not observed.
    ///
    /// # Errors
    ///
    /// Other bytes than those that the index tells of; anything that violates the format. Offsets are those in the
    /// group.
    pub fn evidence(&self, voxel: MortonCode, group: &[u8]) -> Result<Option<Evidence>, DecodeError> {
        let Some(number) = self.index.group_of(voxel.brick()) else { return Ok(None) };
        let announced = self.index.announced(number);
        if group.len() as u64 != announced.bytes {
            let reason = format!("a group of {} bytes where {} are announced", group.len(), announced.bytes);
            return Err(FormatError::at_offset(0, reason).into());
        }
        let finder = VoxelFinder::new(&self.codebook, voxel);
        let mut groups = GroupReader::new(&self.header, &self.voxels, finder);
        let mut input = Input::new(group, announced.bytes + CRC_BYTES);
        groups.read(Some(announced), &mut Columns::default(), &mut ColumnReader::new()?, &mut input)?;
        Ok(groups.made())
    }
}
