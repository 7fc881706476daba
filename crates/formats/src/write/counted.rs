use super::row::{VoxelRow, VoxelSink};
use super::{Error, Result};
use std::path::PathBuf;

/// Sink that checks that all voxels are finite and as many as announced, because some formats store their number first.
pub(super) struct Counted<'a> {
    inner: Box<dyn VoxelSink + 'a>,
    final_path: PathBuf,
    announced: u64,
    seen: u64,
}

impl<'a> Counted<'a> {
    pub(super) fn new(inner: Box<dyn VoxelSink + 'a>, final_path: PathBuf, announced: u64) -> Self {
        Self { inner, final_path, announced, seen: 0 }
    }

    fn wrong(&self, reason: String) -> Error {
        Error::argument(self.final_path.display().to_string(), reason)
    }
}

impl VoxelSink for Counted<'_> {
    fn put(&mut self, voxel: &VoxelRow) -> Result<()> {
        if self.seen == self.announced {
            let reason = format!("there are more than the {} announced voxels", self.announced);
            return Err(self.wrong(reason));
        }
        let numbers = voxel.center_m.iter().chain([&voxel.probability, &voxel.log_odds]);
        if let Some(number) = numbers.copied().find(|number| !number.is_finite()) {
            return Err(self.wrong(format!("voxel {:?} has the invalid value {number}", voxel.index)));
        }
        self.inner.put(voxel)?;
        self.seen += 1;
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<()> {
        if self.seen < self.announced {
            let reason =
                format!("only {} of the {} announced voxels were written", self.seen, self.announced);
            return Err(self.wrong(reason));
        }
        self.inner.finish()
    }
}
