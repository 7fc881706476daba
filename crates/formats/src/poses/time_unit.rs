use crate::read::stamp;

/// Power of ten from seconds to nanoseconds.
pub(super) const SECONDS: i32 = 9;

/// Guesses the unit of a time from its magnitude. Returns the power of ten from the unit to nanoseconds: 9 for seconds.
pub(super) fn digits_of(word: &str) -> Option<i32> {
    let value: f64 = word.parse().ok()?;
    value.is_finite().then(|| digits_of_value(value))
}

/// As [`digits_of`], for a number.
pub(super) fn digits_of_value(value: f64) -> i32 {
    // A hundred billion seconds are 3000 years, so larger values are in smaller units.
    match value.abs() {
        large if large >= 1e17 => 0,
        large if large >= 1e14 => 3,
        large if large >= 1e11 => 6,
        _ => SECONDS,
    }
}

/// Parses a stamp in decimal text exactly.
pub(super) fn stamp_of(word: &str, digits: i32) -> Option<i64> {
    stamp::nanoseconds(word, digits)
}

/// Converts a stamp in floating point. The whole part is converted exactly.
pub(super) fn stamp_of_value(value: f64, digits: i32) -> Option<i64> {
    let unit_ns = 10_i64.checked_pow(u32::try_from(digits).ok()?)?;
    let whole = value.trunc();
    if whole.is_nan() || whole.abs() >= 9.2e18 {
        return None;
    }
    let fraction_ns = ((value - whole) * unit_ns as f64).round() as i64;
    (whole as i64).checked_mul(unit_ns)?.checked_add(fraction_ns)
}
