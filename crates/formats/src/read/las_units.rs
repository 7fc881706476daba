use super::crs_unit::{CrsUnit, FOOT_M, US_FOOT_M, is_metric, of_state_plane};
use super::las_layout::{Layout, double, number};
use super::las_records::{DOUBLES_ID, KEYS_ID, WKT_ID};
use super::wkt::WktUnits;
use crate::crs_codes::epsg_code;

/// Units and coordinate system of a LAS file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Units {
    /// Unit of x and y, and unit of z, in metres.
    pub(super) metres: [f64; 2],
    /// Coordinate system, if the coordinates are not converted.
    pub(super) crs: Option<String>,
    /// Whether the file names a coordinate system or a unit.
    pub(super) is_known: bool,
    pub(super) remarks: Vec<String>,
}

/// Returns a unit of length in metres, by its EPSG code.
fn of_epsg(code: u64) -> Option<f64> {
    Some(match code {
        9001 => 1.0,
        9002 => FOOT_M,
        9003 => US_FOOT_M,
        9005 => 0.304_797_265_4,
        9014 => 1.8288,
        9030 => 1852.0,
        9036 => 1000.0,
        9037 => 0.914_391_796_2,
        9040 => 0.914_398_414_616_028_7,
        9041 => 0.304_799_471_538_676_2,
        9093 => 1609.344,
        9094 => 0.304_799_710_181_508_8,
        9095 => 0.304_800_749_1,
        9096 => 0.9144,
        9097 => 20.1168,
        9098 => 0.201_168,
        1025 => 0.001,
        1033 => 0.01,
        _ => return None,
    })
}

/// Returns the unit of a vertical EPSG system in metres: NAVD88 and NGVD29 in feet, and common systems in metres.
fn of_vertical(code: u64) -> Option<f64> {
    match code {
        5702 | 6360 => Some(US_FOOT_M),
        8228 => Some(FOOT_M),
        3855 | 5621 | 5701 | 5703 | 5709 | 5713 | 5714 | 5728 | 5729 | 5730 | 5773 | 5783 | 6647 | 7837 => {
            Some(1.0)
        }
        _ => None,
    }
}

/// GeoTIFF keys.
const MODEL_TYPE: u64 = 1024;
const GEOGRAPHIC: u64 = 2;
const PROJECTED_SYSTEM: u64 = 3072;
const LINEAR_UNITS: u64 = 3076;
const LINEAR_UNIT_SIZE: u64 = 3077;
const VERTICAL_SYSTEM: u64 = 4096;
const VERTICAL_UNITS: u64 = 4099;
/// Code of a system or unit that the file defines itself.
const USER_DEFINED: u64 = 32767;

impl Units {
    pub(super) fn of(layout: &Layout) -> Self {
        let mut units = Self { metres: [1.0; 2], crs: None, is_known: false, remarks: Vec::new() };
        let text = layout
            .record(WKT_ID)
            .map(|data| String::from_utf8_lossy(data).trim_end_matches('\0').trim().to_owned());
        let text = text.filter(|text| !text.is_empty());
        // A file may have well-known text and GeoTIFF keys; the header states which one is valid.
        let keys = layout.record(KEYS_ID).filter(|_| text.is_none() || !layout.has_wkt);
        if let Some(keys) = keys {
            units.take_keys(keys, layout.record(DOUBLES_ID).unwrap_or_default());
        } else if let Some(wkt) = &text {
            units.take_wkt(wkt);
        }
        units.is_known |= text.is_some();
        units.crs = text.or(units.crs);
        if units.metres != [1.0; 2] {
            let [flat, high] = units.metres;
            units
                .remarks
                .push(format!("coordinates are converted to metres: x and y times {flat}, z times {high}"));
            // It describes the original coordinates, not those converted to metres.
            if let Some(crs) = units.crs.take() {
                let code = epsg_code(&crs).map_or(String::new(), |code| format!(": EPSG:{code}"));
                units.remarks.push(format!(
                    "the coordinate system is not in metres and is not passed on; an export can name it with \
                     `crs`{code}"
                ));
            }
        }
        units
    }

