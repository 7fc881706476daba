use super::fingerprint::Fingerprint;
use super::poses::unit_quaternion;
use super::sensor_scan::SensorScan;
use super::source::ScanSource;
use crate::error::{Error, FormatError, Result};
use nalgebra::{Isometry3, Quaternion, Translation3};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

/// OctoMap's binary scan graph, as `ScanGraph::writeBinary` writes it. Its edges are not read.
///
/// ```text
/// count u32
/// node   points u32, each: i32 3, x y z f64
///        pose: i32 3, x y z f64; i32 4, quaternion w x y z f64
///        id u32
/// ```
pub(super) struct ScanGraph {
    path: PathBuf,
    input: BufReader<File>,
    offset: u64,
    file_bytes: u64,
    nodes: u32,
    done: u32,
}

const POINT_BYTES: u64 = 28;

impl ScanGraph {
    pub(super) fn open(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(|error| Error::io(path, "open", error))?;
        let file_bytes = file.metadata().map_err(|error| Error::io(path, "look at", error))?.len();
        let input = BufReader::with_capacity(1 << 16, file);
        let mut graph = Self { path: path.to_owned(), input, offset: 0, file_bytes, nodes: 0, done: 0 };
        // An empty graph is an empty file.
        if file_bytes > 0 {
            graph.nodes = u32::from_le_bytes(graph.bytes()?);
        }
        Ok(graph)
    }

    fn bytes<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut bytes = [0; N];
        if self.offset + N as u64 > self.file_bytes {
            let reason = format!("the file ends in scan {} of {}", self.done + 1, self.nodes);
            return Err(FormatError::at_offset(self.offset, reason).in_input(&self.path));
        }
        self.input.read_exact(&mut bytes).map_err(|error| Error::io(&self.path, "read", error))?;
        self.offset += N as u64;
        Ok(bytes)
    }

    /// Numbers after their count, which must be `N`.
    fn vector<const N: usize>(&mut self) -> Result<[f64; N]> {
        let at = self.offset;
        let count = i32::from_le_bytes(self.bytes()?);
        if count != N as i32 {
            let reason =
                format!("a vector of {count} numbers where one of {N} belongs; this is no scan graph");
            return Err(FormatError::at_offset(at, reason).in_input(&self.path));
        }
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = f64::from_le_bytes(self.bytes()?);
        }
        Ok(numbers)
    }
}

impl ScanSource for ScanGraph {
    fn len_hint(&self) -> Option<usize> {
        Some(self.nodes as usize)
    }

    fn next_scan(&mut self) -> Result<Option<SensorScan>> {
        if self.done == self.nodes {
            return Ok(None);
        }
        let at = self.offset;
        let points = u64::from(u32::from_le_bytes(self.bytes()?));
        if points * POINT_BYTES > self.file_bytes - self.offset {
            let reason = format!("{points} points announced, more than the rest of the file can hold");
            return Err(FormatError::at_offset(at, reason).in_input(&self.path));
        }
        let points_in_sensor = (0..points).map(|_| self.vector()).collect::<Result<Vec<[f64; 3]>>>()?;
        let at = self.offset;
        let [x, y, z] = self.vector()?;
        let [qw, qx, qy, qz] = self.vector()?;
        if ![x, y, z, qw, qx, qy, qz].iter().all(|number| number.is_finite()) {
            return Err(FormatError::at_offset(at, "a pose that is not finite").in_input(&self.path));
        }
        let rotation = unit_quaternion(Quaternion::new(qw, qx, qy, qz))
            .map_err(|reason| FormatError::at_offset(at, reason).in_input(&self.path))?;
        let id = u32::from_le_bytes(self.bytes()?);
        self.done += 1;
        Ok(Some(SensorScan {
            name: id.to_string(),
            points_in_sensor,
            intensities: None,
            world_from_sensor: Isometry3::from_parts(Translation3::new(x, y, z), rotation),
        }))
    }

    fn fingerprint(&self) -> Result<String> {
        Fingerprint::of_file(&self.path)
    }
}
