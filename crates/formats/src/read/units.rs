//! Units in column names: `x (cm)`, `X[mm]`, `y_mm`, `z/ft`, `time [us]`.

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LengthUnit {
    /// Short name.
    pub(crate) name: &'static str,
    times: f64,
    per: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TimeUnit {
    pub(crate) seconds: f64,
    /// Power of ten from the unit to nanoseconds: 9 for seconds.
    pub(crate) digits: i32,
}

const fn length(name: &'static str, times: f64, per: f64) -> LengthUnit {
    LengthUnit { name, times, per }
}

/// Units with their names in lower case. Division preserves decimals: 7 / 100 is 0.07, but 7 * 0.01 is not.
const LENGTHS: [(LengthUnit, &[&str]); 10] = [
    (LengthUnit::METRE, &["m", "meter", "meters", "metre", "metres", "mtr", "mtrs"]),
    (length("cm", 1.0, 100.0), &["cm", "centimeter", "centimeters", "centimetre", "centimetres"]),
    (length("mm", 1.0, 1000.0), &["mm", "millimeter", "millimeters", "millimetre", "millimetres"]),
    (length("dm", 1.0, 10.0), &["dm", "decimeter", "decimeters", "decimetre", "decimetres"]),
    (
        length("um", 1.0, 1e6),
        &["um", "\u{b5}m", "\u{3bc}m", "micron", "microns", "micrometer", "micrometers"],
    ),
    (length("km", 1000.0, 1.0), &["km", "kilometer", "kilometers", "kilometre", "kilometres"]),
    (
        LengthUnit::FOOT,
        &[
            "ft",
            "foot",
            "feet",
            "'",
            "ift",
            "ifoot",
            "internationalfoot",
            "internationalfeet",
            "footinternational",
            "footintl",
            "intlfoot",
        ],
    ),
    (
        LengthUnit::US_SURVEY_FOOT,
        &[
            "us-ft",
            "us_ft",
            "usft",
            "ftus",
            "sft",
            "us survey foot",
            "us survey feet",
            "ussurveyfoot",
            "ussurveyfeet",
            "surveyfoot",
            "footus",
            "usfoot",
            "usfeet",
            "footussurvey",
            "footuss",
            "ussft",
        ],
    ),
    (length("yd", 0.9144, 1.0), &["yd", "yard", "yards"]),
    (length("in", 0.0254, 1.0), &["in", "inch", "inches", "\""]),
];

const TIMES: [(TimeUnit, &[&str]); 4] = [
    (TimeUnit { seconds: 1e-9, digits: 0 }, &["ns", "nsec", "nsecs", "nanosec", "nanosecond", "nanoseconds"]),
    (
        TimeUnit { seconds: 1e-6, digits: 3 },
        &["us", "usec", "usecs", "\u{b5}s", "\u{3bc}s", "microsec", "microsecond", "microseconds"],
    ),
    (
        TimeUnit { seconds: 1e-3, digits: 6 },
        &["ms", "msec", "msecs", "millisec", "millisecond", "milliseconds"],
    ),
    (TimeUnit { seconds: 1.0, digits: 9 }, &["s", "sec", "secs", "second", "seconds"]),
];

impl LengthUnit {
    pub(crate) const METRE: Self = length("m", 1.0, 1.0);
    pub(crate) const FOOT: Self = length("ft", 0.3048, 1.0);
    pub(crate) const US_SURVEY_FOOT: Self = length("US survey foot", 1200.0, 3937.0);
    /// Known units, for messages.
    pub(crate) const KNOWN: &str = "m, dm, cm, mm, um, km, ft, us-ft, yd, in";

    /// Returns the unit with this name (lower case).
    pub(crate) fn named(name: &str) -> Option<Self> {
        LENGTHS.iter().find(|(_, names)| names.contains(&name)).map(|(unit, _)| *unit)
    }

    /// Converts a value to metres. Values in metres are unchanged to the last bit.
    #[inline]
    pub(crate) const fn metres(self, number: f64) -> f64 {
        number * self.times / self.per
    }

    /// Converts metres to this unit. Metres are unchanged to the last bit.
    #[inline]
    pub(crate) const fn of_metres(self, length_m: f64) -> f64 {
        length_m * self.per / self.times
    }
}

impl TimeUnit {
    /// Returns the unit with this name (lower case).
    pub(crate) fn named(name: &str) -> Option<Self> {
        TIMES.iter().find(|(_, names)| names.contains(&name)).map(|(unit, _)| *unit)
    }
}

/// Splits a column name into the name and its unit, both in lower case. A bracketed text is always the unit; after `_`,
/// `/`, `-` or a blank, only known units are.
pub(crate) fn name_and_unit(name: &str) -> (String, Option<String>) {
    let lower = name.trim().trim_matches(['"', '\'']).trim().to_lowercase();
    if let Some((before, unit)) = lower.split_once(['[', '(', '{', '<'])
        && !before.trim().is_empty()
    {
        let unit = unit.split([']', ')', '}', '>']).next().unwrap_or_default().trim();
        let name = before.trim().trim_end_matches(['_', '/', '-', ':']).trim_end().to_owned();
        return (name, Some(unit.to_owned()).filter(|unit| !unit.is_empty()));
    }
    if let Some((before, unit)) = lower.rsplit_once(['_', '/', '-', ' '])
        // `x_in` is more often an input than inches.
        && unit != "in"
        && (LengthUnit::named(unit).is_some() || TimeUnit::named(unit).is_some())
    {
        let before = before.trim_end_matches(['_', '/', '-', ' ', ':']);
        let before = before.strip_suffix("_in").or_else(|| before.strip_suffix(" in")).unwrap_or(before);
        if !before.is_empty() {
            return (before.to_owned(), Some(unit.to_owned()));
        }
    }
    (lower, None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_split_from_units() {
        for (name, wanted, unit) in [
            ("x (cm)", "x", Some("cm")),
            ("X[mm]", "x", Some("mm")),
            ("\"z [ft]\"", "z", Some("ft")),
            ("y_mm", "y", Some("mm")),
            ("x/mm", "x", Some("mm")),
            ("x mm", "x", Some("mm")),
            ("x_in_mm", "x", Some("mm")),
            ("x (px)", "x", Some("px")),
            ("q_RS_w []", "q_rs_w", None),
            ("timestamp_ns", "timestamp", Some("ns")),
            ("time [us]", "time", Some("us")),
            ("x_in", "x_in", None),
            ("offset_time", "offset_time", None),
            ("(x)", "(x)", None),
            ("m", "m", None),
        ] {
            assert_eq!(name_and_unit(name), (wanted.to_owned(), unit.map(str::to_owned)), "{name}");
        }
    }

    #[test]
    fn lengths_are_converted_to_metres() {
        for (name, number, metres) in [
            ("cm", 7.0, 0.07),
            ("millimetres", 1234.0, 1.234),
            ("m", 0.1 + 0.2, 0.1 + 0.2),
            ("feet", 10.0, 3.048),
            ("us-ft", 3937.0, 1200.0),
            ("km", 1.5, 1500.0),
        ] {
            assert_eq!(LengthUnit::named(name).map(|unit| unit.metres(number)), Some(metres), "{name}");
        }
        assert_eq!(LengthUnit::named("px"), None);
        assert_eq!(TimeUnit::named("us").map(|unit| unit.digits), Some(3));
    }
}
