use super::RigidPose;
use super::binary::check_text;
use super::cells::{Cells, cells, numbers, stamp_of_two, starts_with_number};
use super::header::{Names, Roles, TimeColumns};
use super::matrix::matrix_of;
use super::pose_input::PoseInput;
use super::pose_rows::{BadKind, BadRow, PoseRows, Row, Stamp};
use super::time_unit::{SECONDS, digits_of, stamp_of};
use crate::read::lines::Lines;
use crate::read::text_line::{Separator, comment_of};
use std::borrow::Cow;
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
    /// Whether its poses are matrices.
    pub(crate) is_matrix: bool,
    /// The units of x, y and z where they are not metres.
    pub(crate) unit: Option<[&'static str; 3]>,
}

/// Reads the poses of a text. A line of names tells the columns wherever it stands before the poses.
pub(super) fn read(
    path: &Path,
    input: PoseInput,
    rules: Rules,
    poses: &mut PoseRows,
) -> voxtile::Result<Form> {
    check_text(path, input.head())?;
    let mut text = TextPoses::new(rules, input.head().starts_with(BYTE_ORDER_MARK));
    let mut lines = Lines::new(path, input, 0);
    while let Some((_, line)) = lines.next()? {
        let taken = text.take(&line);
        match taken {
            Ok(Taken::Nothing) => {}
            Ok(Taken::Row(row)) => poses.push(Ok(row), |reason| lines.error(reason))?,
            Err(Bad::Row(row)) => poses.push(Err(row), |reason| lines.error(reason))?,
            Err(Bad::File(reason)) => return Err(lines.error(reason)),
        }
    }
    if !text.matrix.is_empty() {
        let reason =
            format!("the file ends within a matrix of 4x4, after {} lines of it", text.matrix.len() / 4);
        let bad = BadRow { reason, kind: BadKind::Words, stamp: Stamp::None };
        poses.push(Err(bad), |reason| lines.error(reason))?;
    }
    Ok(text.form())
}

/// Whether a text that starts like this starts with poses.
pub(crate) fn looks_like_poses(start: &[u8]) -> bool {
    let start = String::from_utf8_lossy(start);
    let start = start.trim_start_matches('\u{feff}');
    let mut text = TextPoses::new(Rules::Strict, false);
    let lines = start.lines().map(str::trim).filter(|line| !line.is_empty());
    for line in lines.filter(|line| comment_of(line).is_none()) {
        match text.take(line) {
            Ok(Taken::Row(_)) => return true,
            // A line of names comes before poses, and a matrix may have four lines.
            Ok(Taken::Nothing) => {}
            Err(_) => return false,
        }
    }
    false
}

/// What editors on Windows put before a text.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";
/// What poses may be, for messages.
const FORMS: &str = "8 numbers (TUM: t x y z qx qy qz qw), 7 without t, 12 or 16 (KITTI: a matrix of 3x4 or 4x4), \
                     one more with a time before a matrix, or a table whose first line names its columns";

/// What a line has.
enum Taken {
    Row(Row),
    /// A comment, names, a part of a matrix.
    Nothing,
}

/// What is wrong with a line.
enum Bad {
    /// It is no pose; others may be.
    Row(BadRow),
    /// What the poses mean is not known.
    File(String),
}

struct TextPoses {
    rules: Rules,
    layout: Option<Layout>,
    names: Names,
    /// Whether a line without numbers names the columns, not a comment.
    has_header: bool,
    /// Whether each line so far is plain.
    are_plain: bool,
    /// Decimal digits of a unit of time below which there are nanoseconds.
    digits: Option<i32>,
    /// Numbers of a matrix that is not whole yet; NaN where there is none.
    matrix: Vec<f64>,
    /// What is wrong with a line of it.
    matrix_fault: Option<BadRow>,
}

