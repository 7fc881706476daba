use super::matrix::matrix_of;
use super::pose_input::PoseInput;
use super::pose_rows::{BadKind, BadRow, PoseRows, Row, Stamp};
use super::text::{Rules, pose};
use super::time_unit::{digits_of_value, stamp_of_value};
use std::io::Read;
use std::path::Path;
use voxtile::{Error, FormatError, Result};

const MAGIC: &[u8] = b"\x93NUMPY";
const NO_ARRAY: &str = "is not a NumPy array in spite of its name: save it with numpy.save, or rename a text file of \
                        poses to .txt or .csv";
const CUT_HEADER: &str = "the file ends within its header: copy or save it again";
/// Limit for the header; longer headers are rejected.
const MAX_HEADER_BYTES: usize = 1 << 16;

/// Returns whether a file is a NumPy array, by its first bytes or its extension.
pub(super) fn is_npy(path: &Path, head: &[u8]) -> bool {
    head.starts_with(MAGIC) || path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("npy"))
}

/// Reads the poses of an array: N x 8 (TUM), N x 7 (without times), N x 12, N x 16, N x 3 x 4 or N x 4 x 4. Returns
/// whether they are matrices.
pub(super) fn read(path: &Path, mut input: PoseInput, poses: &mut PoseRows) -> Result<bool> {
    let fail = |error| Error::io(path, "read", error);
    let wrong = |at: u64, reason: String| FormatError::at_offset(at, reason).in_input(path);
    let mut start = Vec::new();
    (&mut input).take(8).read_to_end(&mut start).map_err(fail)?;
    let version = match *start.as_slice() {
        [.., version, _] if start.len() == 8 && start.starts_with(MAGIC) => version,
        _ => return Err(wrong(0, NO_ARRAY.into())),
    };
    if !(1..=3).contains(&version) {
        let reason = "its format version is not 1, 2 or 3: save it again with numpy.save";
        return Err(wrong(6, reason.into()));
    }
    let is_long = version >= 2;
    let mut length = [0; 4];
    let length_bytes = if is_long { &mut length[..] } else { &mut length[..2] };
    input.read_exact(length_bytes).map_err(|_| wrong(8, CUT_HEADER.into()))?;
    let header_bytes = u32::from_le_bytes(length) as usize;
    if header_bytes > MAX_HEADER_BYTES {
        return Err(wrong(8, format!("the header size of {header_bytes} bytes is invalid")));
    }
    let mut header = vec![0; header_bytes];
    input.read_exact(&mut header).map_err(|_| wrong(8, CUT_HEADER.into()))?;
    let header = String::from_utf8_lossy(&header).into_owned();
    let (width, rows, columns) = layout(&header).map_err(|reason| wrong(10, reason))?;
    let data_at = 8 + if is_long { 4 } else { 2 } + header_bytes as u64;
    let (mut record, mut numbers, mut digits) = (vec![0; columns * width], Vec::new(), None);
    for row in 0..rows {
        let at = data_at.saturating_add(row.saturating_mul((columns * width) as u64));
        input
            .read_exact(&mut record)
            .map_err(|_| wrong(at, format!("the file ends after {row} of {rows} poses")))?;
        numbers.clear();
        numbers.extend(record.chunks_exact(width).map(|bytes| match *bytes {
            [a, b, c, d] => f64::from(f32::from_le_bytes([a, b, c, d])),
            [a, b, c, d, e, f, g, h] => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
            _ => f64::NAN,
        }));
        let taken = row_of(&numbers, &mut digits);
        poses.push(taken, |reason| FormatError::at_record(row, reason).in_input(path))?;
    }
    Ok(columns >= 12)
}

/// Converts a row to a pose. The first stamp determines the unit of all stamps.
fn row_of(numbers: &[f64], digits: &mut Option<i32>) -> std::result::Result<Row, BadRow> {
    let (stamp, values) = match numbers {
        [time, values @ ..] if values.len() == 7 => (stamp_of(*time, digits), values),
        values => (Stamp::None, values),
    };
    let bad = |kind: BadKind| move |reason: String| BadRow { reason, kind, stamp };
    if !values.iter().all(|number| number.is_finite()) {
        return Err(bad(BadKind::Lost)("a number is not finite".into()));
    }
    match *values {
        [x, y, z, qx, qy, qz, qw] => {
            let pose = pose([x, y, z, qx, qy, qz, qw], Rules::Strict).map_err(bad(BadKind::Odd))?;
            Ok(Row { stamp, pose, has_unnamed_quaternion: true })
        }
        _ => {
            let pose = matrix_of(values).map_err(bad(BadKind::Odd))?;
            Ok(Row { stamp, pose, has_unnamed_quaternion: false })
        }
    }
}

fn stamp_of(time: f64, digits: &mut Option<i32>) -> Stamp {
    if !time.is_finite() {
        return Stamp::Unreadable;
    }
    let digits = *digits.get_or_insert_with(|| digits_of_value(time));
    stamp_of_value(time, digits).map_or(Stamp::Unreadable, Stamp::At)
}

/// Returns the bytes per number, the number of rows and the numbers per row.
fn layout(header: &str) -> std::result::Result<(usize, u64, usize), String> {
    let value = |key: &str| header.split_once(key).map(|(_, rest)| rest.trim_start_matches([':', ' ']));
    let Some(descr) = value("'descr'") else {
        return Err("its header has no type ('descr'): save it again with numpy.save".into());
    };
    if descr.starts_with('[') {
        let reason = "is a structured array: save a plain one with \
                      numpy.lib.recfunctions.structured_to_unstructured(poses)";
        return Err(reason.into());
    }
    let kind = descr.split('\'').nth(1).unwrap_or_default();
    let width = match kind {
        "<f8" => 8,
        "<f4" => 4,
        other => {
            return Err(format!(
                "numbers of type `{other}`; poses are little-endian floats: save it with astype('<f8')"
            ));
        }
    };
    if value("'fortran_order'").is_some_and(|rest| rest.starts_with("True")) {
        return Err("is in Fortran order: save numpy.ascontiguousarray(poses)".into());
    }
    let shape =
        value("'shape'").and_then(|rest| rest.strip_prefix('(')?.split(')').next()).unwrap_or_default();
    let sides: Vec<u64> = shape.split(',').filter_map(|side| side.trim().parse().ok()).collect();
    match *sides.as_slice() {
        [rows, columns @ (7 | 8)] => Ok((width, rows, columns as usize)),
        [rows, 12] | [rows, 3, 4] => Ok((width, rows, 12)),
        [rows, 16] | [rows, 4, 4] => Ok((width, rows, 16)),
        _ => Err(format!(
            "has the shape ({shape}); poses are N x 8 (t x y z qx qy qz qw), N x 7 (without t), N x 3 x 4 or N x 4 x \
             4; roll, pitch and yaw are not supported"
        )),
    }
}
