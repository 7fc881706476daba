use super::RigidPose;
use super::binary::check_text;
use super::cells::{Cells, cells, numbers, stamp_of_two, starts_with_number};
use super::g2o::{GraphLine, vertex};
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

/// Meaning of the numbers of a line, set by the first line of numbers.
#[derive(Clone, Debug)]
enum Layout {
    /// Named columns.
    Named(Roles),
    /// `t x y z qx qy qz qw`.
    Tum,
    /// `x y z qx qy qz qw`.
    Bare,
    /// A 3x4 or 4x4 matrix, optionally preceded by a time.
    Matrix { has_time: bool },
    /// A 4x4 matrix on four lines. Some programs store the time in the corner that is otherwise 1.
    Rows,
    /// A pose graph of g2o.
    Graph,
}

/// How strictly lines of numbers are interpreted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Rules {
    /// Stamps must be times, and quaternions must have a length near 1.
    #[default]
    Strict,
    /// Compatible with older versions, for the poses of PCD files: any number is accepted as a stamp, an invalid stamp
    /// is ignored, and quaternions may have any nonzero length.
    Lenient,
}

/// Form of a text with poses.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Form {
    /// Whether older versions accepted this text for the poses of PCD files: lines of 8 or 7 numbers in TUM order or 12
    /// in KITTI order, separated by blanks and commas, with comments after `#`.
    pub(crate) is_plain: bool,
    /// Whether stamps, if there are any, are in seconds.
    pub(crate) is_in_seconds: bool,
    /// Whether the poses are matrices.
    pub(crate) is_matrix: bool,
    /// Units of x, y and z if not metres.
    pub(crate) unit: Option<[&'static str; 3]>,
}

/// Reads the poses of a text. A header line may follow comments and other lines, but must precede the poses.
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
            format!("the file ends within a 4x4 matrix, after {} of its lines", text.matrix.len() / 4);
        let bad = BadRow { reason, kind: BadKind::Words, stamp: Stamp::None };
        poses.push(Err(bad), |reason| lines.error(reason))?;
    }
    Ok(text.form())
}

/// Returns whether a text with this start contains poses.
pub(crate) fn looks_like_poses(start: &[u8]) -> bool {
    let start = String::from_utf8_lossy(start);
    let start = start.trim_start_matches('\u{feff}');
    let mut text = TextPoses::new(Rules::Strict, false);
    let lines = start.lines().map(str::trim).filter(|line| !line.is_empty());
    for line in lines.filter(|line| comment_of(line).is_none()) {
        match text.take(line) {
            Ok(Taken::Row(_)) => return true,
            // A header line may precede the poses, and a matrix may take four lines.
            Ok(Taken::Nothing) => {}
            Err(_) => return false,
        }
    }
    false
}

/// UTF-8 byte order mark, written by some Windows editors.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";
/// Supported forms of a pose, for messages.
const FORMS: &str = "8 numbers (TUM: t x y z qx qy qz qw), 7 without t, 12 or 16 (a 3x4 or 4x4 matrix, as in KITTI), \
                     one more if a time precedes the matrix, a table with a header line, or a pose graph of g2o \
                     (VERTEX_SE3:QUAT)";

/// Content of a line.
enum Taken {
    Row(Row),
    /// A comment, column names, or part of a matrix.
    Nothing,
}

/// Problem with a line.
enum Bad {
    /// Only this row is invalid.
    Row(BadRow),
    /// The poses of the whole file cannot be interpreted.
    File(String),
}

struct TextPoses {
    rules: Rules,
    layout: Option<Layout>,
    names: Names,
    /// Whether the column names are on a line of their own, not in a comment.
    has_header: bool,
    /// Whether all lines so far have the plain form.
    are_plain: bool,
    /// Power of ten from the unit of time to nanoseconds: 9 for seconds.
    digits: Option<i32>,
    /// Numbers of an incomplete matrix; NaN for unreadable ones.
    matrix: Vec<f64>,
    /// The first problem within this matrix.
    matrix_fault: Option<BadRow>,
    /// Id of the last vertex of a pose graph.
    last_id: Option<u64>,
}

