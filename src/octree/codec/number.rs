/// Formats a positive, finite number as a C++ stream does: `%g`, six significant digits.
pub(super) fn to_six_digits(value: f64) -> String {
    // Rust and C round identically: the exact decimal value, ties to the even digit.
    let scientific = format!("{value:.5e}");
    let (digits, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if (-4..6).contains(&exponent) {
        without_trailing_zeros(&format!("{value:.*}", (5 - exponent) as usize)).to_owned()
    } else {
        let sign = if exponent < 0 { '-' } else { '+' };
        format!("{}e{sign}{:02}", without_trailing_zeros(digits), exponent.abs())
    }
}

fn without_trailing_zeros(decimal: &str) -> &str {
    if decimal.contains('.') { decimal.trim_end_matches('0').trim_end_matches('.') } else { decimal }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_formatted_as_in_c() {
        for (value, text) in [
            (0.1, "0.1"),
            (0.05, "0.05"),
            (0.123456789, "0.123457"),
            (1e-4, "0.0001"),
            (1e-5, "1e-05"),
            (2.5e-5, "2.5e-05"),
            (0.00009999995, "0.0001"),
            (1.0, "1"),
            (100.0, "100"),
            (100_000.5, "100000"),
            (100_001.5, "100002"),
            (999_999.5, "1e+06"),
            (5e6, "5e+06"),
            (12_345_678.9, "1.23457e+07"),
            (1.5e-300, "1.5e-300"),
            (f64::MAX, "1.79769e+308"),
            (5e-324, "4.94066e-324"),
        ] {
            assert_eq!(to_six_digits(value), text);
        }
    }
}
