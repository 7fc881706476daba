use super::column_reader::ColumnReader;
use super::group_columns::{Columns, GroupLimits, Rest};
use super::group_index::AnnouncedGroup;
use super::header::Header;
use super::input::Input;
use super::open_brick::OpenBrick;
use super::symbol::Symbols;
use crate::error::{DecodeError, FormatError};
use crate::space::{BrickCode, VoxelBox};
use std::io::Read;

/// Consumer of the bricks of groups that are read.
pub(super) trait TakeBricks {
    type Made;

    /// Takes the next brick. The data of its voxels are next in `rest`, and must be read completely.
    fn take(&mut self, brick: OpenBrick, rest: &mut Rest<'_>) -> Result<(), String>;

    /// Returns the result for all bricks.
    fn made(self) -> Self::Made;
}

/// Reads groups of bricks, either all in order or a single one. Checks that bricks ascend and belong to the tile.
pub(super) struct GroupReader<'a, T> {
    header: &'a Header,
    tile: &'a VoxelBox,
    symbols: Symbols,
    taker: T,
    /// Numbers of bricks and voxels read so far.
    bricks: usize,
    voxels: usize,
    before: Option<BrickCode>,
}

impl<'a, T: TakeBricks> GroupReader<'a, T> {
    pub(super) fn new(header: &'a Header, tile: &'a VoxelBox, taker: T) -> Self {
        let symbols = Symbols::of(header.states);
        Self { header, tile, symbols, taker, bricks: 0, voxels: 0, before: None }
    }

    /// Reads the next group, which must match the index, if there is one.
    pub(super) fn read(
        &mut self,
        announced: Option<AnnouncedGroup>,
        columns: &mut Columns,
        column_reader: &mut ColumnReader,
        input: &mut Input<impl Read>,
    ) -> Result<(), DecodeError> {
        let Header { bricks, voxels, .. } = *self.header;
        let limits = GroupLimits { bricks: bricks - self.bricks, voxels: voxels - self.voxels };
        columns.read(&limits, column_reader, input)?;
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
        // Without an index, the first brick is also encoded as a step.
        let mut first = announced.map(|group| group.first);
        for _ in 0..columns.bricks {
            let code = first.take().map_or_else(|| rest.take_code(self.before), Ok)?;
            self.take_brick(code, &mut rest)?;
        }
        if !rest.is_empty() {
            return Err("a group has data after its last brick".into());
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

    /// Returns whether as many bricks were read as the header specifies.
    pub(super) fn has_all_bricks(&self) -> bool {
        self.bricks >= self.header.bricks
    }

    /// Checks that the numbers of bricks and voxels match the header.
    pub(super) fn check_is_all(&self) -> Result<(), FormatError> {
        let Header { bricks, voxels, .. } = *self.header;
        if self.bricks != bricks {
            let reason = format!("{} bricks instead of {bricks}", self.bricks);
            return Err(FormatError::at_offset(16, reason));
        }
        if self.voxels != voxels {
            let reason = format!("{} voxels instead of {voxels}", self.voxels);
            return Err(FormatError::at_offset(8, reason));
        }
        Ok(())
    }

    /// Returns the result for all groups.
    pub(super) fn made(self) -> T::Made {
        self.taker.made()
    }
}
