use super::columns::{Clock, Meaning};
use super::one::{Points, Visit};
use super::options::OpenOptions;
use super::scalar::Scalar;
use crate::cloud::CloudHead;
use crate::error::{Error, Place, Result};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

const KITTI: [&str; 4] = ["x", "y", "z", "intensity"];
const NUSCENES: [&str; 5] = ["x", "y", "z", "intensity", "ring"];
/// More columns than any sensor has.
const MOST_FIELDS: usize = 256;

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
pub(super) fn open(
    path: &Path,
    mut head: CloudHead,
    options: &OpenOptions,
) -> Result<(CloudHead, Box<dyn Points>)> {
    let fields: Vec<String> = match &options.fields {
        Some(fields) => fields.clone(),
        None if head.name.ends_with(".pcd.bin") => NUSCENES.map(str::to_owned).into(),
        None => KITTI.map(str::to_owned).into(),
    };
    let list = fields.join(", ");
    if fields.len() > MOST_FIELDS {
        return Err(Error::argument(
            "fields",
            format!("{} names; at most {MOST_FIELDS} are possible", fields.len()),
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
        return Err(Error::format(path, Place::Byte(bytes - bytes % record_bytes as u64), reason));
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
