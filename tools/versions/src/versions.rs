use crate::pair::Pair;
use crate::programs::Programs;
use anyhow::Result;
use report::Samples;

/// The versions to compare.
pub struct Versions {
    pub before: Programs,
    pub now: Programs,
    /// Number of runs of each measurement, alternating between the versions.
    pub runs: usize,
}

impl Versions {
    /// Runs the measurement with both versions in turn, and returns the medians. NaN marks a figure that a version
    /// lacks.
    ///
    /// # Errors
    ///
    /// Returns the error of a measurement.
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
