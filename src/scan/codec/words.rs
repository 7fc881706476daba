//! Conversion between numbers and words of four or eight bytes that sort in the same order.

/// Number of significant bytes of a word, and the type it encodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Width {
    /// `f32`, or an `f64` that is exactly representable as `f32`.
    Narrow,
    /// `f64`.
    Wide,
}

impl Width {
    pub(super) fn bytes(self) -> usize {
        match self {
            Self::Narrow => 4,
            Self::Wide => 8,
        }
    }

    /// The smallest width that represents all values exactly.
    pub(super) fn of(values: &[f64]) -> Self {
        if Self::Narrow.has(values) { Self::Narrow } else { Self::Wide }
    }

    /// Returns whether this width represents all values exactly.
    pub(super) fn has(self, values: &[f64]) -> bool {
        let has_lost = |lost: u64, value: &f64| lost | (f64::from(*value as f32).to_bits() ^ value.to_bits());
        // The fold is branchless and decides all cases without NaN.
        self == Self::Wide
            || values.iter().fold(0, has_lost) == 0 && !values.iter().any(|value| value.is_nan())
            || values.iter().all(|value| narrow(*value).is_some())
    }

    #[inline]
    pub(super) fn bits(self, value: f64) -> u64 {
        match self {
            Self::Narrow if value.is_nan() => u64::from(narrow(value).unwrap_or_default()),
            Self::Narrow => u64::from((value as f32).to_bits()),
            Self::Wide => value.to_bits(),
        }
    }

    #[inline]
    pub(super) fn value(self, bits: u64) -> f64 {
        match self {
            Self::Narrow => widen(bits as u32),
            Self::Wide => f64::from_bits(bits),
        }
    }

    fn sign(self) -> u64 {
        1 << (8 * self.bytes() - 1)
    }

    fn mask(self) -> u64 {
        u64::MAX >> (64 - 8 * self.bytes())
    }

    /// Maps bits to integers that sort in the order of the numbers.
    #[inline]
    pub(super) fn ordered(self, bits: u64) -> u64 {
        if bits & self.sign() != 0 { !bits & self.mask() } else { bits | self.sign() }
    }

    #[inline]
    pub(super) fn unordered(self, ordered: u64) -> u64 {
        if ordered & self.sign() != 0 { ordered & !self.sign() } else { !ordered & self.mask() }
    }

    /// Difference modulo the width, zigzag encoded: 0, -1, 1, -2 become 0, 1, 2, 3.
    #[inline]
    pub(super) fn difference(self, value: u64, before: u64) -> u64 {
        let shift = 64 - 8 * self.bytes() as u32;
        let difference = (value.wrapping_sub(before) << shift) as i64 >> shift;
        zigzag(difference) & self.mask()
    }

    #[inline]
    pub(super) fn sum(self, difference: u64, before: u64) -> u64 {
        before.wrapping_add(unzigzag(difference) as u64) & self.mask()
    }
}

/// Number of mantissa bits that an `f64` has more than an `f32`.
const MORE_BITS: u32 = 29;

/// Converts an `f64` to the identical `f32`; `None` if there is none. The bits of a NaN are preserved, which
/// conversions by the processor do not guarantee.
#[inline]
fn narrow(value: f64) -> Option<u32> {
    if value.is_nan() {
        let bits = value.to_bits();
        let mantissa = (bits >> MORE_BITS) as u32 & 0x007f_ffff;
        let is_narrow = bits.trailing_zeros() >= MORE_BITS;
        return is_narrow.then_some((bits >> 32) as u32 & 0x8000_0000 | 0x7f80_0000 | mantissa);
    }
    let narrow = value as f32;
    (f64::from(narrow).to_bits() == value.to_bits()).then(|| narrow.to_bits())
}

/// Converts an `f32` to `f64`, preserving the bits of a NaN.
#[inline]
pub(super) fn widen(bits: u32) -> f64 {
    let value = f32::from_bits(bits);
    if !value.is_nan() {
        return f64::from(value);
    }
    let sign = u64::from(bits & 0x8000_0000) << 32;
    f64::from_bits(sign | 0x7ff0_0000_0000_0000 | u64::from(bits & 0x007f_ffff) << MORE_BITS)
}

/// Stores the sign in the lowest bit: 0, -1, 1, -2 become 0, 1, 2, 3.
#[inline]
pub(crate) fn zigzag(number: i64) -> u64 {
    ((number << 1) ^ (number >> 63)) as u64
}

/// Inverse of [`zigzag`].
#[inline]
pub(crate) fn unzigzag(number: u64) -> i64 {
    (number >> 1) as i64 ^ -((number & 1) as i64)
}
