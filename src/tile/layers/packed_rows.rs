use super::row::{COLUMNS, FIRST_BITS, RED, Row};

/// Rows of integers, each column with as many bits as its largest value needs. A row begins at a byte.
#[derive(Clone, Debug, Default)]
pub(super) struct PackedRows {
    /// Bits of each column.
    bits: [u8; COLUMNS],
    /// First bit of each column in a row; only valid if `ends` is not 0.
    starts: [u8; COLUMNS],
    /// Number of columns up to the last one with bits.
    used: u8,
    /// Bytes of a row.
    stride: u8,
    /// The bit after each column, as a `u128` that needs no alignment. 0 if a row has more bits than
    /// [`PackedRows::add_if`] supports.
    ends: [u8; 16],
    /// The rows, and [`PADDING`] bytes after the last one.
    bytes: Vec<u8>,
}

/// So many bytes can be read at the first byte of each row, and eight at each other one.
const PADDING: usize = 16;

/// Fields of more bits are read and written in two parts, because they begin within a byte.
const MAX_BITS_AT_ONCE: u8 = 56;

/// Integers to add to a row, in its packed form.
#[derive(Clone, Copy, Debug)]
pub(super) struct Summand {
    bits: u128,
    fits: bool,
}

/// Packs integers to add to a row.
pub(super) struct SummandPacker<'a> {
    rows: &'a PackedRows,
    bits: u128,
    /// Bits of the integers that do not fit in their columns.
    excess: u64,
}

impl SummandPacker<'_> {
    /// Includes the integer of a column, once per column.
    #[inline]
    pub(super) fn include(&mut self, column: usize, value: u64) {
        self.excess |= value >> (self.rows.bits[column] & 63);
        self.bits |= u128::from(value) << (self.rows.starts[column] & 127);
    }

    #[inline]
    pub(super) fn done(self) -> Summand {
        Summand { bits: self.bits, fits: self.excess == 0 }
    }
}

impl PackedRows {
    /// Bytes of a row.
    #[inline]
    fn stride(&self) -> usize {
        usize::from(self.stride)
    }

    #[inline]
    fn ends(&self) -> u128 {
        u128::from_le_bytes(self.ends)
    }

    /// Returns whether rows have at most 127 bits, so that one addition adds all columns.
    #[inline]
    fn has_packed_rows(&self) -> bool {
        self.ends() != 0
    }

    pub(super) fn len(&self) -> usize {
        self.bytes.len().saturating_sub(PADDING).checked_div(self.stride()).unwrap_or(0)
    }

