//! Tables of every kind survive the compact form bit by bit; damaged input is an error.

use super::{
    CompactEffort, CompactIndex, CompactReader, CompactWriter, filter_compact, read_compact, write_compact,
};
use crate::error::{DecodeError, FormatError};
use crate::sensor::Evidence;
use crate::space::{BrickCode, MortonCode, VoxelBox, VoxelKey};
use crate::tile::Table;
use crate::tile::table::{Palette, Storage};
use std::collections::BTreeMap;
use voxtile_simulation::Random;

type Voxels = BTreeMap<MortonCode, Evidence>;

fn state(log_odds: f64, observation_count: i32) -> Evidence {
    Evidence { log_odds, observation_count }
}

/// Returns a small or large tile, on or off the borders of bricks, at the wrap-around of keys or at the limits of
/// `i32`.
fn any_tile(random: &mut Random) -> VoxelBox {
    let n = [2, 3, 7, 8, 16, 21, 40][random.below(7) as usize];
    let min = std::array::from_fn(|_| match random.below(4) {
        0 => random.below(200) as i32 * n - 100 * n,
        1 => 32_768 / n * n,
        2 => -65_536 / n * n,
        _ => [i32::MIN, i32::MAX - n][random.below(2) as usize],
    });
    VoxelBox { min, end: min.map(|k| k + n) }
}

/// Returns a state by `kind`: one of 3, 250 or 3,000 states, or a new one for each voxel. Occasionally an extreme one.
fn any_state(random: &mut Random, kind: u64) -> Evidence {
    const ODD: [f64; 8] =
        [0.0, -0.0, f64::MIN_POSITIVE / 3.0, -5e-324, f64::MAX, f64::MIN, 1.0 + f64::EPSILON, -2.0];
    const COUNTS: [i32; 5] = [0, 1, 255, 65_536, i32::MAX];
    if random.chance(0.02) {
        return state(ODD[random.below(8) as usize], COUNTS[random.below(5) as usize]);
    }
    let step = random.below([3, 250, 3_000][kind as usize % 3]) as f64;
    let log_odds = if kind == 3 { random.between(-10.0, 10.0) } else { -0.4 * step };
    state(log_odds, step as i32)
}

fn any_voxels(random: &mut Random, tile: &VoxelBox) -> Voxels {
    let (kind, density) = (random.below(4), [0.002, 0.2, 0.9, 1.0][random.below(4) as usize]);
    let mut voxels = Voxels::new();
    let [x, y, z] = std::array::from_fn(|k| tile.min[k]..tile.end[k]);
    for x in x {
        for y in y.clone() {
            for z in z.clone() {
                if random.chance(density) {
                    voxels.insert(VoxelKey::from_index([x, y, z]).morton(), any_state(random, kind));
                }
            }
        }
    }
    voxels
}

/// Builds a table of these voxels in random order, with a palette that contains all states or is soon too small.
fn table_of(voxels: &Voxels, random: &mut Random) -> Table {
    let limit = 1 << random.between(2.0, 12.0) as usize;
    let palette = [Palette::default(), Palette::limited(limit, limit)][random.below(2) as usize].clone();
    let mut table = Table::with_palette(palette);
    let all: Vec<_> = voxels.iter().map(|(&code, &evidence)| (code, evidence)).collect();
    let mut bricks: Vec<_> = all.chunk_by(|a, b| a.0.brick() == b.0.brick()).collect();
    for k in (1..bricks.len()).rev() {
        bricks.swap(k, random.below(k as u64 + 1) as usize);
    }
    for brick in bricks {
        let voxels: Vec<_> =
            brick.iter().map(|&(code, evidence)| (code.place_in_brick(), evidence)).collect();
        let (first, second) = voxels.split_at(random.below(voxels.len() as u64 + 1) as usize);
        table.insert(brick[0].0.brick(), second);
        table.insert(brick[0].0.brick(), first);
    }
    table
}

