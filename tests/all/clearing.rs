//! Guarded clearing: maps compared with the naive rule for all tile sizes and memory limits, and how a map stores its
//! rule.

use std::path::Path;
use testkit::faulty_disk::{Fault, FaultyDisk};
use testkit::random_scans::Random;
use testkit::reference_map::{ReferenceMap, voxels_of};
use voxtile::integrity::repair;
use voxtile::mapper::KeptSummary;
use voxtile::operations::{Prefer, Replay, mark_moving, merge, rebuild, remove_points};
use voxtile::scan::{MovingMarks, ScanPoints, ScanRef, Stop};
use voxtile::{
    Aabb, Clearing, Error, Guard, InMemoryMapper, InsertMode, MapConfig, MapOptions, MapPath, MapQueries,
    MapReader, MapView, Mapper, OutOfCoreTileMapper, Scan,
};

/// A scan of a room with a floor, walls and a box: many rays graze surfaces.
fn room(random: &mut Random, origin: [f64; 3], rays: usize) -> Scan {
    let point = |random: &mut Random| {
        let way: [f64; 3] = [0; 3].map(|_| random.between(-1.0, 1.0));
        // Distance to the nearest of the six sides, or to a box of which only one side is seen.
        let to_side = |k: usize| {
            let side = if way[k] > 0.0 { [6.3, 4.1, 2.2][k] } else { [-5.2, -4.4, 0.05][k] };
            (side - origin[k]) / way[k]
        };
        let nearest = (0..3).map(to_side).fold(f64::INFINITY, f64::min);
        let to_box = (2.0 - origin[0]) / way[0];
        let at_box = [1, 2].map(|k| origin[k] + to_box * way[k]);
        let is_box = to_box > 0.0 && to_box < nearest && at_box[0].abs() < 1.0 && at_box[1] < 1.0;
        let distance = if is_box { to_box } else { nearest };
        std::array::from_fn(|k| origin[k] + distance * way[k])
    };
    Scan { origin, points: (0..rays).map(|_| point(random)).collect(), intensities: None }
}

fn drive(rays: usize) -> Vec<Scan> {
    let mut random = Random(5);
    (0..4).map(|k| room(&mut random, [-3.0 + 0.9 * f64::from(k), 0.3, 1.0], rays)).collect()
}

fn guarded(resolution_m: f64, tile_size_m: f64) -> MapConfig {
    let config = MapConfig::new(resolution_m, tile_size_m).unwrap();
    config.with_clearing(Clearing::Guarded(Guard::new(8).unwrap()))
}

#[test]
fn guarded_maps_equal_the_naive_map_for_all_tile_sizes_and_memory_limits() {
    let scans = &drive(150)[..2];
    // With little memory, each tile is processed with all hits and misses near it, so tiny tiles are slow.
    for (voxels, limits) in [(2, &[][..]), (5, &[60_000]), (16, &[0, 60_000]), (100, &[0])] {
        let config = guarded(0.4, 0.4 * f64::from(voxels));
        let mut reference = ReferenceMap::new(&config);
        let mut in_memory = InMemoryMapper::new(config.clone()).unwrap();
        for scan in scans {
            reference.insert_scan(scan);
            in_memory.insert_scan(scan).unwrap();
        }
        assert!(voxels_of(&in_memory) == reference.voxels, "{voxels}");
        for &bytes in limits {
            let disk = FaultyDisk::new(Fault::None);
            let config = config.clone().with_tight_memory_bytes(bytes);
            let mut mapper =
                OutOfCoreTileMapper::create(MapPath::on(disk.shared(), Path::new("/map")), config).unwrap();
            for scan in scans {
                mapper.insert_scan(scan).unwrap();
            }
            assert_eq!(mapper.digest().unwrap(), in_memory.digest().unwrap(), "{voxels} {bytes}");
        }
    }
}

