use super::nav2::quoted;
use super::options::WriteOptions;
use super::out_file::OutFile;
use super::row::{VoxelRow, VoxelSink, VoxelsHead};
use super::sort::{ExternalSort, key, of_key, part};
use super::{Error, Result};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

const RECORD_BYTES: usize = 24;
const METADATA: &str = "pointcloud_map_metadata.yaml";

/// Writer of an Autoware point cloud map folder: PCD files for squares of the ground, and a metadata file that lists
/// them. Only one file is open at a time.
pub(super) struct AutowareSink {
    folder: PathBuf,
    cell_m: f64,
    origin_m: [f64; 3],
    resolution_m: f64,
    points: ExternalSort<RECORD_BYTES>,
    /// Number of points of each square, for the headers of the files.
    counts: BTreeMap<[i32; 2], u64>,
}

impl AutowareSink {
    pub(super) fn create(head: &VoxelsHead, folder: &Path, options: &WriteOptions) -> Result<Self> {
        let cell_m = options.cell_m;
        if !(cell_m >= 1.0 && cell_m.fract() == 0.0 && cell_m <= 1e6) {
            let reason = format!(
                "{cell_m} m is invalid: the edge of squares must be a whole number of metres, at \
                                  least 1"
            );
            return Err(Error::argument("cell", reason));
        }
        if options.origin_m.iter().any(|origin| !origin.is_finite()) {
            return Err(Error::argument("origin", format!("{:?} is not a point", options.origin_m)));
        }
        fs::create_dir_all(folder).map_err(|error| Error::io(folder, "create", error))?;
        let mut files = fs::read_dir(folder).map_err(|error| Error::io(folder, "read", error))?;
        if files.next().is_some() {
            let reason = "the folder is not empty, and its files would be loaded too: use an empty folder";
            return Err(Error::argument(folder.display().to_string(), reason));
        }
        Ok(Self {
            folder: folder.to_owned(),
            cell_m,
            origin_m: options.origin_m,
            resolution_m: head.resolution_m,
            points: ExternalSort::new(&options.scratch_folder),
            counts: BTreeMap::new(),
        })
    }

    /// Returns the coordinate of a square's lower corner, used in its file name.
    fn corner(&self, cell: i32) -> i64 {
        i64::from(cell) * self.cell_m as i64
    }

    fn name(&self, [x, y]: [i32; 2]) -> String {
        format!("{}_{}.pcd", self.corner(x), self.corner(y))
    }

    fn metadata(&self) -> String {
        let [x, y, z] = self.origin_m;
        let mut text = format!(
            "# Coordinates are those of the map less [{x:?}, {y:?}, {z:?}] m.\nx_resolution: {:?}\ny_resolution: {:?}\n",
            self.cell_m, self.cell_m
        );
        for &cell in self.counts.keys() {
            let [x, y] = cell.map(|k| self.corner(k));
            text.push_str(&format!("{}: [{x}, {y}]\n", quoted(&self.name(cell))));
        }
        text
    }
}

