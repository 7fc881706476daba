use crate::space::TileIndex;

/// The tiles from one corner to another, both included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TileSpan {
    min: [i32; 3],
    max: [i32; 3],
}

/// Most tiles that are looked at for what lies ahead; a scan that spans more is no vehicle's.
const MOST_AHEAD: usize = 4096;

impl TileSpan {
    /// The smallest span of these tiles; `None` if there are none.
    pub(super) fn of(tiles: impl Iterator<Item = TileIndex>) -> Option<Self> {
        let spans = tiles.map(|tile| Self { min: tile.to_array(), max: tile.to_array() });
        spans.reduce(|a, b| Self {
            min: std::array::from_fn(|k| a.min[k].min(b.min[k])),
            max: std::array::from_fn(|k| a.max[k].max(b.max[k])),
        })
    }

    /// The tiles that this span would gain by going one tile further in the direction in which it came here.
    pub(super) fn ahead(self, before: &Self) -> Vec<TileIndex> {
        let doubled_center = |span: &Self, k: usize| i64::from(span.min[k]) + i64::from(span.max[k]);
        let mut ahead = Vec::new();
        for axis in 0..3 {
            let gained = match doubled_center(&self, axis).cmp(&doubled_center(before, axis)) {
                std::cmp::Ordering::Greater => self.max[axis].checked_add(1),
                std::cmp::Ordering::Less => self.min[axis].checked_sub(1),
                std::cmp::Ordering::Equal => None,
            };
            let Some(gained) = gained else { continue };
            let (mut min, mut max) = (self.min, self.max);
            (min[axis], max[axis]) = (gained, gained);
            for x in min[0]..=max[0] {
                for y in min[1]..=max[1] {
                    for z in min[2]..=max[2] {
                        if ahead.len() == MOST_AHEAD {
                            return ahead;
                        }
                        ahead.push(TileIndex::new(x, y, z));
                    }
                }
            }
        }
        ahead
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_ahead_is_one_tile_further_in_the_direction_of_travel() {
        let span = |min, max| TileSpan { min, max };
        let before = span([0, 0, 0], [2, 1, 0]);
        assert_eq!(before.ahead(&before), []);
        let east = span([1, 0, 0], [3, 1, 0]);
        assert_eq!(east.ahead(&before), [TileIndex::new(4, 0, 0), TileIndex::new(4, 1, 0)]);
        let down = span([0, 0, -1], [2, 0, 0]);
        let below: Vec<_> = (0..3).map(|x| TileIndex::new(x, 0, -2)).collect();
        // Down, and south as well: the center moved by half a tile.
        let south = (0..3).flat_map(|x| [-1, 0].map(|z| TileIndex::new(x, -1, z)));
        assert_eq!(down.ahead(&before), south.chain(below).collect::<Vec<_>>());
    }

    #[test]
    fn the_end_of_the_world_and_the_widest_scan_are_no_trouble() {
        let far = TileSpan { min: [i32::MAX - 1; 3], max: [i32::MAX; 3] };
        let near = TileSpan { min: [0; 3], max: [1; 3] };
        assert_eq!(far.ahead(&near), []);
        let wide = TileSpan { min: [-500; 3], max: [500; 3] };
        assert_eq!(wide.ahead(&near).len(), MOST_AHEAD);
    }
}
