use super::scan_hits::BYTES_PER_POINT;
use super::scan_rays::{PerScanUpdates, ScanRays};
use super::trace_limit::TraceLimit;
use crate::config::{GUARD_REACH, Guard, InsertMode, Layers, RayConfig};
use crate::error::{Error, Result};
use crate::scan::per_ray::PerRayCollector;
use crate::scan::per_scan::PerScanCollector;
use crate::scan::scan_points::ScanPoints;
use crate::scan::spill::{Overflow, ScanParts};
use crate::scan::stop::Stop;
use crate::scan::updates::MappedTiles;
use crate::scan::{Scan, ScanUpdates};
use crate::sensor::SensorModel;
use crate::space::{Grid, Point, TileSelection, VoxelIndex};
use std::borrow::Cow;

/// Computes the updates of scans. It reuses its memory between scans.
#[derive(Clone, Debug, Default)]
pub struct ScanTracer {
    /// One per thread.
    pub(super) per_scan: Vec<PerScanCollector>,
    /// One per part of the rays.
    pub(super) per_ray: Vec<PerRayCollector>,
    pub(super) limit: TraceLimit,
    pub(super) stop: Stop,
}

/// Settings for tracing the scans of a map.
#[derive(Clone, Copy)]
pub(crate) struct TraceRules<'a> {
    /// Tiles for which updates are computed.
    pub(crate) mapped: MappedTiles<'a>,
    pub(crate) model: &'a SensorModel,
    pub(crate) rays: &'a RayConfig,
    pub(crate) order: UpdateOrder,
    pub(crate) layers: Layers,
}

/// Order of a tile's updates in insertion per ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum UpdateOrder {
    /// The updates of each voxel are in order.
    OfVoxels,
    /// All updates are in the order of the rays.
    OfRays,
}

impl ScanTracer {
    /// Checks that a scan can be traced, without reading its points: its origin, and that it has intensities if they
    /// are needed.
    ///
    /// # Errors
    ///
    /// Same errors as [`ScanTracer::trace`].
    pub fn check(grid: &Grid, model: &SensorModel, scan: &dyn ScanPoints) -> Result<()> {
        if model.needs_intensity() && !scan.has_intensities() {
            return Err(no_intensities());
        }
        origin_voxel(grid, scan.origin()).map(drop)
    }

    /// Traces the rays of a scan and returns the updates, grouped by tile.
    ///
    /// Unusable points are skipped and reported.
    ///
    /// # Errors
    ///
    /// Fails if the origin is outside of the map's space, or if the intensities do not match the points or are missing
    /// although the sensor model needs them.
    pub fn trace(
        &mut self,
        grid: &Grid,
        model: &SensorModel,
        rays: &RayConfig,
        scan: &Scan,
    ) -> Result<ScanUpdates> {
        let mapped = MappedTiles { grid, selection: None };
        self.trace_points(TraceRules::of_evidence(mapped, model, rays, UpdateOrder::OfVoxels), scan, None)
    }

    /// Like [`ScanTracer::trace`], but in insertion per ray the updates of a tile are in the order of the rays. Octrees
    /// with a voxel cache need this, because the content of the cache depends on the order in which voxels are updated.
    ///
    /// # Errors
    ///
    /// Same errors as [`ScanTracer::trace`].
    pub fn trace_in_order(
        &mut self,
        grid: &Grid,
        model: &SensorModel,
        rays: &RayConfig,
        scan: &Scan,
    ) -> Result<ScanUpdates> {
        let mapped = MappedTiles { grid, selection: None };
        self.trace_points(TraceRules::of_evidence(mapped, model, rays, UpdateOrder::OfRays), scan, None)
    }

    /// Like [`ScanTracer::trace`], for any source of points and only for the mapped tiles, whose updates are those of
    /// the whole scan. With `overflow`, updates that exceed the memory limit are spilled and the rest is returned. The
    /// report covers both.
    ///
    /// # Errors
    ///
    /// Same errors as [`ScanTracer::trace`]; also fails if points cannot be read or updates cannot be spilled.
    pub(crate) fn trace_points(
        &mut self,
        rules: TraceRules<'_>,
        scan: &dyn ScanPoints,
        overflow: Option<Overflow<'_>>,
    ) -> Result<ScanUpdates> {
        let selection = rules.selection();
        let rules = rules.with_selection(selection.as_deref());
        let TraceRules { mapped, rays, layers, .. } = rules;
        let traced = rules.traced();
        let threads = rayon::current_num_threads();
        let scan_rays = ScanRays::new(rules, traced.as_deref(), scan, threads, &self.stop)?;
        let is_per_scan = rays.insert_mode == InsertMode::PerScan;
        let in_order = rules.are_rays_in_order();
        let Some(mut overflow) = overflow else {
            let mut updates = match (is_per_scan, in_order) {
                (true, _) => return scan_rays.per_scan(layers, &mut self.per_scan),
                (_, true) => scan_rays.per_ray_in_order(),
                _ => scan_rays.per_ray(&mut self.per_ray),
            }?;
            scan_rays.add_hits(layers, &mut updates)?;
            return Ok(updates);
        };
        let parts = ScanParts::new(
            mapped,
            scan_rays.clearance(),
            &self.stop,
            overflow.max_bytes / 4,
            overflow.max_tiles,
            overflow.make_scratch,
        );
        // Hits that may not fit are collected after the rays.
        let hits_fit = is_per_scan && scan.len() <= overflow.max_bytes / 4 / BYTES_PER_POINT;
        let (with_rays, later) = if hits_fit { (layers, Layers::NONE) } else { (Layers::NONE, layers) };
        let (report, hits) = match (is_per_scan, in_order) {
            (true, _) => {
                match scan_rays.per_scan_in_parts(with_rays, &mut self.per_scan, &self.limit, &parts)? {
                    PerScanUpdates::Whole(mut updates) => {
                        scan_rays.add_hits_in_parts(later, &mut updates, &mut overflow)?;
                        return Ok(updates);
                    }
                    PerScanUpdates::InParts(report, hits) => (report, Some(hits)),
                }
            }
            (_, true) => (scan_rays.per_ray_in_order_in_parts(&self.limit, &parts)?, None),
            _ => (scan_rays.per_ray_in_parts(&mut self.per_ray, &self.limit, &parts)?, None),
        };
        let mut updates = parts.into_updates(report, is_per_scan, &self.stop, &mut overflow)?;
        if let Some(hits) = hits {
            hits.add_to(&mut updates);
        }
        scan_rays.add_hits_in_parts(later, &mut updates, &mut overflow)?;
        Ok(updates)
    }

