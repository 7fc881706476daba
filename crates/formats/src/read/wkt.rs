//! Units of coordinate systems in well-known text.

use super::crs_unit::CrsUnit;

/// Units found in well-known text.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct WktUnits {
    /// Unit of x and y: the last one in PROJCS (PROJCRS).
    pub(super) flat: Option<CrsUnit>,
    /// Unit of z: the one in VERT_CS (VERTCRS).
    pub(super) high: Option<CrsUnit>,
    /// Whether coordinates are angles.
    pub(super) is_degrees: bool,
}

/// Systems with lengths, systems of heights, and systems with angles.
const FLAT: [&str; 7] =
    ["PROJCS", "PROJCRS", "PROJECTEDCRS", "LOCAL_CS", "ENGCRS", "ENGINEERINGCRS", "GEOCCS"];
const HIGH: [&str; 4] = ["VERT_CS", "VERTCRS", "VERTCS", "VERTICALCRS"];
const ANGLES: [&str; 4] = ["GEOGCS", "GEOGCRS", "GEOGRAPHICCRS", "GEODCRS"];

impl WktUnits {
    pub(super) fn of(wkt: &str) -> Self {
        // Upper case in ASCII preserves the length, so offsets are valid in both texts.
        let upper = wkt.to_ascii_uppercase();
        let at = |names: &[&str]| names.iter().find_map(|name| node(&upper, name));
        let unit = |names: &[&str]| at(names).and_then(|at| wkt.get(at..)).and_then(last_unit);
        Self {
            flat: unit(&FLAT),
            high: unit(&HIGH),
            is_degrees: at(&FLAT).is_none() && at(&ANGLES).is_some(),
        }
    }
}

/// Returns the offset of the node with this name.
fn node(upper: &str, name: &str) -> Option<usize> {
    upper.match_indices(name).map(|(at, _)| at).find(|at| {
        let (before, behind) = upper.split_at(*at);
        let is_whole = !before.ends_with(|letter: char| letter.is_alphanumeric() || letter == '_');
        is_whole && behind.get(name.len()..).is_some_and(|rest| rest.trim_start().starts_with(['[', '(']))
    })
}

/// Returns the last unit of length directly within the node at the start of `text`: `UNIT["foot",0.3048]` or
/// `LENGTHUNIT["metre",1]`. Units of deeper nodes (degrees, parameters) are ignored. In newer texts the axes contain
/// the unit; it is used if the node itself has none.
fn last_unit(text: &str) -> Option<CrsUnit> {
    let (mut depth, mut is_quoted) = (0_u32, false);
    let (mut own, mut of_axis) = (None, None);
    let mut axis_depth = None;
    let mut word = String::new();
    for (at, letter) in text.char_indices() {
        if letter == '"' {
            is_quoted = !is_quoted;
        }
        if is_quoted {
            continue;
        }
        match letter {
            '[' | '(' => {
                depth += 1;
                let name = word.to_uppercase();
                if name == "AXIS" && depth == 2 {
                    axis_depth = Some(depth);
                }
                if name == "UNIT" || name == "LENGTHUNIT" {
                    let unit = text.get(at + 1..).and_then(unit);
                    if depth == 2 {
                        own = unit.or(own);
                    } else if depth == 3 && axis_depth.is_some() {
                        of_axis = unit.or(of_axis);
                    }
                }
                word.clear();
            }
            ']' | ')' => {
                if axis_depth == Some(depth) {
                    axis_depth = None;
                }
                depth = depth.saturating_sub(1);
                word.clear();
                if depth == 0 {
                    break;
                }
            }
            letter if letter.is_alphanumeric() || letter == '_' => word.push(letter),
            letter if letter.is_whitespace() => {}
            _ => word.clear(),
        }
    }
    own.or(of_axis)
}

/// Parses a unit: its quoted name and its factor.
fn unit(inside: &str) -> Option<CrsUnit> {
    let (name, rest) = inside.trim_start().strip_prefix('"')?.split_once('"')?;
    let rest = rest.split([']', ')']).next().unwrap_or_default();
    let factor = rest.split(',').nth(1).and_then(|factor| factor.trim().parse::<f64>().ok());
    CrsUnit::of(name, factor.filter(|metres| *metres > 1e-6 && *metres < 1e6))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn metres(text: &str) -> Option<f64> {
        last_unit(text).map(|unit| unit.metres)
    }

    #[test]
    fn projection_unit_is_not_the_ellipsoid_unit() {
        let projection = "PROJCS[\"a, [b]\",GEOGCS[\"c\",DATUM[\"d\",SPHEROID[\"e\",6378137,298.25]],\
                          UNIT[\"degree\",0.0174]],PARAMETER[\"f\",9],UNIT[\"US survey foot\",0.3048006096]],VERT_CS[\"g\",\
                          UNIT[\"metre\",1]]";
        assert_eq!(metres(projection), Some(0.304_800_609_6));
        let axes = "PROJCRS[\"a\",BASEGEOGCRS[\"b\",ANGLEUNIT[\"degree\",0.0174]],CS[Cartesian,2],\
                    AXIS[\"x\",east,ORDER[1],LENGTHUNIT[\"foot\",0.3048]],AXIS[\"y\",north,LENGTHUNIT[\"foot\",0.3048]]]";
        assert_eq!(metres(axes), Some(0.3048));
        assert_eq!(metres("PROJCS[\"a\"]"), None);
        // A known unit needs no factor; others do.
        assert_eq!(metres("PROJCS[\"a\",UNIT[\"feet\",abc]]"), Some(0.3048));
        assert_eq!(metres("PROJCS[\"a\",UNIT[\"ell\",abc]]"), None);
    }

    #[test]
    fn nodes_are_whole_words() {
        let of = |text: &str| {
            let found = WktUnits::of(text);
            (found.flat.map(|unit| unit.metres), found.high.map(|unit| unit.metres), found.is_degrees)
        };
        assert_eq!(of("PROJCS [\"a\",\n  UNIT [\"foot\", 0.3048]]"), (Some(0.3048), None, false));
        assert_eq!(of("LOCAL_CS[\"hall\",UNIT[\"millimetre\",0.001]]"), (Some(0.001), None, false));
        assert_eq!(
            of("ENGCRS[\"a\",CS[Cartesian,3],LENGTHUNIT[\"foot\",0.3048]]"),
            (Some(0.3048), None, false)
        );
        assert_eq!(of("VERTCRS[\"h\",LENGTHUNIT[\"foot\",0.3048]]"), (None, Some(0.3048), false));
        assert_eq!(of("GEOGCS[\"WGS 84\",UNIT[\"degree\",0.0174]]"), (None, None, true));
        assert_eq!(of("PROJCRS[\"a\",BASEGEOGCRS[\"b\"]]"), (None, None, false));
    }
}
