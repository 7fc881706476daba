use super::{Aabb, Grid, TileIndex};
use serde::{Deserialize, Serialize};

/// Box of tiles between two corners, both included.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Corners")]
pub struct TileBox {
    min: [i32; 3],
    max: [i32; 3],
}

/// Serialized form of the corners.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Corners {
    min: [i32; 3],
    max: [i32; 3],
}

impl TryFrom<Corners> for TileBox {
    type Error = &'static str;

    fn try_from(Corners { min, max }: Corners) -> Result<Self, Self::Error> {
        let is_ordered = (0..3).all(|k| min[k] <= max[k]);
        is_ordered
            .then_some(Self { min, max })
            .ok_or("the lower corner of a box of tiles is above the upper one")
    }
}

/// Maximum number of tiles that [`TileBox::ahead`] returns. The scans of a vehicle never span more.
const MAX_AHEAD: usize = 4096;

impl TileBox {
    /// Creates the box from one corner to another, both included; `min` must not exceed `max` along any axis.
    pub fn new(min: TileIndex, max: TileIndex) -> Self {
        Self { min: min.to_array(), max: max.to_array() }
    }

    /// The tiles whose center is in a box; `None` if there are none. If several boxes partition space, their boxes of
    /// tiles partition the tiles. Bounds of the box may be infinite.
    pub fn with_centers_in(region: &Aabb, grid: &Grid) -> Option<Self> {
        // The conversion to `i32` saturates. No voxel is in the last tiles of the range, so this is correct.
        let first_from = |bound_m: f64| (bound_m / grid.tile_size_m() - 0.5).ceil() as i32;
        let (min, end) = (region.min.map(first_from), region.max.map(first_from));
        let is_empty = (0..3).any(|k| min[k] >= end[k]);
        (!is_empty).then(|| Self { min, max: end.map(|end| end - 1) })
    }

    /// The smallest box around these tiles; `None` if there are none.
    pub fn of(tiles: impl Iterator<Item = TileIndex>) -> Option<Self> {
        tiles.map(|tile| Self::new(tile, tile)).reduce(Self::union)
    }

    /// Returns the box enlarged by a number of tiles on all sides, within the range of indices.
    #[must_use]
    pub fn grown(self, tiles: i32) -> Self {
        Self {
            min: self.min.map(|k| k.saturating_sub(tiles)),
            max: self.max.map(|k| k.saturating_add(tiles)),
        }
    }

    /// Lowest tile.
    pub fn min(self) -> TileIndex {
        self.min.into()
    }

    /// Highest tile.
    pub fn max(self) -> TileIndex {
        self.max.into()
    }

    /// A column of all tiles of a square: `tiles` along x and y, from `column` times as many on. Saturates at the limits
    /// of indices.
    pub fn of_column(column: [i32; 2], tiles: u32) -> Self {
        let first = |k: usize, shift: i64| {
            let edge = i64::from(tiles.max(1));
            let at = i64::from(column[k]) * edge + shift * (edge - 1);
            at.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
        };
        Self { min: [first(0, 0), first(1, 0), i32::MIN], max: [first(0, 1), first(1, 1), i32::MAX] }
    }

    /// The smallest box around both.
    pub fn union(self, other: Self) -> Self {
        Self {
            min: std::array::from_fn(|k| self.min[k].min(other.min[k])),
            max: std::array::from_fn(|k| self.max[k].max(other.max[k])),
        }
    }

    /// The tiles that are in both; `None` if there are none.
    pub fn intersection(self, other: Self) -> Option<Self> {
        let (min, max): ([i32; 3], [i32; 3]) = (
            std::array::from_fn(|k| self.min[k].max(other.min[k])),
            std::array::from_fn(|k| self.max[k].min(other.max[k])),
        );
        (0..3).all(|k| min[k] <= max[k]).then_some(Self { min, max })
    }

    /// Returns whether the box contains a tile.
    pub fn contains(self, tile: TileIndex) -> bool {
        let tile = tile.to_array();
        (0..3).all(|k| self.min[k] <= tile[k] && tile[k] <= self.max[k])
    }

    /// Number of tiles; saturates at `u64::MAX`.
    pub fn count(self) -> u64 {
        let edge = |k: usize| u64::from(self.max[k].abs_diff(self.min[k])) + 1;
        edge(0).saturating_mul(edge(1)).saturating_mul(edge(2))
    }

    /// The tiles, in order.
    pub fn tiles(self) -> impl Iterator<Item = TileIndex> {
        let Self { min, max } = self;
        let of_column = move |x, y| (min[2]..=max[2]).map(move |z| TileIndex::new(x, y, z));
        (min[0]..=max[0]).flat_map(move |x| (min[1]..=max[1]).flat_map(move |y| of_column(x, y)))
    }

