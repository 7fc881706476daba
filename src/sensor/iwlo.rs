use super::Evidence;
use crate::error::{Error, Result};
use crate::maths::sigmoid;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Intensity-weighted log-odds: a strong echo has more weight than a weak one, and a new voxel learns faster than an
/// old one. For sonar, radar and lidar intensity.
///
/// With `n` the count before the update and `P = sigmoid(L)`:
///
/// ```text
/// alpha = max(min_alpha, 1 / (1 + decay_rate * n))
/// w(I)  = 0                                                                  if I <= intensity_threshold
///         sigmoid(sharpness * (clamp01((I - threshold) / (max - threshold)) - 0.5))          otherwise
/// hit:  dL = occupied * w * alpha * s,  s = P / P_th * r_max                 if adaptive and P < P_th
/// miss: dL = free * alpha * s,          s = r_max + (1 - r_max) * (1 - (P - (1 - P_th)) / P_th)
///                                                                            if adaptive and P > 1 - P_th
/// L = clamp(L + dL, min, max);          s = 1 if no condition holds
/// ```
///
/// A point with `w = 0` is not evidence: its voxel gets neither a hit nor a miss from it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Iwlo {
    /// Log-odds of a hit of full weight, positive.
    pub occupied: f64,
    /// Log-odds of a miss, negative.
    pub free: f64,
    /// Steepness of the weight over the intensity; at 0.1 the intensity has almost no effect.
    pub sharpness: f64,
    /// Rate at which updates of a voxel lose weight with the number of earlier updates.
    pub decay_rate: f64,
    /// Minimum weight of an update by age, in [0, 1].
    pub min_alpha: f64,
    /// Lower clamp in log-odds.
    pub min: f64,
    /// Upper clamp in log-odds.
    pub max: f64,
    /// Intensities up to this one are not evidence, in the sensor's own unit.
    pub intensity_threshold: f64,
    /// Intensity of full weight, in the sensor's own unit.
    pub intensity_max: f64,
    /// Whether updates that contradict the current estimate are damped.
    pub adaptive: bool,
    /// Probability below which hits (and, mirrored, above which misses) are damped, in (0, 1].
    pub adaptive_probability: f64,
    /// Largest factor of a damped update, `r_max`.
    pub adaptive_ratio: f64,
}

impl Default for Iwlo {
    fn default() -> Self {
        Self {
            occupied: 3.5,
            free: -3.0,
            sharpness: 10.0,
            decay_rate: 0.1,
            min_alpha: 0.3,
            min: -10.0,
            max: 10.0,
            intensity_threshold: 35.0,
            intensity_max: 255.0,
            adaptive: true,
            adaptive_probability: 0.5,
            adaptive_ratio: 0.3,
        }
    }
}

impl fmt::Display for Iwlo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { occupied, free, sharpness, decay_rate, min_alpha, min, max, .. } = self;
        let Self { intensity_threshold, intensity_max, .. } = self;
        write!(
            f,
            "iwlo with occupied {occupied}, free {free}, sharpness {sharpness}, decay rate {decay_rate}, "
        )?;
        write!(
            f,
            "min alpha {min_alpha}, min {min}, max {max}, intensities {intensity_threshold} to {intensity_max}, "
        )?;
        match self.adaptive {
            true => write!(f, "adaptive below {} by {}", self.adaptive_probability, self.adaptive_ratio),
            false => f.write_str("not adaptive"),
        }
    }
}

impl Iwlo {
    /// Returns the model, if its parameters are valid.
    ///
    /// # Errors
    ///
    /// Fails with [`InvalidArgument`](crate::Error::InvalidArgument) and the first invalid parameter.
    pub fn validated(self) -> Result<Self> {
        let Self { occupied, free, sharpness, decay_rate, min_alpha, min, max, .. } = self;
        let numbers = [
            occupied,
            free,
            sharpness,
            decay_rate,
            min_alpha,
            min,
            max,
            self.intensity_threshold,
            self.intensity_max,
            self.adaptive_probability,
            self.adaptive_ratio,
        ];
        let wrong = |what: &str| Err(Error::argument("sensor model iwlo", format!("{what}, not {self}")));
        if !numbers.iter().all(|number| number.is_finite()) {
            return wrong("every parameter must be a finite number");
        }
        if !(occupied > 0.0 && free < 0.0 && min < max) {
            return wrong("needs free < 0 < occupied and min < max");
        }
        if self.intensity_max <= self.intensity_threshold {
            return wrong("the largest intensity must be above the intensity threshold");
        }
        if !(self.adaptive_probability > 0.0 && self.adaptive_probability <= 1.0) {
            return wrong("the adaptive probability must be above 0 and at most 1");
        }
        if sharpness < 0.0 {
            return wrong("the sharpness must be at least 0: a stronger echo cannot have a lower weight");
        }
        if !(decay_rate >= 0.0
            && (0.0..=1.0).contains(&min_alpha)
            && (0.0..=1.0).contains(&self.adaptive_ratio))
        {
            return wrong(
                "needs a decay rate of at least 0, a smallest alpha and an adaptive ratio in [0, 1]",
            );
        }
        Ok(self)
    }

