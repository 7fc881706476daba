use super::Result;
use super::options::WriteOptions;
use super::row::{VoxelRow, VoxelSink, VoxelsHead};
use super::stream_out::StreamOut;
use std::io::Write;

/// Writer of binary little-endian PLY: x y z as double, probability float, log_odds double, observation_count int.
pub(super) struct PlySink<'a> {
    out: StreamOut<'a>,
}

impl<'a> PlySink<'a> {
    pub(super) fn new(head: &VoxelsHead, out: Box<dyn Write + 'a>, options: &WriteOptions) -> Result<Self> {
        let (VoxelsHead { voxels, resolution_m, .. }, [x, y, z]) = (head, options.origin_m);
        let origin = match options.origin_m {
            [0.0, 0.0, 0.0] => String::new(),
            _ => format!("comment origin {x} {y} {z} m: to be added to x y z\n"),
        };
        let text = format!(
            "ply\nformat binary_little_endian 1.0\ncomment occupied voxels, edge {resolution_m} m\n{origin}\
             element vertex {voxels}\nproperty double x\nproperty double y\nproperty double z\nproperty float \
             probability\nproperty double log_odds\nproperty int observation_count\nend_header\n"
        );
        let mut out = StreamOut::new(&options.final_path, out);
        out.write(text.as_bytes())?;
        Ok(Self { out })
    }
}

impl VoxelSink for PlySink<'_> {
    fn put(&mut self, voxel: &VoxelRow) -> Result<()> {
        let mut record = [0; 40];
        record[..24].copy_from_slice(voxel.center_m.map(f64::to_le_bytes).as_flattened());
        record[24..28].copy_from_slice(&(voxel.probability as f32).to_le_bytes());
        record[28..36].copy_from_slice(&voxel.log_odds.to_le_bytes());
        record[36..].copy_from_slice(&voxel.observation_count.to_le_bytes());
        self.out.write(&record)
    }

    fn finish(self: Box<Self>) -> Result<()> {
        self.out.finish()
    }
}
