//! Text files that accompany clouds but are not clouds: poses, times, cameras, logs of other sensors.

use super::file_order::name_of;
use super::glance::{GLANCE_BYTES, first_bytes};
use super::lines::{MAX_LINE_BYTES, RawLines};
use super::text::check_start;
use super::text_header::{are_poses, names_of};
use super::text_line::{Separator, comment_of, without_end};
use crate::poses::matrix_of;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Text files of a folder.
pub(crate) struct Texts {
    pub(crate) clouds: Vec<PathBuf>,
    /// Files that are not clouds: their names and kinds.
    pub(crate) others: Vec<String>,
}

/// Names, without extensions, of text files that are not clouds.
const NAMES: [&str; 12] = [
    "calib",
    "camera-intrinsics",
    "depth",
    "groundtruth",
    "intrinsics",
    "odometry",
    "poses",
    "poses_kitti",
    "poses_tum",
    "readme",
    "rgb",
    "times",
];
/// Words that occur in names of files that are not clouds.
const WORDS: [&str; 44] = [
    "accelerometer",
    "assoc",
    "associate",
    "association",
    "associations",
    "calib",
    "calibration",
    "cam",
    "camera",
    "extrinsic",
    "extrinsics",
    "gnss",
    "gps",
    "groundtruth",
    "gt",
    "gyro",
    "gyroscope",
    "imu",
    "ins",
    "intrinsic",
    "intrinsics",
    "labels",
    "lens",
    "license",
    "notes",
    "odom",
    "odometry",
    "oxts",
    "pose",
    "poses",
    "readme",
    "rtk",
    "stamp",
    "stamps",
    "time",
    "times",
    "timestamp",
    "timestamps",
    "traj",
    "trajectories",
    "trajectory",
    "truth",
    "vicon",
    "wheel",
];
/// Words that do not identify such a file, but may occur in its name in addition to those of [`WORDS`].
const OTHER_WORDS: [&str; 30] = [
    "base",
    "body",
    "color",
    "data",
    "depth",
    "est",
    "estimated",
    "euroc",
    "files",
    "filtered",
    "frames",
    "global",
    "ground",
    "info",
    "keyframes",
    "kitti",
    "left",
    "lidar",
    "list",
    "log",
    "optimized",
    "ref",
    "rgb",
    "right",
    "scan",
    "scans",
    "sensor",
    "slam",
    "tum",
    "velodyne",
];
/// Maximum number of files of a folder to inspect.
const MAX_LOOKS: usize = 64;
/// Maximum number of rows of a file to inspect.
const MAX_ROWS: usize = 64;
/// A file with at most this many rows may be a matrix.
const FEW_ROWS: usize = 4;
/// Smallest plausible Unix time in seconds; coordinates in metres are smaller.
const MIN_STAMP: f64 = 1e8;

/// Returns whether the name alone shows that a file is not a cloud.
pub(crate) fn is_surely_named(path: &Path) -> bool {
    NAMES.contains(&stem_of(path).as_str())
}

/// Separates clouds from other text files. Clouds are numbered, so only files whose name differs from all others in
/// more than a number are inspected.
pub(super) fn sort_out(paths: Vec<PathBuf>) -> Texts {
    let mut forms = BTreeMap::new();
    for path in &paths {
        *forms.entry(form_of(path)).or_insert(0_u64) += 1;
    }
    let (mut texts, mut looks) = (Texts { clouds: Vec::new(), others: Vec::new() }, 0);
    for path in paths {
        let is_odd = forms.get(&form_of(&path)) == Some(&1) || is_named(&path);
        looks += usize::from(is_odd);
        match if is_odd && looks <= MAX_LOOKS { other_than_cloud(&path) } else { None } {
            Some(what) => texts.others.push(format!("{} ({what})", name_of(&path))),
            None => texts.clouds.push(path),
        }
    }
    texts
}

