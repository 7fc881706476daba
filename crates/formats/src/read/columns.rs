//! What the columns of a table of points mean, by their names.

use super::cloud::CloudPoint;

/// A column with times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TimeColumn {
    pub(super) at: usize,
    /// Seconds in a unit.
    pub(super) unit_s: f64,
}

/// Which columns are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Meaning {
    pub(super) xyz: [usize; 3],
    pub(super) intensity: Option<usize>,
    pub(super) time: Option<TimeColumn>,
}

const INTENSITIES: [&str; 6] = ["intensity", "reflectivity", "reflectance", "remission", "intensities", "i"];
const TIMES: [&str; 8] =
    ["time", "timestamp", "t", "offset_time", "gps_time", "gpstime", "stamps", "time_offset"];
/// Units behind a name: `time [ns]`, `timestamp_ns`.
const UNITS: [(&str, f64); 4] = [("ns", 1e-9), ("us", 1e-6), ("ms", 1e-3), ("s", 1.0)];

impl Meaning {
    /// Finds the columns by name. `is_integer` tells which columns hold integers: without a unit, their times are
    /// nanoseconds (Ouster's `t`, Livox' `offset_time`), and those of floats are seconds.
    pub(super) fn of(names: &[String], is_integer: impl Fn(usize) -> bool) -> Option<Self> {
        let plain: Vec<(String, Option<f64>)> = names.iter().map(|name| plain(name)).collect();
        let find = |wanted: &str| plain.iter().position(|(name, _)| name == wanted);
        let axis = |short: &str, number: usize| {
            find(short)
                .or_else(|| find(&format!("points:{number}")))
                .or_else(|| find(&format!("points_{number}")))
        };
        let xyz = [axis("x", 0)?, axis("y", 1)?, axis("z", 2)?];
        let time = TIMES.iter().find_map(|name| find(name)).map(|at| {
            let named = plain.get(at).and_then(|(_, unit)| *unit);
            TimeColumn { at, unit_s: named.unwrap_or(if is_integer(at) { 1e-9 } else { 1.0 }) }
        });
        Some(Self { xyz, intensity: INTENSITIES.iter().find_map(|name| find(name)), time })
    }

    /// The last column that is needed.
    pub(super) fn last(&self) -> usize {
        let more = self.intensity.into_iter().chain(self.time.map(|time| time.at));
        self.xyz.into_iter().chain(more).max().unwrap_or(0)
    }
}

/// A name in lower case without what programs put around it, and the unit that was behind it.
fn plain(name: &str) -> (String, Option<f64>) {
    let lower = name.trim().trim_matches('"').to_lowercase();
    let lower = lower.strip_prefix("scalar_").unwrap_or(&lower);
    let of_unit = |text: &str| UNITS.iter().find(|(unit, _)| *unit == text).map(|&(_, seconds)| seconds);
    if let Some((before, unit)) = lower.split_once(['[', '(']) {
        return (before.trim().to_owned(), of_unit(unit.trim_end_matches([']', ')']).trim()));
    }
    if let Some((before, unit)) = lower.rsplit_once('_') {
        if before != "offset" && before != "gps" && of_unit(unit).is_some() {
            return (before.to_owned(), of_unit(unit));
        }
        if unit == "m" && ["x", "y", "z"].contains(&before) {
            return (before.to_owned(), None);
        }
    }
    (lower.to_owned(), None)
}

/// Times beyond this many seconds count from an epoch, not from the stamp of a cloud.
const ABSOLUTE_S: f64 = 1e8;

/// Makes times relative to the stamp of their cloud.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Clock {
    stamp_ns: Option<i64>,
    first_s: Option<f64>,
}

impl Clock {
    pub(super) fn new(stamp_ns: Option<i64>) -> Self {
        Self { stamp_ns, first_s: None }
    }

    /// Seconds after the stamp; after the first point where the cloud has no stamp.
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

    /// The point of a row; NaN where nothing came back.
    pub(super) fn point(&mut self, meaning: &Meaning, value: impl Fn(usize) -> f64) -> CloudPoint {
        let position_m = meaning.xyz.map(&value);
        CloudPoint {
            position_m,
            intensity: meaning.intensity.map_or(0.0, |at| value(at) as f32),
            time_s: meaning.time.map_or(0.0, |time| self.relative_s(value(time.at) * time.unit_s)),
            is_return: position_m.iter().all(|coordinate| coordinate.is_finite()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(names: &[&str]) -> Vec<String> {
        names.iter().map(|name| (*name).to_owned()).collect()
    }

    #[test]
    fn columns_are_found_by_the_names_that_programs_use() {
        let found = Meaning::of(&names(&["Z", "X [m]", "scalar_Intensity", "y_m", "time [us]"]), |_| false);
        let time = Some(TimeColumn { at: 4, unit_s: 1e-6 });
        assert_eq!(found, Some(Meaning { xyz: [1, 3, 0], intensity: Some(2), time }));
        assert_eq!(Meaning::of(&names(&["x", "y", "t"]), |_| false), None);
        let ouster = Meaning::of(&names(&["x", "y", "z", "t"]), |_| true).and_then(|found| found.time);
        assert_eq!(ouster, Some(TimeColumn { at: 3, unit_s: 1e-9 }));
        let livox =
            Meaning::of(&names(&["x", "y", "z", "offset_time"]), |_| true).and_then(|found| found.time);
        assert_eq!(livox, Some(TimeColumn { at: 3, unit_s: 1e-9 }));
    }
}
