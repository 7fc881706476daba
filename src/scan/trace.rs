use super::counted_page::MAX_RAYS;
use super::every_ray::{EveryRayCollector, updates_in_order};
use super::once::{BATCH, OnceCollector};
use super::ordered::OrderedCollector;
use super::packed_parts::PackedParts;
use super::page_choice::{PageChoice, in_groups, pages_on_the_way};
use super::range::{RangeRule, Ranged};
use super::ray::MAX_RAY_STEPS;
use super::ray_end::RayEnd;
use super::ray_origin::RayOrigin;
use super::rounds::rounds;
use super::slab_ray::SlabRay;
use super::stop::Stop;
use super::trace_memory::TraceMemory;
use super::window::Window;
use super::{PackedUpdates, Scan, ScanReport, ScanUpdates};
use crate::config::{InsertMode, RayConfig};
use crate::error::{Error, Result};
use crate::sensor::{Observation, SensorModel};
use crate::space::{Grid, Point, TileIndex, VoxelIndex};
use rayon::prelude::*;
use std::ops::Range;

/// Rays that a thread walks at least: fewer are not worth a thread's own marks.
const LEAST_RAYS_A_THREAD: usize = 4096;

/// Takes a part of the updates of a scan, by tile.
pub(crate) type PutAside<'a> = dyn FnMut(Vec<(TileIndex, PackedUpdates)>) -> Result<()> + 'a;

/// Finds out what scans say about voxels; from scan to scan it keeps the memory that this takes.
#[derive(Clone, Debug, Default)]
pub struct ScanTracer {
    /// One for every thread that takes part.
    once: Vec<OnceCollector>,
    /// One for every part of the rays.
    every_ray: Vec<EveryRayCollector>,
    memory: TraceMemory,
    stop: Stop,
}

impl ScanTracer {
    /// Whether a scan can be traced at all; takes no time.
    ///
    /// # Errors
    ///
    /// As for [`ScanTracer::trace`].
    pub fn check(grid: &Grid, model: &SensorModel, scan: &Scan) -> Result<()> {
        check_intensities(model, scan.points.len(), scan.intensities.as_deref())?;
        origin_voxel(grid, scan).map(drop)
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
        let put_aside = &mut |_| Ok(());
        self.trace_putting_aside(grid, model, rays, scan, usize::MAX, put_aside)
    }

    /// The same for a map that is short of memory: whenever there are more than so many bytes of updates, they are put
    /// aside, and the rest is returned. The report is about all.
    ///
    /// # Errors
    ///
    /// As for [`ScanTracer::trace`], and those of putting aside.
    pub(crate) fn trace_putting_aside(
        &mut self,
        grid: &Grid,
        model: &SensorModel,
        rays: &RayConfig,
        scan: &Scan,
        most_bytes: usize,
        put_aside: &mut PutAside<'_>,
    ) -> Result<ScanUpdates> {
        check_intensities(model, scan.points.len(), scan.intensities.as_deref())?;
        let fan = Fan::new(grid, model, rays, scan, self.stop.clone())?;
        let once_a_voxel = rays.insert_mode == InsertMode::PerScan;
        let collectors = fan.parts(once_a_voxel);
        let met = self.memory.may_be_short(&fan.window, collectors).then(|| fan.pages_on_the_way());
        let groups = match &met {
            Some(met) => in_groups(met, self.memory.pages_at_a_time(collectors)),
            None => vec![PageChoice::All],
        };
        let mut parts = PackedParts::default();
        for &choice in &groups {
            self.stop.check()?;
            let updates = match once_a_voxel {
                true => fan.once_a_voxel(&mut self.once, choice),
                false => fan.every_ray(&mut self.every_ray, choice),
            };
            self.note_memory();
            if groups.len() == 1 {
                return Ok(updates);
            }
            parts.add(updates);
            if parts.bytes() > most_bytes {
                put_aside(parts.take())?;
            }
        }
        Ok(parts.into_updates(grid))
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
        match rays.insert_mode {
            InsertMode::PerScan => self.trace(grid, model, rays, scan),
            InsertMode::PerRay => {
                check_intensities(model, scan.points.len(), scan.intensities.as_deref())?;
                Ok(Fan::new(grid, model, rays, scan, self.stop.clone())?.every_ray_in_order())
            }
        }
    }