/// Returns a hint for a depth data set that has an association file instead of `depth.txt`.
pub(super) fn depth_list_of(path: &Path) -> Option<String> {
    if !stem_of(path).starts_with("assoc") {
        return None;
    }
    let start = first_bytes(path).ok()?;
    let text = String::from_utf8_lossy(&start);
    let line = text.lines().find(|line| !line.trim().is_empty() && comment_of(line).is_none())?;
    let depth_at = line.split_ascii_whitespace().position(|word| word.contains("depth"))?;
    let name = name_of(path);
    Some(format!(
        "{name} pairs colour and depth images; list only the depth images: `awk '!/^#/ {{print ${depth_at}, ${}}}' \
         {name} > depth.txt`, or use the folder of the depth images as the input",
        depth_at + 1
    ))
}

fn stem_of(path: &Path) -> String {
    path.file_stem().map(|stem| stem.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// Returns the name with each number replaced by `#`.
fn form_of(path: &Path) -> String {
    let mut form = String::new();
    for letter in name_of(path).chars() {
        let letter = if letter.is_ascii_digit() { '#' } else { letter };
        if !(letter == '#' && form.ends_with('#')) {
            form.push(letter);
        }
    }
    form
}

/// Returns whether all words of the name are those of companion files, such as `imu0`, `gt_poses` or `left_camera`.
fn is_named(path: &Path) -> bool {
    let stem = stem_of(path);
    let words = stem.split(|letter: char| !letter.is_alphanumeric()).filter(|word| !word.is_empty());
    let (mut is_named, mut are_known) = (false, true);
    for word in words {
        let word = word.trim_end_matches(|letter: char| letter.is_ascii_digit());
        is_named |= WORDS.contains(&word);
        are_known &= WORDS.contains(&word) || OTHER_WORDS.contains(&word);
    }
    is_named && are_known
}

/// Returns the kind of a text file that is not a cloud.
fn other_than_cloud(path: &Path) -> Option<String> {
    let start = first_bytes(path).ok()?;
    if let Err(reason) = check_start(&start, true) {
        return Some(reason);
    }
    let (names, rows) = rows_of(&start);
    if are_poses(&names) {
        return Some("poses, by its column names".to_owned());
    }
    let all = |is_it: &dyn Fn(&[f64]) -> bool| rows.len() > 1 && rows.iter().all(|row| is_it(row));
    if names.is_empty() {
        let matrix = |row: &[f64]| match row.len() {
            12 | 16 => matrix_of(row).is_ok(),
            13 | 17 => row.get(1..).is_some_and(|row| matrix_of(row).is_ok()),
            _ => false,
        };
        if all(&matrix) {
            return Some("poses: its rows are matrices".to_owned());
        }
        let first = |row: &Vec<f64>| row.first().copied().unwrap_or_default();
        let is_later = |pair: &[Vec<f64>]| matches!(pair, [a, b] if first(a) < first(b));
        let are_times = all(&|row| row.first().is_some_and(|first| *first > MIN_STAMP));
        if are_times && rows.windows(2).all(is_later) {
            return Some("a log: its first column is a time".to_owned());
        }
        let quaternion = |row: &[f64]| match row {
            [_, _, _, _, rest @ ..] if rest.len() == 4 => {
                (rest.iter().map(|part| part * part).sum::<f64>() - 1.0).abs() < 0.1
            }
            _ => false,
        };
        if is_named(path) && all(&quaternion) {
            return Some("poses: its rows end with quaternions".to_owned());
        }
    }
    let is_whole = (start.len() as u64) < GLANCE_BYTES;
    (is_named(path) && is_whole && rows.len() <= FEW_ROWS)
        .then(|| "a few numbers, possibly of a camera".to_owned())
}

/// Parses the column names at the start of a text and its first rows of numbers.
fn rows_of(start: &[u8]) -> (Vec<String>, Vec<Vec<f64>>) {
    let (mut names, mut rows) = (Vec::new(), Vec::new());
    let mut lines = RawLines::new(start, MAX_LINE_BYTES);
    while rows.len() < MAX_ROWS && matches!(lines.next(), Ok(Some(_))) {
        let text = String::from_utf8_lossy(lines.line()).into_owned();
        let line = text.trim();
        if line.is_empty() {
            continue;
        }
        if comment_of(line).is_some() {
            continue;
        }
        let separator = Separator::of(line);
        let cells = separator.split(line);
        let numbers: Option<Vec<f64>> =
            without_end(&cells).iter().map(|cell| separator.number(cell)).collect();
        match numbers {
            Some(numbers) => rows.push(numbers),
            None if rows.is_empty() => names = names_of(line),
            None => {}
        }
    }
    // The last row may be truncated.
    if start.len() as u64 == GLANCE_BYTES && rows.len() < MAX_ROWS {
        rows.pop();
    }
    (names, rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn sorted_out(files: &[(&str, &str)]) -> (Vec<String>, Vec<String>) {
        let folder = tempfile::tempdir().unwrap();
        let paths = files.iter().map(|(name, text)| {
            let path = folder.path().join(name);
            fs::write(&path, text).unwrap();
            path
        });
        let texts = sort_out(paths.collect());
        (texts.clouds.iter().map(|path| name_of(path)).collect(), texts.others)
    }

    #[test]
    fn companion_texts_are_separated_from_clouds() {
        let clouds = [("scan_1.csv", "1,2,3\n"), ("scan_2.csv", "4,5,6\n4,5,7\n")];
        for (name, text, what) in [
            ("imu.csv", "t,ax,ay,az\n0,1,2,3\n", "neither numbers nor column names"),
            ("cam.txt", "525 525 31.5 23.5\n", "a few numbers"),
            ("left_camera.txt", "525 0 31.5\n0 525 23.5\n0 0 1\n", "a few numbers"),
            ("trajectory.csv", "t,x,y,z,qx,qy,qz,qw\n0,1,2,3,0,0,0,1\n", "poses, by its column names"),
            ("path.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0 0 0 1 0\n", "its rows are matrices"),
            ("log.txt", "1700000000.1 0 0 9.8\n1700000000.2 0 0 9.8\n", "its first column is a time"),
            ("gt_poses.txt", "0 1 2 3 0 0 0 1\n0.1 1 2 3 0 0 0 1\n", "end with quaternions"),
            ("stamps.txt", "0.1\n0.2\n0.3\n", "1 columns"),
            ("remarks.txt", "made on Monday\n", "neither numbers nor column names"),
        ] {
            let (found, others) = sorted_out(&[clouds[0], clouds[1], (name, text)]);
            assert_eq!(found, ["scan_1.csv", "scan_2.csv"], "{name}");
            assert!(
                others.len() == 1 && others[0].starts_with(name) && others[0].contains(what),
                "{others:?}"
            );
        }
    }

    #[test]
    fn clouds_with_unusual_names_are_kept() {
        let (found, others) = sorted_out(&[
            ("hall.csv", "1,2,3\n"),
            ("kitchen.xyz", "500000.5 5000000.5 3\n500001.5 5000001.5 3\n"),
            ("camera_1.csv", "1,2,3,4\n".repeat(9).as_str()),
            ("normals.txt", "1 2 3 4 0 0 1 0\n2 2 3 4 0 0 1 0\n"),
            ("scan_1.csv", "nothing that is read"),
            ("scan_2.csv", "1,2,3\n"),
        ]);
        // A damaged cloud among many is reported as an error when it is read.
        assert_eq!((found.len(), others.len()), (6, 0), "{others:?}");
    }

    #[test]
    fn association_files_suggest_the_depth_list() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("associations.txt");
        fs::write(&path, "# rgb depth\n1.5 rgb/1.png 1.5 depth/1.png\n").unwrap();
        let list = depth_list_of(&path).unwrap_or_default();
        assert!(list.contains("{print $3, $4}"), "{list}");
        assert_eq!(depth_list_of(&folder.path().join("1.csv")), None);
    }
}
