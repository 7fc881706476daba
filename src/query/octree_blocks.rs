use super::octree_reach::{REACH, out_of_reach};
use super::octree_shift::OctreeShift;
use super::region::voxels_around;
use crate::error::{Error, Result};
use crate::mapper::{MapView, TileRef};
use crate::octree::{BrickValues, BtPruning, NodeColour, OctreeFormat, OctreeStream, StreamOutcome};
use crate::space::{Aabb, BRICK_EDGE, MortonCode, TileIndex, VoxelBox, VoxelIndex};
use std::io::{self, Read, Seek, Write};

/// Parameters of [`MapQueries::write_octree`](super::MapQueries::write_octree).
#[derive(Clone, Copy, Debug)]
pub struct OctreeExport<'a> {
    /// `.bt` or `.ot`. In `.bt` a voxel is occupied from the map's occupancy threshold on. In `.ot` of a `ColorOcTree` a
    /// voxel has the mean colour of its points; it is white if the map does not have the layer.
    pub format: OctreeFormat,
    /// Restricts the export to voxels whose center is in this half-open box; `None` exports the whole map.
    pub region: Option<&'a Aabb>,
    /// The voxel of the map that becomes voxel 0 of the file. The coordinates of the file are those of the map minus
    /// this voxel's lower corner, so that a map far from its origin fits OctoMap's keys. `[0; 3]` means no shift.
    pub origin: VoxelIndex,
    /// Bytes of memory for the part of the tree that is built at a time, in addition to one tile and a few bytes per
    /// part. With less memory, tiles are read more often.
    pub memory_bytes: usize,
}

/// Depth of bricks, which are not subdivided further.
const BRICK_DEPTH: u8 = 13;

pub(super) fn write_octree<E: From<Error> + From<io::Error>>(
    view: &impl MapView,
    export: &OctreeExport<'_>,
    spool: &mut (impl Read + Write + Seek),
    out: &mut impl Write,
) -> std::result::Result<u64, E> {
    let config = view.config();
    let mut pruning = BtPruning::default();
    loop {
        spool.rewind()?;
        let mut stream = match export.format {
            OctreeFormat::Bt => OctreeStream::bt(config.occupied_log_odds() as f32, pruning, &mut *spool),
            OctreeFormat::Ot => OctreeStream::ot(&mut *spool),
            OctreeFormat::ColorOt => OctreeStream::color_ot(&mut *spool),
        };
        // The rest of the memory is for the encoded values: up to six bytes per voxel in `.ot`, ten with a colour.
        let block_bytes = match export.format {
            OctreeFormat::Bt => export.memory_bytes / 3 * 2,
            OctreeFormat::Ot | OctreeFormat::ColorOt => export.memory_bytes / 3,
        };
        let values = match export.format {
            OctreeFormat::ColorOt => BrickValues::with_colours(),
            OctreeFormat::Bt | OctreeFormat::Ot => BrickValues::default(),
        };
        for_each_block(
            view,
            export.region,
            export.origin,
            block_bytes,
            values,
            |first, depth, values| -> std::result::Result<(), E> {
                Ok(stream.add_block(first, depth, values)?)
            },
        )?;
        match stream.finish(config.grid.resolution_m(), out)? {
            StreamOutcome::Written { voxels, .. } => return Ok(voxels),
            StreamOutcome::Again(further) => pruning = further,
        }
    }
}

/// Visits the map's voxels as blocks of OctoMap's tree, in Morton order, with the first voxel, depth and values of
/// each. A block has at most `block_bytes` of values, unless it is a single brick. `values` is empty.
fn for_each_block<E: From<Error>>(
    view: &impl MapView,
    region: Option<&Aabb>,
    origin: VoxelIndex,
    block_bytes: usize,
    values: BrickValues,
    visit: impl FnMut(MortonCode, u8, &mut BrickValues) -> std::result::Result<(), E>,
) -> std::result::Result<(), E> {
    let shift = OctreeShift::by(origin);
    let tiles = tiles_of(view, region, &shift)?;
    let mut blocks = Blocks { view, region, shift, block_bytes, values, visit };
    blocks.descend(MortonCode(0), 0, &tiles)
}

/// Returns the tiles that may have voxels for the tree; fails if any exceeds the key range.
fn tiles_of(view: &impl MapView, region: Option<&Aabb>, shift: &OctreeShift) -> Result<Vec<TileIndex>> {
    let grid = &view.config().grid;
    let around = region.map(|region| voxels_around(grid, region));
    let mut tiles = view.tile_indices();
    tiles.retain(|&index| {
        around.is_none_or(|around| !around.intersection(&grid.voxels_of_tile(index)).is_empty())
    });
    let mut within_reach = Vec::with_capacity(tiles.len());
    for &index in &tiles {
        let voxels = shift.of_box(&grid.voxels_of_tile(index));
        let in_reach = REACH.intersection(&voxels);
        if in_reach != voxels
            && let Some(tile) = view.tile_uncached(index)?
            && let Some(outside) = first_outside(view, &tile, region, shift)
        {
            return Err(out_of_reach(grid, outside, Some(&tiles)));
        }
        if !in_reach.is_empty() {
            within_reach.push(index);
        }
    }
    Ok(within_reach)
}

