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
    pub(super) per_scan: Vec<PerScanCollector>,
    /// One per part of the rays.
    pub(super) per_ray: Vec<PerRayCollector>,
    pub(super) limit: TraceLimit,
    pub(super) stop: Stop,
}

/// How the scans of a map are traced.
#[derive(Clone, Copy)]
pub(crate) struct TraceRules<'a> {
    /// The tiles whose updates are wanted.
    pub(crate) mapped: MappedTiles<'a>,
    pub(crate) model: &'a SensorModel,
    pub(crate) rays: &'a RayConfig,
    pub(crate) order: UpdateOrder,
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
        self.trace_points(TraceRules { mapped, model, rays, order: UpdateOrder::OfVoxels }, scan, None)
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
        self.trace_points(TraceRules { mapped, model, rays, order: UpdateOrder::OfRays }, scan, None)
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
        rules: TraceRules<'_>,
        scan: &dyn ScanPoints,
        overflow: Option<Overflow<'_>>,
    ) -> Result<ScanUpdates> {
        let selection = rules.selection();
        let rules = rules.with_selection(selection.as_deref());
        let TraceRules { mapped, rays, .. } = rules;
        let scan_rays = ScanRays::new(rules, scan, rayon::current_num_threads(), &self.stop)?;
        let is_per_scan = rays.insert_mode == InsertMode::PerScan;
        let in_order = rules.are_rays_in_order();
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

impl<'a> TraceRules<'a> {
    /// The wanted tiles that are in the region of the rays, or all.
    pub(super) fn selection(&self) -> Option<Cow<'a, TileSelection>> {
        match (self.mapped.selection, self.rays.region) {
            (Some(tiles), Some(region)) => Some(Cow::Owned(tiles.within(region))),
            (Some(tiles), None) => Some(Cow::Borrowed(tiles)),
            (None, region) => region.map(|region| Cow::Owned(TileSelection::from(region))),
        }
    }

    /// The same rules for the tiles of a selection.
    pub(super) fn with_selection<'b>(self, selection: Option<&'b TileSelection>) -> TraceRules<'b>
    where
        'a: 'b,
    {
        TraceRules { mapped: MappedTiles { grid: self.mapped.grid, selection }, ..self }
    }

    /// Whether all updates of a tile are to be in the order of the rays, one by one.
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
