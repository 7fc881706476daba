//! Meaning of the columns of a table of points, derived from their names.

use super::cloud::CloudPoint;
use super::units::{LengthUnit, TimeUnit, name_and_unit};

/// A column of times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TimeColumn {
    pub(super) at: usize,
    /// Unit of the column, in seconds.
    pub(super) unit_s: f64,
}

/// Columns to read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Meaning {
    pub(super) xyz: [usize; 3],
    /// Units of x, y and z.
    pub(super) units: [LengthUnit; 3],
    pub(super) intensity: Option<usize>,
    pub(super) time: Option<TimeColumn>,
}

const INTENSITIES: [&str; 6] = ["intensity", "reflectivity", "reflectance", "remission", "intensities", "i"];
const TIMES: [&str; 8] =
    ["time", "timestamp", "t", "offset_time", "gps_time", "gpstime", "stamps", "time_offset"];
/// Bracketed texts after a coordinate name that are not units.
const NO_UNITS: [&str; 21] = [
    "world",
    "local",
    "global",
    "map",
    "sensor",
    "lidar",
    "utm",
    "enu",
    "ned",
    "east",
    "north",
    "up",
    "easting",
    "northing",
    "height",
    "altitude",
    "elevation",
    "float",
    "float32",
    "double",
    "float64",
];

/// A column name and its parts.
struct Column<'n> {
    written: &'n str,
    name: String,
    unit: Option<String>,
}

impl<'n> Column<'n> {
    /// Parses a name: lower case, without the prefixes that programs add, and with the unit separated.
    fn of(written: &'n str) -> Self {
        let (name, unit) = name_and_unit(written);
        if let Some((name, unit)) = array_name(&name) {
            return Self { written, name, unit };
        }
        let name = name.strip_prefix("scalar_").map(str::to_owned).unwrap_or(name);
        Self { written, name, unit }
    }

    /// Returns the unit of a coordinate; `None` if the name has none.
    fn length(&self) -> Result<Option<LengthUnit>, String> {
        let Some(unit) = self.unit.as_deref().filter(|unit| !NO_UNITS.contains(unit)) else {
            return Ok(None);
        };
        LengthUnit::named(unit).map(Some).ok_or_else(|| {
            format!(
                "column `{:.40}`: `{unit:.20}` is an unknown unit of length: convert the column to a known one ({}) \
                 and rename it",
                self.written,
                LengthUnit::KNOWN
            )
        })
    }
}

/// Parses the name of a VTK array column: `Points_m_XYZ:0` of VeloView is `points:0` in metres.
fn array_name(name: &str) -> Option<(String, Option<String>)> {
    let (array, number) = name.rsplit_once(':')?;
    let unit = array.strip_prefix("points_")?.strip_suffix("xyz")?.trim_end_matches('_');
    Some((format!("points:{number}"), Some(unit.to_owned()).filter(|unit| !unit.is_empty())))
}

impl Meaning {
    /// Three coordinates in metres, without intensity and time.
    pub(super) fn of_metres(xyz: [usize; 3]) -> Self {
        Self { xyz, units: [LengthUnit::METRE; 3], intensity: None, time: None }
    }

    /// Finds the columns by name. Returns `None` without x, y and z. `is_integer` returns whether a column holds
    /// integers: times without a unit are nanoseconds in integer columns (Ouster's `t`, Livox' `offset_time`) and
    /// seconds in others.
    ///
    /// # Errors
    ///
    /// The unit of a coordinate is unknown.
    pub(super) fn of(names: &[String], is_integer: impl Fn(usize) -> bool) -> Result<Option<Self>, String> {
        let columns: Vec<Column> = names.iter().map(|name| Column::of(name)).collect();
        let named = |wanted: &str| {
            let mut found = columns.iter().enumerate().filter(|(_, column)| column.name == wanted);
            let first = found.clone().next();
            // A table may have pixel coordinates in addition to metres.
            found.find(|(_, column)| column.length().is_ok()).or(first).map(|(at, _)| at)
        };
        let axis = |short: &str, number: usize| {
            named(short)
                .or_else(|| named(&format!("points:{number}")))
                .or_else(|| named(&format!("points_{number}")))
        };
        let (Some(x), Some(y), Some(z)) = (axis("x", 0), axis("y", 1), axis("z", 2)) else { return Ok(None) };
        let mut meaning = Self::of_metres([x, y, z]);
        meaning.units = units_of([x, y, z].map(|at| columns.get(at)))?;
        let find = |is_it: &dyn Fn(&Column) -> bool| columns.iter().position(is_it);
        // `t_m` is a translation, not a time.
        let is_length =
            |unit: &Option<String>| unit.as_deref().is_some_and(|unit| LengthUnit::named(unit).is_some());
        let time = |name: &str| find(&|column| column.name == name && !is_length(&column.unit));
        meaning.time = TIMES.iter().find_map(|name| time(name)).map(|at| {
            let unit = columns.get(at).and_then(|column| TimeUnit::named(column.unit.as_deref()?));
            let other = if is_integer(at) { 1e-9 } else { 1.0 };
            TimeColumn { at, unit_s: unit.map_or(other, |unit| unit.seconds) }
        });
        meaning.intensity = INTENSITIES.iter().find_map(|name| find(&|column| column.name == *name));
        Ok(Some(meaning))
    }

