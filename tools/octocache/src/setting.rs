use crate::dataset::Dataset;

/// What a question is put to, and how long it may take.
pub struct Setting {
    /// The scans.
    pub datasets: Vec<Dataset>,
    /// Whether to look only whether everything works.
    pub is_short: bool,
    /// Runs of which the median is taken.
    pub runs: usize,
}

impl Setting {
    /// One of two, the second where the run is to be short.
    pub fn size<T>(&self, full: T, short: T) -> T {
        if self.is_short { short } else { full }
    }
}
