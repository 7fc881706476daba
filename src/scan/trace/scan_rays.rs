use super::scan_tracer::origin_voxel;
use super::trace_limit::{CollectorLimit, TraceLimit};
use crate::config::RayConfig;
use crate::error::Result;
use crate::scan::ScanReport;
use crate::scan::coherence::{one_round, rounds};
use crate::scan::pages::{MAX_RAYS, Window};
use crate::scan::per_ray::{EveryRayCollector, OrderedCollector, put_in_order, updates_in_order};
use crate::scan::per_scan::{BATCH, OnceCollector};
use crate::scan::ray::{MAX_RAY_STEPS, RangeRule, Ranged, RayEnd, RayOrigin, SlabRay};
use crate::scan::scan_points::ScanPoints;
use crate::scan::spill::ScanParts;
use crate::scan::stop::Stop;
use crate::scan::updates::ScanUpdates;
use crate::sensor::{Observation, SensorModel};
use crate::space::{Grid, Point};
use rayon::prelude::*;
use std::ops::Range;

/// Rays that a thread walks at least: fewer are not worth a thread's own marks.
const LEAST_RAYS_A_THREAD: usize = 4096;

/// Rays that a collector takes at first where memory is limited, until it is known what they leave.
const FIRST_RAYS: usize = 1024;

/// The rays of a scan, from one origin.
pub(crate) struct Fan<'a> {
    grid: &'a Grid,
    model: &'a SensorModel,
    rays: &'a RayConfig,
    points: &'a dyn ScanPoints,
    origin_m: Point,
    origin: RayOrigin,
    window: Window,
    range: RangeRule,
    stop: &'a Stop,
}

/// What became of a scan of which each voxel counts once.
pub(crate) enum OnceInParts {
    /// There was room for its updates.
    Whole(ScanUpdates),
    /// There was none: all were given in; this is what became of the points.
    InParts(ScanReport),
}

impl<'a> Fan<'a> {
    pub(crate) fn new(
        grid: &'a Grid,
        model: &'a SensorModel,
        rays: &'a RayConfig,
        origin_m: Point,
        points: &'a dyn ScanPoints,
        stop: &'a Stop,
    ) -> Result<Self> {
        let voxel = origin_voxel(grid, origin_m)?;
        let origin = RayOrigin::new(grid.to_voxel_units(origin_m), voxel);
        let range = RangeRule::new(rays, origin_m);
        let window = Window::default();
        let mut fan = Self { grid, model, rays, points, origin_m, origin, window, range, stop };
        fan.window = Window::around(voxel, fan.bounds()?);
        Ok(fan)
    }

    /// One update a voxel, a hit over any miss. Which voxels these are does not depend on the order of the rays, so
    /// each thread walks some of them.
    pub(crate) fn once_a_voxel(&self, collectors: &mut Vec<OnceCollector>) -> Result<ScanUpdates> {
        let (collectors, report) =
            self.collect_once(collectors, self.threads(), &CollectorLimit::NONE, None)?;
        Ok(self.united(collectors, report))
    }

    /// The same within a limit of memory: the updates, if there is room for them; otherwise all of them go to `parts`.
    pub(crate) fn once_a_voxel_in_parts(
        &self,
        collectors: &mut Vec<OnceCollector>,
        limit: &TraceLimit,
        parts: &ScanParts<'_>,
    ) -> Result<OnceInParts> {
        let threads = limit.collectors(self.threads());
        let (collectors, report) =
            self.collect_once(collectors, threads, &limit.of_collector(threads), Some(parts))?;
        if parts.is_empty() && limit.has_room_for(collectors) {
            return Ok(OnceInParts::Whole(self.united(collectors, report)));
        }
        collectors.par_iter_mut().for_each(|collector| collector.finish(parts));
        Ok(OnceInParts::InParts(report))
    }

    fn united(&self, collectors: &mut [OnceCollector], report: ScanReport) -> ScanUpdates {
        let (first, others) = collectors.split_at_mut(1);
        others.iter().for_each(|other| first[0].absorb(other));
        first[0].updates(self.grid, report)
    }