impl VoxelSink for AutowareSink {
    fn put(&mut self, voxel: &VoxelRow) -> Result<()> {
        let place = voxel.center_m.map(|coordinate| coordinate as f32);
        let is_far = |k: usize| {
            let error_m = (f64::from(place[k]) - voxel.center_m[k]).abs();
            error_m.is_nan() || error_m > self.resolution_m / 8.0
        };
        if (0..3).any(is_far) {
            let reason = format!(
                "single precision is too coarse for voxels of {} m at {:?} m: set `origin` to a point near the map",
                self.resolution_m, voxel.center_m
            );
            return Err(Error::argument("origin", reason));
        }
        // Uses the rounded coordinates, so that no point is outside of its file's square.
        let cell = [0, 1].map(|k: usize| (f64::from(place[k]) / self.cell_m).floor() as i32);
        *self.counts.entry(cell).or_default() += 1;
        let mut record = [0; RECORD_BYTES];
        record[..8].copy_from_slice(cell.map(key).as_flattened());
        let [x, y, z] = place;
        let numbers = [x, y, z, voxel.probability as f32].map(f32::to_le_bytes);
        record[8..].copy_from_slice(numbers.as_flattened());
        self.points.push(record)
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        let points = std::mem::replace(&mut self.points, ExternalSort::new(&self.folder));
        let mut sorted = points.into_sorted()?;
        let mut open: Option<([i32; 2], OutFile)> = None;
        while let Some(record) = sorted.next()? {
            let cell = [0, 4].map(|at| of_key(part(&record, at)));
            let file = match &mut open {
                Some((of, file)) if *of == cell => file,
                _ => {
                    if let Some((_, file)) = open.take() {
                        file.finish()?;
                    }
                    let mut file = OutFile::create(&self.folder.join(self.name(cell)))?;
                    file.write(pcd_head(self.counts.get(&cell).copied().unwrap_or(0)).as_bytes())?;
                    &mut open.insert((cell, file)).1
                }
            };
            file.write(&part::<16>(&record, 8))?;
        }
        if let Some((_, file)) = open {
            file.finish()?;
        }
        let mut metadata = OutFile::create(&self.folder.join(METADATA))?;
        metadata.write(self.metadata().as_bytes())?;
        metadata.finish()
    }
}

fn pcd_head(points: u64) -> String {
    format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\n\
         COUNT 1 1 1 1\nWIDTH {points}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA binary\n"
    )
}

#[cfg(test)]
mod tests {
    use super::super::testing::{head_of, row};
    use super::*;

    #[test]
    fn squares_have_separate_files() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cloud");
        let rows = [row([0, 0, 0], 0.9), row([-1, 39, 0], 0.8), row([40, 0, 0], 0.9), row([1, 1, 1], 0.7)];
        let options = WriteOptions::for_path(&path);
        let mut sink = Box::new(AutowareSink::create(&head_of(&rows), &path, &options).unwrap());
        rows.iter().for_each(|row| sink.put(row).unwrap());
        sink.finish().unwrap();
        let text = fs::read_to_string(path.join(METADATA)).unwrap();
        let lines: Vec<&str> = text.lines().skip(1).collect();
        let files = ["\"-20_0.pcd\": [-20, 0]", "\"0_0.pcd\": [0, 0]", "\"20_0.pcd\": [20, 0]"];
        assert_eq!(lines, [["x_resolution: 20.0", "y_resolution: 20.0"].as_slice(), &files].concat());
        let bytes = fs::read(path.join("0_0.pcd")).unwrap();
        let body = &bytes[pcd_head(2).len()..];
        assert_eq!(body.len(), 32);
        let xs: Vec<f32> =
            body.chunks(16).map(|at| f32::from_le_bytes(at[..4].try_into().unwrap())).collect();
        assert!(xs.contains(&0.25) && xs.contains(&0.75), "{xs:?}");
        assert!(AutowareSink::create(&head_of(&rows), &path, &options).is_err(), "the folder is not empty");
    }

    #[test]
    fn too_coarse_single_precision_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let mut voxel = row([0; 3], 0.9);
        voxel.center_m = [500_123.4, 40_182_321.7, 57.3];
        let mut options = WriteOptions::for_path(&folder.path().join("cloud"));
        let mut sink = AutowareSink::create(&head_of(&[]), &folder.path().join("a"), &options).unwrap();
        assert!(sink.put(&voxel).unwrap_err().to_string().contains("origin"));
        options.origin_m = [500_000.0, 40_182_000.0, 0.0];
        let mut sink = AutowareSink::create(&head_of(&[]), &folder.path().join("b"), &options).unwrap();
        voxel.center_m = std::array::from_fn(|k| voxel.center_m[k] - options.origin_m[k]);
        sink.put(&voxel).unwrap();
    }
}
