use serde::Serialize;
use voxtile::maths::logit;
use voxtile::sensor::LogOdds;
use voxtile::{Error, Result};

/// Parameters of a local map. All of them can change at runtime, from the next update on.
///
/// Names in parentheses are those of the paper by La, Kang and Lee.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct LocalParameters {
    /// Occupancy probability in (0, 1) of a new voxel before its first hit is added (`p_init`). Default: 0.5.
    pub initial_probability: f64,
    /// Log-odds of a hit and of a miss, and the clamping limits. Default: OctoMap's.
    pub log_odds: LogOdds,
    /// Lowest log-odds of an occupied voxel (`l_occ`). Default: 0.
    pub occupied_log_odds: f64,
    /// Highest log-odds of a voxel known to be free, which is removed (`l_free`). Default: logit(0.4).
    pub free_log_odds: f64,
    /// Maximum number of stored voxels (`n_lim`), which are occupied or not yet known to be free. Beyond it, the least
    /// recently updated ones are removed. `None`: no limit.
    pub max_voxels: Option<usize>,
    /// Points nearer to the sensor than this, in metres, are skipped. Default: 0.
    pub min_input_range_m: f64,
    /// Points farther from the sensor than this, in metres, are skipped (`d_in`); infinity accepts all.
    pub input_range_m: f64,
    /// Voxels whose center is within this distance of the sensor, in metres, are inflated (`d_inf`); infinity inflates
    /// all.
    pub inflation_range_m: f64,
    /// Inflation radius in metres between voxel centers: 0 inflates the occupied voxel alone, the maximum is 24 voxels.
    /// Default: 0.2.
    pub inflation_radius_m: f64,
    /// Maximum number of voxels that one update reclassifies, inflates or removes because parameters changed; later
    /// updates continue. At least 1. Changes by scans are not limited. Default: 20 000.
    pub work_per_update: usize,
}

/// Largest inflation radius in voxels. Its ball has 57 777 voxels, so 16 bits suffice for the counts.
pub(super) const MAX_RADIUS_VOXELS: f64 = 24.0;

impl Default for LocalParameters {
    fn default() -> Self {
        Self::local_mapping()
    }
}

impl LocalParameters {
    /// Returns parameters for a reactive planner: recent voxels near the robot.
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

    /// Returns parameters for navigation while mapping: all observed voxels, inflated near the robot.
    pub fn autonomous_mapping() -> Self {
        Self { max_voxels: None, input_range_m: f64::INFINITY, ..Self::local_mapping() }
    }

    /// Returns parameters for a robot that receives maps from others: long input range, everything inflated.
    pub fn passive_perception() -> Self {
        Self { input_range_m: f64::INFINITY, inflation_range_m: f64::INFINITY, ..Self::local_mapping() }
    }

    /// Returns these parameters with another maximum number of voxels.
    pub fn with_max_voxels(self, max_voxels: impl Into<Option<usize>>) -> Self {
        Self { max_voxels: max_voxels.into(), ..self }
    }

    /// Returns these parameters with other ranges of input and inflation, in metres.
    pub fn with_ranges(self, input_range_m: f64, inflation_range_m: f64) -> Self {
        Self { input_range_m, inflation_range_m, ..self }
    }

    /// Returns these parameters with another inflation radius, in metres.
    pub fn with_inflation_radius(self, inflation_radius_m: f64) -> Self {
        Self { inflation_radius_m, ..self }
    }

    /// Returns the parameters if all are valid for this resolution.
    ///
    /// # Errors
    ///
    /// If a value is NaN, a range is negative, or thresholds are outside the clamps or in the wrong order.
    pub fn validated(self, resolution_m: f64) -> Result<Self> {
        let wrong = |argument: &str, value: f64, wanted: &str| {
            Err(Error::argument(argument, format!("must be {wanted}, but is {value}")))
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
        // An infinite minimum range would skip every point.
        if self.min_input_range_m == f64::INFINITY {
            return wrong("minimum input range", f64::INFINITY, "a finite length");
        }
        if let Some((argument, value)) = lengths.into_iter().find(|(_, value)| value.is_nan() || *value < 0.0)
        {
            return wrong(argument, value, "a length of at least 0 m");
        }
        let radius_m = self.inflation_radius_m;
        if !(radius_m >= 0.0 && radius_m / resolution_m <= MAX_RADIUS_VOXELS) {
            let wanted = format!("a length from 0 m to {} m, 24 voxels", MAX_RADIUS_VOXELS * resolution_m);
            return wrong("inflation radius", radius_m, &wanted);
        }
        if self.max_voxels == Some(0) || self.work_per_update == 0 {
            return wrong("max voxels or work per update", 0.0, "at least 1");
        }
        Ok(self)
    }
}
