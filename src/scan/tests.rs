//! Scans under a memory limit give the same updates as without a limit.

use super::updates::brick_code;
use super::{
    MappedTiles, Overflow, PackedUpdates, Scan, ScanPoints, ScanReport, ScanTracer, ScanUpdates, TileUpdates,
    TraceRules, UpdateOrder,
};
use crate::config::{Clearing, Guard, InsertMode, RayConfig};
use crate::error::Result;
use crate::scan::ray::RayWalk;
use crate::scratch::Scratch;
use crate::sensor::{Iwlo, Observation, SensorModel};
use crate::space::{
    BRICK_EDGE, Grid, Point, TileBox, TileIndex, TileSelection, VoxelIndex, is_in_mask, place_of_voxel,
    places,
};
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::Path;

/// Stands for a weak miss; no intensity has this value.
const WEAK: f32 = -1.0;

/// Updates of each voxel, in order: `None` for a miss, the bits of the intensity for a hit. The key is the tile, the
/// brick code and the position in the brick.
type UpdatesByVoxel = BTreeMap<(TileIndex, u64, usize), Vec<Option<u32>>>;

fn add(by_voxel: &mut UpdatesByVoxel, grid: &Grid, tile: TileIndex, updates: &TileUpdates) {
    let mut push = |brick, place, hit: Option<f32>| {
        by_voxel.entry((tile, brick, place)).or_default().push(hit.map(f32::to_bits));
    };
    match updates {
        TileUpdates::Masks(bricks) => {
            for brick in bricks {
                assert!(brick.hits.iter().zip(&brick.misses).all(|(hits, misses)| hits & misses == 0));
                for (place, observation) in places(brick.touched()).zip(brick.observations()) {
                    let is_weak = is_in_mask(&brick.weak, place);
                    assert!(!is_weak || observation == Observation::Miss);
                    push(brick.brick.0, place, if is_weak { Some(WEAK) } else { intensity(observation) });
                }
            }
        }
        TileUpdates::Runs(bricks) => {
            for (brick, run) in bricks.bricks().flat_map(|brick| brick.iter().map(move |run| (brick, run))) {
                for _ in 0..run.misses {
                    push(brick.brick.0, run.place.into(), None);
                }
                if run.hit.is_some() {
                    push(brick.brick.0, run.place.into(), run.hit);
                }
            }
        }
        TileUpdates::Ordered(updates) => {
            let min = grid.voxels_of_tile(tile).min;
            for (offset, observation) in updates.iter() {
                let voxel: VoxelIndex = std::array::from_fn(|k| min[k] + offset[k]);
                let brick = brick_code(voxel.map(|k| k.div_euclid(BRICK_EDGE)));
                push(brick.0, place_of_voxel(voxel), intensity(observation));
            }
        }
        TileUpdates::Packed(packed) => packed.iter().for_each(|updates| add(by_voxel, grid, tile, &updates)),
        TileUpdates::Layers(_) | TileUpdates::WithLayers(..) => panic!("these scans have no layers"),
    }
}

fn intensity(observation: Observation) -> Option<f32> {
    match observation {
        Observation::Hit(intensity) => Some(intensity),
        Observation::Miss => None,
    }
}

struct Setting {
    grid: Grid,
    model: SensorModel,
    rays: RayConfig,
    order: UpdateOrder,
    /// `None` for the whole space.
    tiles: Option<TileSelection>,
}

impl Setting {
    fn whole(&self, scan: &Scan) -> (UpdatesByVoxel, ScanReport) {
        let Self { grid, model, rays, order, tiles } = self;
        let mapped = MappedTiles { grid, selection: tiles.as_ref() };
        let tracer = &mut ScanTracer::default();
        let updates =
            tracer.trace_points(TraceRules::of_evidence(mapped, model, rays, *order), scan, None).unwrap();
        let mut by_voxel = UpdatesByVoxel::new();
        updates.tiles.iter().for_each(|(tile, updates)| add(&mut by_voxel, grid, *tile, updates));
        (by_voxel, updates.report)
    }

