//! Collects the points of a scan that hit voxels, for the layers of a map: while rays are traced, or in a pass of its own
//! over the points, if a memory limit or the insertion per ray divides the work otherwise.

use super::scan_rays::{ScanRays, is_set, part_of};
use crate::config::Layers;
use crate::error::Result;
use crate::scan::ray::RayEnd;
use crate::scan::spill::Overflow;
use crate::scan::updates::{
    LayerHit, LayerHits, MappedTiles, OFFSETS_PER_VOXEL, ScanUpdates, TileUpdates, in_order_of_tiles,
};
use crate::scan::{AttributeSlices, ChunkMarks, PackedUpdates, PointFrame, ScanReport, TakeAttributed};
use crate::space::{Point, TileIndex, VoxelIndex};
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::ops::Range;

/// Bytes of memory that a point takes while hits are collected, in lists that may be half empty.
pub(super) const BYTES_PER_POINT: usize = 2 * size_of::<LayerHit>() + 8;

impl<'a> ScanRays<'a> {
    /// Adds the points that hit voxels to the updates of a scan.
    pub(super) fn add_hits(&self, layers: Layers, updates: &mut ScanUpdates) -> Result<()> {
        if !layers.is_none() {
            let hits = self.hits(layers, 0..self.points().len(), self.threads())?;
            hits.add_to(updates);
        }
        Ok(())
    }

    /// Like [`Self::add_hits`], under a memory limit: hits that exceed it are spilled.
    pub(super) fn add_hits_in_parts(
        &self,
        layers: Layers,
        updates: &mut ScanUpdates,
        overflow: &mut Overflow<'_>,
    ) -> Result<()> {
        if layers.is_none() {
            return Ok(());
        }
        let count = self.points().len();
        let at_a_time = (overflow.max_bytes / 4 / BYTES_PER_POINT).max(1);
        let mut first = 0;
        while count - first > at_a_time {
            let hits = self.hits(layers, first..first + at_a_time, self.threads())?;
            (overflow.spill)(hits.into_packed())?;
            self.stop().check()?;
            first += at_a_time;
        }
        self.hits(layers, first..count, self.threads())?.add_to(updates);
        Ok(())
    }

    /// An empty list.
    pub(super) fn no_hits(&self, layers: Layers) -> HitsByTile<'a> {
        HitsByTile::new(self.mapped(), layers, self.points().stamp_ns())
    }

    /// Passes a range of the points in the world frame, with the attributes that layers need.
    pub(super) fn for_each_attributed_chunk(
        &self,
        layers: Layers,
        range: Range<usize>,
        take: &mut TakeAttributed<'_>,
    ) -> Result<()> {
        if layers.is_none() {
            let take = &mut |points: &[Point], intensities: Option<&[f32]>| {
                take(points, intensities, AttributeSlices::default())
            };
            return self.points().for_each_chunk(range, take);
        }
        self.points().for_each_attributed_chunk(
            range,
            PointFrame::World,
            &mut |points, intensities, attributes| {
                let attributes = AttributeSlices {
                    colours: if layers.colour { attributes.colours } else { &[] },
                    classes: if layers.class { attributes.classes } else { &[] },
                    times_ns: &[],
                };
                take(points, intensities, attributes)
            },
        )
    }

    fn hits(&self, layers: Layers, points: Range<usize>, threads: usize) -> Result<HitsByTile<'a>> {
        let parts = (0..threads).into_par_iter().map(|part| {
            let mut hits = self.no_hits(layers);
            self.take_hits(&mut hits, part_of(&points, part, threads))?;
            Ok(hits)
        });
        let mut parts = parts.collect::<Result<Vec<_>>>()?.into_iter();
        let mut all = parts.next().unwrap_or_else(|| self.no_hits(layers));
        parts.for_each(|part| all.append(part));
        Ok(all)
    }

    fn take_hits(&self, hits: &mut HitsByTile<'_>, range: Range<usize>) -> Result<()> {
        let mut marks = ChunkMarks::from(self.points().moving(), range.start);
        let mut report = ScanReport::default();
        self.for_each_attributed_chunk(hits.layers, range, &mut |points, intensities, attributes| {
            let is_moving = marks.next(points.len());
            for (number, &point) in points.iter().enumerate() {
                let intensity = intensities.map_or(f32::NAN, |intensities| intensities[number]);
                let of_ray = if intensities.is_some() { intensity } else { 0.0 };
                let end = self.end(point, of_ray, is_set(is_moving, number), &mut report);
                if let Some(end) = end.filter(|end| end.hit.is_some()) {
                    hits.push_point(&end, intensity, attributes, number);
                }
            }
            !self.stop().is_set()
        })
    }
}

/// Hits of one scan by tile.
pub(crate) struct HitsByTile<'a> {
    mapped: MappedTiles<'a>,
    layers: Layers,
    stamp_ns: Option<i64>,
    lists: Vec<TileHits>,
    slots: FxHashMap<TileIndex, usize>,
    /// Slot of the last hit: consecutive hits are mostly in the same tile.
    latest: usize,
    count: usize,
}

