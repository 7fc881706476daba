use std::str::FromStr;

/// A length as text: `5km`, `800m`, `800` (metres).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Length {
    /// In metres; positive and finite.
    pub metres: f64,
}

impl FromStr for Length {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (number, unit_m) = match (text.strip_suffix("km"), text.strip_suffix('m')) {
            (Some(number), _) => (number, 1000.0),
            (None, Some(number)) => (number, 1.0),
            (None, None) => (text, 1.0),
        };
        let metres = number.trim().parse::<f64>().map_or(f64::NAN, |number| number * unit_m);
        if metres > 0.0 && metres.is_finite() {
            Ok(Self { metres })
        } else {
            Err("not a length such as 5km or 800m".to_owned())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_have_a_unit_or_are_metres() {
        for (text, metres) in [("5km", 5_000.0), ("0.5 km", 500.0), ("800m", 800.0), ("800", 800.0)] {
            assert_eq!(text.parse(), Ok(Length { metres }), "{text}");
        }
        for text in ["", "km", "-1km", "0", "nan", "inf", "5 miles", "1e999km"] {
            assert!(text.parse::<Length>().is_err(), "{text}");
        }
    }
}
