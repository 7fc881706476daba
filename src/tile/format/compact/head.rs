use super::codebook_states::CodebookStates;
use super::column_reader::ColumnReader;
use super::group_index::GroupIndex;
use super::header::{Header, Version};
use super::input::Input;
use crate::error::DecodeError;
use crate::space::VoxelBox;
use std::io::Read;

/// Part of a compact table before its groups.
#[derive(Debug)]
pub(super) struct Head {
    pub(super) header: Header,
    /// `None` in version 1.
    pub(super) index: Option<GroupIndex>,
    pub(super) codebook: CodebookStates,
    /// Checksum of header and index.
    pub(super) crc: u32,
}

impl Head {
    /// Reads the head of a table of the tile of `voxels`. Checks the index and the codebook's checksum.
    pub(super) fn read(
        voxels: &VoxelBox,
        column_reader: &mut ColumnReader,
        input: &mut Input<impl Read>,
    ) -> Result<Self, DecodeError> {
        let (version, header) = Header::read(input, voxels)?;
        let index = match version {
            Version::One => None,
            Version::Two => Some(GroupIndex::read(&header, input)?),
        };
        let crc = input.end_part();
        let codebook = CodebookStates::read(header.states, column_reader, input)?;
        if index.is_some() {
            input.end_part_as("codebook", header.codebook_bytes as u64, header.codebook_crc)?;
        }
        Ok(Self { header, index, codebook, crc })
    }
}
