use std::collections::BTreeSet;
use std::time::Duration;
use testkit::random_scans::{Random, random_scan};
use testkit::reference_local::states_of;
use voxtile::query::{Shape, United, UnknownAs};
use voxtile::scan::no_return;
use voxtile::space::{Grid, VoxelIndex};
use voxtile::{InMemoryMapper, MapConfig, MapQueries, MapView, Mapper, Queries, Scan};
use voxtile_local::{LocalMap, LocalParameters, LocalState};
use voxtile_share::{
    LocalWatch, MapWatch, Sender, SenderConfig, VoxelSet, merge_layer, read_layer, write_layer,
};

fn config() -> MapConfig {
    MapConfig::new(0.1, 1.0).unwrap().with_range(0.0, 3.0)
}

fn sender() -> Sender {
    Sender::new(config().grid, 1, SenderConfig::default()).unwrap()
}

fn sent(sender: &mut Sender) -> BTreeSet<VoxelIndex> {
    sender.flush(Duration::ZERO);
    sender.sent().iter().collect()
}

fn occupied(map: &InMemoryMapper, threshold: f64) -> BTreeSet<VoxelIndex> {
    map.all_occupied_voxels(Some(threshold)).unwrap().iter().map(|voxel| voxel.index).collect()
}

#[test]
fn a_watch_sends_the_occupied_voxels_after_every_scan() {
    for (seed, threshold) in [(1, 0.5), (2, 0.6), (3, 0.9)] {
        let mut random = Random(seed);
        let mut map = InMemoryMapper::new(config()).unwrap();
        let (mut by_scans, mut at_once, mut seldom_sent) = (sender(), sender(), sender());
        let watch = MapWatch::new(threshold).unwrap();
        for number in 0..12 {
            let scan = random_scan(&mut random, [f64::from(number), 0.0, 0.0], 300);
            map.insert_scan(&scan).unwrap();
            watch.take_scan(&map, &scan, &mut by_scans).unwrap();
            watch.take_scan(&map, &scan, &mut seldom_sent).unwrap();
            assert!(sent(&mut by_scans) == occupied(&map, threshold));
        }
        assert!(sent(&mut seldom_sent) == occupied(&map, threshold));
        watch.take_all(&map, &mut at_once).unwrap();
        assert!(sent(&mut at_once) == occupied(&map, threshold));
    }
    assert!(MapWatch::new(1.0).is_err());
    let mut other = Sender::new(MapConfig::new(0.2, 1.0).unwrap().grid, 1, SenderConfig::default()).unwrap();
    let map = InMemoryMapper::new(config()).unwrap();
    assert!(MapWatch::new(0.5).unwrap().take_all(&map, &mut other).is_err());
}

/// A voxel is hit once. Then rays pass it until it is free.
#[test]
fn voxels_cleared_by_rays_without_a_return_leave_the_set() {
    let origin = [0.05; 3];
    let ahead = [[1.0, 0.0, 0.0], [-1.0, -1.0, 0.5]];
    let is_no_return = |k: usize| no_return(origin, ahead[k]).unwrap();
    let farthest = |k: usize| ahead[k].map(|d| d * f64::from(f32::MAX));
    for (max_m, no_return_m) in [(None, Some(8.0)), (Some(8.0), None), (Some(8.0), Some(7.0))] {
        for (k, beyond) in [0, 1].into_iter().flat_map(|k| [(k, is_no_return(k)), (k, farthest(k))]) {
            let config =
                MapConfig::new(0.1, 1.0).unwrap().with_range(0.0, max_m).with_no_return_range(no_return_m);
            let mut map = InMemoryMapper::new(config).unwrap();
            let (mut sender, watch) = (sender(), MapWatch::new(0.5).unwrap());
            let seen: [f64; 3] = std::array::from_fn(|axis| origin[axis] + 4.0 * ahead[k][axis]);
            // Rays with a return keep their length, even beyond the no-return range.
            let near = [[0.45, 0.05, 0.05], [0.05, 12.05, 0.05]];
            let mut take = |far: [f64; 3]| {
                let scan = Scan { origin, points: [near.to_vec(), vec![far]].concat(), intensities: None };
                map.insert_scan(&scan).unwrap();
                watch.take_scan(&map, &scan, &mut sender).unwrap();
                let now = occupied(&map, 0.5);
                assert!(sent(&mut sender) == now, "{max_m:?} {no_return_m:?} {far:?}");
                now
            };
            let before = take(seen);
            let after = (0..4).map(|_| take(beyond)).last().unwrap();
            assert_eq!(before.difference(&after).count(), 1, "the voxel is free in the end");
        }
    }
}

