use super::header::Header;
use super::point_field::{FieldType, PointField};
use super::point_layout::{
    Column, TimeColumn, any_of, column_of, find, is_little_endian, points_unannounced, position_columns,
    row_bytes_of, time_column,
};
use crate::read::attribute_columns::{AttributeColumns, AttributeValues};
use crate::read::cloud::CloudPoint;
use crate::ros::wire::{Decoded, Wire, WireError, WireReader};
use crate::spill::FilePart;
use std::cell::RefCell;
use voxtile::Result;
use voxtile::scan::AttributeSet;

/// `sensor_msgs/PointCloud2` with its undecoded points.
#[derive(Clone, Debug)]
pub struct PointCloud2<'a> {
    /// Stamp and frame.
    pub header: Header,
    /// Number of rows; 1 if the cloud is not organised.
    pub height: u32,
    /// Points per row.
    pub width: u32,
    /// All fields, in message order.
    pub fields: Vec<PointField>,
    is_big_endian: bool,
    point_bytes: usize,
    row_bytes: usize,
    /// Bytes of the points, or the available part of them.
    data: &'a [u8],
    /// Offset of the points in the message.
    data_at: u64,
    data_bytes: usize,
    /// Columns of x and y.
    xyz: [Column; 2],
    z: Option<Column>,
    intensity: Option<Column>,
    time: Option<TimeColumn>,
    /// Fields of the attributes to read, as indices of `fields`.
    attributes: AttributeColumns,
    /// Converts values to attributes.
    values: RefCell<AttributeValues>,
    repairs: Vec<&'static str>,
}

const INTENSITY_NAMES: [&str; 5] = ["intensity", "Intensity", "i", "reflectivity", "reflectance"];
const TIME_NAMES: [&str; 8] =
    ["t", "time", "time_stamp", "timestamp", "offset_time", "timeOffset", "time_offset", "stamps"];
/// Limit for the fields of a point.
const MAX_FIELDS: usize = 1024;
/// Number of bytes read from the start of a large message. They must include everything before the points.
pub(crate) const MAX_HEAD_BYTES: u64 = 1 << 20;
/// Size of the parts in which a large message is read.
const PIECE_BYTES: usize = 1 << 16;
/// Limit for the size of a point in a large message.
const MAX_POINT_BYTES: usize = 1 << 20;
/// Times of type `f64` above this are nanoseconds: as seconds they would be three million years.
const MIN_NANOSECONDS: f64 = 1e14;

impl<'a> PointCloud2<'a> {
    /// Decodes a message.
    ///
    /// # Errors
    ///
    /// The message is truncated, x or y is missing, or a field is outside of a point.
    pub fn decode(wire: Wire, bytes: &'a [u8]) -> Decoded<Self> {
        Self::decode_start(wire, bytes, bytes.len() as u64)
    }

    /// Decodes a message of `len` bytes from its first bytes. [`PointCloud2::visit_part`] visits its points.
    pub(crate) fn decode_start(wire: Wire, bytes: &'a [u8], len: u64) -> Decoded<Self> {
        let mut reader = WireReader::of_start(wire, bytes, len)?;
        let header = Header::read(&mut reader)?;
        let (mut height, mut width) = (reader.u32()?, reader.u32()?);
        let count = reader.sequence(PointField::MIN_BYTES)?;
        if count > MAX_FIELDS {
            return Err(
                reader.error(format!("points have {count} fields; at most {MAX_FIELDS} are supported"))
            );
        }
        let fields = (0..count).map(|_| PointField::read(&mut reader)).collect::<Decoded<Vec<_>>>()?;
        let is_big_endian = reader.u8()? != 0;
        let (point_bytes, row_bytes) = (reader.u32()? as usize, reader.u32()? as usize);
        let (data, data_at, data_bytes) = reader.start_of_bytes()?;
        if point_bytes == 0 && width != 0 && height != 0 {
            return Err(reader.error("point_step is 0"));
        }
        let mut repairs = Vec::new();
        let (xyz, z) = match position_columns(&fields, point_bytes) {
            Ok(columns) => columns,
            // Some drivers send clouds without points and without fields.
            Err(_) if data_bytes == 0 && (width == 0 || height == 0) => {
                let none = Column { offset: 0, kind: FieldType::U8 };
                ([none; 2], Some(none))
            }
            Err(reason) => return Err(reader.error(reason)),
        };
        if z.is_none() {
            repairs.push("have no field z: 0 is used");
        }
        let intensity = any_of(&INTENSITY_NAMES, |is_exact, name| find(&fields, name, is_exact, point_bytes));
        let time = any_of(&TIME_NAMES, |is_exact, name| time_column(&fields, name, is_exact, point_bytes));
        if let Some(count) = points_unannounced(height, width, point_bytes, data_bytes) {
            (height, width) = (1, count);
            repairs.push("announce no points, but contain points, which are read");
        }
        let Some(row_bytes) = row_bytes_of(row_bytes, height, width, point_bytes, data_bytes) else {
            return Err(reader.error("width * point_step is too large"));
        };
        let is_big_endian = is_big_endian && {
            let columns: Vec<Column> = xyz.into_iter().chain(z).collect();
            let is_wrong = is_little_endian(data, point_bytes, &columns);
            repairs.extend(is_wrong.then_some("are marked as big-endian, but are little-endian"));
            !is_wrong
        };
        Ok(Self {
            header,
            height,
            width,
            fields,
            is_big_endian,
            point_bytes,
            row_bytes,
            data,
            data_at,
            data_bytes,
            xyz,
            z,
            intensity,
            time,
            attributes: AttributeColumns::default(),
            values: RefCell::default(),
            repairs,
        })
    }

