use super::cloud::CloudHead;
use super::columns::{Clock, Meaning};
use super::one::{Points, Visit};
use super::scalar::Scalar;
use crate::read_options::ReadOptions;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use voxtile::{Error, FormatError, Result};

const KITTI: [&str; 4] = ["x", "y", "z", "intensity"];
const NUSCENES: [&str; 5] = ["x", "y", "z", "intensity", "ring"];
/// Bytes of the begin of a file that tell four columns from five: whole points of both.
const GLANCE_BYTES: usize = 1000 * 4 * NUSCENES.len();
/// Points that say nothing of their columns are no more than this.
const FEW_POINTS: usize = 16;
/// More columns than any sensor has.
const MAX_FIELDS: usize = 256;

/// The points of a file of floats without a header.
struct BinPoints {
    path: PathBuf,
    input: BufReader<File>,
    meaning: Meaning,
    clock: Clock,
    record: Vec<u8>,
    points: u64,
}

/// Opens a file of floats without a header. Nothing in it tells its columns: its size must fit them.
pub(crate) fn open(
    path: &Path,
    mut head: CloudHead,
    options: &ReadOptions,
) -> Result<(CloudHead, Box<dyn Points>)> {
    let fields: Vec<String> = match &options.fields {
        Some(fields) => fields.clone(),
        None if head.name.ends_with(".pcd.bin") => NUSCENES.map(str::to_owned).into(),
        None => KITTI.map(str::to_owned).into(),
    };
    let list = fields.join(", ");
    if fields.len() > MAX_FIELDS {
        return Err(Error::argument(
            "fields",
            format!("{} names; at most {MAX_FIELDS} are possible", fields.len()),
        ));
    }
    let meaning = Meaning::of(&fields, |_| false)
        .ok_or_else(|| Error::argument("fields", format!("`{list}` lacks x, y or z")))?;
    let file = File::open(path).map_err(|error| Error::io(path, "read", error))?;
    let bytes = file.metadata().map_err(|error| Error::io(path, "read", error))?.len();
    let record_bytes = fields.len() * 4;
    if bytes % record_bytes as u64 != 0 {
        let reason = format!(
            "{bytes} bytes are no whole number of points of {} floats ({list}): name the columns of the file as fields, or \
             it is cut off",
            fields.len()
        );
        return Err(FormatError::at_offset(bytes - bytes % record_bytes as u64, reason).in_input(path));
    }
    let may_be_wider =
        fields == KITTI && options.fields.is_none() && bytes % (4 * NUSCENES.len() as u64) == 0;
    if may_be_wider && looks_like_nuscenes(path)? {
        let reason = format!(
            "its size fits {} floats a point ({list}) and {}, and the last of {} are whole numbers, as of the ring of \
             a sensor: name the columns of the file as fields, `--fields {}` or `--fields {}`",
            KITTI.len(),
            NUSCENES.len(),
            NUSCENES.len(),
            NUSCENES.join(","),
            KITTI.join(",")
        );
        return Err(FormatError::at_offset(0, reason).in_input(path));
    }
    head.points = Some(bytes / record_bytes as u64);
    head.fields = fields;
    head.has_intensities = meaning.intensity.is_some();
    head.has_times = meaning.time.is_some();
    let points = BinPoints {
        path: path.to_owned(),
        input: BufReader::with_capacity(1 << 16, file),
        meaning,
        clock: Clock::new(head.stamp_ns),
        record: vec![0; record_bytes],
        points: bytes / record_bytes as u64,
    };
    Ok((head, Box::new(points)))
}

/// Whether a file, read as five columns, has a ring in the last one, and as four no intensity there. In the wrong five
/// columns, the last holds coordinates by turns, which are not all whole numbers; in the wrong four likewise.
fn looks_like_nuscenes(path: &Path) -> Result<bool> {
    let mut start = Vec::new();
    File::open(path)
        .and_then(|file| file.take(GLANCE_BYTES as u64).read_to_end(&mut start))
        .map_err(|error| Error::io(path, "read", error))?;
    let floats: Vec<f32> = start.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    let last_of = |columns: usize| floats.iter().skip(columns - 1).step_by(columns).copied();
    let is_whole = |value: f32| (0.0..=255.0).contains(&value) && value.fract() == 0.0;
    let mut rings = last_of(NUSCENES.len());
    let is_ring = rings.len() >= FEW_POINTS
        && rings.clone().all(is_whole)
        && rings.next().is_some_and(|first| rings.any(|ring| ring != first));
    let is_intensity = last_of(KITTI.len()).all(is_whole)
        || last_of(KITTI.len()).all(|intensity| (0.0..=1.0).contains(&intensity));
    Ok(is_ring && !is_intensity)
}

impl Points for BinPoints {
    fn read(&mut self, visit: Visit<'_>) -> Result<()> {
        for _ in 0..self.points {
            self.input.read_exact(&mut self.record).map_err(|error| Error::io(&self.path, "read", error))?;
            let record = &self.record;
            let value =
                |at: usize| record.get(at * 4..).map_or(f64::NAN, |bytes| Scalar::F32.value(bytes, false));
            visit(self.clock.point(&self.meaning, value))?;
        }
        Ok(())
    }
}