    /// Traces with the given limits in bytes for marks and for updates; also returns the number of spills.
    fn in_parts(
        &self,
        tracer: &mut ScanTracer,
        scan: &Scan,
        max_bytes: usize,
    ) -> Result<(UpdatesByVoxel, ScanReport, usize)> {
        let Self { grid, model, rays, order, tiles } = self;
        let mapped = MappedTiles { grid, selection: tiles.as_ref() };
        let (mut by_voxel, mut times) = (UpdatesByVoxel::new(), 0);
        let mut spill = |part: Vec<(TileIndex, PackedUpdates)>| {
            times += 1;
            for (tile, updates) in part {
                add(&mut by_voxel, grid, tile, &TileUpdates::Packed(updates));
            }
            Ok(())
        };
        let make_scratch = &|| Ok(Box::new(Vec::new()) as Box<dyn Scratch>);
        let folder = Path::new("map");
        let overflow = Overflow { max_bytes, max_tiles: usize::MAX, folder, make_scratch, spill: &mut spill };
        let ScanUpdates { tiles, report } = tracer.trace_points(
            TraceRules::of_evidence(mapped, model, rays, *order),
            scan,
            Some(overflow),
        )?;
        tiles.iter().for_each(|(tile, updates)| add(&mut by_voxel, grid, *tile, updates));
        Ok((by_voxel, report, times))
    }
}

fn settings(tile_size_m: f64) -> Vec<Setting> {
    let modes = [
        (InsertMode::PerScan, UpdateOrder::OfVoxels),
        (InsertMode::PerRay, UpdateOrder::OfVoxels),
        (InsertMode::PerRay, UpdateOrder::OfRays),
    ];
    let setting = |(insert_mode, order)| Setting {
        grid: Grid::new(0.1, tile_size_m).unwrap(),
        model: SensorModel::Iwlo(Iwlo::default()),
        rays: RayConfig { insert_mode, ..RayConfig::default() },
        order,
        tiles: None,
    };
    let mut settings: Vec<Setting> = modes.map(setting).into();
    // With little memory each tile gets all marks near it, so tiny tiles would take minutes.
    if tile_size_m < 1.0 {
        return settings;
    }
    let mut guarded = setting((InsertMode::PerScan, UpdateOrder::OfVoxels));
    guarded.rays.clearing = Some(Clearing::Guarded(Guard::new(8).unwrap()));
    settings.push(guarded);
    // Points are taken in batches.
    let plain = setting((InsertMode::PerScan, UpdateOrder::OfVoxels));
    settings.push(Setting { model: SensorModel::default(), ..plain });
    settings
}

/// The default model, whose points are taken in batches, with rays that are cut.
fn batched() -> Setting {
    Setting {
        grid: Grid::new(0.1, 10.0).unwrap(),
        model: SensorModel::default(),
        rays: RayConfig { min_range_m: 0.2, max_range_m: Some(4.0), ..RayConfig::default() },
        order: UpdateOrder::OfVoxels,
        tiles: None,
    }
}

/// Rays in all directions, many of them similar.
fn dense(rays: u32, reach_m: f64) -> Scan {
    let origin = [0.03, -0.02, 0.05];
    let point = |k: u32| -> Point {
        let (azimuth, up) = (f64::from(k) * 2.399_963, 2.0 * f64::from(k) / f64::from(rays) - 1.0);
        let (flat, reach) = ((1.0 - up * up).sqrt(), reach_m * (0.75 + 0.25 * (5.0 * azimuth).sin()));
        [origin[0] + reach * flat * azimuth.cos(), origin[1] + reach * flat * azimuth.sin(), reach * up]
    };
    let intensities = (0..rays).map(|k| (k * 37 % 256) as f32).collect();
    Scan { origin, points: (0..rays).map(point).collect(), intensities: Some(intensities) }
}