impl TextPoses {
    fn new(rules: Rules, has_mark: bool) -> Self {
        Self {
            rules,
            layout: None,
            names: Names::Prose,
            has_header: false,
            are_plain: !has_mark,
            digits: None,
            matrix: Vec::new(),
            matrix_fault: None,
        }
    }

    /// How the text is written.
    fn form(&self) -> Form {
        Form {
            is_plain: self.are_plain,
            is_in_seconds: self.digits.is_none_or(|digits| digits == SECONDS),
            is_matrix: matches!(self.layout, Some(Layout::Matrix { .. } | Layout::Rows)),
            unit: match &self.layout {
                Some(Layout::Named(roles)) if roles.has_units() => Some(roles.units.map(|unit| unit.name)),
                _ => None,
            },
        }
    }

    fn take(&mut self, line: &str) -> Result<Taken, Bad> {
        let line = line.trim();
        if line.is_empty() {
            return Ok(Taken::Nothing);
        }
        self.are_plain &= !line.starts_with('%') && !line.starts_with("//");
        if let Some(comment) = comment_of(line) {
            if self.layout.is_none() {
                self.note_names(Names::of(comment));
            }
            return Ok(Taken::Nothing);
        }
        if !starts_with_number(line) {
            let found = if self.layout.is_none() { Names::of(line) } else { Names::Prose };
            return match found {
                Names::Poses(_) => {
                    self.has_header = true;
                    self.note_names(found);
                    Ok(Taken::Nothing)
                }
                Names::Wrong { reason, .. } => Err(Bad::File(reason)),
                Names::Prose => Err(no_row(format!(
                    "`{line:.60}` is neither a pose nor names of columns: a pose is {FORMS}"
                ))),
            };
        }
        self.take_numbers(line)
    }

    /// Keeps the names that a line tells; prose does not take them away.
    fn note_names(&mut self, names: Names) {
        if names != Names::Prose {
            self.names = names;
        }
    }

    fn take_numbers(&mut self, line: &str) -> Result<Taken, Bad> {
        let mut words = cells(line);
        if self.layout.is_none() {
            // Names that need more columns than there are belong to prose.
            match &self.names {
                Names::Poses(roles) if roles.last() < words.len() => {
                    self.layout = Some(Layout::Named(roles.clone()));
                }
                Names::Poses(roles) if roles.is_w_first() => {
                    return Err(Bad::File(format!(
                        "{} columns; the names before it are of {} or more, with w first",
                        words.len(),
                        roles.last() + 1
                    )));
                }
                Names::Wrong { columns, reason } if *columns == words.len() => {
                    return Err(Bad::File(reason.clone()));
                }
                _ => {}
            }
        }
        if !matches!(self.layout, Some(Layout::Named(_))) {
            words = numbers(line);
        }
        let layout = match &self.layout {
            Some(layout) => layout.clone(),
            None => {
                let found = match words.len() {
                    8 => Layout::Tum,
                    7 => Layout::Bare,
                    12 | 16 => Layout::Matrix { has_time: false },
                    13 | 17 => Layout::Matrix { has_time: true },
                    4 => Layout::Rows,
                    other => return Err(no_row(other_count(other))),
                };
                self.layout.insert(found).clone()
            }
        };
        let was_plain = self.are_plain;
        self.are_plain &= match &layout {
            Layout::Tum | Layout::Bare => !line.contains([';', '|']),
            Layout::Matrix { has_time } => !has_time && words.len() == 12 && !line.contains([';', '|']),
            Layout::Named(roles) => roles.are_those_of_tum() && words.len() == 8 && !self.has_header,
            Layout::Rows => false,
        };
        let cells = Cells { words, separator: Separator::of(line) };
        let taken = self.take_cells(&layout, &cells);
        if taken.is_err() {
            self.are_plain = was_plain;
        }
        taken
    }

