use std::fmt;

/// Serialization of the messages of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Wire {
    /// ROS 1: little-endian, without padding.
    Ros1,
    /// CDR of ROS 2: a header of four bytes states the byte order; numbers are aligned to their size.
    Cdr,
}

/// Decoding error of a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WireError {
    /// Byte offset in the message.
    pub byte: usize,
    /// Reason.
    pub reason: String,
}

impl fmt::Display for WireError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "byte {} of the message: {}", self.byte, self.reason)
    }
}

impl std::error::Error for WireError {}

/// Result of decoding.
pub type Decoded<T> = std::result::Result<T, WireError>;

/// Sequential reader of a serialized message.
#[derive(Clone, Debug)]
pub struct WireReader<'a> {
    bytes: &'a [u8],
    /// Length of the message. `bytes` may contain only its start.
    len: u64,
    at: usize,
    wire: Wire,
    /// Origin for alignment.
    origin: usize,
    /// Upper bound for the alignment of numbers.
    max_alignment: usize,
    is_big_endian: bool,
}

/// Size of the CDR header.
const CDR_HEADER: usize = 4;

macro_rules! numbers {
    ($($name:ident: $type:ty),*) => {$(
        #[doc = concat!("Reads the next number, of type `", stringify!($type), "`.")]
        ///
        /// # Errors
        ///
        /// The message ends before it.
        pub fn $name(&mut self) -> Decoded<$type> {
            let bytes = self.array()?;
            Ok(if self.is_big_endian { <$type>::from_be_bytes(bytes) } else { <$type>::from_le_bytes(bytes) })
        }
    )*};
}

impl<'a> WireReader<'a> {
    numbers!(u8: u8, u16: u16, i32: i32, u32: u32, u64: u64, f32: f32, f64: f64);

    /// Starts reading a message.
    ///
    /// # Errors
    ///
    /// The CDR header is missing or of a kind that ROS 2 does not write.
    pub fn new(wire: Wire, bytes: &'a [u8]) -> Decoded<Self> {
        Self::of_start(wire, bytes, bytes.len() as u64)
    }

    /// Starts reading a message of `len` bytes from its first bytes.
    pub(super) fn of_start(wire: Wire, bytes: &'a [u8], len: u64) -> Decoded<Self> {
        let mut reader = Self { bytes, len, at: 0, wire, origin: 0, max_alignment: 1, is_big_endian: false };
        if wire == Wire::Ros1 {
            return Ok(reader);
        }
        let header: [u8; CDR_HEADER] = reader.array()?;
        // The encodings of the DDS-XTypes standard with plain structures: CDR and CDR version 2.
        let (is_big_endian, max_alignment) = match [header[0], header[1]] {
            [0, 0] => (true, 8),
            [0, 1] => (false, 8),
            [0, 6] => (true, 4),
            [0, 7] => (false, 4),
            [high, low] => {
                let reason =
                    format!("the header states representation {high:02x} {low:02x}, but plain CDR is 00 01");
                return Err(WireError { byte: 0, reason });
            }
        };
        Ok(Self { origin: CDR_HEADER, is_big_endian, max_alignment, ..reader })
    }

    /// Creates an error at the current position.
    pub fn error(&self, reason: impl Into<String>) -> WireError {
        WireError { byte: self.at, reason: reason.into() }
    }

    /// Returns the serialization of the message.
    pub fn wire(&self) -> Wire {
        self.wire
    }

    /// Returns the number of bytes left.
    pub fn remaining(&self) -> usize {
        usize::try_from(self.len).unwrap_or(usize::MAX).saturating_sub(self.at)
    }

