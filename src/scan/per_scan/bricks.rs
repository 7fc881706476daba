use crate::scan::clearing::{BrickMarks, Clearance};
use crate::scan::pages::MarkedBrick;
use crate::scan::updates::{BrickUpdate, MappedTiles, brick_code, brick_index, bricks_by_tile, part_in_tile};
use crate::space::{
    BRICK_EDGE, BrickMask, Grid, MortonCode, TileIndex, VoxelIndex, VoxelKey, is_in_mask, places,
};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Largest intensity of each hit voxel; empty for sensor models that need none.
pub(crate) type Intensities = FxHashMap<VoxelIndex, f32>;

/// Returns the updates of marked bricks by mapped tile, in Morton order. Bricks across a tile border are split. `weak`
/// returns the weak misses of a brick by its index.
pub(crate) fn updates_by_tile(
    mapped: MappedTiles<'_>,
    bricks: &[MarkedBrick],
    intensities: &Intensities,
    weak: impl Fn(VoxelIndex) -> BrickMask + Sync,
) -> Vec<(TileIndex, Vec<BrickUpdate>)> {
    let indices: Vec<VoxelIndex> = bricks.iter().map(|brick| brick.index).collect();
    let updates = bricks_by_tile(mapped, &indices, 0).into_par_iter().map(|(tile, numbers)| {
        let of_tile = numbers.iter().map(|&number| &bricks[number as usize]);
        (tile, updates_of_tile(mapped.grid, tile, of_tile, intensities, &weak))
    });
    let mut tiles: Vec<(TileIndex, Vec<BrickUpdate>)> = updates.collect();
    tiles.retain(|(_, bricks)| !bricks.is_empty());
    tiles
}

/// Adds the updates of further bricks to those of tiles.
pub(crate) fn add_bricks(
    tiles: &mut Vec<(TileIndex, Vec<BrickUpdate>)>,
    others: Vec<(TileIndex, Vec<BrickUpdate>)>,
) {
    let mut others: FxHashMap<TileIndex, Vec<BrickUpdate>> = others.into_iter().collect();
    for (tile, bricks) in tiles.iter_mut() {
        if let Some(others) = others.remove(tile) {
            bricks.extend(others);
            bricks.sort_unstable_by_key(|brick| brick.brick);
        }
    }
    tiles.extend(others);
}

/// Returns the marks of bricks by mapped tile, in Morton order, for a rule that needs their surroundings: each tile gets
/// the whole bricks that are within `reach` voxels. Hits and misses are those of the marks.
pub(crate) fn marks_by_tile(
    mapped: MappedTiles<'_>,
    bricks: &[MarkedBrick],
    intensities: &Intensities,
    reach: i32,
) -> Vec<(TileIndex, Vec<BrickUpdate>)> {
    let indices: Vec<VoxelIndex> = bricks.iter().map(|brick| brick.index).collect();
    let marks = |number: u32| {
        let brick = &bricks[number as usize];
        BrickUpdate {
            brick: brick_code(brick.index),
            hits: brick.hits,
            misses: brick.misses(),
            weak: [0; 8],
            intensities: intensities_of(brick.index, &brick.hits, intensities),
        }
    };
    bricks_by_tile(mapped, &indices, reach)
        .into_iter()
        .map(|(tile, numbers)| (tile, numbers.into_iter().map(marks).collect()))
        .collect()
}

/// Returns the updates of a tile from its marks and those around it, in Morton order, as by [`marks_by_tile`].
pub(crate) fn guarded_updates(
    grid: &Grid,
    tile: TileIndex,
    marks: &[BrickUpdate],
    clearance: &Clearance,
) -> Vec<BrickUpdate> {
    let marked = |update: &BrickUpdate| MarkedBrick {
        index: brick_index(grid, tile, update.brick),
        hits: update.hits,
        passed: update.misses,
    };
    let around: BrickMarks = marks.iter().map(marked).collect();
    let of_tile = |update: &BrickUpdate| {
        let index = brick_index(grid, tile, update.brick);
        let part = part_in_tile(grid, tile, index);
        let within = |mask: &BrickMask| -> BrickMask { std::array::from_fn(|word| mask[word] & part[word]) };
        let (hits, misses) = (within(&update.hits), within(&update.misses));
        if hits == [0; 8] && misses == [0; 8] {
            return None;
        }
        let weak = within(&clearance.weak_misses(index, &around));
        let all = places(update.hits).zip(&update.intensities);
        let intensities = all.filter(|(place, _)| is_in_mask(&hits, *place)).map(|(_, &intensity)| intensity);
        Some(BrickUpdate { brick: update.brick, hits, misses, weak, intensities: intensities.collect() })
    };
    marks.iter().filter_map(of_tile).collect()
}

fn updates_of_tile<'a>(
    grid: &Grid,
    tile: TileIndex,
    bricks: impl Iterator<Item = &'a MarkedBrick>,
    intensities: &Intensities,
    weak: impl Fn(VoxelIndex) -> BrickMask,
) -> Vec<BrickUpdate> {
    let update = |&MarkedBrick { index, mut hits, passed: mut misses }: &MarkedBrick| {
        let part = part_in_tile(grid, tile, index);
        for word in 0..8 {
            hits[word] &= part[word];
            misses[word] &= part[word] & !hits[word];
        }
        let is_empty = hits == [0; 8] && misses == [0; 8];
        let update = || {
            let (brick, intensities) = (brick_code(index), intensities_of(index, &hits, intensities));
            let weak = weak(index);
            let weak = std::array::from_fn(|word| weak[word] & misses[word]);
            BrickUpdate { brick, hits, misses, weak, intensities }
        };
        (!is_empty).then(update)
    };
    bricks.filter_map(update).collect()
}

