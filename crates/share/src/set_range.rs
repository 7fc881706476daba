use voxtile::space::TileIndex;

/// A position in the order of a set: by tile (x, then y, then z), then by the Morton code of the voxel's key.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct SetPosition {
    /// Tile of the voxel.
    pub tile: TileIndex,
    /// Morton code of the key, 48 bits.
    pub code: u64,
}

/// Range of positions, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SetRange {
    /// The first position.
    pub first: SetPosition,
    /// The last position, not before the first.
    pub last: SetPosition,
}

/// The largest Morton code of a key.
pub(super) const LAST_CODE: u64 = (1 << 48) - 1;

impl SetPosition {
    /// Returns the next position.
    pub(super) fn next(self) -> Self {
        if self.code < LAST_CODE {
            return Self { code: self.code + 1, ..self };
        }
        let TileIndex { x, y, z } = self.tile;
        let tile = match (y, z) {
            (i32::MAX, i32::MAX) => TileIndex::new(x.saturating_add(1), i32::MIN, i32::MIN),
            (_, i32::MAX) => TileIndex::new(x, y + 1, i32::MIN),
            _ => TileIndex::new(x, y, z + 1),
        };
        Self { tile, code: 0 }
    }

    /// Returns the previous position, which must exist.
    pub(super) fn before(self) -> Self {
        if self.code > 0 {
            return Self { code: self.code - 1, ..self };
        }
        let TileIndex { x, y, z } = self.tile;
        let tile = match (y, z) {
            (i32::MIN, i32::MIN) => TileIndex::new(x.saturating_sub(1), i32::MAX, i32::MAX),
            (_, i32::MIN) => TileIndex::new(x, y - 1, i32::MAX),
            _ => TileIndex::new(x, y, z - 1),
        };
        Self { tile, code: LAST_CODE }
    }
}

impl SetRange {
    /// All positions.
    pub const ALL: Self = Self {
        first: SetPosition { tile: TileIndex::new(i32::MIN, i32::MIN, i32::MIN), code: 0 },
        last: SetPosition { tile: TileIndex::new(i32::MAX, i32::MAX, i32::MAX), code: LAST_CODE },
    };

    /// Returns the range of the tiles between `first` and `last`, both included.
    pub fn of_tiles(first: TileIndex, last: TileIndex) -> Self {
        Self {
            first: SetPosition { tile: first, code: 0 },
            last: SetPosition { tile: last, code: LAST_CODE },
        }
    }

    /// Returns whether a position is in the range.
    pub fn contains(&self, position: SetPosition) -> bool {
        self.first <= position && position <= self.last
    }

    /// Returns whether the codes are valid and the last position is not before the first.
    pub fn is_valid(&self) -> bool {
        self.first <= self.last && self.first.code <= LAST_CODE && self.last.code <= LAST_CODE
    }
}