    fn take_cells(&mut self, layout: &Layout, cells: &Cells<'_>) -> Result<Taken, Bad> {
        let rules = if self.are_plain { self.rules } else { Rules::Strict };
        let columns = match layout {
            Layout::Named(_) | Layout::Rows => None,
            Layout::Tum => Some(8),
            Layout::Bare => Some(7),
            Layout::Matrix { has_time } => Some(if *has_time { 13 } else { 12 }),
        };
        let found = cells.words.len();
        if let Some(columns) = columns
            && found != columns
            && !(matches!(layout, Layout::Matrix { .. }) && found == columns + 4)
        {
            let reason = format!("{found} numbers; the lines before have {columns}");
            // A row that ends early was lost.
            let kind = if found < columns { BadKind::Lost } else { BadKind::Odd };
            let has_time = matches!(layout, Layout::Tum | Layout::Matrix { has_time: true });
            let stamp = if has_time { self.stamp(cells, 0, None) } else { Stamp::None };
            return Err(Bad::Row(BadRow { reason, kind, stamp }));
        }
        let stamp = match layout {
            Layout::Named(Roles { time: Some(TimeColumns::One(at, digits)), .. }) => {
                self.stamp(cells, *at, *digits)
            }
            Layout::Named(Roles { time: Some(TimeColumns::Two { seconds, nanoseconds }), .. }) => {
                stamp_of_two(cells, *seconds, *nanoseconds)
            }
            Layout::Tum | Layout::Matrix { has_time: true } => self.stamp(cells, 0, None),
            Layout::Named(_) | Layout::Bare | Layout::Matrix { has_time: false } | Layout::Rows => {
                Stamp::None
            }
        };
        let pose = match layout {
            Layout::Rows => return self.take_matrix_line(cells),
            Layout::Named(Roles { position, units, quaternion, .. }) => {
                let [px, py, pz] = *position;
                let [qx, qy, qz, qw] = *quaternion;
                cells.all(&[px, py, pz, qx, qy, qz, qw]).and_then(|mut numbers| {
                    numbers.iter_mut().zip(units).for_each(|(number, unit)| *number = unit.metres(*number));
                    pose_of(&numbers, rules)
                })
            }
            Layout::Tum => cells.all(&[1, 2, 3, 4, 5, 6, 7]).and_then(|numbers| pose_of(&numbers, rules)),
            Layout::Bare => cells.all(&[0, 1, 2, 3, 4, 5, 6]).and_then(|numbers| pose_of(&numbers, rules)),
            Layout::Matrix { has_time } => {
                let first = usize::from(*has_time);
                let numbers = cells.all(&(first..found).collect::<Vec<_>>());
                if let Ok(numbers) = &numbers {
                    self.are_plain = self.are_plain && Pose::of_matrix(numbers.as_chunks().0).is_ok();
                }
                numbers.and_then(|numbers| matrix_of(&numbers).map_err(|reason| (BadKind::Odd, reason)))
            }
        };
        match pose {
            Ok(pose) => {
                let has_unnamed_quaternion = matches!(layout, Layout::Tum | Layout::Bare);
                Ok(Taken::Row(Row { stamp, pose, has_unnamed_quaternion }))
            }
            Err((kind, reason)) => Err(Bad::Row(BadRow { reason, kind, stamp })),
        }
    }

    /// Takes a line of a matrix of 4x4. Of a line that cannot be read the matrix is lost, and it ends where it would.
    fn take_matrix_line(&mut self, cells: &Cells<'_>) -> Result<Taken, Bad> {
        let line = match (cells.words.len(), cells.all(&[0, 1, 2, 3])) {
            (4, Ok(numbers)) => numbers,
            (4, Err((kind, reason))) => self.matrix_line_fault(kind, reason),
            (other, _) => {
                self.matrix_line_fault(BadKind::Odd, format!("{other} numbers; the lines before have 4"))
            }
        };
        self.matrix.extend(line);
        if self.matrix.len() < 16 {
            return Ok(Taken::Nothing);
        }
        let mut numbers = std::mem::take(&mut self.matrix);
        let stamp = match numbers.last_mut() {
            Some(corner) if corner.is_finite() && *corner != 1.0 => {
                *corner = 1.0;
                self.stamp(cells, 3, None)
            }
            _ => Stamp::None,
        };
        if let Some(fault) = self.matrix_fault.take() {
            return Err(Bad::Row(BadRow { stamp, ..fault }));
        }
        match matrix_of(&numbers) {
            Ok(pose) => Ok(Taken::Row(Row { stamp, pose, has_unnamed_quaternion: false })),
            Err(reason) => Err(Bad::Row(BadRow { reason, kind: BadKind::Odd, stamp })),
        }
    }

