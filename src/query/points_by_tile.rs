use crate::space::{Grid, Point, TileIndex};
use rustc_hash::FxHashMap;

/// At most [`PointsByTile::MAX_POINTS`] points in the order of the tiles that contain them; points without a tile are
/// last.
pub(super) struct PointsByTile {
    /// Tiles in the order of their first points, with their numbers of points.
    tiles: Vec<(TileIndex, u32)>,
    /// Number of each point; empty if the points are already in order.
    numbers: Vec<u16>,
}

impl PointsByTile {
    /// Maximum number of points that can be grouped. Their results remain in the CPU cache until they are reordered.
    pub(super) const MAX_POINTS: usize = 1 << 15;

    /// Groups points with a counting sort, which is faster than comparing their tiles.
    pub(super) fn of(grid: &Grid, points: &[Point]) -> Self {
        debug_assert!(points.len() <= Self::MAX_POINTS);
        /// Marks points without a tile.
        const NOWHERE: u16 = u16::MAX;
        let mut places: FxHashMap<TileIndex, u16> = FxHashMap::default();
        let mut tiles: Vec<(TileIndex, u32)> = Vec::new();
        // Consecutive points are mostly in the same tile.
        let mut last: Option<(TileIndex, u16)> = None;
        let (mut is_in_order, mut before) = (true, 0);
        let place_of_point = |&point: &Point| {
            let place = grid.tile_of(point).map_or(NOWHERE, |tile| {
                let place = match last {
                    Some((last, place)) if last == tile => place,
                    _ => *places.entry(tile).or_insert_with(|| {
                        tiles.push((tile, 0));
                        tiles.len() as u16 - 1
                    }),
                };
                last = Some((tile, place));
                tiles[usize::from(place)].1 += 1;
                place
            });
            is_in_order &= before <= place;
            before = place;
            place
        };
        let place_of: Vec<u16> = points.iter().map(place_of_point).collect();
        if is_in_order {
            return Self { tiles, numbers: Vec::new() };
        }
        let mut begin = 0;
        let mut next: Vec<u32> = Vec::with_capacity(tiles.len());
        for (_, count) in &tiles {
            next.push(begin);
            begin += count;
        }
        let mut numbers = vec![0; points.len()];
        for (number, place) in place_of.into_iter().enumerate() {
            let at = next.get_mut(usize::from(place)).unwrap_or(&mut begin);
            numbers[*at as usize] = number as u16;
            *at += 1;
        }
        Self { tiles, numbers }
    }

    /// Tiles in the order of their first points, with their numbers of points.
    pub(super) fn tiles(&self) -> &[(TileIndex, u32)] {
        &self.tiles
    }

    /// Number of the point at a position of the order.
    #[inline]
    pub(super) fn number_at(&self, place: usize) -> usize {
        self.numbers.get(place).map_or(place, |&number| number.into())
    }

    /// Moves results from the order of the tiles to the order of the points.
    pub(super) fn put_in_order_of_points<A: Copy>(&self, answers: &mut [A]) {
        if self.numbers.is_empty() {
            return;
        }
        let by_tile = answers.to_vec();
        for (&number, answer) in self.numbers.iter().zip(by_tile) {
            answers[usize::from(number)] = answer;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn points_of_a_tile_are_grouped(
            points in prop::collection::vec(
                prop::array::uniform3(prop_oneof![9 => -3.0..3.0, 1 => Just(f64::NAN)]), 0..300
            ),
            is_sorted in any::<bool>(),
        ) {
            let grid = Grid::new(0.1, 2.0).unwrap();
            let mut points = points;
            if is_sorted {
                points.sort_by_key(|&point| (grid.tile_of(point).is_none(), grid.tile_of(point)));
            }
            let by_tile = PointsByTile::of(&grid, &points);
            prop_assert!(!is_sorted || by_tile.numbers.is_empty());
            let mut place = 0;
            for &(tile, count) in by_tile.tiles() {
                prop_assert!(count > 0);
                for _ in 0..count {
                    prop_assert_eq!(grid.tile_of(points[by_tile.number_at(place)]), Some(tile));
                    place += 1;
                }
            }
            let mut order: Vec<usize> = (0..points.len()).map(|place| by_tile.number_at(place)).collect();
            prop_assert!(order[place..].iter().all(|&number| grid.tile_of(points[number]).is_none()));
            by_tile.put_in_order_of_points(&mut order);
            prop_assert!(order.into_iter().eq(0..points.len()));
        }
    }
}
