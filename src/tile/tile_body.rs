use super::OctreeFactory;
use super::layers::VoxelLayers;
use super::octocache::VoxelCacheCounts;
use super::octree::{BrickOctree, TileOctree};
use super::table::Table;
use crate::octree::Octree;
use crate::scan::TileUpdates;
use crate::sensor::{Evidence, SensorModel};
use crate::space::{
    BRICK_EDGE, BrickCode, BrickMask, Grid, MortonCode, TileIndex, VoxelBox, VoxelIndex, VoxelKey, places,
};
use serde::Serialize;
use std::ops::AddAssign;

/// Tile of a map: its exact table, and its octree.
#[derive(Clone, Debug)]
pub struct Tile {
    index: TileIndex,
    voxels: VoxelBox,
    table: Table,
    octree: TileOctree,
    is_dirty: bool,
}

/// Observed voxel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Voxel {
    /// Index along x, y and z.
    pub index: VoxelIndex,
    pub evidence: Evidence,
}

/// Sizes of one tile or of several.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct TileCounts {
    /// Number of observed voxels.
    pub voxels: u64,
    /// Number of nodes of the octrees that are up to date.
    pub octree_nodes: u64,
    /// Bytes of memory of tables.
    pub table_bytes: u64,
    /// Bytes of memory of octrees.
    pub octree_bytes: u64,
    /// Bytes of memory of voxel caches and of batches pending for octrees.
    pub voxel_cache_bytes: u64,
    /// Counts of the voxel caches of these tiles.
    pub voxel_cache: VoxelCacheCounts,
}

impl Tile {
    /// Creates a tile without observed voxels.
    pub fn empty(grid: &Grid, octrees: &OctreeFactory, index: TileIndex) -> Self {
        Self::from_table(grid, octrees, index, Table::default())
    }

    /// Creates a tile from a table, and derives its octree.
    pub fn from_table(grid: &Grid, octrees: &OctreeFactory, index: TileIndex, mut table: Table) -> Self {
        let octree = octrees.octree_of(&mut table);
        Self { index, voxels: grid.voxels_of_tile(index), table, octree, is_dirty: false }
    }

    /// Creates a tile for a few queries. Its octree is always a view of the bricks, and not synced: answers are the
    /// same, but coarse queries take longer.
    pub fn uncached(grid: &Grid, index: TileIndex, table: Table) -> Self {
        let octree = TileOctree::Bricks(BrickOctree::default());
        Self { index, voxels: grid.voxels_of_tile(index), table, octree, is_dirty: false }
    }

    /// Index of the tile.
    pub fn index(&self) -> TileIndex {
        self.index
    }

    /// Box of the voxels that belong to the tile.
    pub fn voxel_box(&self) -> VoxelBox {
        self.voxels
    }

    /// The exact table.
    pub fn table(&self) -> &Table {
        &self.table
    }

    /// Returns whether the tile has changed since it was last written or created.
    pub fn is_dirty(&self) -> bool {
        self.is_dirty
    }

    /// Marks the tile as changed.
    pub fn mark_dirty(&mut self) {
        self.is_dirty = true;
    }

    /// Marks the tile as written.
    pub fn mark_clean(&mut self) {
        self.is_dirty = false;
    }

    /// Applies the updates of one scan or batch.
    pub fn apply(&mut self, model: &SensorModel, updates: &TileUpdates) {
        self.is_dirty |= !updates.is_empty();
        self.octree.apply(&mut self.table, model, self.voxels.min, updates);
    }

    /// The evidence of a voxel of this tile; `None` if it was never observed or belongs to another tile.
    #[inline]
    pub fn evidence(&self, voxel: VoxelIndex) -> Option<Evidence> {
        self.voxels.contains(voxel).then(|| self.evidence_of_own(voxel))?
    }

    /// The evidence of a voxel that must belong to this tile.
    #[inline]
    pub fn evidence_of_own(&self, voxel: VoxelIndex) -> Option<Evidence> {
        self.table.get_key(VoxelKey::from_index(voxel))
    }

    /// Largest log-odds, as `f32`, of this tile's voxels under the octree node at `depth` (1 to 16) that contains the
    /// voxel; `None` if all are unknown. At depth 16, [`Tile::evidence`] returns the value without rounding.
    pub fn max_log_odds_under(&self, voxel: VoxelIndex, depth: u8) -> Option<f32> {
        self.octree.max_under(&self.table, VoxelKey::from_index(voxel).morton(), depth)
    }

