//! Values that are whole multiples of a step: millimetres, the steps of a file, the intensities of most sensors.

use super::words::Width;

/// Steps that are tried, the coarsest first: those of sensors and files, and powers of two.
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
/// Values that are looked at before all are.
const LOOKED_AT: usize = 48;
/// Larger multiples have no exact products any more.
const MOST: f64 = 2_251_799_813_685_248.0;
/// How far a value may be from the product, in units of its last place: readers add offsets.
const MOST_ULPS: u64 = 100;

/// The coarsest step of which some of the values are multiples, near enough.
pub(super) fn step_of(values: &[f64], width: Width) -> Option<f64> {
    let every = values.len().div_ceil(LOOKED_AT).max(1);
    let mut steps = STEPS.into_iter();
    steps.find(|step| values.iter().step_by(every).all(|value| multiple(*value, *step, width).is_some()))
}

/// How many steps a value is, and how far it is from their product in units of the last place; `None` if that is far.
#[inline]
pub(super) fn multiple(value: f64, step: f64, width: Width) -> Option<(i64, i8)> {
    let steps = rounded(value / step);
    if !(steps.abs() < MOST) {
        return None;
    }
    // As an integer, so that there is one zero; the other is one place below it.
    let steps = steps as i64;
    let product = width.ordered(width.bits(steps as f64 * step));
    let apart = width.ordered(width.bits(value)).wrapping_sub(product) as i64;
    let most = if width == Width::Narrow { 1 } else { MOST_ULPS };
    (apart.unsigned_abs() <= most).then_some((steps, apart as i8))
}

/// A whole number next to this one, which is smaller than 2^51: what `round` does, without a call.
#[inline]
pub(super) fn rounded(number: f64) -> f64 {
    const SHIFT: f64 = 6_755_399_441_055_744.0;
    (number + SHIFT) - SHIFT
}

/// The value of so many steps.
#[inline]
pub(super) fn value_of(steps: i64, apart: i8, step: f64, width: Width) -> f64 {
    let product = width.ordered(width.bits(steps as f64 * step));
    width.value(width.unordered(product.wrapping_add(i64::from(apart) as u64)))
}
