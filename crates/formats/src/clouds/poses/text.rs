use super::binary::check_text;
use super::header::Roles;
use super::matrix::matrix_of;
use super::pose_input::PoseInput;
use super::pose_rows::{PoseRows, Row};
use super::time_unit::{digits_of, stamp_of};
use crate::clouds::error;
use crate::clouds::lines::Lines;
use crate::clouds::pose::RigidPose;
use std::path::Path;

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

/// Reads the poses of a text.
pub(super) fn read(path: &Path, input: PoseInput, poses: &mut PoseRows) -> error::Result<()> {
    check_text(path, input.head())?;
    let mut lines = Lines::new(path, input, 0);
    let mut names: Option<Roles> = None;
    let mut text = TextPoses::default();
    while let Some((_, line)) = lines.next()? {
        let line = line.trim();
        if line.is_empty() {
            continue;
        }
        if let Some(comment) = line.strip_prefix(['#', '%']) {
            if text.layout.is_none() {
                names = Roles::of(comment).or(names);
            }
            continue;
        }
        if text.layout.is_none() && !starts_with_number(line) {
            match Roles::of(line) {
                Some(found) => names = Some(found),
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
    Ok(())
}

/// Whether the first word is a number; `nan` is none, which is told later.
fn starts_with_number(line: &str) -> bool {
    words(line).first().is_some_and(|word| word.parse::<f64>().is_ok())
}

fn words(line: &str) -> Vec<&str> {
    match [';', ','].into_iter().find(|mark| line.contains(*mark)) {
        Some(mark) => line.strip_suffix(mark).unwrap_or(line).split(mark).map(str::trim).collect(),
        None => line.split_ascii_whitespace().collect(),
    }
}

#[derive(Default)]
struct TextPoses {
    layout: Option<Layout>,
    /// Decimal digits of a unit of time below which there are nanoseconds.
    digits: Option<i32>,
    /// Lines of a matrix that is not whole yet.
    rows: Vec<f64>,
}

impl TextPoses {
    fn take(&mut self, line: &str, names: &mut Option<Roles>) -> Result<Option<Row>, String> {
        let words = words(line);
        if self.layout.is_none() {
            // Names that need more columns than there are belong to prose.
            let named = names.take().filter(|roles| roles.last() < words.len());
            self.layout = Some(match (named, words.len()) {
                (Some(roles), _) => Layout::Named(roles),
                (None, 8) => Layout::Tum,
                (None, 7) => Layout::Bare,
                (None, 12 | 16) => Layout::Matrix { has_time: false },
                (None, 13 | 17) => Layout::Matrix { has_time: true },
                (None, 4) => Layout::Rows,
                (None, other) => {
                    return Err(format!(
                        "{other} numbers; a pose has 8 (TUM: t x y z qx qy qz qw) or 12 (KITTI: a matrix of 3x4), or a line \
                         of names before it"
                    ));
                }
            });
        }
        let Some(layout) = self.layout.clone() else { return Ok(None) };
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
                let pose = pose([
                    number(x)?,
                    number(y)?,
                    number(z)?,
                    number(qx)?,
                    number(qy)?,
                    number(qz)?,
                    number(qw)?,
                ])?;
                let stamp_ns = match roles.time {
                    Some((at, digits)) => {
                        Some(self.stamp(words.get(at).copied().unwrap_or_default(), digits)?)
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
                    (1, Some(stamp)) => Some(self.stamp(stamp, None)?),
                    _ => None,
                };
                Ok(Some(Row { stamp_ns, pose: pose(numbers)? }))
            }
            Layout::Matrix { has_time } => {
                let first = usize::from(has_time);
                let numbers: Vec<f64> = (first..words.len()).map(number).collect::<Result<_, _>>()?;
                let stamp_ns = match (has_time, words.first()) {
                    (true, Some(stamp)) => Some(self.stamp(stamp, None)?),
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
                        Some(self.stamp(stamp, None)?)
                    }
                    _ => None,
                };
                let pose = matrix_of(&self.rows)?;
                self.rows.clear();
                Ok(Some(Row { stamp_ns, pose }))
            }
        }
    }

    fn stamp(&mut self, word: &str, named: Option<i32>) -> Result<i64, String> {
        let guessed = named.or(self.digits).or_else(|| digits_of(word));
        let wrong = || format!("`{word:.40}` is no time stamp");
        let digits = guessed.ok_or_else(wrong)?;
        self.digits = Some(digits);
        stamp_of(word, digits).ok_or_else(wrong)
    }
}

/// The pose of x y z and a quaternion.
pub(super) fn pose(numbers: [f64; 7]) -> Result<RigidPose, String> {
    let [x, y, z, qx, qy, qz, qw] = numbers;
    let pose = RigidPose { position_m: [x, y, z], quaternion: [qx, qy, qz, qw] };
    let length = (qx * qx + qy * qy + qz * qz + qw * qw).sqrt();
    if !pose.is_valid() || (length - 1.0).abs() > 0.1 {
        return Err(format!("the quaternion {qx} {qy} {qz} {qw} has length {length:.3}, not 1"));
    }
    Ok(pose)
}