    /// Sets the attributes to read. `values` are those of the previous message.
    pub fn read_attributes(&mut self, wanted: AttributeSet, values: AttributeValues) {
        let column = |at: usize| column_of(self.fields.get(at)?, self.point_bytes);
        // Fields outside of a point are not there.
        let names = (0..self.fields.len()).map(|at| column(at).and_then(|_| self.fields.get(at)));
        let names = names.map(|field| field.map_or("", |field| &field.name));
        let is_packed = |at: usize| column(at).is_some_and(|column| column.kind.bytes() == size_of::<u32>());
        let attributes = AttributeColumns::of(names, wanted, is_packed);
        let kinds = attributes.colour_kinds(|at| column(at).map(|column| column.kind.scalar()));
        self.attributes = attributes;
        *self.values.get_mut() = values;
        self.values.get_mut().continue_with(kinds);
    }

    /// Returns which of the attributes to read the points have.
    pub fn attributes(&self) -> AttributeSet {
        self.attributes.set()
    }

    /// Returns the converter of attributes, with its counts.
    pub fn into_values(self) -> AttributeValues {
        self.values.into_inner()
    }

    /// Returns whether points have intensities.
    pub fn has_intensities(&self) -> bool {
        self.intensity.is_some()
    }

    /// Returns whether points have times.
    pub fn has_times(&self) -> bool {
        self.time.is_some()
    }

    /// Returns the corrections of inconsistent messages, each as the end of a sentence about clouds.
    pub fn repairs(&self) -> &[&'static str] {
        &self.repairs
    }

    /// Returns the number of points according to the message's width and height.
    pub fn points_claimed(&self) -> u64 {
        u64::from(self.height) * u64::from(self.width)
    }

