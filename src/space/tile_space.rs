use super::{TileBox, TileIndex};
use rustc_hash::FxHashSet;

/// Compact index of the space with tiles: a box around all tiles of a map, and aligned cubes of 16, 256, .. tiles along
/// an edge that may contain one. A ray passes a cube without tiles in one step, so its cost depends on the number of
/// tiles near it, not on the distance between them.
///
/// Tiles are added and never removed. A level with too many cubes is disabled, which limits the memory to 200 kB. In
/// large maps this concerns the fine levels. If tens of thousands of tiles are more than 40 km apart, coarse levels are
/// disabled too, and the limit is 10 MB.
#[derive(Clone, Debug, Default)]
pub struct TileSpace {
    bounds: Option<TileBox>,
    /// From fine to coarse. If a cube is in a level, the larger cube around it is in the next level, or the next level
    /// is disabled.
    levels: [Level; SHIFTS.len()],
}

/// Edges of the cubes of each level, in tiles, as powers of two.
const SHIFTS: [u32; 7] = [4, 8, 12, 16, 20, 24, 28];

/// Maximum number of cubes per level. Coarse levels have a higher maximum: maps of one region have few such cubes, and
/// disabling the level for scattered tiles would cost each ray thousands of steps.
const MAX_CUBES: [usize; SHIFTS.len()] = [1 << 11, 1 << 11, 1 << 16, 1 << 16, 1 << 16, 1 << 16, 1 << 16];

#[derive(Clone, Debug, Default)]
struct Level {
    /// Cubes that may contain a tile.
    cubes: FxHashSet<[i32; 3]>,
    /// Whether the level was disabled; then each cube may contain a tile.
    is_disabled: bool,
}

impl TileSpace {
    /// Adds a tile.
    pub fn insert(&mut self, tile: TileIndex) {
        let own = TileBox::new(tile, tile);
        self.bounds = Some(self.bounds.map_or(own, |bounds| bounds.union(own)));
        for ((level, shift), max_cubes) in self.levels.iter_mut().zip(SHIFTS).zip(MAX_CUBES) {
            if level.is_disabled {
                continue;
            }
            if !level.cubes.insert(cube_of(tile, shift)) {
                // A cube in this level implies its cubes in all coarser levels, so nothing is to be added there.
                return;
            }
            if level.cubes.len() > max_cubes {
                *level = Level { cubes: FxHashSet::default(), is_disabled: true };
            }
        }
    }

    /// The smallest box around all tiles; `None` if there are none.
    pub fn bounds(&self) -> Option<TileBox> {
        self.bounds
    }

    /// Returns a large box around a tile that contains no tile; `None` if none is known.
    pub fn empty_around(&self, tile: TileIndex) -> Option<TileBox> {
        self.levels.iter().zip(SHIFTS).rev().find_map(|(level, shift)| {
            let cube = cube_of(tile, shift);
            let is_empty = !level.is_disabled && !level.cubes.contains(&cube);
            let first = cube.map(|k| k << shift);
            is_empty.then(|| TileBox::new(first.into(), first.map(|k| k + ((1 << shift) - 1)).into()))
        })
    }
}

fn cube_of(tile: TileIndex, shift: u32) -> [i32; 3] {
    tile.to_array().map(|k| k >> shift)
}

impl Extend<TileIndex> for TileSpace {
    fn extend<I: IntoIterator<Item = TileIndex>>(&mut self, tiles: I) {
        tiles.into_iter().for_each(|tile| self.insert(tile));
    }
}

impl FromIterator<TileIndex> for TileSpace {
    fn from_iter<I: IntoIterator<Item = TileIndex>>(tiles: I) -> Self {
        let mut space = Self::default();
        space.extend(tiles);
        space
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Tiles close to each other, and anywhere.
    fn any_tile() -> impl Strategy<Value = TileIndex> {
        let ends = prop_oneof![Just(i32::MIN), Just(i32::MAX), any::<i32>()];
        prop::array::uniform3(prop_oneof![4 => -40..40_i32, 1 => -100_000..100_000_i32, 1 => ends])
            .prop_map(TileIndex::from)
    }

    proptest! {
        #[test]
        fn no_tile_is_in_an_empty_box(
            tiles in prop::collection::vec(any_tile(), 0..40),
            queried in prop::collection::vec(any_tile(), 1..40),
        ) {
            let space: TileSpace = tiles.iter().copied().collect();
            prop_assert_eq!(space.bounds(), TileBox::of(tiles.iter().copied()));
            for tile in queried {
                let Some(empty) = space.empty_around(tile) else {
                    let cube = cube_of(tile, SHIFTS[0]);
                    prop_assert!(tiles.iter().any(|&tile| cube_of(tile, SHIFTS[0]) == cube));
                    continue;
                };
                prop_assert!(empty.contains(tile));
                prop_assert!(!tiles.iter().any(|&tile| empty.contains(tile)));
            }
        }
    }

    #[test]
    fn a_level_with_too_many_cubes_is_disabled() {
        let mut space: TileSpace =
            (0..3000).map(|k| TileIndex::new(16 * (k % 60), 16 * (k / 60), 0)).collect();
        space.insert(TileIndex::new(1 << 30, 0, 0));
        assert_eq!(space.empty_around(TileIndex::new(0, 0, 20)), None);
        let empty = space.empty_around(TileIndex::new(0, 0, 300)).unwrap();
        assert_eq!(empty, TileBox::new(TileIndex::new(0, 0, 256), TileIndex::new(255, 255, 511)));
        assert!(space.empty_around(TileIndex::new(1 << 29, 0, 0)).unwrap().count() > 1 << 60);
        assert!(space.levels.iter().zip(MAX_CUBES).all(|(level, max_cubes)| level.cubes.len() <= max_cubes));
    }
}
