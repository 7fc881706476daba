use crate::counters::Counters;
use voxtile::Error;

/// Reason why the map refused a cloud or a flush failed. The map is unchanged, and the next attempt may succeed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// An invalid pose, or one beyond all tiles.
    Malformed,
    /// The map exceeds its memory limit.
    Memory,
    /// A tile is damaged on disk.
    Damaged,
    /// A disk error, such as a full disk.
    Disk,
}

impl Refusal {
    /// Returns `None` for an error after which the map can no longer be used.
    pub fn of(error: &Error) -> Option<Self> {
        Some(match error {
            Error::InvalidArgument { argument, .. } if argument == "memory" => Self::Memory,
            Error::InvalidArgument { .. } | Error::Grid(_) => Self::Malformed,
            Error::Damaged { tile: Some(_), .. } => Self::Damaged,
            Error::Io { .. } => Self::Disk,
            _ => return None,
        })
    }

    pub fn count(self, counters: &mut Counters) {
        let count = match self {
            Self::Malformed => &mut counters.malformed,
            Self::Memory => &mut counters.refused_memory,
            Self::Damaged => &mut counters.refused_damaged,
            Self::Disk => &mut counters.refused_disk,
        };
        *count += 1;
    }
}