#[test]
fn batches_of_points_mark_the_voxels_of_single_rays() {
    let setting = batched();
    let (grid, range_m) = (&setting.grid, 4.0);
    for rays in [255, 256, 700, 9_000] {
        let mut scan = dense(rays, 5.0);
        let origin = scan.origin;
        scan.points[7] = [f64::NAN, 0.0, 0.0];
        scan.points[250] = origin;
        scan.points[100] = [origin[0], origin[1] + 0.1, origin[2]];
        scan.points[101] = [origin[0], origin[1] - 3.0, origin[2]];
        let (mut hits, mut passed, mut cut, mut skipped) = (BTreeSet::new(), BTreeSet::new(), 0, 0);
        for &point in &scan.points {
            let offset: Point = std::array::from_fn(|k| point[k] - origin[k]);
            let length_m = offset.iter().map(|x| x * x).sum::<f64>().sqrt();
            if !length_m.is_finite() || length_m < 0.2 {
                skipped += 1;
                continue;
            }
            let is_cut = length_m > range_m;
            cut += u64::from(is_cut);
            let end_m = match is_cut {
                true => std::array::from_fn(|k| origin[k] + offset[k] * (range_m / length_m)),
                false => point,
            };
            let [from, end] = [origin, end_m].map(|point| grid.to_voxel_units(point));
            let [first, last] = [origin, end_m].map(|point| grid.voxel_of(point).unwrap());
            RayWalk::between(from, first, end, last).for_each_before_end(|voxel| {
                passed.insert(voxel);
            });
            if !is_cut {
                hits.insert(last);
            }
        }
        assert!(cut > 10 && skipped == 3);
        let key = |voxel: VoxelIndex| {
            let brick = brick_code(voxel.map(|k| k.div_euclid(BRICK_EDGE)));
            (grid.tile_of_voxel(voxel), brick.0, place_of_voxel(voxel))
        };
        let misses = passed.difference(&hits).map(|&voxel| (key(voxel), vec![None]));
        let hit = vec![Some(0.0_f32.to_bits())];
        let naive: UpdatesByVoxel =
            misses.chain(hits.iter().map(|&voxel| (key(voxel), hit.clone()))).collect();
        let (by_voxel, report) = setting.whole(&scan);
        assert!(by_voxel == naive, "{rays}");
        assert_eq!((report.points, report.cut_at_max_range), (rays.into(), cut));
        assert_eq!(report.skipped.total(), skipped);
    }
}

#[test]
fn dense_rays_in_little_memory_give_the_same_updates_with_any_number_of_threads() {
    let scan = dense(9_000, 5.0);
    for setting in settings(10.0) {
        let (by_voxel, report) = setting.whole(&scan);
        for (threads, bytes) in [(1, 1 << 20), (3, 1 << 20), (3, 16 << 20)] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut tracer = ScanTracer::with_memory_bytes(bytes);
            for _ in 0..2 {
                let parts = pool.install(|| setting.in_parts(&mut tracer, &scan, bytes / 2)).unwrap();
                assert_eq!(parts.1, report, "{:?} {threads} {bytes}", setting.order);
                assert!(parts.0 == by_voxel, "{:?} {threads} {bytes}", setting.order);
            }
        }
    }
}

#[test]
fn concurrent_scans_give_the_same_updates_and_large_ones_are_rejected() {
    let scans = [dense(2_000, 3.0), dense(50, 3.0), dense(2_000, 12.0), dense(2, 1.0), dense(400, 4.0)];
    let references: Vec<&dyn ScanPoints> = scans.iter().map(|scan| scan as _).collect();
    for setting in settings(10.0) {
        let Setting { grid, model, rays, order, .. } = &setting;
        let rules = TraceRules::of_evidence(MappedTiles { grid, selection: None }, model, rays, *order);
        let limited = rays.insert_mode == InsertMode::PerScan;
        let alone: Vec<_> = scans.iter().map(|scan| setting.whole(scan)).collect();
        for (threads, bytes) in [(1, None), (2, None), (12, None), (3, Some(512 << 20)), (3, Some(16 << 20))]
        {
            let mut tracer = bytes.map_or(ScanTracer::default(), ScanTracer::with_memory_bytes);
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            for _ in 0..2 {
                let traced = pool.install(|| tracer.trace_concurrently(rules, &references));
                for (number, (alone, updates)) in alone.iter().zip(traced).enumerate() {
                    let fits = bytes.is_none() || (limited && (number != 2 || bytes > Some(16 << 20)));
                    let updates = updates.unwrap();
                    assert_eq!(updates.is_some(), fits, "{threads} {bytes:?} {number}");
                    let Some(updates) = updates else { continue };
                    let mut by_voxel = UpdatesByVoxel::new();
                    updates.tiles.iter().for_each(|(tile, updates)| add(&mut by_voxel, grid, *tile, updates));
                    assert!(
                        (&by_voxel, &updates.report) == (&alone.0, &alone.1),
                        "{threads} {bytes:?} {number}"
                    );
                }
            }
            // All collectors were returned, and no more than needed were created.
            assert!(tracer.collectors() <= threads.max(scans.len()));
        }
    }
}

