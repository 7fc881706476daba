//! Time stamps in file names.

use super::cloud::CloudHead;
use super::one::head_of;
use super::stamp::nanoseconds;
use std::path::{Path, PathBuf};

/// Additional extensions before the last one: `0001.pcd.bin`, `frame-000001.depth.png`.
const INNER_ENDINGS: [&str; 4] = [".pcd", ".depth", ".cloud", ".points"];
/// Plausible stamps, in seconds: the years 1990 to 2100. Counters do not reach them.
const PLAUSIBLE_S: std::ops::Range<i128> = 631_152_000..4_102_444_800;
/// Decimal digits of a second in nanoseconds.
const NANOSECOND_DIGITS: usize = 9;

/// Returns the time stamp in a file name: `1700000000123456789.bin`, `1403636579.763555.ply`,
/// `lidar__1532402927647951.bin`, `cloud_1583836591_182590976.pcd`.
pub fn in_name(path: &Path) -> Option<i64> {
    NameStamps::default().stamp(path)
}

/// How the file names of a folder encode times. A single name may be ambiguous.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct NameStamps {
    /// Meaning of the digits after a point.
    after_point: Part,
    /// Meaning of the digits after `_` or `-`.
    after_dash: Option<Part>,
}

/// Meaning of the digits after whole seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Part {
    /// Decimals of a second.
    #[default]
    Decimals,
    /// An integer in units of `10^digits` nanoseconds, possibly without leading zeros.
    Whole { digits: i32 },
}

/// Seconds in a name and the digits after them.
#[derive(Clone, Copy)]
struct Parted<'n> {
    seconds: &'n str,
    part: &'n str,
    is_behind_point: bool,
}

impl NameStamps {
    /// Derives the encoding from all names of a folder.
    pub(crate) fn of(files: &[PathBuf]) -> Self {
        let names = || files.iter().filter_map(|path| parted(stem_of(path)?));
        Self {
            after_point: Widths::of(names().filter(|name| name.is_behind_point)).after_point(),
            after_dash: Widths::of(names().filter(|name| !name.is_behind_point)).after_dash(),
        }
    }

    /// Returns whether the digits after a point are an integer instead of decimals.
    pub(crate) fn are_whole(self) -> bool {
        self.after_point != Part::Decimals
    }

    /// Returns the properties of a cloud that are known from its file name.
    pub(crate) fn head_of(self, path: &Path) -> CloudHead {
        CloudHead { stamp_ns: self.stamp(path), ..head_of(path) }
    }

    /// Returns a remark for the user about an unusual encoding.
    pub(crate) fn remark(self) -> Option<String> {
        let unit = match self.after_point {
            Part::Decimals => return None,
            Part::Whole { digits: 0 } => "nanoseconds",
            Part::Whole { .. } => "microseconds",
        };
        Some(format!(
            "the numbers after the point in the file names have different lengths: they are read as {unit}"
        ))
    }

    /// Returns the time stamp in a file name.
    pub(crate) fn stamp(self, path: &Path) -> Option<i64> {
        let stem = stem_of(path)?;
        if let Some(Parted { seconds, part, is_behind_point }) = parted(stem) {
            let sure = Part::Whole { digits: 0 };
            let kind = match self.after_dash {
                _ if is_behind_point => Some(self.after_point),
                None => (part.len() == NANOSECOND_DIGITS).then_some(sure),
                known => known,
            };
            match kind {
                Some(Part::Whole { digits }) => {
                    let part_ns = nanoseconds(part, digits).filter(|ns| (0..1_000_000_000).contains(ns))?;
                    return nanoseconds(seconds, 9)?.checked_add(part_ns);
                }
                Some(Part::Decimals) => {}
                None => return None,
            }
        }
        one_number(stem)
    }
}

/// Returns a file name without its extensions.
fn stem_of(path: &Path) -> Option<&str> {
    let name = path.file_name()?.to_str()?;
    let mut stem = name;
    if let Some((before, ending)) = name.rsplit_once('.')
        && !(is_digits(ending) && is_digits(before))
    {
        stem = before;
    }
    for ending in INNER_ENDINGS {
        stem = stem.strip_suffix(ending).unwrap_or(stem);
    }
    Some(stem)
}

