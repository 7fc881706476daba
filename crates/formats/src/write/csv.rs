use super::Result;
use super::options::WriteOptions;
use super::row::{VoxelRow, VoxelSink, VoxelsHead};
use super::stream_out::StreamOut;
use std::io::Write;

/// Writer of CSV with a header line. Every number can be parsed back to the same bits.
pub(super) struct CsvSink<'a> {
    out: StreamOut<'a>,
}

impl<'a> CsvSink<'a> {
    pub(super) fn new(_: &VoxelsHead, out: Box<dyn Write + 'a>, options: &WriteOptions) -> Result<Self> {
        let mut out = StreamOut::new(&options.final_path, out);
        out.write(b"x,y,z,probability,log_odds,observation_count\n")?;
        Ok(Self { out })
    }
}

impl VoxelSink for CsvSink<'_> {
    fn put(&mut self, voxel: &VoxelRow) -> Result<()> {
        let VoxelRow { center_m: [x, y, z], probability, log_odds, observation_count, .. } = voxel;
        writeln!(self.out, "{x},{y},{z},{probability},{log_odds},{observation_count}")
    }

    fn finish(self: Box<Self>) -> Result<()> {
        self.out.finish()
    }
}
