use crate::space::{Grid, TileIndex, TileSelection};

/// The tiles that updates are collected for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MappedTiles<'a> {
    pub(crate) grid: &'a Grid,
    /// `None` for all of space.
    pub(crate) selection: Option<&'a TileSelection>,
}

impl MappedTiles<'_> {
    /// Whether updates of this tile are wanted.
    #[inline]
    pub(crate) fn has(&self, tile: TileIndex) -> bool {
        self.selection.is_none_or(|selection| selection.contains(tile))
    }
}