    /// Returns a remark for the user about the units.
    pub(super) fn remark(&self) -> Option<String> {
        let [x, y, z] = self.units.map(|unit| unit.name);
        if self.units == [LengthUnit::METRE; 3] {
            return None;
        }
        let units = if x == y && y == z {
            format!("x, y and z are in {x}")
        } else {
            format!("x is in {x}, y in {y}, z in {z}")
        };
        Some(format!("coordinates are converted to metres: {units} according to the column names"))
    }

    fn all(&self) -> impl Iterator<Item = usize> {
        let more = self.intensity.into_iter().chain(self.time.map(|time| time.at));
        self.xyz.into_iter().chain(more)
    }

    pub(super) fn reads(&self, at: usize) -> bool {
        self.all().any(|column| column == at)
    }

    /// Returns the index of the last column in use.
    pub(super) fn last(&self) -> usize {
        self.all().max().unwrap_or(0)
    }
}

/// Returns the units of three columns. Either all columns have a unit or none has.
fn units_of(columns: [Option<&Column>; 3]) -> Result<[LengthUnit; 3], String> {
    let mut units = [None; 3];
    for (unit, column) in units.iter_mut().zip(columns) {
        *unit = column.map_or(Ok(None), Column::length)?;
    }
    let other =
        units.iter().zip(columns).find(|(unit, _)| unit.is_some_and(|unit| unit != LengthUnit::METRE));
    let without = units.iter().zip(columns).find(|(unit, _)| unit.is_none());
    if let (Some((_, Some(other))), Some((_, Some(without)))) = (other, without) {
        return Err(format!(
            "column `{:.40}` has a unit and `{:.40}` has none: add the unit to every coordinate",
            other.written, without.written
        ));
    }
    Ok(units.map(|unit| unit.unwrap_or(LengthUnit::METRE)))
}

/// Larger times, in seconds, count from an epoch instead of the cloud's stamp.
const ABSOLUTE_S: f64 = 1e8;

/// Converts times to be relative to the stamp of their cloud.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Clock {
    stamp_ns: Option<i64>,
    first_s: Option<f64>,
}

impl Clock {
    pub(super) fn new(stamp_ns: Option<i64>) -> Self {
        Self { stamp_ns, first_s: None }
    }

    /// Returns the time after the stamp in seconds, or after the first point if the cloud has no stamp.
    fn relative_s(&mut self, time_s: f64) -> f64 {
        if !time_s.is_finite() {
            return 0.0;
        }
        if time_s.abs() < ABSOLUTE_S {
            return time_s;
        }
        let base = match self.stamp_ns {
            Some(stamp_ns) => stamp_ns as f64 * 1e-9,
            None => *self.first_s.get_or_insert(time_s),
        };
        time_s - base
    }

    /// Creates the point of a row. Its position is NaN where there was no return.
    pub(super) fn point(&mut self, meaning: &Meaning, value: impl Fn(usize) -> f64) -> CloudPoint {
        let intensity = meaning.intensity.map(&value);
        let time = meaning.time.map(|time| value(time.at));
        self.point_of(meaning, meaning.xyz.map(&value), intensity, time)
    }

