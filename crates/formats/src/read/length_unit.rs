//! Units of length by name.

/// A unit of length as a file names it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LengthUnit {
    /// Metres in the unit.
    pub(super) metres: f64,
    /// Name and factor of a unit whose factor is another's: the name counts.
    pub(super) conflict: Option<(String, f64)>,
}

pub(super) const FOOT_M: f64 = 0.3048;
pub(super) const US_FOOT_M: f64 = 1200.0 / 3937.0;
/// Factors are written with so many digits. Feet of all kinds are as near to each other.
const SAME: f64 = 1e-4;

impl LengthUnit {
    /// A unit by its name and its factor. `None` if neither is known.
    pub(super) fn of(name: &str, factor: Option<f64>) -> Option<Self> {
        let (metres, conflict) = match (of_name(name), factor) {
            (Some(known), Some(factor)) if (factor / known - 1.0).abs() > SAME => {
                (known, Some((name.to_owned(), factor)))
            }
            // Other digits are another foot.
            (_, Some(factor)) => (factor, None),
            (known, None) => (known?, None),
        };
        Some(Self { metres, conflict })
    }
}

/// Metres in a unit with a well-known name.
fn of_name(name: &str) -> Option<f64> {
    let letters = name.chars().filter(|letter| letter.is_alphanumeric());
    let plain: String = letters.flat_map(char::to_lowercase).collect();
    Some(match plain.as_str() {
        "m" | "metre" | "metres" | "meter" | "meters" => 1.0,
        "ft" | "foot" | "feet" | "internationalfoot" | "internationalfeet" | "footinternational"
        | "footintl" | "intlfoot" | "ifoot" | "ift" => FOOT_M,
        "ussurveyfoot" | "ussurveyfeet" | "surveyfoot" | "footus" | "usfoot" | "usfeet" | "ftus" | "usft"
        | "footussurvey" | "footuss" | "ussft" => US_FOOT_M,
        "mm" | "millimetre" | "millimetres" | "millimeter" | "millimeters" => 0.001,
        "cm" | "centimetre" | "centimetres" | "centimeter" | "centimeters" => 0.01,
        "km" | "kilometre" | "kilometres" | "kilometer" | "kilometers" => 1000.0,
        "yd" | "yard" | "yards" => 0.9144,
        "in" | "inch" | "inches" => 0.0254,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_well_known_name_counts_more_than_a_factor_of_another_unit() {
        let of =
            |name, factor| LengthUnit::of(name, factor).map(|unit| (unit.metres, unit.conflict.is_some()));
        assert_eq!(of("US survey foot", Some(1.0)), Some((US_FOOT_M, true)));
        assert_eq!(of("Foot_US", Some(0.304_800_609_601_219)), Some((0.304_800_609_601_219, false)));
        assert_eq!(of("foot", Some(US_FOOT_M)), Some((US_FOOT_M, false)));
        assert_eq!(of("metre", Some(0.3048)), Some((1.0, true)));
        assert_eq!(of("foot (international)", None), Some((FOOT_M, false)));
        assert_eq!(of("link", Some(0.201_168)), Some((0.201_168, false)));
        assert_eq!(of("link", None), None);
    }
}
