use super::column_grid::{ColumnGrid, nothing_to_draw};
use super::height_range::HeightRange;
use super::options::WriteOptions;
use super::out_file::OutFile;
use super::row::{VoxelRow, VoxelSink, VoxelsHead};
use super::{Error, Result};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Number of values for heights; 0 means a column without an occupied voxel.
const VALUES: i64 = u16::MAX as i64;

/// Writer of the heights of the topmost occupied voxels as a 16-bit PNG, with a world file and a JSON file for the
/// scale.
pub(super) struct HeightmapSink {
    out: OutFile,
    head: VoxelsHead,
    crs: Option<String>,
    heights: HeightRange,
    world_file: PathBuf,
    scale_file: PathBuf,
    grid: Option<ColumnGrid<u16>>,
}

impl HeightmapSink {
    pub(super) fn create(head: &VoxelsHead, path: &Path, options: &WriteOptions) -> Result<Self> {
        let (world_file, scale_file) = (options.companion("pgw", "png")?, options.companion("json", "png")?);
        let heights = HeightRange::of(options)?;
        Ok(Self {
            out: OutFile::create(path)?,
            head: head.clone(),
            crs: options.crs.clone(),
            heights,
            world_file,
            scale_file,
            grid: None,
        })
    }
}

/// Number of voxel layers per value: one, unless there are more layers than values.
fn layers_per_value(grid: &ColumnGrid<u16>) -> i64 {
    (grid.layers().max(1) - 1) / VALUES + 1
}

impl VoxelSink for HeightmapSink {
    fn put(&mut self, voxel: &VoxelRow) -> Result<()> {
        let grid = match &mut self.grid {
            Some(grid) => grid,
            none => none.insert(ColumnGrid::new(&self.head, voxel, 0)?),
        };
        let share = layers_per_value(grid);
        let (column, layer) = grid.column(voxel)?;
        if voxel.log_odds >= self.head.occupied_log_odds && self.heights.meets(voxel, self.head.resolution_m)
        {
            let value = u16::try_from(1 + layer / share).unwrap_or(u16::MAX);
            *column = value.max(*column);
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        let grid = self.grid.take().ok_or_else(nothing_to_draw)?;
        let (resolution_m, share) = (self.head.resolution_m, layers_per_value(&grid));
        let [x, y, z] = grid.corner_m();
        let scale_m = resolution_m * share as f64;
        // Value 1 is the height of the middle of the lowest layers.
        let offset_m = z - 0.5 * scale_m;
        let [width, height] = grid.size();
        let path = self.out.path().to_owned();
        let refused = |error: png::EncodingError| match error {
            png::EncodingError::IoError(error) => Error::io(&path, "write", error),
            other => Error::argument(path.display().to_string(), other.to_string()),
        };
        let too_wide = |_| Error::argument("heightmap", "a side is too long for an image: choose a region");
        let (columns, rows) =
            (u32::try_from(width).map_err(too_wide)?, u32::try_from(height).map_err(too_wide)?);
        let mut encoder = png::Encoder::new(&mut self.out, columns, rows);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Sixteen);
        for (name, value) in [("scale_m", scale_m), ("offset_m", offset_m), ("no_data", 0.0)] {
            encoder.add_text_chunk(name.to_owned(), value.to_string()).map_err(refused)?;
        }
        let mut writer = encoder.write_header().map_err(refused)?;
        let mut stream = writer.stream_writer().map_err(refused)?;
        let mut line = Vec::new();
        for row in grid.cells().chunks(width.max(1)) {
            line.clear();
            line.extend(row.iter().flat_map(|value| value.to_be_bytes()));
            stream.write_all(&line).map_err(|error| Error::io(&path, "write", error))?;
        }
        stream.finish().map_err(refused)?;
        writer.finish().map_err(refused)?;

        // World files refer to the centre of the upper left cell.
        let top = y + (height as f64 - 0.5) * resolution_m;
        let world = format!("{resolution_m}\n0\n0\n-{resolution_m}\n{}\n{top}\n", x + 0.5 * resolution_m);
        write_text(&self.world_file, &world)?;
        let scale = serde_json::json!({
            "height_m": "offset_m + scale_m * value: the middle of the topmost occupied voxel",
            "scale_m": scale_m,
            "offset_m": offset_m,
            "no_data": 0,
            "resolution_m": resolution_m,
            "lower_left_corner_m": [x, y],
            "crs": self.crs,
        });
        write_text(&self.scale_file, &format!("{scale:#}\n"))?;
        self.out.finish()
    }
}

fn write_text(path: &Path, text: &str) -> Result<()> {
    let mut file = OutFile::create(path)?;
    file.write(text.as_bytes())?;
    file.finish()
}

#[cfg(test)]
mod tests {
    use super::super::testing::{head_of, row};
    use super::*;

    /// Returns the values of a heightmap of five voxels, row by row.
    fn values(options: &WriteOptions) -> Vec<u16> {
        let path = &options.final_path;
        let rows = [row([0, 0, -3], 0.9), row([0, 0, 5], 0.9), row([0, 0, 6], 0.1), row([1, 2, 0], 0.8)];
        let mut sink = Box::new(HeightmapSink::create(&head_of(&rows), path, options).unwrap());
        for row in &rows {
            sink.put(row).unwrap();
        }
        sink.finish().unwrap();
        let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        pixels.chunks(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]])).collect()
    }

    #[test]
    fn only_requested_heights_are_used() {
        let folder = tempfile::tempdir().unwrap();
        let all = WriteOptions::for_path(&folder.path().join("heights.png"));
        // The voxel at 2.75 m is excluded, so the one below it is the topmost.
        assert_eq!(values(&WriteOptions { z_max_m: Some(2.5), ..all.clone() }), [0, 4, 0, 0, 1, 0]);
        assert_eq!(values(&WriteOptions { z_min_m: Some(0.5), ..all }), [0, 0, 0, 0, 9, 0]);
    }

    #[test]
    fn topmost_occupied_voxel_is_used() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("heights.png");
        assert_eq!(values(&WriteOptions::for_path(&path)), [0, 4, 0, 0, 9, 0]);
        let text = std::fs::read_to_string(folder.path().join("heights.json")).unwrap();
        let scale: serde_json::Value = serde_json::from_str(&text).unwrap();
        let height =
            |value: f64| scale["offset_m"].as_f64().unwrap() + scale["scale_m"].as_f64().unwrap() * value;
        assert_eq!([height(4.0), height(9.0)], [0.25, 2.75]);
        let world = std::fs::read_to_string(folder.path().join("heights.pgw")).unwrap();
        assert_eq!(world, "0.5\n0\n0\n-0.5\n0.25\n1.25\n");
    }
}