fn written(table: &Table, effort: CompactEffort) -> Vec<u8> {
    let mut bytes = Vec::new();
    let count = write_compact(table, effort, &mut bytes).unwrap();
    assert_eq!(count, bytes.len() as u64);
    bytes
}

fn read(bytes: &[u8], tile: &VoxelBox) -> Result<Table, FormatError> {
    let format_error = |error| match error {
        DecodeError::Format(error) => error,
        DecodeError::Io(error) => panic!("memory can be read: {error}"),
    };
    let table = read_compact(&mut &bytes[..], bytes.len() as u64, tile).map_err(format_error);
    for from in [f64::NEG_INFINITY, -1.0, 0.0, f64::MAX] {
        let filtered = filter_compact(&mut &bytes[..], bytes.len() as u64, tile, from).map_err(format_error);
        match (&table, filtered) {
            (Ok(table), Ok(filtered)) => assert!(table.iter_from(from).eq(filtered)),
            (Err(table), Err(filtered)) => assert_eq!(*table, filtered),
            (_, filtered) => panic!("{filtered:?}"),
        }
    }
    if let Ok(table) = &table {
        assert_is_found_alone(bytes, tile, table);
    }
    table
}

/// Checks that some voxels, observed and unobserved ones, are the same when each is read from its group alone.
fn assert_is_found_alone(bytes: &[u8], tile: &VoxelBox, table: &Table) {
    let index = CompactIndex::read(&mut &bytes[..], bytes.len() as u64, tile).unwrap().unwrap();
    let middle = (table.len() / 2).saturating_sub(1);
    let observed = table.iter().step_by(middle.max(1)).map(|(code, _)| code);
    let corners = [tile.min, tile.end.map(|end| end - 1)].map(|voxel| VoxelKey::from_index(voxel).morton());
    for code in observed.chain(corners) {
        let place = index.group_of(code);
        let found = place.and_then(|place| {
            index.evidence(code, &bytes[place.start as usize..place.end as usize]).unwrap()
        });
        let bits = |of: Evidence| (of.log_odds.to_bits(), of.observation_count);
        assert_eq!(found.map(bits), table.get(code).map(bits), "{code:?}");
    }
}

fn assert_is(table: &Table, voxels: &Voxels) {
    let bits =
        |(code, Evidence { log_odds, observation_count })| (code, log_odds.to_bits(), observation_count);
    assert_eq!(table.len(), voxels.len());
    assert!(table.iter().map(bits).eq(voxels.iter().map(|(&code, &evidence)| bits((code, evidence)))));
    assert!(voxels.keys().all(|&code| table.get(code) == voxels.get(&code).copied()));
    assert_eq!(table.bytes(), table.counted_bytes());
}

#[test]
fn tables_round_trip_and_equal_tables_have_equal_bytes() {
    let mut random = Random::of(7, &[]);
    let mut plain = 0;
    for _ in 0..150 {
        let tile = any_tile(&mut random);
        let voxels = any_voxels(&mut random, &tile);
        let (one, other) = (table_of(&voxels, &mut random), table_of(&voxels, &mut random));
        plain += one.bricks.iter().filter(|brick| matches!(brick.evidence, Storage::Plain(_))).count();
        for effort in [CompactEffort::Fast, CompactEffort::Small] {
            let bytes = written(&one, effort);
            assert!(written(&other, effort) == bytes);
            let table = read(&bytes, &tile).unwrap();
            assert_is(&table, &voxels);
            assert!(written(&table, effort) == bytes);
        }
    }
    assert!(plain > 100, "{plain}");
}

