use crate::read::scalar::Scalar;
use crate::ros::wire::{Decoded, WireReader};

/// Type of a field of `sensor_msgs/PointCloud2`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldType {
    /// `INT8`.
    I8,
    /// `UINT8`.
    U8,
    /// `INT16`.
    I16,
    /// `UINT16`.
    U16,
    /// `INT32`.
    I32,
    /// `UINT32`.
    U32,
    /// `FLOAT32`.
    F32,
    /// `FLOAT64`.
    F64,
}

/// `sensor_msgs/PointField`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PointField {
    /// Name.
    pub name: String,
    /// Byte offset in a point.
    pub offset: usize,
    /// Type; `None` for an unknown type code.
    pub kind: Option<FieldType>,
    /// Number of values; 0 means 1, as written by many drivers.
    pub count: u32,
}

impl PointField {
    /// Minimum size of a field description in a message.
    pub const MIN_BYTES: usize = 13;

    /// Reads a field description.
    ///
    /// # Errors
    ///
    /// The message is truncated.
    pub fn read(reader: &mut WireReader<'_>) -> Decoded<Self> {
        Ok(Self {
            name: reader.string()?,
            offset: reader.u32()? as usize,
            kind: FieldType::of(reader.u8()?),
            count: reader.u32()?,
        })
    }
}

impl FieldType {
    /// Returns the type with this code.
    pub fn of(number: u8) -> Option<Self> {
        Some(match number {
            1 => Self::I8,
            2 => Self::U8,
            3 => Self::I16,
            4 => Self::U16,
            5 => Self::I32,
            6 => Self::U32,
            7 => Self::F32,
            8 => Self::F64,
            _ => return None,
        })
    }

    /// Returns the size of a value in bytes.
    pub fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Returns the equal type of other formats.
    pub(crate) fn scalar(self) -> Scalar {
        match self {
            Self::I8 => Scalar::I8,
            Self::U8 => Scalar::U8,
            Self::I16 => Scalar::I16,
            Self::U16 => Scalar::U16,
            Self::I32 => Scalar::I32,
            Self::U32 => Scalar::U32,
            Self::F32 => Scalar::F32,
            Self::F64 => Scalar::F64,
        }
    }

    /// Decodes the value at the start of `bytes`. Returns `None` if there are too few bytes.
    pub fn value(self, bytes: &[u8], is_big_endian: bool) -> Option<f64> {
        macro_rules! number {
            ($type:ty) => {{
                let bytes = *bytes.first_chunk()?;
                let value =
                    if is_big_endian { <$type>::from_be_bytes(bytes) } else { <$type>::from_le_bytes(bytes) };
                f64::from(value)
            }};
        }
        Some(match self {
            Self::I8 => number!(i8),
            Self::U8 => number!(u8),
            Self::I16 => number!(i16),
            Self::U16 => number!(u16),
            Self::I32 => number!(i32),
            Self::U32 => number!(u32),
            Self::F32 => number!(f32),
            Self::F64 => number!(f64),
        })
    }
}
