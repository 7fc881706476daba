use super::random_maps::{config, disk, open, path, random_voxels, read_map, write_map};
use testkit::random_scans::Random;
use testkit::reference_map::Voxels;
use voxtile::mapper::MapView;
use voxtile::operations::{AreaPart, CopyScans, Part, Prefer, clear, crop, crop_area, merge};
use voxtile::space::{Aabb, Area, VoxelBox};
use voxtile::{Error, MapConfig, MapPath, MapQueries, MapReader};

/// A random box around the voxels of [`random_voxels`]: bounds between voxels, on their borders and centers, and beyond
/// all of them.
fn random_box(random: &mut Random) -> Aabb {
    let center = [[0.0, -35.0, 16_383.0][random.below(3) as usize], 1.5, -1.0];
    let mut bound = |center: f64| match random.below(5) {
        0 => center + 0.25 * (random.below(24) as f64 - 12.0),
        1 => center + [-100.0, 100.0][random.below(2) as usize],
        _ => center + random.between(-3.0, 3.0),
    };
    let (a, b): ([f64; 3], [f64; 3]) = (center.map(&mut bound), center.map(&mut bound));
    let region = Aabb::from_corners(a, b);
    // Never empty along an axis.
    Aabb { max: std::array::from_fn(|k| region.max[k].max(region.min[k] + 0.3)), ..region }
}

fn naive(config: &MapConfig, voxels: &Voxels, part: &Part) -> Voxels {
    let is_in = |center| match part {
        Part::Inside(region) => region.contains(center),
        Part::Outside(region) => !region.contains(center),
    };
    voxels
        .iter()
        .filter(|(voxel, _)| is_in(config.grid.center_m(**voxel)))
        .map(|(&voxel, &e)| (voxel, e))
        .collect()
}

#[test]
fn crop_and_clear_are_filters_and_crops_merge_to_the_whole() {
    let (mut cut_through, mut removed, mut untouched) = (0, 0, 0);
    for seed in 0..80 {
        let mut random = Random(seed);
        let (disk, config) = (disk(), config(&mut random));
        let voxels = random_voxels(&mut random, 400);
        write_map(&disk, &path("whole"), &config, &voxels);
        let whole = MapReader::open(MapPath::on(disk.shared(), path("whole")), 0).unwrap().digest().unwrap();
        let region = random_box(&mut random);
        if config.grid.voxels_in(&region).is_empty() {
            let refused = crop(
                &open(&disk, &path("whole")).unwrap(),
                &Part::Outside(region),
                CopyScans::No,
                path("none"),
                |_, _| {},
            );
            assert!(matches!(refused, Err(Error::InvalidArgument { .. })), "seed {seed}");
            continue;
        }
        let parts = [(Part::Inside(region), "inside"), (Part::Outside(region), "outside")];
        for (part, name) in parts {
            let expected = naive(&config, &voxels, &part);
            let written =
                crop(&open(&disk, &path("whole")).unwrap(), &part, CopyScans::No, path(name), |_, _| {})
                    .unwrap();
            assert_eq!(read_map(&disk, &path(name)), expected, "seed {seed}, {name}");
            assert_eq!(written.voxels, expected.len() as u64);
            cut_through += u64::from(!expected.is_empty() && expected.len() < voxels.len());
        }
        let halves = ["inside", "outside"].map(|half| open(&disk, &path(half)).unwrap());
        merge(&halves, path("again"), Some(Prefer::First), |_, _| {}).unwrap();
        let again = MapReader::open(MapPath::on(disk.shared(), path("again")), 0).unwrap();
        assert_eq!(again.digest().unwrap(), whole, "seed {seed}");
        for (part, name) in parts {
            let copy = disk.copy();
            let cleared = clear(MapPath::on(copy.shared(), path("whole")), &part, |_, _| {}).unwrap();
            let other = read_map(&disk, &path(if name == "inside" { "outside" } else { "inside" }));
            assert_eq!(read_map(&copy, &path("whole")), other, "seed {seed}, cleared {name}");
            assert_eq!(cleared.voxels_cleared, (voxels.len() - other.len()) as u64);
            let reader = MapReader::open(MapPath::on(copy.shared(), path("whole")), 0).unwrap();
            assert_eq!(cleared.tiles, reader.tile_indices().len() as u64);
            assert_eq!(reader.voxel_counts().unwrap().0, other.len() as u64);
            removed += cleared.tiles_removed;
            if cleared.voxels_cleared == 0 {
                untouched += 1;
                assert_eq!(copy.files(), disk.files());
            }
        }
    }
    assert!(cut_through > 20 && removed > 20 && untouched > 5, "{cut_through} {removed} {untouched}");
}

#[test]
fn a_crop_keeps_the_scan_number_and_gets_a_new_id() {
    let (disk, mut random) = (disk(), Random(1));
    let config = config(&mut random);
    write_map(&disk, &path("whole"), &config, &random_voxels(&mut random, 50));
    let everywhere = Aabb { min: [f64::NEG_INFINITY; 3], max: [f64::INFINITY; 3] };
    crop(
        &open(&disk, &path("whole")).unwrap(),
        &Part::Inside(everywhere),
        CopyScans::No,
        path("part"),
        |_, _| {},
    )
    .unwrap();
    let [whole, part] = ["whole", "part"].map(|name| open(&disk, &path(name)).unwrap());
    assert_eq!(whole.digest().unwrap(), part.digest().unwrap());
    let id_of = |reader: &MapReader| reader.metadata().ext.as_ref().unwrap().map_id.clone();
    assert_ne!(id_of(&whole), id_of(&part));
    assert_eq!(part.scan_number(), whole.scan_number());
}

