use crate::neighborhood::{HitVoxels, MAX_RADIUS};
use crate::seen_through::find_seen_through;
use crate::stays::Stays;
use rustc_hash::FxHashSet;
use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use voxtile::mapper::KeptScan;
use voxtile::scan::{MovingMarks, ScanPoints, is_hit};
use voxtile::space::{Grid, Point, VoxelIndex};
use voxtile::{Aabb, MapReader, Queries, Result};

/// Number of points from which on a scan is examined in several parts, to bound the memory for its voxels.
const POINTS_AT_A_TIME: u64 = 1 << 20;

/// Distance of a neighbor in metres along each axis; rounded to whole voxels, at least one.
const RADIUS_M: f64 = 0.35;

/// Finder of the points of kept scans that hit something that moved.
#[derive(Debug)]
pub(crate) struct MovingFinder<'a> {
    map: &'a MapReader,
    grid: Grid,
    radius: i32,
    region: Option<Aabb>,
    /// Things that stayed, if they are not moving.
    stays: Option<&'a Stays>,
}

impl<'a> MovingFinder<'a> {
    pub(crate) fn new(map: &'a MapReader, region: Option<Aabb>, stays: Option<&'a Stays>) -> Self {
        let grid = map.grid();
        let radius = (RADIUS_M / grid.resolution_m()).round().clamp(1.0, f64::from(MAX_RADIUS)) as i32;
        Self { map, grid, radius, region, stays }
    }

    /// Returns the marks of a scan. Its own marks are ignored.
    ///
    /// # Errors
    ///
    /// Damage or an I/O error.
    pub(crate) fn marks_of(&self, scan: &KeptScan) -> Result<MovingMarks> {
        let mut moving = FxHashSet::default();
        for part in self.parts_of(scan)? {
            self.find_in(scan, part, &mut moving)?;
        }
        let mut marks = MovingMarks::builder();
        let mut number = 0_u64;
        scan.for_each_chunk(0..scan.len(), &mut |points, _| {
            for _ in points {
                marks.push(moving.contains(&number));
                number += 1;
            }
            true
        })?;
        Ok(marks.finish())
    }

    /// Divides the tiles along x, so that each part has a limited number of points if possible.
    fn parts_of(&self, scan: &KeptScan) -> Result<Vec<RangeInclusive<i32>>> {
        if scan.len() as u64 <= POINTS_AT_A_TIME {
            return Ok(vec![i32::MIN..=i32::MAX]);
        }
        let mut counts = BTreeMap::<i32, u64>::new();
        self.for_each_hit(scan, |_, _, voxel| {
            *counts.entry(self.grid.tile_of_voxel(voxel).x).or_default() += 1;
        })?;
        let (mut parts, mut first, mut points) = (Vec::new(), i32::MIN, 0);
        for (x, count) in counts {
            if points > 0 && points + count > POINTS_AT_A_TIME {
                parts.push(first..=x - 1);
                (first, points) = (x, 0);
            }
            points += count;
        }
        parts.push(first..=i32::MAX);
        Ok(parts)
    }

    /// Passes the hit voxels of a scan, with those that were seen through. Passes them in parts if there are many.
    ///
    /// # Errors
    ///
    /// Damage, an I/O error, or an error of `take`.
    pub(crate) fn for_each_part(
        &self,
        scan: &KeptScan,
        mut take: impl FnMut(HitVoxels) -> Result<()>,
    ) -> Result<()> {
        self.parts_of(scan)?.into_iter().try_for_each(|part| take(self.hit_voxels(scan, &part, 0)?))
    }

    /// Returns the hit voxels in a part of the tiles along x and up to `margin` voxels beside it.
    fn hit_voxels(&self, scan: &KeptScan, part: &RangeInclusive<i32>, margin: i32) -> Result<HitVoxels> {
        let tile_x = |x: i32| self.grid.tile_of_voxel([x, 0, 0]).x;
        let mut voxels = HitVoxels::default();
        self.for_each_hit(scan, |_, _, voxel| {
            let [low, high] = [voxel[0].saturating_sub(margin), voxel[0].saturating_add(margin)];
            if tile_x(low) <= *part.end() && tile_x(high) >= *part.start() {
                voxels.insert(voxel);
            }
        })?;
        find_seen_through(self.map, &mut voxels)?;
        Ok(voxels)
    }

    /// Adds the numbers of the moving points in a part of the tiles along x.
    fn find_in(&self, scan: &KeptScan, part: RangeInclusive<i32>, moving: &mut FxHashSet<u64>) -> Result<()> {
        let tile_x = |x: i32| self.grid.tile_of_voxel([x, 0, 0]).x;
        let mut voxels = self.hit_voxels(scan, &part, self.radius)?;
        if let Some(stays) = self.stays {
            stays.keep_in(&mut voxels)?;
        }
        let in_moving = voxels.moving(self.radius);
        if in_moving.is_empty() {
            return Ok(());
        }
        self.for_each_hit(scan, |number, point, voxel| {
            let is_chosen = self.region.is_none_or(|region| region.contains(point));
            if is_chosen && part.contains(&tile_x(voxel[0])) && in_moving.contains(voxel) {
                moving.insert(number);
            }
        })
    }

    /// Passes each point that is a hit: its number, the point in metres in the world frame, and its voxel.
    fn for_each_hit(&self, scan: &KeptScan, mut take: impl FnMut(u64, Point, VoxelIndex)) -> Result<()> {
        let (rays, origin, mut number) = (scan.rays(), scan.origin(), 0);
        scan.for_each_chunk(0..scan.len(), &mut |points, _| {
            for &point in points {
                if is_hit(rays, origin, point)
                    && let Some(voxel) = self.grid.voxel_of(point)
                {
                    take(number, point, voxel);
                }
                number += 1;
            }
            true
        })
    }
}
