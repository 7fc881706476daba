//! The table against the simplest thing that could be right: a map from voxels to evidence.

use super::palette::Palette;
use super::table::Table;
use crate::scan::BrickUpdate;
use crate::sensor::{Evidence, Iwlo, Observation, SensorModel};
use crate::space::{BrickCode, BrickMask, MortonCode};
use proptest::prelude::*;
use std::collections::BTreeMap;

type Naive = BTreeMap<MortonCode, Evidence>;

/// A palette that holds all states, ones that must drop states now and then, and ones that soon hold too few.
fn any_palette() -> impl Strategy<Value = Palette> {
    prop_oneof![
        Just(Palette::default()),
        (1..4_u32, 3..9_u32).prop_map(|(limit, most)| Palette::limited(1 << limit, 1 << most)),
    ]
}

fn any_model() -> impl Strategy<Value = SensorModel> {
    prop_oneof![Just(SensorModel::default()), Just(SensorModel::Iwlo(Iwlo::default()))]
}

/// Words that are empty, full, sparse or anything.
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
    let seed = (0..3_u64, any_mask(), any_mask(), 40.0..250.0_f32);
    seed.prop_map(|(brick, hits, misses, first)| {
        let count: u32 = hits.iter().map(|word| word.count_ones()).sum();
        let intensities = (0..count).map(|k| first + (k % 7) as f32).collect();
        BrickUpdate { brick: BrickCode(0x0fff_ffff + brick), hits, misses, intensities }
    })
}

fn apply(naive: &mut Naive, model: &SensorModel, update: &BrickUpdate) {
    for (place, observation) in crate::space::places(update.touched()).zip(update.observations()) {
        let code = update.brick.voxel(place);
        naive.insert(code, model.update(naive.get(&code).copied(), observation));
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
    fn whatever_the_palette_holds_the_evidence_is_that_of_the_model(
        palette in any_palette(),
        model in any_model(),
        updates in prop::collection::vec((any::<bool>(), any_update()), 1..24),
    ) {
        let (mut table, mut naive) = (Table::with_palette(palette), Naive::new());
        for (whole, update) in updates {
            apply(&mut naive, &model, &update);
            if whole {
                table.update_brick(&model, &update);
            } else {
                for (place, observation) in crate::space::places(update.touched()).zip(update.observations()) {
                    table.update(&model, update.brick.voxel(place), observation);
                }
            }
            assert_eq!(table.bytes(), table.counted_bytes());
        }
        assert_is(&table, &naive);

        // As a file is read: brick by brick.
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
fn a_step_is_forgotten_with_its_sensor_model() {
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
fn evidence_is_kept_once_and_dropped_when_no_voxel_has_it() {
    let model = SensorModel::default();
    let all =
        BrickUpdate { brick: BrickCode(5), hits: [0; 8], misses: [u64::MAX; 8], intensities: [].into() };
    let mut table = Table::default();
    table.update_brick(&model, &all);
    let bytes = table.bytes();
    assert!(bytes < 4 * 512, "{bytes} bytes for 512 voxels");
    // Each time the whole brick is in a state that no voxel was in before.
    for _ in 0..100_000 {
        table.update_brick(&model, &all);
    }
    assert!(table.bytes() < bytes + 64 * 1024, "{} bytes", table.bytes());
    assert_eq!(table.get(MortonCode(5 << 9)).unwrap().observation_count, 100_001);
}

#[test]
fn more_states_than_a_palette_holds_are_kept_by_the_bricks() {
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
                intensities,
            };
            table.update_brick(&model, &update);
            apply(&mut naive, &model, &update);
        }
    }
    assert_is(&table, &naive);
    assert_eq!(table.bytes(), table.counted_bytes());
}
