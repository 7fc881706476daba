//! Units of length in coordinate reference systems.

use super::units::LengthUnit;
use super::wkt::WktUnits;

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

/// Returns the unit in metres of the NAD83 state planes in feet, which files often name without a unit.
pub(super) fn of_state_plane(code: u64) -> Option<f64> {
    match code {
        2222..=2224 | 2251..=2253 | 2256 | 2265 | 2266 | 2269 | 2270 | 2273 | 2280..=2282 => Some(FOOT_M),
        2225..=2289 => Some(US_FOOT_M),
        _ => None,
    }
}

/// Returns whether a projected EPSG system is known to be metric, such as UTM on WGS 84, ETRS89 and NAD83.
pub(super) fn is_metric(code: u64) -> bool {
    matches!(code, 32601..=32660 | 32701..=32760 | 25828..=25838 | 26901..=26923 | 3857 | 2154 | 2056 | 28992 | 27700)
}

/// Returns the unit in metres of the coordinates of a system, named as `EPSG:2230` or as well-known text; `None` if it
/// is not known.
///
/// # Errors
///
/// The problem, if the coordinates have no single unit of length.
pub(crate) fn unit_of_crs(crs: &str) -> Result<Option<f64>, String> {
    if let Some(code) = crs.strip_prefix("EPSG:") {
        let Ok(code) = code.parse() else { return Ok(None) };
        return Ok(of_state_plane(code).or(is_metric(code).then_some(1.0)));
    }
    let WktUnits { flat, high, is_degrees } = WktUnits::of(crs);
    if is_degrees {
        return Err("its coordinates are degrees".to_owned());
    }
    for unit in [&flat, &high].into_iter().flatten() {
        if let Some((name, factor)) = &unit.conflict {
            return Err(format!("its unit is named {name}, but has the factor {factor}"));
        }
    }
    match (flat.map(|unit| unit.metres), high.map(|unit| unit.metres)) {
        (Some(flat), Some(high)) if (flat / high - 1.0).abs() > SAME => {
            Err(format!("the unit of x and y is {flat} m, that of heights {high} m"))
        }
        (flat, high) => Ok(flat.or(high)),
    }
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

    #[test]
    fn systems_have_one_unit_or_none() {
        let feet =
            r#"PROJCS["a",GEOGCS["b",UNIT["degree",0.01745]],UNIT["US survey foot",0.304800609601219]]"#;
        let height_m = r#"VERT_CS["h",UNIT["metre",1]]"#;
        assert_eq!(unit_of_crs("EPSG:2230"), Ok(Some(US_FOOT_M)));
        assert_eq!(unit_of_crs("EPSG:2222"), Ok(Some(FOOT_M)));
        assert_eq!(unit_of_crs("EPSG:25832"), Ok(Some(1.0)));
        assert_eq!(unit_of_crs("EPSG:9999"), Ok(None));
        assert_eq!(unit_of_crs(feet), Ok(Some(0.304_800_609_601_219)));
        assert!(
            unit_of_crs(&format!("COMPD_CS[\"c\",{feet},{height_m}]")).unwrap_err().contains("heights 1 m")
        );
        assert!(unit_of_crs(r#"GEOGCS["b",UNIT["degree",0.01745]]"#).unwrap_err().contains("degrees"));
        assert!(unit_of_crs(r#"PROJCS["a",UNIT["foot",1]]"#).unwrap_err().contains("named foot"));
    }
}
