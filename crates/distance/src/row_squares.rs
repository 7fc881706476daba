use crate::cap::Cap;
use crate::line::FAR;

/// Table of squares, to fill parts of a row by copying.
#[derive(Debug)]
pub(crate) struct RowSquares {
    reach: usize,
    /// 0, 1, 4, 9, .. up to the cap.
    ascending: Vec<i16>,
    /// The same in reverse order.
    descending: Vec<i16>,
}

impl RowSquares {
    pub(crate) fn new(cap: Cap) -> Self {
        let ascending: Vec<i16> = (0..=cap.reach as i16).map(|k| k * k).collect();
        let descending = ascending.iter().rev().copied().collect();
        Self { reach: cap.reach, ascending, descending }
    }

    /// Computes the squared distance to the nearest set bit of a row, [`FAR`] if there is none within the cap. The
    /// value at position `x` is that of bit `x + reach`; `bits` has `count` bits.
    pub(crate) fn fill(&self, bits: &[u64], count: usize, out: &mut [i16]) {
        out.fill(FAR);
        // Runs of set bits; between two runs each half has the distance to the nearer one.
        let mut before: Option<usize> = None;
        let mut at = 0;
        while let Some(first) = next(bits, at, count, true) {
            let end = next(bits, first, count, false).unwrap_or(count);
            let low = match before {
                Some(last) => {
                    let middle = (last + first).div_ceil(2);
                    self.rise(last, middle, out);
                    middle
                }
                None => first.saturating_sub(self.reach),
            };
            self.fall(low, first, out);
            if let Some(run) = self.part(first, end, out) {
                out[run].fill(0);
            }
            before = Some(end - 1);
            at = end;
        }
        if let Some(last) = before {
            self.rise(last, usize::MAX, out);
        }
    }

    /// The positions of `out` for the bits from `first` to before `end`.
    fn part(&self, first: usize, end: usize, out: &[i16]) -> Option<std::ops::Range<usize>> {
        let part = first.saturating_sub(self.reach)..end.saturating_sub(self.reach).min(out.len());
        (part.start < part.end).then_some(part)
    }

    /// Writes the squared distances to bit `last` for the bits after it, up to before `end`.
    fn rise(&self, last: usize, end: usize, out: &mut [i16]) {
        if let Some(part) = self.part(last + 1, end.min(last + 1 + self.reach), out) {
            let steps = part.start + self.reach - last;
            let length = part.len();
            out[part].copy_from_slice(&self.ascending[steps..steps + length]);
        }
    }

    /// Writes the squared distances to bit `first` for the bits before it, from `low` on.
    fn fall(&self, low: usize, first: usize, out: &mut [i16]) {
        if let Some(part) = self.part(low.max(first.saturating_sub(self.reach)), first, out) {
            let steps = first - (part.start + self.reach);
            let from = self.reach - steps;
            let length = part.len();
            out[part].copy_from_slice(&self.descending[from..from + length]);
        }
    }
}

/// Returns the next bit of a value at or after a position.
fn next(bits: &[u64], from: usize, count: usize, value: bool) -> Option<usize> {
    let mut at = from;
    while at < count {
        let word = if value { bits[at / 64] } else { !bits[at / 64] };
        let rest = word >> (at % 64);
        if rest != 0 {
            at += rest.trailing_zeros() as usize;
            return (at < count).then_some(at);
        }
        at = (at / 64 + 1) * 64;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bits::bit;
    use testkit::random_scans::Random;

    #[test]
    fn squares_of_random_rows_equal_the_nearest_bit() {
        let mut random = Random(3);
        for case in 0..2000 {
            let reach = 1 + random.below(40) as usize;
            let squares = RowSquares::new(Cap { squared: (reach * reach) as i16, reach });
            let edge = 1 + random.below(100) as usize;
            let count = edge + 2 * reach;
            let mut bits = vec![0_u64; count.div_ceil(64)];
            let one_in = 1 + random.below([3, 30, 300][case % 3]);
            for x in 0..count {
                if random.below(one_in) == 0 {
                    bits[x / 64] |= 1 << (x % 64);
                }
            }
            let mut out = vec![7; edge.next_multiple_of(32)];
            squares.fill(&bits, count, &mut out[..edge]);
            for (x, found) in out[..edge].iter().enumerate() {
                let at = x + reach;
                let nearest = (0..count).filter(|&b| bit(&bits, b)).map(|b| b.abs_diff(at)).min();
                let expected =
                    nearest.filter(|steps| *steps <= reach).map_or(FAR, |steps| (steps * steps) as i16);
                assert_eq!(*found, expected, "case {case}, {x} of {edge}, reach {reach}");
            }
        }
    }
}
