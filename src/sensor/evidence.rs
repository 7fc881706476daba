/// Evidence of one observed voxel: the exact log-odds and the number of updates.
///
/// An unobserved voxel has no `Evidence`: it is *unknown*, which differs from log-odds 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evidence {
    /// Logarithm of the odds that the voxel is occupied.
    pub log_odds: f64,
    /// Number of applied updates, including those at a clamp; saturates at `i32::MAX`.
    pub observation_count: i32,
}

impl Evidence {
    /// State before the first update.
    pub(crate) const PRIOR: Self = Self { log_odds: 0.0, observation_count: 0 };

    /// Probability that the voxel is occupied, in [0, 1].
    pub fn probability(&self) -> f64 {
        crate::maths::sigmoid(self.log_odds)
    }

    /// Returns the evidence after one more update that resulted in `log_odds`.
    pub(crate) fn updated_to(self, log_odds: f64) -> Self {
        Self { log_odds, observation_count: self.observation_count.saturating_add(1) }
    }
}
