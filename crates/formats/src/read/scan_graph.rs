use super::input_file::open_input;
use super::regular::check_regular;
use crate::read_options::ReadOptions;
use crate::scans::Fingerprint;
use crate::scans::PointStore;
use crate::scans::{ScanHead, ScanSource};
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use voxtile::scan::Pose;
use voxtile::{Error, FormatError, Result};

pub(crate) fn open(path: &Path, _: &ReadOptions) -> Result<Box<dyn ScanSource + Send>> {
    check_regular(path)?;
    let file = open_input(path)?;
    let bytes = file.metadata().map_err(|error| Error::io(path, "open", error))?.len();
    Ok(Box::new(read_scan_graph(BufReader::with_capacity(1 << 16, file), bytes, path)?))
}

/// Reads OctoMap's binary scan graph of `file_bytes` bytes, as written by `ScanGraph::writeBinary`, scan by scan. Its
/// edges are ignored.
///
/// `path` is used for errors and for the fingerprint. Reads are small, so `input` should be buffered.
///
/// # Errors
///
/// The input fails or ends within its first four bytes. Errors in a scan are returned with that scan.
pub fn read_scan_graph<R: Read>(input: R, file_bytes: u64, path: &Path) -> Result<impl ScanSource + use<R>> {
    let path = path.to_owned();
    let mut graph = ScanGraph { path, input, offset: 0, file_bytes, nodes: 0, done: 0, is_past_error: false };
    // An empty file is an empty graph.
    if file_bytes > 0 {
        graph.nodes = u32::from_le_bytes(graph.bytes()?);
    }
    Ok(graph)
}

/// Reader of a scan graph:
///
/// ```text
/// count u32
/// node   points u32, each: i32 3, x y z f64
///        pose: i32 3, x y z f64; i32 4, quaternion w x y z f64
///        id u32
/// ```
struct ScanGraph<R> {
    path: PathBuf,
    input: R,
    offset: u64,
    file_bytes: u64,
    nodes: u32,
    done: u32,
    /// Whether reading can continue after the scan that caused an error.
    is_past_error: bool,
}

const POINT_BYTES: u64 = 28;

impl<R: Read> ScanGraph<R> {
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

    /// Reads a vector, which starts with its length `N`.
    fn vector<const N: usize>(&mut self) -> Result<[f64; N]> {
        let at = self.offset;
        let count = i32::from_le_bytes(self.bytes()?);
        if count != N as i32 {
            let reason = format!("a vector has {count} numbers instead of {N}: this is not a scan graph");
            return Err(FormatError::at_offset(at, reason).in_input(&self.path));
        }
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = f64::from_le_bytes(self.bytes()?);
        }
        Ok(numbers)
    }
}

impl<R: Read> ScanSource for ScanGraph<R> {
    fn len_hint(&self) -> Option<usize> {
        Some(self.nodes as usize)
    }

    fn format(&self) -> String {
        "OctoMap scan graph".to_owned()
    }

    fn read_scan(&mut self, store: &mut PointStore) -> Result<Option<ScanHead>> {
        if self.done == self.nodes {
            return Ok(None);
        }
        let at = self.offset;
        let points = u64::from(u32::from_le_bytes(self.bytes()?));
        if points * POINT_BYTES > self.file_bytes - self.offset {
            let reason = format!("{points} points are announced, more than fit in the rest of the file");
            return Err(FormatError::at_offset(at, reason).in_input(&self.path));
        }
        store.begin(false);
        store.reserve(points as usize);
        for _ in 0..points {
            store.push(self.vector()?, 0.0)?;
        }
        let at = self.offset;
        let [x, y, z] = self.vector()?;
        let [qw, qx, qy, qz] = self.vector()?;
        let id = u32::from_le_bytes(self.bytes()?);
        self.done += 1;
        // An invalid pose does not affect the start of the next scan.
        self.is_past_error = true;
        if ![x, y, z, qw, qx, qy, qz].iter().all(|number| number.is_finite()) {
            return Err(
                FormatError::at_offset(at, "the pose has a number that is not finite").in_input(&self.path)
            );
        }
        let world_from_sensor = Pose::of_quaternion([x, y, z], [qx, qy, qz, qw])
            .map_err(|reason| FormatError::at_offset(at, reason).in_input(&self.path))?;
        self.is_past_error = false;
        Ok(Some(ScanHead { name: id.to_string(), stamp_ns: None, world_from_sensor }))
    }

    fn pass_unread(&mut self) -> bool {
        std::mem::take(&mut self.is_past_error)
    }

    fn fingerprint(&self) -> Result<String> {
        Fingerprint::of_file(&self.path)
    }
}
