use super::scan_hits::HitsByTile;
use super::scan_tracer::{ScanTracer, TraceRules, origin_voxel};
use super::trace_limit::{CollectorLimit, TraceLimit};
use crate::config::{Layers, RayConfig};
use crate::error::Result;
use crate::scan::clearing::Clearance;
use crate::scan::coherence::{sampling_passes, single_pass};
use crate::scan::pages::{MAX_RAYS, Window};
use crate::scan::per_ray::{OrderedCollector, PerRayCollector, drain_in_order, updates_in_order};
use crate::scan::per_scan::{BATCH, HitBatch, PerScanCollector};
use crate::scan::ray::{
    MAX_RAY_STEPS, NO_RETURN_M, RangeRule, Ranged, RayCut, RayEnd, RayOrigin, SlabRay, SlabSpan,
};
use crate::scan::scan_points::ScanPoints;
use crate::scan::spill::ScanParts;
use crate::scan::stop::Stop;
use crate::scan::updates::{MappedTiles, ScanUpdates};
use crate::scan::{ChunkMarks, ScanReport, SkippedPoints};
use crate::sensor::{Observation, SensorModel};
use crate::space::{Grid, Point, TileSelection, VoxelIndex};
use rayon::prelude::*;
use std::ops::Range;

/// Minimum number of rays per thread: fewer do not justify a thread with its own pages.
const MIN_RAYS_PER_THREAD: usize = 4096;

/// Number of rays that a collector first receives under a memory limit, before their size is known.
const FIRST_RAYS: usize = 1024;

/// Rays of a scan, from one origin.
pub(crate) struct ScanRays<'a> {
    mapped: MappedTiles<'a>,
    model: &'a SensorModel,
    rays: &'a RayConfig,
    points: &'a dyn ScanPoints,
    origin_m: Point,
    origin: RayOrigin,
    /// Clips rays to the traced tiles; `None` for the whole space.
    cut: Option<RayCut<'a>>,
    /// Rule for weak misses, if the map has one.
    clearance: Option<Clearance>,
    window: Window,
    range: RangeRule,
    /// Whether voxel indices of all points fit, and no ray is too long.
    all_in_reach: bool,
    /// Maximum number of threads.
    max_threads: usize,
    stop: &'a Stop,
}

/// Result of an insertion per scan under a memory limit.
pub(crate) enum PerScanUpdates<'a> {
    /// All updates fitted in memory.
    Whole(ScanUpdates),
    /// They did not fit and were all added to the parts. The report covers the points; the hits are in no part.
    InParts(ScanReport, HitsByTile<'a>),
}

impl<'a> ScanRays<'a> {
    /// `traced` are the mapped tiles and those around them that the rule of clearing needs.
    pub(crate) fn new(
        rules: TraceRules<'a>,
        traced: Option<&'a TileSelection>,
        points: &'a dyn ScanPoints,
        max_threads: usize,
        stop: &'a Stop,
    ) -> Result<Self> {
        let TraceRules { mapped, model, rays, .. } = rules;
        ScanTracer::check(mapped.grid, model, points)?;
        let origin_m = points.origin();
        let grid = mapped.grid;
        let voxel = origin_voxel(grid, origin_m)?;
        let origin = RayOrigin::new(grid.to_voxel_units(origin_m), voxel);
        let cut = traced.map(|tiles| RayCut::new(grid, tiles, &origin));
        let clearance = rules.guard().map(|guard| Clearance::new(guard, voxel));
        let range = RangeRule::new(rays, origin_m);
        let window = Window::default();
        let mut scan_rays = Self {
            mapped,
            model,
            rays,
            points,
            origin_m,
            origin,
            cut,
            clearance,
            window,
            range,
            all_in_reach: false,
            max_threads,
            stop,
        };
        // A window for all rays in range saves a pass over the points. Clearing it must not take longer.
        let max_pages = points.len() / scan_rays.threads();
        let in_range = scan_rays.bounds_of_range();
        let bounds = match in_range.filter(|bounds| Window::can_hold(*bounds, max_pages)) {
            Some(bounds) if is_in_reach(voxel, bounds) => bounds,
            _ => scan_rays.bounds()?,
        };
        scan_rays.window = Window::around(voxel, bounds);
        scan_rays.all_in_reach = is_in_reach(voxel, bounds);
        Ok(scan_rays)
    }