    fn collect_once<'c>(
        &self,
        collectors: &'c mut Vec<OnceCollector>,
        threads: usize,
        limit: &CollectorLimit,
        parts: Option<&ScanParts<'_>>,
    ) -> Result<(&'c mut [OnceCollector], ScanReport)> {
        let needs_intensity = self.model.needs_intensity();
        self.collect(collectors, threads, |collector, range| {
            collector.clear(self.window, limit);
            let mut report = ScanReport { points: range.len() as u64, ..ScanReport::default() };
            let mut batch = Vec::with_capacity(BATCH);
            let (mut seen, mut worth_sharing) = (0, 0);
            self.points.for_each_chunk(range, &mut |points, intensities| {
                // What chunk after chunk adds is less and less, and to look takes as long each time.
                let shares = seen >= worth_sharing;
                if shares {
                    worth_sharing = 2 * (seen + points.len());
                }
                seen += points.len();
                for round in if shares { rounds(0..points.len()) } else { one_round(0..points.len()) } {
                    collector.share(&self.origin, round.shared_squares);
                    for number in round.points() {
                        batch.extend(self.ray(points[number], intensity(intensities, number), &mut report));
                        if batch.len() == BATCH {
                            collector.take(&self.origin, &batch, needs_intensity, parts);
                            batch.clear();
                            if !self.goes_on(parts) {
                                return false;
                            }
                        }
                    }
                    collector.take(&self.origin, &batch, needs_intensity, parts);
                    batch.clear();
                }
                self.goes_on(parts)
            })?;
            Ok(report)
        })
    }

    /// Every ray counts: its misses from the sensor outward, then its hit, in the order of the points.
    pub(crate) fn every_ray(&self, collectors: &mut Vec<EveryRayCollector>) -> Result<ScanUpdates> {
        let parts = self.threads().max(self.points.len().div_ceil(MAX_RAYS));
        let (collectors, report) = self.collect(collectors, parts, |collector, range| {
            collector.clear(self.window, None);
            let mut report = ScanReport::default();
            self.take_rays(collector, range, |_, _| false, &mut report)?;
            Ok(report)
        })?;
        Ok(updates_in_order(self.grid, collectors, report))
    }

    /// The same within a limit of memory: so many rays at a time as there is room for. A part is given in when all rays
    /// before it are.
    pub(crate) fn every_ray_in_parts(
        &self,
        collectors: &mut Vec<EveryRayCollector>,
        limit: &TraceLimit,
        parts: &ScanParts<'_>,
    ) -> Result<ScanReport> {
        let all = self.points.len();
        let threads = limit.collectors(rayon::current_num_threads());
        let each = limit.of_collector(threads);
        let mut report = ScanReport::default();
        let (mut next, mut at_a_time) = (0, FIRST_RAYS);
        while next < all && self.goes_on(Some(parts)) {
            let some = next..all.min(next + threads * at_a_time.min(MAX_RAYS));
            let threads = threads.min(some.len().div_ceil(FIRST_RAYS));
            let reports = self.collect_each(collectors, some.clone(), threads, |collector, range| {
                collector.clear(self.window, Some((&each, self.grid)));
                let mut report = ScanReport::default();
                self.take_rays(collector, range, EveryRayCollector::is_full_for, &mut report)?;
                Ok(report)
            })?;
            // What comes after a collector that was full is taken again.
            let mut used = 0;
            for (part, of_part) in reports.into_iter().enumerate() {
                let wanted = part_of(&some, part, threads);
                next = wanted.start + of_part.points as usize;
                report += of_part;
                used = part + 1;
                if next < wanted.end {
                    break;
                }
            }
            put_in_order(self.grid, &mut collectors[..used], parts);
            at_a_time = match next < some.end {
                true => ((next - some.start) / threads).max(1),
                false => at_a_time.saturating_mul(2),
            };
        }
        Ok(report)
    }

    /// Takes the rays to the points of a range until the collector is full.
    fn take_rays(
        &self,
        collector: &mut EveryRayCollector,
        range: Range<usize>,
        is_full_for: impl Fn(&mut EveryRayCollector, &SlabRay<'_>) -> bool,
        report: &mut ScanReport,
    ) -> Result<()> {
        self.points.for_each_chunk(range, &mut |points, intensities| {
            for (number, &point) in points.iter().enumerate() {
                let before = *report;
                report.points += 1;
                let Some(end) = self.ray(point, intensity(intensities, number), report) else { continue };
                let ray = SlabRay::new(&self.origin, end);
                if is_full_for(collector, &ray) {
                    *report = before;
                    return false;
                }
                collector.pass(&ray);
                if let Some(intensity) = end.hit {
                    collector.hit(end.voxel, intensity);
                }
            }
            !self.stop.is_set()
        })
    }

    /// Every ray counts, with every update for itself.
    pub(crate) fn every_ray_in_order(&self) -> Result<ScanUpdates> {
        let mut collector = OrderedCollector::new(self.grid, self.model.needs_intensity());
        let report = self.in_order(&mut collector, |_| ())?;
        Ok(collector.into_updates(report))
    }

    /// The same within a limit of memory.
    pub(crate) fn every_ray_in_order_in_parts(
        &self,
        limit: &TraceLimit,
        parts: &ScanParts<'_>,
    ) -> Result<ScanReport> {
        let mut collector = OrderedCollector::new(self.grid, self.model.needs_intensity());
        let most_bytes = limit.of_collector(1).small_bytes;
        let report = self.in_order(&mut collector, |collector| {
            if collector.bytes() > most_bytes {
                collector.put_in(parts);
            }
        })?;
        collector.put_in(parts);
        Ok(report)
    }

    fn in_order(
        &self,
        collector: &mut OrderedCollector<'_>,
        mut after_ray: impl FnMut(&mut OrderedCollector<'_>),
    ) -> Result<ScanReport> {
        let range = 0..self.points.len();
        let mut report = ScanReport { points: range.len() as u64, ..ScanReport::default() };
        self.points.for_each_chunk(range, &mut |points, intensities| {
            for (number, &point) in points.iter().enumerate() {
                let Some(end) = self.ray(point, intensity(intensities, number), &mut report) else {
                    continue;
                };
                let walk = SlabRay::new(&self.origin, end).walk();
                walk.for_each_before_end(|voxel| collector.push(voxel, Observation::Miss));
                if let Some(intensity) = end.hit {
                    collector.push(end.voxel, Observation::Hit(intensity));
                }
                after_ray(collector);
            }
            !self.stop.is_set()
        })?;
        Ok(report)
    }

    /// In how many parts the points are taken, each with a collector of its own.
    fn threads(&self) -> usize {
        rayon::current_num_threads().min(self.points.len() / LEAST_RAYS_A_THREAD).max(1)
    }

    fn goes_on(&self, parts: Option<&ScanParts<'_>>) -> bool {
        !self.stop.is_set() && !parts.is_some_and(ScanParts::has_failed)
    }

    /// Gives each part of the points a collector, in order.
    fn collect<'c, C: Default + Send>(
        &self,
        collectors: &'c mut Vec<C>,
        parts: usize,
        collect: impl Fn(&mut C, Range<usize>) -> Result<ScanReport> + Sync,
    ) -> Result<(&'c mut [C], ScanReport)> {
        let reports = self.collect_each(collectors, 0..self.points.len(), parts, collect)?;
        let mut report = ScanReport::default();
        reports.into_iter().for_each(|part| report += part);
        Ok((&mut collectors[..parts], report))
    }

    fn collect_each<C: Default + Send>(
        &self,
        collectors: &mut Vec<C>,
        points: Range<usize>,
        parts: usize,
        collect: impl Fn(&mut C, Range<usize>) -> Result<ScanReport> + Sync,
    ) -> Result<Vec<ScanReport>> {
        if collectors.len() < parts {
            collectors.resize_with(parts, C::default);
        }
        let collectors = collectors[..parts].par_iter_mut().enumerate();
        collectors.map(|(part, collector)| collect(collector, part_of(&points, part, parts))).collect()
    }

    /// Bounds of the points, cut at the max range, in units of voxels; whatever is not finite is left out.
    fn bounds(&self) -> Result<(Point, Point)> {
        let (mut low, mut high) = (self.origin_m, self.origin_m);
        self.points.for_each_chunk(0..self.points.len(), &mut |points, _| {
            for point in points.iter().filter(|point| point.iter().all(|x| x.is_finite())) {
                for axis in 0..3 {
                    low[axis] = low[axis].min(point[axis]);
                    high[axis] = high[axis].max(point[axis]);
                }
            }
            true
        })?;
        if let Some(range_m) = self.rays.max_range_m {
            for axis in 0..3 {
                low[axis] = low[axis].max(self.origin_m[axis] - range_m);
                high[axis] = high[axis].min(self.origin_m[axis] + range_m);
            }
        }
        Ok((self.grid.to_voxel_units(low), self.grid.to_voxel_units(high)))
    }

    /// Where the ray to a point ends; `None` if it does not count.
    #[inline]
    fn ray(&self, point: Point, intensity: f32, report: &mut ScanReport) -> Option<RayEnd> {
        if self.stop.is_set() {
            return None;
        }
        let skipped = &mut report.skipped;
        if self.model.needs_intensity() && intensity.is_nan() {
            skipped.no_intensity += 1;
            return None;
        }
        let (end_m, is_hit) = match self.range.apply(point, skipped) {
            Ranged::Hit(point) => (point, true),
            Ranged::Cut(point) => (point, false),
            Ranged::Skipped => return None,
        };
        let end = self.grid.to_voxel_units(end_m);
        let Some(last) = Grid::voxel_of_units(end) else {
            skipped.out_of_range += 1;
            return None;
        };
        let steps: u64 = (0..3).map(|k| u64::from(self.origin.voxel[k].abs_diff(last[k]))).sum();
        if steps > MAX_RAY_STEPS {
            skipped.ray_too_long += 1;
            return None;
        }
        report.cut_at_max_range += u64::from(!is_hit);
        let hit = Observation::Hit(intensity);
        let hit = (is_hit && self.model.is_evidence(hit)).then_some(intensity);
        Some(RayEnd { point: end, voxel: last, hit })
    }
}

/// The points of one of so many parts of a range.
fn part_of(points: &Range<usize>, part: usize, parts: usize) -> Range<usize> {
    let at = |part| points.start + points.len() * part / parts;
    at(part)..at(part + 1)
}

#[inline]
fn intensity(intensities: Option<&[f32]>, number: usize) -> f32 {
    intensities.map_or(0.0, |intensities| intensities[number])
}