    /// A tracer that keeps to so many bytes for its marks, if need be by following the rays several times.
    pub fn with_memory_bytes(bytes: usize) -> Self {
        Self { memory: TraceMemory::new(bytes), ..Self::default() }
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

    fn note_memory(&mut self) {
        let once = self.once.iter().map(OnceCollector::pages);
        let every_ray = self.every_ray.iter().map(EveryRayCollector::pages);
        self.memory.note(self.bytes(), once.chain(every_ray).sum());
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

fn origin_voxel(grid: &Grid, scan: &Scan) -> Result<VoxelIndex> {
    grid.voxel_of(scan.origin).ok_or_else(|| {
        let reason = format!("{:?} m is not finite or too far away for a voxel index", scan.origin);
        Error::argument("scan origin", reason)
    })
}

/// The rays of a scan, from one origin.
struct Fan<'a> {
    grid: &'a Grid,
    model: &'a SensorModel,
    rays: &'a RayConfig,
    scan: &'a Scan,
    origin: RayOrigin,
    window: Window,
    range: RangeRule,
    stop: Stop,
}

impl<'a> Fan<'a> {
    fn new(
        grid: &'a Grid,
        model: &'a SensorModel,
        rays: &'a RayConfig,
        scan: &'a Scan,
        stop: Stop,
    ) -> Result<Self> {
        let voxel = origin_voxel(grid, scan)?;
        let origin = RayOrigin::new(grid.to_voxel_units(scan.origin), voxel);
        let range = RangeRule::new(rays, scan.origin);
        let mut fan = Self { grid, model, rays, scan, origin, window: Window::default(), range, stop };
        fan.window = Window::around(voxel, fan.bounds());
        Ok(fan)
    }

    /// One update a voxel, a hit over any miss. Which voxels these are does not depend on the order of the rays, so
    /// each thread walks some of them.
    fn once_a_voxel(&self, collectors: &mut Vec<OnceCollector>, choice: PageChoice<'_>) -> ScanUpdates {
        let needs_intensity = self.model.needs_intensity();
        let parts = self.parts(true);
        let (collectors, report) = self.collect(collectors, parts, |collector, points| {
            collector.clear(self.window, choice);
            let mut report = ScanReport { points: points.len() as u64, ..ScanReport::default() };
            let mut batch = Vec::with_capacity(BATCH);
            for round in rounds(points) {
                collector.share(&self.origin, round.shared_squares);
                for number in round.points() {
                    batch.extend(self.ray(number, &mut report));
                    if batch.len() == BATCH {
                        collector.take(&self.origin, &batch, needs_intensity);
                        batch.clear();
                    }
                }
                collector.take(&self.origin, &batch, needs_intensity);
                batch.clear();
            }
            collector.finish();
            report
        });
        let (first, others) = collectors.split_at_mut(1);
        others.iter().for_each(|other| first[0].absorb(other));
        first[0].updates(self.grid, report)
    }

    /// Every ray counts: its misses from the sensor outward, then its hit, in the order of the points.
    fn every_ray(&self, collectors: &mut Vec<EveryRayCollector>, choice: PageChoice<'_>) -> ScanUpdates {
        let parts = self.parts(false);
        let (collectors, report) = self.collect(collectors, parts, |collector, points| {
            collector.clear(self.window, choice);
            let mut report = ScanReport { points: points.len() as u64, ..ScanReport::default() };
            for end in points.filter_map(|number| self.ray(number, &mut report)) {
                collector.pass(&SlabRay::new(&self.origin, end));
                if let Some(intensity) = end.hit {
                    collector.hit(end.voxel, intensity);
                }
            }
            collector.finish();
            report
        });
        updates_in_order(self.grid, collectors, report)
    }

    /// The same, with every update for itself.
    fn every_ray_in_order(&self) -> ScanUpdates {
        let mut collector = OrderedCollector::new(self.grid, self.model.needs_intensity());
        let points = 0..self.scan.points.len();
        let mut report = ScanReport { points: points.len() as u64, ..ScanReport::default() };
        for end in points.filter_map(|number| self.ray(number, &mut report)) {
            let walk = SlabRay::new(&self.origin, end).walk();
            walk.for_each_before_end(|voxel| collector.push(voxel, Observation::Miss));
            if let Some(intensity) = end.hit {
                collector.push(end.voxel, Observation::Hit(intensity));
            }
        }
        collector.into_updates(report)
    }

    /// In how many parts the points are taken, each with a collector of its own.
    fn parts(&self, once_a_voxel: bool) -> usize {
        let points = self.scan.points.len();
        let threads = rayon::current_num_threads().min(points / LEAST_RAYS_A_THREAD);
        let least = if once_a_voxel { 1 } else { points.div_ceil(MAX_RAYS).max(1) };
        threads.max(least)
    }

    fn pages_on_the_way(&self) -> Vec<u32> {
        let mut report = ScanReport::default();
        let ends = (0..self.scan.points.len()).filter_map(|number| self.ray(number, &mut report));
        pages_on_the_way(&self.window, &self.origin, ends)
    }

    /// Gives each part of the points a collector, in order.
    fn collect<'c, C: Default + Send>(
        &self,
        collectors: &'c mut Vec<C>,
        parts: usize,
        collect: impl Fn(&mut C, Range<usize>) -> ScanReport + Sync,
    ) -> (&'c mut [C], ScanReport) {
        let points = self.scan.points.len();
        if collectors.len() < parts {
            collectors.resize_with(parts, C::default);
        }
        let collectors = &mut collectors[..parts];
        let reports = collectors
            .par_iter_mut()
            .enumerate()
            .map(|(part, collector)| collect(collector, points * part / parts..points * (part + 1) / parts));
        let reports: Vec<ScanReport> = reports.collect();
        let mut report = ScanReport::default();
        reports.into_iter().for_each(|part| report += part);
        (collectors, report)
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

    /// Where the ray to a point ends; `None` if it does not count.
    #[inline]
    fn ray(&self, number: usize, report: &mut ScanReport) -> Option<RayEnd> {
        if self.stop.is_set() {
            return None;
        }
        let intensity = self.scan.intensities.as_ref().map_or(0.0, |intensities| intensities[number]);
        let skipped = &mut report.skipped;
        if self.model.needs_intensity() && intensity.is_nan() {
            skipped.no_intensity += 1;
            return None;
        }
        let (end_m, is_hit) = match self.range.apply(self.scan.points[number], skipped) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::{BrickRuns, BrickUpdate, TileUpdates};
    use crate::sensor::Iwlo;
    use proptest::prelude::*;

    /// The bricks of every tile in order, however they come.
    type Bricks = Vec<(TileIndex, Vec<BrickUpdate>, Vec<BrickRuns>)>;

    fn bricks(updates: &ScanUpdates) -> Bricks {
        let of_tile = |(tile, updates): &(TileIndex, TileUpdates)| {
            let parts = match updates {
                TileUpdates::Packed(packed) => packed.iter().collect(),
                whole => vec![whole.clone()],
            };
            let (mut once, mut runs) = (Vec::new(), Vec::new());
            for part in parts {
                match part {
                    TileUpdates::Once(bricks) => once.extend(bricks),
                    TileUpdates::Runs(bricks) => runs.extend(bricks),
                    other => panic!("{other:?}"),
                }
            }
            once.sort_by_key(|brick| brick.brick);
            runs.sort_by_key(|brick| brick.brick);
            (*tile, once, runs)
        };
        updates.tiles.iter().map(of_tile).collect()
    }

    #[test]
    fn dense_rays_with_little_memory_make_the_same_updates() {
        let grid = Grid::new(0.1, 10.0).unwrap();
        let origin = [0.03, -0.02, 0.05];
        let point = |k: u32| -> Point {
            let (azimuth, up) = (f64::from(k) * 2.399_963, f64::from(k) / 10_000.0 - 1.0);
            let (flat, reach) = ((1.0 - up * up).sqrt(), 9.0 + 3.0 * (5.0 * azimuth).sin());
            [origin[0] + reach * flat * azimuth.cos(), origin[1] + reach * flat * azimuth.sin(), reach * up]
        };
        let scan = Scan { origin, points: (0..20_000).map(point).collect(), intensities: None };
        let (model, rays) = (SensorModel::default(), RayConfig::default());
        let whole = ScanTracer::default().trace(&grid, &model, &rays, &scan).unwrap();
        let parts = ScanTracer::with_memory_bytes(1 << 20).trace(&grid, &model, &rays, &scan).unwrap();
        assert!(parts.tiles.iter().any(|(_, updates)| matches!(updates, TileUpdates::Packed(_))));
        assert_eq!(parts.report, whole.report);
        assert!(bricks(&parts) == bricks(&whole));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]

        #[test]
        fn little_memory_makes_the_same_updates(
            origin in prop::array::uniform3(-50.0..50.0_f64),
            ends in prop::collection::vec((prop::array::uniform3(-120.0..120.0_f64), 0.0..255_f32), 1..60),
            stray in any::<bool>(),
            per_ray in any::<bool>(),
        ) {
            let grid = Grid::new(0.1, 10.0).unwrap();
            let mut points: Vec<Point> =
                ends.iter().map(|(way, _)| std::array::from_fn(|k| origin[k] + way[k])).collect();
            if stray {
                points[0] = [origin[0] + 900.0, origin[1], origin[2] - 700.0];
            }
            let intensities = Some(ends.iter().map(|(_, intensity)| *intensity).collect());
            let scan = Scan { origin, points, intensities };
            let insert_mode = if per_ray { InsertMode::PerRay } else { InsertMode::PerScan };
            let rays = RayConfig { insert_mode, ..RayConfig::default() };
            let model = SensorModel::Iwlo(Iwlo::default());
            let whole = ScanTracer::default().trace(&grid, &model, &rays, &scan).unwrap();
            let mut tracer = ScanTracer::with_memory_bytes(1 << 20);
            for _ in 0..2 {
                let parts = tracer.trace(&grid, &model, &rays, &scan).unwrap();
                prop_assert_eq!(parts.report, whole.report);
                prop_assert_eq!(bricks(&parts), bricks(&whole));
            }
            let is_packed = |(_, updates): &(TileIndex, TileUpdates)| matches!(updates, TileUpdates::Packed(_));
            let again = tracer.trace(&grid, &model, &rays, &scan).unwrap();
            prop_assert!(again.tiles.len() < 20 || again.tiles.iter().any(is_packed));
        }
    }
}
