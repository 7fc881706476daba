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
/// Candidate units in metres: the metre, the international foot, and the US survey foot as a fraction and as most files
/// round it. Readers multiply the coordinates of a file by its unit.
const UNITS_M: [f64; 4] = [1.0, 0.3048, 1200.0 / 3937.0, 0.304_800_609_6];
/// Number of values that are sampled before all are checked.
const SAMPLE_SIZE: usize = 48;
/// Number of sampled values that may be off the grid.
const MAX_OFF_GRID: usize = 6;
/// Maximum number of steps from 0 to a value: 2^51. Products of larger numbers with the step are not exact.
const MAX_STEPS: f64 = 2_251_799_813_685_248.0;
/// Maximum number of steps from 0 to a sampled value. Nearly all floating-point numbers are close to a multiple of a
/// finer step.
const MAX_SAMPLED_STEPS: [f64; 2] = [4_194_304.0, 17_592_186_044_416.0];
/// Maximum difference between a value and its multiple of the step, in units in the last place. Values differ from exact
/// multiples if the program that wrote the file added an offset.
const MAX_ULPS: u64 = 100;

/// Grid of multiples of a step. Programs that read sensor files either multiply an integer by the step, or divide it by
/// the number of steps per unit; the results differ in the last place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grid {
    pub(super) steps: Steps,
    /// The multiples are multiplied by this: a unit in metres.
    pub(super) unit: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Steps {
    /// Multiples of this step.
    Times(f64),
    /// Integers divided by this number.
    Over(f64),
}

impl Grid {
    /// Returns the coarsest grid of each kind and unit on which most of the sampled values approximately lie.
    pub(super) fn of(values: &[f64], width: Width) -> impl Iterator<Item = Self> {
        // Irregular distances, because sensors repeat themselves after a fixed number of points.
        let every = values.len().div_ceil(SAMPLE_SIZE).max(1);
        let sample =
            move || (0..SAMPLE_SIZE).filter_map(move |k| values.get(k * every + k * k * 7_919 % every));
        let most_steps = MAX_SAMPLED_STEPS[usize::from(width == Width::Wide)] as i64;
        // Fewer values must all be on the grid.
        let most_off = if values.len() < SAMPLE_SIZE { 0 } else { MAX_OFF_GRID };
        let is_on = move |grid: &Self| {
            let is_off =
                |value: &&f64| grid.place(**value, width).is_none_or(|(steps, _)| steps.abs() > most_steps);
            sample().filter(is_off).nth(most_off).is_none()
        };
        UNITS_M.into_iter().flat_map(move |unit| {
            let times = STEPS.map(|step| Self { steps: Steps::Times(step), unit });
            let over = STEPS.map(|step| Self { steps: Steps::Over((1.0 / step).round()), unit });
            [over, times].into_iter().filter_map(move |grids| grids.into_iter().find(is_on))
        })
    }

    #[inline]
    fn value(self, steps: i64) -> f64 {
        let value = match self.steps {
            Steps::Times(step) => steps as f64 * step,
            Steps::Over(parts) => steps as f64 / parts,
        };
        value * self.unit
    }

    /// Returns the number of steps of a value, and its deviation in units in the last place; `None` if the deviation is
    /// too large.
    #[inline]
    pub(super) fn place(self, value: f64, width: Width) -> Option<(i64, i8)> {
        let steps = rounded(match self.steps {
            Steps::Times(step) => value * (1.0 / (step * self.unit)),
            Steps::Over(parts) => value * (parts / self.unit),
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
