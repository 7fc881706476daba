use integer_encoding::VarInt;

/// Marks of the points of a scan that hit something that was moving: one bit per point, stored as lengths of runs.
///
/// The ray of a marked point still passes free voxels, but the point is no hit.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MovingMarks {
    /// Lengths of runs as variable-length integers: points without a mark, marked points, and so on. Only the first
    /// may be zero.
    runs: Vec<u8>,
    points: u64,
    marked: u64,
}

impl MovingMarks {
    /// Creates the marks of all points of a scan, in order.
    pub fn new(is_moving: impl IntoIterator<Item = bool>) -> Self {
        let mut marks = Self::builder();
        is_moving.into_iter().for_each(|is_moving| marks.push(is_moving));
        marks.finish()
    }

    fn push_run(&mut self, length: u64, is_marked: bool) {
        self.runs.extend(length.encode_var_vec());
        self.points += length;
        self.marked += if is_marked { length } else { 0 };
    }

    /// Returns the marks of a scan of which no point is marked.
    pub fn none(points: u64) -> Self {
        let mut marks = Self::default();
        if points > 0 {
            marks.push_run(points, false);
        }
        marks
    }

    /// Returns a builder that takes the marks point by point.
    pub fn builder() -> MovingMarksBuilder {
        MovingMarksBuilder::default()
    }

    /// Parses the encoded marks of a scan of `points` points; `None` if they are invalid.
    pub fn from_bytes(runs: Vec<u8>, points: u64) -> Option<Self> {
        let mut marks = Self::default();
        let (mut left, mut is_marked, mut is_first) = (&*runs, false, true);
        while !left.is_empty() {
            let (length, bytes) = u64::decode_var(left)?;
            // Bounded, so that the sums cannot overflow.
            if (length == 0 && !is_first) || length > points - marks.points {
                return None;
            }
            marks.points += length;
            marks.marked += if is_marked { length } else { 0 };
            (left, is_marked, is_first) = (left.get(bytes..)?, !is_marked, false);
        }
        (marks.points == points).then_some(Self { runs, ..marks })
    }

    /// The encoded marks.
    pub fn as_bytes(&self) -> &[u8] {
        &self.runs
    }

    /// Number of points of the scan.
    pub fn points(&self) -> u64 {
        self.points
    }

    /// Number of marked points.
    pub fn marked(&self) -> u64 {
        self.marked
    }

    /// Returns for each point whether it is marked, in order.
    pub fn iter(&self) -> impl Iterator<Item = bool> + '_ {
        let mut runs = self.runs();
        std::iter::from_fn(move || runs.next()).flat_map(|(is_marked, length)| {
            // A scan in memory has no more points than fit in a `usize`.
            std::iter::repeat_n(is_marked, usize::try_from(length).unwrap_or(usize::MAX))
        })
    }

    fn runs(&self) -> Runs<'_> {
        Runs { left: &self.runs, is_marked: false }
    }
}

/// Builder of the marks of a scan, point by point.
#[derive(Clone, Debug, Default)]
pub struct MovingMarksBuilder {
    marks: MovingMarks,
    /// Whether the current run is marked, and its length.
    run: (bool, u64),
}

impl MovingMarksBuilder {
    /// Adds the mark of the next point.
    pub fn push(&mut self, is_moving: bool) {
        if is_moving != self.run.0 {
            self.marks.push_run(self.run.1, self.run.0);
            self.run = (is_moving, 0);
        }
        self.run.1 += 1;
    }

    /// Returns the marks.
    pub fn finish(mut self) -> MovingMarks {
        if self.run.1 > 0 {
            self.marks.push_run(self.run.1, self.run.0);
        }
        self.marks
    }
}

/// Iterator over the runs: whether they are marked, and their lengths.
#[derive(Clone, Debug)]
struct Runs<'a> {
    left: &'a [u8],
    is_marked: bool,
}

impl Iterator for Runs<'_> {
    type Item = (bool, u64);

    fn next(&mut self) -> Option<(bool, u64)> {
        let (length, bytes) = u64::decode_var(self.left)?;
        self.left = &self.left[bytes..];
        let run = (self.is_marked, length);
        self.is_marked = !self.is_marked;
        Some(run)
    }
}

/// Marks of consecutive chunks of points.
#[derive(Debug)]
pub(crate) struct ChunkMarks<'a> {
    runs: Option<Runs<'a>>,
    /// The rest of the current run.
    rest: (bool, u64),
    chunk: Vec<bool>,
}

impl<'a> ChunkMarks<'a> {
    /// Starts at the point number `first`.
    pub(crate) fn from(marks: Option<&'a MovingMarks>, first: usize) -> Self {
        let mut chunks = Self { runs: marks.map(MovingMarks::runs), rest: (false, 0), chunk: Vec::new() };
        let mut skipped = first as u64;
        while let Some(runs) = &mut chunks.runs
            && let Some((is_marked, length)) = runs.next()
        {
            if length > skipped {
                chunks.rest = (is_marked, length - skipped);
                break;
            }
            skipped -= length;
        }
        chunks
    }

    /// Returns the marks of the next `points` points; an empty list if no point of the scan is marked.
    pub(crate) fn next(&mut self, points: usize) -> &[bool] {
        self.chunk.clear();
        let Some(runs) = &mut self.runs else { return &[] };
        while self.chunk.len() < points {
            if self.rest.1 == 0 {
                let Some(run) = runs.next() else { break };
                self.rest = run;
            }
            let (is_marked, length) = self.rest;
            let taken = (points - self.chunk.len()).min(usize::try_from(length).unwrap_or(usize::MAX));
            self.chunk.resize(self.chunk.len() + taken, is_marked);
            self.rest.1 -= taken as u64;
        }
        &self.chunk
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn marks_equal_a_list(
            runs in prop::collection::vec((any::<bool>(), 0..300_usize), 0..12),
            first in 0..400_usize,
            chunk in 1..200_usize,
        ) {
            let all: Vec<bool> = runs.iter().flat_map(|&(is, n)| std::iter::repeat_n(is, n)).collect();
            let marks = MovingMarks::new(all.iter().copied());
            prop_assert_eq!(marks.iter().collect::<Vec<_>>(), all.clone());
            prop_assert_eq!(marks.points(), all.len() as u64);
            prop_assert_eq!(marks.marked(), all.iter().filter(|is| **is).count() as u64);
            let decoded = MovingMarks::from_bytes(marks.as_bytes().to_vec(), marks.points());
            prop_assert_eq!(decoded.as_ref(), Some(&marks));
            prop_assert_eq!(MovingMarks::from_bytes(marks.as_bytes().to_vec(), marks.points() + 1), None);
            let mut chunks = ChunkMarks::from(Some(&marks), first);
            let mut found = Vec::new();
            while first + found.len() < all.len() {
                let count = chunk.min(all.len() - first - found.len());
                let some = chunks.next(count);
                prop_assert_eq!(some.len(), count);
                found.extend_from_slice(some);
            }
            prop_assert_eq!(&found[..], all.get(first..).unwrap_or_default());
        }

        #[test]
        fn damaged_marks_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..40), points in any::<u64>()) {
            if let Some(marks) = MovingMarks::from_bytes(bytes, points) {
                prop_assert!(marks.marked() <= marks.points());
            }
        }
    }
}