struct TileHits {
    tile: TileIndex,
    /// Lowest voxel of the tile.
    lowest: VoxelIndex,
    /// Voxels along each axis.
    edges: [u32; 3],
    hits: LayerHits,
}

impl TileHits {
    /// The voxel relative to the tile's lowest; `None` if it is outside of the tile.
    #[inline]
    fn offset_of(&self, voxel: VoxelIndex) -> Option<VoxelIndex> {
        let offset: [u32; 3] = std::array::from_fn(|k| voxel[k].wrapping_sub(self.lowest[k]) as u32);
        let is_inside = (0..3).all(|k| offset[k] < self.edges[k]);
        is_inside.then(|| offset.map(|k| k as i32))
    }
}

impl<'a> HitsByTile<'a> {
    pub(crate) fn new(mapped: MappedTiles<'a>, layers: Layers, stamp_ns: Option<i64>) -> Self {
        let (lists, slots) = Default::default();
        Self { mapped, layers, stamp_ns, lists, slots, latest: 0, count: 0 }
    }

    /// Adds point `number` of a chunk, at which a ray ends; its intensity is NaN if it has none.
    #[inline]
    pub(super) fn push_point(
        &mut self,
        end: &RayEnd,
        intensity: f32,
        attributes: AttributeSlices<'_>,
        number: usize,
    ) {
        self.push(end.point, end.voxel, |layers| LayerHit {
            intensity: layers.stored_intensity(intensity),
            colour: attributes.colour(number),
            class: attributes.class(number),
            ..LayerHit::default()
        });
    }

    /// Adds a point, in units of voxels, that hit a voxel; `make` returns its attributes.
    #[inline]
    pub(crate) fn push(&mut self, point: Point, voxel: VoxelIndex, make: impl FnOnce(&Layers) -> LayerHit) {
        let offset = match self.lists.get(self.latest).and_then(|list| list.offset_of(voxel)) {
            Some(offset) => offset,
            None => {
                let Some(offset) = self.enter(voxel) else { return };
                offset
            }
        };
        let layers = &self.layers;
        let mut hit = make(layers);
        hit.voxel = LayerHit::packed_voxel(offset);
        if layers.shape {
            let edge = f64::from(OFFSETS_PER_VOXEL);
            hit.offset = std::array::from_fn(|k| {
                let share = point[k] - f64::from(voxel[k]);
                ((share * edge).floor().clamp(0.0, edge - 1.0) - edge / 2.0) as i16
            });
        }
        self.lists[self.latest].hits.push(hit);
        self.count += 1;
    }

    /// Makes the tile of a voxel the latest; returns the voxel relative to its lowest. `None` if it is not mapped.
    fn enter(&mut self, voxel: VoxelIndex) -> Option<VoxelIndex> {
        let tile = self.mapped.grid.tile_of_voxel(voxel);
        if !self.mapped.has(tile) {
            return None;
        }
        self.latest = self.slot(tile);
        self.lists[self.latest].offset_of(voxel)
    }

    /// Upper bound on the bytes of memory.
    pub(crate) fn bytes(&self) -> usize {
        self.count * BYTES_PER_POINT
    }

    fn slot(&mut self, tile: TileIndex) -> usize {
        *self.slots.entry(tile).or_insert_with(|| {
            let voxels = self.mapped.grid.voxels_of_tile(tile);
            self.lists.push(TileHits {
                tile,
                lowest: voxels.min,
                edges: std::array::from_fn(|k| voxels.end[k].wrapping_sub(voxels.min[k]) as u32),
                hits: LayerHits::new(self.layers, self.stamp_ns),
            });
            self.lists.len() - 1
        })
    }

    pub(super) fn append(&mut self, others: Self) {
        if self.lists.is_empty() {
            *self = others;
            return;
        }
        for mut list in others.lists {
            let slot = self.slot(list.tile);
            self.lists[slot].hits.append(&mut list.hits);
        }
    }

    pub(crate) fn into_packed(self) -> Vec<(TileIndex, PackedUpdates)> {
        let packed = |list: TileHits| (list.tile, PackedUpdates::of(&TileUpdates::Layers(list.hits)));
        self.lists.into_iter().map(packed).collect()
    }

    /// Adds the hits to the updates of the same scan.
    pub(crate) fn add_to(self, updates: &mut ScanUpdates) {
        if self.lists.is_empty() {
            return;
        }
        let mut hits: FxHashMap<TileIndex, LayerHits> =
            self.lists.into_iter().map(|list| (list.tile, list.hits)).collect();
        let tiles =
            std::mem::take(&mut updates.tiles).into_iter().map(|(tile, of_tile)| match hits.remove(&tile) {
                Some(hits) => (tile, of_tile.with_layers(hits)),
                None => (tile, of_tile),
            });
        let mut tiles: Vec<_> = tiles.collect();
        // Tiles whose evidence was spilled.
        if !hits.is_empty() {
            tiles.extend(hits.into_iter().map(|(tile, hits)| (tile, TileUpdates::Layers(hits))));
            let report = updates.report;
            tiles = in_order_of_tiles(self.mapped.grid, tiles, report).tiles;
        }
        updates.tiles = tiles;
    }
}
