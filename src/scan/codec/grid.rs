//! Values that are whole multiples of a step: millimetres, the steps of a file, the intensities of most sensors.

use super::words::Width;

/// Candidate steps, the coarsest first: those of sensors and files, and powers of two.
const STEPS: [f64; 30] = [
    1.0,
    0.5,
    0.25,
    0.125,
    0.1,
    0.0625,
    0.05,
    0.03125,
    0.025,
    0.02,
    0.015_625,
    0.01,
    0.007_812_5,
    0.005,
    0.004,
    0.003_906_25,
    0.002,
    0.001_953_125,
    0.001,
    0.000_976_562_5,
    0.0005,
    0.000_488_281_25,
    0.00025,
    0.000_244_140_625,
    0.0002,
    0.0001,
    0.000_05,
    0.000_025,
    0.000_01,
    0.000_001,
];
/// Number of values that are sampled before all are checked.
const SAMPLE_SIZE: usize = 48;
/// Maximum number of steps from 0 to a value: 2^51. Products of larger numbers with the step are not exact.
const MAX_STEPS: f64 = 2_251_799_813_685_248.0;
/// Maximum difference between a value and its multiple of the step, in units in the last place. Values differ from exact
/// multiples if the program that wrote the file added an offset.
const MAX_ULPS: u64 = 100;

/// Grid of multiples of a step. Programs that read sensor files either multiply an integer by the step, or divide it by
/// the number of steps per unit; the results differ in the last place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Grid {
    /// Multiples of this step.
    Times(f64),
    /// Integers divided by this number.
    Over(f64),
}

impl Grid {
    /// Returns the coarsest grid of each kind on which the sampled values approximately lie.
    pub(super) fn of(values: &[f64], width: Width) -> impl Iterator<Item = Self> {
        let every = values.len().div_ceil(SAMPLE_SIZE).max(1);
        let is_on =
            |grid: &Self| values.iter().step_by(every).all(|value| grid.place(*value, width).is_some());
        let times = STEPS.into_iter().map(Self::Times).find(is_on);
        let over = STEPS.into_iter().map(|step| Self::Over((1.0 / step).round())).find(is_on);
        [over, times].into_iter().flatten()
    }

    #[inline]
    fn value(self, steps: i64) -> f64 {
        match self {
            Self::Times(step) => steps as f64 * step,
            Self::Over(parts) => steps as f64 / parts,
        }
    }

    /// Returns the number of steps of a value, and its deviation in units in the last place; `None` if the deviation is
    /// too large.
    #[inline]
    pub(super) fn place(self, value: f64, width: Width) -> Option<(i64, i8)> {
        let steps = rounded(match self {
            Self::Times(step) => value / step,
            Self::Over(parts) => value * parts,
        });
        // A NaN is not whole: this comparison is false for it.
        let is_whole = steps.abs() < MAX_STEPS;
        if !is_whole {
            return None;
        }
        // As an integer, -0.0 becomes 0. It is restored by a deviation of one unit.
        let steps = steps as i64;
        let of_steps = width.ordered(width.bits(self.value(steps)));
        let apart = width.ordered(width.bits(value)).wrapping_sub(of_steps) as i64;
        let most = if width == Width::Narrow { 1 } else { MAX_ULPS };
        (apart.unsigned_abs() <= most).then_some((steps, apart as i8))
    }

    /// The value at a position.
    #[inline]
    pub(super) fn value_at(self, steps: i64, apart: i8, width: Width) -> f64 {
        let of_steps = width.ordered(width.bits(self.value(steps)));
        width.value(width.unordered(of_steps.wrapping_add(i64::from(apart) as u64)))
    }
}

/// Rounds a number whose magnitude is below 2^51 to an adjacent integer, like `round` but without a call.
#[inline]
pub(super) fn rounded(number: f64) -> f64 {
    const SHIFT: f64 = 6_755_399_441_055_744.0;
    (number + SHIFT) - SHIFT
}