/// Splits off seconds and the digits after them at the end of a name.
fn parted(stem: &str) -> Option<Parted<'_>> {
    let (before, part) = stem.rsplit_once(['.', '_', '-'])?;
    let start = before.trim_end_matches(|letter: char| letter.is_ascii_digit()).len();
    let (prefix, seconds) = before.split_at_checked(start)?;
    let is_time = matches!(seconds.len(), 9 | 10)
        && seconds.parse().is_ok_and(|seconds| PLAUSIBLE_S.contains(&seconds))
        && (prefix.is_empty() || prefix.ends_with(['_', '-']));
    let is_part = is_digits(part) && part.len() <= NANOSECOND_DIGITS;
    let is_behind_point = stem.as_bytes().get(before.len()) == Some(&b'.');
    (is_time && is_part).then_some(Parted { seconds, part, is_behind_point })
}

/// Parses a stamp written as one number. Decimals are allowed after seconds.
fn one_number(stem: &str) -> Option<i64> {
    let number_at = stem.trim_end_matches(|letter: char| letter.is_ascii_digit() || letter == '.').len();
    let (prefix, number) = stem.split_at(number_at);
    let (whole, fraction) = number.split_once('.').unwrap_or((number, ""));
    // A number of ten or twelve digits after a word may be a date.
    let is_sure = prefix.is_empty() || (prefix.ends_with(['_', '-']) && whole.len() + fraction.len() >= 13);
    if !is_sure
        || !is_digits(whole)
        || whole.len() > 20
        || !fraction.bytes().all(|byte| byte.is_ascii_digit())
    {
        return None;
    }
    let value: i128 = whole.parse().ok()?;
    let in_unit = |(_, per_second): &(i32, i128)| PLAUSIBLE_S.contains(&(value / per_second));
    let (digits, per_second) =
        [(9, 1), (6, 1_000), (3, 1_000_000), (0, 1_000_000_000)].into_iter().find(in_unit)?;
    // Only seconds may have a fraction.
    (fraction.is_empty() || per_second == 1).then(|| nanoseconds(number, digits))?
}

/// Statistics of the digits after seconds in the names of a folder.
#[derive(Default)]
struct Widths {
    least: usize,
    most: usize,
    /// Whether a number of several digits starts with 0, which shows padding or decimals.
    has_zero_start: bool,
    /// Whether a number of several digits ends with 0. Programs that shorten decimals omit such zeros.
    has_zero_end: bool,
    /// Whether a later second has a smaller number, which a running counter never has.
    starts_again: bool,
}

impl Widths {
    fn of<'n>(names: impl Iterator<Item = Parted<'n>>) -> Self {
        let mut widths = Self { least: usize::MAX, ..Self::default() };
        let mut parts: Vec<(&str, u64)> = Vec::new();
        for Parted { seconds, part, .. } in names {
            parts.push((seconds, part.parse().unwrap_or(0)));
            widths.least = widths.least.min(part.len());
            widths.most = widths.most.max(part.len());
            widths.has_zero_start |= part.len() > 1 && part.starts_with('0');
            widths.has_zero_end |= part.len() > 1 && part.ends_with('0');
        }
        parts.sort_unstable();
        let mut most = 0;
        for same_second in parts.chunk_by(|(a, _), (b, _)| a == b) {
            let ends = same_second.first().zip(same_second.last());
            widths.starts_again |= ends.is_some_and(|((_, first), _)| *first < most);
            most = ends.map_or(most, |(_, (_, last))| most.max(*last));
        }
        widths
    }

    fn differ(&self) -> bool {
        self.least < self.most
    }

    /// Returns the meaning of the digits after a point. Decimals have equal widths, or are shorter where trailing zeros
    /// are omitted. Integers of nanoseconds or microseconds without leading zeros have different widths and never start
    /// with 0. Shortened decimals have fewer than nine digits, because a double cannot hold nine decimals of current
    /// Unix time.
    fn after_point(&self) -> Part {
        match self.most {
            _ if !self.differ() || self.has_zero_start => Part::Decimals,
            NANOSECOND_DIGITS => Part::Whole { digits: 0 },
            6 if self.has_zero_end => Part::Whole { digits: 3 },
            _ => Part::Decimals,
        }
    }

    /// Returns the meaning of the digits after `_` or `-`; `None` if they may be a counter.
    fn after_dash(&self) -> Option<Part> {
        match self.most {
            NANOSECOND_DIGITS => Some(Part::Whole { digits: 0 }),
            _ if !self.starts_again => None,
            7 | 8 if !self.has_zero_start => Some(Part::Whole { digits: 0 }),
            6 => Some(Part::Whole { digits: 3 }),
            _ => None,
        }
    }
}

