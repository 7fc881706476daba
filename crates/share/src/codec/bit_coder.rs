use super::context::Contexts;
use voxtile::FormatError;

/// Writer or reader of a packet's bits, each in a context that predicts its probability.
///
/// A writer writes `bit` and returns it. A reader ignores `bit` and returns the bit that it read. This way, both share
/// one tree walk.
pub(super) trait Bits {
    fn bit(&mut self, context: usize, bit: bool) -> Result<bool, FormatError>;
}

/// Binary arithmetic encoder: each bit narrows a 32-bit interval in proportion to the bit's probability. A byte is
/// written once both ends of the interval agree on it.
pub(super) struct BitWriter {
    contexts: Contexts,
    low: u32,
    high: u32,
    bytes: Vec<u8>,
}

impl BitWriter {
    pub(super) fn new() -> Self {
        Self { contexts: Contexts::new(), low: 0, high: u32::MAX, bytes: Vec::new() }
    }

    /// Finishes and returns the bytes. A reader continues with zeros after the last byte.
    pub(super) fn finish(mut self) -> Vec<u8> {
        // Write the shortest number in the interval.
        for bits in [0, 8, 16, 24] {
            let mask = if bits == 0 { 0 } else { u32::MAX << (32 - bits) };
            let rounded = u64::from(self.low) + u64::from(!mask);
            let end = (rounded & u64::from(mask)) as u32;
            if rounded <= u64::from(u32::MAX) && end >= self.low && end <= self.high {
                self.bytes.extend(&end.to_be_bytes()[..bits / 8]);
                return self.bytes;
            }
        }
        self.bytes.extend(self.low.to_be_bytes());
        self.bytes
    }
}

impl Bits for BitWriter {
    fn bit(&mut self, context: usize, bit: bool) -> Result<bool, FormatError> {
        let middle = middle(self.low, self.high, self.contexts.probability(context));
        if bit {
            self.high = middle;
        } else {
            self.low = middle + 1;
        }
        self.contexts.learn(context, bit);
        while (self.low ^ self.high) >> 24 == 0 {
            self.bytes.push((self.high >> 24) as u8);
            self.low <<= 8;
            self.high = self.high << 8 | 255;
        }
        Ok(bit)
    }
}

pub(super) struct BitReader<'a> {
    contexts: Contexts,
    low: u32,
    high: u32,
    code: u32,
    bytes: &'a [u8],
    position: usize,
}

impl<'a> BitReader<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        let mut reader =
            Self { contexts: Contexts::new(), low: 0, high: u32::MAX, code: 0, bytes, position: 0 };
        (0..4).for_each(|_| reader.shift());
        reader
    }

    fn shift(&mut self) {
        self.code = self.code << 8 | u32::from(self.bytes.get(self.position).copied().unwrap_or(0));
        self.position += 1;
    }

    /// Returns whether all bytes were read.
    pub(super) fn is_used_up(&self) -> bool {
        self.position >= self.bytes.len()
    }
}

impl Bits for BitReader<'_> {
    fn bit(&mut self, context: usize, _: bool) -> Result<bool, FormatError> {
        let middle = middle(self.low, self.high, self.contexts.probability(context));
        let bit = self.code <= middle;
        if bit {
            self.high = middle;
        } else {
            self.low = middle + 1;
        }
        self.contexts.learn(context, bit);
        while (self.low ^ self.high) >> 24 == 0 {
            self.low <<= 8;
            self.high = self.high << 8 | 255;
            self.shift();
            // After valid output, the reader is at most four bytes past the end.
            if self.position > self.bytes.len() + 4 {
                return Err(FormatError::at_offset(
                    self.bytes.len() as u64,
                    "the packet ends within its voxels",
                ));
            }
        }
        Ok(bit)
    }
}

/// Returns the last number of the subinterval for bit 1.
fn middle(low: u32, high: u32, probability: u32) -> u32 {
    low + ((u64::from(high - low) * u64::from(probability)) >> 16) as u32
}
