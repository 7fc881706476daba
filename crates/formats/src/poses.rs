use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use voxtile::scan::Pose;
use voxtile::{Error, FormatError, Result};

/// The poses of a file, with their time stamps if it has any.
#[derive(Default)]
pub(super) struct Poses {
    /// How many poses the file has; `poses` holds only the first ones.
    count: usize,
    poses: Vec<Pose>,
    /// Seconds, each with its line number; TUM files only.
    stamps: Vec<(u64, f64)>,
}

/// How much of a file is read to identify it.
const GLANCE_BYTES: u64 = 1 << 14;
/// A longer line is an error.
const MAX_LINE_BYTES: u64 = 1 << 16;
/// Numbers in file names are compared with time stamps if both exceed this many seconds: counters do not.
const MIN_STAMP_S: f64 = 1e6;

impl Poses {
    /// Reads a file and keeps its first `wanted` poses.
    pub(super) fn read(path: &Path, wanted: usize) -> Result<Self> {
        let mut poses = Self::default();
        for_each_line(path, &mut |number, pose| {
            poses.count += 1;
            if poses.count <= wanted {
                poses.stamps.extend(pose.stamp_s.map(|stamp_s| (number, stamp_s)));
                poses.poses.push(pose.world_from_sensor);
            }
        })?;
        Ok(poses)
    }

    /// Checks that these are the poses of these files: equal in number, and in the same order of time.
    ///
    /// # Errors
    ///
    /// Another number of poses, time stamps that go back.
    pub(super) fn check(&self, path: &Path, files: &[PathBuf]) -> Result<()> {
        let wrong = |reason: String| Err(Error::argument(path.display().to_string(), reason));
        if self.count != files.len() {
            let (poses, files) = (self.count, files.len());
            return wrong(format!(
                "{poses} poses for {files} scan files; there must be one line a file, in the natural order of their names \
                 (scan2 before scan10)"
            ));
        }
        if let Some(pair) = self.stamps.windows(2).find(|pair| pair[1].1 < pair[0].1) {
            let ((_, before), (line, stamp)) = (pair[0], pair[1]);
            return wrong(format!(
                "line {line}: time stamp {stamp} comes after {before}, but line by line these are the poses of the files in \
                 the natural order of their names; put the lines in that order (stamps that mean nothing may all be 0)"
            ));
        }
        if let Some((file, seconds)) = self.first_beside_its_file(files) {
            log::warn!(
                "{}: the number in {} is {seconds:.3} s further from its pose's time stamp than those of most files: is a \
                 line or a file missing?",
                path.display(),
                file.display()
            );
        }
        Ok(())
    }

    pub(super) fn into_poses(self) -> Vec<Pose> {
        self.poses
    }

    /// If file names are time stamps, the first file whose name does not match its pose, and by how many seconds.
    fn first_beside_its_file<'f>(&self, files: &'f [PathBuf]) -> Option<(&'f PathBuf, f64)> {
        let stamps: Vec<f64> = self.stamps.iter().map(|&(_, stamp)| stamp).collect();
        let (first, last) = (*stamps.first()?, *stamps.last()?);
        let names: Vec<f64> = files.iter().map(|path| number_in(path)).collect::<Option<_>>()?;
        if stamps.len() != names.len() || first < MIN_STAMP_S || last <= first {
            return None;
        }
        let spacing = (last - first) / (stamps.len() - 1) as f64;
        let near = first - (last - first) - 1.0..=last + (last - first) + 1.0;
        let unit = [1.0, 1e-3, 1e-6, 1e-9].into_iter().find(|unit| near.contains(&(names[0] * unit)))?;
        let apart: Vec<f64> = names.iter().zip(&stamps).map(|(name, stamp)| name * unit - stamp).collect();
        let mut sorted = apart.clone();
        sorted.sort_by(f64::total_cmp);
        let most = sorted[sorted.len() / 2];
        let beside = |&k: &usize| (apart[k] - most).abs() > 0.5 * spacing;
        (0..apart.len()).find(beside).map(|k| (&files[k], (apart[k] - most).abs()))
    }
}

impl Poses {
    pub(super) fn len(&self) -> usize {
        self.count
    }

    /// Whether each line has the stamp, in nanoseconds, in its place, up to the milliseconds that some programs write.
    pub(super) fn have_stamps(&self, stamps_ns: &[i64]) -> bool {
        let is_same = |(&stamp_ns, &(_, stamp_s)): (&i64, &(u64, f64))| {
            (stamp_ns as f64 * 1e-9 - stamp_s).abs() <= 1e-3
        };
        self.stamps.len() == stamps_ns.len() && stamps_ns.iter().zip(&self.stamps).all(is_same)
    }
}