    /// Creates a tracer that uses at most `bytes` of memory if it is given an [`Overflow`].
    pub(crate) fn with_memory_bytes(bytes: usize) -> Self {
        Self { limit: TraceLimit::new(bytes), ..Self::default() }
    }

    /// Sets the stop request. Once it is raised, the remaining rays are skipped and the updates are incomplete.
    pub(crate) fn stop_with(&mut self, stop: Stop) {
        self.stop = stop;
    }

    pub(crate) fn stop(&self) -> &Stop {
        &self.stop
    }

    /// Bytes of memory that are kept between scans.
    pub fn bytes(&self) -> usize {
        let per_scan =
            self.per_scan.iter().map(|collector| size_of::<PerScanCollector>() + collector.bytes());
        let per_ray = self.per_ray.iter().map(|collector| size_of::<PerRayCollector>() + collector.bytes());
        per_scan.sum::<usize>() + per_ray.sum::<usize>()
    }
}

impl<'a> TraceRules<'a> {
    /// Rules for updates of evidence alone.
    pub(crate) fn of_evidence(
        mapped: MappedTiles<'a>,
        model: &'a SensorModel,
        rays: &'a RayConfig,
        order: UpdateOrder,
    ) -> Self {
        Self { mapped, model, rays, order, layers: Layers::NONE }
    }

    /// The mapped tiles that are in the region of the rays; `None` for the whole space.
    pub(super) fn selection(&self) -> Option<Cow<'a, TileSelection>> {
        match (self.mapped.selection, self.rays.region) {
            (Some(tiles), Some(region)) => Some(Cow::Owned(tiles.within(region))),
            (Some(tiles), None) => Some(Cow::Borrowed(tiles)),
            (None, region) => region.map(|region| Cow::Owned(TileSelection::from(region))),
        }
    }

    /// The same rules for other selected tiles.
    pub(super) fn with_selection<'b>(self, selection: Option<&'b TileSelection>) -> TraceRules<'b>
    where
        'a: 'b,
    {
        TraceRules { mapped: MappedTiles { grid: self.mapped.grid, selection }, ..self }
    }

    /// The guard of the rule of clearing, if it has one.
    pub(super) fn guard(&self) -> Option<Guard> {
        self.rays.clearing().guard().filter(|_| self.rays.insert_mode == InsertMode::PerScan)
    }

    /// The tiles in which rays are traced: the selected tiles and, with guarded clearing, those within its reach;
    /// `None` for the whole space.
    pub(super) fn traced(&self) -> Option<Cow<'a, TileSelection>> {
        let selection = self.mapped.selection?;
        Some(match self.guard() {
            None => Cow::Borrowed(selection),
            Some(_) => Cow::Owned(selection.grown(self.mapped.grid.tiles_within(GUARD_REACH))),
        })
    }

    /// Returns whether all updates of a tile must be in the order of the rays.
    pub(super) fn are_rays_in_order(&self) -> bool {
        self.rays.insert_mode != InsertMode::PerScan && self.order == UpdateOrder::OfRays
    }
}

/// Checks that there is one intensity per point, or none if the model needs none.
pub(crate) fn check_intensities(
    model: &SensorModel,
    points: usize,
    intensities: Option<&[f32]>,
) -> Result<()> {
    match intensities {
        Some(given) => check_count(points, given),
        None if model.needs_intensity() => Err(no_intensities()),
        None => Ok(()),
    }
}

/// Checks that there is one intensity per point.
pub(crate) fn check_count(points: usize, intensities: &[f32]) -> Result<()> {
    if intensities.len() == points {
        return Ok(());
    }
    let reason = format!("{} for {points} points; one per point is needed", intensities.len());
    Err(Error::argument("intensities", reason))
}

fn no_intensities() -> Error {
    let reason =
        "the sensor model iwlo needs an intensity per point; use log-odds for data without intensities";
    Error::argument("intensities", reason)
}

/// Returns the voxel that contains the sensor.
pub(crate) fn origin_voxel(grid: &Grid, origin: Point) -> Result<VoxelIndex> {
    grid.voxel_of(origin).ok_or_else(|| {
        let reason = format!("{origin:?} m is not finite or too far away for a voxel index");
        Error::argument("scan origin", reason)
    })
}
