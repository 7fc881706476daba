use super::las_layout::{Layout, number};

const WKT: u16 = 2112;
const KEYS: u16 = 34735;

/// What a LAS file says of its coordinates.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Units {
    /// Metres in a unit of x and y, and of z.
    pub(super) metres: [f64; 2],
    pub(super) wkt: Option<String>,
    pub(super) remarks: Vec<String>,
}

const US_FOOT_M: f64 = 1200.0 / 3937.0;

/// Metres in a unit of length by its number in the EPSG register.
fn of_epsg(code: u64) -> Option<f64> {
    match code {
        9001 => Some(1.0),
        9002 => Some(0.3048),
        9003 => Some(US_FOOT_M),
        9005 => Some(0.304_797_265_4),
        9036 => Some(1000.0),
        _ => None,
    }
}

impl Units {
    pub(super) fn of(layout: &Layout) -> Self {
        let mut units = Self { metres: [1.0; 2], wkt: None, remarks: Vec::new() };
        let text = layout
            .record(WKT)
            .map(|data| String::from_utf8_lossy(data).trim_end_matches('\0').trim().to_owned());
        units.wkt = text.filter(|text| !text.is_empty());
        // Both may be there: the header says which one counts.
        let keys = layout.record(KEYS).filter(|_| units.wkt.is_none() || !layout.has_wkt);
        if let Some(keys) = keys {
            units.take_keys(keys);
        } else if let Some(wkt) = units.wkt.clone() {
            units.take_wkt(&wkt);
        }
        if units.metres != [1.0; 2] {
            let [flat, high] = units.metres;
            units.remarks.push(format!("coordinates become metres: x and y times {flat}, z times {high}"));
        }
        units
    }

    /// GeoTIFF: unit of the projection, unit of heights, and known systems in feet.
    fn take_keys(&mut self, keys: &[u8]) {
        let entries = keys.as_chunks::<8>().0.iter().skip(1);
        let value = |wanted: u64| {
            let mut found =
                entries.clone().filter(|entry| number(*entry, 0, 2) == wanted && number(*entry, 2, 2) == 0);
            found.next().map(|entry| number(entry, 6, 2))
        };
        if value(1024) == Some(2) {
            self.degrees();
            return;
        }
        let flat = value(3076).and_then(of_epsg);
        match (flat.or(value(3072).and_then(of_state_plane)), value(3072)) {
            (Some(metres), _) => self.metres = [metres; 2],
            (None, Some(code)) if code != 32767 && !is_metric(code) => self.remarks.push(format!(
                "the unit of coordinate system EPSG:{code} is not in the file; metres are assumed"
            )),
            _ => {}
        }
        // Heights without a unit of their own are in that of the projection.
        if let Some(metres) = value(4099).and_then(of_epsg) {
            self.metres[1] = metres;
        }
    }

    /// Well-known text: the unit that closes PROJCS (PROJCRS) and the one of VERT_CS (VERTCRS).
    fn take_wkt(&mut self, wkt: &str) {
        let upper = wkt.to_uppercase();
        let at = |names: &[&str]| names.iter().find_map(|name| upper.find(name));
        let flat = at(&["PROJCS[", "PROJCRS["]).and_then(|at| wkt.get(at..));
        let vertical = at(&["VERT_CS[", "VERTCRS[", "VERTCS["]).and_then(|at| wkt.get(at..));
        let flat_m = flat.and_then(last_unit);
        if flat.is_none() && at(&["GEOGCS[", "GEOGCRS[", "GEODCRS["]).is_some() {
            self.degrees();
        }
        if let Some(metres) = flat_m {
            self.metres = [metres; 2];
        }
        if let Some(metres) = vertical.and_then(last_unit) {
            self.metres[1] = metres;
        }
    }

    fn degrees(&mut self) {
        self.remarks.push(
            "coordinates are degrees, not metres: project the file first (PDAL: filters.reprojection)".into(),
        );
    }
}

/// Metres in a unit of the state planes of NAD83 in feet, which files often name without their unit.
fn of_state_plane(code: u64) -> Option<f64> {
    match code {
        2222..=2224 | 2251..=2253 | 2256 | 2265 | 2266 | 2269 | 2270 | 2273 | 2280..=2282 => Some(0.3048),
        2225..=2289 => Some(US_FOOT_M),
        _ => None,
    }
}

/// Whether a projected system of the EPSG register is metric for sure: UTM on WGS 84, ETRS89 and NAD83.
fn is_metric(code: u64) -> bool {
    matches!(code, 32601..=32660 | 32701..=32760 | 25828..=25838 | 26901..=26923 | 3857 | 2154 | 2056 | 28992 | 27700)
}

/// The last unit of length directly within the node that a text starts with: `UNIT["foot",0.3048]`,
/// `LENGTHUNIT["metre",1]`. Units of what is nested deeper (degrees, parameters) are passed by; axes of newer texts hold
/// the unit themselves and count if there is none beside them.
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
