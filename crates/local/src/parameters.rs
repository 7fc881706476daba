use serde::Serialize;
use voxtile::maths::logit;
use voxtile::sensor::LogOdds;
use voxtile::{Error, Result};

/// Parameters of a local map. All of them may change while the map runs, from the next update on.
///
/// The names in brackets are the voxel mapping paper's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct LocalParameters {
    /// Probability in (0, 1) of a voxel before its first hit counts (`p_init`). Default: 0.5.
    pub initial_probability: f64,
    /// Hit, miss and clamps in log-odds. Default: OctoMap's.
    pub log_odds: LogOdds,
    /// Log-odds from which a voxel is occupied (`l_occ`). Default: 0.
    pub occupied_log_odds: f64,
    /// Log-odds up to which a voxel is known to be free, and removed (`l_free`). Default: logit(0.4).
    pub free_log_odds: f64,
    /// Most voxels with occupancy (`n_lim`): beyond it, those with the oldest updates are removed. `None` keeps all.
    pub max_voxels: Option<usize>,
    /// Points nearer to the sensor than this, in metres, are skipped. Default: 0.
    pub min_input_range_m: f64,
    /// Points farther from the sensor than this, in metres, are skipped (`d_in`); infinity takes all.
    pub input_range_m: f64,
    /// Voxels whose center is at most this far from the sensor, in metres, are inflated (`d_inf`); infinity takes all.
    pub inflation_range_m: f64,
    /// Voxels whose center is at most this far from an occupied voxel's center, in metres, are inflated; 0 is the
    /// occupied voxel alone, the most is 24 voxels. Default: 0.2.
    pub inflation_radius_m: f64,
    /// Most voxels that one update classifies, inflates or removes because parameters changed; the rest follows in
    /// later updates. At least 1. Changes by scans are not limited. Default: 20 000.
    pub work_per_update: usize,
}

/// Largest inflation radius in voxels: its ball has 57 777 voxels, which 16 bits can count.
pub(super) const MAX_RADIUS_VOXELS: f64 = 24.0;

impl Default for LocalParameters {
    fn default() -> Self {
        Self::local_mapping()
    }
}

impl LocalParameters {
    /// For a reactive planner: what was seen last, near the robot.
    pub fn local_mapping() -> Self {
        Self {
            initial_probability: 0.5,
            log_odds: LogOdds::default(),
            occupied_log_odds: 0.0,
            free_log_odds: logit(0.4),
            max_voxels: Some(50_000),
            min_input_range_m: 0.0,
            input_range_m: 40.0,
            inflation_range_m: 8.0,
            inflation_radius_m: 0.2,
            work_per_update: 20_000,
        }
    }

    /// For navigation while mapping: everything that was seen, inflated near the robot.
    pub fn autonomous_mapping() -> Self {
        Self { max_voxels: None, input_range_m: f64::INFINITY, ..Self::local_mapping() }
    }

    /// For a robot that receives maps of others: long input range, all of it inflated.
    pub fn passive_perception() -> Self {
        Self { input_range_m: f64::INFINITY, inflation_range_m: f64::INFINITY, ..Self::local_mapping() }
    }

    /// The same with at most so many voxels with occupancy.
    pub fn with_max_voxels(self, max_voxels: impl Into<Option<usize>>) -> Self {
        Self { max_voxels: max_voxels.into(), ..self }
    }

    /// The same with other ranges of input and inflation, in metres.
    pub fn with_ranges(self, input_range_m: f64, inflation_range_m: f64) -> Self {
        Self { input_range_m, inflation_range_m, ..self }
    }

    /// The same with another inflation radius in metres.
    pub fn with_inflation_radius(self, inflation_radius_m: f64) -> Self {
        Self { inflation_radius_m, ..self }
    }

    /// The parameters, if all are valid for this resolution.
    ///
    /// # Errors
    ///
    /// NaN, a negative range, thresholds outside the clamps or in the wrong order.
    pub fn validated(self, resolution_m: f64) -> Result<Self> {
        let wrong = |argument: &str, value: f64, right: &str| {
            Err(Error::argument(argument, format!("{value} is not {right}")))
        };
        self.log_odds.validated()?;
        let LogOdds { min, max, .. } = self.log_odds;
        let (free, occupied, p_init) = (self.free_log_odds, self.occupied_log_odds, self.initial_probability);
        if !(p_init > 0.0 && p_init < 1.0) {
            return wrong("initial probability", p_init, "a probability between 0 and 1");
        }
        if !(min <= free && free <= max) {
            return wrong("free log-odds", free, "between the clamps");
        }
        if !(free <= occupied && occupied <= max) {
            return wrong("occupied log-odds", occupied, "between the free log-odds and the upper clamp");
        }
        let lengths = [
            ("minimum input range", self.min_input_range_m),
            ("input range", self.input_range_m),
            ("inflation range", self.inflation_range_m),
        ];
        // Nothing is farther away than this.
        if self.min_input_range_m == f64::INFINITY {
            return wrong("minimum input range", f64::INFINITY, "a finite length");
        }
        if let Some((argument, value)) = lengths.into_iter().find(|(_, value)| value.is_nan() || *value < 0.0)
        {
            return wrong(argument, value, "a length of at least 0 m");
        }
        let radius_m = self.inflation_radius_m;
        if !(radius_m >= 0.0 && radius_m / resolution_m <= MAX_RADIUS_VOXELS) {
            let right = format!("a length from 0 m to {} m, 24 voxels", MAX_RADIUS_VOXELS * resolution_m);
            return wrong("inflation radius", radius_m, &right);
        }
        if self.max_voxels == Some(0) || self.work_per_update == 0 {
            return wrong("most voxels, and work per update", 0.0, "at least 1");
        }
        Ok(self)
    }
}
