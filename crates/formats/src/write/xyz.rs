use super::Result;
use super::options::WriteOptions;
use super::out_file::OutFile;
use super::row::{VoxelRow, VoxelSink, VoxelsHead};
use std::path::Path;

/// Writer of text with one line per voxel: `x y z probability`, with the fewest digits that restore the same numbers.
pub(super) struct XyzSink {
    out: OutFile,
}

impl XyzSink {
    pub(super) fn create(_: &VoxelsHead, path: &Path, _: &WriteOptions) -> Result<Self> {
        Ok(Self { out: OutFile::create(path)? })
    }
}

impl VoxelSink for XyzSink {
    fn put(&mut self, voxel: &VoxelRow) -> Result<()> {
        let [x, y, z] = voxel.center_m;
        self.out.write(format!("{x} {y} {z} {}\n", voxel.probability).as_bytes())
    }

    fn finish(self: Box<Self>) -> Result<()> {
        self.out.finish()
    }
}