/// The intensities of the given hits of a brick, in the order of the mask.
pub(crate) fn intensities_of(brick: VoxelIndex, hits: &BrickMask, intensities: &Intensities) -> Box<[f32]> {
    if intensities.is_empty() {
        return Box::default();
    }
    let intensity = |place| {
        let VoxelKey(local) = MortonCode(place as u64).to_key();
        let voxel = std::array::from_fn(|k| brick[k] * BRICK_EDGE + i32::from(local[k]));
        intensities.get(&voxel).copied().unwrap_or_default()
    };
    places(*hits).map(intensity).collect()
}

pub(crate) fn hits_and_misses(bricks: &[BrickUpdate]) -> (u64, u64) {
    let ones = |mask: &BrickMask| u64::from(mask.map(u64::count_ones).iter().sum::<u32>());
    bricks
        .iter()
        .fold((0, 0), |(hits, misses), brick| (hits + ones(&brick.hits), misses + ones(&brick.misses)))
}

/// Merges two parts of one scan for a tile. Each voxel occurs once: a hit overrides a miss, and the largest intensity
/// of its hits is used. No miss is weak yet. Both parts and the result are in Morton order and contain each brick once.
pub(crate) fn merge_bricks(a: Vec<BrickUpdate>, b: Vec<BrickUpdate>) -> Vec<BrickUpdate> {
    let mut all = Vec::with_capacity(a.len() + b.len());
    let (mut a, mut b) = (a.into_iter().peekable(), b.into_iter().peekable());
    while let (Some(first), Some(second)) = (a.peek(), b.peek()) {
        let order = first.brick.cmp(&second.brick);
        let first = if order.is_le() { a.next() } else { None };
        let second = if order.is_ge() { b.next() } else { None };
        all.extend(match (first, second) {
            (Some(first), Some(second)) => Some(merge_brick(&first, &second)),
            (first, second) => first.or(second),
        });
    }
    all.extend(a.chain(b));
    all
}

fn merge_brick(a: &BrickUpdate, b: &BrickUpdate) -> BrickUpdate {
    let hits: BrickMask = std::array::from_fn(|word| a.hits[word] | b.hits[word]);
    let misses = std::array::from_fn(|word| (a.misses[word] | b.misses[word]) & !hits[word]);
    let has_intensities = !(a.intensities.is_empty() && b.intensities.is_empty());
    let of = |brick: &BrickUpdate| places(brick.hits).zip(brick.intensities.to_vec()).collect::<Vec<_>>();
    let (mut of_a, mut of_b) = (of(a).into_iter().peekable(), of(b).into_iter().peekable());
    let largest = |place: usize| {
        let a = of_a.next_if(|&(at, _)| at == place).map(|(_, intensity)| intensity);
        let b = of_b.next_if(|&(at, _)| at == place).map(|(_, intensity)| intensity);
        a.into_iter().chain(b).max_by(f32::total_cmp).unwrap_or_default()
    };
    let intensities = if has_intensities { places(hits).map(largest).collect() } else { Box::default() };
    BrickUpdate { brick: a.brick, hits, misses, weak: [0; 8], intensities }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::BrickCode;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    /// A miss (`None`) or the intensity of a hit for each voxel.
    type Naive = BTreeMap<(u64, usize), Option<f32>>;

    fn naive(parts: &[&[BrickUpdate]]) -> Naive {
        let mut voxels = Naive::new();
        for brick in parts.iter().copied().flatten() {
            let misses = places(brick.misses).map(|place| (place, None));
            let hits = places(brick.hits).zip(brick.intensities.iter().copied().map(Some));
            for (place, said) in misses.chain(hits) {
                let known = voxels.entry((brick.brick.0, place)).or_insert(said);
                if said.map_or(f32::MIN, |i| i) > known.map_or(f32::MIN, |i| i) {
                    *known = said;
                }
            }
        }
        voxels
    }

    fn part() -> impl Strategy<Value = Vec<BrickUpdate>> {
        let brick = (0..6_u64, any::<[u64; 8]>(), any::<[u64; 8]>(), 0..1000_u32);
        prop::collection::vec(brick, 0..5).prop_map(|bricks| {
            let bricks: BTreeMap<u64, _> =
                bricks.into_iter().map(|(code, h, p, i)| (code, (h, p, i))).collect();
            let brick = |(code, (h, p, i)): (u64, ([u64; 8], [u64; 8], u32))| {
                let hits: BrickMask =
                    std::array::from_fn(|word| h[word] & h[(word + 1) % 8] & p[(word + 3) % 8]);
                let misses = std::array::from_fn(|word| p[word] & !hits[word]);
                let intensities = places(hits).map(|place| ((place as u32 * 7 + i) % 50) as f32).collect();
                BrickUpdate { brick: BrickCode(code), hits, misses, weak: [0; 8], intensities }
            };
            bricks.into_iter().map(brick).collect()
        })
    }

    proptest! {
        #[test]
        fn merged_parts_equal_the_whole_scan(a in part(), b in part()) {
            let expected = naive(&[&a, &b]);
            let united = merge_bricks(a, b);
            prop_assert!(united.is_sorted_by(|a, b| a.brick < b.brick));
            prop_assert_eq!(naive(&[&united]), expected);
        }
    }
}
