use super::once::OnceCollector;
use super::ordered::OrderedCollector;
use super::range::{Ranged, in_range};
use super::ray::MAX_RAY_STEPS;
use super::slab_walk::SlabRay;
use super::window::Window;
use super::{Scan, ScanReport, ScanUpdates};
use crate::config::{InsertMode, RayConfig};
use crate::error::{Error, Result};
use crate::sensor::{Observation, SensorModel};
use crate::space::{Grid, Point, VoxelIndex};
use rayon::prelude::*;
use std::ops::Range;

/// Rays that a thread walks at least: fewer are not worth a thread's own marks.
const LEAST_RAYS_A_THREAD: usize = 4096;

/// Finds out what scans say about voxels; from scan to scan it keeps the memory that this takes.
#[derive(Clone, Debug, Default)]
pub struct ScanTracer {
    /// One for every thread that takes part.
    collectors: Vec<OnceCollector>,
}

impl ScanTracer {
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
        let fan = Fan::new(grid, model, rays, scan)?;
        match rays.insert_mode {
            InsertMode::PerScan => Ok(fan.once_a_voxel(&mut self.collectors)),
            InsertMode::PerRay => Ok(fan.every_ray()),
        }
    }

    /// Bytes of memory that are kept.
    pub fn bytes(&self) -> usize {
        self.collectors.iter().map(|collector| size_of::<OnceCollector>() + collector.bytes()).sum()
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

/// The rays of a scan, from one origin.
struct Fan<'a> {
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
    path: SlabRay,
    /// The observation at its end, if its end is evidence.
    end: Option<Observation>,
}

impl<'a> Fan<'a> {
    fn new(grid: &'a Grid, model: &'a SensorModel, rays: &'a RayConfig, scan: &'a Scan) -> Result<Self> {
        let start = grid.voxel_of(scan.origin).ok_or_else(|| {
            let reason = format!("{:?} m is not finite or too far away for a voxel index", scan.origin);
            Error::argument("scan origin", reason)
        })?;
        Ok(Self { grid, model, rays, scan, origin: grid.to_voxel_units(scan.origin), start })
    }

    /// One update a voxel, a hit over any miss. Which voxels these are does not depend on the order of the rays, so
    /// each thread walks some of them.
    fn once_a_voxel(&self, collectors: &mut Vec<OnceCollector>) -> ScanUpdates {
        let points = self.scan.points.len();
        let threads = rayon::current_num_threads().min(points / LEAST_RAYS_A_THREAD).max(1);
        if collectors.len() < threads {
            collectors.resize_with(threads, OnceCollector::default);
        }
        let window = Window::around(self.start, self.bounds());
        let collect = |(part, collector): (usize, &mut OnceCollector)| {
            collector.clear(window);
            self.collect_once(collector, points * part / threads..points * (part + 1) / threads)
        };
        let reports: Vec<ScanReport> =
            collectors[..threads].par_iter_mut().enumerate().map(collect).collect();
        let mut report = ScanReport::default();
        reports.into_iter().for_each(|part| report += part);
        let (first, others) = collectors.split_at_mut(1);
        others[..threads - 1].iter().for_each(|other| first[0].absorb(other));
        first[0].updates(self.grid, report)
    }

    fn collect_once(&self, collector: &mut OnceCollector, points: Range<usize>) -> ScanReport {
        let needs_intensity = self.model.needs_intensity();
        self.for_each_ray(points, |ray| {
            collector.pass(&ray.path);
            if let Some(Observation::Hit(intensity)) = ray.end {
                collector.hit(ray.path.last, needs_intensity.then_some(intensity));
            }
        })
    }

    /// Bounds of the points, cut at the max range, in units of voxels; whatever is not finite is left out.
    fn bounds(&self) -> (Point, Point) {
        let (mut low, mut high) = (self.scan.origin, self.scan.origin);
        for point in self.scan.points.iter().filter(|point| point.iter().all(|x| x.is_finite())) {
            for axis in 0..3 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
        if let Some(range_m) = self.rays.max_range_m {
            for axis in 0..3 {
                low[axis] = low[axis].max(self.scan.origin[axis] - range_m);
                high[axis] = high[axis].min(self.scan.origin[axis] + range_m);
            }
        }
        (self.grid.to_voxel_units(low), self.grid.to_voxel_units(high))
    }

    /// Every ray counts: its misses from the sensor outward, then its hit, in the order of the points.
    fn every_ray(&self) -> ScanUpdates {
        let mut collector = OrderedCollector::new(self.grid, self.model.needs_intensity());
        let report = self.for_each_ray(0..self.scan.points.len(), |ray| {
            ray.path.walk().for_each_before_end(|voxel| collector.push(voxel, Observation::Miss));
            if let Some(observation) = ray.end {
                collector.push(ray.path.last, observation);
            }
        });
        collector.into_updates(report)
    }

    fn for_each_ray(&self, points: Range<usize>, mut visit: impl FnMut(Ray)) -> ScanReport {
        let mut report = ScanReport { points: points.len() as u64, ..ScanReport::default() };
        for number in points {
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
        let steps: u64 = (0..3).map(|k| u64::from(self.start[k].abs_diff(last[k]))).sum();
        if steps > MAX_RAY_STEPS {
            skipped.ray_too_long += 1;
            return None;
        }
        report.cut_at_max_range += u64::from(!is_hit);
        let hit = Observation::Hit(intensity);
        let end = self.grid.to_voxel_units(end_m);
        let path = SlabRay { origin: self.origin, start: self.start, end, last };
        Some(Ray { path, end: (is_hit && self.model.is_evidence(hit)).then_some(hit) })
    }
}
