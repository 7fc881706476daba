use crate::pair::Pair;
use crate::programs::Programs;
use anyhow::Result;
use report::Samples;

/// Two versions that are compared.
pub struct Versions {
    /// The earlier one.
    pub before: Programs,
    /// The present one.
    pub now: Programs,
    /// How often each measurement is taken, the two in turn.
    pub runs: usize,
}

impl Versions {
    /// Measures both in turn; medians of several figures. A measurement that names no figure counts as NaN.
    ///
    /// # Errors
    ///
    /// Those of a measurement.
    pub fn measure<const N: usize>(
        &self,
        measure: impl Fn(&Programs) -> Result<[f64; N]>,
    ) -> Result<[Pair; N]> {
        let mut samples: [[Samples; 2]; N] = std::array::from_fn(|_| Default::default());
        for _ in 0..self.runs {
            for (version, programs) in [&self.before, &self.now].into_iter().enumerate() {
                let figures = measure(programs)?;
                samples.iter_mut().zip(figures).for_each(|(samples, figure)| samples[version].push(figure));
            }
        }
        Ok(samples.map(|[before, now]| Pair { before: before.median(), now: now.median() }))
    }
}
