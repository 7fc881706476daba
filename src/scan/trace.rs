use super::grouping::{MaskCollector, OrderedCollector};
use super::range::{Ranged, in_range};
use super::ray::{MAX_RAY_STEPS, RayWalk};
use super::{Scan, ScanReport, ScanUpdates};
use crate::config::{InsertMode, RayConfig};
use crate::error::{Error, Result};
use crate::sensor::{Observation, SensorModel};
use crate::space::{Grid, Point, VoxelIndex};

/// What a scan says about voxels: its rays walked, and the updates grouped by tile.
///
/// Points that cannot count are skipped and reported.
///
/// # Errors
///
/// An origin without a voxel, intensities that do not match the points, or none where the sensor model needs them.
pub fn trace_scan(grid: &Grid, model: &SensorModel, rays: &RayConfig, scan: &Scan) -> Result<ScanUpdates> {
    check_intensities(model, scan.points.len(), scan.intensities.as_deref())?;
    let tracer = Tracer::new(grid, model, rays, scan)?;
    match rays.insert_mode {
        InsertMode::PerScan => Ok(tracer.once_a_voxel()),
        InsertMode::PerRay => Ok(tracer.every_ray()),
    }
}

/// Intensities, if any, must be as many as the points; a model that needs them must have them.
pub(super) fn check_intensities(
    model: &SensorModel,
    points: usize,
    intensities: Option<&[f32]>,
) -> Result<()> {
    match intensities {
        Some(given) if given.len() != points => Err(Error::argument(
            "intensities",
            format!("{} for {points} points; give one a point", given.len()),
        )),
        None if model.needs_intensity() => {
            let reason = "the sensor model iwlo needs an intensity a point; use log-odds for data without";
            Err(Error::argument("intensities", reason))
        }
        _ => Ok(()),
    }
}

struct Tracer<'a> {
    grid: &'a Grid,
    model: &'a SensorModel,
    rays: &'a RayConfig,
    scan: &'a Scan,
    /// The sensor in units of voxels, and its voxel.
    origin: Point,
    start: VoxelIndex,
}

/// A ray that counts.
struct Ray {
    walk: RayWalk,
    /// The voxel and observation at its end, if its end is evidence.
    end: Option<(VoxelIndex, Observation)>,
}

impl<'a> Tracer<'a> {
    fn new(grid: &'a Grid, model: &'a SensorModel, rays: &'a RayConfig, scan: &'a Scan) -> Result<Self> {
        let start = grid.voxel_of(scan.origin).ok_or_else(|| {
            let reason = format!("{:?} m is not finite or too far away for a voxel index", scan.origin);
            Error::argument("scan origin", reason)
        })?;
        Ok(Self { grid, model, rays, scan, origin: grid.to_voxel_units(scan.origin), start })
    }

    /// One update a voxel, a hit over any miss.
    fn once_a_voxel(&self) -> ScanUpdates {
        let mut collector = MaskCollector::default();
        let needs_intensity = self.model.needs_intensity();
        let report = self.for_each_ray(|ray| {
            ray.walk.for_each_before_end(|voxel| collector.miss(voxel));
            if let Some((voxel, Observation::Hit(intensity))) = ray.end {
                collector.hit(voxel, needs_intensity.then_some(intensity));
            }
        });
        collector.into_updates(self.grid, report)
    }

    /// Every ray counts: its misses from the sensor outward, then its hit, in the order of the points.
    fn every_ray(&self) -> ScanUpdates {
        let mut collector = OrderedCollector::new(self.grid, self.model.needs_intensity());
        let report = self.for_each_ray(|ray| {
            ray.walk.for_each_before_end(|voxel| collector.push(voxel, Observation::Miss));
            if let Some((voxel, observation)) = ray.end {
                collector.push(voxel, observation);
            }
        });
        collector.into_updates(report)
    }

    fn for_each_ray(&self, mut visit: impl FnMut(Ray)) -> ScanReport {
        let mut report = ScanReport { points: self.scan.points.len() as u64, ..ScanReport::default() };
        for number in 0..self.scan.points.len() {
            if let Some(ray) = self.ray(number, &mut report) {
                visit(ray);
            }
        }
        report
    }

    fn ray(&self, number: usize, report: &mut ScanReport) -> Option<Ray> {
        let intensity = self.scan.intensities.as_ref().map_or(0.0, |intensities| intensities[number]);
        let skipped = &mut report.skipped;
        if self.model.needs_intensity() && intensity.is_nan() {
            skipped.no_intensity += 1;
            return None;
        }
        let (end_m, is_hit) = match in_range(self.rays, self.scan.origin, self.scan.points[number], skipped) {
            Ranged::Hit(point) => (point, true),
            Ranged::Cut(point) => (point, false),
            Ranged::Skipped => return None,
        };
        let Some(last) = self.grid.voxel_of(end_m) else {
            skipped.out_of_range += 1;
            return None;
        };
        let walk = RayWalk::between(self.origin, self.start, self.grid.to_voxel_units(end_m), last);
        if walk.steps() > MAX_RAY_STEPS {
            skipped.ray_too_long += 1;
            return None;
        }
        report.cut_at_max_range += u64::from(!is_hit);
        let hit = Observation::Hit(intensity);
        Some(Ray { walk, end: (is_hit && self.model.is_evidence(hit)).then_some((last, hit)) })
    }
}
