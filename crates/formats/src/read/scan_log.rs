use super::input_file::open_input;
use crate::read_options::ReadOptions;
use crate::scans::Fingerprint;
use crate::scans::PointStore;
use crate::scans::{ScanHead, ScanSource};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use voxtile::maths::sin_cos;
use voxtile::scan::Pose;
use voxtile::{Error, FormatError, Result};

pub(crate) fn open(path: &Path, _: &ReadOptions) -> Result<Box<dyn ScanSource + Send>> {
    Ok(Box::new(read_scan_log(BufReader::with_capacity(1 << 16, open_input(path)?), path)))
}

/// Reads OctoMap's scan log, a text format: `NODE x y z roll pitch yaw` starts a scan, and its points follow as `x y z`
/// in the node's frame. Empty lines and lines that start with `#` or a blank are skipped, as in OctoMap.
///
/// Numbers are read as `f32`, as in OctoMap, so that a log and its graph give the same map. `path` is used for errors
/// and for the fingerprint.
pub fn read_scan_log<R: BufRead>(input: R, path: &Path) -> impl ScanSource + use<R> {
    ScanLog { path: path.to_owned(), input, line: 0, pose: None, done: 0 }
}

struct ScanLog<R> {
    path: PathBuf,
    input: R,
    line: u64,
    /// Pose of the current scan.
    pose: Option<Pose>,
    done: usize,
}

/// Limit for the length of a line.
const MAX_LINE_BYTES: u64 = 1 << 16;

impl<R: BufRead> ScanLog<R> {
    /// Returns the next line with content, or `None` at the end.
    fn next_line(&mut self) -> Result<Option<String>> {
        loop {
            let mut bytes = Vec::new();
            let mut limited = std::io::Read::take(&mut self.input, MAX_LINE_BYTES);
            let read = limited
                .read_until(b'\n', &mut bytes)
                .map_err(|error| Error::io(&self.path, "read", error))?;
            if read == 0 {
                return Ok(None);
            }
            self.line += 1;
            if read as u64 == MAX_LINE_BYTES {
                return Err(self.wrong("the line is too long for a scan log"));
            }
            let line = String::from_utf8_lossy(&bytes).trim_end().to_owned();
            if !(line.is_empty() || line.starts_with(['#', ' '])) {
                return Ok(Some(line));
            }
        }
    }

    fn numbers<const N: usize>(&self, words: &str) -> Result<[f64; N]> {
        let mut words = words.split_ascii_whitespace();
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            let Some(word) = words.next() else { return Err(self.wrong(format!("fewer than {N} numbers"))) };
            let parsed: f32 = word.parse().map_err(|_| self.wrong(format!("`{word}` is not a number")))?;
            *number = f64::from(parsed);
        }
        Ok(numbers)
    }

    fn pose(&self, words: &str) -> Result<Pose> {
        let [x, y, z, roll, pitch, yaw] = self.numbers(words)?;
        if ![x, y, z, roll, pitch, yaw].iter().all(|number| number.is_finite()) {
            return Err(self.wrong("the pose has a number that is not finite"));
        }
        Ok(Isometry3::from_parts(Translation3::new(x, y, z), rotation(roll, pitch, yaw)).into())
    }

    fn wrong(&self, reason: impl Into<String>) -> Error {
        FormatError::at_line(self.line, reason).in_input(&self.path)
    }
}

impl<R: BufRead> ScanSource for ScanLog<R> {
    fn len_hint(&self) -> Option<usize> {
        None
    }

    fn format(&self) -> String {
        "OctoMap scan log".to_owned()
    }

    fn read_scan(&mut self, points: &mut PointStore) -> Result<Option<ScanHead>> {
        points.begin(false);
        let mut next = None;
        while let Some(line) = self.next_line()? {
            let node = line.strip_prefix("NODE").map(|words| self.pose(words)).transpose()?;
            match (node, self.pose) {
                (Some(pose), None) => self.pose = Some(pose),
                (Some(pose), Some(_)) => {
                    next = Some(pose);
                    break;
                }
                (None, Some(_)) => points.push(self.numbers(&line)?, 0.0)?,
                (None, None) => {
                    return Err(
                        self.wrong("there are points before the first NODE line: this is not a scan log")
                    );
                }
            }
        }
        let Some(world_from_sensor) = std::mem::replace(&mut self.pose, next) else { return Ok(None) };
        let name = self.done.to_string();
        self.done += 1;
        Ok(Some(ScanHead { name, stamp_ns: None, world_from_sensor }))
    }

    fn fingerprint(&self) -> Result<String> {
        Fingerprint::of_file(&self.path)
    }
}

/// Rotation about x (roll), then y (pitch), then z (yaw), in radians.
fn rotation(roll: f64, pitch: f64, yaw: f64) -> UnitQuaternion<f64> {
    let ((sr, cr), (sp, cp), (sy, cy)) = (sin_cos(roll), sin_cos(pitch), sin_cos(yaw));
    let matrix = Matrix3::new(
        cy * cp,
        cy * sp * sr - sy * cr,
        cy * sp * cr + sy * sr,
        sy * cp,
        sy * sp * sr + cy * cr,
        sy * sp * cr - cy * sr,
        -sp,
        cp * sr,
        cp * cr,
    );
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix))
}
