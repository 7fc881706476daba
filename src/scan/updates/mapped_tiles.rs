use crate::space::{Grid, TileIndex, TileSelection};

/// Tiles for which updates are collected.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MappedTiles<'a> {
    pub(crate) grid: &'a Grid,
    /// `None` for the whole space.
    pub(crate) selection: Option<&'a TileSelection>,
}

impl MappedTiles<'_> {
    /// Returns whether updates of this tile are collected.
    #[inline]
    pub(crate) fn has(&self, tile: TileIndex) -> bool {
        self.selection.is_none_or(|selection| selection.contains(tile))
    }
}