    fn matrix_line_fault(&mut self, kind: BadKind, reason: String) -> Vec<f64> {
        self.matrix_fault.get_or_insert(BadRow { reason, kind, stamp: Stamp::None });
        vec![f64::NAN; 4]
    }

    fn stamp(&mut self, cells: &Cells<'_>, at: usize, named: Option<i32>) -> Stamp {
        let word = cells.words.get(at).copied().unwrap_or_default();
        let word = match cells.separator {
            Separator::Mark(',') => Cow::Borrowed(word),
            _ => Cow::Owned(word.replace(',', ".")),
        };
        let digits = named.or(self.digits).or_else(|| digits_of(&word));
        let Some(stamp_ns) = digits.and_then(|digits| stamp_of(&word, digits)) else {
            return Stamp::Unreadable;
        };
        self.digits = digits;
        Stamp::At(stamp_ns)
    }
}

/// A line before all poses, perhaps their number.
fn no_row(reason: String) -> Bad {
    Bad::Row(BadRow { reason, kind: BadKind::Words, stamp: Stamp::None })
}

fn other_count(numbers: usize) -> String {
    let hint = match numbers {
        6 => {
            "; roll, pitch and yaw are not read, as they have many conventions: save quaternions or matrices"
        }
        9 => {
            "; seconds and nanoseconds in two columns need a first line with names: sec nsec x y z qx qy qz qw"
        }
        _ => "",
    };
    format!("{numbers} numbers; a pose is {FORMS}{hint}")
}

fn pose_of(numbers: &[f64], rules: Rules) -> Result<RigidPose, (BadKind, String)> {
    let &[x, y, z, qx, qy, qz, qw] = numbers else { return Err((BadKind::Odd, "no pose".into())) };
    pose([x, y, z, qx, qy, qz, qw], rules).map_err(|reason| {
        // Some programs write zeros where they lost track.
        let is_zero = [qx, qy, qz, qw] == [0.0; 4];
        (if is_zero { BadKind::Lost } else { BadKind::Odd }, reason)
    })
}

/// A number with an exponent if it would have many digits without.
fn short(number: f64) -> String {
    let is_short = number == 0.0 || !number.is_finite() || (1e-4..1e9).contains(&number.abs());
    if is_short { number.to_string() } else { format!("{number:e}") }
}

/// The pose of x y z and a quaternion.
pub(super) fn pose(numbers: [f64; 7], rules: Rules) -> Result<RigidPose, String> {
    let [x, y, z, qx, qy, qz, qw] = numbers;
    let pose = RigidPose { position_m: [x, y, z], quaternion: [qx, qy, qz, qw] };
    let length = (qx * qx + qy * qy + qz * qz + qw * qw).sqrt();
    if !pose.is_valid() || (rules == Rules::Strict && (length - 1.0).abs() > 0.1) {
        let hint =
            if length.is_finite() && length > 1e-6 { "; are these angles, roll, pitch and yaw?" } else { "" };
        let [qx, qy, qz, qw] = pose.quaternion.map(short);
        let length = if length < 1e6 { format!("{length:.3}") } else { short(length) };
        return Err(format!("the quaternion {qx} {qy} {qz} {qw} has length {length}, not 1{hint}"));
    }
    Ok(pose)
}
