use super::part_log::MakeScratch;
use crate::error::{Error, Result};
use crate::scan::PackedUpdates;
use crate::space::TileIndex;
use std::io;
use std::path::Path;

/// Callback that receives a part of the updates of a scan, by tile, and stores it outside of memory.
pub(crate) type Spill<'a> = dyn FnMut(Vec<(TileIndex, PackedUpdates)>) -> Result<()> + 'a;

/// Destination of the updates of a scan that exceed the memory limit.
pub(crate) struct Overflow<'a> {
    /// Maximum bytes of updates in memory; beyond that, they are spilled.
    pub(crate) max_bytes: usize,
    /// Maximum number of tiles that a scan may change: each takes memory during the insertion.
    pub(crate) max_tiles: usize,
    /// Folder of the map, for errors.
    pub(crate) folder: &'a Path,
    /// Creates a temporary file for the parts of the scan.
    pub(crate) make_scratch: &'a MakeScratch<'a>,
    /// Receives complete updates.
    pub(crate) spill: &'a mut Spill<'a>,
}

impl Overflow<'_> {
    pub(crate) fn too_many_tiles(&self) -> Error {
        let reason = format!(
            "too few for a scan that changes more than {} tiles; use more memory or larger tiles",
            self.max_tiles
        );
        Error::argument("memory", reason)
    }

    pub(crate) fn error(&self, error: io::Error) -> Error {
        Error::io(self.folder, "store updates of a scan in a temporary file in", error)
    }
}
