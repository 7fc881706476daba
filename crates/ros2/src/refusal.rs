use crate::counters::Counters;
use voxtile::Error;

/// Why the map has not taken a cloud, or a flush: it is as before then, and the next one may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// A pose that is none, or beyond all tiles.
    Malformed,
    /// The map has outgrown its memory.
    Memory,
    /// A tile that belongs to it is damaged on disk.
    Damaged,
    /// The disk has no room, or something else against it.
    Disk,
}

impl Refusal {
    /// `None` for an error after which the map is none to go on with.
    pub fn of(error: &Error) -> Option<Self> {
        Some(match error {
            Error::InvalidArgument { argument, .. } if argument == "memory" => Self::Memory,
            Error::InvalidArgument { .. } | Error::Grid(_) => Self::Malformed,
            Error::Damaged { tile: Some(_), .. } => Self::Damaged,
            Error::Io { .. } => Self::Disk,
            _ => return None,
        })
    }

    /// Counts a cloud that was refused.
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