/// Surfaces keep more of their voxels than by OctoMap's rule, and the same voxels are known.
#[test]
fn guarded_maps_keep_surfaces_and_know_the_same_voxels() {
    let scans = drive(20_000);
    let map = |config: MapConfig| {
        let mut mapper = InMemoryMapper::new(config).unwrap();
        scans.iter().for_each(|scan| {
            mapper.insert_scan(scan).unwrap();
        });
        mapper
    };
    let config = MapConfig::new(0.1, 10.0).unwrap();
    let (octomap, guarded) = (map(config.clone()), map(config.with_clearing(Clearing::guarded())));
    let kept = |mapper: &InMemoryMapper| {
        let voxels = voxels_of(mapper);
        let grid = mapper.config().grid;
        let points = || scans.iter().flat_map(|scan| &scan.points);
        let is_occupied = |point: &&[f64; 3]| {
            let (bits, _) = voxels[&grid.voxel_of(**point).unwrap()];
            f64::from_bits(bits) >= 0.0
        };
        points().filter(is_occupied).count() as f64 / points().count() as f64
    };
    let (before, after) = (kept(&octomap), kept(&guarded));
    assert!(before < after && after > 0.999, "{before} {after}");
    assert!(voxels_of(&octomap).keys().eq(voxels_of(&guarded).keys()));
}

/// A removed hit turns weak misses of other rays into full ones, also in tiles that its ray did not pass.
#[test]
fn removed_points_change_neighboring_tiles() {
    // Tiles of 8 voxels of 1 m. A sheet of rays along x ends at x = 30; one ray from the same place ends at the last
    // voxel before the border at y = 8.
    let config = guarded(1.0, 8.0).with_kept_scans(true);
    let origin = [0.5, 4.5, 4.5];
    let wall = (0..30).flat_map(|y| (0..8).map(move |z| [30.5, f64::from(y) + 0.5, f64::from(z) + 0.5]));
    let post = [12.5, 7.5, 4.5];
    let points: Vec<_> = wall.chain([post]).collect();
    let first = Scan { origin, points: vec![[13.5, 8.5, 4.5], [12.5, 9.5, 4.5]], intensities: None };
    // Scans elsewhere: a change of most updates would replay all tiles.
    let moved = |point: &[f64; 3]| [point[0], point[1] + 800.0, point[2]];
    let far = Scan { origin: moved(&origin), points: points.iter().map(moved).collect(), intensities: None };
    let second = Scan { origin, points, intensities: None };
    let at = |disk: &FaultyDisk| MapPath::on(disk.shared(), Path::new("/map"));
    let digest = |second: &Scan| {
        let mut mapper = InMemoryMapper::new(config.clone()).unwrap();
        [&first, second].into_iter().chain([&far; 9]).for_each(|scan| {
            mapper.insert_scan(scan).unwrap();
        });
        mapper.digest().unwrap()
    };
    let disk = FaultyDisk::new(Fault::None);
    let mut mapper = OutOfCoreTileMapper::create(at(&disk), config.clone()).unwrap();
    [&first, &second].into_iter().chain([&far; 9]).for_each(|scan| {
        mapper.insert_scan(scan).unwrap();
    });
    mapper.flush().unwrap();
    drop(mapper);
    let before = MapReader::open(at(&disk), 0).unwrap().digest().unwrap();
    assert_eq!(before, digest(&second));

    let region = Aabb { min: [12.0, 7.0, 4.0], max: [13.0, 8.0, 5.0] };
    let removed = remove_points(at(&disk), &region, &Replay::default(), |_, _| ()).unwrap();
    assert_eq!(removed.points_removed, 1);
    let counts = &removed.mapped;
    assert!(counts.tiles_mapped < counts.tiles, "{} of {} tiles", counts.tiles_mapped, counts.tiles);
    let without = Scan { points: second.points[..second.points.len() - 1].to_vec(), ..second.clone() };
    let after = MapReader::open(at(&disk), 0).unwrap();
    assert_eq!(after.digest().unwrap(), digest(&without));
}

