use super::RigidPose;
use super::binary::check_text;
use super::header::Roles;
use super::matrix::matrix_of;
use super::pose_input::PoseInput;
use super::pose_rows::{PoseRows, Row};
use super::time_unit::{SECONDS, digits_of, stamp_of};
use crate::read::lines::Lines;
use std::path::Path;
use voxtile::scan::Pose;

/// What the numbers of a line are, decided by the first line of numbers.
#[derive(Clone, Debug)]
enum Layout {
    /// Columns with names.
    Named(Roles),
    /// `t x y z qx qy qz qw`.
    Tum,
    /// The same without a time.
    Bare,
    /// A matrix, perhaps with a time before it.
    Matrix { has_time: bool },
    /// A matrix of 4x4 over four lines; some keep the time in the corner that is always 1.
    Rows,
}

/// What is taken for a pose in lines of numbers alone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Rules {
    /// Stamps are times, quaternions have a length near 1.
    #[default]
    Strict,
    /// As earlier versions took the poses of PCD files: any number is a stamp, one that is no time is none, and
    /// quaternions have any length but 0.
    Lenient,
}

/// How a text of poses is written.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Form {
    /// Whether earlier versions took it for the poses of PCD files: lines of 7 or 8 numbers in the order of TUM or of
    /// KITTI's 12, with blanks and commas between them, and comments after `#`.
    pub(crate) is_plain: bool,
    /// Whether its stamps, if it has any, are seconds.
    pub(crate) is_in_seconds: bool,
}

/// Reads the poses of a text.
pub(super) fn read(
    path: &Path,
    input: PoseInput,
    rules: Rules,
    poses: &mut PoseRows,
) -> voxtile::Result<Form> {
    check_text(path, input.head())?;
    let mut text = TextPoses::new(rules, input.head().starts_with(BYTE_ORDER_MARK));
    let mut lines = Lines::new(path, input, 0);
    let mut names: Option<Roles> = None;
    while let Some((_, line)) = lines.next()? {
        let line = line.trim();
        if line.is_empty() {
            continue;
        }
        text.are_plain &= !line.starts_with('%');
        if let Some(comment) = line.strip_prefix(['#', '%']) {
            if text.layout.is_none() {
                names = Roles::of(comment).or(names);
            }
            continue;
        }
        if text.layout.is_none() && !starts_with_number(line) {
            match Roles::of(line) {
                Some(found) => (names, text.has_header) = (Some(found), true),
                None => {
                    let reason = format!(
                        "`{line:.60}` is neither a pose (8 numbers of TUM, 12 of KITTI) nor names of columns (t, x, y, z, \
                         qx, qy, qz, qw)"
                    );
                    return Err(lines.error(reason));
                }
            }
            continue;
        }
        let row = text.take(line, &mut names).map_err(|reason| lines.error(reason))?;
        row.map_or(Ok(()), |row| poses.push(row))?;
    }
    if !text.rows.is_empty() {
        return Err(
            lines.error(format!("the file ends within a matrix of 4x4, after {} numbers", text.rows.len()))
        );
    }
    let is_in_seconds = text.digits.is_none_or(|digits| digits == SECONDS);
    Ok(Form { is_plain: text.are_plain, is_in_seconds })
}

/// Whether a text that starts like this starts with poses.
pub(crate) fn looks_like_poses(start: &[u8]) -> bool {
    let start = String::from_utf8_lossy(start);
    let mut text = TextPoses::new(Rules::Strict, false);
    let mut lines = start.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    lines.next().is_some_and(|line| matches!(text.take(line, &mut None), Ok(Some(_))))
}

/// What editors on Windows put before a text.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Whether the first word is a number; `nan` is none, which is told later.
fn starts_with_number(line: &str) -> bool {
    numbers(line).first().is_some_and(|word| word.parse::<f64>().is_ok())
}

/// The cells of a table.
fn cells(line: &str) -> Vec<&str> {
    match [';', ','].into_iter().find(|mark| line.contains(*mark)) {
        Some(mark) => line.strip_suffix(mark).unwrap_or(line).split(mark).map(str::trim).collect(),
        None => line.split_ascii_whitespace().collect(),
    }
}

/// The words of a line of numbers alone: commas or blanks part them, or both.
fn numbers(line: &str) -> Vec<&str> {
    let cells = cells(line);
    if !cells.iter().any(|cell| cell.contains(char::is_whitespace)) {
        return cells;
    }
    let parts = cells.into_iter().map(|cell| (cell, cell.split(char::is_whitespace)));
    parts.flat_map(|(cell, words)| words.filter(move |word| cell.is_empty() || !word.is_empty())).collect()
}

struct TextPoses {
    rules: Rules,
    layout: Option<Layout>,
    /// Whether a line without numbers names the columns, not a comment.
    has_header: bool,
    /// Whether each line so far is plain.
    are_plain: bool,
    /// Decimal digits of a unit of time below which there are nanoseconds.
    digits: Option<i32>,
    /// Lines of a matrix that is not whole yet.
    rows: Vec<f64>,
}

impl TextPoses {
    fn new(rules: Rules, has_mark: bool) -> Self {
        let (layout, has_header, are_plain, digits, rows) = (None, false, !has_mark, None, Vec::new());
        Self { rules, layout, has_header, are_plain, digits, rows }
    }

