//! Locations of the values of a point in the bytes of `sensor_msgs/PointCloud2`.

use super::point_field::{FieldType, PointField};

/// Location of a value in a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    pub(super) offset: usize,
    pub(super) kind: FieldType,
}

/// Location and meaning of the time of a point.
#[derive(Clone, Copy, Debug)]
pub(super) enum TimeColumn {
    /// Nanoseconds (integers) or seconds (`f32`) after the stamp.
    AfterStamp(Column),
    /// `f64`, usually since the epoch.
    Double(usize),
    /// Two 32-bit values that form a 64-bit time: nanoseconds since the epoch.
    Wide(usize),
}

/// Names of fields that hold x, y and z together.
const VECTOR_NAMES: [&str; 2] = ["xyz", "position"];
/// Number of points to inspect for the byte order.
const LOOKED_AT: usize = 64;
/// Plausible coordinates in metres, except 0.
const SENSIBLE_M: std::ops::Range<f64> = 1e-6..1e7;

/// Returns the columns of x and y, and of z if there is one, or the reason why there are none.
pub(super) fn position_columns(
    fields: &[PointField],
    point_bytes: usize,
) -> std::result::Result<([Column; 2], Option<Column>), String> {
    let axis = |name: &str| any_of(&[name], |is_exact, name| find(fields, name, is_exact, point_bytes));
    let axes = [axis("x"), axis("y"), axis("z")];
    if let [Some(x), Some(y), Some(z)] = axes {
        return Ok(([x, y], Some(z)));
    }
    let vector = any_of(&VECTOR_NAMES, |is_exact, name| {
        let field = named(fields, name, is_exact).filter(|field| field.count >= 3)?;
        let first = find(fields, name, is_exact, point_bytes)?;
        let at = |k: usize| {
            let offset = field.offset.checked_add(k * first.kind.bytes())?;
            let end = offset.checked_add(first.kind.bytes())?;
            (end <= point_bytes).then_some(Column { offset, kind: first.kind })
        };
        Some(([at(0)?, at(1)?], Some(at(2)?)))
    });
    if let Some(vector) = vector {
        return Ok(vector);
    }
    let unused = |name: &&str| axis(name).is_none();
    let missing = ["x", "y", "z"].into_iter().find(unused).unwrap_or_default();
    let there = any_of(&[missing], |is_exact, name| named(fields, name, is_exact));
    match (axes, there) {
        ([Some(x), Some(y), None], None) => Ok(([x, y], None)),
        (_, Some(field)) if field.kind.is_some() => Err(format!(
            "the field {} at byte {} is outside of the point, which has {point_bytes} bytes (point_step)",
            field.name, field.offset
        )),
        (_, Some(field)) => Err(format!("the field {} has an unknown type", field.name)),
        (_, None) => {
            let names: Vec<&str> = fields.iter().map(|field| field.name.as_str()).collect();
            let names = names.join(", ");
            Err(format!("points of {point_bytes} bytes have no field {missing}; fields: {names}"))
        }
    }
}

/// Returns the number of points of a message whose size is announced as zero although it contains points.
pub(super) fn points_unannounced(
    height: u32,
    width: u32,
    point_bytes: usize,
    data_bytes: usize,
) -> Option<u32> {
    if (height != 0 && width != 0) || point_bytes == 0 || !data_bytes.is_multiple_of(point_bytes) {
        return None;
    }
    let count = u32::try_from(data_bytes / point_bytes).ok().filter(|count| *count > 0)?;
    let announced = height.max(width);
    (announced == 0 || announced == count).then_some(count)
}

/// Returns the bytes from one row to the next. Some drivers set `row_step` to 0, to the size of the whole cloud or to
/// the number of points. Rows are then contiguous, as viewers that only use `point_step` assume.
pub(super) fn row_bytes_of(
    row_step: usize,
    height: u32,
    width: u32,
    point_bytes: usize,
    data_bytes: usize,
) -> Option<usize> {
    let row = point_bytes.checked_mul(width as usize)?;
    if height <= 1 || row_step <= row {
        return Some(row);
    }
    let whole = row.checked_mul(height as usize);
    let needed = row_step.checked_mul(height as usize - 1).and_then(|rows| rows.checked_add(row));
    let is_there = needed.is_some_and(|needed| needed <= data_bytes);
    let is_without_gaps = whole.is_some_and(|whole| whole == data_bytes || row_step >= whole);
    Some(if !is_there && is_without_gaps { row } else { row_step })
}

/// Returns whether the first points are plausible in little-endian order and implausible in big-endian order.
pub(super) fn is_little_endian(data: &[u8], point_bytes: usize, columns: &[Column]) -> bool {
    let (mut little, mut big, mut all) = (0, 0, 0);
    for point in data.chunks_exact(point_bytes.max(1)).take(LOOKED_AT) {
        for column in columns.iter().filter(|column| matches!(column.kind, FieldType::F32 | FieldType::F64)) {
            let bytes = point.get(column.offset..).unwrap_or_default();
            let values = [false, true].map(|is_big| column.kind.value(bytes, is_big).unwrap_or(f64::NAN));
            if values == [0.0; 2] || values.iter().any(|value| value.is_nan()) {
                continue;
            }
            let [is_little, is_big] = values.map(|value| value == 0.0 || SENSIBLE_M.contains(&value.abs()));
            all += 1;
            little += usize::from(is_little);
            big += usize::from(is_big);
        }
    }
    all >= 6 && 10 * little >= 9 * all && 2 * big < all
}

/// Returns the first match for these names: case-sensitive first, then in any case.
pub(super) fn any_of<T>(names: &[&str], find: impl Fn(bool, &str) -> Option<T>) -> Option<T> {
    [true, false].into_iter().find_map(|is_exact| names.iter().find_map(|name| find(is_exact, name)))
}

/// Finds a field by name. `T` does not match `t`, because it is a temperature.
fn named<'f>(fields: &'f [PointField], name: &str, is_exact: bool) -> Option<&'f PointField> {
    let is_it = |field: &&PointField| match is_exact || name == "t" {
        true => field.name == name,
        false => field.name.eq_ignore_ascii_case(name),
    };
    fields.iter().find(is_it)
}

/// Finds a field that is within a point by name.
pub(super) fn find(fields: &[PointField], name: &str, is_exact: bool, point_bytes: usize) -> Option<Column> {
    column_of(named(fields, name, is_exact)?, point_bytes)
}

/// Returns the column of a field that is within a point.
pub(super) fn column_of(field: &PointField, point_bytes: usize) -> Option<Column> {
    let kind = field.kind?;
    let end = field.offset.checked_add(kind.bytes())?;
    (end <= point_bytes).then_some(Column { offset: field.offset, kind })
}

pub(super) fn time_column(
    fields: &[PointField],
    name: &str,
    is_exact: bool,
    point_bytes: usize,
) -> Option<TimeColumn> {
    let column = find(fields, name, is_exact, point_bytes)?;
    let is_pair = named(fields, name, is_exact).is_some_and(|field| field.count == 2);
    let is_whole = column.offset.checked_add(8).is_some_and(|end| end <= point_bytes);
    Some(match column.kind {
        FieldType::F64 => TimeColumn::Double(column.offset),
        FieldType::U32 if is_pair && is_whole => TimeColumn::Wide(column.offset),
        _ => TimeColumn::AfterStamp(column),
    })
}
