use crate::space::Point;
use std::io::{self, Write};
use std::path::Path;

/// A voxel as it is exported.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelRecord {
    /// Its center in metres, world frame.
    pub center_m: Point,
    /// Probability of being occupied.
    pub probability: f64,
    /// Exact log-odds.
    pub log_odds: f64,
    /// Number of updates.
    pub observation_count: i32,
}

/// Which file voxels are written to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VoxelFormat {
    /// PLY, binary little-endian: x y z as double, probability float, log_odds double, observation_count int.
    Ply,
    /// PCD 0.7, binary: x y z as F8, so that large coordinates stay exact; intensity F4 holds the probability.
    Pcd,
    /// Text with a line of names; every number reads back to the same bits.
    Csv,
}

impl VoxelFormat {
    /// The format that a path's extension names.
    pub fn of_path(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "ply" => Some(Self::Ply),
            "pcd" => Some(Self::Pcd),
            "csv" => Some(Self::Csv),
            _ => None,
        }
    }
}

/// Streams voxels into a file. Their number must be known before: the headers of PLY and PCD name it.
#[derive(Debug)]
pub struct VoxelWriter<W> {
    format: VoxelFormat,
    out: W,
    announced: u64,
    written: u64,
}

impl<W: Write> VoxelWriter<W> {
    /// Begins a file of `count` voxels of `resolution_m` metres.
    pub fn new(format: VoxelFormat, count: u64, resolution_m: f64, mut out: W) -> io::Result<Self> {
        match format {
            VoxelFormat::Ply => write!(
                out,
                "ply\nformat binary_little_endian 1.0\ncomment occupied voxels, edge {resolution_m} m\nelement vertex \
                 {count}\nproperty double x\nproperty double y\nproperty double z\nproperty float \
                 probability\nproperty double log_odds\nproperty int observation_count\nend_header\n"
            )?,
            VoxelFormat::Pcd => write!(
                out,
                "# .PCD v0.7 - occupied voxels, edge {resolution_m} m\nVERSION 0.7\nFIELDS x y z intensity \
                 observation_count\nSIZE 8 8 8 4 4\nTYPE F F F F I\nCOUNT 1 1 1 1 1\nWIDTH {count}\nHEIGHT \
                 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n"
            )?,
            VoxelFormat::Csv => writeln!(out, "x,y,z,probability,log_odds,observation_count")?,
        }
        Ok(Self { format, out, announced: count, written: 0 })
    }

    /// Appends a voxel.
    pub fn write(&mut self, voxel: &VoxelRecord) -> io::Result<()> {
        self.written += 1;
        let VoxelRecord { center_m, probability, log_odds, observation_count } = *voxel;
        let [x, y, z] = center_m;
        if self.format == VoxelFormat::Csv {
            return writeln!(self.out, "{x},{y},{z},{probability},{log_odds},{observation_count}");
        }
        for coordinate in center_m {
            self.out.write_all(&coordinate.to_le_bytes())?;
        }
        self.out.write_all(&(probability as f32).to_le_bytes())?;
        if self.format == VoxelFormat::Ply {
            self.out.write_all(&log_odds.to_le_bytes())?;
        }
        self.out.write_all(&observation_count.to_le_bytes())
    }

    /// Ends the file.
    ///
    /// # Errors
    ///
    /// Another number of voxels than was announced: the file's header would be wrong.
    pub fn finish(mut self) -> io::Result<W> {
        if self.written != self.announced {
            let reason = format!("{} voxels announced, {} written", self.announced, self.written);
            return Err(io::Error::other(reason));
        }
        self.out.flush()?;
        Ok(self.out)
    }
}
