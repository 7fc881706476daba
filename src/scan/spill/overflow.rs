use super::part_log::MakeScratch;
use crate::error::{Error, Result};
use crate::scan::PackedUpdates;
use crate::space::TileIndex;
use std::io;
use std::path::Path;

/// Takes a part of the updates of a scan, by tile, and stores it outside memory.
pub(crate) type Spill<'a> = dyn FnMut(Vec<(TileIndex, PackedUpdates)>) -> Result<()> + 'a;

/// Where the updates of a scan go that exceed the memory limit.
pub(crate) struct Overflow<'a> {
    /// Most bytes of updates in memory; whenever there are more, they are spilled.
    pub(crate) max_bytes: usize,
    /// Most tiles that a scan may touch: each takes memory while the scan is inserted.
    pub(crate) max_tiles: usize,
    /// The map's folder, for errors.
    pub(crate) folder: &'a Path,
    /// Makes a temporary file for the parts of the scan.
    pub(crate) make_scratch: &'a MakeScratch<'a>,
    /// Takes updates that are complete.
    pub(crate) spill: &'a mut Spill<'a>,
}

impl Overflow<'_> {
    pub(crate) fn too_many_tiles(&self) -> Error {
        let reason = format!(
            "too few for a scan that touches more than {} tiles; go on with more memory, or build with larger tiles",
            self.max_tiles
        );
        Error::argument("memory", reason)
    }

    pub(crate) fn error(&self, error: io::Error) -> Error {
        Error::io(self.folder, "keep the updates of a scan for a while in a temporary file in", error)
    }
}