#[test]
fn long_rays_respect_the_memory_limit() {
    let scan = dense(80, 500.0);
    for setting in settings(25.6) {
        let bytes = 2 << 20;
        let mut tracer = ScanTracer::with_memory_bytes(bytes);
        let (by_voxel, report, times) = setting.in_parts(&mut tracer, &scan, bytes / 16).unwrap();
        assert!(times > 0);
        // The memory kept between scans is also limited. Page numbers and marked prefixes add slightly more than 1 MiB.
        assert!(tracer.bytes() < bytes + (2 << 20), "{}", tracer.bytes());
        assert!((by_voxel, report) == setting.whole(&scan));
    }
}

#[test]
fn a_failed_scratch_file_is_an_error_with_the_folder() {
    let scan = dense(100, 200.0);
    for setting in settings(10.0) {
        let Setting { grid, model, rays, order, .. } = &setting;
        let make_scratch = &|| Err(io::Error::from(io::ErrorKind::StorageFull));
        let (folder, spill) = (Path::new("some_map"), &mut |_| Ok(()));
        let overflow = Overflow { max_bytes: 1 << 16, max_tiles: usize::MAX, folder, make_scratch, spill };
        let mut tracer = ScanTracer::with_memory_bytes(1 << 20);
        let mapped = MappedTiles { grid, selection: None };
        let rules = TraceRules::of_evidence(mapped, model, rays, *order);
        let traced = tracer.trace_points(rules, &scan, Some(overflow));
        assert!(traced.unwrap_err().to_string().contains("some_map"));
    }
}

/// Restricts the updates of a whole scan to selected tiles, and counts them again.
fn restricted(whole: &(UpdatesByVoxel, ScanReport), tiles: &TileSelection) -> (UpdatesByVoxel, ScanReport) {
    let (by_voxel, mut report) = whole.clone();
    let by_voxel: UpdatesByVoxel =
        by_voxel.into_iter().filter(|((tile, ..), _)| tiles.contains(*tile)).collect();
    let updates = || by_voxel.values().flatten();
    let is_hit = |update: &&Option<u32>| update.is_some_and(|intensity| intensity != WEAK.to_bits());
    report.hits = updates().filter(is_hit).count() as u64;
    report.misses = updates().count() as u64 - report.hits;
    let mut touched: Vec<TileIndex> = by_voxel.keys().map(|(tile, ..)| *tile).collect();
    touched.dedup();
    report.tiles_touched = touched.len() as u64;
    (by_voxel, report)
}

/// Boxes and sets of tiles close to and far from the origin, and an empty selection.
fn selections(center: TileIndex, sparse: u32) -> Vec<TileSelection> {
    let at = |x, y, z| {
        let [a, b, c] = center.to_array();
        TileIndex::new(a + x, b + y, c + z)
    };
    let around = TileBox::new(at(-9, -9, -9), at(9, 9, 9));
    let some = |tile: &TileIndex| {
        let [x, y, z] = tile.to_array();
        let hash =
            (x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_663) ^ z.wrapping_mul(83_492_791)) as u32;
        (hash >> 3).is_multiple_of(sparse)
    };
    vec![
        TileBox::new(at(0, 0, 0), at(0, 0, 0)).into(),
        TileBox::new(at(1, -3, -1), at(2, 4, 0)).into(),
        TileBox::new(at(-1_000_000, i32::MIN / 2, -4), at(0, 0, 1_000_000)).into(),
        around.tiles().filter(some).collect(),
        [at(0, 0, 0), at(3, 1, 0), at(-2, 0, 1)].into_iter().collect(),
        TileSelection::from_iter([]),
    ]
}