/// A tile whose voxels have more states than fit in a palette, some of them twice.
#[test]
fn plain_bricks_round_trip() {
    let mut random = Random::of(8, &[]);
    let tile = VoxelBox { min: [0; 3], end: [50; 3] };
    let states: Vec<_> = (0..90_000).map(|_| any_state(&mut random, 3)).collect();
    let mut voxels = Voxels::new();
    for x in 0..50 {
        for y in 0..50 {
            for z in 0..50 {
                let evidence = states[random.below(90_000) as usize];
                voxels.insert(VoxelKey::from_index([x, y, z]).morton(), evidence);
            }
        }
    }
    let (one, other) = (table_of(&voxels, &mut random), table_of(&voxels, &mut random));
    let bytes = written(&one, CompactEffort::Fast);
    assert!(written(&other, CompactEffort::Fast) == bytes);
    let table = read(&bytes, &tile).unwrap();
    assert_is(&table, &voxels);
    assert!(table.bricks.iter().any(|brick| matches!(brick.evidence, Storage::Plain(_))));
    assert!(written(&table, CompactEffort::Fast) == bytes);
}

#[test]
fn decoded_tables_can_be_updated() {
    use crate::sensor::{Observation, SensorModel};
    let mut random = Random::of(9, &[]);
    let tile = VoxelBox { min: [0; 3], end: [16; 3] };
    let voxels = any_voxels(&mut random, &tile);
    let mut table = table_of(&voxels, &mut random);
    let mut again = read(&written(&table, CompactEffort::Fast), &tile).unwrap();
    let model = SensorModel::default();
    for round in 0..20_000 {
        let voxel = std::array::from_fn(|_| random.below(16) as i32);
        let observation = if round % 3 == 0 { Observation::Hit(0.0) } else { Observation::Miss };
        for table in [&mut table, &mut again] {
            table.update(&model, VoxelKey::from_index(voxel).morton(), observation);
        }
    }
    assert_is(&again, &table.iter().collect());
}

/// Checks the index of a table, and reads all its voxels individually from their groups.
fn assert_is_voxel_by_voxel(bytes: &[u8], tile: &VoxelBox, voxels: &Voxels) {
    let index = CompactIndex::read(&mut &bytes[..], bytes.len() as u64, tile).unwrap().unwrap();
    let crc = bytes.last_chunk().unwrap();
    assert_eq!(index.crc(), u32::from_le_bytes(*crc));
    let [x, y, z] = std::array::from_fn(|k| tile.min[k]..tile.end[k]);
    for x in x {
        for y in y.clone() {
            for z in z.clone() {
                let code = VoxelKey::from_index([x, y, z]).morton();
                let group =
                    index.group_of(code).map(|place| &bytes[place.start as usize..place.end as usize]);
                let found = group.and_then(|group| index.evidence(code, group).unwrap());
                let bits = |of: Evidence| (of.log_odds.to_bits(), of.observation_count);
                assert_eq!(found.map(bits), voxels.get(&code).copied().map(bits), "{code:?}");
            }
        }
    }
}

#[test]
fn single_voxels_are_read_from_their_groups() {
    let mut random = Random::of(10, &[]);
    for _ in 0..40 {
        let mut tile = any_tile(&mut random);
        (0..3).for_each(|k| tile.end[k] = tile.end[k].min(tile.min[k].saturating_add(16)));
        let voxels = any_voxels(&mut random, &tile);
        let bytes = written(&table_of(&voxels, &mut random), CompactEffort::Fast);
        assert_is_voxel_by_voxel(&bytes, &tile, &voxels);
    }
    // Several groups, symbols of one and two bytes, and rare states in each.
    let tile = VoxelBox { min: [0; 3], end: [56; 3] };
    let mut voxels = Voxels::new();
    for x in 0..56 {
        for y in 0..56 {
            for z in (0..56).filter(|z| (x * y + z) % 5 != 0) {
                let kind = random.below(60).min(3);
                voxels.insert(VoxelKey::from_index([x, y, z]).morton(), any_state(&mut random, kind.max(1)));
            }
        }
    }
    let bytes = written(&table_of(&voxels, &mut random), CompactEffort::Fast);
    let index = CompactIndex::read(&mut &bytes[..], bytes.len() as u64, &tile).unwrap().unwrap();
    let mut groups = std::collections::BTreeSet::new();
    for (number, (&code, evidence)) in voxels.iter().enumerate() {
        let place = index.group_of(code).unwrap();
        groups.insert(place.start);
        if number % 199 == 0 {
            let found = index.evidence(code, &bytes[place.start as usize..place.end as usize]).unwrap();
            assert_eq!(found, Some(*evidence), "{code:?}");
        }
    }
    assert!(groups.len() > 1);
}

