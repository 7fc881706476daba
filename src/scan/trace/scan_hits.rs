//! Collects the points of a scan that hit voxels, for the layers of a map. It is a pass of its own over the points, so
//! that maps without layers do not pay for it.

use super::scan_rays::{ScanRays, is_set, part_of};
use crate::config::Layers;
use crate::error::Result;
use crate::scan::ray::RayEnd;
use crate::scan::spill::Overflow;
use crate::scan::updates::{
    LayerHit, LayerHits, MappedTiles, OFFSETS_PER_VOXEL, ScanUpdates, TileUpdates, in_order_of_tiles,
};
use crate::scan::{AttributeSlices, ChunkMarks, PackedUpdates, PointFrame, ScanReport};
use crate::space::{Point, TileIndex, VoxelBox, VoxelIndex};
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::ops::Range;

/// Bytes of memory that a point takes while hits are collected, in lists that may be half empty.
pub(super) const BYTES_PER_POINT: usize = 2 * size_of::<LayerHit>() + 8;

impl ScanRays<'_> {
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

    fn hits(&self, layers: Layers, points: Range<usize>, threads: usize) -> Result<HitsByTile<'_>> {
        let parts = (0..threads).into_par_iter().map(|part| {
            let mut hits = HitsByTile::new(self.mapped(), layers, self.points().stamp_ns());
            self.take_hits(&mut hits, part_of(&points, part, threads))?;
            Ok(hits)
        });
        let mut parts = parts.collect::<Result<Vec<_>>>()?.into_iter();
        let mut all = parts.next().unwrap_or_else(|| HitsByTile::new(self.mapped(), layers, None));
        parts.for_each(|part| all.append(part));
        Ok(all)
    }

    fn take_hits(&self, hits: &mut HitsByTile<'_>, range: Range<usize>) -> Result<()> {
        let mut marks = ChunkMarks::from(self.points().moving(), range.start);
        let mut report = ScanReport::default();
        self.points().for_each_attributed_chunk(
            range,
            PointFrame::World,
            &mut |points, intensities, attributes| {
                let attributes = AttributeSlices {
                    colours: if hits.layers.colour { attributes.colours } else { &[] },
                    classes: if hits.layers.class { attributes.classes } else { &[] },
                };
                let is_moving = marks.next(points.len());
                for (number, &point) in points.iter().enumerate() {
                    let intensity = intensities.map_or(f32::NAN, |intensities| intensities[number]);
                    let of_ray = if intensities.is_some() { intensity } else { 0.0 };
                    let end = self.end(point, of_ray, is_set(is_moving, number), &mut report);
                    if let Some(RayEnd { point, voxel, hit: Some(_), .. }) = end {
                        hits.push(point, voxel, |layers| LayerHit {
                            intensity: layers.stored_intensity(intensity),
                            colour: attributes.colour(number),
                            class: attributes.class(number),
                            ..LayerHit::default()
                        });
                    }
                }
                !self.stop().is_set()
            },
        )
    }
}

/// Hits of one scan by tile.
pub(crate) struct HitsByTile<'a> {
    mapped: MappedTiles<'a>,
    layers: Layers,
    stamp_ns: Option<i64>,
    lists: Vec<(TileIndex, VoxelBox, LayerHits)>,
    slots: FxHashMap<TileIndex, usize>,
    /// Slot of the last hit: consecutive hits are mostly in the same tile.
    latest: usize,
    count: usize,
}

impl<'a> HitsByTile<'a> {
    pub(crate) fn new(mapped: MappedTiles<'a>, layers: Layers, stamp_ns: Option<i64>) -> Self {
        let (lists, slots) = Default::default();
        Self { mapped, layers, stamp_ns, lists, slots, latest: 0, count: 0 }
    }

    /// Adds a point, in units of voxels, that hit a voxel; `make` returns its attributes.
    #[inline]
    pub(crate) fn push(&mut self, point: Point, voxel: VoxelIndex, make: impl FnOnce(&Layers) -> LayerHit) {
        if !self.lists.get(self.latest).is_some_and(|(_, tile, _)| tile.contains(voxel)) {
            let tile = self.mapped.grid.tile_of_voxel(voxel);
            if !self.mapped.has(tile) {
                return;
            }
            self.latest = self.slot(tile);
        }
        let layers = &self.layers;
        let (_, tile, hits) = &mut self.lists[self.latest];
        let mut hit = make(layers);
        hit.voxel = LayerHit::packed_voxel(std::array::from_fn(|k| voxel[k].wrapping_sub(tile.min[k])));
        if layers.shape {
            let edge = f64::from(OFFSETS_PER_VOXEL);
            hit.offset = std::array::from_fn(|k| {
                let share = point[k] - f64::from(voxel[k]);
                ((share * edge).floor().clamp(0.0, edge - 1.0) - edge / 2.0) as i16
            });
        }
        hits.push(hit);
        self.count += 1;
    }

    /// Upper bound on the bytes of memory.
    pub(crate) fn bytes(&self) -> usize {
        self.count * BYTES_PER_POINT
    }

    fn slot(&mut self, tile: TileIndex) -> usize {
        *self.slots.entry(tile).or_insert_with(|| {
            let voxels = self.mapped.grid.voxels_of_tile(tile);
            self.lists.push((tile, voxels, LayerHits::new(self.layers, self.stamp_ns)));
            self.lists.len() - 1
        })
    }

    fn append(&mut self, others: Self) {
        for (tile, _, mut hits) in others.lists {
            let slot = self.slot(tile);
            self.lists[slot].2.append(&mut hits);
        }
    }

    pub(crate) fn into_packed(self) -> Vec<(TileIndex, PackedUpdates)> {
        let packed = |(tile, _, hits)| (tile, PackedUpdates::of(&TileUpdates::Layers(hits)));
        self.lists.into_iter().map(packed).collect()
    }

    /// Adds the hits to the updates of the same scan.
    pub(crate) fn add_to(self, updates: &mut ScanUpdates) {
        let mut hits: FxHashMap<TileIndex, LayerHits> =
            self.lists.into_iter().map(|(tile, _, hits)| (tile, hits)).collect();
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
