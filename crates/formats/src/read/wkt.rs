//! Units of coordinate systems as well-known text.

/// What well-known text says of its coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WktUnits {
    /// Metres in a unit of x and y: the unit that closes PROJCS (PROJCRS).
    pub(super) flat_m: Option<f64>,
    /// Metres in a unit of z: the one of VERT_CS (VERTCRS).
    pub(super) high_m: Option<f64>,
    /// Coordinates are angles.
    pub(super) is_degrees: bool,
}

impl WktUnits {
    pub(super) fn of(wkt: &str) -> Self {
        // Of the same length, unlike Unicode's.
        let upper = wkt.to_ascii_uppercase();
        let at = |names: &[&str]| names.iter().find_map(|name| upper.find(name));
        let flat = at(&["PROJCS[", "PROJCRS["]).and_then(|at| wkt.get(at..));
        let vertical = at(&["VERT_CS[", "VERTCRS[", "VERTCS["]).and_then(|at| wkt.get(at..));
        Self {
            flat_m: flat.and_then(last_unit),
            high_m: vertical.and_then(last_unit),
            is_degrees: flat.is_none() && at(&["GEOGCS[", "GEOGCRS[", "GEODCRS["]).is_some(),
        }
    }
}

/// The last unit of length directly within the node that a text starts with: `UNIT["foot",0.3048]`,
/// `LENGTHUNIT["metre",1]`. Units of what is nested deeper (degrees, parameters) are passed by; axes of newer texts
/// hold the unit themselves and count if there is none beside them.
fn last_unit(text: &str) -> Option<f64> {
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
                    let factor = || text.get(at..)?.split([',', ']', ')']).nth(1)?.trim().parse::<f64>().ok();
                    let metres = factor().filter(|metres| *metres > 1e-6 && *metres < 1e6);
                    if depth == 2 {
                        own = metres.or(own);
                    } else if depth == 3 && axis_depth.is_some() {
                        of_axis = metres.or(of_axis);
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
            _ => word.clear(),
        }
    }
    own.or(of_axis)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_of_the_projection_is_not_that_of_its_ellipsoid() {
        let projection = "PROJCS[\"a, [b]\",GEOGCS[\"c\",DATUM[\"d\",SPHEROID[\"e\",6378137,298.25]],\
                          UNIT[\"degree\",0.0174]],PARAMETER[\"f\",9],UNIT[\"US survey foot\",0.3048006096]],VERT_CS[\"g\",\
                          UNIT[\"metre\",1]]";
        assert_eq!(last_unit(projection), Some(0.304_800_609_6));
        let axes = "PROJCRS[\"a\",BASEGEOGCRS[\"b\",ANGLEUNIT[\"degree\",0.0174]],CS[Cartesian,2],\
                    AXIS[\"x\",east,ORDER[1],LENGTHUNIT[\"foot\",0.3048]],AXIS[\"y\",north,LENGTHUNIT[\"foot\",0.3048]]]";
        assert_eq!(last_unit(axes), Some(0.3048));
        assert_eq!(last_unit("PROJCS[\"a\"]"), None);
        assert_eq!(last_unit("PROJCS[\"a\",UNIT[\"feet\",abc]]"), None);
    }
}