/// Reading one voxel verifies its parts against the checksum of the whole.
#[test]
fn flipped_bits_are_detected_when_reading_one_voxel() {
    let (tile, table) = small();
    let bytes = written(&table, CompactEffort::Fast);
    let (&code, _) =
        table.iter().collect::<Voxels>().first_key_value().map(|(code, of)| (code, *of)).unwrap();
    let right = u32::from_le_bytes(*bytes.last_chunk().unwrap());
    for bit in 0..8 * (bytes.len() - 4) {
        let mut wrong = bytes.clone();
        wrong[bit / 8] ^= 1 << (bit % 8);
        let Ok(Some(index)) = CompactIndex::read(&mut &wrong[..], wrong.len() as u64, &tile) else {
            continue;
        };
        if index.crc() == right {
            let place = index.group_of(code).unwrap();
            assert!(place.contains(&(bit as u64 / 8)), "bit {bit}");
            index.evidence(code, &wrong[place.start as usize..place.end as usize]).unwrap_err();
        }
    }
}

/// Adds the checksum, and corrects those of the parts that exist.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let u32_at = |bytes: &[u8], at: usize| {
        bytes.get(at..at + 4).map_or(0, |bytes| u32::from_le_bytes(bytes.try_into().unwrap())) as usize
    };
    let groups = u32_at(&bytes, 24).min(bytes.len() / 16);
    let mut begin = 36 + 16 * groups;
    for number in 0..=groups {
        let [length, crc] = if number == 0 { [28, 32] } else { [28 + 16 * number, 32 + 16 * number] };
        let end = begin + u32_at(&bytes, length);
        if let Some(part) = bytes.get(begin..end) {
            let part = crc32fast::hash(part).to_le_bytes();
            bytes[crc..crc + 4].copy_from_slice(&part);
        }
        begin = end;
    }
    bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
    bytes
}

struct FullDisk;

