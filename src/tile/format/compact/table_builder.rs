use super::group_columns::Rest;
use super::group_reader::TakeBricks;
use super::open_brick::{OpenBrick, Refusal};
use crate::tile::Table;
use crate::tile::table::{Palette, Storage};

pub(super) struct TableBuilder {
    table: Table,
}

impl TableBuilder {
    /// Creates a builder. The palette must contain the codebook.
    pub(super) fn new(palette: Palette) -> Self {
        Self { table: Table::with_palette(palette) }
    }
}

impl TakeBricks for TableBuilder {
    type Made = Table;

    fn take(&mut self, brick: OpenBrick, rest: &mut Rest<'_>) -> Result<(), String> {
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

    fn made(mut self) -> Table {
        self.table.palette.limit_by_use();
        self.table
    }
}
