use crate::naive::{Positions, bounds_m, classes, clusters, is_hidden, is_same_box, thinned, voxels_of};
use crate::random_maps::{TILE_SIZES_M, config, fill, random_map, random_region, storage_of};
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};
use testkit::random_scans::Random;
use testkit::support::cases;
use voxtile::mapper::MapView;
use voxtile::{MapOptions, MapReader, Mapper, VoxelIndex};
use voxtile_compare::{
    ChangeKind, CompareOptions, Comparison, EpochCounts, Viewpoints, VoxelClass, compare, compare_span,
    count_blocks, for_each_voxel, join_spans,
};

type Classes = BTreeMap<VoxelIndex, VoxelClass>;

fn compared<A: MapView, B: MapView>(
    a: &A,
    b: &B,
    options: &CompareOptions,
) -> (Comparison, Classes, BTreeMap<VoxelIndex, u32>) {
    let comparison = compare(a, b, options, &|_, _| {}).unwrap();
    let of_spans = compared_in_spans(a, b, options);
    assert_eq!(json!(of_spans), json!(comparison));
    let comparison = of_spans;
    let (mut classes, mut changes) = (Classes::new(), BTreeMap::new());
    for_each_voxel(
        a,
        b,
        options,
        &comparison,
        &VoxelClass::ALL,
        |voxel| {
            assert!(classes.insert(voxel.index, voxel.class).is_none(), "{voxel:?} twice");
            changes.extend(voxel.change.map(|change| (voxel.index, change)));
            Ok(())
        },
        &|_, _| {},
    )
    .unwrap();
    (comparison, classes, changes)
}

/// Compares spans of one to three blocks alone, as if other processes did.
fn compared_in_spans<A: MapView, B: MapView>(a: &A, b: &B, options: &CompareOptions) -> Comparison {
    let blocks = count_blocks(a, b, options).unwrap();
    let (mut spans, mut first) = (Vec::new(), 0);
    while first < blocks {
        let end = first + 1 + first % 3;
        let span = compare_span(a, b, options, first..end, &|_, _| {}).unwrap();
        spans.push(serde_json::to_vec(&span).unwrap());
        first = end;
    }
    let spans = spans.iter().map(|bytes| serde_json::from_slice(bytes).unwrap());
    join_spans(a, b, options, spans).unwrap()
}

fn counts(classes: &Classes, names: [VoxelClass; 3]) -> [u64; 5] {
    let count = |wanted| classes.values().filter(|class| **class == wanted).count() as u64;
    [classes.len() as u64, count(VoxelClass::Unchanged), count(names[0]), count(names[1]), count(names[2])]
}

fn listed(counts: EpochCounts) -> [u64; 5] {
    [counts.occupied, counts.unchanged, counts.changed, counts.not_seen, counts.uncertain]
}

const OF_BEFORE: [VoxelClass; 3] =
    [VoxelClass::Vanished, VoxelClass::NotSeenAfter, VoxelClass::UncertainVanished];
const OF_AFTER: [VoxelClass; 3] =
    [VoxelClass::Appeared, VoxelClass::NotSeenBefore, VoxelClass::UncertainAppeared];