    /// Creates the point of a row from values in the units of their columns.
    pub(super) fn point_of(
        &mut self,
        meaning: &Meaning,
        [x, y, z]: [f64; 3],
        intensity: Option<f64>,
        time: Option<f64>,
    ) -> CloudPoint {
        let [in_x, in_y, in_z] = meaning.units;
        let position_m = [in_x.metres(x), in_y.metres(y), in_z.metres(z)];
        let time = meaning.time.zip(time);
        CloudPoint {
            intensity: intensity.unwrap_or_default() as f32,
            time_s: time.map_or(0.0, |(column, time)| self.relative_s(time * column.unit_s)),
            is_return: position_m.iter().all(|coordinate| coordinate.is_finite()),
            ..CloudPoint::hit(position_m)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(names: &[&str]) -> Vec<String> {
        names.iter().map(|name| (*name).to_owned()).collect()
    }

    fn found(list: &[&str], is_integer: bool) -> Option<Meaning> {
        Meaning::of(&names(list), |_| is_integer).unwrap_or_else(|error| panic!("{error}"))
    }

    #[test]
    fn columns_are_found_by_common_names() {
        let time = Some(TimeColumn { at: 4, unit_s: 1e-6 });
        assert_eq!(
            found(&["Z", "X [m]", "scalar_Intensity", "y_m", "time [us]"], false),
            Some(Meaning { intensity: Some(2), time, ..Meaning::of_metres([1, 3, 0]) })
        );
        assert_eq!(found(&["x", "y", "t"], false), None);
        let time_of = |list: &[&str]| found(list, true).and_then(|found| found.time);
        assert_eq!(time_of(&["x", "y", "z", "t"]), Some(TimeColumn { at: 3, unit_s: 1e-9 }));
        assert_eq!(time_of(&["x", "y", "z", "offset_time"]), Some(TimeColumn { at: 3, unit_s: 1e-9 }));
        assert_eq!(time_of(&["x", "y", "z", "t_m"]), None);
        let veloview = ["Points_m_XYZ:0", "Points_m_XYZ:1", "Points_m_XYZ:2", "laser_id"];
        assert_eq!(found(&veloview, false), Some(Meaning::of_metres([0, 1, 2])));
        assert_eq!(
            found(&["x (px)", "y (px)", "X (m)", "Y (m)", "Z (m)"], false),
            Some(Meaning::of_metres([2, 3, 4]))
        );
        assert_eq!(found(&["x (world)", "y []", "z"], false), Some(Meaning::of_metres([0, 1, 2])));
    }

    #[test]
    fn units_of_coordinates_are_used_or_refused() {
        let point = |list: &[&str]| {
            let meaning = found(list, false).unwrap();
            let values = [700.0, 25.0, -1.0];
            (
                Clock::default().point(&meaning, |at| values[at]).position_m,
                meaning.remark().unwrap_or_default(),
            )
        };
        for (list, wanted, remark) in [
            (["x (cm)", "y (cm)", "z (cm)"], [7.0, 0.25, -0.01], "x, y and z are in cm"),
            (["X[mm]", "Y[mm]", "Z[mm]"], [0.7, 0.025, -0.001], "are in mm"),
            (["x_ft", "y_ft", "z_m"], [700.0 * 0.3048, 25.0 * 0.3048, -1.0], "x is in ft, y in ft, z in m"),
            (["Points_cm_XYZ:0", "Points_cm_XYZ:1", "Points_cm_XYZ:2"], [7.0, 0.25, -0.01], "are in cm"),
            (["x/km", "y/km", "z/km"], [700_000.0, 25_000.0, -1000.0], "are in km"),
            (["x (m)", "y", "z"], [700.0, 25.0, -1.0], ""),
        ] {
            let (position_m, found) = point(&list);
            assert_eq!(position_m, wanted, "{list:?}");
            assert!(found.contains(remark) && found.is_empty() == remark.is_empty(), "{list:?}: {found}");
        }
        for (list, reason) in [
            (["x (px)", "y (px)", "z (px)"], "column `x (px)`: `px` is an unknown unit of length"),
            (["x [deg]", "y [deg]", "z [m]"], "`deg` is an unknown unit"),
            (["x (cm)", "y", "z"], "column `x (cm)` has a unit and `y` has none"),
            (["x_ms", "y_ms", "z_ms"], "`ms` is an unknown unit of length"),
        ] {
            let error = Meaning::of(&names(&list), |_| false).unwrap_err();
            assert!(error.contains(reason), "{error}");
        }
    }
}
