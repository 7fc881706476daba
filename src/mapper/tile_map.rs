use crate::space::{Grid, TileIndex, TileSpace, Torus};
use crate::tile::{OctreeFactory, Tile};

/// The tiles of a map that lives in memory.
#[derive(Debug)]
pub(super) struct TileMap {
    /// In order of their first update.
    tiles: Vec<Tile>,
    /// The number of each, from 1.
    directory: Torus,
    /// Where they are.
    space: TileSpace,
    /// In place of a tile that is not there.
    nothing: Tile,
}

impl TileMap {
    pub(super) fn new(grid: &Grid) -> Self {
        let nothing = Tile::empty(grid, &OctreeFactory::default(), TileIndex::default());
        Self { tiles: Vec::new(), directory: Torus::default(), space: TileSpace::default(), nothing }
    }

    #[inline]
    pub(super) fn get(&self, index: TileIndex) -> Option<&Tile> {
        self.tiles.get((self.directory.get(index.to_array()) as usize).wrapping_sub(1))
    }

    /// The tile, or one in which nothing was observed; without a branch, for which of them cannot be guessed.
    #[inline]
    pub(super) fn get_or_nothing(&self, index: TileIndex) -> &Tile {
        self.get(index).unwrap_or(&self.nothing)
    }

    /// The place of a tile among [`TileMap::tiles`]; it is made if it is not there.
    pub(super) fn number_of(&mut self, grid: &Grid, octrees: &OctreeFactory, index: TileIndex) -> usize {
        let mut number = self.directory.get(index.to_array());
        if number == Torus::NONE {
            self.tiles.push(Tile::empty(grid, octrees, index));
            self.space.insert(index);
            number = self.tiles.len() as u32;
            self.directory.insert(index.to_array(), number);
        }
        number as usize - 1
    }

    /// Where the tiles are.
    pub(super) fn space(&self) -> &TileSpace {
        &self.space
    }

    /// The tiles.
    pub(super) fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    /// The tiles, to change.
    pub(super) fn tiles_mut(&mut self) -> &mut [Tile] {
        &mut self.tiles
    }
}
