use crate::config::RayConfig;
use crate::error::{Error, Result};
use crate::mapper::{KeptScan, NewPose};
use crate::scan::{ChunkMarks, MovingMarks, ScanPoints, Sweep};
use crate::space::{Aabb, Grid, Point, TileBox, TileIndex};
use crate::store::KeptRecord;
use rustc_hash::{FxHashMap, FxHashSet};
use std::fmt;
use std::sync::Arc;

/// Change of a scan. Other scans are unchanged.
#[derive(Clone, Debug)]
pub(super) enum Change {
    Move(NewPose),
    Remove,
    /// Removes the points in a box.
    Filter(Aabb),
    /// Marks other points as moving than before.
    Mark(MarkSource),
}

pub(super) type Changes = FxHashMap<u64, Change>;

/// A hit that returns may be so many voxels from the voxels that its scan has updated: misses near other hits may be
/// omitted.
const RETURN_REACH: i32 = 20;

impl Change {
    /// Returns boxes of tiles in which the change may change the map.
    ///
    /// # Errors
    ///
    /// A scan of a map of a region without a maximum range, of which the tiles outside are unknown.
    pub(super) fn reach(&self, record: &KeptRecord, grid: &Grid) -> Result<Vec<TileBox>> {
        let around = |tile: TileIndex, tiles: i32| TileBox::new(tile, tile).grown(tiles);
        let own = |tiles: i32| record.tiles.iter().map(move |&tile| around(tile, tiles));
        Ok(match self {
            Self::Move(pose) => {
                let moved = reach_from(record, pose.world_from_sensor.position_m(), &pose.sweep, grid)?;
                own(0).chain([moved]).collect()
            }
            Self::Mark(_) if record.rays.region.is_some() => {
                own(0).chain([reach_from(record, record.origin_m(), &None, grid)?]).collect()
            }
            Self::Mark(_) => {
                let tiles = grid.tiles_within(RETURN_REACH);
                own(tiles).chain(grid.tile_of(record.origin_m()).map(|tile| around(tile, tiles))).collect()
            }
            Self::Remove | Self::Filter(_) => own(0).collect(),
        })
    }

    /// Returns whether the change may change the map in a region.
    ///
    /// # Errors
    ///
    /// As for [`Change::reach`].
    pub(super) fn may_reach(
        &self,
        record: &KeptRecord,
        grid: &Grid,
        region: Option<TileBox>,
    ) -> Result<bool> {
        let Some(region) = region else { return Ok(true) };
        Ok(self.reach(record, grid)?.into_iter().any(|tiles| tiles.intersection(region).is_some()))
    }
}

/// Returns ray settings limited to a region; `None` if they exclude it.
pub(super) fn rays_within(rays: &RayConfig, region: Option<TileBox>) -> Option<RayConfig> {
    let Some(region) = region else { return Some(*rays) };
    let region = rays.region.map_or(Some(region), |own| own.intersection(region))?;
    Some(RayConfig { region: Some(region), ..*rays })
}

/// Returns a box around the tiles that a scan can change from a position, perhaps with a new motion: its rays are as
/// long as before.
fn reach_from(
    record: &KeptRecord,
    position_m: Point,
    sweep: &Option<Arc<Sweep>>,
    grid: &Grid,
) -> Result<TileBox> {
    let longest_m = match record.rays.region {
        // Rays may end beyond the tiles of a region.
        Some(_) => record.rays.max_range_m.ok_or_else(|| {
            let reason = format!("scan {} was mapped into a region, without a maximum range", record.number);
            Error::argument("map", reason)
        })?,
        None => {
            let from = record.origin_m();
            let far_m = |tile: &TileIndex| {
                let edge_m = grid.tile_size_m();
                let tile = tile.to_array();
                let axis = |k: usize| {
                    let low = f64::from(tile[k]) * edge_m - from[k];
                    low.abs().max((low + edge_m).abs())
                };
                (0..3).map(|k| axis(k).powi(2)).sum::<f64>().sqrt()
            };
            // The range of a point when it was measured differs from that at the stamp by the motion between.
            let moved_m: f64 =
                [&record.sweep, sweep].into_iter().flatten().map(|sweep| sweep.reach_m()).sum();
            record.tiles.iter().map(far_m).fold(0.0, f64::max) + moved_m
        }
    };
    let reach_m = longest_m + grid.resolution_m();
    let around = Aabb { min: position_m.map(|k| k - reach_m), max: position_m.map(|k| k + reach_m) };
    let voxels = grid.voxels_in(&around);
    let last = voxels.end.map(|k| k.saturating_sub(1));
    Ok(TileBox::new(grid.tile_of_voxel(voxels.min), grid.tile_of_voxel(last)))
}

/// Source of new marks of moving points, by the number of the scan.
#[derive(Clone)]
pub(super) struct MarkSource(pub(super) Arc<dyn Fn(u64) -> Result<MovingMarks> + Send + Sync>);

impl fmt::Debug for MarkSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("MarkSource")
    }
}

impl MarkSource {
    /// Returns the new marks of a scan.
    ///
    /// # Errors
    ///
    /// Errors of the source, and marks that do not match the points.
    pub(super) fn of(&self, scan: &KeptScan) -> Result<MovingMarks> {
        let marks = (self.0)(scan.number())?;
        match marks.points() == scan.record().points {
            true => Ok(marks),
            false => {
                let (number, points) = (scan.number(), scan.record().points);
                let reason = format!(
                    "{} for the {points} points of scan {number}; one per point is needed",
                    marks.points()
                );
                Err(Error::argument("marks", reason))
            }
        }
    }
}

/// Returns the tiles of the points whose marks differ from those of the scan, in no order. They include all tiles in
/// which the scan gains or loses hits. If the marks of the scan are lost, these are the tiles of all points.
pub(super) fn tiles_of_marks(grid: &Grid, scan: &KeptScan, new: &MovingMarks) -> Result<Vec<TileIndex>> {
    let (mut old, mut new) = (ChunkMarks::from(scan.moving(), 0), ChunkMarks::from(Some(new), 0));
    let mut tiles = FxHashSet::default();
    let are_lost = scan.record().has_lost_marks();
    scan.for_each_chunk(0..scan.len(), &mut |points, _| {
        let (old, new) = (old.next(points.len()), new.next(points.len()));
        let is_set = |marks: &[bool], number: usize| marks.get(number).is_some_and(|is_set| *is_set);
        let differs = |number: &usize| are_lost || is_set(old, *number) != is_set(new, *number);
        tiles.extend((0..points.len()).filter(differs).filter_map(|number| grid.tile_of(points[number])));
        true
    })?;
    Ok(tiles.into_iter().collect())
}