/// Compares two maps with the definition. Returns the numbers of changes and of hidden voxels.
fn check<A: MapView, B: MapView>(
    a: &A,
    b: &B,
    (options, positions): &(CompareOptions, [Option<Positions>; 2]),
    name: &str,
) -> [usize; 2] {
    let (comparison, found, changes) = compared(a, b, options);
    let (before, after) = (voxels_of(a), voxels_of(b));
    let tolerance = options.tolerance_m.map_or(1, |tolerance_m| (tolerance_m / 0.1).round() as i32);
    let grid = a.config().grid;
    let is_inside = |voxel| options.region.is_none_or(|region| region.contains(grid.center_m(voxel)));
    let certain = voxtile::maths::least_logit(options.certainty);
    let of_before = classes(&before, &after, tolerance, certain, &is_inside, OF_BEFORE);
    let of_after = classes(&after, &before, tolerance, certain, &is_inside, OF_AFTER);
    assert_eq!(listed(comparison.before), counts(&of_before, OF_BEFORE), "{name}");
    assert_eq!(listed(comparison.after), counts(&of_after, OF_AFTER), "{name}");
    // Unchanged voxels are those of the later map.
    let mut wanted = of_after.clone();
    wanted.extend(
        of_before.iter().filter(|(_, class)| **class != VoxelClass::Unchanged).map(|(k, v)| (*k, *v)),
    );
    // Unknown voxels are hidden or out of view.
    for (voxel, class) in &mut wanted {
        let is_known_hidden = match (&*class, positions) {
            (VoxelClass::NotSeenBefore, [Some(positions), _]) => is_hidden(a, positions, *voxel),
            (VoxelClass::NotSeenAfter, [_, Some(positions)]) => is_hidden(b, positions, *voxel),
            _ => false,
        };
        if is_known_hidden {
            let is_before = *class == VoxelClass::NotSeenBefore;
            *class = if is_before { VoxelClass::HiddenBefore } else { VoxelClass::HiddenAfter };
        }
    }
    assert_eq!(found, wanted, "{name}");
    let hidden = [comparison.after.hidden, comparison.before.hidden].map(|hidden| hidden.is_some());
    assert_eq!(hidden, positions.each_ref().map(Option::is_some), "{name}");
    for class in VoxelClass::ALL {
        let count = found.values().filter(|other| **other == class).count() as u64;
        assert_eq!(comparison.voxels_of(class), count, "{name}: {class:?}");
    }
    let mut all = Vec::new();
    for (kind, class, of_kind, counted) in [
        (ChangeKind::Vanished, VoxelClass::Vanished, &of_before, comparison.vanished),
        (ChangeKind::Appeared, VoxelClass::Appeared, &of_after, comparison.appeared),
    ] {
        let all_of_kind = clusters(of_kind.iter().filter(|(_, of)| **of == class).map(|(voxel, _)| *voxel));
        let (large, small): (Vec<_>, Vec<_>) =
            all_of_kind.into_iter().partition(|cluster| cluster.len() as u64 >= options.min_voxels);
        let voxels =
            |clusters: &[BTreeSet<_>]| clusters.iter().map(|cluster| cluster.len() as u64).sum::<u64>();
        assert_eq!([counted.clusters, counted.voxels], [large.len() as u64, voxels(&large)], "{name}");
        assert_eq!([counted.small_clusters, counted.small_voxels], [small.len() as u64, voxels(&small)]);
        all.extend(large.into_iter().map(|cluster| (kind, cluster)));
    }
    all.sort_by_key(|(_, cluster)| {
        (std::cmp::Reverse(cluster.len()), cluster.iter().map(|[x, y, z]| [*z, *y, *x]).min())
    });
    assert_eq!(comparison.changes.len(), all.len());
    for (change, (kind, cluster)) in comparison.changes.iter().zip(&all) {
        assert_eq!((change.kind, change.voxels), (*kind, cluster.len() as u64), "{name}");
        assert!(is_same_box(&change.bounds_m, &bounds_m(cluster)), "{name}: {change:?}");
        let of_change: BTreeSet<_> =
            changes.iter().filter(|(_, number)| **number == change.number).map(|(voxel, _)| *voxel).collect();
        assert_eq!(of_change, *cluster, "{name}");
        let mean = |k: usize| {
            cluster.iter().map(|voxel| grid.center_m(*voxel)[k]).sum::<f64>() / cluster.len() as f64
        };
        assert!((0..3).all(|k| (change.center_m[k] - mean(k)).abs() < 1e-6));
    }
    let is_hidden = |class: &&VoxelClass| matches!(class, VoxelClass::HiddenBefore | VoxelClass::HiddenAfter);
    [comparison.changes.len(), found.values().filter(is_hidden).count()]
}