fn first_outside(
    view: &impl MapView,
    tile: &TileRef<'_>,
    region: Option<&Aabb>,
    shift: &OctreeShift,
) -> Option<VoxelIndex> {
    let grid = &view.config().grid;
    let wanted = |voxel| region.is_none_or(|region| region.contains(grid.center_m(voxel)));
    let mut voxels = tile.voxels().map(|voxel| voxel.index);
    voxels.find(|&voxel| !REACH.contains(shift.of_voxel(voxel)) && wanted(voxel))
}

struct Blocks<'a, V, F> {
    view: &'a V,
    region: Option<&'a Aabb>,
    shift: OctreeShift,
    block_bytes: usize,
    values: BrickValues,
    visit: F,
}

impl<V: MapView, F> Blocks<'_, V, F> {
    /// Visits the node at `depth` whose first voxel is `first`, or its children if it is too large; `tiles` are those
    /// that overlap it.
    fn descend<E: From<Error>>(
        &mut self,
        first: MortonCode,
        depth: u8,
        tiles: &[TileIndex],
    ) -> std::result::Result<(), E>
    where
        F: FnMut(MortonCode, u8, &mut BrickValues) -> std::result::Result<(), E>,
    {
        if tiles.is_empty() {
            return Ok(());
        }
        if self.may_fit(first, depth, tiles) && self.gather(first, depth, tiles)? {
            return (self.visit)(first, depth, &mut self.values);
        }
        for child in 0..8 {
            let first = MortonCode(first.0 + child * MortonCode::span(depth + 1));
            let voxels = voxels_of_node(first, depth + 1);
            let reaches_in = |tile: &&TileIndex| !self.voxels_of(**tile).intersection(&voxels).is_empty();
            let tiles: Vec<TileIndex> = tiles.iter().filter(reaches_in).copied().collect();
            self.descend(first, depth + 1, &tiles)?;
        }
        Ok(())
    }

    /// The voxels of a tile in the indices of the octree.
    fn voxels_of(&self, tile: TileIndex) -> VoxelBox {
        self.shift.of_box(&self.view.config().grid.voxels_of_tile(tile))
    }

    /// Returns whether the node may fit, estimated without reading its tiles.
    fn may_fit(&self, first: MortonCode, depth: u8, tiles: &[TileIndex]) -> bool {
        let node = voxels_of_node(first, depth);
        let expected = tiles.iter().map(|&index| {
            let tile = self.voxels_of(index);
            let share = volume(&tile.intersection(&node)) / volume(&tile);
            self.view.voxels_of_tile_hint(index).map_or(0.0, |voxels| voxels as f64 * share)
        });
        // Parts of bricks take slightly more.
        let bytes = self.values.voxel_bytes() as f64 * expected.sum::<f64>();
        depth == BRICK_DEPTH || bytes <= self.block_bytes as f64
    }

    /// Collects the voxels of a node; returns `false`, with some of them collected, if they are too many.
    fn gather(&mut self, first: MortonCode, depth: u8, tiles: &[TileIndex]) -> Result<bool> {
        self.values.clear();
        let node = first.brick()..MortonCode(first.0 + MortonCode::span(depth)).brick();
        let grid = &self.view.config().grid;
        let has_colours = self.values.has_colours();
        for &index in tiles {
            let Some(tile) = self.view.tile_uncached(index)? else { continue };
            let table = tile.table();
            let colour_of = |voxel| {
                let made = if has_colours { table.layers_of(voxel) } else { None };
                made.and_then(|made| made.mean_colour()).map_or(NodeColour::NONE, NodeColour)
            };
            for brick in table.bricks() {
                self.shift.add_brick(brick, &node, &mut self.values, |add| {
                    table.for_each_in(brick, |place, evidence| {
                        let voxel = brick.voxel(place);
                        let center_m = || grid.center_m(tile.index_of(voxel));
                        if self.region.is_none_or(|region| region.contains(center_m())) {
                            add(place, evidence.log_odds as f32, colour_of(voxel));
                        }
                    });
                });
                if depth < BRICK_DEPTH && self.values.bytes() > self.block_bytes {
                    return Ok(false);
                }
            }
        }
        Ok(true)
    }
}

/// The voxels of an octree node, by their indices.
fn voxels_of_node(first: MortonCode, depth: u8) -> VoxelBox {
    let min = first.to_key().to_index_from(REACH.min);
    // The longest edge is that of the root, 65536 voxels.
    let edge = BRICK_EDGE << (BRICK_DEPTH - depth);
    VoxelBox { min, end: min.map(|k| k + edge) }
}

fn volume(voxels: &VoxelBox) -> f64 {
    (0..3).map(|k| (f64::from(voxels.end[k]) - f64::from(voxels.min[k])).max(0.0)).product()
}
