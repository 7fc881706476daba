use crate::space::{Grid, TileIndex, TileSpace, Torus};
use crate::tile::{OctreeFactory, Tile};

#[derive(Debug)]
pub(super) struct TileMap {
    /// In the order of their first update.
    tiles: Vec<Tile>,
    /// Number of each tile in `tiles`, from 1.
    directory: Torus,
    space: TileSpace,
    /// Empty tile, returned for tiles that do not exist.
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

    /// Returns the tile, or an empty one if it does not exist. Branchless, because the branch would be unpredictable.
    #[inline]
    pub(super) fn get_or_nothing(&self, index: TileIndex) -> &Tile {
        self.get(index).unwrap_or(&self.nothing)
    }

    /// Returns the position of a tile in [`TileMap::tiles`]; creates the tile if it does not exist.
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

    pub(super) fn space(&self) -> &TileSpace {
        &self.space
    }

    pub(super) fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    pub(super) fn tiles_mut(&mut self) -> &mut [Tile] {
        &mut self.tiles
    }
}
