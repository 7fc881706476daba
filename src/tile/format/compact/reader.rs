use super::CRC_BYTES;
use super::column_reader::{Column, ColumnReader};
use super::columns::{STATE_BYTES, state_at};
use super::group_columns::Columns;
use super::group_index::GroupIndex;
use super::group_reader::GroupReader;
use super::header::{HEADER_1_BYTES, Header, Version};
use super::input::Input;
use crate::error::{DecodeError, FormatError};
use crate::space::VoxelBox;
use crate::tile::Table;
use crate::tile::format::entry::fault_of;
use crate::tile::table::Palette;
use std::io::{self, Read};

/// Reads tables in compact form. Its buffers are kept from table to table: 0.4 MB, and up to 1.5 MB more after a table
/// in which hardly two voxels were in one state.
pub struct CompactReader {
    column_reader: ColumnReader,
    columns: Columns,
}

impl CompactReader {
    /// A reader.
    ///
    /// # Errors
    ///
    /// Those of zstd.
    pub fn new() -> io::Result<Self> {
        Ok(Self { column_reader: ColumnReader::new()?, columns: Columns::default() })
    }

    /// Reads a table of `bytes` bytes that belongs to the tile of `voxels`. Damaged bytes cannot add voxels outside the
    /// tile, or take more memory than the tile could need.
    ///
    /// # Errors
    ///
    /// Anything that violates the format, with the offset of the part: wrong magic or version, lengths and counts that
    /// do not fit, bricks out of order or of another tile, duplicate or invalid states, bytes after the end, a wrong
    /// checksum.
    pub fn read(
        &mut self,
        input: &mut impl Read,
        bytes: u64,
        voxels: &VoxelBox,
    ) -> Result<Table, DecodeError> {
        if bytes < HEADER_1_BYTES as u64 + CRC_BYTES {
            let reason = format!("{bytes} bytes are too few for a compact table");
            return Err(FormatError::at_offset(0, reason).into());
        }
        let mut input = Input::new(input, bytes);
        let (version, header) = Header::read(&mut input, voxels)?;
        let table = match version {
            Version::One => self.read_groups_1(&header, voxels, &mut input)?,
            Version::Two => self.read_groups(&header, voxels, &mut input)?,
        };
        if table.len() != header.voxels {
            let reason = format!("{} voxels where {} are announced", table.len(), header.voxels);
            return Err(FormatError::at_offset(8, reason).into());
        }
        input.end()?;
        Ok(table)
    }

    fn read_groups(
        &mut self,
        header: &Header,
        voxels: &VoxelBox,
        input: &mut Input<impl Read>,
    ) -> Result<Table, DecodeError> {
        let index = GroupIndex::read(header, input)?;
        input.end_part();
        let palette = read_codebook(header.states, &mut self.column_reader, input)?;
        input.end_part_as("codebook", header.codebook_bytes as u64, header.codebook_crc)?;
        let mut groups = GroupReader::new(voxels, palette);
        for group in &index.groups {
            self.columns.read(&groups.room(header), &mut self.column_reader, input)?;
            input.end_part_as("group", group.bytes.into(), group.crc)?;
            groups.add(&self.columns, Some(group.first))?;
        }
        if groups.bricks() != header.bricks {
            let reason = format!("{} bricks where {} are announced", groups.bricks(), header.bricks);
            return Err(FormatError::at_offset(16, reason).into());
        }
        Ok(groups.end())
    }

    /// Of version 1: groups until all bricks are there.
    fn read_groups_1(
        &mut self,
        header: &Header,
        voxels: &VoxelBox,
        input: &mut Input<impl Read>,
    ) -> Result<Table, DecodeError> {
        let palette = read_codebook(header.states, &mut self.column_reader, input)?;
        let mut groups = GroupReader::new(voxels, palette);
        while groups.bricks() < header.bricks {
            self.columns.read(&groups.room(header), &mut self.column_reader, input)?;
            groups.add(&self.columns, None)?;
        }
        Ok(groups.end())
    }
}

/// Reads one table, see [`CompactReader::read`].
///
/// # Errors
///
/// Those of [`CompactReader::read`].
pub fn read_compact(input: &mut impl Read, bytes: u64, voxels: &VoxelBox) -> Result<Table, DecodeError> {
    CompactReader::new()?.read(input, bytes, voxels)
}

/// The codebook as a palette: its states are numbered from 1.
fn read_codebook(
    states: usize,
    column_reader: &mut ColumnReader,
    input: &mut Input<impl Read>,
) -> Result<Palette, DecodeError> {
    let offset = input.offset;
    let wrong = |reason: String| Err(FormatError::at_offset(offset, reason).into());
    let bytes = read_codebook_states(states, column_reader, input)?;
    let mut palette = Palette::with_all_room();
    for number in 0..states {
        let state = state_at(&bytes, number);
        if let Some((_, reason)) = fault_of(state) {
            return wrong(format!("state {number} of the codebook: {reason}"));
        }
        match palette.intern(state) {
            Ok(id) if usize::from(id) == number + 1 => {}
            _ => return wrong(format!("state {number} of the codebook comes twice")),
        }
    }
    Ok(palette)
}

/// The states of the codebook, for [`state_at`]. None was looked at.
pub(super) fn read_codebook_states(
    states: usize,
    column_reader: &mut ColumnReader,
    input: &mut Input<impl Read>,
) -> Result<Vec<u8>, DecodeError> {
    let offset = input.offset;
    let mut bytes = Vec::new();
    let column = Column { name: "codebook", most: states * STATE_BYTES, bytes: &mut bytes };
    column_reader.take_columns([column], input)?;
    if bytes.len() != states * STATE_BYTES {
        let reason = format!("a codebook of {} bytes for {states} states", bytes.len());
        return Err(FormatError::at_offset(offset, reason).into());
    }
    Ok(bytes)
}