/// A voxel leaves the map because of the maximum number of voxels, while the rays of skipped points pass it.
#[test]
fn rays_of_skipped_points_do_not_clear_shared_voxels() {
    // The map skips voxels near the end of the index range.
    let end = (f64::from(i32::MAX) - 4100.5) * 0.1;
    let cases = [
        ("beyond the input range", [0.05; 3], [8.05, 0.05, 0.05], [12.05, 0.05, 0.05], "beyond"),
        ("too near", [0.05; 3], [0.45, 0.05, 0.05], [0.85, 0.05, 0.05], "near"),
        ("out of range", [end, 0.05, 0.05], [end + 0.3, 0.05, 0.05], [end + 0.8, 0.05, 0.05], "range"),
        ("cast", [0.05; 3], [3.05, 0.05, 0.05], [6.05, 0.05, 0.05], "none"),
    ];
    for (name, origin, seen, past, skipped) in cases {
        let parameters = LocalParameters::local_mapping().with_ranges(10.0, 1.0).with_max_voxels(20);
        let mut map = LocalMap::new(0.1, parameters).unwrap();
        let (mut watch, mut sender) = (LocalWatch::new(), sender());
        let mut take = |map: &mut LocalMap, points: Vec<[f64; 3]>| {
            let scan = Scan { origin, points, intensities: None };
            let report = map.insert_scan(&scan).unwrap();
            watch.take_scan(map, &report, &scan, &mut sender).unwrap();
            (report, sent(&mut sender))
        };
        let voxel = Grid::new(0.1, 1.0).unwrap().voxel_of(seen).unwrap();
        let (_, shared) = take(&mut map, vec![seen]);
        assert!(shared.contains(&voxel), "{name}");
        let mut later = *map.parameters();
        later.min_input_range_m = 1.0;
        map.set_parameters(later).unwrap();
        // As many new voxels as the map can hold, away from these rays.
        let others =
            (0..20).map(|k| std::array::from_fn(|axis| origin[axis] + [-2.0, 2.0, 0.1 * f64::from(k)][axis]));
        let points: Vec<_> = others.chain([past; 4]).collect();
        let (report, shared) = take(&mut map, points);
        let counts = (report.beyond_input_range, report.skipped.too_near, report.skipped.out_of_range);
        let expected = match skipped {
            "beyond" => (4, 0, 0),
            "near" => (0, 4, 0),
            "range" => (0, 0, 4),
            _ => (0, 0, 0),
        };
        assert_eq!(counts, expected, "{name}");
        assert!(report.forgotten > 0 && map.view().state(voxel) != LocalState::Occupied, "{name}");
        assert_eq!(shared.contains(&voxel), skipped != "none", "{name}");
    }
}

#[test]
fn a_local_map_shares_occupied_voxels_and_keeps_those_forgotten_by_age() {
    for limit in [None, Some(150)] {
        let mut random = Random(5);
        let mut map = LocalMap::new(0.1, LocalParameters::local_mapping().with_max_voxels(limit)).unwrap();
        let mut watch = LocalWatch::new();
        let mut sender = sender();
        let (mut forgotten, mut left) = (0, 0);
        let mut before = BTreeSet::new();
        for number in 0..20 {
            // Five points are hit once. Then the rays of three scans pass them.
            let cycle = f64::from(number / 4);
            let farther = if number % 4 == 0 { 1.0 } else { 2.0 };
            let seen = (0..5).map(|k| [2.05 + 0.1 * cycle, 0.3 * f64::from(k), 0.35].map(|x| farther * x));
            let points = (0..30).map(|_| random.point([0.0; 3], 4.0)).chain(seen).collect();
            let scan = Scan { origin: [0.0; 3], points, intensities: None };
            let report = map.insert_scan(&scan).unwrap();
            watch.take_scan(&map, &report, &scan, &mut sender).unwrap();
            let states = states_of(map.view());
            let is_occupied =
                |(voxel, state): (VoxelIndex, LocalState)| (state == LocalState::Occupied).then_some(voxel);
            let occupied: BTreeSet<VoxelIndex> = states.into_iter().filter_map(is_occupied).collect();
            let shared = sent(&mut sender);
            assert!(shared.is_superset(&occupied));
            if limit.is_none() {
                assert!(shared == occupied);
            }
            left += before.difference(&shared).count();
            forgotten += report.forgotten;
            before = shared;
        }
        assert_eq!(forgotten > 0, limit.is_some());
        assert!(left > 0, "rays have freed nothing");
        if limit.is_some() {
            assert!(before.len() > map.stored_voxels() + 100, "{} shared", before.len());
        }
    }
}

