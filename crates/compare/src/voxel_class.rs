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
    /// Occupied in the later map, unknown in the earlier one and not known to be hidden in it.
    NotSeenBefore,
    /// Occupied in the earlier map, unknown in the later one and not known to be hidden in it.
    NotSeenAfter,
    /// As [`VoxelClass::Appeared`], but one of the maps has too little evidence, or the earlier one has not observed all
    /// six neighbors.
    UncertainAppeared,
    /// As [`VoxelClass::Vanished`], but one of the maps has too little evidence, or the later one has not observed all
    /// six neighbors.
    UncertainVanished,
    /// Occupied in the later map, and hidden from the sensor of the earlier one.
    HiddenBefore,
    /// Occupied in the earlier map, and hidden from the sensor of the later one.
    HiddenAfter,
}

impl VoxelClass {
    /// All classes.
    pub const ALL: [Self; 9] = [
        Self::Unchanged,
        Self::Appeared,
        Self::Vanished,
        Self::NotSeenBefore,
        Self::NotSeenAfter,
        Self::UncertainAppeared,
        Self::UncertainVanished,
        Self::HiddenBefore,
        Self::HiddenAfter,
    ];

    /// Returns whether voxels of the class are occupied in the earlier map, and not in the later one.
    pub fn is_of_earlier(self) -> bool {
        matches!(self, Self::Vanished | Self::NotSeenAfter | Self::UncertainVanished | Self::HiddenAfter)
    }

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
            Self::HiddenBefore => "hidden_before",
            Self::HiddenAfter => "hidden_after",
        }
    }
}