fn random_options(random: &mut Random) -> (CompareOptions, [Option<Positions>; 2]) {
    let settings = random_settings(random);
    let positions: [Option<Positions>; 2] = std::array::from_fn(|_| {
        let count = [1, 2, 30][random.below(3) as usize];
        let positions = (0..count).map(|_| random.point([0.3, 12.4, -0.2], 2.0)).collect();
        let range_m = [0.5, 2.0, 20.0][random.below(3) as usize];
        (random.below(3) > 0).then_some((positions, range_m))
    });
    let viewpoints = positions.clone().map(|positions| {
        positions.map(|(positions, range_m)| Viewpoints::new(positions, Some(range_m)).unwrap())
    });
    (settings.with_viewpoints(viewpoints), positions.map(|positions| positions.map(thinned)))
}

fn random_settings(random: &mut Random) -> CompareOptions {
    let tolerances_m = [None, Some(0.0), Some(0.1), Some(0.2), Some(0.34)];
    CompareOptions::default()
        .with_tolerance(tolerances_m[random.below(5) as usize])
        .with_certainty([0.51, 0.7, 0.8][random.below(3) as usize])
        .with_min_voxels(1 + random.below(6))
        .with_region(random_region(random))
        .with_memory([0, 256 << 20][random.below(2) as usize])
}

#[test]
fn comparisons_of_random_maps_equal_the_definition() {
    let mut changes = 0;
    for case in 0..cases(16, 1000) {
        let random = &mut Random(case);
        let tile_size_m = |random: &mut Random| TILE_SIZES_M[random.below(3) as usize];
        let (a, b) = (random_map(case, 1, tile_size_m(random)), random_map(case, 2, tile_size_m(random)));
        let options = random_options(random);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1 + random.below(3) as usize).build().unwrap();
        changes += pool.install(|| check(&a, &b, &options, &format!("case {case}")))[0];
    }
    assert!(changes > 20, "{changes}");
}

#[test]
fn hidden_voxels_of_different_scenes_equal_the_definition() {
    let mut hidden = 0;
    for case in 0..cases(10, 300) {
        let random = &mut Random(case);
        let (a, b) =
            (random_map(case, 1, 3.0), random_map(case + 500, 2, TILE_SIZES_M[random.below(3) as usize]));
        let options = random_options(random);
        hidden += check(&a, &b, &options, &format!("case {case}"))[1];
    }
    assert!(hidden > 20, "{hidden}");
}

#[test]
fn maps_on_disk_of_both_storages_equal_maps_in_memory() {
    for case in 0..cases(4, 60) {
        let random = &mut Random(case);
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = [1, 2].map(|epoch| {
            let path = folder.path().join(epoch.to_string());
            let config =
                config(TILE_SIZES_M[random.below(3) as usize]).with_storage(storage_of(case + epoch));
            let mut map = MapOptions::new().config(config).create_new(true).open(&path).unwrap();
            fill(&mut map, case, epoch);
            map.flush().unwrap();
            MapReader::open(&path, 1 << 20).unwrap()
        });
        let options = random_options(random);
        check(&a, &b, &options, &format!("case {case}"));
        let in_memory = [1, 2].map(|epoch| random_map(case, epoch, 3.0));
        let of_disk = compared(&a, &b, &options.0);
        let of_memory = compared(&in_memory[0], &in_memory[1], &options.0);
        assert_eq!(
            (of_disk.0.changes, of_disk.1, of_disk.2),
            (of_memory.0.changes, of_memory.1, of_memory.2)
        );
    }
}

#[test]
fn a_map_is_unchanged_compared_with_itself() {
    let map = random_map(3, 1, 3.0);
    let comparison = compare(&map, &map, &CompareOptions::default().with_tolerance(0.0), &|_, _| {}).unwrap();
    assert_eq!(comparison.before, comparison.after);
    assert!(comparison.before.unchanged == comparison.before.occupied && comparison.before.occupied > 100);
    assert!(comparison.changes.is_empty() && comparison.before.seen_share() == 1.0);
}
