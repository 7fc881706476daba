//! Compares the table with a naive map from voxels to evidence, and its octree view and files with those of the pointer
//! tree.

use super::octree::BrickOctree;
use super::table::{Palette, Table};
use crate::octree::{Octree, write_bt};
use crate::scan::BrickUpdate;
use crate::sensor::{Evidence, Iwlo, Observation, SensorModel};
use crate::space::{BrickCode, BrickMask, MortonCode, is_in_mask};
use proptest::prelude::*;
use std::collections::BTreeMap;

type Naive = BTreeMap<MortonCode, Evidence>;

/// A palette that contains all states, that occasionally drops states, or that is soon too small.
fn any_palette() -> impl Strategy<Value = Palette> {
    prop_oneof![
        Just(Palette::default()),
        (1..4_u32, 3..9_u32).prop_map(|(limit, most)| Palette::limited(1 << limit, 1 << most)),
    ]
}

fn any_model() -> impl Strategy<Value = SensorModel> {
    prop_oneof![Just(SensorModel::default()), Just(SensorModel::Iwlo(Iwlo::default()))]
}

/// Words that are empty, full, sparse or arbitrary.
fn any_mask() -> impl Strategy<Value = BrickMask> {
    let word = prop_oneof![
        4 => Just(0),
        1 => Just(u64::MAX),
        2 => (any::<u64>(), any::<u64>(), any::<u64>()).prop_map(|(a, b, c)| a & b & c),
        1 => any::<u64>(),
    ];
    prop::array::uniform8(word)
}

fn any_update() -> impl Strategy<Value = BrickUpdate> {
    let seed = (0..3_u64, any_mask(), any_mask(), any_mask(), 40.0..250.0_f32);
    seed.prop_map(|(brick, hits, misses, weak, first)| {
        let weak = std::array::from_fn(|word| weak[word] & misses[word]);
        let count: u32 = hits.iter().map(|word| word.count_ones()).sum();
        let intensities = (0..count).map(|k| first + (k % 7) as f32).collect();
        BrickUpdate { brick: BrickCode(0x0fff_ffff + brick), hits, misses, weak, intensities }
    })
}

fn apply(naive: &mut Naive, model: &SensorModel, update: &BrickUpdate) {
    for (place, observation) in crate::space::places(update.touched()).zip(update.observations()) {
        let code = update.brick.voxel(place);
        let before = naive.get(&code).copied();
        let is_weak = observation == Observation::Miss && is_in_mask(&update.weak, place);
        if !(is_weak && before.is_some()) {
            naive.insert(code, model.update(before, observation));
        }
    }
}

fn assert_is(table: &Table, naive: &Naive) {
    let bits = |(code, evidence): (MortonCode, Evidence)| {
        (code, evidence.log_odds.to_bits(), evidence.observation_count)
    };
    assert_eq!(table.len(), naive.len());
    assert!(table.iter().map(bits).eq(naive.iter().map(|(&code, &evidence)| bits((code, evidence)))));
    for code in (0x0fff_fffe << 9..0x1000_0003_u64 << 9).step_by(5).map(MortonCode) {
        assert_eq!(table.get(code), naive.get(&code).copied());
    }
    assert!(
        table.bricks().eq(naive.keys().map(|code| code.brick()).collect::<std::collections::BTreeSet<_>>())
    );
}

proptest! {
    #[test]
    fn evidence_is_that_of_the_model_with_any_palette(
        palette in any_palette(),
        model in any_model(),
        scans in prop::collection::vec((any::<bool>(), prop::collection::vec(any_update(), 1..24)), 1..4),
    ) {
        let (mut table, mut naive) = (Table::with_palette(palette), Naive::new());
        for (whole, mut updates) in scans {
            if !whole {
                // A single update is never weak.
                updates.iter_mut().for_each(|update| update.weak = [0; 8]);
            }
            updates.iter().for_each(|update| apply(&mut naive, &model, update));
            if whole {
                table.update_bricks(&model, &updates);
            } else {
                for update in updates {
                    let observed = crate::space::places(update.touched()).zip(update.observations());
                    for (place, observation) in observed {
                        table.update(&model, update.brick.voxel(place), observation);
                    }
                }
            }
            assert_eq!(table.bytes(), table.counted_bytes());
        }
        assert_is(&table, &naive);

        // Brick by brick, as when reading a file.
        let mut read = Table::with_palette(Palette::limited(4, 64));
        for brick in table.bricks() {
            let voxels: Vec<_> =
                table.voxels_of_brick(brick).map(|(code, evidence)| (code.place_in_brick(), evidence)).collect();
            let (first, second) = voxels.split_at(voxels.len() / 2);
            read.insert(brick, second);
            read.insert(brick, first);
        }
        assert_is(&read, &naive);
        assert_eq!(read.bytes(), read.counted_bytes());
    }
}

#[test]
fn steps_are_dropped_with_their_sensor_model() {
    let code = MortonCode(77);
    let (octomap, iwlo) = (SensorModel::default(), SensorModel::Iwlo(Iwlo::default()));
    let mut table = Table::default();
    let mut evidence = None;
    for model in [octomap, iwlo, octomap, iwlo] {
        for observation in [Observation::Miss, Observation::Hit(90.0), Observation::Miss] {
            table.update(&model, code, observation);
            evidence = Some(model.update(evidence, observation));
        }
    }
    assert_eq!(table.get(code), evidence);
}