#[test]
fn selected_tiles_of_dense_rays_equal_those_of_the_whole_scan() {
    let mut scan = dense(9_000, 5.0);
    // Rays that end far outside the window around the sensor.
    scan.points[100] = [900.0, 20.0, -7.0];
    scan.points[4_500] = [-3.0, 1000.0, 800.0];
    for mut setting in settings(1.6) {
        let whole = setting.whole(&scan);
        for tiles in selections(TileIndex::new(0, 0, 0), 5) {
            let wanted = restricted(&whole, &tiles);
            setting.tiles = Some(tiles);
            assert!(setting.whole(&scan) == wanted, "{:?} {:?}", setting.rays, setting.tiles);
            let mut tracer = ScanTracer::with_memory_bytes(1 << 20);
            let (by_voxel, report, _) = setting.in_parts(&mut tracer, &scan, 1 << 19).unwrap();
            assert!((by_voxel, report) == wanted, "{:?} {:?}", setting.rays, setting.tiles);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn selected_tiles_of_random_scans_equal_those_of_the_whole_scan(
        origin in prop::array::uniform3(-50.0..50.0_f64),
        is_on_border in prop::array::uniform3(prop::bool::ANY),
        far in prop::sample::select(vec![0.0, 0.0, 1.0e6]),
        ends in prop::collection::vec((prop::array::uniform3(-30.0..30.0_f64), 0.0..255_f32), 1..60),
        is_along_axis in prop::bool::ANY,
        stray in any::<bool>(),
        sparse in 1..9_u32,
        tile_size_m in prop::sample::select(vec![10.0, 0.4, 3.7]),
    ) {
        let origin: Point = std::array::from_fn(|k| {
            let x = origin[k] + far;
            if is_on_border[k] { (x * 4.0).floor() / 4.0 } else { x }
        });
        let mut points: Vec<Point> =
            ends.iter().map(|(way, _)| std::array::from_fn(|k| origin[k] + way[k])).collect();
        if is_along_axis {
            points[0] = [origin[0], origin[1] - 17.25, origin[2]];
        }
        if stray {
            points.push([origin[0] + 900.0, origin[1], origin[2] - 400.0]);
        }
        let intensities = Some((0..points.len()).map(|k| (k * 91 % 256) as f32).collect());
        let scan = Scan { origin, points, intensities };
        for mut setting in settings(tile_size_m) {
            let whole = setting.whole(&scan);
            let center = setting.grid.tile_of(origin).unwrap();
            for tiles in selections(center, sparse) {
                let wanted = restricted(&whole, &tiles);
                setting.tiles = Some(tiles);
                prop_assert!(setting.whole(&scan) == wanted, "{:?}", setting.tiles);
                let mut tracer = ScanTracer::with_memory_bytes(1 << 16);
                let (by_voxel, report, _) = setting.in_parts(&mut tracer, &scan, 1 << 12).unwrap();
                prop_assert!((by_voxel, report) == wanted, "{:?}", setting.tiles);
            }
        }
    }

    #[test]
    fn little_memory_gives_the_same_updates(
        origin in prop::array::uniform3(-50.0..50.0_f64),
        ends in prop::collection::vec((prop::array::uniform3(-60.0..60.0_f64), 0.0..255_f32), 1..40),
        stray in any::<bool>(),
        tile_size_m in prop::sample::select(vec![10.0, 0.4, 3.7]),
        max_bytes in prop::sample::select(vec![0_usize, 1 << 12, 1 << 16]),
    ) {
        let mut points: Vec<Point> =
            ends.iter().map(|(way, _)| std::array::from_fn(|k| origin[k] + way[k])).collect();
        if stray {
            points[0] = [origin[0] + 500.0, origin[1], origin[2] - 400.0];
        }
        let intensities = Some(ends.iter().map(|(_, intensity)| *intensity).collect());
        let scan = Scan { origin, points, intensities };
        for setting in settings(tile_size_m) {
            let (by_voxel, report) = setting.whole(&scan);
            let mut tracer = ScanTracer::with_memory_bytes(1 << 16);
            for _ in 0..2 {
                let parts = setting.in_parts(&mut tracer, &scan, max_bytes).unwrap();
                prop_assert_eq!(parts.1, report);
                prop_assert!(parts.0 == by_voxel);
            }
        }
    }
}
