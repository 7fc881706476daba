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
    /// Whether a line has any distance within the cap.
    is_live: Vec<bool>,
    has_live: bool,
}

impl Column {
    /// Replaces the lines.
    pub(crate) fn fill(&mut self, lines: impl Iterator<Item = Line>) {
        self.lines.clear();
        self.lines.extend(lines);
        self.is_live.clear();
        self.is_live.extend(self.lines.iter().map(|line| min_of(line) != FAR));
        self.has_live = self.is_live.contains(&true);
    }

    /// Returns whether any line has a distance within the cap.
    pub(crate) fn has_live(&self) -> bool {
        self.has_live
    }

    /// Returns the least sum of a line's values and the squared distance to that line, of all lines at most the cap
    /// away from the line `at`. There must be as many on both sides.
    pub(crate) fn least_around(&self, at: usize, cap: Cap) -> Line {
        let mut best = self.lines[at];
        let (below, above) = (at - cap.reach..at, at + 1..at + 1 + cap.reach);
        let below = self.lines[below.clone()].iter().zip(&self.is_live[below]).rev();
        let above = self.lines[above.clone()].iter().zip(&self.is_live[above]);
        for (number, ((low, is_low_live), (high, is_high_live))) in below.zip(above).enumerate() {
            let steps = number as i16 + 1;
            let square = steps * steps;
            // No farther line can improve any lane. Checked now and then, because the check costs as much as a line.
            if number % 4 == 0 && square >= max_of(&best) {
                break;
            }
            match (is_low_live, is_high_live) {
                (false, false) => {}
                (true, false) => improve(&mut best, low, square),
                (false, true) => improve(&mut best, high, square),
                (true, true) => {
                    for lane in 0..LANES {
                        best[lane] = best[lane].min(low[lane].min(high[lane]).saturating_add(square));
                    }
                }
            }
        }
        for lane in &mut best {
            *lane = if *lane > cap.squared { FAR } else { *lane };
        }
        best
    }
}

#[inline]
fn improve(best: &mut Line, other: &Line, square: i16) {
    for lane in 0..LANES {
        best[lane] = best[lane].min(other[lane].saturating_add(square));
    }
}

#[inline]
fn min_of(line: &Line) -> i16 {
    line.iter().fold(FAR, |least, &lane| least.min(lane))
}

#[inline]
fn max_of(line: &Line) -> i16 {
    line.iter().fold(i16::MIN, |most, &lane| most.max(lane))
}
