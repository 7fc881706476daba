use crate::blocks::{BLOCK_EDGE, BlockIndex, may_be_occupied, tiles_in};
use crate::mask_reader::{MaskReader, TilesOfBatch};
use crate::sweep::Sweep;
use crate::tile_masks::Thresholds;
use crate::tops::{Top, Tops};
use crate::volume_options::{MAX_BLOCKS, VolumeOptions};
use serde::Serialize;
use std::collections::BTreeSet;
use voxtile::mapper::MapView;
use voxtile::space::VoxelBox;
use voxtile::{Error, Grid, Result, TileIndex};

/// Volumes between two surfaces, each the highest occupied voxels of its map.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Volumes {
    /// Columns of voxels in which both surfaces are known.
    pub measured: VolumeSums,
    /// Columns in which the voxel above one of the surfaces was not observed: that surface may be higher.
    pub open: VolumeSums,
    /// Area in which only the earlier map has a surface, in square metres.
    pub only_before_m2: f64,
    /// Area in which only the later map has a surface, in square metres.
    pub only_after_m2: f64,
    /// The whole area in square metres: of the region or polygons, or else of all columns with a surface.
    pub area_m2: f64,
    /// Share of the whole area that is measured, 0 to 1; 0 without any area.
    pub measured_share: f64,
}

/// Volumes of some columns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct VolumeSums {
    /// Their area in square metres.
    pub area_m2: f64,
    /// Volume in cubic metres where the later surface is higher.
    pub fill_m3: f64,
    /// Volume in cubic metres where the later surface is lower.
    pub cut_m3: f64,
    /// Fill without cut, in cubic metres.
    pub net_m3: f64,
}

