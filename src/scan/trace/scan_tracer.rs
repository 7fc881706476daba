use super::scan_rays::{Fan, OnceInParts};
use super::trace_limit::TraceLimit;
use crate::config::{InsertMode, RayConfig};
use crate::error::{Error, Result};
use crate::scan::per_ray::EveryRayCollector;
use crate::scan::per_scan::OnceCollector;
use crate::scan::scan_points::ScanPoints;
use crate::scan::spill::{Overflow, ScanParts};
use crate::scan::stop::Stop;
use crate::scan::{Scan, ScanUpdates};
use crate::sensor::SensorModel;
use crate::space::{Grid, Point, VoxelIndex};

/// Finds out what scans say about voxels; from scan to scan it keeps the memory that this takes.
#[derive(Clone, Debug, Default)]
pub struct ScanTracer {
    /// One for every thread that takes part.
    once: Vec<OnceCollector>,
    /// One for every part of the rays.
    every_ray: Vec<EveryRayCollector>,
    limit: TraceLimit,
    stop: Stop,
}

/// The order in which the updates of a tile are wanted where every ray counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum UpdateOrder {
    /// Those of each voxel in order.
    OfVoxels,
    /// All in the order in which the rays make them, one by one.
    OfRays,
}

impl ScanTracer {
    /// Whether a scan can be traced at all; takes no time.
    ///
    /// # Errors
    ///
    /// As for [`ScanTracer::trace`].
    pub fn check(grid: &Grid, model: &SensorModel, scan: &Scan) -> Result<()> {
        check_intensities(model, scan.points.len(), scan.intensities.as_deref())?;
        Self::check_points(grid, model, scan.origin, scan)
    }

    /// The same for points wherever they lie, seen from `origin` in metres, world frame.
    ///
    /// # Errors
    ///
    /// As for [`ScanTracer::trace`].
    pub fn check_points(
        grid: &Grid,
        model: &SensorModel,
        origin: Point,
        points: &dyn ScanPoints,
    ) -> Result<()> {
        if model.needs_intensity() && !points.has_intensities() {
            return Err(no_intensities());
        }
        origin_voxel(grid, origin).map(drop)
    }

    /// What a scan says about voxels: its rays walked, and the updates grouped by tile.
    ///
    /// Points that cannot count are skipped and reported.
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
        check_intensities(model, scan.points.len(), scan.intensities.as_deref())?;
        self.trace_points(grid, model, rays, scan.origin, scan, UpdateOrder::OfVoxels, None)
    }

    /// The same, but where every ray counts the updates of a tile come one by one, in the order in which the rays
    /// make them: for whom the order of different voxels matters too.
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
        check_intensities(model, scan.points.len(), scan.intensities.as_deref())?;
        self.trace_points(grid, model, rays, scan.origin, scan, UpdateOrder::OfRays, None)
    }

    /// The same for points wherever they lie, and with `overflow` for a map that is short of memory: what there is no room
    /// for is put aside, and the rest is returned. The report is about all.
    ///
    /// # Errors
    ///
    /// As for [`ScanTracer::trace`], points that cannot be had, and those of putting aside.
    #[expect(
        clippy::too_many_arguments,
        reason = "what a map is, what a scan is, and where there is no room, where to"
    )]
    pub(crate) fn trace_points(
        &mut self,
        grid: &Grid,
        model: &SensorModel,
        rays: &RayConfig,
        origin: Point,
        points: &dyn ScanPoints,
        order: UpdateOrder,
        overflow: Option<Overflow<'_>>,
    ) -> Result<ScanUpdates> {
        if model.needs_intensity() && !points.has_intensities() {
            return Err(no_intensities());
        }
        let fan = Fan::new(grid, model, rays, origin, points, &self.stop)?;
        let counts_once = rays.insert_mode == InsertMode::PerScan;
        let in_order = !counts_once && order == UpdateOrder::OfRays;
        let Some(mut overflow) = overflow else {
            return match (counts_once, in_order) {
                (true, _) => fan.once_a_voxel(&mut self.once),
                (_, true) => fan.every_ray_in_order(),
                _ => fan.every_ray(&mut self.every_ray),
            };
        };
        let parts = ScanParts::new(grid, overflow.most_bytes / 4, overflow.most_tiles, overflow.make_scratch);
        let report = match (counts_once, in_order) {
            (true, _) => match fan.once_a_voxel_in_parts(&mut self.once, &self.limit, &parts)? {
                OnceInParts::Whole(updates) => return Ok(updates),
                OnceInParts::InParts(report) => report,
            },
            (_, true) => fan.every_ray_in_order_in_parts(&self.limit, &parts)?,
            _ => fan.every_ray_in_parts(&mut self.every_ray, &self.limit, &parts)?,
        };
        parts.into_updates(report, counts_once, &self.stop, &mut overflow)
    }

    /// A tracer that keeps to so many bytes where it can put aside what there is no room for.
    pub(crate) fn with_memory_bytes(bytes: usize) -> Self {
        Self { limit: TraceLimit::new(bytes), ..Self::default() }
    }

    /// From when this is set on, rays of a scan are left out, so that the trace comes to its end: its updates are then
    /// good for nothing.
    pub(crate) fn stop_with(&mut self, stop: Stop) {
        self.stop = stop;
    }

    /// Whether the last trace was to be given up.
    pub(crate) fn stop(&self) -> &Stop {
        &self.stop
    }

    /// Bytes of memory that are kept.
    pub fn bytes(&self) -> usize {
        let once = self.once.iter().map(|collector| size_of::<OnceCollector>() + collector.bytes());
        let every_ray =
            self.every_ray.iter().map(|collector| size_of::<EveryRayCollector>() + collector.bytes());
        once.sum::<usize>() + every_ray.sum::<usize>()
    }
}

/// Intensities, if any, must be as many as the points; a model that needs them must have them.
pub(crate) fn check_intensities(
    model: &SensorModel,
    points: usize,
    intensities: Option<&[f32]>,
) -> Result<()> {
    match intensities {
        Some(given) if given.len() != points => Err(Error::argument(
            "intensities",
            format!("{} for {points} points; give one a point", given.len()),
        )),
        None if model.needs_intensity() => Err(no_intensities()),
        _ => Ok(()),
    }
}

fn no_intensities() -> Error {
    let reason = "the sensor model iwlo needs an intensity a point; use log-odds for data without";
    Error::argument("intensities", reason)
}

/// The voxel that a scan is taken from.
pub(crate) fn origin_voxel(grid: &Grid, origin: Point) -> Result<VoxelIndex> {
    grid.voxel_of(origin).ok_or_else(|| {
        let reason = format!("{origin:?} m is not finite or too far away for a voxel index");
        Error::argument("scan origin", reason)
    })
}