    /// What the map's layers store of the points that hit a voxel of this tile; `None` without a hit, without layers,
    /// and for voxels of other tiles.
    pub fn layers_of(&self, voxel: VoxelIndex) -> Option<VoxelLayers> {
        let is_own = self.voxels.contains(voxel);
        is_own.then(|| self.table.layers_of(VoxelKey::from_index(voxel).morton()))?
    }

    /// The observed voxels in Morton order.
    pub fn voxels(&self) -> impl Iterator<Item = Voxel> {
        self.table.iter().map(|(code, evidence)| Voxel { index: self.index_of(code), evidence })
    }

    /// The observed voxels whose log-odds are at least a threshold, in Morton order. Bricks of free space are skipped.
    pub fn voxels_from(&self, log_odds: f64) -> impl Iterator<Item = Voxel> {
        let found = self.table.iter_from(log_odds);
        found.map(|(code, evidence)| Voxel { index: self.index_of(code), evidence })
    }

    /// The observed voxels of one brick in Morton order.
    pub fn voxels_of_brick(&self, brick: BrickCode) -> impl Iterator<Item = Voxel> {
        self.table
            .voxels_of_brick(brick)
            .map(|(code, evidence)| Voxel { index: self.index_of(code), evidence })
    }

    /// Visits the bricks with observed voxels that overlap a box, in no particular order: the lowest voxel of the brick,
    /// which may be outside of the tile, the mask of its observed voxels, and the mask of those whose log-odds are at
    /// least a threshold.
    pub fn for_each_brick_in(
        &self,
        voxels: &VoxelBox,
        log_odds: f64,
        mut visit: impl FnMut(VoxelIndex, &BrickMask, &BrickMask),
    ) {
        for brick in self.table.brick_views() {
            let observed = brick.observed();
            // The index of a voxel of the tile is unique, that of the brick's lowest voxel may be outside of it.
            let Some(place) = places(observed).next() else { continue };
            let lowest = self.index_of(brick.code().voxel(place)).map(|k| k & !(BRICK_EDGE - 1));
            let is_inside =
                |k: usize| lowest[k] < voxels.end[k] && lowest[k].saturating_add(BRICK_EDGE) > voxels.min[k];
            if (0..3).all(is_inside) {
                let from = if brick.is_below(log_odds) { [0; 8] } else { brick.mask_from(log_odds) };
                visit(lowest, &observed, &from);
            }
        }
    }

    /// Index of the voxel of this tile with the given code.
    pub fn index_of(&self, code: MortonCode) -> VoxelIndex {
        code.to_key().to_index_from(self.voxels.min)
    }

    /// Returns whether the octree contains all updates.
    pub fn is_octree_synced(&self) -> bool {
        self.octree.is_synced()
    }

    /// Updates the octree. This does not change answers, but speeds them up.
    pub fn sync_octree(&mut self) {
        self.octree.sync(&mut self.table);
    }

    /// OctoMap's tree of the tile, up to date.
    pub fn octree(&self) -> Octree {
        self.octree.tree(&self.table)
    }

    /// Sizes of the tile.
    pub fn counts(&self) -> TileCounts {
        let (octree_bytes, cache_bytes) = self.octree.bytes();
        TileCounts {
            voxels: self.table.len() as u64,
            octree_nodes: self.octree.node_count(),
            table_bytes: self.table.bytes() as u64,
            octree_bytes: octree_bytes as u64,
            voxel_cache_bytes: cache_bytes as u64,
            voxel_cache: self.octree.cache_counts(),
        }
    }

    #[cfg(test)]
    pub(super) fn tile_octree(&self) -> &TileOctree {
        &self.octree
    }

    /// Bytes of memory that the tile occupies.
    pub fn bytes(&self) -> usize {
        let (octree_bytes, cache_bytes) = self.octree.bytes();
        size_of::<Self>() + self.table.bytes() + octree_bytes + cache_bytes
    }
}

impl TileCounts {
    /// Total bytes of memory of tables, octrees and voxel caches.
    pub fn bytes(&self) -> u64 {
        self.table_bytes + self.octree_bytes + self.voxel_cache_bytes
    }
}

impl AddAssign for TileCounts {
    fn add_assign(&mut self, other: Self) {
        self.voxels += other.voxels;
        self.octree_nodes += other.octree_nodes;
        self.table_bytes += other.table_bytes;
        self.octree_bytes += other.octree_bytes;
        self.voxel_cache_bytes += other.voxel_cache_bytes;
        self.voxel_cache += other.voxel_cache;
    }
}
