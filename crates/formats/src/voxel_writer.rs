use std::io::{self, Write};
use std::path::Path;
use voxtile::space::Point;

/// An exported voxel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelRecord {
    /// Its center in metres, relative to the file's origin.
    pub center_m: Point,
    /// Probability of being occupied.
    pub probability: f64,
    /// Exact log-odds.
    pub log_odds: f64,
    /// Number of updates.
    pub observation_count: i32,
}

/// Format of an exported file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VoxelFormat {
    /// PLY, binary little-endian: x y z as double, probability float, log_odds double, observation_count int.
    Ply,
    /// PCD 0.7, binary, as PCL reads it: x y z as F4, intensity F4 holds the probability, observation_count I4. A
    /// file's origin is its `VIEWPOINT`.
    Pcd,
    /// Text with a header line; every number reads back to the same bits.
    Csv,
}

impl VoxelFormat {
    /// The format of a path's extension.
    pub fn of_path(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "ply" => Some(Self::Ply),
            "pcd" => Some(Self::Pcd),
            "csv" => Some(Self::Csv),
            _ => None,
        }
    }
}

/// Header of an exported file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelFile {
    /// Its format.
    pub format: VoxelFormat,
    /// Number of voxels, for the headers of PLY and PCD.
    pub voxels: u64,
    /// Edge of a voxel in metres.
    pub resolution_m: f64,
    /// The file's origin in the world, in metres, to be added to its coordinates. CSV does not store it.
    pub origin_m: Point,
}

impl VoxelFile {
    /// Up to so many voxels from a PCD file's origin along an axis, `f32` resolves centers to an eighth of a voxel;
    /// [`VoxelWriter::write`] refuses more distant ones.
    pub const PCD_REACH_VOXELS: i32 = 1 << 21;
}

/// Streams voxels into a file.
#[derive(Debug)]
pub struct VoxelWriter<W> {
    file: VoxelFile,
    out: W,
    written: u64,
}

impl<W: Write> VoxelWriter<W> {
    /// Starts a file.
    ///
    /// # Errors
    ///
    /// Errors of `out`.
    pub fn new(file: VoxelFile, mut out: W) -> io::Result<Self> {
        let VoxelFile { format, voxels, resolution_m, origin_m: [x, y, z] } = file;
        let is_moved = file.origin_m != [0.0; 3];
        match format {
            VoxelFormat::Ply => {
                writeln!(out, "ply\nformat binary_little_endian 1.0")?;
                writeln!(out, "comment occupied voxels, edge {resolution_m} m")?;
                if is_moved {
                    writeln!(out, "comment origin {x} {y} {z} m: to be added to x y z")?;
                }
                write!(
                    out,
                    "element vertex {voxels}\nproperty double x\nproperty double y\nproperty double z\nproperty float \
                     probability\nproperty double log_odds\nproperty int observation_count\nend_header\n"
                )?;
            }
            VoxelFormat::Pcd => {
                writeln!(out, "# .PCD v0.7 - occupied voxels, edge {resolution_m} m")?;
                if is_moved {
                    writeln!(out, "# origin {x} {y} {z} m: to be added to x y z, as VIEWPOINT says, too")?;
                }
                write!(
                    out,
                    "VERSION 0.7\nFIELDS x y z intensity observation_count\nSIZE 4 4 4 4 4\nTYPE F F F F I\nCOUNT 1 1 1 1 \
                     1\nWIDTH {voxels}\nHEIGHT 1\nVIEWPOINT {x} {y} {z} 1 0 0 0\nPOINTS {voxels}\nDATA binary\n"
                )?;
            }
            VoxelFormat::Csv => writeln!(out, "x,y,z,probability,log_odds,observation_count")?,
        }
        Ok(Self { file, out, written: 0 })
    }

    /// Appends a voxel.
    ///
    /// # Errors
    ///
    /// Errors of `out`; in a PCD file, a center too far from the file's origin for `f32`.
    pub fn write(&mut self, voxel: &VoxelRecord) -> io::Result<()> {
        self.written += 1;
        let VoxelRecord { center_m, probability, log_odds, observation_count } = *voxel;
        let [x, y, z] = center_m;
        // One write for a record: each is a call, and a look at whether to stop.
        match self.file.format {
            VoxelFormat::Csv => {
                writeln!(self.out, "{x},{y},{z},{probability},{log_odds},{observation_count}")
            }
            VoxelFormat::Ply => {
                let mut record = [0; 40];
                for (bytes, coordinate) in record.as_chunks_mut().0.iter_mut().zip(center_m) {
                    *bytes = coordinate.to_le_bytes();
                }
                record[24..28].copy_from_slice(&(probability as f32).to_le_bytes());
                record[28..36].copy_from_slice(&log_odds.to_le_bytes());
                record[36..].copy_from_slice(&observation_count.to_le_bytes());
                self.out.write_all(&record)
            }
            VoxelFormat::Pcd => {
                let reach_m = f64::from(VoxelFile::PCD_REACH_VOXELS) * self.file.resolution_m;
                let is_far = |coordinate: &&f64| coordinate.is_nan() || coordinate.abs() > reach_m;
                if let Some(far) = center_m.iter().find(is_far) {
                    let reason = format!(
                        "{far} m from the file's origin a float32 of PCD does not tell voxels of {} m apart",
                        self.file.resolution_m
                    );
                    return Err(io::Error::new(io::ErrorKind::InvalidInput, reason));
                }
                let mut record = [0; 20];
                for (bytes, value) in record.as_chunks_mut().0.iter_mut().zip([x, y, z, probability]) {
                    *bytes = (value as f32).to_le_bytes();
                }
                record[16..].copy_from_slice(&observation_count.to_le_bytes());
                self.out.write_all(&record)
            }
        }
    }

    /// Ends the file.
    ///
    /// # Errors
    ///
    /// A number of voxels that differs from the header's.
    pub fn finish(mut self) -> io::Result<W> {
        if self.written != self.file.voxels {
            let reason = format!("{} voxels announced, {} written", self.file.voxels, self.written);
            return Err(io::Error::other(reason));
        }
        self.out.flush()?;
        Ok(self.out)
    }
}