fn is_digits(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads the stamps of several names together, relative to 1.5e9 s.
    fn together(names: &[&str]) -> Vec<Option<i64>> {
        let files: Vec<PathBuf> = names.iter().map(PathBuf::from).collect();
        let stamps = NameStamps::of(&files);
        files.iter().map(|file| Some(stamps.stamp(file)? - 1_500_000_000_000_000_000)).collect()
    }

    #[test]
    fn numeric_names_are_stamps_except_counters() {
        let stamps = [
            ("1700000000123456789.bin", 1_700_000_000_123_456_789),
            ("1403636579.763555.ply", 1_403_636_579_763_555_000),
            ("1403636579.763555", 1_403_636_579_763_555_000),
            ("1700000000123.pcd", 1_700_000_000_123_000_000),
            ("1700000000.ply", 1_700_000_000_000_000_000),
            ("n015-2018__LIDAR_TOP__1532402927647951.pcd.bin", 1_532_402_927_647_951_000),
            ("cloud_1583836591_182590976.pcd", 1_583_836_591_182_590_976),
            ("1583836591-082590976.pcd", 1_583_836_591_082_590_976),
        ];
        for (name, stamp_ns) in stamps {
            assert_eq!(in_name(Path::new(name)), Some(stamp_ns), "{name}");
        }
        for name in [
            "000012.bin",
            "0000000012.bin",
            "scan_20240101.ply",
            "scan_202401011200.ply",
            "20240101_120000.ply",
            "1583836591_000012.ply",
            "v1.2.ply",
            "a.ply",
        ] {
            assert_eq!(in_name(Path::new(name)), None, "{name}");
        }
    }

    #[test]
    fn nanoseconds_without_leading_zeros_are_detected_by_other_names() {
        let names = ["1500000000.5000000.pcd", "1500000000.120000000.pcd", "1500000001.70000000.pcd"];
        assert_eq!(together(&names), [Some(5_000_000), Some(120_000_000), Some(1_070_000_000)]);
        let dashed = names.map(|name| name.replacen('.', "-", 1));
        assert_eq!(together(&dashed.each_ref().map(|name| &**name)), together(&names));
        let micros = ["1500000000.5010.pcd", "1500000000.120000.pcd", "1500000001.70001.pcd"];
        assert_eq!(together(&micros), [Some(5_010_000), Some(120_000_000), Some(1_070_001_000)]);
    }

    #[test]
    fn decimals_of_a_second_may_be_shortened() {
        let names = ["1500000000.5.pcd", "1500000000.52.pcd", "1500000001.070125.pcd"];
        assert_eq!(together(&names), [Some(500_000_000), Some(520_000_000), Some(1_070_125_000)]);
        let one_starts_with_zero = ["1500000000.5.pcd", "1500000000.070125034.pcd"];
        assert_eq!(together(&one_starts_with_zero), [Some(500_000_000), Some(70_125_034)]);
        let equal = ["1500000000.500000000.pcd", "1500000000.620000001.pcd"];
        assert_eq!(together(&equal), [Some(500_000_000), Some(620_000_001)]);
    }

    #[test]
    fn microseconds_start_again_each_second_and_counters_do_not() {
        let times = ["1500000000_900000.ply", "1500000001_000012.ply", "1500000001_100012.ply"];
        assert_eq!(together(&times), [Some(900_000_000), Some(1_000_012_000), Some(1_100_012_000)]);
        for counters in [
            ["1500000000_000001.ply", "1500000000_000002.ply", "1500000001_000003.ply"],
            ["1500000000_1.ply", "1500000001_2.ply", "1500000002_1.ply"],
        ] {
            assert_eq!(together(&counters), [None; 3]);
        }
    }
}
