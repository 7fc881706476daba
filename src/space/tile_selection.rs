use super::{TileBox, TileIndex};
use rustc_hash::FxHashSet;

/// Selection of tiles that an insertion may change; all others remain unchanged.
///
/// ```
/// use voxtile::{TileBox, TileIndex, TileSelection};
///
/// let around_origin = TileSelection::from(TileBox::new([-1, -1, 0].into(), [0, 0, 0].into()));
/// assert!(around_origin.contains(TileIndex::new(-1, 0, 0)));
/// let two: TileSelection = [TileIndex::new(0, 0, 0), TileIndex::new(7, 0, 0)].into_iter().collect();
/// assert!(!two.contains(TileIndex::new(3, 0, 0)));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TileSelection {
    /// Box around the tiles; `None` if there are none.
    bounds: Option<TileBox>,
    /// The tiles; `None` for all of the box.
    tiles: Option<FxHashSet<TileIndex>>,
}

impl TileSelection {
    /// The smallest box around the tiles; `None` if there are none.
    pub fn bounds(&self) -> Option<TileBox> {
        self.bounds
    }

    /// Returns whether all tiles of the box are selected.
    pub fn is_box(&self) -> bool {
        self.tiles.is_none()
    }

    /// Returns whether a tile is selected.
    #[inline]
    pub fn contains(&self, tile: TileIndex) -> bool {
        self.bounds.is_some_and(|bounds| bounds.contains(tile))
            && self.tiles.as_ref().is_none_or(|tiles| tiles.contains(&tile))
    }

    /// Returns the selected tiles and those that are at most `tiles` tiles away along each axis.
    #[must_use]
    pub fn grown(&self, tiles: i32) -> Self {
        match &self.tiles {
            Some(selected) => {
                selected.iter().flat_map(|&tile| TileBox::new(tile, tile).grown(tiles).tiles()).collect()
            }
            None => Self { bounds: self.bounds.map(|bounds| bounds.grown(tiles)), tiles: None },
        }
    }

    /// Returns the selected tiles that are also in a box.
    #[must_use]
    pub fn within(&self, region: TileBox) -> Self {
        match &self.tiles {
            Some(tiles) => tiles.iter().copied().filter(|tile| region.contains(*tile)).collect(),
            None => {
                let bounds = self.bounds.and_then(|bounds| bounds.intersection(region));
                Self { bounds, tiles: None }
            }
        }
    }
}

impl From<TileBox> for TileSelection {
    fn from(region: TileBox) -> Self {
        Self { bounds: Some(region), tiles: None }
    }
}

impl FromIterator<TileIndex> for TileSelection {
    fn from_iter<I: IntoIterator<Item = TileIndex>>(tiles: I) -> Self {
        let tiles: FxHashSet<TileIndex> = tiles.into_iter().collect();
        Self { bounds: TileBox::of(tiles.iter().copied()), tiles: Some(tiles) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_selection_contains_exactly_the_selected_tiles() {
        let region = TileBox::new([0, -1, 2].into(), [1, 0, 2].into());
        let listed: TileSelection = region.tiles().collect();
        let of_box = TileSelection::from(region);
        assert!(of_box.is_box() && !listed.is_box());
        assert_eq!((of_box.bounds(), listed.bounds()), (Some(region), Some(region)));
        let around = TileBox::new([-2, -3, 0].into(), [3, 2, 4].into());
        for tile in around.tiles() {
            assert_eq!(of_box.contains(tile), region.contains(tile));
            assert_eq!(listed.contains(tile), region.contains(tile));
        }
        let half = TileBox::new([1, -9, -9].into(), [9, 9, 9].into());
        for selection in [&of_box, &listed] {
            let left: Vec<_> = around.tiles().filter(|tile| selection.within(half).contains(*tile)).collect();
            assert_eq!(left, [TileIndex::new(1, -1, 2), TileIndex::new(1, 0, 2)]);
        }
        let none = TileSelection::from_iter([]);
        assert_eq!((none.bounds(), none.contains(TileIndex::new(0, 0, 0))), (None, false));
        assert_eq!(of_box.within(TileBox::new([7; 3].into(), [8; 3].into())).bounds(), None);
    }
}
