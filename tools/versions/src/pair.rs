/// Medians of one measurement for both versions.
#[derive(Clone, Copy)]
pub struct Pair {
    pub before: f64,
    pub now: f64,
}

impl Pair {
    /// Speed of the current version relative to the earlier one.
    pub fn ratio(&self) -> f64 {
        self.before / self.now
    }

    /// Formats both values and their ratio.
    pub fn text(&self, digits: usize) -> String {
        format!("{:.digits$} -> {:.digits$} ({:.2}x)", self.before, self.now, self.ratio())
    }
}
