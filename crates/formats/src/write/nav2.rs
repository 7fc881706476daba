use super::Result;
use super::flat_map::{Column, FlatMap};
use super::height_range::HeightRange;
use super::options::WriteOptions;
use super::out_file::OutFile;
use super::row::{VoxelRow, VoxelSink, VoxelsHead};
use std::path::{Path, PathBuf};

/// Writer of a 2D occupancy grid for nav2's map server: an image and a `.yaml` file that refers to it.
pub(super) struct Nav2Sink {
    out: OutFile,
    resolution_m: f64,
    yaml: PathBuf,
    image: String,
    map: FlatMap,
}

impl Nav2Sink {
    pub(super) fn create(head: &VoxelsHead, path: &Path, options: &WriteOptions) -> Result<Self> {
        let map = FlatMap::new(head, HeightRange::of(options)?);
        let (yaml, image) = (options.companion("yaml", "pgm")?, options.final_name()?.to_owned());
        Ok(Self { out: OutFile::create(path)?, resolution_m: head.resolution_m, yaml, image, map })
    }
}

impl VoxelSink for Nav2Sink {
    fn put(&mut self, voxel: &VoxelRow) -> Result<()> {
        self.map.put(voxel)
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        let [width, height] = self.map.size()?;
        self.out.write(format!("P5\n{width} {height}\n255\n").as_bytes())?;
        let mut greys = Vec::new();
        for row in self.map.columns()?.chunks(width.max(1)) {
            greys.clear();
            greys.extend(row.iter().copied().map(grey_of));
            self.out.write(&greys)?;
        }
        let [x, y, _] = self.map.corner_m()?;
        // nav2 compares with `<` and `>`. 0.196 is below the 0.19608 of an unknown cell; with the 0.25 of nav2's own
        // saver, unknown cells would be loaded as free.
        let yaml = format!(
            "image: {}\nmode: trinary\nresolution: {}\norigin: [{x:?}, {y:?}, 0.0]\nnegate: 0\noccupied_thresh: 0.65\n\
             free_thresh: 0.196\n",
            quoted(&self.image),
            self.resolution_m
        );
        let mut companion = OutFile::create(&self.yaml)?;
        companion.write(yaml.as_bytes())?;
        companion.finish()?;
        self.out.finish()
    }
}

fn grey_of(column: Column) -> u8 {
    match column {
        // `p = (255 - 205) / 255 = 0.196`.
        Column::Unknown => 205,
        Column::Free => 254,
        Column::Occupied => 0,
    }
}

/// Quotes a text for YAML. JSON string literals are valid YAML.
pub(super) fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

#[cfg(test)]
mod tests {
    use super::super::column_grid::ColumnGrid;
    use super::super::testing::{head_of, row};
    use super::*;

    /// Returns the states as loaded by nav2's rule, row by row from the top: `#` occupied, `.` free, `?` unknown.
    fn map(rows: &[VoxelRow], z_m: [Option<f64>; 2]) -> Vec<String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.pgm");
        let options = WriteOptions { z_min_m: z_m[0], z_max_m: z_m[1], ..WriteOptions::for_path(&path) };
        let mut sink = Box::new(Nav2Sink::create(&head_of(rows), &path, &options).unwrap());
        for row in rows {
            sink.put(row).unwrap();
        }
        sink.finish().unwrap();
        let yaml = std::fs::read_to_string(folder.path().join("map.yaml")).unwrap();
        let number = |key: &str| -> f64 {
            let line = yaml.lines().find_map(|line| line.strip_prefix(key)).unwrap();
            line.trim().parse().unwrap()
        };
        assert!(yaml.contains("image: \"map.pgm\"\n"));
        assert!(yaml.contains("origin: [-0.5, 1.0, 0.0]\n"), "{yaml}");
        let (free, occupied) = (number("free_thresh:"), number("occupied_thresh:"));
        let picture = std::fs::read(path).unwrap();
        let body = picture.strip_prefix(b"P5\n3 2\n255\n").unwrap();
        let state = |&grey: &u8| match f64::from(255 - grey) / 255.0 {
            p if p > occupied => '#',
            p if p < free => '.',
            _ => '?',
        };
        body.chunks(3).map(|row| row.iter().map(state).collect()).collect()
    }

    fn rows() -> Vec<VoxelRow> {
        // Voxels of 0.5 m: a column with free below occupied, a free one, and one that is only occupied above 2 m.
        vec![
            row([-1, 2, 0], 0.2),
            row([-1, 2, 1], 0.9),
            row([-1, 2, 2], 0.2),
            row([1, 2, 0], 0.1),
            row([1, 3, 0], 0.1),
            row([1, 3, 4], 0.5),
        ]
    }

    #[test]
    fn all_three_states_are_loaded_correctly() {
        assert_eq!(map(&rows(), [None, None]), ["??#", "#?."]);
    }

    #[test]
    fn heights_limit_the_voxels() {
        // A voxel that begins at 2 m is above the limit, and one that ends there is below.
        assert_eq!(map(&rows(), [None, Some(2.0)]), ["??.", "#?."]);
        assert_eq!(map(&rows(), [Some(0.5), None]), ["??#", "#??"]);
        assert_eq!(map(&rows(), [Some(1.0), Some(1.25)]), ["???", ".??"]);
    }

    #[test]
    fn maps_that_are_too_large_are_refused() {
        let rows = rows();
        let mut head = head_of(&rows);
        head.bounds_m[1] = [1e6, 1e6, 2.0];
        let error = ColumnGrid::new(&head, &rows[0], 0_u8).unwrap_err().to_string();
        assert!(error.contains("choose a region"), "{error}");
        head.bounds_m[1] = [f64::INFINITY; 3];
        assert!(ColumnGrid::new(&head, &rows[0], 0_u8).is_err());
    }
}
