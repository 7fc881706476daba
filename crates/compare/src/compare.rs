use crate::bits::Bits;
use crate::block_bits::BlockBits;
use crate::blocks::{BlockIndex, Cube, blocks_of, may_be_occupied};
use crate::change::{Comparison, EpochCounts};
use crate::classify::{ClassBits, NOT_SEEN, reach};
use crate::collected::Collected;
use crate::components::Components;
use crate::hidden::hidden;
use crate::joined::BlockParts;
use crate::mask_reader::{MaskReader, TilesOfBatch};
use crate::options::CompareOptions;
use crate::sweep::Sweep;
use crate::tile_masks::Thresholds;
use crate::voxel_class::VoxelClass;
use rustc_hash::FxHashSet;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use voxtile::mapper::MapView;
use voxtile::space::VoxelBox;
use voxtile::{Error, Grid, Result, TileIndex};

/// Compares two maps: finds which occupied voxels of each are unchanged, changed or not seen in the other one, and lists
/// the clusters of changed voxels.
///
/// The maps need equal resolutions; their tiles may differ. `progress` receives the number of blocks done and in total.
///
/// ```
/// use voxtile::{InMemoryMapper, MapConfig, Mapper, Scan};
/// use voxtile_compare::{ChangeKind, CompareOptions, compare};
///
/// # fn main() -> voxtile::Result<()> {
/// // Nine rays end at a distance along x.
/// let map_of = |x: f64| -> voxtile::Result<InMemoryMapper> {
///     let slopes = [-0.03, 0.02, 0.07];
///     let points = slopes.iter().flat_map(|y| slopes.iter().map(move |z| [x, x * y, x * z]));
///     let scan = Scan { points: points.collect(), ..Scan::default() };
///     let mut map = InMemoryMapper::new(MapConfig::new(0.1, 10.0)?)?;
///     for _ in 0..3 {
///         map.insert_scan(&scan)?;
///     }
///     Ok(map)
/// };
/// // The rays that ended at 2 m pass through to 4 m.
/// let options = CompareOptions::default().with_min_voxels(1);
/// let comparison = compare(&map_of(2.05)?, &map_of(4.05)?, &options, &|_, _| {})?;
/// assert_eq!(comparison.changes[0].kind, ChangeKind::Vanished);
/// assert_eq!(comparison.after.not_seen, 9); // No ray reached 4 m before.
/// # Ok(())
/// # }
/// ```
///
/// # Errors
///
/// Fails if the resolutions differ, an option is invalid, a tile cannot be read, or with [`Error::Stopped`].
pub fn compare<A: MapView, B: MapView>(
    before: &A,
    after: &B,
    options: &CompareOptions,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Comparison> {
    let comparer = Comparer::new(before, after, options)?;
    let mut collected = Collected::new(&comparer);
    comparer.for_each_block(
        &VoxelClass::ALL,
        progress,
        |block, classes| comparer.block_result(block, classes),
        |block, result| {
            collected.take(block, result);
            Ok(())
        },
    )?;
    Ok(collected.finish())
}

/// The classes of clustered voxels: vanished, then appeared.
pub(crate) const KINDS: [VoxelClass; 2] = [VoxelClass::Vanished, VoxelClass::Appeared];

/// Two maps, with checked options.
pub(crate) struct Comparer<'a, A, B> {
    before: &'a A,
    after: &'a B,
    pub(crate) options: &'a CompareOptions,
    pub(crate) tolerance_voxels: u32,
    pub(crate) certain_log_odds: f64,
    /// Voxels of the region.
    region: Option<VoxelBox>,
    /// The blocks to compare, of all; `None` for all.
    span: Option<Range<u64>>,
}

/// Result of a block.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct BlockResult {
    pub(crate) counts: [EpochCounts; 2],
    /// By [`KINDS`].
    pub(crate) parts: [BlockParts; 2],
}

/// Masks of the tiles of both maps.
struct LoadedTiles([TilesOfBatch; 2]);

impl<'a, A: MapView, B: MapView> Comparer<'a, A, B> {
    pub(crate) fn new(before: &'a A, after: &'a B, options: &'a CompareOptions) -> Result<Self> {
        let (grid, other) = (before.config().grid, after.config().grid);
        if grid.resolution_m() != other.resolution_m() {
            let reason = format!(
                "voxels of {} m and {} m cannot be compared: build one of the maps again with the resolution of the \
                 other (`voxtile remap -o` for a map that keeps its scans)",
                grid.resolution_m(),
                other.resolution_m()
            );
            return Err(Error::argument("maps", reason));
        }
        Ok(Self {
            before,
            after,
            options,
            tolerance_voxels: options.tolerance_voxels(&grid)?,
            certain_log_odds: options.certain_log_odds()?,
            region: options.region.map(|region| grid.voxels_in(&region)),
            span: None,
        })
    }

    /// Limits the comparison to some of its blocks.
    pub(crate) fn with_span(self, span: Range<u64>) -> Self {
        Self { span: Some(span), ..self }
    }

    pub(crate) fn grid(&self) -> &Grid {
        &self.before.config().grid
    }

    /// Counts of no voxels.
    pub(crate) fn counts(&self) -> [EpochCounts; 2] {
        let [earlier, later] = self.is_hidden_known().map(|is_known| is_known.then_some(0));
        [later, earlier].map(|hidden| EpochCounts { hidden, ..EpochCounts::default() })
    }

