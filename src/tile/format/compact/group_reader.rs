use super::group_columns::Rest;
use super::open_brick::{OpenBrick, Refusal};
use super::reader::TakeGroups;
use super::symbol::Symbols;
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
}

impl TakeGroups for GroupReader<'_> {
    type Made = Table;

    fn bricks(&self) -> usize {
        self.table.bricks.len()
    }

    fn voxels(&self) -> usize {
        self.table.len()
    }

    fn add_brick(&mut self, rest: &mut Rest<'_>) -> Result<(), String> {
        let code = rest.take_code(self.before)?;
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

    fn end(mut self) -> Table {
        self.table.palette.limit_by_use();
        self.table
    }
}
