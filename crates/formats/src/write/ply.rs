use super::Result;
use super::options::WriteOptions;
use super::row::{RowLayers, VoxelRow, VoxelSink, VoxelsHead};
use super::stream_out::StreamOut;
use std::io::Write;
use voxtile::Layers;

/// Writer of binary little-endian PLY: x y z as double, probability float, log_odds double, observation_count int, and a
/// property or three for each layer of the map.
pub(super) struct PlySink<'a> {
    out: StreamOut<'a>,
    layers: Layers,
}

impl<'a> PlySink<'a> {
    pub(super) fn new(head: &VoxelsHead, out: Box<dyn Write + 'a>, options: &WriteOptions) -> Result<Self> {
        let (&VoxelsHead { voxels, resolution_m, layers, .. }, [x, y, z]) = (head, options.origin_m);
        let origin = match options.origin_m {
            [0.0, 0.0, 0.0] => String::new(),
            _ => format!("comment origin {x} {y} {z} m: to be added to x y z\n"),
        };
        let mut of_layers = String::new();
        for (is_there, properties) in [
            (layers.colour, "property uchar red\nproperty uchar green\nproperty uchar blue\n"),
            (layers.intensity_max.is_some(), "property float intensity\n"),
            (layers.class, "property uchar class\n"),
            (layers.time, "property double first_time\nproperty double last_time\n"),
        ] {
            of_layers += if is_there { properties } else { "" };
        }
        let text = format!(
            "ply\nformat binary_little_endian 1.0\ncomment occupied voxels, edge {resolution_m} m\n{origin}\
             element vertex {voxels}\nproperty double x\nproperty double y\nproperty double z\nproperty float \
             probability\nproperty double log_odds\nproperty int observation_count\n{of_layers}end_header\n"
        );
        let mut out = StreamOut::new(&options.final_path, out);
        out.write(text.as_bytes())?;
        Ok(Self { out, layers })
    }
}

impl VoxelSink for PlySink<'_> {
    fn put(&mut self, voxel: &VoxelRow) -> Result<()> {
        let mut record = [0; 40];
        record[..24].copy_from_slice(voxel.center_m.map(f64::to_le_bytes).as_flattened());
        record[24..28].copy_from_slice(&(voxel.probability as f32).to_le_bytes());
        record[28..36].copy_from_slice(&voxel.log_odds.to_le_bytes());
        record[36..].copy_from_slice(&voxel.observation_count.to_le_bytes());
        self.out.write(&record)?;
        let RowLayers { colour, intensity, class, .. } = voxel.layers;
        if self.layers.colour {
            self.out.write(&colour.unwrap_or_default())?;
        }
        if self.layers.intensity_max.is_some() {
            self.out.write(&(intensity.unwrap_or(f64::NAN) as f32).to_le_bytes())?;
        }
        if self.layers.class {
            self.out.write(&[class.unwrap_or_default()])?;
        }
        if self.layers.time {
            self.out.write(voxel.layers.times_s().map(f64::to_le_bytes).as_flattened())?;
        }
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<()> {
        self.out.finish()
    }
}
