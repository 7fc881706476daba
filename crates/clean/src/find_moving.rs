use crate::neighborhood::{HitVoxels, MAX_RADIUS};
use crate::scan_hits::{HitReader, ScanHits};
use crate::seen_through::{BothOrders, find_seen_through};
use crate::stays::Stays;
use std::path::Path;
use voxtile::mapper::KeptScan;
use voxtile::scan::{MovingMarks, Stop};
use voxtile::space::{Grid, TileBox};
use voxtile::{Aabb, Result};

/// Distance of a neighbor in metres along each axis; rounded to whole voxels, at least one.
const RADIUS_M: f64 = 0.35;

/// Finder of the points of kept scans that hit something that moved.
pub(crate) struct MovingFinder<'a> {
    maps: BothOrders<'a>,
    /// Folder for temporary files.
    folder: &'a Path,
    grid: Grid,
    radius: i32,
    /// Number of points from which on a scan is examined in several parts, to bound the memory for its voxels.
    points_at_a_time: u64,
    region: Option<Aabb>,
    /// Tiles outside of which hits are ignored.
    tiles: Option<TileBox>,
    /// Things that stayed, if they are not moving.
    stays: Option<&'a Stays>,
    stop: &'a Stop,
}

impl<'a> MovingFinder<'a> {
    pub(crate) fn new(maps: BothOrders<'a>, folder: &'a Path, points_at_a_time: u64, stop: &'a Stop) -> Self {
        let grid = maps.forward.grid();
        let radius = (RADIUS_M / grid.resolution_m()).round().clamp(1.0, f64::from(MAX_RADIUS)) as i32;
        Self { maps, folder, grid, radius, points_at_a_time, region: None, tiles: None, stays: None, stop }
    }

    /// Sets the box outside of which no point is marked, and the things that are not moving because they stayed.
    pub(crate) fn with(self, region: Option<Aabb>, stays: Option<&'a Stays>) -> Self {
        Self { region, stays, ..self }
    }

    /// # Errors
    ///
    /// A request to stop.
    pub(crate) fn check_stop(&self) -> Result<()> {
        self.stop.check()
    }

    /// Ignores hits outside of tiles of the map.
    pub(crate) fn within(self, tiles: TileBox) -> Self {
        Self { tiles: Some(tiles), ..self }
    }

    /// Returns the marks of a scan. Its own marks are ignored.
    ///
    /// # Errors
    ///
    /// Damage, an I/O error, or a request to stop.
    pub(crate) fn marks_of(&self, scan: &KeptScan) -> Result<MovingMarks> {
        let mut hits = self.hits_of(scan, self.radius)?;
        // One bit per point.
        let mut moving = Vec::<u64>::new();
        for part in 0..hits.parts() {
            let mut voxels = self.hit_voxels(&mut hits, part)?;
            if let Some(stays) = self.stays {
                stays.keep_in(&mut voxels)?;
            }
            let in_moving = voxels.moving(self.radius);
            if in_moving.is_empty() {
                continue;
            }
            hits.for_each(part, |hit| {
                if hit.may_move && in_moving.contains(hit.voxel) {
                    let word = (hit.number / 64) as usize;
                    moving.resize(moving.len().max(word + 1), 0);
                    moving[word] |= 1 << (hit.number % 64);
                }
            })?;
        }
        let is_moving = |number: u64| {
            moving.get((number / 64) as usize).is_some_and(|word| word >> (number % 64) & 1 == 1)
        };
        Ok(match moving.is_empty() {
            true => MovingMarks::none(scan.record().points),
            false => MovingMarks::new((0..scan.record().points).map(is_moving)),
        })
    }

    /// Passes the hit voxels of a scan, with those that were seen through. Passes them in parts if there are many.
    ///
    /// # Errors
    ///
    /// Damage, an I/O error, an error of `take`, or a request to stop.
    pub(crate) fn for_each_part(
        &self,
        scan: &KeptScan,
        mut take: impl FnMut(HitVoxels) -> Result<()>,
    ) -> Result<()> {
        let mut hits = self.hits_of(scan, 0)?;
        (0..hits.parts()).try_for_each(|part| take(self.hit_voxels(&mut hits, part)?))
    }

    fn hits_of<'s>(&'s self, scan: &'s KeptScan, margin: i32) -> Result<ScanHits<'s>> {
        let Self { grid, region, tiles, stop, .. } = *self;
        let reader = HitReader { scan, grid, region, tiles, stop };
        ScanHits::of(reader, margin, self.points_at_a_time, self.folder)
    }

    fn hit_voxels(&self, hits: &mut ScanHits<'_>, part: usize) -> Result<HitVoxels> {
        let mut voxels = HitVoxels::default();
        hits.for_each(part, |hit| voxels.insert(hit.voxel))?;
        find_seen_through(self.maps, &mut voxels)?;
        Ok(voxels)
    }
}