fn layer(voxels: impl IntoIterator<Item = VoxelIndex>) -> VoxelSet {
    let mut layer = VoxelSet::new(config().grid);
    voxels.into_iter().for_each(|voxel| {
        layer.put(voxel, true);
    });
    layer
}

#[test]
fn merging_a_layer_again_changes_only_voxels_that_are_still_free() {
    let mut random = Random(9);
    let mut map = InMemoryMapper::new(config()).unwrap();
    let scan = Scan { origin: [0.0; 3], points: vec![[2.05, 0.05, 0.05]; 5], intensities: None };
    (0..4).for_each(|_| {
        map.insert_scan(&scan).unwrap();
    });
    // One voxel that is free in the map after four scans, one that is occupied, and new voxels.
    let new = (0..200).map(|_| std::array::from_fn(|_| 30 + random.below(40) as i32));
    let layer = layer(new.chain([[10, 0, 0], [20, 0, 0]]));
    let report = merge_layer(&layer, &mut map).unwrap();
    assert_eq!((report.voxels, report.known, report.hits), (layer.len(), 1, layer.len() - 1));
    let now = occupied(&map, 0.5);
    assert_eq!(now.len() as u64, layer.len() - 1, "the voxel that was free in four scans is still free");
    let digest = map.digest().unwrap();
    let again = merge_layer(&layer, &mut map).unwrap();
    assert_eq!(again.hits, 1);
    assert_ne!(map.digest().unwrap(), digest, "its hit counts");
    let mut other = InMemoryMapper::new(MapConfig::new(0.2, 1.0).unwrap()).unwrap();
    assert!(merge_layer(&layer, &mut other).is_err());
}

#[test]
fn a_union_answers_queries_from_all_maps() {
    let mut random = Random(11);
    let mut map = InMemoryMapper::new(config()).unwrap();
    for _ in 0..3 {
        map.insert_scan(&random_scan(&mut random, [0.0; 3], 200)).unwrap();
    }
    let mut voxels =
        || (0..300).map(|_| std::array::from_fn(|_| random.below(60) as i32 - 30)).collect::<Vec<_>>();
    let layers = [layer(voxels()), layer(voxels())];
    let all = United::new(&[&map, &layers[0], &layers[1]]).unwrap();
    let own = occupied(&map, 0.5);
    let is_occupied =
        |voxel: VoxelIndex| own.contains(&voxel) || layers.iter().any(|layer| layer.contains(voxel));
    let grid = map.config().grid;
    let mut random = Random(12);
    let (mut hits, mut collisions) = (0, 0);
    for _ in 0..300 {
        let (from, to) = (random.point([0.0; 3], 3.5), random.point([0.0; 3], 3.5));
        assert_eq!(all.occupancy_at(from).unwrap().is_occupied(), is_occupied(grid.voxel_of(from).unwrap()));
        let hit = all.cast_segment(from, to, UnknownAs::Free).unwrap().map(|hit| hit.voxel);
        hits += usize::from(hit.is_some());
        assert!(hit.is_none_or(is_occupied));
        // Small steps along the segment find no occupied voxel before the hit.
        for step in 0..1000 {
            let at = std::array::from_fn(|k| from[k] + (to[k] - from[k]) * f64::from(step) / 1000.0);
            let voxel = grid.voxel_of(at).unwrap();
            if is_occupied(voxel) {
                assert!(hit.is_some());
                break;
            }
            if hit == Some(voxel) {
                break;
            }
        }
        let collision =
            all.collision(&Shape::Sphere { center: from, radius_m: 0.25 }, UnknownAs::Free).unwrap();
        collisions += usize::from(collision.is_some());
        let near = |voxel: &VoxelIndex| {
            let low = voxel.map(|k| f64::from(k) * 0.1);
            let gap = |k: usize| from[k] - from[k].clamp(low[k], low[k] + 0.1);
            (0..3).map(|k| gap(k) * gap(k)).sum::<f64>()
        };
        let everything = own.iter().copied().chain(layers.iter().flat_map(|layer| layer.iter()));
        let nearest = everything.map(|voxel| near(&voxel)).fold(f64::INFINITY, f64::min);
        if (nearest - 0.0625).abs() > 1e-9 {
            assert_eq!(collision.is_some(), nearest < 0.0625);
        }
    }
    assert!(hits > 20 && collisions > 20, "{hits} {collisions}");
    let coarse = VoxelSet::new(MapConfig::new(0.2, 1.0).unwrap().grid);
    assert!(United::new(&[&map, &coarse]).is_err());
}