/// Computes the volumes between the surfaces of two maps: what was filled, and what was cut.
///
/// The surface of a column of voxels is its highest occupied voxel. It is *measured* only if the voxel above it was seen
/// free: a scanner that sees the side of a heap, but not its top, does not make a lower heap.
///
/// The maps need equal resolutions; their tiles may differ. `progress` receives the number of blocks done and in total.
///
/// # Errors
///
/// Fails if the resolutions differ, an option is invalid, a tile cannot be read, or with [`Error::Stopped`].
pub fn volumes<A: MapView, B: MapView>(
    before: &A,
    after: &B,
    options: &VolumeOptions,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Volumes> {
    let (grid, other) = (before.config().grid, after.config().grid);
    if grid.resolution_m() != other.resolution_m() {
        let reason = format!(
            "surfaces of voxels of {} m and {} m cannot be compared: build one of the maps again with the resolution \
             of the other (`voxtile remap -o` for a map that keeps its scans)",
            grid.resolution_m(),
            other.resolution_m()
        );
        return Err(Error::argument("maps", reason));
    }
    let least_voxels = options.least_voxels(&grid)?;
    let columns = Columns::new(grid, options)?;
    let mut before = SurfaceReader::new(before, options);
    let mut after = SurfaceReader::new(after, options);
    let blocks = columns.blocks([before.map_blocks(), after.map_blocks()])?;
    let mut totals = Totals::default();
    Sweep { blocks: &blocks, memory_bytes: options.memory_bytes / 2, stop: &options.stop, progress }.run(
        |blocks| Ok((before.read(&columns, blocks)?, after.read(&columns, blocks)?)),
        |block, (of_before, of_after)| {
            let (voxels, mut totals) = (columns.voxels_of(block), Totals::default());
            let (old, new) = (of_before.tops(&voxels), of_after.tops(&voxels));
            columns.for_each(&voxels, |column| {
                let surfaces = (old.at(column), new.at(column));
                totals.add(surfaces, |old, new| {
                    let higher = i64::from(new) - i64::from(old);
                    if higher.unsigned_abs() < least_voxels { 0 } else { higher }
                });
            });
            Ok(totals)
        },
        |_, of_block| {
            totals.add_all(&of_block);
            Ok(())
        },
    )?;
    Ok(totals.finish(&columns, Level::Surface))
}

/// Computes the volumes between a horizontal plane at a height in metres and the surface of a map: above the plane as
/// fill, below it as cut. The surface is at the middle of the highest occupied voxels; see [`volumes`].
///
/// # Errors
///
/// Fails if the height is not finite, an option is invalid, a tile cannot be read, or with [`Error::Stopped`].
pub fn volumes_over_plane<V: MapView>(
    map: &V,
    height_m: f64,
    options: &VolumeOptions,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<Volumes> {
    if !height_m.is_finite() {
        return Err(Error::argument("plane", format!("must be a finite height, not {height_m}")));
    }
    let columns = Columns::new(map.config().grid, options)?;
    let mut reader = SurfaceReader::new(map, options);
    let blocks = columns.blocks([reader.map_blocks(), BTreeSet::new()])?;
    let mut totals = Totals::default();
    let grid = columns.grid;
    Sweep { blocks: &blocks, memory_bytes: options.memory_bytes / 2, stop: &options.stop, progress }.run(
        |blocks| reader.read(&columns, blocks),
        |block, loaded| {
            let (voxels, mut totals) = (columns.voxels_of(block), Totals::default());
            let tops = loaded.tops(&voxels);
            columns.for_each(&voxels, |column| match tops.at(column) {
                Some(top) => {
                    let is_above = grid.center_m([0, 0, top.z])[2] >= height_m;
                    totals.sums(top.is_seen).add(i64::from(top.z), is_above);
                }
                None => totals.without += 1,
            });
            Ok(totals)
        },
        |_, of_block| {
            totals.add_all(&of_block);
            Ok(())
        },
    )?;
    Ok(totals.finish(&columns, Level::Plane(height_m)))
}

/// From where heights in voxels count.
#[derive(Clone, Copy)]
enum Level {
    Surface,
    /// Height in metres.
    Plane(f64),
}

/// Sums over columns, in whole voxels: they do not depend on the order.
#[derive(Clone, Copy, Default)]
struct HeightSums {
    columns: u64,
    /// Columns with fill and with cut, each with the sum of their heights.
    fill: (u64, i128),
    cut: (u64, i128),
}

impl HeightSums {
    fn add(&mut self, height: i64, is_fill: bool) {
        self.columns += 1;
        let (columns, heights) = if is_fill { &mut self.fill } else { &mut self.cut };
        *columns += 1;
        *heights += i128::from(height);
    }

    fn add_all(&mut self, other: &Self) {
        self.columns += other.columns;
        self.fill = (self.fill.0 + other.fill.0, self.fill.1 + other.fill.1);
        self.cut = (self.cut.0 + other.cut.0, self.cut.1 + other.cut.1);
    }

    fn volumes(&self, resolution_m: f64, level: Level) -> VolumeSums {
        let cell_m2 = resolution_m * resolution_m;
        let volume_m3 = |(columns, heights): (u64, i128)| {
            let heights_m = match level {
                Level::Surface => heights as f64 * resolution_m,
                Level::Plane(plane_m) => {
                    heights as f64 * resolution_m + columns as f64 * (resolution_m / 2.0 - plane_m)
                }
            };
            heights_m * cell_m2
        };
        let (fill_m3, cut_m3) = (volume_m3(self.fill), -volume_m3(self.cut));
        VolumeSums {
            area_m2: self.columns as f64 * cell_m2,
            fill_m3,
            // No cut is 0, not -0.
            cut_m3: cut_m3 + 0.0,
            net_m3: fill_m3 - cut_m3,
        }
    }
}

#[derive(Clone, Copy, Default)]
struct Totals {
    measured: HeightSums,
    open: HeightSums,
    only_before: u64,
    only_after: u64,
    /// Columns of the area without a surface.
    without: u64,
}

impl Totals {
    fn sums(&mut self, is_measured: bool) -> &mut HeightSums {
        if is_measured { &mut self.measured } else { &mut self.open }
    }

    fn add(&mut self, surfaces: (Option<Top>, Option<Top>), higher: impl Fn(i32, i32) -> i64) {
        match surfaces {
            (Some(old), Some(new)) => {
                let height = higher(old.z, new.z);
                self.sums(old.is_seen && new.is_seen).add(height, height >= 0);
            }
            (Some(_), None) => self.only_before += 1,
            (None, Some(_)) => self.only_after += 1,
            (None, None) => self.without += 1,
        }
    }

    fn add_all(&mut self, other: &Self) {
        self.measured.add_all(&other.measured);
        self.open.add_all(&other.open);
        self.only_before += other.only_before;
        self.only_after += other.only_after;
        self.without += other.without;
    }

    fn finish(&self, columns: &Columns<'_>, level: Level) -> Volumes {
        let resolution_m = columns.grid.resolution_m();
        let cell_m2 = resolution_m * resolution_m;
        let with_surface = self.measured.columns + self.open.columns + self.only_before + self.only_after;
        let all = match columns.is_bounded() {
            true => with_surface + self.without,
            false => with_surface,
        };
        let share = if all == 0 { 0.0 } else { self.measured.columns as f64 / all as f64 };
        Volumes {
            measured: self.measured.volumes(resolution_m, level),
            open: self.open.volumes(resolution_m, level),
            only_before_m2: self.only_before as f64 * cell_m2,
            only_after_m2: self.only_after as f64 * cell_m2,
            area_m2: all as f64 * cell_m2,
            measured_share: share,
        }
    }
}

/// The columns of voxels whose surfaces are wanted.
struct Columns<'a> {
    grid: Grid,
    options: &'a VolumeOptions,
    region: Option<VoxelBox>,
}

impl<'a> Columns<'a> {
    fn new(grid: Grid, options: &'a VolumeOptions) -> Result<Self> {
        let region = options.region.map(|region| grid.voxels_in(&region));
        Ok(Self { grid, options, region })
    }

    /// Whether the area has bounds of its own, besides those of the maps.
    fn is_bounded(&self) -> bool {
        self.region.is_some() || self.options.area.is_some()
    }

    /// The blocks of columns, with z = 0: those of the area, or else those of the maps.
    fn blocks(&self, of_maps: [BTreeSet<[i32; 2]>; 2]) -> Result<Vec<BlockIndex>> {
        let Some([min, end]) = self.bounds() else {
            let [mut all, mut others] = of_maps;
            all.append(&mut others);
            return Ok(all.into_iter().map(|[x, y]| [x, y, 0]).collect());
        };
        if min[0] >= end[0] || min[1] >= end[1] {
            return Ok(Vec::new());
        }
        let [first, last] = [min, end.map(|k| k - 1)].map(|corner| corner.map(|k| k.div_euclid(BLOCK_EDGE)));
        let count = (0..2).map(|k| last[k] - first[k] + 1).try_fold(1, i64::checked_mul);
        if count.is_none_or(|count| count > MAX_BLOCKS) {
            let reason = format!("has more than {MAX_BLOCKS} blocks of {BLOCK_EDGE} x {BLOCK_EDGE} voxels");
            return Err(Error::argument("area", reason));
        }
        let blocks = (first[0]..=last[0]).flat_map(|x| (first[1]..=last[1]).map(move |y| [x, y]));
        Ok(blocks.map(|[x, y]| [x as i32, y as i32, 0]).collect())
    }

    /// Lowest voxel indices along x and y, and one past the highest, of the region and the polygons.
    fn bounds(&self) -> Option<[[i64; 2]; 2]> {
        let of_region = self.region.map(|voxels| {
            [voxels.min, voxels.end].map(|corner| [i64::from(corner[0]), i64::from(corner[1])])
        });
        let of_area = self.options.area.as_ref().map(|area| {
            let [low, high] = area.bounds_m();
            let index = |coordinate: f64| (coordinate / self.grid.resolution_m()).floor() as i64;
            // A margin for rounding; the exact columns are those of the mask.
            [low.map(|k| index(k).saturating_sub(1)), high.map(|k| index(k).saturating_add(2))]
        });
        match (of_region, of_area) {
            (Some([a, b]), Some([c, d])) => {
                Some([[a[0].max(c[0]), a[1].max(c[1])], [b[0].min(d[0]), b[1].min(d[1])]])
            }
            (region, area) => region.or(area),
        }
        .map(|corners| corners.map(|corner| corner.map(|k| k.clamp(i32::MIN.into(), i32::MAX.into()))))
    }

    /// The voxels of the columns of a block in which surfaces are looked for.
    fn voxels_of(&self, [x, y, _]: BlockIndex) -> VoxelBox {
        let limits = |index: i32| {
            let first = i64::from(index) * BLOCK_EDGE;
            [first, first + BLOCK_EDGE].map(|k| k.clamp(i32::MIN.into(), i32::MAX.into()) as i32)
        };
        let ([x, x_end], [y, y_end]) = (limits(x), limits(y));
        let block = VoxelBox { min: [x, y, i32::MIN], end: [x_end, y_end, i32::MAX] };
        self.region.map_or(block, |region| block.intersection(&region))
    }

    fn for_each(&self, voxels: &VoxelBox, mut visit: impl FnMut([i32; 2])) {
        let mask = self.options.area.as_ref().map(|area| area.columns(&self.grid, voxels));
        for y in voxels.min[1]..voxels.end[1] {
            for x in voxels.min[0]..voxels.end[0] {
                if mask.as_ref().is_none_or(|mask| mask.contains([x, y])) {
                    visit([x, y]);
                }
            }
        }
    }
}

/// Reader of the surfaces of a map.
struct SurfaceReader<'a, V> {
    reader: MaskReader<'a, V>,
}