    /// Returns the weight of an intensity in [0, 1]; 0 is not evidence.
    #[inline]
    pub fn weight(&self, intensity: f32) -> f64 {
        let intensity = f64::from(intensity);
        if intensity <= self.intensity_threshold {
            return 0.0;
        }
        let share = (intensity - self.intensity_threshold) / (self.intensity_max - self.intensity_threshold);
        sigmoid(self.sharpness * (share.clamp(0.0, 1.0) - 0.5))
    }

    #[inline]
    pub(super) fn hit(&self, before: Evidence, weight: f64) -> Evidence {
        let mut change = self.occupied * weight * self.alpha(before);
        if self.adaptive {
            let probability = sigmoid(before.log_odds);
            if probability < self.adaptive_probability {
                change *= probability / self.adaptive_probability * self.adaptive_ratio;
            }
        }
        self.changed(before, change)
    }

    #[inline]
    pub(super) fn miss(&self, before: Evidence) -> Evidence {
        let mut change = self.free * self.alpha(before);
        if self.adaptive {
            let probability = sigmoid(before.log_odds);
            let threshold = 1.0 - self.adaptive_probability;
            if probability > threshold {
                let certainty = (probability - threshold) / self.adaptive_probability;
                change *= self.adaptive_ratio + (1.0 - self.adaptive_ratio) * (1.0 - certainty);
            }
        }
        self.changed(before, change)
    }

    fn alpha(&self, before: Evidence) -> f64 {
        (1.0 / (1.0 + self.decay_rate * f64::from(before.observation_count))).max(self.min_alpha)
    }

    fn changed(&self, before: Evidence, change: f64) -> Evidence {
        before.updated_to((before.log_odds + change).clamp(self.min, self.max))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_bits_of_a_short_history() {
        let model = Iwlo::default();
        let mut evidence = Evidence::PRIOR;
        let mut bits = Vec::new();
        for intensity in [200.0, 36.0, 255.0, 90.5] {
            evidence = model.hit(evidence, model.weight(intensity));
            bits.push(evidence.log_odds.to_bits());
            evidence = model.miss(evidence);
            bits.push(evidence.log_odds.to_bits());
        }
        let golden = [
            0x4009_e03f_a1fe_e419,
            0x4002_2c57_8061_0ea8,
            0x4002_562a_a38f_5dd1,
            0x3ff4_da13_0199_6395,
            0x400e_4ac5_0caf_f558,
            0x4008_fed3_c625_0427,
            0x400a_59e0_fe88_d900,
            0x4005_6898_f4eb_6d54,
        ];
        assert_eq!(bits, golden, "{bits:#x?}");
        assert_eq!(evidence.observation_count, 8);
    }

    #[test]
    fn first_hits_and_misses_have_full_weight_at_even_odds() {
        // P = P_th = 0.5 is not below the threshold, and not above 1 - P_th.
        let model = Iwlo::default();
        let weight = model.weight(255.0);
        assert_eq!(model.hit(Evidence::PRIOR, weight).log_odds, 3.5 * weight);
        assert_eq!(model.miss(Evidence::PRIOR).log_odds, -3.0);
    }

    #[test]
    fn intensity_determines_the_weight() {
        let model = Iwlo::default();
        assert_eq!(model.weight(35.0), 0.0);
        assert_eq!(model.weight(-5.0), 0.0);
        assert_eq!(model.weight(145.0), 0.5);
        assert!(model.weight(35.1) > 0.0 && model.weight(255.0) < 1.0);
        assert_eq!(model.weight(255.0), model.weight(3015.0));
    }

    #[test]
    fn parameters_that_divide_by_zero_are_rejected() {
        for model in [
            Iwlo { intensity_max: 35.0, ..Iwlo::default() },
            Iwlo { adaptive_probability: 0.0, ..Iwlo::default() },
            Iwlo { sharpness: f64::NAN, ..Iwlo::default() },
            Iwlo { min: 10.0, ..Iwlo::default() },
            Iwlo { decay_rate: -1.0, ..Iwlo::default() },
        ] {
            assert!(model.validated().is_err(), "{model:?}");
        }
        assert!(Iwlo::default().validated().is_ok());
    }
}