impl std::io::Write for FullDisk {
    fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
        Err(std::io::ErrorKind::StorageFull.into())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
fn writers_and_readers_can_be_reused_after_failures() {
    let mut random = Random::of(4, &[]);
    let (mut writer, mut reader) =
        (CompactWriter::new(CompactEffort::Fast).unwrap(), CompactReader::new().unwrap());
    for _ in 0..30 {
        let tile = any_tile(&mut random);
        let voxels = any_voxels(&mut random, &tile);
        let table = table_of(&voxels, &mut random);
        writer.write(&table, &mut FullDisk).unwrap_err();
        let mut bytes = Vec::new();
        writer.write(&table, &mut bytes).unwrap();
        assert!(bytes == written(&table, CompactEffort::Fast));
        let half = bytes.len() / 2;
        reader.read(&mut &bytes[..half], half as u64, &tile).unwrap_err();
        assert_is(&reader.read(&mut &bytes[..], bytes.len() as u64, &tile).unwrap(), &voxels);
    }
}

/// A small table with every part of the form: states of the codebook, rare ones, two bricks.
fn small() -> (VoxelBox, Table) {
    let tile = VoxelBox { min: [-12, 36, 0], end: [0, 48, 12] };
    let mut voxels = Voxels::new();
    for x in -9..-1 {
        for y in 38..47 {
            let evidence = if x * y % 17 == 0 { state(f64::from(x), y) } else { state(-0.5, y % 5) };
            voxels.insert(VoxelKey::from_index([x, y, 3]).morton(), evidence);
        }
    }
    (tile, table_of(&voxels, &mut Random::of(1, &[])))
}

/// A table of three groups, with symbols of one and two bytes and rare states in each.
fn three_groups() -> (VoxelBox, Table) {
    let tile = VoxelBox { min: [0; 3], end: [104; 3] };
    let mut voxels = Voxels::new();
    for number in 0..13 * 13 * 13 {
        let [x, y, z] = [number / 169, number / 13 % 13, number % 13].map(|k| 8 * k);
        for k in 0..=number % 3 {
            let evidence = match number % 11 {
                0 => state(f64::from(number) * 0.001 + f64::from(k), number % 7),
                _ => state(f64::from(number % 300) * -0.4, number % 300),
            };
            let voxel = [x + (number + k) % 8, y + number / 8 % 8, z + k];
            voxels.insert(VoxelKey::from_index(voxel).morton(), evidence);
        }
    }
    (tile, table_of(&voxels, &mut Random::of(1, &[])))
}

/// With valid checksums: groups must match the index, also when one group is read alone.
#[test]
fn an_index_that_does_not_match_its_groups_is_an_error() {
    let (tile, table) = three_groups();
    let bytes = written(&table, CompactEffort::Fast);
    read(&bytes, &tile).unwrap();
    let index = CompactIndex::read(&mut &bytes[..], bytes.len() as u64, &tile).unwrap().unwrap();
    let codes: Vec<_> = table.iter().map(|(code, _)| code).collect();
    let groups: Vec<_> = codes.chunk_by(|a, b| index.group_of(*a) == index.group_of(*b)).collect();
    let places: Vec<_> = groups.iter().map(|group| index.group_of(group[0]).unwrap()).collect();
    assert_eq!(places.len(), 3);
    assert!(places.windows(2).all(|pair| pair[0].end == pair[1].start));

    let entry = |group: usize| 36 + 16 * group;
    let last = groups[0].last().unwrap().brick().0.to_le_bytes();
    let [shorter, longer] = [(&places[0], -1), (&places[1], 1)]
        .map(|(place, more)| ((place.end - place.start) as i32 + more).to_le_bytes());
    type Changes<'a> = &'a [(usize, &'a [u8])];
    let cases: [(Changes<'_>, u64, &str, bool); 3] = [
        (&[(entry(1), &last)], places[0].start, "bricks of the next one", true),
        (&[(entry(0) + 8, &shorter), (entry(1) + 8, &longer)], places[0].start, "bytes instead of", true),
        (&[(16, &1025_u32.to_le_bytes())], places[1].start, "at most 1", false),
    ];
    for (changes, place, reason, is_seen_alone) in cases {
        let mut wrong = bytes[..bytes.len() - 4].to_vec();
        for (at, with) in changes {
            wrong[*at..at + with.len()].copy_from_slice(with);
        }
        let wrong = sealed(wrong);
        let error = read(&wrong, &tile).unwrap_err();
        assert_eq!(error.at, place, "{error}");
        assert!(error.reason.contains(reason), "{error}");
        let index = CompactIndex::read(&mut &wrong[..], wrong.len() as u64, &tile).unwrap().unwrap();
        let place = index.group_of(codes[0]).unwrap();
        let alone = index.evidence(codes[0], &wrong[place.start as usize..place.end as usize]);
        assert_eq!(alone.is_err(), is_seen_alone);
    }
}

#[test]
fn truncations_and_flipped_bits_are_errors() {
    let (tile, table) = small();
    let bytes = written(&table, CompactEffort::Small);
    assert!(read(&bytes, &tile).is_ok());
    for length in 0..bytes.len() {
        read(&bytes[..length], &tile).unwrap_err();
    }
    for bit in 0..8 * bytes.len() {
        let mut wrong = bytes.clone();
        wrong[bit / 8] ^= 1 << (bit % 8);
        read(&wrong, &tile).unwrap_err();
    }
    read(&[&bytes[..], &[0]].concat(), &tile).unwrap_err();
    // A stream that is shorter than its declared length.
    let longer = read_compact(&mut &bytes[..bytes.len() - 1], bytes.len() as u64, &tile);
    assert!(matches!(longer, Err(DecodeError::Io(_))));
}

/// With a valid checksum, the result is an error or a table of this tile.
#[test]
fn hostile_bytes_are_an_error_or_a_table_of_the_tile() {
    hostile_bytes_of(small(), 20_000, 200);
    hostile_bytes_of(three_groups(), 1_000, 25);
}

fn hostile_bytes_of((tile, table): (VoxelBox, Table), times: usize, min_read_well: usize) {
    let bytes = written(&table, CompactEffort::Fast);
    let mut random = Random::of(3, &[]);
    let (mut refused, mut read_well) = (0, 0);
    for _ in 0..times {
        let mut wrong = bytes[..bytes.len() - 4].to_vec();
        for _ in 0..=random.below(3) {
            let end = if random.chance(0.5) { wrong.len() as u64 } else { 84 };
            let at = random.below(end) as usize;
            wrong[at] = [0, 1, 127, 255, random.below(256) as u8][random.below(5) as usize];
        }
        let Ok(table) = read(&sealed(wrong), &tile) else {
            refused += 1;
            continue;
        };
        read_well += 1;
        let voxels: Voxels = table.iter().collect();
        assert_is(&table, &voxels);
        assert!(voxels.keys().all(|code| tile.contains(code.to_key().to_index_from(tile.min))));
        let is_evidence = |e: &Evidence| e.log_odds.is_finite() && e.observation_count >= 0;
        assert!(voxels.values().all(is_evidence));
        assert_is(&read(&written(&table, CompactEffort::Fast), &tile).unwrap(), &voxels);
    }
    assert!(refused > times / 4 && read_well > min_read_well, "{refused} {read_well}");
}

#[test]
fn errors_have_the_offset_of_their_cause() {
    let (tile, table) = small();
    let bytes = written(&table, CompactEffort::Fast);
    let wrong = |at: usize, with: &[u8]| {
        let mut wrong = bytes[..bytes.len() - 4].to_vec();
        wrong[at..at + with.len()].copy_from_slice(with);
        read(&sealed(wrong), &tile).unwrap_err()
    };
    let all = u64::MAX.to_le_bytes();
    for (at, with, place, reason) in [
        (0, &b"IWLO"[..], 0, "magic"),
        (4, &[3], 4, "version 3"),
        (8, &all, 8, "18446744073709551615 voxels in a tile of 1728"),
        (8, &[1], 16, "1 voxels in"),
        (16, &all[..4], 16, "bricks"),
        (16, &[0], 16, "0 bricks"),
        (20, &all[..4], 20, "codebook"),
        (20, &[1], 52, "codebook"),
        (24, &all[..4], 24, "groups"),
        (24, &[0], 24, "0 groups"),
        (28, &all[..4], 36, "the parts should have"),
        (36, &all, 36, "ascend"),
        (44, &all[..4], 36, "the parts should have"),
    ] {
        let error = wrong(at, with);
        assert_eq!(error.at, place, "{error}");
        assert!(error.reason.contains(reason), "{error}");
    }
    let neighbor = VoxelBox { min: [0, 36, 0], end: [12, 48, 12] };
    assert!(read(&bytes, &neighbor).unwrap_err().reason.contains("another tile"));
    assert!(read(&[], &tile).unwrap_err().reason.contains("too few"));
}

#[test]
fn an_empty_table_and_a_full_brick_have_fixed_bytes() {
    let tile = VoxelBox { min: [0; 3], end: [8; 3] };
    let empty = written(&Table::default(), CompactEffort::Fast);
    assert_eq!(empty.len(), 42);
    assert!(read(&empty, &tile).unwrap().is_empty());

    let mut full = Table::default();
    full.insert(
        BrickCode::of_voxel([0; 3]),
        &(0..512).map(|place| (place, state(1.5, 2))).collect::<Vec<_>>(),
    );
    let bytes = written(&full, CompactEffort::Fast);
    assert!(bytes.len() < 150, "{}", bytes.len());
    assert_eq!(read(&bytes, &tile).unwrap().len(), 512);
}