/// Whether a file is a text that starts like a pose file.
pub(super) fn looks_like_poses(path: &Path) -> bool {
    let is_text = path.extension().is_some_and(|extension| {
        ["txt", "tum", "kitti", "csv"].iter().any(|known| extension.eq_ignore_ascii_case(known))
    });
    let mut text = Vec::new();
    let mut glance = || File::open(path)?.take(GLANCE_BYTES).read_to_end(&mut text);
    if !is_text || !path.is_file() || glance().is_err() {
        return false;
    }
    let first = lines(&String::from_utf8_lossy(&text)).next();
    first.is_some_and(|line| line.is_ok())
}

/// The number at the end of a file's name.
fn number_in(path: &Path) -> Option<f64> {
    let stem = path.file_stem()?.to_str()?;
    let digits = stem.trim_end_matches(|letter: char| letter.is_ascii_digit() || letter == '.').len();
    stem[digits..].trim_start_matches('.').parse().ok()
}

/// Reads poses, sensor to world, one per line; empty lines and lines that start with `#` are skipped.
///
/// A line of 8 numbers is TUM's `t tx ty tz qx qy qz qw`, one of 12 is KITTI's row-major 3x4 matrix.
///
/// # Errors
///
/// An invalid line, numbers that are not finite, a zero quaternion, a matrix that is not a rotation.
pub fn read_poses(path: &Path) -> Result<Vec<Pose>> {
    let mut poses = Vec::new();
    for_each_line(path, &mut |_, pose| poses.push(pose.world_from_sensor))?;
    Ok(poses)
}

/// Parses the text of a pose file, see [`read_poses`].
///
/// # Errors
///
/// Those of [`read_poses`] that are about a line.
pub fn parse_poses(text: &str) -> std::result::Result<Vec<Pose>, FormatError> {
    lines(text).map(|line| line.map(|(_, pose)| pose.world_from_sensor)).collect()
}

/// A line of a file of poses.
struct StampedPose {
    /// Seconds, in a TUM file.
    stamp_s: Option<f64>,
    world_from_sensor: Pose,
}

/// Visits the poses of a file, each with its line number.
fn for_each_line(path: &Path, take: &mut dyn FnMut(u64, StampedPose)) -> Result<()> {
    let fail = |error| Error::io(path, "read", error);
    let mut input = BufReader::with_capacity(1 << 16, File::open(path).map_err(fail)?);
    let mut line = Vec::new();
    for number in 1.. {
        line.clear();
        let read = (&mut input).take(MAX_LINE_BYTES).read_until(b'\n', &mut line).map_err(fail)?;
        if read == 0 {
            break;
        }
        let wrong = |reason: String| FormatError::at_line(number, reason).in_input(path);
        let is_comment = line.trim_ascii_start().starts_with(b"#");
        if read as u64 == MAX_LINE_BYTES && line.last() != Some(&b'\n') {
            if !is_comment {
                let reason =
                    format!("the line is longer than {} KiB: this is no file of poses", MAX_LINE_BYTES >> 10);
                return Err(wrong(reason));
            }
            input.skip_until(b'\n').map_err(fail)?;
        }
        let text = String::from_utf8_lossy(&line);
        let text = text.trim();
        if !text.is_empty() && !is_comment {
            take(number, parse(text).map_err(wrong)?);
        }
    }
    Ok(())
}

/// The poses of a text, each with its line number.
fn lines(text: &str) -> impl Iterator<Item = std::result::Result<(u64, StampedPose), FormatError>> {
    let lines =
        (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty() && !line.trim().starts_with('#'));
    lines.map(|(number, line)| match parse(line) {
        Ok(pose) => Ok((number, pose)),
        Err(reason) => Err(FormatError::at_line(number, reason)),
    })
}

fn parse(line: &str) -> std::result::Result<StampedPose, String> {
    let numbers: Vec<f64> = line
        .split([' ', '\t', ',', '\r'])
        .filter(|word| !word.is_empty())
        .map(|word| word.parse().map_err(|_| format!("`{word}` is not a number")))
        .collect::<std::result::Result<_, _>>()?;
    // The time is only for checks; everything else must be finite.
    let stamp_s = (numbers.len() == 8).then(|| numbers[0]).filter(|stamp| stamp.is_finite());
    let pose = if numbers.len() == 8 { &numbers[1..] } else { &numbers[..] };
    let world_from_sensor = match *pose {
        [x, y, z, qx, qy, qz, qw] => Pose::of_quaternion([x, y, z], [qx, qy, qz, qw])?,
        _ if pose.len() == 12 => Pose::of_matrix(pose.as_chunks().0)?,
        _ => return Err(format!("{} numbers; a pose has 8 (TUM) or 12 (KITTI)", numbers.len())),
    };
    Ok(StampedPose { stamp_s, world_from_sensor })
}
