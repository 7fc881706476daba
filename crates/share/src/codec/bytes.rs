use voxtile::FormatError;

/// Reader of consecutive numbers. Its errors report the offset.
pub(super) struct Reader<'a> {
    bytes: &'a [u8],
    position: usize,
    offset: u64,
}

impl<'a> Reader<'a> {
    /// `offset` is the position of `bytes` in the packet, for errors.
    pub(super) fn new(bytes: &'a [u8], offset: u64) -> Self {
        Self { bytes, position: 0, offset }
    }

    pub(super) fn rest(&self) -> &'a [u8] {
        &self.bytes[self.position..]
    }

    pub(super) fn offset(&self) -> u64 {
        self.offset + self.position as u64
    }

    pub(super) fn error(&self, reason: impl Into<String>) -> FormatError {
        FormatError::at_offset(self.offset(), reason)
    }

    pub(super) fn array<const N: usize>(&mut self) -> Result<[u8; N], FormatError> {
        let array = self.rest().first_chunk::<N>().ok_or_else(|| self.error("the packet ends too early"))?;
        self.position += N;
        Ok(*array)
    }

    pub(super) fn byte(&mut self) -> Result<u8, FormatError> {
        self.array::<1>().map(|[byte]| byte)
    }

    /// Reads a varint of seven bits per byte, lowest bits first.
    pub(super) fn number(&mut self) -> Result<u64, FormatError> {
        let mut number = 0_u64;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            let bits = u64::from(byte & 127);
            if bits << shift >> shift != bits {
                break;
            }
            number |= bits << shift;
            if byte < 128 {
                return Ok(number);
            }
        }
        Err(self.error("a number of more than 64 bits"))
    }

    /// Reads a varint with the sign in the lowest bit.
    pub(super) fn signed(&mut self) -> Result<i64, FormatError> {
        let number = self.number()?;
        Ok((number >> 1) as i64 ^ -((number & 1) as i64))
    }

    pub(super) fn end(&self) -> Result<(), FormatError> {
        if self.rest().is_empty() { Ok(()) } else { Err(self.error("unexpected bytes after the end")) }
    }
}

pub(super) fn put_number(bytes: &mut Vec<u8>, mut number: u64) {
    while number >= 128 {
        bytes.push(number as u8 | 128);
        number >>= 7;
    }
    bytes.push(number as u8);
}

pub(super) fn put_signed(bytes: &mut Vec<u8>, number: i64) {
    put_number(bytes, (number << 1 ^ number >> 63) as u64);
}
