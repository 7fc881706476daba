use super::column_reader::{Column, ColumnReader};
use super::columns::{STATE_BYTES, state_at};
use super::group_columns::{Columns, Rest, Room};
use super::group_reader::GroupReader;
use super::group_sieve::GroupSieve;
use super::input::Input;
use super::symbol::MAX_STATES;
use super::{CRC_BYTES, HEADER_BYTES, MAGIC, VERSION};
use crate::error::{DecodeError, FormatError};
use crate::space::VoxelBox;
use crate::tile::Table;
use crate::tile::format::entry::fault_of;
use crate::tile::format::gather::SiftedVoxels;
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
        self.read_groups(input, bytes, voxels, |palette| GroupReader::new(voxels, palette))
    }

    /// Reads groups into what begins with the codebook's palette.
    fn read_groups<G: TakeGroups>(
        &mut self,
        input: &mut impl Read,
        bytes: u64,
        voxels: &VoxelBox,
        begin: impl FnOnce(Palette) -> G,
    ) -> Result<G::Made, DecodeError> {
        if bytes < HEADER_BYTES as u64 + CRC_BYTES {
            let reason = format!("{bytes} bytes are too few for a compact table");
            return Err(FormatError::at_offset(0, reason).into());
        }
        let mut input = Input::new(input, bytes);
        let header = Header::read(&mut input, voxels)?;
        let palette = read_codebook(header.states, &mut self.column_reader, &mut input)?;
        let mut groups = begin(palette);
        while groups.bricks() < header.bricks {
            let room =
                Room { bricks: header.bricks - groups.bricks(), voxels: header.voxels - groups.voxels() };
            self.columns.read(&room, &mut self.column_reader, &mut input)?;
            groups.add(&self.columns)?;
        }
        if groups.voxels() != header.voxels {
            let reason = format!("{} voxels where {} are announced", groups.voxels(), header.voxels);
            return Err(FormatError::at_offset(8, reason).into());
        }
        input.end()?;
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

/// Reads the observed voxels of a table whose log-odds are at least `from`, in Morton order, without the table.
///
/// # Errors
///
/// Those of [`CompactReader::read`].
pub(in crate::tile::format) fn sift_compact(
    input: &mut impl Read,
    bytes: u64,
    voxels: &VoxelBox,
    from: f64,
) -> Result<SiftedVoxels, DecodeError> {
    CompactReader::new()?.read_groups(input, bytes, voxels, |palette| GroupSieve::new(voxels, palette, from))
}

/// What is made of groups of bricks.
pub(super) trait TakeGroups {
    type Made;

    /// Number of bricks so far.
    fn bricks(&self) -> usize;

    /// Number of observed voxels so far.
    fn voxels(&self) -> usize;

    /// Adds the next group.
    fn add(&mut self, columns: &Columns) -> Result<(), FormatError> {
        self.add_bricks(columns).map_err(|reason| FormatError::at_offset(columns.offset, reason))
    }

    fn add_bricks(&mut self, columns: &Columns) -> Result<(), String> {
        if columns.bricks == 0 {
            return Err("a group without bricks".into());
        }
        let mut rest = Rest::of(columns);
        (0..columns.bricks).try_for_each(|_| self.add_brick(&mut rest))?;
        match rest.is_empty() {
            true => Ok(()),
            false => Err("a group has more than its bricks".into()),
        }
    }

    fn add_brick(&mut self, rest: &mut Rest<'_>) -> Result<(), String>;

    /// What was made of all groups.
    fn end(self) -> Self::Made;
}

/// The header of a compact table.
struct Header {
    voxels: usize,
    bricks: usize,
    states: usize,
}

impl Header {
    fn read(input: &mut Input<impl Read>, voxels: &VoxelBox) -> Result<Self, DecodeError> {
        let mut header = [0; HEADER_BYTES];
        input.read(&mut header)?;
        let u32_at = |at: usize| u32::from_le_bytes(std::array::from_fn(|k| header[at + k]));
        let wrong = |offset, reason: String| Err(FormatError::at_offset(offset, reason).into());
        if u32_at(0) != MAGIC {
            return wrong(0, format!("the magic number is {:#010x}, not {MAGIC:#010x}", u32_at(0)));
        }
        if u32_at(4) != VERSION {
            let reason = format!("version {} is not known; this program reads version {VERSION}", u32_at(4));
            return wrong(4, reason);
        }
        let count = u64::from(u32_at(8)) | u64::from(u32_at(12)) << 32;
        let most = voxels_in(voxels);
        let Some(count) = usize::try_from(count).ok().filter(|&count| count as u64 <= most) else {
            return wrong(8, format!("{count} voxels in a tile of {most}"));
        };
        let [bricks, states] = [u32_at(16), u32_at(20)].map(|count| count as usize);
        if bricks > count || (bricks == 0) != (count == 0) {
            return wrong(16, format!("{count} voxels in {bricks} bricks"));
        }
        if states > count.min(MAX_STATES) {
            return wrong(20, format!("a codebook of {states} states for {count} voxels"));
        }
        Ok(Self { voxels: count, bricks, states })
    }
}

/// Number of voxels of a tile.
fn voxels_in(voxels: &VoxelBox) -> u64 {
    (0..3).map(|k| u64::from(voxels.end[k].abs_diff(voxels.min[k]))).product()
}

/// The codebook as a palette: its states are numbered from 1.
fn read_codebook(
    states: usize,
    column_reader: &mut ColumnReader,
    input: &mut Input<impl Read>,
) -> Result<Palette, DecodeError> {
    let offset = input.offset;
    let wrong = |reason: String| Err(FormatError::at_offset(offset, reason).into());
    let mut bytes = Vec::new();
    let column = Column { name: "codebook", most: states * STATE_BYTES, bytes: &mut bytes };
    column_reader.take_columns([column], input)?;
    if bytes.len() != states * STATE_BYTES {
        return wrong(format!("a codebook of {} bytes for {states} states", bytes.len()));
    }
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
