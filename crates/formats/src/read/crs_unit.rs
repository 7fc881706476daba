//! Units of length in coordinate reference systems.

use super::units::LengthUnit;

/// Unit of the axes of a coordinate reference system.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct CrsUnit {
    /// Length of the unit in metres.
    pub(super) metres: f64,
    /// Name and factor as written, if they contradict each other. The name is then used.
    pub(super) conflict: Option<(String, f64)>,
}

pub(super) const FOOT_M: f64 = LengthUnit::FOOT.metres(1.0);
pub(super) const US_FOOT_M: f64 = LengthUnit::US_SURVEY_FOOT.metres(1.0);
/// Relative tolerance for factors, which are rounded in files. The kinds of feet differ by less.
const SAME: f64 = 1e-4;

impl CrsUnit {
    /// Determines the unit from a name and a factor. `None` if neither is known.
    pub(super) fn of(name: &str, factor: Option<f64>) -> Option<Self> {
        let (metres, conflict) = match (metres_by_name(name), factor) {
            (Some(known), Some(factor)) if (factor / known - 1.0).abs() > SAME => {
                (known, Some((name.to_owned(), factor)))
            }
            // Kinds of feet differ only in the last digits of their factors.
            (_, Some(factor)) => (factor, None),
            (known, None) => (known?, None),
        };
        Some(Self { metres, conflict })
    }
}

/// Returns the length of a unit in metres, by its name without blanks and punctuation: `Foot_US`, `US survey foot`.
fn metres_by_name(name: &str) -> Option<f64> {
    let letters = name.chars().filter(|letter| letter.is_alphanumeric());
    let plain: String = letters.flat_map(char::to_lowercase).collect();
    LengthUnit::named(&plain).map(|unit| unit.metres(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_unit_names_override_wrong_factors() {
        let of = |name, factor| CrsUnit::of(name, factor).map(|unit| (unit.metres, unit.conflict.is_some()));
        assert_eq!(of("US survey foot", Some(1.0)), Some((US_FOOT_M, true)));
        assert_eq!(of("Foot_US", Some(0.304_800_609_601_219)), Some((0.304_800_609_601_219, false)));
        assert_eq!(of("foot", Some(US_FOOT_M)), Some((US_FOOT_M, false)));
        assert_eq!(of("metre", Some(0.3048)), Some((1.0, true)));
        assert_eq!(of("foot (international)", None), Some((FOOT_M, false)));
        assert_eq!(of("link", Some(0.201_168)), Some((0.201_168, false)));
        assert_eq!(of("link", None), None);
    }
}