    fn take(&mut self, line: &str, names: &mut Option<Roles>) -> Result<Option<Row>, String> {
        let mut words = cells(line);
        if self.layout.is_none()
            // Names that need more columns than there are belong to prose.
            && let Some(roles) = names.take().filter(|roles| roles.last() < words.len())
        {
            self.layout = Some(Layout::Named(roles));
        }
        if !matches!(self.layout, Some(Layout::Named(_))) {
            words = numbers(line);
        }
        if self.layout.is_none() {
            self.layout = Some(match words.len() {
                8 => Layout::Tum,
                7 => Layout::Bare,
                12 | 16 => Layout::Matrix { has_time: false },
                13 | 17 => Layout::Matrix { has_time: true },
                4 => Layout::Rows,
                other => {
                    return Err(format!(
                        "{other} numbers; a pose has 8 (TUM: t x y z qx qy qz qw) or 12 (KITTI: a matrix of 3x4), or a line \
                         of names before it"
                    ));
                }
            });
        }
        let Some(layout) = self.layout.clone() else { return Ok(None) };
        self.are_plain &= match &layout {
            Layout::Tum | Layout::Bare => !line.contains(';'),
            Layout::Matrix { has_time } => !has_time && words.len() == 12 && !line.contains(';'),
            Layout::Named(roles) => roles.are_those_of_tum() && words.len() == 8 && !self.has_header,
            Layout::Rows => false,
        };
        let rules = if self.are_plain { self.rules } else { Rules::Strict };
        let number = |at: usize| -> Result<f64, String> {
            let word = words
                .get(at)
                .ok_or_else(|| format!("{} numbers; number {} is missing", words.len(), at + 1))?;
            let number: f64 = word.parse().map_err(|_| format!("`{word:.40}` is not a number"))?;
            if number.is_finite() { Ok(number) } else { Err(format!("`{word:.40}` is not finite")) }
        };
        let expect = |count: usize| {
            let found = words.len();
            if found == count {
                Ok(())
            } else {
                Err(format!("{found} numbers; the lines before have {count}"))
            }
        };
        match layout {
            Layout::Named(roles) => {
                let [x, y, z] = roles.position;
                let [qx, qy, qz, qw] = roles.quaternion;
                let pose = pose(
                    [number(x)?, number(y)?, number(z)?, number(qx)?, number(qy)?, number(qz)?, number(qw)?],
                    rules,
                )?;
                let stamp_ns = match roles.time {
                    Some((at, digits)) => {
                        self.stamp(words.get(at).copied().unwrap_or_default(), digits, rules)?
                    }
                    None => None,
                };
                Ok(Some(Row { stamp_ns, pose }))
            }
            Layout::Tum | Layout::Bare => {
                let first = usize::from(matches!(layout, Layout::Tum));
                expect(first + 7)?;
                let mut numbers = [0.0; 7];
                for (k, place) in numbers.iter_mut().enumerate() {
                    *place = number(first + k)?;
                }
                let stamp_ns = match (first, words.first()) {
                    (1, Some(stamp)) => self.stamp(stamp, None, rules)?,
                    _ => None,
                };
                Ok(Some(Row { stamp_ns, pose: pose(numbers, rules)? }))
            }
            Layout::Matrix { has_time } => {
                let first = usize::from(has_time);
                let numbers: Vec<f64> = (first..words.len()).map(number).collect::<Result<_, _>>()?;
                self.are_plain = self.are_plain && Pose::of_matrix(numbers.as_chunks().0).is_ok();
                let stamp_ns = match (has_time, words.first()) {
                    (true, Some(stamp)) => self.stamp(stamp, None, rules)?,
                    _ => None,
                };
                Ok(Some(Row { stamp_ns, pose: matrix_of(&numbers)? }))
            }
            Layout::Rows => {
                expect(4)?;
                for at in 0..4 {
                    self.rows.push(number(at)?);
                }
                if self.rows.len() < 16 {
                    return Ok(None);
                }
                let stamp_ns = match (self.rows.last_mut(), words.last()) {
                    (Some(corner), Some(stamp)) if *corner != 1.0 => {
                        *corner = 1.0;
                        self.stamp(stamp, None, rules)?
                    }
                    _ => None,
                };
                let pose = matrix_of(&self.rows)?;
                self.rows.clear();
                Ok(Some(Row { stamp_ns, pose }))
            }
        }
    }

    fn stamp(&mut self, word: &str, named: Option<i32>, rules: Rules) -> Result<Option<i64>, String> {
        let digits = named.or(self.digits).or_else(|| digits_of(word));
        let stamp_ns = digits.and_then(|digits| stamp_of(word, digits));
        if stamp_ns.is_some() {
            self.digits = digits;
        } else if rules == Rules::Strict || word.parse::<f64>().is_err() {
            return Err(format!("`{word:.40}` is no time stamp"));
        }
        Ok(stamp_ns)
    }
}

/// The pose of x y z and a quaternion.
pub(super) fn pose(numbers: [f64; 7], rules: Rules) -> Result<RigidPose, String> {
    let [x, y, z, qx, qy, qz, qw] = numbers;
    let pose = RigidPose { position_m: [x, y, z], quaternion: [qx, qy, qz, qw] };
    let length = (qx * qx + qy * qy + qz * qz + qw * qw).sqrt();
    if !pose.is_valid() || (rules == Rules::Strict && (length - 1.0).abs() > 0.1) {
        return Err(format!("the quaternion {qx} {qy} {qz} {qw} has length {length:.3}, not 1"));
    }
    Ok(pose)
}
