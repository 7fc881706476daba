use super::Result;
use super::mcap_file::{McapFile, Topic};
use super::options::WriteOptions;
use super::point_cloud2::{FieldType, SCHEMA, encode};
use super::row::{RowLayers, VoxelRow, VoxelSink, VoxelsHead};
use std::path::Path;
use voxtile::Layers;

/// Maximum number of points of a cloud.
const MAX_POINTS: usize = 1 << 20;
const TOPIC: &str = "/voxels";

/// Writer of a ROS 2 recording (MCAP). Each cloud contains whole tiles, unless a tile exceeds the limit.
///
/// Coordinates are in single precision, which all viewers support, unless that is too coarse at the map's location.
pub(super) struct McapSink {
    file: McapFile,
    frame: String,
    stamp_ns: u64,
    fields: Vec<(&'static str, FieldType)>,
    layers: Layers,
    /// Points of the next cloud. `tile_start` is the offset of its last tile.
    points: Vec<u8>,
    max_points: usize,
    tile: Option<[i32; 3]>,
    tile_start: usize,
    clouds: u32,
}

impl McapSink {
    pub(super) fn create(head: &VoxelsHead, path: &Path, options: &WriteOptions) -> Result<Self> {
        let topic = Topic { name: TOPIC, type_name: "sensor_msgs/msg/PointCloud2", definition: SCHEMA };
        let file = McapFile::create(path, &topic)?;
        let fits = head.bounds_m.as_flattened().iter().all(|bound| {
            // Upper bound on the distance between neighbouring single precision numbers at this location.
            bound.abs() * f64::from(f32::EPSILON) <= head.resolution_m / 16.0
        });
        let of = if fits { FieldType::Float32 } else { FieldType::Float64 };
        let mut fields = vec![
            ("x", of),
            ("y", of),
            ("z", of),
            ("intensity", FieldType::Float32),
            ("log_odds", FieldType::Float64),
            ("count", FieldType::Int32),
        ];
        let layers = head.layers;
        for (is_written, of_layer) in [
            // The bits of a float, as viewers expect.
            (layers.colour, [("rgb", FieldType::Float32)].as_slice()),
            (layers.class, &[("label", FieldType::UInt32)]),
            (layers.time, &[("first_time", FieldType::Float64), ("last_time", FieldType::Float64)]),
        ] {
            fields.extend(of_layer.iter().filter(|_| is_written));
        }
        Ok(Self {
            file,
            frame: options.frame.clone(),
            stamp_ns: options.stamp_ns,
            fields,
            layers,
            points: Vec::new(),
            max_points: MAX_POINTS,
            tile: None,
            tile_start: 0,
            clouds: 0,
        })
    }

    fn step(&self) -> usize {
        self.fields.iter().map(|(_, of)| of.bytes() as usize).sum()
    }

    /// Writes the points up to an offset as a cloud.
    fn write_cloud(&mut self, end: usize) -> Result<()> {
        let end = end.min(self.points.len());
        if end == 0 {
            return Ok(());
        }
        let rest = self.points.split_off(end);
        let data = encode(self.stamp_ns, &self.frame, &self.fields, &self.points);
        // The recording times differ by a nanosecond, so that players keep the order.
        let log_ns = self.stamp_ns.saturating_add(u64::from(self.clouds));
        self.file.write(log_ns, self.stamp_ns, &data)?;
        self.clouds = self.clouds.saturating_add(1);
        self.points = rest;
        self.tile_start = self.tile_start.saturating_sub(end);
        Ok(())
    }
}

impl VoxelSink for McapSink {
    fn put(&mut self, voxel: &VoxelRow) -> Result<()> {
        if self.tile.replace(voxel.tile) != Some(voxel.tile) {
            self.tile_start = self.points.len();
        }
        if self.points.len() >= self.max_points.saturating_mul(self.step()) {
            // End the cloud before its last tile, unless that is the only one.
            let end = if self.tile_start == 0 { self.points.len() } else { self.tile_start };
            self.write_cloud(end)?;
        }
        let is_short = self.fields.first().is_some_and(|(_, of)| *of == FieldType::Float32);
        for place in voxel.center_m {
            match is_short {
                true => self.points.extend((place as f32).to_le_bytes()),
                false => self.points.extend(place.to_le_bytes()),
            }
        }
        let RowLayers { colour, class, .. } = voxel.layers;
        let intensity = voxel.layers.intensity_or_probability(&self.layers, voxel.probability);
        self.points.extend((intensity as f32).to_le_bytes());
        self.points.extend(voxel.log_odds.to_le_bytes());
        self.points.extend(voxel.observation_count.to_le_bytes());
        if self.layers.colour {
            let [red, green, blue] = colour.unwrap_or_default();
            self.points.extend([blue, green, red, 0]);
        }
        if self.layers.class {
            self.points.extend(u32::from(class.unwrap_or_default()).to_le_bytes());
        }
        if self.layers.time {
            self.points.extend(voxel.layers.times_s().map(f64::to_le_bytes).as_flattened());
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        self.write_cloud(self.points.len())?;
        self.file.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{head_of, row};
    use super::*;

    #[test]
    fn clouds_contain_whole_tiles_if_they_fit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mcap");
        // Tiles of 16 voxels along x: 16 points each, and one with 64 points, which is split.
        let mut rows: Vec<_> = (0..48).map(|x| row([x, 0, 0], 0.9)).collect();
        rows.extend((0..4).flat_map(|y| (48..64).map(move |x| row([x, y, 0], 0.9))));
        let mut sink = McapSink::create(&head_of(&rows), &path, &WriteOptions::for_path(&path)).unwrap();
        sink.max_points = 40;
        rows.iter().for_each(|row| sink.put(row).unwrap());
        Box::new(sink).finish().unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let messages: Vec<_> =
            ::mcap::MessageStream::new(&bytes).unwrap().map(|message| message.unwrap()).collect();
        // The number of points follows the CDR header, stamp, frame and height.
        let width = |data: &[u8]| u32::from_le_bytes(data[24..28].try_into().unwrap());
        let widths: Vec<u32> = messages.iter().map(|message| width(&message.data)).collect();
        assert_eq!(widths, [32, 16, 40, 24]);
        assert!(messages.is_sorted_by_key(|message| message.log_time));

        // The index finds every chunk, and its checksum is correct.
        let summary = ::mcap::Summary::read(&bytes).unwrap().unwrap();
        let stats = summary.stats.as_ref().unwrap();
        assert_eq!((stats.message_count, stats.chunk_count, stats.channel_count), (4, 4, 1));
        let channel = summary.channels.values().next().unwrap();
        assert_eq!((channel.topic.as_str(), channel.message_encoding.as_str()), ("/voxels", "cdr"));
        assert_eq!(channel.schema.as_ref().unwrap().name, "sensor_msgs/msg/PointCloud2");
        for (chunk, message) in summary.chunk_indexes.iter().zip(&messages) {
            let found: Vec<_> =
                summary.stream_chunk(&bytes, chunk).unwrap().map(|found| found.unwrap()).collect();
            assert_eq!(found.len(), 1);
            assert_eq!(found[0].data, message.data);
            let index = summary.read_message_indexes(&bytes, chunk).unwrap();
            let entry = index.values().next().unwrap()[0];
            assert_eq!(summary.seek_message(&bytes, chunk, &entry).unwrap().data, message.data);
        }
    }
}
