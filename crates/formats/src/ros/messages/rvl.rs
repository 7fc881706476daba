/// RVL decoder for depth images (Wilson 2017). The data alternates runs of zeros and runs of differences to the
/// previous value. Each number is stored in groups of four bits, one of which marks a continuation, packed in 32-bit
/// words.
#[derive(Clone, Debug)]
pub(super) struct Rvl<'a> {
    words: &'a [[u8; 4]],
    word: u32,
    /// Groups left in the current word.
    groups: u32,
    zeros: u32,
    numbers: u32,
    previous: u16,
}

/// Maximum number of groups of a 32-bit number.
const MAX_GROUPS: u32 = 11;

impl<'a> Rvl<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        let (words, _) = bytes.as_chunks();
        Self { words, word: 0, groups: 0, zeros: 0, numbers: 0, previous: 0 }
    }

    /// Returns the next pixel, or `None` after the last one.
    pub(super) fn pixel(&mut self) -> Option<u16> {
        while self.zeros == 0 && self.numbers == 0 {
            (self.zeros, self.numbers) = (self.number()?, self.number()?);
        }
        if let Some(zeros) = self.zeros.checked_sub(1) {
            self.zeros = zeros;
            return Some(0);
        }
        self.numbers -= 1;
        let coded = self.number()?;
        // Zigzag coding: even numbers are positive differences, odd ones are negative.
        let difference = (coded >> 1) as u16 ^ if coded & 1 == 1 { u16::MAX } else { 0 };
        self.previous = self.previous.wrapping_add(difference);
        Some(self.previous)
    }

    fn number(&mut self) -> Option<u32> {
        let mut number = 0;
        for group in 0..MAX_GROUPS {
            if self.groups == 0 {
                let (word, rest) = self.words.split_first()?;
                (self.word, self.words, self.groups) = (u32::from_le_bytes(*word), rest, 8);
            }
            let bits = self.word >> 28;
            (self.word, self.groups) = (self.word << 4, self.groups - 1);
            number |= (bits & 7) << (3 * group);
            if bits & 8 == 0 {
                return Some(number);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Packs groups of four bits into words.
    fn words(groups: &[u32]) -> Vec<u8> {
        let word =
            |groups: &[u32]| groups.iter().zip(0..).fold(0, |word, (bits, k)| word | bits << (28 - 4 * k));
        groups.chunks(8).flat_map(|groups| u32::to_le_bytes(word(groups))).collect()
    }

    #[test]
    fn runs_and_differences_are_pixels() {
        // Two zeros; three differences: +10 (20 = 0b010_100), -1 (1), +0 (0); one zero, one difference: -9 (17 =
        // 0b010_001).
        let bytes = words(&[2, 3, 0b1100, 0b0010, 1, 0, 1, 1, 0b1001, 0b0010]);
        let mut rvl = Rvl::new(&bytes);
        let pixels: Vec<u16> = std::iter::from_fn(|| rvl.pixel()).take(7).collect();
        assert_eq!(pixels, [0, 0, 10, 9, 9, 0, 0]);
        assert_eq!(Rvl::new(&[]).pixel(), None);
        assert_eq!(Rvl::new(&words(&[8; 16])).pixel(), None, "a number of more than 11 groups is invalid");
        assert_eq!(Rvl::new(&words(&[0; 16])).pixel(), None, "empty runs contain no pixels");
    }
}
