use crate::scan::ScanReport;
use crate::scan::spill::ScanParts;
use crate::scan::updates::{MappedTiles, OrderedUpdates, ScanUpdates, TileUpdates, in_order_of_tiles};
use crate::sensor::Observation;
use crate::space::{TileIndex, VoxelBox, VoxelIndex};
use rustc_hash::FxHashMap;

/// Collector of voxel updates in the order of the rays, one list per tile.
pub(crate) struct OrderedCollector<'a> {
    mapped: MappedTiles<'a>,
    keep_intensities: bool,
    lists: Vec<(TileIndex, VoxelBox, OrderedUpdates)>,
    slots: FxHashMap<TileIndex, usize>,
    /// Slot of the last update: consecutive updates are mostly in the same tile.
    latest: usize,
    hits: u64,
    misses: u64,
}

/// Maximum bytes of an update: four for the voxel and four for the intensity, in lists that may be half empty.
const BYTES_PER_UPDATE: usize = 16;
/// Bytes of a tile in addition to its updates.
const BYTES_PER_TILE: usize = 256;

impl<'a> OrderedCollector<'a> {
    pub(crate) fn new(mapped: MappedTiles<'a>, keep_intensities: bool) -> Self {
        let (lists, slots) = Default::default();
        Self { mapped, keep_intensities, lists, slots, latest: 0, hits: 0, misses: 0 }
    }

    pub(crate) fn push(&mut self, voxel: VoxelIndex, observation: Observation) {
        let offset_in =
            |tile: &VoxelBox| -> VoxelIndex { std::array::from_fn(|k| voxel[k].wrapping_sub(tile.min[k])) };
        // Boxes of tiles are clipped to the index range, so this test is also exact for tiles at the limits of the
        // range.
        let in_latest = |(_, tile, _): &&mut (_, VoxelBox, _)| tile.contains(voxel);
        if let Some((_, tile, updates)) = self.lists.get_mut(self.latest).filter(in_latest) {
            updates.push(offset_in(tile), observation, self.keep_intensities);
            return self.count(observation);
        }
        let tile = self.mapped.grid.tile_of_voxel(voxel);
        if !self.mapped.has(tile) {
            return;
        }
        self.latest = *self.slots.entry(tile).or_insert_with(|| {
            let voxels = self.mapped.grid.voxels_of_tile(tile);
            self.lists.push((tile, voxels, OrderedUpdates::default()));
            self.lists.len() - 1
        });
        let (_, voxels, updates) = &mut self.lists[self.latest];
        updates.push(offset_in(voxels), observation, self.keep_intensities);
        self.count(observation);
    }

    fn count(&mut self, observation: Observation) {
        match observation {
            Observation::Hit(_) => self.hits += 1,
            Observation::Miss => self.misses += 1,
        }
    }

    /// Upper bound on the bytes of memory.
    pub(crate) fn bytes(&self) -> usize {
        BYTES_PER_UPDATE * (self.hits + self.misses) as usize + BYTES_PER_TILE * self.lists.len()
    }

    pub(crate) fn drain_to(&mut self, parts: &ScanParts<'_>) {
        self.slots.clear();
        (self.hits, self.misses) = (0, 0);
        parts.add(self.lists.drain(..).map(|(tile, _, updates)| {
            let counts = updates.hits_and_misses();
            (tile, TileUpdates::Ordered(updates), counts)
        }));
    }

    pub(crate) fn into_updates(self, mut report: ScanReport) -> ScanUpdates {
        report.hits += self.hits;
        report.misses += self.misses;
        let tiles =
            self.lists.into_iter().map(|(tile, _, updates)| (tile, TileUpdates::Ordered(updates))).collect();
        in_order_of_tiles(self.mapped.grid, tiles, report)
    }
}