/// Like a removed hit, a marked one turns weak misses into full ones. Without the mark, the map is that of before.
#[test]
fn marks_of_moving_points_change_neighboring_tiles() {
    let config = guarded(1.0, 8.0).with_kept_scans(true);
    let (origin, post) = ([0.5, 4.5, 4.5], [12.5, 7.5, 4.5]);
    let wall = (0..30).flat_map(|y| (0..8).map(move |z| [30.5, f64::from(y) + 0.5, f64::from(z) + 0.5]));
    let points: Vec<_> = wall.chain([post]).collect();
    let is_post = MovingMarks::new(points.iter().map(|point| *point == post));
    let none = MovingMarks::new(points.iter().map(|_| false));
    let first = Scan { origin, points: vec![[13.5, 8.5, 4.5], [12.5, 9.5, 4.5]], intensities: None };
    let far = Scan { origin: [0.5, 804.5, 4.5], points: vec![[9.5, 804.5, 4.5]], intensities: None };
    let insert = |mapper: &mut dyn Mapper, marks: &MovingMarks| {
        mapper.insert_scan(&first).unwrap();
        let scan = ScanRef::in_world(origin, &points).with_moving(marks).unwrap();
        mapper.insert_points(&scan).unwrap();
        mapper.insert_scan(&far).unwrap();
    };
    let digest = |marks: &MovingMarks| {
        let mut mapper = InMemoryMapper::new(config.clone()).unwrap();
        insert(&mut mapper, marks);
        mapper.digest().unwrap()
    };
    let disk = FaultyDisk::new(Fault::None);
    let at = || MapPath::on(disk.shared(), Path::new("/map"));
    let mut mapper = OutOfCoreTileMapper::create(at(), config.clone()).unwrap();
    insert(&mut mapper, &none);
    mapper.flush().unwrap();
    drop(mapper);
    for marks in [&is_post, &none, &is_post] {
        let of_scan = marks.clone();
        let summary = KeptSummary::read(at()).unwrap();
        let done =
            mark_moving(&summary, [2], move |_| Ok(of_scan.clone()), &Replay::default(), |_, _| ()).unwrap();
        assert!(done.tiles_mapped > 2 && done.tiles_mapped < done.tiles, "{done:?}");
        let map = MapReader::open(at(), 0).unwrap();
        assert_eq!(map.digest().unwrap(), digest(marks));
        let kept = map.kept_scans().unwrap().nth(1).unwrap().unwrap();
        assert_eq!(kept.moving(), Some(marks).filter(|marks| marks.marked() > 0));
        assert_eq!(KeptSummary::read(at()).unwrap().scans()[1].moving_points, marks.marked());
    }
    assert_ne!(digest(&is_post), digest(&none));

    // Another map from these scans keeps the marks.
    let map = MapReader::open(at(), 0).unwrap();
    let other = || MapPath::on(disk.shared(), Path::new("/other"));
    rebuild(&map, other(), config.clone(), |rays| *rays, &Stop::default(), |_, _| ()).unwrap();
    let rebuilt = MapReader::open(other(), 0).unwrap();
    assert_eq!(rebuilt.digest().unwrap(), map.digest().unwrap());
    assert_eq!(KeptSummary::read(other()).unwrap().scans()[1].moving_points, 1);

    // Marks of another number of points are refused, and the map is unchanged.
    let before = map.digest().unwrap();
    let wrong = |_| Ok(MovingMarks::new([true; 3]));
    let summary = KeptSummary::read(at()).unwrap();
    let refused = mark_moving(&summary, [2], wrong, &Replay::default(), |_, _| ()).unwrap_err();
    assert!(refused.to_string().contains("3 for the 241 points of scan 2"), "{refused}");
    assert_eq!(MapReader::open(at(), 0).unwrap().digest().unwrap(), before);
    assert!(ScanRef::in_world(origin, &points).with_moving(&MovingMarks::new([true])).is_err());
}

