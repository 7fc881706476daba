//! Exact conversion of time stamps from decimal text. A double cannot hold the nanoseconds of current Unix time.

/// Limit for the digits of a number, so that nothing overflows.
const MAX_DIGITS: usize = 36;

/// Parses a decimal number in units of `10^digits_per_unit` nanoseconds: 9 for seconds, 0 for nanoseconds. Digits below
/// a nanosecond are rounded. Returns `None` if it is not a number or exceeds 292 years.
pub(crate) fn nanoseconds(text: &str, digits_per_unit: i32) -> Option<i64> {
    let text = text.trim();
    let (is_negative, digits) = match text.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, text.strip_prefix('+').unwrap_or(text)),
    };
    let (mantissa, exponent) = match digits.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, exponent.parse::<i32>().ok()?),
        None => (digits, 0),
    };
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let is_number = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if (whole.is_empty() && fraction.is_empty()) || !is_number(whole) || !is_number(fraction) {
        return None;
    }
    if whole.len() + fraction.len() > MAX_DIGITS {
        return None;
    }
    let value: i128 = format!("{whole}{fraction}").parse().ok()?;
    let shift = exponent.checked_add(digits_per_unit)?.checked_sub(i32::try_from(fraction.len()).ok()?)?;
    let power = |digits: u32| 10_i128.checked_pow(digits);
    let value = if value == 0 {
        0
    } else if shift >= 0 {
        value.checked_mul(power(shift.unsigned_abs())?)?
    } else {
        // A divisor beyond all digits gives 0.
        power(shift.unsigned_abs()).map_or(0, |divisor| (value + divisor / 2) / divisor)
    };
    i64::try_from(if is_negative { -value } else { value }).ok()
}

/// Parses a decimal number of seconds.
pub(crate) fn of_seconds(text: &str) -> Option<i64> {
    nanoseconds(text, 9)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimal_text_keeps_its_digits() {
        assert_eq!(of_seconds("1403636579.763555584"), Some(1_403_636_579_763_555_584));
        assert_eq!(of_seconds("1.403636579763555584e+09"), Some(1_403_636_579_763_555_584));
        assert_eq!(of_seconds("-0.5"), Some(-500_000_000));
        assert_eq!(of_seconds("0.0000000005"), Some(1));
        assert_eq!(of_seconds("1e-40"), Some(0));
        assert_eq!(nanoseconds("1403636579763555584", 0), Some(1_403_636_579_763_555_584));
        for wrong in ["", ".", "1.2.3", "1e", "nan", "0x10", "1e400", "9300000000", "1_000"] {
            assert_eq!(of_seconds(wrong), None, "{wrong}");
        }
    }
}