    /// The tiles that this box would gain if it moved by one more tile in its direction of travel, where `before` is
    /// the previous box.
    pub fn ahead(self, before: &Self) -> Vec<TileIndex> {
        let doubled_center = |tiles: &Self, k: usize| i64::from(tiles.min[k]) + i64::from(tiles.max[k]);
        let mut ahead = Vec::new();
        for axis in 0..3 {
            let gained = match doubled_center(&self, axis).cmp(&doubled_center(before, axis)) {
                std::cmp::Ordering::Greater => self.max[axis].checked_add(1),
                std::cmp::Ordering::Less => self.min[axis].checked_sub(1),
                std::cmp::Ordering::Equal => None,
            };
            let Some(gained) = gained else { continue };
            let mut slab = self;
            (slab.min[axis], slab.max[axis]) = (gained, gained);
            ahead.extend(slab.tiles().take(MAX_AHEAD - ahead.len()));
        }
        ahead
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_ahead_are_one_tile_further_in_the_direction_of_travel() {
        let tiles = |min, max| TileBox { min, max };
        let before = tiles([0, 0, 0], [2, 1, 0]);
        assert_eq!(before.ahead(&before), []);
        let east = tiles([1, 0, 0], [3, 1, 0]);
        assert_eq!(east.ahead(&before), [TileIndex::new(4, 0, 0), TileIndex::new(4, 1, 0)]);
        let down = tiles([0, 0, -1], [2, 0, 0]);
        let below: Vec<_> = (0..3).map(|x| TileIndex::new(x, 0, -2)).collect();
        // Down, and also south: the center moved by half a tile.
        let south = (0..3).flat_map(|x| [-1, 0].map(|z| TileIndex::new(x, -1, z)));
        assert_eq!(down.ahead(&before), south.chain(below).collect::<Vec<_>>());
    }

    #[test]
    fn boxes_that_partition_space_give_tile_boxes_that_partition_it() {
        let grid = Grid::new(0.1, 10.0).unwrap();
        let of = |from: f64, to: f64| {
            let region = Aabb { min: [from, -15.0, f64::NEG_INFINITY], max: [to, 5.0, f64::INFINITY] };
            TileBox::with_centers_in(&region, &grid)
        };
        assert_eq!(of(0.0, 20.0), Some(TileBox::new([0, -2, i32::MIN].into(), [1, -1, i32::MAX - 1].into())));
        assert_eq!(of(5.1, 14.9), None);
        let cuts = [f64::NEG_INFINITY, -1e12, -30.0, -7.3, 4.999, 5.0, 5.001, 60.0, 1e12, f64::INFINITY];
        let parts: Vec<_> = cuts.windows(2).filter_map(|cut| of(cut[0], cut[1])).collect();
        for x in [i32::MIN, -4, -3, -2, -1, 0, 1, 2, 5, 6, 7, i32::MAX - 1] {
            let tile = TileIndex::new(x, -1, 0);
            assert_eq!(parts.iter().filter(|part| part.contains(tile)).count(), 1, "{x}");
        }
        assert_eq!(of(9.0, f64::NAN), None);
    }

    #[test]
    fn index_limits_and_the_widest_scan_are_handled() {
        let far = TileBox { min: [i32::MAX - 1; 3], max: [i32::MAX; 3] };
        let near = TileBox { min: [0; 3], max: [1; 3] };
        assert_eq!(far.ahead(&near), []);
        let wide = TileBox { min: [-500; 3], max: [500; 3] };
        assert_eq!(wide.ahead(&near).len(), MAX_AHEAD);
    }

    #[test]
    fn boxes_unite_intersect_and_list_tiles_in_order() {
        let tiles = |min: [i32; 3], max: [i32; 3]| TileBox::new(min.into(), max.into());
        let (a, b) = (tiles([-1, 0, 0], [1, 2, 0]), tiles([1, 1, -3], [4, 1, 5]));
        assert_eq!(a.union(b), tiles([-1, 0, -3], [4, 2, 5]));
        assert_eq!(a.intersection(b), Some(tiles([1, 1, 0], [1, 1, 0])));
        assert_eq!(a.intersection(tiles([2, 0, 0], [3, 0, 0])), None);
        let listed: Vec<_> = a.tiles().collect();
        assert!(listed.is_sorted() && listed.len() as u64 == a.count());
        assert!(listed.iter().all(|tile| a.contains(*tile)) && !a.contains(TileIndex::new(0, 3, 0)));
        assert_eq!(TileBox::of(listed.into_iter()), Some(a));
        assert_eq!(tiles([i32::MIN; 3], [i32::MAX; 3]).count(), u64::MAX);
    }
}
