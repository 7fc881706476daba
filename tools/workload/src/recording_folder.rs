use anyhow::{Context, Result, ensure};
use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use voxtile_simulation::LabelledScan;

/// Folder of a recording with labels, in the layout of other labelled data sets.
///
/// | file | content |
/// |---|---|
/// | `scans/000000.pcd` ... | binary PCD: x, y, z (f32, metres, sensor frame), intensity (f32, 0 to 255), label (u8) |
/// | `poses_kitti.txt` | a line per scan: sensor to world, 3 x 4 numbers in metres, row by row |
///
/// Labels are the numbers of [`voxtile_simulation::Label`].
#[derive(Debug)]
pub struct RecordingFolder {
    path: PathBuf,
    count: usize,
    poses: String,
}

impl RecordingFolder {
    /// Creates the folder.
    ///
    /// # Errors
    ///
    /// Fails if the folder contains files or cannot be created.
    pub fn create(path: &Path) -> Result<Self> {
        let scans = path.join("scans");
        fs::create_dir_all(path).with_context(|| format!("{}: cannot create the folder", path.display()))?;
        let mut entries =
            path.read_dir().with_context(|| format!("{}: cannot list the folder", path.display()))?;
        ensure!(entries.next().is_none(), "{}: the folder is not empty", path.display());
        fs::create_dir(&scans).with_context(|| format!("{}: cannot create the folder", scans.display()))?;
        Ok(Self { path: path.to_owned(), count: 0, poses: String::new() })
    }

    /// Writes the next scan.
    ///
    /// # Errors
    ///
    /// Fails if the file cannot be written.
    pub fn write(&mut self, labelled: &LabelledScan) -> Result<()> {
        let path = self.path.join("scans").join(format!("{:06}.pcd", self.count));
        write_pcd(&path, labelled).with_context(|| format!("{}: cannot write the scan", path.display()))?;
        self.count += 1;
        let [x, y, z] = labelled.world_from_sensor.position_m();
        let rotation = labelled.world_from_sensor.isometry().rotation.to_rotation_matrix();
        for (row, offset) in [x, y, z].into_iter().enumerate() {
            let [a, b, c] = std::array::from_fn(|column| rotation[(row, column)]);
            let end = if row == 2 { '\n' } else { ' ' };
            // Writing to a string succeeds.
            let _ = write!(self.poses, "{a} {b} {c} {offset}{end}");
        }
        Ok(())
    }

    /// Writes the poses.
    ///
    /// # Errors
    ///
    /// Fails if the file cannot be written.
    pub fn finish(self) -> Result<()> {
        let path = self.path.join("poses_kitti.txt");
        fs::write(&path, self.poses).with_context(|| format!("{}: cannot write the poses", path.display()))
    }
}

fn write_pcd(path: &Path, labelled: &LabelledScan) -> std::io::Result<()> {
    let count = labelled.scan.points.len();
    let mut file = BufWriter::new(File::create_new(path)?);
    write!(
        file,
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z intensity label\nSIZE 4 4 4 4 1\n\
         TYPE F F F F U\nCOUNT 1 1 1 1 1\nWIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\n\
         DATA binary\n"
    )?;
    let position = labelled.world_from_sensor.position_m();
    let rotation = labelled.world_from_sensor.isometry().rotation.to_rotation_matrix();
    let intensities = labelled.scan.intensities.iter().flatten().copied().chain(std::iter::repeat(0.0));
    for ((point, intensity), label) in labelled.scan.points.iter().zip(intensities).zip(&labelled.labels) {
        let d: [f64; 3] = std::array::from_fn(|k| point[k] - position[k]);
        // The transposed rotation is the inverse.
        for axis in 0..3 {
            let x = rotation[(0, axis)] * d[0] + rotation[(1, axis)] * d[1] + rotation[(2, axis)] * d[2];
            file.write_all(&(x as f32).to_le_bytes())?;
        }
        file.write_all(&intensity.to_le_bytes())?;
        file.write_all(&[label.number()])?;
    }
    file.flush()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SensorName;

    #[test]
    fn a_written_recording_has_the_points_and_labels_of_its_scans() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("recording");
        let scans: Vec<LabelledScan> = SensorName::Camera.scans(3, 5.0).step_by(20).take(2).collect();
        let mut recording = RecordingFolder::create(&path).unwrap();
        scans.iter().for_each(|scan| recording.write(scan).unwrap());
        recording.finish().unwrap();
        assert!(RecordingFolder::create(&path).unwrap_err().to_string().contains("not empty"));
        let poses = fs::read_to_string(path.join("poses_kitti.txt")).unwrap();
        assert_eq!(poses.lines().count(), 2);
        for ((number, scan), line) in scans.iter().enumerate().zip(poses.lines()) {
            let numbers: Vec<f64> = line.split(' ').map(|x| x.parse().unwrap()).collect();
            let (rows, _) = numbers.as_chunks::<4>();
            let to_world = voxtile::Pose::from_matrix(rows).unwrap().to_world();
            let bytes = fs::read(path.join(format!("scans/{number:06}.pcd"))).unwrap();
            let body = &bytes[bytes.len() - 17 * scan.scan.points.len()..];
            let records = body.as_chunks::<17>().0;
            for ((record, point), label) in records.iter().zip(&scan.scan.points).zip(&scan.labels) {
                let number = |k: usize| f32::from_le_bytes(std::array::from_fn(|i| record[4 * k + i]));
                let read = to_world([0, 1, 2].map(|k| f64::from(number(k))));
                assert!((0..3).all(|k| (read[k] - point[k]).abs() < 1e-4), "{read:?} {point:?}");
                assert_eq!(record[16], label.number());
            }
        }
    }
}
