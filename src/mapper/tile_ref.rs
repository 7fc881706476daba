use crate::tile::Tile;
use std::ops::Deref;
use std::sync::Arc;

/// Tile of a map, pinned in memory while this value exists.
#[derive(Debug)]
pub struct TileRef<'a>(Held<'a>);

#[derive(Debug)]
enum Held<'a> {
    Borrowed(&'a Tile),
    Shared(Arc<Tile>),
}

impl<'a> TileRef<'a> {
    pub(super) fn borrowed(tile: &'a Tile) -> Self {
        Self(Held::Borrowed(tile))
    }

    pub(super) fn shared(tile: Arc<Tile>) -> Self {
        Self(Held::Shared(tile))
    }
}

impl Deref for TileRef<'_> {
    type Target = Tile;

    fn deref(&self) -> &Tile {
        match &self.0 {
            Held::Borrowed(tile) => tile,
            Held::Shared(tile) => tile,
        }
    }
}
