use super::row::{COLUMNS, Row};

/// Rows of integers, each column with as many bits as its largest value needs. A row begins at a byte.
#[derive(Clone, Debug, Default)]
pub(super) struct PackedRows {
    /// Bits of each column.
    bits: [u8; COLUMNS],
    /// Number of columns up to the last one with bits.
    used: usize,
    /// Bytes of a row.
    stride: usize,
    /// The rows, and eight bytes after the last one, so that eight bytes can be read at each byte of a row.
    bytes: Vec<u8>,
}

const PADDING: usize = 8;

/// Fields of more bits are read and written in two parts, because they begin within a byte.
const MAX_BITS_AT_ONCE: u8 = 56;

impl PackedRows {
    pub(super) fn len(&self) -> usize {
        self.bytes.len().saturating_sub(PADDING).checked_div(self.stride).unwrap_or(0)
    }

    pub(super) fn heap_bytes(&self) -> usize {
        self.bytes.capacity()
    }

    #[inline]
    pub(super) fn get(&self, number: usize) -> Row {
        let mut row = Row::default();
        let mut at = number * self.stride * 8;
        for (column, &bits) in row.0.iter_mut().zip(&self.bits[..self.used]) {
            if bits > 0 {
                *column = self.field(at, bits);
                at += usize::from(bits);
            }
        }
        row
    }

    /// Replaces a row.
    #[inline]
    pub(super) fn set(&mut self, number: usize, row: &Row) {
        self.make_room_for(row);
        self.write(number, row);
    }

    /// Inserts a row before the row with this number.
    pub(super) fn insert(&mut self, number: usize, row: &Row) {
        self.make_room_for(row);
        let at = number * self.stride;
        let len = self.bytes.len();
        if len + self.stride > self.bytes.capacity() {
            // Less slack than the default growth of a vector.
            self.bytes.reserve_exact(self.stride.max(len / 4));
        }
        self.bytes.resize(len + self.stride, 0);
        self.bytes.copy_within(at..len, at + self.stride);
        self.write(number, row);
    }

    #[inline]
    fn fits(&self, row: &Row) -> bool {
        let (used, others) = row.0.split_at(self.used);
        // Without branches: nearly all rows fit.
        let too_large = used.iter().zip(&self.bits).fold(0, |all, (&value, &bits)| {
            let above = value >> (bits / 2) >> (bits - bits / 2);
            all | above
        });
        others.iter().fold(too_large, |all, value| all | value) == 0
    }

    /// Widens the columns in which a value of this row does not fit.
    #[inline]
    fn make_room_for(&mut self, row: &Row) {
        if !self.fits(row) || self.stride == 0 {
            self.widen(row);
        }
    }

    #[cold]
    fn widen(&mut self, row: &Row) {
        let mut bits = self.bits;
        for (bits, &value) in bits.iter_mut().zip(&row.0) {
            let needed = bits_of(value);
            if needed > *bits {
                // One more than needed: sums grow.
                *bits = if *bits == 0 { needed } else { (needed + 1).min(64) };
            }
        }
        let used = bits.iter().rposition(|bits| *bits > 0).map_or(0, |last| last + 1);
        let stride = bits.iter().map(|bits| usize::from(*bits)).sum::<usize>().div_ceil(8).max(1);
        let count = self.len();
        let mut wider = Self { bits, used, stride, bytes: vec![0; count * stride + PADDING] };
        (0..count).for_each(|number| wider.write(number, &self.get(number)));
        *self = wider;
    }

    #[inline]
    fn write(&mut self, number: usize, row: &Row) {
        let mut at = number * self.stride * 8;
        for (column, value) in row.0.iter().enumerate().take(self.used) {
            let bits = self.bits[column];
            if bits > 0 {
                self.set_field(at, bits, *value);
                at += usize::from(bits);
            }
        }
    }

    #[inline]
    fn field(&self, at: usize, bits: u8) -> u64 {
        if bits > MAX_BITS_AT_ONCE {
            return self.field(at, 32) | self.field(at + 32, bits - 32) << 32;
        }
        self.word(at / 8) >> (at % 8) & ((1 << bits) - 1)
    }

    #[inline]
    fn set_field(&mut self, at: usize, bits: u8, value: u64) {
        if bits > MAX_BITS_AT_ONCE {
            self.set_field(at, 32, value & 0xffff_ffff);
            return self.set_field(at + 32, bits - 32, value >> 32);
        }
        let mask = ((1 << bits) - 1) << (at % 8);
        let word = self.word(at / 8) & !mask | value << (at % 8);
        if let Some(bytes) = self.bytes[at / 8..].first_chunk_mut() {
            *bytes = word.to_le_bytes();
        }
    }

    #[inline]
    fn word(&self, at: usize) -> u64 {
        self.bytes[at..].first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes))
    }
}

/// Number of bits of a value.
#[inline]
fn bits_of(value: u64) -> u8 {
    (u64::BITS - value.leading_zeros()) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any_row() -> impl Strategy<Value = Row> {
        let value = prop_oneof![3 => Just(0), 3 => 0..9_u64, 1 => any::<u64>(), 1 => any::<u64>().prop_map(|k| k >> 7)];
        prop::collection::vec(value, COLUMNS).prop_map(|values| {
            let mut row = Row::default();
            row.0.copy_from_slice(&values);
            row
        })
    }

    proptest! {
        #[test]
        fn packed_rows_equal_a_list(steps in prop::collection::vec((any::<bool>(), any::<usize>(), any_row()), 1..60)) {
            let (mut packed, mut rows) = (PackedRows::default(), Vec::<Row>::new());
            for (is_new, at, row) in steps {
                if is_new || rows.is_empty() {
                    let at = at % (rows.len() + 1);
                    rows.insert(at, row);
                    packed.insert(at, &row);
                } else {
                    let at = at % rows.len();
                    rows[at] = row;
                    packed.set(at, &row);
                }
                prop_assert_eq!(packed.len(), rows.len());
            }
            for (number, row) in rows.iter().enumerate() {
                prop_assert_eq!(packed.get(number), *row);
            }
        }
    }
}