    /// Whether the positions of the earlier and of the later map's sensor are known, which hidden voxels need.
    fn is_hidden_known(&self) -> [bool; 2] {
        [0, 1].map(|k| self.options.viewpoints[k].is_some())
    }

    /// Classifies the voxels of all blocks with occupied voxels. Hidden voxels are only looked for if `wanted` has
    /// a class of voxels that are not seen.
    pub(crate) fn for_each_block<T: Send>(
        &self,
        wanted: &[VoxelClass],
        progress: &(dyn Fn(u64, u64) + Sync),
        work: impl Fn(BlockIndex, &ClassBits) -> Result<T> + Sync,
        take: impl FnMut(BlockIndex, T) -> Result<()>,
    ) -> Result<()> {
        let options = self.options;
        let thresholds = [
            Thresholds::of(self.before, self.certain_log_odds),
            Thresholds::of(self.after, self.certain_log_odds),
        ];
        let cache_bytes = options.memory_bytes / 4;
        let mut before = MaskReader::new(self.before, thresholds[0], cache_bytes);
        let mut after = MaskReader::new(self.after, thresholds[1], cache_bytes);
        let blocks = self.blocks();
        let sweep =
            Sweep { blocks: &blocks, memory_bytes: options.memory_bytes / 2, stop: &options.stop, progress };
        sweep.run(
            |blocks| {
                let tiles = [self.tiles_around(blocks, before.map()), self.tiles_around(blocks, after.map())];
                Ok(LoadedTiles([before.read(&tiles[0])?, after.read(&tiles[1])?]))
            },
            |block, loaded| work(block, &self.classes_of(block, loaded, wanted)?),
            take,
        )
    }

    /// The blocks with occupied voxels of the span, in order.
    pub(crate) fn blocks(&self) -> Vec<BlockIndex> {
        let grid = &self.before.config().grid;
        let mut blocks = blocks_of(grid, occupied_tiles(self.before));
        blocks.extend(blocks_of(&self.after.config().grid, occupied_tiles(self.after)));
        blocks.sort_unstable();
        blocks.dedup();
        if let Some(region) = self.region {
            blocks.retain(|&block| {
                let [min, end] = Cube::of_block(block).positions_of(&region);
                (0..3).all(|k| min[k] < end[k])
            });
        }
        if let Some(span) = &self.span {
            let [first, end] = [span.start, span.end].map(|k| (k as usize).min(blocks.len()));
            blocks = blocks.drain(first..end.max(first)).collect();
        }
        blocks
    }

    /// The tiles of a map that overlap blocks or their surroundings.
    fn tiles_around(&self, blocks: &[BlockIndex], map: &impl MapView) -> Vec<TileIndex> {
        let cubes = blocks.iter().map(|&block| Cube::of_block(block).grown(reach(self.tolerance_voxels)));
        let tiles: FxHashSet<TileIndex> = cubes.flat_map(|cube| cube.tiles(map)).collect();
        let mut tiles: Vec<TileIndex> = tiles.into_iter().collect();
        tiles.sort_unstable();
        tiles
    }

    fn classes_of(
        &self,
        block: BlockIndex,
        LoadedTiles(loaded): &LoadedTiles,
        wanted: &[VoxelClass],
    ) -> Result<ClassBits> {
        let own = Cube::of_block(block);
        let cube = own.grown(reach(self.tolerance_voxels));
        let before = BlockBits::of(cube, &cube.tiles(self.before), &loaded[0]);
        let after = BlockBits::of(cube, &cube.tiles(self.after), &loaded[1]);
        let mut inside = Bits::new(cube);
        let [min, end] = match &self.region {
            Some(region) => own.positions_of(region),
            None => [[0; 3], [own.edge; 3]],
        };
        let moved = |place: [usize; 3]| place.map(|k| k + reach(self.tolerance_voxels) as usize);
        inside.add_box(moved(min), moved(end));
        let mut classes = ClassBits::of(&before, &after, &inside, self.tolerance_voxels);
        for (number, not_seen) in NOT_SEEN.into_iter().enumerate() {
            let Some(viewpoints) = &self.options.viewpoints[number] else { continue };
            if not_seen.iter().any(|class| wanted.contains(class)) {
                let voxels = classes.of_class(not_seen[0]);
                let found = match number {
                    0 => hidden(self.before, viewpoints, voxels)?,
                    _ => hidden(self.after, viewpoints, voxels)?,
                };
                classes.hide(not_seen, found);
            }
        }
        Ok(classes)
    }

    pub(crate) fn block_result(&self, block: BlockIndex, classes: &ClassBits) -> Result<BlockResult> {
        let mut components = KINDS.map(|class| Components::of(classes.of_class(class)));
        let [vanished, appeared] = &mut components;
        if !self.before.config().layers().is_none() {
            vanished.add_layers(self.before)?;
        }
        if !self.after.config().layers().is_none() {
            appeared.add_layers(self.after)?;
        }
        let parts = components.map(|components| BlockParts::of(components, block));
        Ok(BlockResult { counts: classes.counts(self.is_hidden_known()), parts })
    }
}

/// The tiles of a map that may have occupied voxels.
fn occupied_tiles(map: &impl MapView) -> impl Iterator<Item = TileIndex> {
    map.tile_indices().into_iter().filter(|&tile| may_be_occupied(map, tile))
}