    /// Reads GeoTIFF keys: the unit of the projection, the unit of heights, and known systems in feet.
    fn take_keys(&mut self, keys: &[u8], doubles: &[u8]) {
        let entries = keys.as_chunks::<8>().0.iter().skip(1);
        let found = |wanted: u64, place: u64| {
            let mut found = entries
                .clone()
                .filter(|entry| number(*entry, 0, 2) == wanted && number(*entry, 2, 2) == place);
            found.next().map(|entry| number(entry, 6, 2))
        };
        // 0 means unknown.
        let value = |wanted| found(wanted, 0).filter(|value| *value > 0);
        self.is_known |= [MODEL_TYPE, PROJECTED_SYSTEM, LINEAR_UNITS, VERTICAL_SYSTEM, VERTICAL_UNITS]
            .into_iter()
            .any(|key| value(key).is_some());
        if value(MODEL_TYPE) == Some(GEOGRAPHIC) {
            self.degrees();
            return;
        }
        let system = value(PROJECTED_SYSTEM);
        self.crs =
            system.filter(|code| (1024..USER_DEFINED).contains(code)).map(|code| format!("EPSG:{code}"));
        let own_m = found(LINEAR_UNIT_SIZE, u64::from(DOUBLES_ID)).map(|at| double(doubles, 8 * at as usize));
        let own_m = own_m.filter(|metres| *metres > 1e-6 && *metres < 1e6);
        let unit = |code: u64| if code == USER_DEFINED { own_m } else { of_epsg(code) };
        let flat = value(LINEAR_UNITS).and_then(unit);
        match (flat.or(system.and_then(of_state_plane)), system) {
            (Some(metres), _) => self.metres = [metres; 2],
            (None, Some(code)) if code != USER_DEFINED && !is_metric(code) => self.remarks.push(format!(
                "the file does not state the unit of coordinate system EPSG:{code}; metres are assumed"
            )),
            _ => {}
        }
        if let Some(code) = value(LINEAR_UNITS).filter(|code| unit(*code).is_none()) {
            self.remarks.push(format!("the unit of x and y, EPSG:{code}, is unknown; metres are assumed"));
        }
        // The unit of heights defaults to that of the vertical system, then to that of the projection.
        let high = value(VERTICAL_UNITS).and_then(unit).or(value(VERTICAL_SYSTEM).and_then(of_vertical));
        if let Some(metres) = high {
            self.metres[1] = metres;
        }
        if let Some(code) = value(VERTICAL_UNITS).filter(|code| unit(*code).is_none()) {
            self.remarks
                .push(format!("the unit of z, EPSG:{code}, is unknown; {} m is assumed", self.metres[1]));
        }
    }

    /// Reads the units of well-known text. The unit of heights defaults to that of the projection.
    fn take_wkt(&mut self, wkt: &str) {
        let found = WktUnits::of(wkt);
        if found.is_degrees {
            self.degrees();
        }
        let mut take = |unit: Option<CrsUnit>, axes: &str| {
            if let Some(CrsUnit { metres, conflict: Some((name, factor)) }) = &unit {
                self.remarks.push(format!(
                    "the unit of {axes} is named {name}, but has the factor {factor}: the name is used, {metres} m"
                ));
            }
            unit.map(|unit| unit.metres)
        };
        let (flat, high) = (take(found.flat, "x and y"), take(found.high, "z"));
        if let Some(metres) = flat {
            self.metres = [metres; 2];
        }
        if let Some(metres) = high {
            self.metres[1] = metres;
        }
    }

    fn degrees(&mut self) {
        self.remarks.push(
            "coordinates are degrees, not metres: project the file first (PDAL: filters.reprojection)".into(),
        );
    }
}
