use super::group_columns::{Columns, Rest, Room};
use super::header::Header;
use super::open_brick::{OpenBrick, Refusal};
use super::symbol::Symbols;
use crate::error::FormatError;
use crate::space::{BrickCode, VoxelBox};
use crate::tile::Table;
use crate::tile::table::{Palette, Storage};

/// Builds a table from groups of bricks.
pub(super) struct GroupReader<'a> {
    voxels: &'a VoxelBox,
    symbols: Symbols,
    table: Table,
    /// The previous brick.
    before: Option<BrickCode>,
}

impl<'a> GroupReader<'a> {
    /// The palette holds the codebook.
    pub(super) fn new(voxels: &'a VoxelBox, palette: Palette) -> Self {
        let symbols = Symbols::of(palette.len() - 1);
        Self { voxels, symbols, table: Table::with_palette(palette), before: None }
    }

    /// Number of bricks so far.
    pub(super) fn bricks(&self) -> usize {
        self.table.bricks.len()
    }

    /// The limits of the next group.
    pub(super) fn room(&self, header: &Header) -> Room {
        Room { bricks: header.bricks - self.bricks(), voxels: header.voxels - self.table.len() }
    }

    /// The table of all groups.
    pub(super) fn end(mut self) -> Table {
        self.table.palette.limit_by_use();
        self.table
    }

    /// Adds the next group. Its first brick is `first`, or the first step leads to it.
    pub(super) fn add(&mut self, columns: &Columns, first: Option<BrickCode>) -> Result<(), FormatError> {
        self.add_bricks(columns, first).map_err(|reason| FormatError::at_offset(columns.offset, reason))
    }

    fn add_bricks(&mut self, columns: &Columns, mut first: Option<BrickCode>) -> Result<(), String> {
        if columns.bricks == 0 {
            return Err("a group without bricks".into());
        }
        let mut rest = Rest::of(columns);
        if first.is_some() && first <= self.before {
            return Err("the first brick is not behind the previous group".into());
        }
        for _ in 0..columns.bricks {
            let code = first.take().map_or_else(|| rest.take_code(self.before), Ok)?;
            self.add_brick(code, &mut rest)?;
        }
        match rest.is_empty() {
            true => Ok(()),
            false => Err("a group has more than its bricks".into()),
        }
    }

    fn add_brick(&mut self, code: BrickCode, rest: &mut Rest<'_>) -> Result<(), String> {
        self.before = Some(code);
        let observed = rest.take_mask()?;
        let brick = OpenBrick { code, observed, symbols: self.symbols };
        brick.check_is_inside(self.voxels)?;
        let before = *rest;
        let evidence = match brick.interned(rest, &mut self.table.palette) {
            Ok(cells) => Storage::Interned(cells),
            Err(Refusal::Full) => {
                *rest = before;
                self.table.made_plain += 1;
                Storage::Plain(brick.plain(rest, &self.table.palette)?)
            }
            Err(Refusal::Wrong(reason)) => return Err(reason),
        };
        self.table.add_brick(brick.closed(evidence));
        Ok(())
    }
}
