use super::las_layout::{KEYS_ID, Layout, WKT_ID, number};
use super::wkt::WktUnits;

/// What a LAS file says of its coordinates.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Units {
    /// Metres in a unit of x and y, and of z.
    pub(super) metres: [f64; 2],
    /// The coordinate system, if the coordinates stay as they are in it.
    pub(super) crs: Option<String>,
    pub(super) remarks: Vec<String>,
}

/// The system is that of the file, not of the metres that are read of it.
const NOT_PASSED_ON: &str = "the coordinate system is not in metres, and the output does not name it";
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
        let mut units = Self { metres: [1.0; 2], crs: None, remarks: Vec::new() };
        let text = layout
            .record(WKT_ID)
            .map(|data| String::from_utf8_lossy(data).trim_end_matches('\0').trim().to_owned());
        let text = text.filter(|text| !text.is_empty());
        // Both may be there: the header says which one counts.
        let keys = layout.record(KEYS_ID).filter(|_| text.is_none() || !layout.has_wkt);
        if let Some(keys) = keys {
            units.take_keys(keys);
        } else if let Some(wkt) = &text {
            units.take_wkt(wkt);
        }
        units.crs = text.or(units.crs);
        if units.metres != [1.0; 2] {
            let [flat, high] = units.metres;
            units.remarks.push(format!("coordinates become metres: x and y times {flat}, z times {high}"));
            if units.crs.take().is_some() {
                units.remarks.push(NOT_PASSED_ON.into());
            }
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
        // 32767 is a system of the file's own.
        self.crs = value(3072).filter(|code| (1024..32767).contains(code)).map(|code| format!("EPSG:{code}"));
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

    /// Heights have the unit of the projection, if not one of their own.
    fn take_wkt(&mut self, wkt: &str) {
        let found = WktUnits::of(wkt);
        if found.is_degrees {
            self.degrees();
        }
        if let Some(metres) = found.flat_m {
            self.metres = [metres; 2];
        }
        if let Some(metres) = found.high_m {
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