#[test]
fn an_empty_box_is_an_error() {
    let (disk, mut random) = (disk(), Random(1));
    write_map(&disk, &path("whole"), &config(&mut random), &random_voxels(&mut random, 50));
    for region in
        [Aabb { min: [0.0; 3], max: [1.0, 0.0, 1.0] }, Aabb { min: [0.0, f64::NAN, 0.0], max: [1.0; 3] }]
    {
        for part in [Part::Inside(region), Part::Outside(region)] {
            let cropped =
                crop(&open(&disk, &path("whole")).unwrap(), &part, CopyScans::No, path("part"), |_, _| {});
            assert!(matches!(cropped, Err(Error::InvalidArgument { .. })));
            let cleared = clear(MapPath::on(disk.shared(), path("whole")), &part, |_, _| {});
            assert!(matches!(cleared, Err(Error::InvalidArgument { .. })));
        }
    }
    assert!(!disk.files().keys().any(|file| file.starts_with(path("part"))));
}

#[test]
fn a_map_cannot_be_created_inside_another() {
    let mut random = Random(7);
    let (disk, config) = (disk(), config(&mut random));
    write_map(&disk, &path("whole"), &config, &random_voxels(&mut random, 50));
    disk.shared().create_folder(&path("whole/snapshots")).unwrap();
    let before = disk.files();
    let everything = Part::Inside(Aabb { min: [-1e3; 3], max: [1e3; 3] });
    for inside in ["whole/tile_0_0_90", "whole/snapshots/x"] {
        let refused =
            crop(&open(&disk, &path("whole")).unwrap(), &everything, CopyScans::No, path(inside), |_, _| {});
        assert!(matches!(refused, Err(Error::InvalidArgument { .. })), "{inside}: {refused:?}");
    }
    assert_eq!(disk.files(), before);
}

/// A prism around the voxels of [`random_voxels`], with a hole.
fn random_prism(random: &mut Random) -> AreaPart {
    let mut corner = || [random.between(-6.0, 6.0), 1.5 + random.between(-6.0, 6.0)];
    let triangle = [corner(), corner(), corner()].to_vec();
    let hole = [corner(), corner(), corner()].to_vec();
    let z_m = match random.below(3) {
        0 => [f64::NEG_INFINITY, f64::INFINITY],
        1 => [-1.125, 0.75],
        _ => [random.between(-4.0, -1.0), f64::INFINITY],
    };
    AreaPart { area: Area::new(&[vec![triangle, hole]]).unwrap(), z_m, is_outside: random.below(2) == 1 }
}

#[test]
fn crops_by_areas_are_filters() {
    let (mut cut_through, mut empty) = (0, 0);
    for seed in 0..40 {
        let mut random = Random(seed);
        let (disk, config) = (disk(), config(&mut random));
        let voxels = random_voxels(&mut random, 400);
        write_map(&disk, &path("whole"), &config, &voxels);
        let part = random_prism(&mut random);
        let is_in = |voxel: [i32; 3]| {
            let alone = VoxelBox { min: voxel, end: voxel.map(|index| index + 1) };
            let [_, _, z] = config.grid.center_m(voxel);
            let is_in_prism =
                part.area.columns(&config.grid, &alone).is_full() && part.z_m[0] <= z && z < part.z_m[1];
            is_in_prism != part.is_outside
        };
        let expected: Voxels = voxels
            .iter()
            .filter(|(voxel, _)| is_in(**voxel))
            .map(|(&voxel, &found)| (voxel, found))
            .collect();
        let written =
            crop_area(&open(&disk, &path("whole")).unwrap(), &part, CopyScans::No, path("part"), |_, _| {})
                .unwrap();
        assert_eq!(read_map(&disk, &path("part")), expected, "seed {seed}");
        assert_eq!(written.voxels, expected.len() as u64);
        cut_through += u64::from(!expected.is_empty() && expected.len() < voxels.len());
        empty += u64::from(expected.is_empty());
    }
    assert!(cut_through > 10 && empty > 2, "{cut_through} {empty}");
}

#[test]
fn areas_without_a_height_of_a_voxel_are_refused() {
    let mut random = Random(1);
    let (disk, config) = (disk(), config(&mut random));
    write_map(&disk, &path("whole"), &config, &random_voxels(&mut random, 10));
    for z_m in [[1.0, 1.0], [2.0, 1.0], [f64::NAN, 1.0], [0.0, f64::NAN]] {
        let part = AreaPart { z_m, is_outside: false, ..random_prism(&mut random) };
        let refused =
            crop_area(&open(&disk, &path("whole")).unwrap(), &part, CopyScans::No, path("none"), |_, _| {});
        assert!(matches!(refused, Err(Error::InvalidArgument { .. })), "{z_m:?}");
    }
}