    /// Reads raw bytes.
    ///
    /// # Errors
    ///
    /// The message ends before them.
    pub fn bytes(&mut self, count: usize) -> Decoded<&'a [u8]> {
        let taken = self.at.checked_add(count).and_then(|end| self.bytes.get(self.at..end));
        let bytes = taken.ok_or_else(|| {
            if count <= self.remaining() {
                return self
                    .error(format!("there are more than {} bytes before the points", self.bytes.len()));
            }
            self.error(format!(
                "{count} bytes are needed, but {} are left: the message is truncated",
                self.remaining()
            ))
        })?;
        self.at += count;
        Ok(bytes)
    }

    /// Reads the length of a sequence whose items take at least `min_item_bytes` bytes each.
    ///
    /// # Errors
    ///
    /// The message is too short for the items.
    pub fn sequence(&mut self, min_item_bytes: usize) -> Decoded<usize> {
        let count = self.u32()? as usize;
        if count.checked_mul(min_item_bytes.max(1)).is_none_or(|bytes| bytes > self.remaining()) {
            let left = self.remaining();
            return Err(self.error(format!("a sequence has {count} items, but {left} bytes are left")));
        }
        Ok(count)
    }

    /// Reads a sequence of bytes.
    ///
    /// # Errors
    ///
    /// The message ends before them.
    pub fn byte_sequence(&mut self) -> Decoded<&'a [u8]> {
        let count = self.sequence(1)?;
        self.bytes(count)
    }

    /// Reads a sequence of bytes, as far as they are available, and returns its offset in the message and its length.
    pub(super) fn start_of_bytes(&mut self) -> Decoded<(&'a [u8], u64, usize)> {
        let count = self.sequence(1)?;
        let (at, there) = (self.at, count.min(self.bytes.len().saturating_sub(self.at)));
        let bytes = self.bytes(there)?;
        self.at = at.saturating_add(count);
        Ok((bytes, at as u64, count))
    }

    /// Reads a sequence of `f32`.
    ///
    /// # Errors
    ///
    /// The message ends before them.
    pub fn f32_sequence(&mut self) -> Decoded<Vec<f32>> {
        let count = self.sequence(4)?;
        (0..count).map(|_| self.f32()).collect()
    }

    /// Reads a string. Invalid UTF-8 is replaced.
    ///
    /// # Errors
    ///
    /// The message ends before it.
    pub fn string(&mut self) -> Decoded<String> {
        let bytes = self.byte_sequence()?;
        // CDR strings include a terminating NUL. ROS 1 strings do not, but some writers add one.
        let text = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        Ok(String::from_utf8_lossy(text).into_owned())
    }

    /// Reads a time in nanoseconds.
    ///
    /// # Errors
    ///
    /// The message ends before it.
    pub fn stamp_ns(&mut self) -> Decoded<i64> {
        let seconds = match self.wire {
            Wire::Ros1 => i64::from(self.u32()?),
            Wire::Cdr => i64::from(self.i32()?),
        };
        // At most 2^32 * 10^9 + 2^32, far below 2^63.
        Ok(seconds * 1_000_000_000 + i64::from(self.u32()?))
    }

    /// Reads the bytes of a number after its alignment padding.
    fn array<const N: usize>(&mut self) -> Decoded<[u8; N]> {
        let beyond = (self.at.saturating_sub(self.origin)) % N.min(self.max_alignment).max(1);
        if beyond != 0 {
            self.bytes(N.min(self.max_alignment) - beyond)?;
        }
        let at = self.at;
        let bytes = self.bytes(N)?;
        bytes.try_into().map_err(|_| WireError { byte: at, reason: "the message is truncated".to_owned() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cdr_aligns_after_its_header_in_both_byte_orders() {
        let little = [0, 1, 0, 0, 7, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 240, 63];
        let mut reader = WireReader::new(Wire::Cdr, &little).unwrap();
        assert_eq!((reader.u8(), reader.u32(), reader.f64()), (Ok(7), Ok(1), Ok(1.0)));
        let big = [0, 0, 0, 0, 7, 0, 0, 0, 0, 0, 0, 1, 63, 240, 0, 0, 0, 0, 0, 0];
        let mut reader = WireReader::new(Wire::Cdr, &big).unwrap();
        assert_eq!((reader.u8(), reader.u32(), reader.f64()), (Ok(7), Ok(1), Ok(1.0)));
        assert!(reader.u8().is_err());
    }

    #[test]
    fn version_two_of_cdr_aligns_doubles_to_four() {
        let bytes = [0, 7, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0, 0, 0, 240, 63];
        let mut reader = WireReader::new(Wire::Cdr, &bytes).unwrap();
        assert_eq!((reader.u8(), reader.f64()), (Ok(7), Ok(1.0)));
    }

    #[test]
    fn parameter_lists_are_an_error() {
        assert!(WireReader::new(Wire::Cdr, &[0, 3, 0, 0]).is_err());
        assert!(WireReader::new(Wire::Cdr, &[0, 1]).is_err());
    }

    #[test]
    fn strings_lose_their_nul_and_sequences_are_capped() {
        let bytes = [0, 1, 0, 0, 4, 0, 0, 0, b'm', b'a', b'p', 0, 255, 255, 255, 255];
        let mut reader = WireReader::new(Wire::Cdr, &bytes).unwrap();
        assert_eq!(reader.string().unwrap(), "map");
        assert!(reader.sequence(0).is_err());
        let mut reader = WireReader::new(Wire::Ros1, &[3, 0, 0, 0, b'm', b'a', b'p', 9, 1, 2]).unwrap();
        assert_eq!(reader.string().unwrap(), "map");
        assert_eq!((reader.u8(), reader.u16()), (Ok(9), Ok(0x0201)));
    }

    #[test]
    fn stamps_of_ros_2_may_be_negative() {
        let bytes = [0, 1, 0, 0, 255, 255, 255, 255, 1, 0, 0, 0];
        assert_eq!(WireReader::new(Wire::Cdr, &bytes).unwrap().stamp_ns(), Ok(-999_999_999));
        assert_eq!(
            WireReader::new(Wire::Ros1, &bytes[4..]).unwrap().stamp_ns(),
            Ok(4_294_967_295_000_000_001)
        );
    }
}