#[test]
fn a_map_keeps_its_rule() {
    let disk = FaultyDisk::new(Fault::None);
    let at = |name: &str| MapPath::on(disk.shared(), Path::new("/").join(name));
    let scan = &drive(300)[0];
    let config = guarded(0.2, 4.0);
    let mut mapper = OutOfCoreTileMapper::create(at("map"), config.clone().with_kept_scans(true)).unwrap();
    mapper.insert_scan(scan).unwrap();
    mapper.flush().unwrap();
    drop(mapper);

    // A configuration without a rule uses the map's rule. A different rule is an error.
    let open = |config: MapConfig| MapOptions::new().config(config).open(at("map"));
    let own = open(config.clone().with_clearing(None)).unwrap();
    assert_eq!(own.config().rays.clearing, config.rays.clearing);
    drop(own);
    for other in [Clearing::Octomap, Clearing::guarded()] {
        let refused = open(config.clone().with_clearing(other)).unwrap_err();
        assert!(matches!(&refused, Error::Mismatch { what: "rule of clearing", .. }), "{refused}");
    }
    let per_ray = open(config.clone().with_clearing(None).with_insert_mode(InsertMode::PerRay)).unwrap_err();
    assert!(per_ray.to_string().contains("per-scan"), "{per_ray}");

    // The rule is an integer in the metadata; a map of OctoMap's rule has no such key.
    let text = |name: &str| {
        let files = disk.files();
        let path = Path::new("/").join(name).join("metadata.json");
        String::from_utf8(files[&path].clone()).unwrap()
    };
    let metadata: serde_json::Value = serde_json::from_str(&text("map")).unwrap();
    assert_eq!(metadata["ext"]["rays"]["clearing"]["guarded"]["approach_voxels"], 8);
    drop(OutOfCoreTileMapper::create(at("other"), config.clone().with_clearing(Clearing::Octomap)).unwrap());
    assert!(!text("other").contains("clearing"));
    // Programs which do not know the rule refuse the map by its version.
    assert_eq!(metadata["version"], "1.1");
    assert!(text("other").contains(r#""version": "1.0""#));

    // Rebuild the map from its kept scans by OctoMap's rule.
    let reader = MapReader::open(at("map"), 0).unwrap();
    let octomap = |rays: &voxtile::RayConfig| {
        let mut rays = *rays;
        rays.clearing = Some(Clearing::Octomap);
        rays
    };
    rebuild(&reader, at("again"), reader.config().clone(), octomap, &Stop::default(), |_, _| ()).unwrap();
    let mut plain = InMemoryMapper::new(config.clone().with_clearing(Clearing::Octomap)).unwrap();
    plain.insert_scan(scan).unwrap();
    assert_eq!(MapReader::open(at("again"), 0).unwrap().digest().unwrap(), plain.digest().unwrap());
    assert!(!text("again").contains("guarded"));
    drop(reader);

    // Tiles record the rule, so a repair without the metadata restores it.
    let map = Path::new("/map");
    for name in ["metadata.json", "commits.log"] {
        disk.take(&map.join(name));
    }
    repair(at("map"), |_| (), |_, _| ()).unwrap();
    assert_eq!(MapReader::open(at("map"), 0).unwrap().config().rays.clearing, config.rays.clearing);

    // Evidence of guarded maps cannot be added.
    let maps = || ["map", "map"].map(|name| MapReader::open(at(name), 0).unwrap());
    let refused = merge(&maps(), "/merged", None, |_, _| ()).unwrap_err();
    assert!(refused.to_string().contains("the maps have guarded clearing"), "{refused}");
    merge(&maps(), "/merged", Some(Prefer::First), |_, _| ()).unwrap();
}
