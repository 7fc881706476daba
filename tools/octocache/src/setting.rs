use crate::dataset::Dataset;

/// Inputs of the questions, and how much to measure.
pub struct Setting {
    pub datasets: Vec<Dataset>,
    /// Whether to check only that everything works.
    pub is_short: bool,
    /// Number of runs for a median.
    pub runs: usize,
}

impl Setting {
    /// Returns `short` in a short run, else `full`.
    pub fn size<T>(&self, full: T, short: T) -> T {
        if self.is_short { short } else { full }
    }
}