#[test]
fn a_layer_file_is_read_back_and_damage_is_detected() {
    let mut random = Random(21);
    let many = (0..9000).map(|_| std::array::from_fn(|_| random.below(90) as i32 - 45));
    // These voxels are too far apart for one packet.
    let far = [[-2_000_000_000, 5, 7], [2_000_000_000, 0, -9]];
    for voxels in [Vec::new(), vec![[1, 2, 3]], many.chain(far).collect()] {
        let mut layer = layer(voxels);
        let mut file = Vec::new();
        write_layer(&mut layer, &mut file).unwrap();
        assert!(read_layer(&mut &file[..], 1 << 20).unwrap() == layer);
        for at in (0..file.len()).step_by(1 + file.len() / 50) {
            let mut damaged = file.clone();
            damaged[at] ^= 4;
            assert!(read_layer(&mut &damaged[..], 1 << 20).is_err(), "byte {at}");
            assert!(read_layer(&mut &file[..at], 1 << 20).is_err(), "cut at {at}");
        }
        if layer.len() > 100 {
            let error = read_layer(&mut &file[..], 100).unwrap_err().to_string();
            assert!(error.contains("more than 100 voxels"), "{error}");
        }
    }
}

/// The query visits only existing voxels, for a sphere of any size. An invalid sphere is refused.
#[test]
fn a_collision_query_accepts_any_finite_sphere() {
    let map = InMemoryMapper::new(config()).unwrap();
    let far = layer([[1_000_000, -5, 7], [i32::MAX - 1, i32::MIN, 0]]);
    let all = United::new(&[&map, &far]).unwrap();
    let collision = |center, radius_m, unknown| all.collision(&Shape::Sphere { center, radius_m }, unknown);
    let hit = |radius_m| collision([0.0; 3], radius_m, UnknownAs::Free).unwrap().map(|hit| hit.voxel);
    assert_eq!(hit(99_000.0), None);
    assert_eq!(hit(101_000.0), Some([1_000_000, -5, 7]));
    assert!(hit(1e9).is_some() && hit(1e300).is_some());
    assert_eq!(hit(0.0), None);
    let near_the_end = [(f64::from(i32::MAX) - 0.5) * 0.1, f64::from(i32::MIN) * 0.1, 0.0];
    let at_the_end = collision(near_the_end, 0.2, UnknownAs::Free).unwrap().map(|hit| hit.voxel);
    assert_eq!(at_the_end, Some([i32::MAX - 1, i32::MIN, 0]));
    for radius_m in [f64::NAN, f64::INFINITY, -1.0] {
        assert!(collision([0.0; 3], radius_m, UnknownAs::Free).is_err(), "{radius_m}");
    }
    assert!(collision([f64::NAN; 3], 1.0, UnknownAs::Free).is_err());
    // If unknown space is an obstacle, a query over too many voxels is an error.
    assert!(collision([0.0; 3], 1e9, UnknownAs::Obstacle).is_err());
}