impl TextPoses {
    fn new(rules: Rules, has_bom: bool) -> Self {
        Self {
            rules,
            layout: None,
            names: Names::Prose,
            has_header: false,
            are_plain: !has_bom,
            digits: None,
            matrix: Vec::new(),
            matrix_fault: None,
            last_id: None,
        }
    }

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
        if let Some(found) = GraphLine::of(line)
            && matches!(self.layout, None | Some(Layout::Graph))
        {
            return self.take_graph_line(&found);
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
                    "`{line:.60}` is neither a pose nor a header line: a pose is {FORMS}"
                ))),
            };
        }
        self.take_numbers(line)
    }

    fn take_graph_line(&mut self, line: &GraphLine<'_>) -> Result<Taken, Bad> {
        self.layout = Some(Layout::Graph);
        self.are_plain = false;
        let words = match line {
            GraphLine::Pose(words) => words,
            GraphLine::OtherPose(tag) => {
                return Err(Bad::File(format!(
                    "`{tag}` is a pose in the plane or with angles; save VERTEX_SE3:QUAT, or the poses as TUM"
                )));
            }
            GraphLine::Other => return Ok(Taken::Nothing),
        };
        let (id, pose) = vertex(words).map_err(Bad::File)?;
        if let Some(last) = self.last_id.filter(|last| *last >= id) {
            return Err(Bad::File(format!(
                "vertex {id} follows vertex {last}: sort the vertices by their ids, because poses are assigned in \
                 order"
            )));
        }
        self.last_id = Some(id);
        let row = |pose| Taken::Row(Row { stamp: Stamp::None, pose, has_unnamed_quaternion: false });
        pose.map(row).map_err(Bad::Row)
    }

    /// Stores the column names of a line. Prose does not replace them.
    fn note_names(&mut self, names: Names) {
        if names != Names::Prose {
            self.names = names;
        }
    }

    fn take_numbers(&mut self, line: &str) -> Result<Taken, Bad> {
        let mut words = cells(line);
        if self.layout.is_none() {
            // A line naming more columns than the rows have was prose.
            match &self.names {
                Names::Poses(roles) if roles.last() < words.len() => {
                    self.layout = Some(Layout::Named(roles.clone()));
                }
                Names::Poses(roles) if roles.is_w_first() => {
                    return Err(Bad::File(format!(
                        "{} columns, but the header line has {} or more and w first",
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
            Layout::Rows | Layout::Graph => false,
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
            Layout::Named(_) | Layout::Rows | Layout::Graph => None,
            Layout::Tum => Some(8),
            Layout::Bare => Some(7),
            Layout::Matrix { has_time } => Some(if *has_time { 13 } else { 12 }),
        };
        let found = cells.words.len();
        if let Some(columns) = columns
            && found != columns
            && !(matches!(layout, Layout::Matrix { .. }) && found == columns + 4)
        {
            let reason = format!("{found} numbers, but the lines before have {columns}");
            // A row with too few numbers counts as a lost pose.
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
            Layout::Named(_)
            | Layout::Bare
            | Layout::Matrix { has_time: false }
            | Layout::Rows
            | Layout::Graph => Stamp::None,
        };
        let pose = match layout {
            Layout::Rows => return self.take_matrix_line(cells),
            Layout::Graph => Err((BadKind::Odd, "numbers without a tag in a pose graph".to_owned())),
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

    /// Adds a line of a 4x4 matrix. An unreadable line makes the whole matrix invalid, but still counts as one of its
    /// lines.
    fn take_matrix_line(&mut self, cells: &Cells<'_>) -> Result<Taken, Bad> {
        let line = match (cells.words.len(), cells.all(&[0, 1, 2, 3])) {
            (4, Ok(numbers)) => numbers,
            (4, Err((kind, reason))) => self.matrix_line_fault(kind, reason),
            (other, _) => {
                self.matrix_line_fault(BadKind::Odd, format!("{other} numbers, but the lines before have 4"))
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
            Separator::Char(',') => Cow::Borrowed(word),
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

/// A line before the first pose that is not a row, for instance the number of poses.
fn no_row(reason: String) -> Bad {
    Bad::Row(BadRow { reason, kind: BadKind::Words, stamp: Stamp::None })
}

fn other_count(numbers: usize) -> String {
    let hint = match numbers {
        6 => {
            "; roll, pitch and yaw are not supported, because they have many conventions: save quaternions or matrices"
        }
        9 => "; seconds and nanoseconds in two columns need the header line sec nsec x y z qx qy qz qw",
        _ => "",
    };
    format!("{numbers} numbers; a pose is {FORMS}{hint}")
}

fn pose_of(numbers: &[f64], rules: Rules) -> Result<RigidPose, (BadKind, String)> {
    let &[x, y, z, qx, qy, qz, qw] = numbers else { return Err((BadKind::Odd, "no pose".into())) };
    pose([x, y, z, qx, qy, qz, qw], rules).map_err(|reason| {
        // Some programs write zeros while tracking is lost.
        let is_zero = [qx, qy, qz, qw] == [0.0; 4];
        (if is_zero { BadKind::Lost } else { BadKind::Odd }, reason)
    })
}

/// Formats a number, with an exponent if it would otherwise have many digits.
fn short(number: f64) -> String {
    let is_short = number == 0.0 || !number.is_finite() || (1e-4..1e9).contains(&number.abs());
    if is_short { number.to_string() } else { format!("{number:e}") }
}

/// Builds a pose from x y z and a quaternion.
pub(super) fn pose(numbers: [f64; 7], rules: Rules) -> Result<RigidPose, String> {
    let [x, y, z, qx, qy, qz, qw] = numbers;
    let pose = RigidPose { position_m: [x, y, z], quaternion: [qx, qy, qz, qw] };
    let length = (qx * qx + qy * qy + qz * qz + qw * qw).sqrt();
    if !pose.is_valid() || (rules == Rules::Strict && (length - 1.0).abs() > 0.1) {
        let hint =
            if length.is_finite() && length > 1e-6 { "; are these roll, pitch and yaw angles?" } else { "" };
        let [qx, qy, qz, qw] = pose.quaternion.map(short);
        let length = if length < 1e6 { format!("{length:.3}") } else { short(length) };
        return Err(format!("the quaternion {qx} {qy} {qz} {qw} has length {length}, not 1{hint}"));
    }
    Ok(pose)
}