    /// Starts the integers that are to be added to a row; `None` if rows have too many bits for that.
    #[inline]
    pub(super) fn summand(&self) -> Option<SummandPacker<'_>> {
        self.has_packed_rows().then_some(SummandPacker { rows: self, bits: 0, excess: 0 })
    }

    /// Adds integers to the columns of a row if the integer in `column` is `value`. Returns `false`, with the row
    /// unchanged, if it is another one, or if one of the sums has too many bits.
    #[inline]
    pub(super) fn add_if(&mut self, number: usize, summand: Summand, column: usize, value: u64) -> bool {
        let at = number * self.stride();
        let Some(bytes) = self.bytes.get(at..).and_then(<[u8]>::first_chunk) else { return false };
        // The next rows follow the last column.
        let before = u128::from_le_bytes(*bytes);
        let sum = before.wrapping_add(summand.bits);
        // A bit of the sum differs from the sum without carries where a carry arrived.
        let carries = before ^ summand.bits ^ sum;
        let fits = summand.fits && carries & self.ends() == 0 && self.value_in(before, column) == value;
        if fits && let Some(bytes) = self.bytes[at..].first_chunk_mut() {
            *bytes = sum.to_le_bytes();
        }
        fits
    }

    /// The integer of a column in a packed row.
    #[inline]
    fn value_in(&self, row: u128, column: usize) -> u64 {
        (row >> (self.starts[column] & 127)) as u64 & ((1 << (self.bits[column] & 63)) - 1)
    }

    /// Inserts a row with these integers before the row with this number; returns `false`, with the rows unchanged, if
    /// one of them has too many bits.
    #[inline]
    pub(super) fn insert_sum(&mut self, number: usize, summand: Summand) -> bool {
        if summand.fits {
            self.make_gap(number);
            let of_row = u128::MAX >> (128 - 8 * self.stride());
            if let Some(bytes) = self.packed_row(number) {
                *bytes = (u128::from_le_bytes(*bytes) & !of_row | summand.bits).to_le_bytes();
            }
        }
        summand.fits
    }

    /// The bytes of a row and those after it.
    #[inline]
    fn packed_row(&mut self, number: usize) -> Option<&mut [u8; size_of::<u128>()]> {
        let at = number * self.stride();
        self.bytes.get_mut(at..)?.first_chunk_mut()
    }

    pub(super) fn heap_bytes(&self) -> usize {
        self.bytes.capacity()
    }

    #[inline]
    pub(super) fn get(&self, number: usize) -> Row {
        let mut row = Row::default();
        self.read(number, &mut row);
        row
    }

    /// Reads a row. The columns after the last used one remain as they are.
    #[inline]
    pub(super) fn read(&self, number: usize, row: &mut Row) {
        if self.has_packed_rows()
            && let Some(bytes) = self.bytes.get(number * self.stride()..).and_then(<[u8]>::first_chunk)
        {
            let packed = u128::from_le_bytes(*bytes);
            for (column, integer) in row.0.iter_mut().enumerate().take(self.used.into()) {
                *integer = self.value_in(packed, column);
            }
            return;
        }
        let mut at = number * self.stride() * 8;
        for (column, &bits) in row.0.iter_mut().zip(&self.bits[..self.used.into()]) {
            *column = 0;
            if bits > 0 {
                *column = self.field(at, bits);
                at += usize::from(bits);
            }
        }
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
        self.make_gap(number);
        let stride = self.stride();
        let at = number * stride;
        self.bytes[at..at + stride].fill(0);
        self.write(number, row);
    }

    /// Makes room for a row before the row with this number. The room has no defined content.
    fn make_gap(&mut self, number: usize) {
        let (stride, len) = (self.stride(), self.bytes.len());
        let at = number * stride;
        if len + stride > self.bytes.capacity() {
            // Less slack than the default growth of a vector.
            self.bytes.reserve_exact((4 * stride).max(len / 4));
        }
        self.bytes.resize(len + stride, 0);
        self.bytes.copy_within(at..len, at + stride);
    }

    #[inline]
    fn fits(&self, row: &Row) -> bool {
        let (used, others) = row.0.split_at(self.used.into());
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
        for ((bits, first), &value) in bits.iter_mut().zip(FIRST_BITS).zip(&row.0) {
            let needed = bits_of(value);
            if needed > *bits {
                // One more than needed: sums grow.
                *bits = if *bits == 0 { needed.max(first) } else { (needed + 1).min(64) };
            }
        }
        // Colours grow together.
        let most = bits[RED..RED + 3].iter().copied().max().unwrap_or(0);
        bits[RED..RED + 3].fill(most);
        let mut wider = Self::with_bits(bits);
        let count = self.len();
        wider.bytes = vec![0; count * wider.stride() + PADDING];
        for number in 0..count {
            match self.has_packed_rows() && wider.has_packed_rows() {
                true => self.copy_packed(number, &mut wider),
                false => wider.write(number, &self.get(number)),
            }
        }
        *self = wider;
    }

    fn with_bits(bits: [u8; COLUMNS]) -> Self {
        let used = bits.iter().rposition(|bits| *bits > 0).map_or(0, |last| last + 1);
        let (mut starts, mut total, mut ends) = ([0; COLUMNS], 0_usize, 0_u128);
        for (start, &bits) in starts.iter_mut().zip(&bits[..used]) {
            *start = total.min(127) as u8;
            total += usize::from(bits);
            ends |= 1_u128.checked_shl(total as u32).unwrap_or(0);
        }
        if total > 127 || bits.contains(&64) {
            ends = 0;
        }
        // At most 22 columns of 64 bits: 176 bytes.
        let stride = total.div_ceil(8).max(1) as u8;
        Self { bits, starts, used: used as u8, stride, ends: ends.to_le_bytes(), bytes: Vec::new() }
    }

    /// Copies a row in its packed form to the same row of `wider`.
    fn copy_packed(&mut self, number: usize, wider: &mut Self) {
        let Some(row) = self.packed_row(number).map(|bytes| u128::from_le_bytes(*bytes)) else { return };
        let mut wide = 0;
        for column in 0..usize::from(self.used) {
            if self.bits[column] > 0 {
                wide |= u128::from(self.value_in(row, column)) << (wider.starts[column] & 127);
            }
        }
        // Zeros after the row: rows are copied in ascending order.
        if let Some(bytes) = wider.packed_row(number) {
            *bytes = wide.to_le_bytes();
        }
    }

    #[inline]
    fn write(&mut self, number: usize, row: &Row) {
        let mut at = number * self.stride() * 8;
        for (column, value) in row.0.iter().enumerate().take(self.used.into()) {
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

    #[derive(Clone, Debug)]
    enum Step {
        Set(usize, Row),
        Insert(usize, Row),
        /// Adds to an existing row.
        Add(usize, Row),
        InsertSum(usize, Row),
    }

    fn any_step() -> impl Strategy<Value = Step> {
        let summand =
            prop::collection::vec(prop_oneof![2 => Just(0), 2 => 0..6_u64, 1 => any::<u64>()], COLUMNS);
        let summand = summand.prop_map(|values| {
            let mut row = Row::default();
            row.0[..6].copy_from_slice(&values[..6]);
            row
        });
        prop_oneof![
            1 => (any::<usize>(), any_row()).prop_map(|(at, row)| Step::Set(at, row)),
            1 => (any::<usize>(), any_row()).prop_map(|(at, row)| Step::Insert(at, row)),
            4 => (any::<usize>(), summand.clone()).prop_map(|(at, row)| Step::Add(at, row)),
            2 => (any::<usize>(), summand).prop_map(|(at, row)| Step::InsertSum(at, row)),
        ]
    }

    fn packed(rows: &PackedRows, row: &Row) -> Option<Summand> {
        let mut packer = rows.summand()?;
        for (column, value) in row.0.iter().enumerate().filter(|(_, value)| **value > 0) {
            packer.include(column, *value);
        }
        Some(packer.done())
    }

    #[test]
    fn sums_are_packed_until_a_column_has_too_few_bits() {
        let mut rows = PackedRows::default();
        assert!(rows.summand().is_none());
        let (mut one, mut last) = (Row::default(), Row::default());
        (one.0[0], one.0[COLUMNS - 1]) = (1, 1);
        last.0[COLUMNS - 1] = 1;
        rows.insert(0, &one);
        let two = packed(&rows, &one).unwrap();
        assert!(rows.insert_sum(1, two));
        // The last column has one bit, and the next row follows it.
        assert!(!rows.add_if(0, packed(&rows, &last).unwrap(), 0, 1));
        let mut more = Row::default();
        more.0[0] = 6;
        assert!(rows.add_if(0, packed(&rows, &more).unwrap(), COLUMNS - 1, 1));
        assert!(!rows.add_if(1, packed(&rows, &more).unwrap(), COLUMNS - 1, 0));
        more.0[0] = 1;
        assert!(!rows.add_if(0, packed(&rows, &more).unwrap(), COLUMNS - 1, 1));
        more.0[0] = 8;
        assert!(!rows.insert_sum(0, packed(&rows, &more).unwrap()));
        assert_eq!([rows.get(0).0[0], rows.get(1).0[0]], [7, 1]);
    }

    proptest! {
        #[test]
        fn sums_equal_those_of_a_list(steps in prop::collection::vec(any_step(), 1..60)) {
            let (mut rows, mut list) = (PackedRows::default(), Vec::<Row>::new());
            for step in steps {
                let at = |at: usize| at % list.len().max(1);
                match step {
                    Step::Insert(number, row) => {
                        let number = number % (list.len() + 1);
                        list.insert(number, row);
                        rows.insert(number, &row);
                    }
                    Step::InsertSum(number, row) => {
                        let number = number % (list.len() + 1);
                        if packed(&rows, &row).is_some_and(|summand| rows.insert_sum(number, summand)) {
                            list.insert(number, row);
                        }
                    }
                    _ if list.is_empty() => {}
                    Step::Set(number, row) => {
                        let number = at(number);
                        list[number] = row;
                        rows.set(number, &row);
                    }
                    Step::Add(number, row) => {
                        let number = at(number);
                        let Some(summand) = packed(&rows, &row) else { continue };
                        let value = list[number].0[8];
                        prop_assert!(!rows.add_if(number, summand, 8, value.wrapping_add(1)));
                        if rows.add_if(number, summand, 8, value) {
                            (0..COLUMNS).for_each(|k| list[number].0[k] += row.0[k]);
                        }
                    }
                }
                for (number, row) in list.iter().enumerate() {
                    prop_assert_eq!(rows.get(number), *row);
                }
            }
        }

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
