/// What is known of one observed voxel: the exact log-odds and how many updates made it.
///
/// A voxel that was never observed has no `Evidence`; that is *unknown*, which is not log-odds 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evidence {
    /// Logarithm of the odds that the voxel is occupied.
    pub log_odds: f64,
    /// Number of applied updates, those at a clamp included; stays at `i32::MAX` once there.
    pub observation_count: i32,
}

impl Evidence {
    /// Where the first update of a voxel starts from.
    pub(crate) const PRIOR: Self = Self { log_odds: 0.0, observation_count: 0 };

    /// Probability that the voxel is occupied, in [0, 1].
    pub fn probability(&self) -> f64 {
        crate::maths::sigmoid(self.log_odds)
    }

    /// The evidence after one more update that led to `log_odds`.
    pub(crate) fn updated_to(self, log_odds: f64) -> Self {
        Self { log_odds, observation_count: self.observation_count.saturating_add(1) }
    }
}
