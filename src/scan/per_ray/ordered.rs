use crate::scan::ScanReport;
use crate::scan::spill::ScanParts;
use crate::scan::updates::{MappedTiles, OrderedUpdates, ScanUpdates, TileUpdates, in_order_of_tiles};
use crate::sensor::Observation;
use crate::space::{TileIndex, VoxelIndex};
use rustc_hash::FxHashMap;

/// Collects updates of voxels in the order in which they count, one list per tile.
pub(crate) struct OrderedCollector<'a> {
    mapped: MappedTiles<'a>,
    keep_intensities: bool,
    lists: Vec<(TileIndex, VoxelIndex, OrderedUpdates)>,
    slots: FxHashMap<TileIndex, usize>,
    /// The slot of the last update: rays mostly stay in a tile.
    latest: usize,
    hits: u64,
    misses: u64,
}

/// Bytes of an update in a list that may be half empty; more with an intensity.
const BYTES_PER_UPDATE: usize = 16;
/// Bytes of a tile beside its updates.
const BYTES_PER_TILE: usize = 256;

impl<'a> OrderedCollector<'a> {
    pub(crate) fn new(mapped: MappedTiles<'a>, keep_intensities: bool) -> Self {
        let (lists, slots) = Default::default();
        Self { mapped, keep_intensities, lists, slots, latest: 0, hits: 0, misses: 0 }
    }

    pub(crate) fn push(&mut self, voxel: VoxelIndex, observation: Observation) {
        let offset_in =
            |min: VoxelIndex| -> VoxelIndex { std::array::from_fn(|k| voxel[k].wrapping_sub(min[k])) };
        let edge = self.mapped.grid.voxels_per_tile_edge();
        let in_latest = |(_, min, _): &&mut (_, VoxelIndex, _)| {
            (0..3).all(|k| min[k] <= voxel[k] && i64::from(voxel[k]) - i64::from(min[k]) < i64::from(edge))
        };
        if let Some((_, min, updates)) = self.lists.get_mut(self.latest).filter(in_latest) {
            updates.push(offset_in(*min), observation, self.keep_intensities);
            return self.count(observation);
        }
        let tile = self.mapped.grid.tile_of_voxel(voxel);
        if !self.mapped.has(tile) {
            return;
        }
        self.latest = *self.slots.entry(tile).or_insert_with(|| {
            let min = self.mapped.grid.voxels_of_tile(tile).min;
            self.lists.push((tile, min, OrderedUpdates::default()));
            self.lists.len() - 1
        });
        let (_, min, updates) = &mut self.lists[self.latest];
        updates.push(offset_in(*min), observation, self.keep_intensities);
        self.count(observation);
    }

    fn count(&mut self, observation: Observation) {
        match observation {
            Observation::Hit(_) => self.hits += 1,
            Observation::Miss => self.misses += 1,
        }
    }

    /// Upper bound of the bytes of memory.
    pub(crate) fn bytes(&self) -> usize {
        BYTES_PER_UPDATE * (self.hits + self.misses) as usize + BYTES_PER_TILE * self.lists.len()
    }

    /// Moves all updates to `parts`.
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
