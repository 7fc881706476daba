/// Repeated measurements of a value.
#[derive(Clone, Debug, Default)]
pub struct Samples(Vec<f64>);

impl Samples {
    /// Adds a sample.
    pub fn push(&mut self, sample: f64) {
        self.0.push(sample);
    }

    /// The middle sample, or the mean of the two middle ones; NaN without samples.
    pub fn median(&self) -> f64 {
        let sorted = self.sorted();
        match sorted.len() {
            0 => f64::NAN,
            count => (sorted[(count - 1) / 2] + sorted[count / 2]) / 2.0,
        }
    }

    /// The smallest sample that a share (0 to 1) of the samples does not exceed; NaN without samples.
    pub fn quantile(&self, share: f64) -> f64 {
        let sorted = self.sorted();
        let rank = (share * sorted.len() as f64).ceil() as usize;
        sorted.get(rank.clamp(1, sorted.len().max(1)) - 1).copied().unwrap_or(f64::NAN)
    }

    /// All samples, ascending.
    pub fn sorted(&self) -> Vec<f64> {
        let mut sorted = self.0.clone();
        sorted.sort_by(f64::total_cmp);
        sorted
    }

    /// Largest minus smallest, as a share of the median: the noise of the measurements. NaN for fewer than two.
    pub fn spread(&self) -> f64 {
        match &self.sorted()[..] {
            [least, .., most] => (most - least) / self.median(),
            _ => f64::NAN,
        }
    }
}

impl FromIterator<f64> for Samples {
    fn from_iter<I: IntoIterator<Item = f64>>(samples: I) -> Self {
        Self(samples.into_iter().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_quantiles_and_spreads_do_not_depend_on_the_order() {
        let samples: Samples = [9.0, 1.0, 2.0, 4.0].into_iter().collect();
        assert_eq!(samples.median(), 3.0);
        assert_eq!(
            [0.0, 0.25, 0.5, 0.95, 1.0].map(|share| samples.quantile(share)),
            [1.0, 1.0, 2.0, 9.0, 9.0]
        );
        assert_eq!(samples.spread(), 8.0 / 3.0);
    }

    #[test]
    fn no_samples_have_no_median() {
        let nothing = Samples::default();
        assert!([nothing.median(), nothing.quantile(0.5), nothing.spread()].iter().all(|x| x.is_nan()));
        assert!(Samples(vec![3.0]).spread().is_nan());
    }
}