    pub(crate) fn clearance(&self) -> Option<Clearance> {
        self.clearance
    }

    pub(super) fn mapped(&self) -> MappedTiles<'a> {
        self.mapped
    }

    pub(super) fn points(&self) -> &'a dyn ScanPoints {
        self.points
    }

    pub(super) fn stop(&self) -> &'a Stop {
        self.stop
    }

    /// Insertion per scan: one update per voxel, a hit overrides any miss. The result does not depend on the order of
    /// the rays, so they are divided among threads.
    ///
    /// The points that hit voxels are collected on the way, for the given layers.
    pub(crate) fn per_scan(
        &self,
        layers: Layers,
        collectors: &mut Vec<PerScanCollector>,
    ) -> Result<ScanUpdates> {
        let (collectors, report, hits) =
            self.collect_per_scan(layers, collectors, self.threads(), &CollectorLimit::NONE, None)?;
        self.stop.check()?;
        Ok(self.merge(collectors, report, hits))
    }

    /// Like [`Self::per_scan`], under a memory limit: updates that do not fit are all added to `parts`.
    pub(crate) fn per_scan_in_parts(
        &self,
        layers: Layers,
        collectors: &mut Vec<PerScanCollector>,
        limit: &TraceLimit,
        parts: &ScanParts<'_>,
    ) -> Result<PerScanUpdates<'a>> {
        let threads = limit.collectors(self.threads());
        let (collectors, report, hits) =
            self.collect_per_scan(layers, collectors, threads, &limit.of_collector(threads), Some(parts))?;
        self.stop.check()?;
        if parts.is_empty() && limit.has_room_for(collectors, self.mapped.grid) {
            return Ok(PerScanUpdates::Whole(self.merge(collectors, report, hits)));
        }
        collectors.par_iter_mut().for_each(|collector| collector.finish(parts));
        Ok(PerScanUpdates::InParts(report, hits))
    }

    fn merge(
        &self,
        collectors: &mut [PerScanCollector],
        report: ScanReport,
        hits: HitsByTile<'_>,
    ) -> ScanUpdates {
        let (first, others) = collectors.split_at_mut(1);
        others.iter().for_each(|other| first[0].absorb(other));
        let mut updates = first[0].updates(self.mapped, self.clearance.as_ref(), report);
        hits.add_to(&mut updates);
        updates
    }

    fn collect_per_scan<'c>(
        &self,
        layers: Layers,
        collectors: &'c mut Vec<PerScanCollector>,
        threads: usize,
        limit: &CollectorLimit,
        parts: Option<&ScanParts<'_>>,
    ) -> Result<(&'c mut [PerScanCollector], ScanReport, HitsByTile<'a>)> {
        let needs_intensity = self.model.needs_intensity();
        let all = 0..self.points.len();
        let collected = self.collect_each(collectors, all, threads, |collector, range| {
            collector.clear(self.window, limit);
            // Ends of the rays of a chunk, if points are collected for layers.
            let (mut hits, mut ends) = (self.no_hits(layers), Vec::new());
            let mut report = ScanReport { points: range.len() as u64, ..ScanReport::default() };
            let mut batch = Vec::with_capacity(BATCH);
            let mut hit_batch = self.takes_batches(layers).then(Box::<HitBatch>::default);
            let (mut seen, mut extend_at) = (0, 0);
            let mut marks = ChunkMarks::from(self.points.moving(), range.start);
            self.for_each_attributed_chunk(layers, range, &mut |points, intensities, attributes| {
                // Extending the prefixes takes equally long for each chunk, but later chunks add less to them. So they
                // are extended whenever the number of points has doubled.
                let extends = seen >= extend_at;
                if extends {
                    extend_at = 2 * (seen + points.len());
                }
                seen += points.len();
                let is_moving = marks.next(points.len());
                ends.clear();
                if !layers.is_none() {
                    // In the order of the points, because neighbors often hit the same voxel.
                    ends.extend((0..points.len()).map(|number| {
                        let of_ray = intensity(intensities, number);
                        let is_moving = is_set(is_moving, number);
                        let end = self.end(points[number], of_ray, is_moving, &mut report);
                        if let Some(end) = end.filter(|end| end.hit.is_some()) {
                            let intensity = intensities.map_or(f32::NAN, |_| of_ray);
                            hits.push_point(&end, intensity, attributes, number);
                        }
                        end
                    }));
                }
                for pass in
                    if extends { sampling_passes(0..points.len()) } else { single_pass(0..points.len()) }
                {
                    collector.extend_prefixes(&self.origin, pass.squares, self.cut.as_ref());
                    if let Some(hits) = &mut hit_batch {
                        let of_pass = pass.points().map(|number| points[number]);
                        if !self.take_batches(of_pass, hits, collector, parts, &mut report) {
                            return false;
                        }
                        continue;
                    }
                    for number in pass.points() {
                        batch.extend(if layers.is_none() {
                            let intensity = intensity(intensities, number);
                            self.ray(points[number], intensity, is_set(is_moving, number), &mut report)
                        } else {
                            ends[number].and_then(|end| self.cut(end))
                        });
                        if batch.len() == BATCH {
                            collector.take(&self.origin, &batch, needs_intensity, parts);
                            batch.clear();
                            if !self.continues(parts) {
                                return false;
                            }
                        }
                    }
                    collector.take(&self.origin, &batch, needs_intensity, parts);
                    batch.clear();
                }
                self.continues(parts)
            })?;
            Ok((report, hits))
        })?;
        let mut all = (ScanReport::default(), self.no_hits(layers));
        for (report, hits) in collected {
            all.0 += report;
            all.1.append(hits);
        }
        Ok((&mut collectors[..threads], all.0, all.1))
    }

    /// Returns whether points can be taken in batches: each point that the range rule makes a hit is one, with a whole
    /// ray, and there are enough of them.
    fn takes_batches(&self, layers: Layers) -> bool {
        self.points.len() >= BATCH
            && self.all_in_reach
            && self.cut.is_none()
            && layers.is_none()
            && self.points.moving().is_none()
            && !self.model.needs_intensity()
    }

    /// Adds points, most of which are hits, in batches. Returns whether to continue.
    fn take_batches(
        &self,
        mut points: impl Iterator<Item = Point>,
        hits: &mut HitBatch,
        collector: &mut PerScanCollector,
        parts: Option<&ScanParts<'_>>,
        report: &mut ScanReport,
    ) -> bool {
        let mut others = Vec::new();
        let mut take = |hits: &mut HitBatch| {
            hits.remove_uncertain(&self.range, |point| others.extend(self.end(point, 0.0, false, report)));
            hits.find_rays(self.mapped.grid, &self.origin);
            collector.take_hits(&self.origin, hits, parts);
            hits.clear();
            if !others.is_empty() {
                collector.take(&self.origin, &others, false, parts);
                others.clear();
            }
            self.continues(parts)
        };
        points.all(|point| !hits.push(point) || take(hits)) && take(hits)
    }

    /// Insertion per ray, in the order of the points: the misses of a ray from the sensor outward, then its hit.
    pub(crate) fn per_ray(&self, collectors: &mut Vec<PerRayCollector>) -> Result<ScanUpdates> {
        let parts = self.threads().max(self.points.len().div_ceil(MAX_RAYS));
        let (collectors, report) = self.collect(collectors, parts, |collector, range| {
            collector.clear(self.window, None);
            let mut report = ScanReport::default();
            self.take_rays(collector, range, |_, _| false, &mut report)?;
            Ok(report)
        })?;
        Ok(updates_in_order(self.mapped, collectors, report))
    }

    /// Like [`Self::per_ray`], under a memory limit: as many rays at a time as fit. A part is added after the parts of
    /// all earlier rays.
    pub(crate) fn per_ray_in_parts(
        &self,
        collectors: &mut Vec<PerRayCollector>,
        limit: &TraceLimit,
        parts: &ScanParts<'_>,
    ) -> Result<ScanReport> {
        let all = self.points.len();
        let threads = limit.collectors(self.max_threads);
        let each = limit.of_collector(threads);
        let mut report = ScanReport::default();
        let (mut next, mut at_a_time) = (0, FIRST_RAYS);
        while next < all && self.continues(Some(parts)) {
            let some = next..all.min(next + threads * at_a_time.min(MAX_RAYS));
            let threads = threads.min(some.len().div_ceil(FIRST_RAYS));
            let reports = self.collect_each(collectors, some.clone(), threads, |collector, range| {
                collector.clear(self.window, Some((&each, self.mapped.grid)));
                let mut report = ScanReport::default();
                self.take_rays(collector, range, PerRayCollector::is_full_for, &mut report)?;
                Ok(report)
            })?;
            // If a collector was full, the rays after its last one are traced again in the next round.
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
            drain_in_order(self.mapped, &mut collectors[..used], parts);
            at_a_time = match next < some.end {
                true => ((next - some.start) / threads).max(1),
                false => at_a_time.saturating_mul(2),
            };
        }
        Ok(report)
    }

    /// Adds the rays to the points of a range until the collector is full.
    fn take_rays(
        &self,
        collector: &mut PerRayCollector,
        range: Range<usize>,
        is_full_for: impl Fn(&mut PerRayCollector, &SlabRay<'_>) -> bool,
        report: &mut ScanReport,
    ) -> Result<()> {
        let mut marks = ChunkMarks::from(self.points.moving(), range.start);
        self.points.for_each_chunk(range, &mut |points, intensities| {
            let is_moving = marks.next(points.len());
            for (number, &point) in points.iter().enumerate() {
                let before = *report;
                report.points += 1;
                let (intensity, is_moving) = (intensity(intensities, number), is_set(is_moving, number));
                let Some(end) = self.ray(point, intensity, is_moving, report) else { continue };
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

    /// Insertion per ray, as a list of all updates.
    pub(crate) fn per_ray_in_order(&self) -> Result<ScanUpdates> {
        let mut collector = OrderedCollector::new(self.mapped, self.model.needs_intensity());
        let report = self.in_order(&mut collector, |_| ())?;
        Ok(collector.into_updates(report))
    }

    /// Like [`Self::per_ray_in_order`], under a memory limit.
    pub(crate) fn per_ray_in_order_in_parts(
        &self,
        limit: &TraceLimit,
        parts: &ScanParts<'_>,
    ) -> Result<ScanReport> {
        let mut collector = OrderedCollector::new(self.mapped, self.model.needs_intensity());
        let max_bytes = limit.of_collector(1).small_bytes;
        let report = self.in_order(&mut collector, |collector| {
            if collector.bytes() > max_bytes {
                collector.drain_to(parts);
            }
        })?;
        collector.drain_to(parts);
        Ok(report)
    }

    fn in_order(
        &self,
        collector: &mut OrderedCollector<'_>,
        mut after_ray: impl FnMut(&mut OrderedCollector<'_>),
    ) -> Result<ScanReport> {
        let range = 0..self.points.len();
        let mut report = ScanReport { points: range.len() as u64, ..ScanReport::default() };
        let mut marks = ChunkMarks::from(self.points.moving(), range.start);
        self.points.for_each_chunk(range, &mut |points, intensities| {
            let is_moving = marks.next(points.len());
            for (number, &point) in points.iter().enumerate() {
                let (intensity, is_moving) = (intensity(intensities, number), is_set(is_moving, number));
                let Some(end) = self.ray(point, intensity, is_moving, &mut report) else { continue };
                let ray = SlabRay::new(&self.origin, end);
                ray.for_each_exactly(|voxel| collector.push(voxel, Observation::Miss));
                if let Some(intensity) = end.hit {
                    collector.push(end.voxel, Observation::Hit(intensity));
                }
                after_ray(collector);
            }
            !self.stop.is_set()
        })?;
        Ok(report)
    }

    /// Number of parts into which the points are divided, each with its own collector.
    pub(super) fn threads(&self) -> usize {
        self.max_threads.min(self.points.len() / MIN_RAYS_PER_THREAD).max(1)
    }

    fn continues(&self, parts: Option<&ScanParts<'_>>) -> bool {
        !self.stop.is_set() && !parts.is_some_and(ScanParts::has_failed)
    }

    /// Collects each part of the points with its own collector, in order.
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

    fn collect_each<C: Default + Send, R: Send>(
        &self,
        collectors: &mut Vec<C>,
        points: Range<usize>,
        parts: usize,
        collect: impl Fn(&mut C, Range<usize>) -> Result<R> + Sync,
    ) -> Result<Vec<R>> {
        if collectors.len() < parts {
            collectors.resize_with(parts, C::default);
        }
        let collectors = collectors[..parts].par_iter_mut().enumerate();
        collectors.map(|(part, collector)| collect(collector, part_of(&points, part, parts))).collect()
    }

    /// Bounds of all points within the max range, in units of voxels; `None` without one.
    fn bounds_of_range(&self) -> Option<(Point, Point)> {
        let range_m = self.rays.max_range_m?;
        let side = |range_m: f64| self.mapped.grid.to_voxel_units(self.origin_m.map(|x| x + range_m));
        Some((side(-range_m), side(range_m)))
    }

    /// Bounds of the finite points, clipped at the max range, in units of voxels.
    fn bounds(&self) -> Result<(Point, Point)> {
        let (mut low, mut high) = (self.origin_m, self.origin_m);
        let mut has_no_return = false;
        self.points.for_each_chunk(0..self.points.len(), &mut |points, _| {
            if self.rays.no_return_range_m.is_none()
                && let Some((least, most)) = bounds_of_finite(points)
            {
                low = smaller(low, least);
                high = larger(high, most);
                return true;
            }
            for &point in points.iter().filter(|point| point.iter().all(|x| x.is_finite())) {
                if self.rays.no_return_range_m.is_some()
                    && (0..3).any(|axis| (point[axis] - self.origin_m[axis]).abs() > NO_RETURN_M / 2.0)
                {
                    has_no_return = true;
                    continue;
                }
                low = smaller(low, point);
                high = larger(high, point);
            }
            true
        })?;
        if let Some(range_m) = self.rays.no_return_range_m.filter(|_| has_no_return) {
            for axis in 0..3 {
                low[axis] = low[axis].min(self.origin_m[axis] - range_m);
                high[axis] = high[axis].max(self.origin_m[axis] + range_m);
            }
        }
        if let Some(range_m) = self.rays.max_range_m {
            for axis in 0..3 {
                low[axis] = low[axis].max(self.origin_m[axis] - range_m);
                high[axis] = high[axis].min(self.origin_m[axis] + range_m);
            }
        }
        let grid = self.mapped.grid;
        Ok((grid.to_voxel_units(low), grid.to_voxel_units(high)))
    }

    /// Returns the end of the ray to a point; `None` if the point is skipped or its ray crosses no mapped tile. A point
    /// that is marked as moving is no hit.
    #[inline]
    fn ray(&self, point: Point, intensity: f32, is_moving: bool, report: &mut ScanReport) -> Option<RayEnd> {
        self.end(point, intensity, is_moving, report).and_then(|end| self.cut(end))
    }

    /// Clips a whole ray to the mapped tiles; `None` if it crosses none.
    #[inline]
    fn cut(&self, end: RayEnd) -> Option<RayEnd> {
        match &self.cut {
            None => Some(end),
            Some(cut) => cut.apply(&self.origin, end),
        }
    }

    /// Like [`Self::ray`], but of the whole ray, whatever tiles are mapped.
    #[inline(always)]
    pub(super) fn end(
        &self,
        point: Point,
        intensity: f32,
        is_moving: bool,
        report: &mut ScanReport,
    ) -> Option<RayEnd> {
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
        let end = self.mapped.grid.to_voxel_units(end_m);
        let last = match self.all_in_reach {
            true => Grid::voxel_of_fitting_units(end),
            false => self.checked_voxel(end, skipped)?,
        };
        report.cut_at_max_range += u64::from(!is_hit);
        let hit = Observation::Hit(intensity);
        let hit = (is_hit && !is_moving && self.model.is_evidence(hit)).then_some(intensity);
        Some(RayEnd { point: end, voxel: last, hit, span: SlabSpan::WHOLE })
    }

    /// The voxel in which a ray ends; `None` if its index does not fit, or the ray is too long.
    #[cold]
    fn checked_voxel(&self, end: Point, skipped: &mut SkippedPoints) -> Option<VoxelIndex> {
        let Some(last) = Grid::voxel_of_units(end) else {
            skipped.out_of_range += 1;
            return None;
        };
        let steps: u64 = (0..3).map(|k| u64::from(self.origin.voxel[k].abs_diff(last[k]))).sum();
        skipped.ray_too_long += u64::from(steps > MAX_RAY_STEPS);
        (steps <= MAX_RAY_STEPS).then_some(last)
    }
}

/// Returns whether the indices of all voxels in bounds, in units of voxels, fit, and no ray to them is too long.
fn is_in_reach(origin: VoxelIndex, (low, high): (Point, Point)) -> bool {
    // More than the rounding error of a point that was clipped at the max range.
    const MARGIN: f64 = 2.0;
    let farthest = |k: usize| {
        let origin = f64::from(origin[k]);
        (high[k] - origin).max(origin - low[k]) + MARGIN
    };
    let limit = f64::from(i32::MAX) - MARGIN;
    (0..3).map(farthest).sum::<f64>() <= MAX_RAY_STEPS as f64
        && low.iter().chain(&high).all(|&coordinate| coordinate.abs() < limit)
}

/// Returns the bounds of points that are all finite; `None` if one is not. Processes two points at a time, for vector
/// instructions.
fn bounds_of_finite(points: &[Point]) -> Option<(Point, Point)> {
    let (mut low, mut high) = ([[f64::INFINITY; 3]; 2], [[f64::NEG_INFINITY; 3]; 2]);
    // Each sum is 0 while all coordinates are finite; otherwise it becomes NaN.
    let mut all = [[0.0; 3]; 2];
    let (pairs, rest) = points.as_chunks::<2>();
    let last = rest.first().map(|&point| [point; 2]);
    for pair in pairs.iter().chain(&last) {
        for point in 0..2 {
            low[point] = smaller(low[point], pair[point]);
            high[point] = larger(high[point], pair[point]);
            all[point] = std::array::from_fn(|axis| all[point][axis] + pair[point][axis] * 0.0);
        }
    }
    let is_finite = all.iter().flatten().all(|sum| *sum == 0.0);
    is_finite.then(|| (smaller(low[0], low[1]), larger(high[0], high[1])))
}

// Unlike `f64::min` and `f64::max`, these functions have no special case for NaN, so each is one instruction.
#[inline]
fn smaller(a: Point, b: Point) -> Point {
    std::array::from_fn(|axis| if b[axis] < a[axis] { b[axis] } else { a[axis] })
}

#[inline]
fn larger(a: Point, b: Point) -> Point {
    std::array::from_fn(|axis| if b[axis] > a[axis] { b[axis] } else { a[axis] })
}

/// Returns part `part` of `parts` equal parts of a range.
pub(super) fn part_of(points: &Range<usize>, part: usize, parts: usize) -> Range<usize> {
    let at = |part| points.start + points.len() * part / parts;
    at(part)..at(part + 1)
}

#[inline]
pub(super) fn is_set(marks: &[bool], number: usize) -> bool {
    marks.get(number).is_some_and(|is_set| *is_set)
}

#[inline]
fn intensity(intensities: Option<&[f32]>, number: usize) -> f32 {
    intensities.map_or(0.0, |intensities| intensities[number])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn bounds_of_finite_points_are_exact(
            points in prop::collection::vec(prop::array::uniform3(-1e9..1e9_f64), 0..9),
            wrong in prop::option::of((0..9_usize, 0..3_usize, prop::sample::select(vec![
                f64::NAN, f64::INFINITY, f64::NEG_INFINITY,
            ]))),
        ) {
            let mut points = points;
            let wrong = wrong.filter(|(number, ..)| *number < points.len());
            if let Some((number, axis, x)) = wrong {
                points[number][axis] = x;
            }
            let by = |pick: fn(f64, f64) -> f64, none| {
                points.iter().fold([none; 3], |bound, point| std::array::from_fn(|k| pick(bound[k], point[k])))
            };
            let naive = (by(f64::min, f64::INFINITY), by(f64::max, f64::NEG_INFINITY));
            prop_assert_eq!(bounds_of_finite(&points), wrong.is_none().then_some(naive));
        }
    }
}
