use super::column_reader::ColumnReader;
use super::columns::state_at;
use super::group_columns::{Columns, Rest, Room};
use super::group_index::GroupIndex;
use super::header::{HEADER_1_BYTES, HEADER_BYTES, Header, Version};
use super::input::Input;
use super::reader::read_codebook_states;
use super::symbol::{RARE, Symbols};
use super::{CRC_BYTES, group_index::ENTRY_BYTES};
use crate::error::{DecodeError, FormatError};
use crate::sensor::Evidence;
use crate::space::{BrickMask, MortonCode, VoxelBox, is_in_mask};
use crate::tile::format::entry::fault_of;
use std::io::Read;
use std::ops::Range;

/// What a compact table has before its groups: any of these is checked and read with it, without the others.
#[derive(Debug)]
pub struct CompactIndex {
    header: Header,
    index: GroupIndex,
    /// As in the file, a byte plane behind the other.
    states: Vec<u8>,
    symbols: Symbols,
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
        if bytes < HEADER_1_BYTES as u64 + CRC_BYTES {
            return Err(
                FormatError::at_offset(0, format!("{bytes} bytes are too few for a compact table")).into()
            );
        }
        let mut input = Input::new(input, bytes);
        let (version, header) = Header::read(&mut input, voxels)?;
        if version == Version::One {
            return Ok(None);
        }
        let index = GroupIndex::read(&header, &mut input)?;
        let crc = index.crc_of_all(input.end_part(), &header);
        let states = read_codebook_states(header.states, &mut ColumnReader::new()?, &mut input)?;
        input.end_part_as("codebook", header.codebook_bytes as u64, header.codebook_crc)?;
        let symbols = Symbols::of(header.states);
        Ok(Some(Self { header, index, states, symbols, crc }))
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
    /// Other bytes than those that the index tells of; anything that violates the format.
    pub fn evidence(&self, voxel: MortonCode, group: &[u8]) -> Result<Option<Evidence>, DecodeError> {
        let Some(number) = self.index.group_of(voxel.brick()) else { return Ok(None) };
        let entry = self.index.groups[number];
        if group.len() as u64 != u64::from(entry.bytes) || crc32fast::hash(group) != entry.crc {
            return Err(FormatError::at_offset(0, "the group does not match its checksum").into());
        }
        let mut columns = Columns::default();
        let room = Room { bricks: self.header.bricks, voxels: self.header.voxels };
        let mut input = Input::new(group, entry.bytes as u64 + CRC_BYTES);
        columns.read(&room, &mut ColumnReader::new()?, &mut input)?;
        let mut rest = Rest::of(&columns);
        let mut code = entry.first;
        let wrong = |reason: String| FormatError::at_offset(0, reason);
        for number in 0..columns.bricks {
            if number > 0 {
                code = rest.take_code(Some(code)).map_err(wrong)?;
            }
            if code > voxel.brick() {
                break;
            }
            let mask = rest.take_mask().map_err(wrong)?;
            let count = mask.iter().map(|word| word.count_ones() as usize).sum();
            if code < voxel.brick() {
                rest.take_symbols(count).map_err(wrong)?;
                continue;
            }
            if !is_in_mask(&mask, voxel.place_in_brick()) {
                break;
            }
            let before = columns.symbols().len() - rest.symbols.len();
            let at = before + rank(&mask, voxel.place_in_brick());
            return Ok(Some(self.state_of_symbol(&columns, at, rest).map_err(wrong)?));
        }
        Ok(None)
    }

    /// The state of the voxel with this number in its group, of whose last columns nothing was taken.
    fn state_of_symbol(&self, columns: &Columns, at: usize, mut rest: Rest<'_>) -> Result<Evidence, String> {
        let symbols = columns.symbols().split_at_checked(at);
        let (before, symbol) =
            symbols.and_then(|(before, of)| Some((before, *of.first()?))).ok_or("no symbol")?;
        let number = if symbol < self.symbols.direct() {
            Some(symbol.into())
        } else if symbol == RARE {
            rest.pass_rares(before.iter().filter(|&&symbol| symbol == RARE).count());
            return rest.take_rare();
        } else if symbol < self.symbols.first_prefix() {
            None
        } else {
            let prefixes = self.symbols.first_prefix()..RARE;
            rest.pass_seconds(before.iter().filter(|symbol| prefixes.contains(symbol)).count())?;
            self.symbols.number(symbol, rest.take_second()?)
        };
        let number = number.ok_or_else(|| format!("symbol {symbol} stands for no state"))?;
        let state = state_at(&self.states, number);
        match fault_of(state) {
            None => Ok(state),
            Some((_, reason)) => Err(format!("state {number} of the codebook: {reason}")),
        }
    }
}

/// How many voxels of a mask are before a place.
fn rank(mask: &BrickMask, place: usize) -> usize {
    let whole: u32 = mask[..place / 64].iter().map(|word| word.count_ones()).sum();
    let part = mask[place / 64] & ((1 << (place % 64)) - 1);
    (whole + part.count_ones()) as usize
}
