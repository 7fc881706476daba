use crate::read::crs_unit::unit_of_crs;
use crate::read::units::LengthUnit;
use voxtile::{Error, Result};

/// Unit of length of the coordinates and heights in a file. Maps are in metres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FileUnit {
    /// Metre.
    #[default]
    Metre,
    /// International foot, 0.3048 m.
    Foot,
    /// US survey foot, 1200/3937 m.
    UsSurveyFoot,
}

/// Relative tolerance for the factors in well-known text: a hundredth of the difference between the kinds of feet.
const SAME: f64 = 2e-8;

impl FileUnit {
    /// All units.
    pub const ALL: [Self; 3] = [Self::Metre, Self::Foot, Self::UsSurveyFoot];

    /// Name in options and files: `m`, `ft`, `us-ft`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Metre => "m",
            Self::Foot => "ft",
            Self::UsSurveyFoot => "us-ft",
        }
    }

    /// Returns the unit with this name.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|unit| unit.name() == name)
    }

    /// Returns the unit of a coordinate reference system, named as `EPSG:2230` or as well-known text; `None` if it is
    /// not known.
    ///
    /// # Errors
    ///
    /// The system has degrees, two units, or another unit than those of files.
    pub fn of_crs(crs: &str) -> Result<Option<Self>> {
        let refused = |reason: String| Err(Error::argument("crs", format!("{crs:.80}: {reason}")));
        match unit_of_crs(crs) {
            Ok(Some(metres)) => match Self::ALL
                .iter()
                .find(|unit| (unit.metres(1.0) / metres - 1.0).abs() < SAME)
            {
                Some(unit) => Ok(Some(*unit)),
                None => refused(format!("its unit of {metres} m is not supported; known units: m ft us-ft")),
            },
            Ok(None) => Ok(None),
            Err(reason) => refused(reason),
        }
    }

    const fn length(self) -> LengthUnit {
        match self {
            Self::Metre => LengthUnit::METRE,
            Self::Foot => LengthUnit::FOOT,
            Self::UsSurveyFoot => LengthUnit::US_SURVEY_FOOT,
        }
    }

    /// Converts a length in this unit to metres.
    pub const fn metres(self, length: f64) -> f64 {
        self.length().metres(length)
    }

    /// Converts metres to this unit. Metres are unchanged to the last bit.
    pub const fn of_metres(self, length_m: f64) -> f64 {
        self.length().of_metres(length_m)
    }

    /// EPSG code of the unit.
    pub(super) const fn epsg(self) -> u16 {
        match self {
            Self::Metre => 9001,
            Self::Foot => 9002,
            Self::UsSurveyFoot => 9003,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_convert_back() {
        for unit in FileUnit::ALL {
            assert_eq!(FileUnit::of_name(unit.name()), Some(unit));
            for length_m in [0.1, 1234.567, -98.7] {
                assert!((unit.metres(unit.of_metres(length_m)) / length_m - 1.0).abs() < 1e-15);
            }
        }
        assert_eq!(FileUnit::Metre.of_metres(0.1), 0.1);
        assert_eq!(FileUnit::UsSurveyFoot.of_metres(1200.0), 3937.0);
    }

    #[test]
    fn kinds_of_feet_are_distinguished() {
        let of = |crs| FileUnit::of_crs(crs);
        assert_eq!(of("EPSG:2230").unwrap(), Some(FileUnit::UsSurveyFoot));
        assert_eq!(of("EPSG:2222").unwrap(), Some(FileUnit::Foot));
        assert_eq!(of(r#"PROJCS["a",UNIT["foot",0.3048]]"#).unwrap(), Some(FileUnit::Foot));
        assert_eq!(of("EPSG:25832").unwrap(), Some(FileUnit::Metre));
        assert_eq!(of("EPSG:9999").unwrap(), None);
        assert!(of(r#"PROJCS["a",UNIT["link",0.201168]]"#).unwrap_err().to_string().contains("0.201168 m"));
    }
}
