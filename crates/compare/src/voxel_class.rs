use serde::Serialize;

/// Class of an occupied voxel of one of two maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum VoxelClass {
    /// Occupied in both maps, within the tolerance.
    Unchanged,
    /// Occupied in the later map, seen free in the earlier one.
    Appeared,
    /// Occupied in the earlier map, seen free in the later one.
    Vanished,
    /// Occupied in the later map, unknown in the earlier one.
    NotSeenBefore,
    /// Occupied in the earlier map, unknown in the later one.
    NotSeenAfter,
    /// As [`VoxelClass::Appeared`], but one of the maps has too little evidence, or the earlier one has not observed all
    /// six neighbors.
    UncertainAppeared,
    /// As [`VoxelClass::Vanished`], but one of the maps has too little evidence, or the later one has not observed all
    /// six neighbors.
    UncertainVanished,
}

impl VoxelClass {
    /// All classes.
    pub const ALL: [Self; 7] = [
        Self::Unchanged,
        Self::Appeared,
        Self::Vanished,
        Self::NotSeenBefore,
        Self::NotSeenAfter,
        Self::UncertainAppeared,
        Self::UncertainVanished,
    ];

    /// Name in files and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Unchanged => "unchanged",
            Self::Appeared => "appeared",
            Self::Vanished => "vanished",
            Self::NotSeenBefore => "not_seen_before",
            Self::NotSeenAfter => "not_seen_after",
            Self::UncertainAppeared => "uncertain_appeared",
            Self::UncertainVanished => "uncertain_vanished",
        }
    }
}