/// Tiles of a batch of blocks.
struct LoadedTiles {
    tiles: Vec<TileIndex>,
    masks: TilesOfBatch,
    grid: Grid,
}

impl<'a, V: MapView> SurfaceReader<'a, V> {
    fn new(map: &'a V, options: &VolumeOptions) -> Self {
        let occupied = map.config().occupied_log_odds();
        let thresholds = Thresholds::of(map, occupied.max(0.0));
        Self { reader: MaskReader::new(map, thresholds, options.memory_bytes / 4) }
    }

    /// The blocks of columns with tiles that may have occupied voxels.
    fn map_blocks(&self) -> BTreeSet<[i32; 2]> {
        let map = self.reader.map();
        let grid = &map.config().grid;
        let mut blocks = BTreeSet::new();
        for tile in map.tile_indices().into_iter().filter(|&tile| may_be_occupied(map, tile)) {
            let voxels = grid.voxels_of_tile(tile);
            let [first, last] = [voxels.min, voxels.end.map(|k| k.saturating_sub(1))]
                .map(|corner| [corner[0], corner[1]].map(|k| k.div_euclid(BLOCK_EDGE as i32)));
            for x in first[0]..=last[0] {
                blocks.extend((first[1]..=last[1]).map(|y| [x, y]));
            }
        }
        blocks
    }

