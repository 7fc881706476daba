use crate::space::{Grid, Point, TileIndex};
use rustc_hash::FxHashMap;
use std::ops::Range;

/// Numbers of points, grouped by the tiles that hold them. Points that no tile holds are left out.
pub(super) struct PointsByTile {
    /// Tiles in order, and where their points are in `numbers`.
    tiles: Vec<(TileIndex, Range<usize>)>,
    numbers: Vec<u32>,
}

/// What points get that no tile holds.
const NOWHERE: u32 = u32::MAX;

impl PointsByTile {
    /// Most points that can be grouped.
    pub(super) const MOST_POINTS: usize = 1 << 22;

    /// Groups at most [`PointsByTile::MOST_POINTS`] by counting: comparing tiles of points with each other takes longer
    /// than to look at all of them.
    pub(super) fn of(grid: &Grid, points: &[Point]) -> Self {
        debug_assert!(points.len() <= Self::MOST_POINTS);
        let mut places: FxHashMap<TileIndex, u32> = FxHashMap::default();
        let mut counts: Vec<(TileIndex, u32)> = Vec::new();
        // Neighbours in a list are mostly neighbours in space.
        let mut last: Option<(TileIndex, u32)> = None;
        let place_of_point = |&point: &Point| {
            let Some(tile) = grid.tile_of(point) else { return NOWHERE };
            let place = match last {
                Some((last, place)) if last == tile => place,
                _ => *places.entry(tile).or_insert_with(|| {
                    counts.push((tile, 0));
                    counts.len() as u32 - 1
                }),
            };
            last = Some((tile, place));
            counts[place as usize].1 += 1;
            place
        };
        let place_of: Vec<u32> = points.iter().map(place_of_point).collect();
        let mut order: Vec<usize> = (0..counts.len()).collect();
        order.sort_unstable_by_key(|&place| counts[place].0);
        let (mut begin, mut next) = (0, vec![0; counts.len()]);
        let tiles = order.into_iter().map(|place| {
            let (tile, count) = counts[place];
            next[place] = begin;
            let range = begin..begin + count as usize;
            begin = range.end;
            (tile, range)
        });
        let tiles: Vec<_> = tiles.collect();
        let mut numbers = vec![0; begin];
        for (number, place) in place_of.into_iter().enumerate().filter(|(_, place)| *place != NOWHERE) {
            let at = &mut next[place as usize];
            numbers[*at] = number as u32;
            *at += 1;
        }
        Self { tiles, numbers }
    }

    /// Tiles in order with the numbers of points in them, at most so many at a time.
    pub(super) fn chunks(&self, most_points: usize) -> impl Iterator<Item = (TileIndex, &[u32])> {
        let of_tile = move |(tile, range): &(TileIndex, Range<usize>)| {
            let tile = *tile;
            self.numbers[range.clone()].chunks(most_points).map(move |numbers| (tile, numbers))
        };
        self.tiles.iter().flat_map(of_tile)
    }
}
