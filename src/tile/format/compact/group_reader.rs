use super::column_reader::ColumnReader;
use super::group_columns::{Columns, Rest, Room};
use super::group_index::AnnouncedGroup;
use super::header::Header;
use super::input::Input;
use super::open_brick::OpenBrick;
use super::symbol::Symbols;
use crate::error::{DecodeError, FormatError};
use crate::space::{BrickCode, VoxelBox};
use std::io::Read;

/// What is made of bricks while their groups are read.
pub(super) trait TakeBricks {
    type Made;

    /// Takes the next brick. What is known of its voxels comes next in `rest`, and all of that is taken.
    fn take(&mut self, brick: OpenBrick, rest: &mut Rest<'_>) -> Result<(), String>;

    /// What was made of all bricks.
    fn made(self) -> Self::Made;
}

/// Reads groups of bricks, all in order or one of them: bricks ascend and belong to the tile.
pub(super) struct GroupReader<'a, T> {
    header: &'a Header,
    tile: &'a VoxelBox,
    symbols: Symbols,
    taker: T,
    /// Bricks and voxels so far.
    bricks: usize,
    voxels: usize,
    /// The previous brick.
    before: Option<BrickCode>,
}

impl<'a, T: TakeBricks> GroupReader<'a, T> {
    pub(super) fn new(header: &'a Header, tile: &'a VoxelBox, taker: T) -> Self {
        let symbols = Symbols::of(header.states);
        Self { header, tile, symbols, taker, bricks: 0, voxels: 0, before: None }
    }

    /// Reads the next group, which must be the one that the index announces, if there is an index.
    pub(super) fn read(
        &mut self,
        announced: Option<AnnouncedGroup>,
        columns: &mut Columns,
        column_reader: &mut ColumnReader,
        input: &mut Input<impl Read>,
    ) -> Result<(), DecodeError> {
        let Header { bricks, voxels, .. } = *self.header;
        let room = Room { bricks: bricks - self.bricks, voxels: voxels - self.voxels };
        columns.read(&room, column_reader, input)?;
        if let Some(AnnouncedGroup { bytes, crc, .. }) = announced {
            input.end_part_as("group", bytes, crc)?;
        }
        let wrong = |reason| FormatError::at_offset(columns.offset, reason);
        self.take(announced, columns).map_err(wrong)?;
        Ok(())
    }

    fn take(&mut self, announced: Option<AnnouncedGroup>, columns: &Columns) -> Result<(), String> {
        if columns.bricks == 0 {
            return Err("a group without bricks".into());
        }
        let mut rest = Rest::of(columns);
        // Without an index, a step leads to the first one, too.
        let mut first = announced.map(|group| group.first);
        for _ in 0..columns.bricks {
            let code = first.take().map_or_else(|| rest.take_code(self.before), Ok)?;
            self.take_brick(code, &mut rest)?;
        }
        if !rest.is_empty() {
            return Err("a group has more than its bricks".into());
        }
        match announced {
            Some(group) if self.before >= Some(group.end) => Err("a group has bricks of the next one".into()),
            _ => Ok(()),
        }
    }

    fn take_brick(&mut self, code: BrickCode, rest: &mut Rest<'_>) -> Result<(), String> {
        let brick = OpenBrick { code, observed: rest.take_mask()?, symbols: self.symbols };
        brick.check_is_inside(self.tile)?;
        self.before = Some(code);
        self.bricks += 1;
        self.voxels += brick.voxels();
        self.taker.take(brick, rest)
    }

    /// Whether all announced bricks were read.
    pub(super) fn has_all_bricks(&self) -> bool {
        self.bricks >= self.header.bricks
    }

    /// Checks that all was read that the header announces.
    pub(super) fn check_is_all(&self) -> Result<(), FormatError> {
        let Header { bricks, voxels, .. } = *self.header;
        if self.bricks != bricks {
            let reason = format!("{} bricks where {bricks} are announced", self.bricks);
            return Err(FormatError::at_offset(16, reason));
        }
        if self.voxels != voxels {
            let reason = format!("{} voxels where {voxels} are announced", self.voxels);
            return Err(FormatError::at_offset(8, reason));
        }
        Ok(())
    }

    /// What was made of the groups.
    pub(super) fn made(self) -> T::Made {
        self.taker.made()
    }
}