    fn read(&mut self, columns: &Columns<'_>, blocks: &[BlockIndex]) -> Result<LoadedTiles> {
        let map = self.reader.map();
        let mut tiles = BTreeSet::new();
        for &block in blocks {
            let mut voxels = columns.voxels_of(block);
            // The voxel above a surface belongs to the question.
            voxels.end[2] = voxels.end[2].saturating_add(1);
            tiles.extend(tiles_in(map, &voxels));
        }
        let tiles: Vec<TileIndex> = tiles.into_iter().collect();
        Ok(LoadedTiles { masks: self.reader.read(&tiles)?, tiles, grid: map.config().grid })
    }
}

impl LoadedTiles {
    fn tops(&self, voxels: &VoxelBox) -> Tops {
        let [first, last] = [[voxels.min[0], voxels.min[1]], [voxels.end[0] - 1, voxels.end[1] - 1]]
            .map(|[x, y]| self.grid.tile_of_voxel([x, y, 0]));
        let is_near =
            |tile: &&TileIndex| (first.x..=last.x).contains(&tile.x) && (first.y..=last.y).contains(&tile.y);
        let tiles: Vec<TileIndex> = self.tiles.iter().filter(is_near).copied().collect();
        Tops::of(voxels, &tiles, &self.masks)
    }
}
