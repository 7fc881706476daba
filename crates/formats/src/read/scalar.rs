/// Type of a number in a binary file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

/// Decodes the first bytes in either byte order.
macro_rules! number {
    ($kind:ty, $bytes:expr, $big:expr) => {{
        let mut array = [0; size_of::<$kind>()];
        for (to, from) in array.iter_mut().zip($bytes) {
            *to = *from;
        }
        if $big { <$kind>::from_be_bytes(array) } else { <$kind>::from_le_bytes(array) }
    }};
}

impl Scalar {
    /// Returns the type with this name: as in PLY (`uchar`, `float`), as in NumPy (`uint8`, `float32`), or short (`u8`,
    /// `f32`).
    pub(crate) fn named(name: &str) -> Option<Self> {
        Some(match name.to_ascii_lowercase().as_str() {
            "char" | "int8" | "i8" => Self::I8,
            "uchar" | "uint8" | "u8" => Self::U8,
            "short" | "int16" | "i16" => Self::I16,
            "ushort" | "uint16" | "u16" => Self::U16,
            "int" | "int32" | "i32" => Self::I32,
            "uint" | "uint32" | "u32" => Self::U32,
            "int64" | "long" | "i64" => Self::I64,
            "uint64" | "ulong" | "u64" => Self::U64,
            "float" | "float32" | "f32" => Self::F32,
            "double" | "float64" | "f64" => Self::F64,
            _ => return None,
        })
    }

    pub(crate) fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    pub(crate) fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    /// Decodes the value at the start of `bytes`. Missing bytes count as zero, so callers must check the length.
    pub(crate) fn value(self, bytes: &[u8], is_big_endian: bool) -> f64 {
        match self {
            Self::I8 => f64::from(number!(i8, bytes, is_big_endian)),
            Self::U8 => f64::from(number!(u8, bytes, is_big_endian)),
            Self::I16 => f64::from(number!(i16, bytes, is_big_endian)),
            Self::U16 => f64::from(number!(u16, bytes, is_big_endian)),
            Self::I32 => f64::from(number!(i32, bytes, is_big_endian)),
            Self::U32 => f64::from(number!(u32, bytes, is_big_endian)),
            Self::I64 => number!(i64, bytes, is_big_endian) as f64,
            Self::U64 => number!(u64, bytes, is_big_endian) as f64,
            Self::F32 => f64::from(number!(f32, bytes, is_big_endian)),
            Self::F64 => number!(f64, bytes, is_big_endian),
        }
    }
}