    /// Iterates over the points whose bytes are available, in order.
    pub fn points(&self) -> impl Iterator<Item = CloudPoint> + '_ {
        let rows =
            (0..self.height as usize).map_while(|row| self.data.get(row.checked_mul(self.row_bytes)?..));
        // Rows of width 0 have no points, whatever their number.
        let rows = rows.take(if self.width == 0 { 0 } else { usize::MAX });
        rows.flat_map(|row| row.chunks_exact(self.point_bytes.max(1)).take(self.width as usize))
            .map(|point| self.point(point))
    }

    /// Visits the points of a large message decoded by [`PointCloud2::decode_start`].
    pub(crate) fn visit_part(
        &self,
        message: &FilePart,
        visit: &mut dyn FnMut(CloudPoint) -> Result<()>,
    ) -> Result<Option<WireError>> {
        let point_bytes = self.point_bytes.max(1);
        if point_bytes > MAX_POINT_BYTES {
            let reason = format!("points have {point_bytes} bytes; at most {MAX_POINT_BYTES} are supported");
            return Ok(Some(WireError { byte: 0, reason }));
        }
        let (mut height, mut width) = (self.height as usize, self.width as usize);
        // Rows without gaps are read as a single row.
        if point_bytes.checked_mul(width) == Some(self.row_bytes)
            && let Some(points) = height.checked_mul(width)
        {
            (height, width) = (1, points);
        }
        let at_a_time = (PIECE_BYTES / point_bytes).max(1);
        let (mut bytes, mut there) = (Vec::new(), 0_u64);
        for row in 0..if width == 0 { 0 } else { height } {
            let start = row.checked_mul(self.row_bytes).filter(|start| *start <= self.data_bytes);
            let Some(start) = start else { break };
            let points = ((self.data_bytes - start) / point_bytes).min(width);
            for first in (0..points).step_by(at_a_time) {
                let count = at_a_time.min(points - first);
                bytes.resize(count * point_bytes, 0);
                message.read_at(self.data_at + (start + first * point_bytes) as u64, &mut bytes)?;
                bytes.chunks_exact(point_bytes).try_for_each(|point| visit(self.point(point)))?;
                there += count as u64;
            }
        }
        Ok(self.is_short().then(|| self.shortage_of(there)))
    }

    /// Returns the reason if there are fewer points than the message announces.
    pub fn shortage(&self) -> Option<WireError> {
        self.is_short().then(|| self.shortage_of(self.points().count() as u64))
    }

    fn is_short(&self) -> bool {
        let rows_before = (self.height as usize).checked_sub(1);
        let last_row = rows_before.and_then(|rows| rows.checked_mul(self.row_bytes));
        let last_row_bytes = self.point_bytes.checked_mul(self.width as usize);
        let needed = last_row.zip(last_row_bytes).and_then(|(rows, row)| rows.checked_add(row));
        self.points_claimed() > 0 && needed.is_none_or(|needed| needed > self.data_bytes)
    }

    fn shortage_of(&self, there: u64) -> WireError {
        let (claimed, bytes) = (self.points_claimed(), self.data_bytes);
        let reason = format!("{claimed} points are announced, but {bytes} bytes of data contain {there}");
        WireError { byte: 0, reason }
    }

    fn point(&self, point: &[u8]) -> CloudPoint {
        let [x_m, y_m] = self.xyz.map(|column| self.value(point, column));
        let position_m = [x_m, y_m, self.z.map_or(0.0, |column| self.value(point, column))];
        // Sensors write NaN or all zeros for points without a return.
        let is_return = position_m.iter().all(|m| m.is_finite()) && position_m != [0.0; 3];
        let mut cloud_point = CloudPoint {
            position_m: if is_return { position_m } else { [f64::NAN; 3] },
            intensity: self.intensity.map_or(0.0, |column| self.value(point, column) as f32),
            time_s: self.time.map_or(0.0, |time| self.time_s(point, time)),
            colour: None,
            class: None,
            is_return,
        };
        if !self.attributes.set().is_none() {
            let column = |at: usize| column_of(self.fields.get(at)?, self.point_bytes);
            let value = |at: usize| column(at).map_or(f64::NAN, |column| self.value(point, column));
            // A packed colour is read as bits, because as a float it may be NaN.
            let bits = |at: usize| {
                let kind = FieldType::U32;
                column(at).map(|column| self.value(point, Column { kind, ..column }) as u32)
            };
            self.attributes.set_in(&mut cloud_point, &mut self.values.borrow_mut(), value, bits);
        }
        cloud_point
    }

    /// Decodes a value of a point. Columns are always within a point.
    fn value(&self, point: &[u8], column: Column) -> f64 {
        let bytes = point.get(column.offset..).unwrap_or_default();
        column.kind.value(bytes, self.is_big_endian).unwrap_or(f64::NAN)
    }

    fn time_s(&self, point: &[u8], time: TimeColumn) -> f64 {
        let seconds = match time {
            TimeColumn::AfterStamp(column) if column.kind == FieldType::F32 => self.value(point, column),
            TimeColumn::AfterStamp(column) => self.value(point, column) * 1e-9,
            TimeColumn::Double(offset) => {
                let value = self.value(point, Column { offset, kind: FieldType::F64 });
                let seconds = if value.abs() > MIN_NANOSECONDS { value * 1e-9 } else { value };
                self.after_stamp_s(seconds)
            }
            TimeColumn::Wide(offset) => {
                let bytes = point.get(offset..).and_then(|bytes| bytes.first_chunk()).copied();
                let bytes = bytes.unwrap_or_default();
                let stamp_ns =
                    if self.is_big_endian { u64::from_be_bytes(bytes) } else { u64::from_le_bytes(bytes) };
                let after_ns = i128::from(stamp_ns) - i128::from(self.header.stamp_ns);
                if after_ns.unsigned_abs() < u128::from(stamp_ns) {
                    after_ns as f64 * 1e-9
                } else {
                    stamp_ns as f64 * 1e-9
                }
            }
        };
        if seconds.is_finite() { seconds } else { 0.0 }
    }

    /// Converts a time that counts either from the epoch or from the stamp: the interpretation closer to the stamp is
    /// used.
    fn after_stamp_s(&self, seconds: f64) -> f64 {
        let (whole_s, rest_ns) =
            (self.header.stamp_ns.div_euclid(1_000_000_000), self.header.stamp_ns.rem_euclid(1_000_000_000));
        let after = (seconds - whole_s as f64) - rest_ns as f64 * 1e-9;
        if after.abs() < seconds.abs() { after } else { seconds }
    }
}
