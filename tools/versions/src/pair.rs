/// What one measurement of both came to: medians.
#[derive(Clone, Copy)]
pub struct Pair {
    /// Of the earlier version.
    pub before: f64,
    /// Of the present one.
    pub now: f64,
}

impl Pair {
    /// How many times less the present version takes.
    pub fn ratio(&self) -> f64 {
        self.before / self.now
    }

    /// Both and their ratio, for reading.
    pub fn text(&self, digits: usize) -> String {
        format!("{:.digits$} -> {:.digits$} ({:.2}x)", self.before, self.now, self.ratio())
    }
}
