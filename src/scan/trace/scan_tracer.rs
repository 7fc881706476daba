use super::scan_rays::{PerScanUpdates, ScanRays};
use super::trace_limit::TraceLimit;
use crate::config::{InsertMode, RayConfig};
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

/// Computes the updates of scans. It keeps its memory from scan to scan.
#[derive(Clone, Debug, Default)]
pub struct ScanTracer {
    /// One per thread.
    per_scan: Vec<PerScanCollector>,
    /// One per part of the rays.
    per_ray: Vec<PerRayCollector>,
    limit: TraceLimit,
    stop: Stop,
}

/// The order of a tile's updates in insertion per ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum UpdateOrder {
    /// The updates of each voxel are in order.
    OfVoxels,
    /// All updates are in the order of the rays, one by one.
    OfRays,
}

impl ScanTracer {
    /// Checks that a scan can be traced, without reading its points: its origin, and that it has intensities if they
    /// are needed.
    ///
    /// # Errors
    ///
    /// As for [`ScanTracer::trace`].
    pub fn check(grid: &Grid, model: &SensorModel, scan: &dyn ScanPoints) -> Result<()> {
        if model.needs_intensity() && !scan.has_intensities() {
            return Err(no_intensities());
        }
        origin_voxel(grid, scan.origin()).map(drop)
    }

    /// Walks the rays of a scan; returns the updates, grouped by tile.
    ///
    /// Points that are not usable are skipped and reported.
    ///
    /// # Errors
    ///
    /// An origin without a voxel, intensities that do not match the points, or none where the sensor model needs them.
    pub fn trace(
        &mut self,
        grid: &Grid,
        model: &SensorModel,
        rays: &RayConfig,
        scan: &Scan,
    ) -> Result<ScanUpdates> {
        let mapped = MappedTiles { grid, selection: None };
        self.trace_points(mapped, model, rays, scan, UpdateOrder::OfVoxels, None)
    }

    /// The same, but in insertion per ray a tile's updates are in the order of the rays, one by one: for octrees whose
    /// cache depends on the order of different voxels.
    ///
    /// # Errors
    ///
    /// As for [`ScanTracer::trace`].
    pub fn trace_in_order(
        &mut self,
        grid: &Grid,
        model: &SensorModel,
        rays: &RayConfig,
        scan: &Scan,
    ) -> Result<ScanUpdates> {
        let mapped = MappedTiles { grid, selection: None };
        self.trace_points(mapped, model, rays, scan, UpdateOrder::OfRays, None)
    }

    /// The same for any source of points and for the mapped tiles alone: their updates are those of the whole scan.
    /// With `overflow`, updates that exceed the memory limit are spilled and the rest is returned. The report covers
    /// both.
    ///
    /// # Errors
    ///
    /// As for [`ScanTracer::trace`], points that cannot be read, and errors of the spill.
    pub(crate) fn trace_points(
        &mut self,
        mapped: MappedTiles<'_>,
        model: &SensorModel,
        rays: &RayConfig,
        scan: &dyn ScanPoints,
        order: UpdateOrder,
        overflow: Option<Overflow<'_>>,
    ) -> Result<ScanUpdates> {
        let MappedTiles { grid, selection } = mapped;
        let selection = match (selection, rays.region) {
            (Some(tiles), Some(region)) => Some(Cow::Owned(tiles.within(region))),
            (Some(tiles), None) => Some(Cow::Borrowed(tiles)),
            (None, region) => region.map(|region| Cow::Owned(TileSelection::from(region))),
        };
        let mapped = MappedTiles { grid, selection: selection.as_deref() };
        Self::check(grid, model, scan)?;
        let scan_rays = ScanRays::new(mapped, model, rays, scan, &self.stop)?;
        let is_per_scan = rays.insert_mode == InsertMode::PerScan;
        let in_order = !is_per_scan && order == UpdateOrder::OfRays;
        let Some(mut overflow) = overflow else {
            return match (is_per_scan, in_order) {
                (true, _) => scan_rays.per_scan(&mut self.per_scan),
                (_, true) => scan_rays.per_ray_in_order(),
                _ => scan_rays.per_ray(&mut self.per_ray),
            };
        };
        let parts = ScanParts::new(
            mapped,
            &self.stop,
            overflow.max_bytes / 4,
            overflow.max_tiles,
            overflow.make_scratch,
        );
        let report = match (is_per_scan, in_order) {
            (true, _) => match scan_rays.per_scan_in_parts(&mut self.per_scan, &self.limit, &parts)? {
                PerScanUpdates::Whole(updates) => return Ok(updates),
                PerScanUpdates::InParts(report) => report,
            },
            (_, true) => scan_rays.per_ray_in_order_in_parts(&self.limit, &parts)?,
            _ => scan_rays.per_ray_in_parts(&mut self.per_ray, &self.limit, &parts)?,
        };
        parts.into_updates(report, is_per_scan, &self.stop, &mut overflow)
    }

    /// A tracer that takes at most `bytes` of memory when it is given an [`Overflow`].
    pub(crate) fn with_memory_bytes(bytes: usize) -> Self {
        Self { limit: TraceLimit::new(bytes), ..Self::default() }
    }

    /// Sets the stop request. Once it is set, the remaining rays are left out and the updates are incomplete.
    pub(crate) fn stop_with(&mut self, stop: Stop) {
        self.stop = stop;
    }

    /// The stop request.
    pub(crate) fn stop(&self) -> &Stop {
        &self.stop
    }

    /// Bytes of memory that are kept.
    pub fn bytes(&self) -> usize {
        let per_scan =
            self.per_scan.iter().map(|collector| size_of::<PerScanCollector>() + collector.bytes());
        let per_ray = self.per_ray.iter().map(|collector| size_of::<PerRayCollector>() + collector.bytes());
        per_scan.sum::<usize>() + per_ray.sum::<usize>()
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
    let reason = format!("{} for {points} points; give one a point", intensities.len());
    Err(Error::argument("intensities", reason))
}

fn no_intensities() -> Error {
    let reason = "the sensor model iwlo needs an intensity a point; use log-odds for data without";
    Error::argument("intensities", reason)
}

/// The voxel of the sensor.
pub(crate) fn origin_voxel(grid: &Grid, origin: Point) -> Result<VoxelIndex> {
    grid.voxel_of(origin).ok_or_else(|| {
        let reason = format!("{origin:?} m is not finite or too far away for a voxel index");
        Error::argument("scan origin", reason)
    })
}
