use std::str::FromStr;

/// Height up to which a picture shows voxels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum MaxHeight {
    /// That of the sensor, if most columns around the trajectory are roofed.
    #[default]
    Auto,
    /// No limit.
    None,
    /// In metres.
    Metres(f64),
}

impl FromStr for MaxHeight {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "auto" => Ok(Self::Auto),
            "none" => Ok(Self::None),
            _ => match text.parse() {
                Ok(metres) if f64::is_finite(metres) => Ok(Self::Metres(metres)),
                _ => Err("must be auto, none, or a height in metres"),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_are_numbers_or_words() {
        assert_eq!("auto".parse(), Ok(MaxHeight::Auto));
        assert_eq!("none".parse(), Ok(MaxHeight::None));
        assert_eq!("-1.5".parse(), Ok(MaxHeight::Metres(-1.5)));
        for wrong in ["", "high", "nan", "inf", "1 m"] {
            assert!(wrong.parse::<MaxHeight>().is_err(), "{wrong}");
        }
    }
}
