use crate::cap::Cap;

/// Voxels along x that are processed together: a cache line.
pub(crate) const LANES: usize = 32;

/// Squared distances of consecutive voxels along x; [`FAR`] if beyond the cap.
pub(crate) type Line = [i16; LANES];

/// Squared distance beyond the cap.
pub(crate) const FAR: i16 = i16::MAX;

/// A line without obstacles within the cap.
pub(crate) const FAR_LINE: Line = [FAR; LANES];

/// Lines of one column along y or z, from which squared distances along that axis are computed.
#[derive(Debug, Default)]
pub(crate) struct Column {
    lines: Vec<Line>,
    /// Number of lines before each one that have any distance within the cap; one more for all lines.
    live_before: Vec<u32>,
}

/// Lines on each side that are compared together, so that the best values remain in registers.
const GROUP: usize = 4;

impl Column {
    /// Replaces the lines.
    pub(crate) fn fill<'a>(&mut self, lines: impl Iterator<Item = &'a Line>) {
        self.lines.clear();
        self.live_before.clear();
        let mut live = 0;
        for line in lines {
            self.lines.push(*line);
            self.live_before.push(live);
            live += u32::from(min_of(line) != FAR);
        }
        self.live_before.push(live);
    }

    /// Returns whether any line has a distance within the cap.
    pub(crate) fn has_live(&self) -> bool {
        self.live_before.last().is_some_and(|live| *live > 0)
    }

    /// Returns whether any line of a range has a distance within the cap.
    #[inline]
    fn has_live_in(&self, from: usize, end: usize) -> bool {
        self.live_before[from] != self.live_before[end]
    }

    /// Returns the least sum of a line's values and the squared distance to that line, of all lines at most the cap
    /// away from the line `at`. There must be as many on both sides.
    pub(crate) fn least_around(&self, at: usize, cap: Cap) -> Line {
        let mut best = self.lines[at];
        if !self.has_live_in(at - cap.reach, at + cap.reach + 1) {
            return FAR_LINE;
        }
        let mut most = max_of(&best);
        let mut first = 1;
        // No farther line can improve any lane once its square is as large as the largest value.
        while first <= cap.reach && square(first) < most {
            let last = (first + GROUP - 1).min(cap.reach);
            if self.has_live_in(at - last, at - first + 1) || self.has_live_in(at + first, at + last + 1) {
                // A group may end before its last line; that line then counts twice.
                let steps: [usize; GROUP] = std::array::from_fn(|number| (first + number).min(last));
                let low = steps.map(|steps| &self.lines[at - steps]);
                let high = steps.map(|steps| &self.lines[at + steps]);
                (best, most) = improved(&best, low, high, steps.map(square));
            }
            first = last + 1;
        }
        for lane in &mut best {
            *lane = if *lane > cap.squared { FAR } else { *lane };
        }
        best
    }
}

#[inline]
fn square(steps: usize) -> i16 {
    let steps = steps as i16;
    steps * steps
}

/// Returns the least of the values and of a group's values plus squares, and the largest result.
#[inline]
fn improved(best: &Line, low: [&Line; GROUP], high: [&Line; GROUP], squares: [i16; GROUP]) -> (Line, i16) {
    let mut out = FAR_LINE;
    let mut most = i16::MIN;
    for lane in 0..LANES {
        let mut least = best[lane];
        for number in 0..GROUP {
            let nearer = low[number][lane].min(high[number][lane]);
            least = least.min(nearer.saturating_add(squares[number]));
        }
        out[lane] = least;
        most = most.max(least);
    }
    (out, most)
}

#[inline]
fn min_of(line: &Line) -> i16 {
    line.iter().fold(FAR, |least, &lane| least.min(lane))
}

#[inline]
fn max_of(line: &Line) -> i16 {
    line.iter().fold(i16::MIN, |most, &lane| most.max(lane))
}
