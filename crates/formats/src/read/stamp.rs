//! Time stamps from decimal text, exactly: a double holds no nanoseconds of today.

use std::path::Path;

/// Digits that a number may have; more are an error, so that nothing overflows.
const MAX_DIGITS: usize = 36;

/// The nanoseconds of a decimal text of units of `10^digits_per_unit` nanoseconds: 9 for seconds, 0 for nanoseconds.
/// Digits beyond a nanosecond are rounded. `None` if it is not a number or beyond 292 years.
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
        // A power beyond all digits leaves nothing.
        power(shift.unsigned_abs()).map_or(0, |divisor| (value + divisor / 2) / divisor)
    };
    i64::try_from(if is_negative { -value } else { value }).ok()
}

/// The nanoseconds of a decimal text of seconds.
pub(crate) fn of_seconds(text: &str) -> Option<i64> {
    nanoseconds(text, 9)
}

/// Endings that a name has beside the last one: `0001.pcd.bin`, `frame-000001.depth.png`.
const INNER_ENDINGS: [&str; 4] = [".pcd", ".depth", ".cloud", ".points"];
/// From 1990 to 2100 in seconds: what a number in a name must mean to be a stamp. Counters do not come that far.
const PLAUSIBLE_S: std::ops::Range<i128> = 631_152_000..4_102_444_800;

/// The time stamp in a file's name: `1700000000123456789.bin`, `1403636579.763555.ply`, `lidar__1532402927647951.bin`.
pub fn in_name(path: &Path) -> Option<i64> {
    let name = path.file_name()?.to_str()?;
    let mut stem = name;
    if let Some((before, ending)) = name.rsplit_once('.')
        && !(ending.bytes().all(|byte| byte.is_ascii_digit()) && is_digits(before))
    {
        stem = before;
    }
    for ending in INNER_ENDINGS {
        stem = stem.strip_suffix(ending).unwrap_or(stem);
    }
    let number_at = stem.trim_end_matches(|letter: char| letter.is_ascii_digit() || letter == '.').len();
    let (prefix, number) = stem.split_at(number_at);
    let (whole, fraction) = number.split_once('.').unwrap_or((number, ""));
    // A date of ten or twelve digits behind a word is no stamp.
    let is_sure = prefix.is_empty() || (prefix.ends_with(['_', '-']) && whole.len() + fraction.len() >= 13);
    if !is_sure
        || !is_digits(whole)
        || whole.len() > 20
        || !fraction.bytes().all(|byte| byte.is_ascii_digit())
    {
        return None;
    }
    let value: i128 = whole.parse().ok()?;
    let in_unit = |(_, per_second): &(i32, i128)| PLAUSIBLE_S.contains(&(value / per_second));
    let (digits, per_second) =
        [(9, 1), (6, 1_000), (3, 1_000_000), (0, 1_000_000_000)].into_iter().find(in_unit)?;
    // Seconds alone may have a fraction.
    (fraction.is_empty() || per_second == 1).then(|| nanoseconds(number, digits))?
}

fn is_digits(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
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

    #[test]
    fn names_that_are_numbers_are_stamps_and_counters_are_not() {
        let stamps = [
            ("1700000000123456789.bin", 1_700_000_000_123_456_789),
            ("1403636579.763555.ply", 1_403_636_579_763_555_000),
            ("1403636579.763555", 1_403_636_579_763_555_000),
            ("1700000000123.pcd", 1_700_000_000_123_000_000),
            ("1700000000.ply", 1_700_000_000_000_000_000),
            ("n015-2018__LIDAR_TOP__1532402927647951.pcd.bin", 1_532_402_927_647_951_000),
        ];
        for (name, stamp_ns) in stamps {
            assert_eq!(in_name(Path::new(name)), Some(stamp_ns), "{name}");
        }
        for name in [
            "000012.bin",
            "0000000012.bin",
            "scan_20240101.ply",
            "scan_202401011200.ply",
            "v1.2.ply",
            "a.ply",
        ] {
            assert_eq!(in_name(Path::new(name)), None, "{name}");
        }
    }
}