#[test]
fn evidence_is_stored_once_and_dropped_when_unused() {
    let model = SensorModel::default();
    let all = BrickUpdate {
        brick: BrickCode(5),
        hits: [0; 8],
        misses: [u64::MAX; 8],
        weak: [0; 8],
        intensities: [].into(),
    };
    let mut table = Table::default();
    table.update_brick(&model, &all);
    let bytes = table.bytes();
    // A palette, a block of the directory, and two bytes per voxel: half the size of plain evidence.
    assert!(bytes < 6 * 512, "{bytes} bytes for 512 voxels");
    // Each time, the whole brick enters a state that no voxel had before.
    for _ in 0..100_000 {
        table.update_brick(&model, &all);
    }
    assert!(table.bytes() < bytes + 64 * 1024, "{} bytes", table.bytes());
    assert_eq!(table.get(MortonCode(5 << 9)).unwrap().observation_count, 100_001);
}

#[test]
fn bricks_store_states_beyond_the_palette_limit() {
    let model = SensorModel::Iwlo(Iwlo::default());
    let (mut table, mut naive) = (Table::default(), Naive::new());
    for round in 0..3 {
        for brick in 0..200_u32 {
            let first = 40.0 + brick as f32 + round as f32 / 3.0;
            let intensities = (0..512).map(|k| first + k as f32 / 1024.0).collect();
            let update = BrickUpdate {
                brick: BrickCode(0x1000_0000 - u64::from(brick)),
                hits: [u64::MAX; 8],
                misses: [0; 8],
                weak: [0; 8],
                intensities,
            };
            table.update_brick(&model, &update);
            apply(&mut naive, &model, &update);
        }
    }
    assert_is(&table, &naive);
    assert_eq!(table.bytes(), table.counted_bytes());
}

/// Runs of voxels with one value: single ones, whole nodes of every size up to eight bricks, and parts of them.
fn any_run() -> impl Strategy<Value = (u64, u64, f64)> {
    let value =
        prop_oneof![4 => Just(-2.0), 2 => Just(1.0), 1 => Just(0.0), 1 => Just(-0.0), 1 => -3.0..3.0_f64];
    let run = (0..=12_u32, any::<u64>()).prop_map(|(log, first)| {
        let (span, base) = (1 << log, 0x1234_5678_9000);
        (base + first % 16_384 / span * span, span)
    });
    let run = prop_oneof![3 => run, 1 => (0x1234_5678_9000..0x1234_5678_d000_u64, 1..3000_u64)];
    (run, value).prop_map(|((first, span), value)| (first, span, value))
}

/// A table with these runs, where later ones override earlier ones, and the tree that it represents.
fn table_of(runs: &[(u64, u64, f64)], palette: Palette) -> (Table, Octree) {
    let mut voxels = BTreeMap::new();
    for &(first, span, value) in runs {
        voxels.extend((first..first + span).map(|code| (MortonCode(code), value)));
    }
    let voxels: Vec<_> = voxels.into_iter().collect();
    let mut table = Table::with_palette(palette);
    for brick in voxels.chunk_by(|a, b| a.0.brick() == b.0.brick()) {
        let evidence = |&(code, log_odds): &(MortonCode, f64)| {
            // Equal log-odds with different observation counts are one value in an octree.
            let observation_count = (code.0 % 3) as i32;
            (code.place_in_brick(), Evidence { log_odds, observation_count })
        };
        table.insert(brick[0].0.brick(), &brick.iter().map(evidence).collect::<Vec<_>>());
    }
    (table, Octree::from_sorted(voxels.into_iter().map(|(code, value)| (code, value as f32))))
}

fn assert_same_answers(octree: &BrickOctree, table: &Table, tree: &Octree, queried: &[u64]) {
    for &code in queried {
        let code = MortonCode(0x1234_5678_9000 + code);
        for depth in 1..=16 {
            assert_eq!(octree.max_under(table, code, depth), tree.get(code, depth), "{code:?} at {depth}");
        }
    }
}

proptest! {
    #[test]
    fn bricks_equal_the_pointer_tree_in_answers_and_files(
        palette in any_palette(),
        runs in prop::collection::vec(any_run(), 0..16),
        more in any_update(),
        threshold in prop_oneof![Just(0.0_f32), Just(-2.0), Just(1.0), -3.0..3.0_f32],
        queried in prop::collection::vec(0..0x4800_u64, 1..20),
    ) {
        let (mut table, tree) = table_of(&runs, palette);
        let mut octree = BrickOctree::default();
        assert_same_answers(&octree, &table, &tree, &queried);
        octree.sync(&mut table);
        assert_same_answers(&octree, &table, &tree, &queried);
        assert_eq!(octree.node_count(), tree.node_count());

        let (mut by_bricks, mut by_tree) = (Vec::new(), Vec::new());
        table.write_bt(0.1, threshold, &mut by_bricks).unwrap();
        write_bt(&tree, 0.1, threshold, &mut by_tree).unwrap();
        assert!(by_bricks == by_tree);
        let voxels = table.iter().filter(|(_, evidence)| evidence.log_odds >= f64::from(threshold)).count();
        assert_eq!(table.count_from(f64::from(threshold)), voxels);

        let update = BrickUpdate { brick: BrickCode((0x1234_5678_9000 >> 9) + more.brick.0 % 32), ..more };
        table.update_brick(&SensorModel::default(), &update);
        octree.note_change();
        let tree = Octree::from_sorted(table.iter().map(|(code, evidence)| (code, evidence.log_odds as f32)));
        assert_same_answers(&octree, &table, &tree, &queried);
        octree.sync(&mut table);
        assert_same_answers(&octree, &table, &tree, &queried);
        assert_eq!(octree.node_count(), tree.node_count());
    }
}
