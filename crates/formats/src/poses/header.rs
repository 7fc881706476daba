use super::time_unit::SECONDS;
use crate::read::text_line::Separator;
use crate::read::units::{LengthUnit, TimeUnit, name_and_unit};

/// Columns of a table that form a pose.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Roles {
    pub(super) time: Option<TimeColumns>,
    pub(super) position: [usize; 3],
    /// Units of x, y and z.
    pub(super) units: [LengthUnit; 3],
    pub(super) quaternion: [usize; 4],
}

/// Columns that hold the time stamp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum TimeColumns {
    /// One column. The second value is the power of ten from its unit to nanoseconds (9 for seconds), if the column
    /// name states the unit.
    One(usize, Option<i32>),
    /// Whole seconds in one column and the remaining nanoseconds in another.
    Two { seconds: usize, nanoseconds: usize },
}

/// Meaning of a line of words.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Names {
    /// Column names of poses.
    Poses(Roles),
    /// Column names of an unsupported table, with their count and the reason.
    Wrong { columns: usize, reason: String },
    /// Any other text.
    Prose,
}

/// Names of time columns, most specific first.
const TIMES: [&str; 6] = ["timestamp", "stamp", "header.stamp", "field.header.stamp", "time", "t"];
const SECOND_NAMES: [&str; 2] = ["sec", "secs"];
const NANOSECOND_NAMES: [&str; 3] = ["nsec", "nsecs", "nanosec"];
/// Names of angles. They have no common convention, so they are refused.
const ANGLES: [&str; 12] =
    ["roll", "pitch", "yaw", "heading", "rx", "ry", "rz", "omega", "phi", "kappa", "euler", "theta"];
/// Bracketed texts after a column name that are units but not units of length.
const OTHER_UNITS: [&str; 14] = [
    "px", "pixel", "pixels", "deg", "degree", "degrees", "rad", "radian", "radians", "s", "ms", "ns", "m/s",
    "voxel",
];

impl Names {
    /// Classifies a line.
    pub(super) fn of(line: &str) -> Self {
        let words = words_of(line);
        let names: Vec<(String, Option<String>)> = words.iter().map(|word| plain(word)).collect();
        let find = |is_it: &dyn Fn(&str) -> bool| names.iter().position(|(name, _)| is_it(name));
        let position = ['x', 'y', 'z'].map(|axis| find(&|name| is_position(name, axis)));
        let quaternion = ['x', 'y', 'z', 'w'].map(|axis| find(&|name| is_quaternion(name, axis)));
        let [Some(x), Some(y), Some(z)] = position else { return Self::Prose };
        let wrong = |reason: String| Self::Wrong { columns: words.len(), reason };
        let unit_of = |at: usize| names.get(at).and_then(|(_, unit)| unit.as_deref());
        let [Some(qx), Some(qy), Some(qz), Some(qw)] = quaternion else {
            let is_angle = |name: &str| name.split(['_', '.', ' ']).any(|part| ANGLES.contains(&part));
            return match names.iter().find(|(name, _)| is_angle(name)) {
                Some((name, _)) => wrong(format!(
                    "the column `{name:.40}` is an angle: roll, pitch and yaw are not supported, because they have \
                     many conventions; save quaternions (qx qy qz qw) or matrices"
                )),
                None => Self::Prose,
            };
        };
        let mut units = [LengthUnit::METRE; 3];
        for (place, at) in units.iter_mut().zip([x, y, z]) {
            match unit_of(at).map(|text| (LengthUnit::named(text), text)) {
                Some((Some(unit), _)) => *place = unit,
                Some((None, text)) if is_a_unit(text, words.get(at).map_or("", |word| word)) => {
                    let known = LengthUnit::KNOWN;
                    return wrong(format!("`{text:.20}` is an unknown unit of length; known units: {known}"));
                }
                _ => {}
            }
        }
        let time = match time_columns(&names) {
            Ok(time) => time,
            Err(reason) => return wrong(reason),
        };
        Self::Poses(Roles { time, position: [x, y, z], units, quaternion: [qx, qy, qz, qw] })
    }
}

impl Roles {
    /// Returns whether the columns are `t x y z qx qy qz qw`, in seconds and metres as far as the names state units.
    pub(super) fn are_those_of_tum(&self) -> bool {
        matches!(self.time, Some(TimeColumns::One(0, None | Some(SECONDS))))
            && (self.position, self.quaternion) == ([1, 2, 3], [4, 5, 6, 7])
            && !self.has_units()
    }

    /// Returns whether w precedes x, y and z of the quaternion.
    pub(super) fn is_w_first(&self) -> bool {
        let [x, y, z, w] = self.quaternion;
        w < x.min(y).min(z)
    }

    /// Returns whether positions have a unit other than metres.
    pub(super) fn has_units(&self) -> bool {
        self.units.iter().any(|unit| *unit != LengthUnit::METRE)
    }

    /// Returns the index of the last column in use.
    pub(super) fn last(&self) -> usize {
        let time = match self.time {
            Some(TimeColumns::One(at, _)) => at,
            Some(TimeColumns::Two { seconds, nanoseconds }) => seconds.max(nanoseconds),
            None => 0,
        };
        self.position.into_iter().chain(self.quaternion).chain([time]).max().unwrap_or(0)
    }
}

/// Splits a line of column names. In a blank-separated line, a bracketed unit belongs to the name before it.
fn words_of(line: &str) -> Vec<String> {
    let separator = Separator::of(line);
    let mut words: Vec<String> = Vec::new();
    for word in separator.split(line) {
        match words.last_mut() {
            Some(last) if separator == Separator::Blank && word.starts_with(['[', '(']) => {
                last.push(' ');
                last.push_str(word);
            }
            _ => words.push(word.to_owned()),
        }
    }
    words
}

/// Splits a column name into its name, in lower case, and its unit.
fn plain(word: &str) -> (String, Option<String>) {
    name_and_unit(word.trim().trim_start_matches(['#', '%']))
}

/// Returns whether the bracketed text after a name is meant as a unit. It may also be a frame or a remark.
fn is_a_unit(text: &str, word: &str) -> bool {
    OTHER_UNITS.contains(&text) || (word.contains('[') && !matches!(text, "-" | "1") && !text.contains(' '))
}

fn time_columns(names: &[(String, Option<String>)]) -> Result<Option<TimeColumns>, String> {
    let find = |is_it: &dyn Fn(&str) -> bool| names.iter().position(|(name, _)| is_it(name));
    // `sec`, `header.stamp.sec`, or `stamp_sec`, whose last part is a unit.
    let part = |known: &[&str]| {
        find(&|name| {
            let mut parts = name.rsplit('.');
            parts.next().is_some_and(|last| known.contains(&last))
                && parts
                    .next()
                    .is_none_or(|before| matches!(before, "stamp" | "timestamp" | "time" | "header"))
        })
    };
    let with_unit = |name: &str, known: &[&str]| {
        let is_it = |unit: &Option<String>| unit.as_deref().is_some_and(|unit| known.contains(&unit));
        names.iter().position(|(own, unit)| own == name && is_it(unit))
    };
    let of_one_name =
        |name: &&str| Some((with_unit(name, &SECOND_NAMES)?, with_unit(name, &NANOSECOND_NAMES)?));
    let parts = part(&SECOND_NAMES).zip(part(&NANOSECOND_NAMES));
    if let Some((seconds, nanoseconds)) = parts.or_else(|| TIMES.iter().find_map(of_one_name)) {
        return Ok(Some(TimeColumns::Two { seconds, nanoseconds }));
    }
    let named = TIMES.iter().find_map(|time| find(&|name| name == *time));
    let Some(at) = named.or_else(|| part(&SECOND_NAMES)) else { return Ok(None) };
    match names.get(at).and_then(|(_, unit)| unit.as_deref()) {
        Some(unit @ ("min" | "mins" | "minutes" | "h" | "hours" | "d" | "days" | "m")) => {
            Err(format!("`{unit}` is an unknown unit of time; known units: ns, us, ms, s"))
        }
        unit => Ok(Some(TimeColumns::One(at, unit.and_then(TimeUnit::named).map(|unit| unit.digits)))),
    }
}

/// Matches `x`, `tx`, `px`, `pos_x`, `p_RS_R_x` and `pose.position.x`, but not velocities.
fn is_position(name: &str, axis: char) -> bool {
    let Some(before) = name.strip_suffix(axis) else { return false };
    let starts = |start: &str| before.starts_with(start) && before.ends_with(['_', '.']);
    matches!(before, "" | "t" | "p")
        || starts("p_")
        || starts("t_")
        || before.contains("pos")
            && !is_quaternion(name, axis)
            && (before.contains("position") || before.starts_with("pos"))
        || before.contains("trans")
}

/// Matches `qx`, `q_x`, `q_RS_x`, `pose.orientation.x` and `quat_x`.
fn is_quaternion(name: &str, axis: char) -> bool {
    let Some(before) = name.strip_suffix(axis) else { return false };
    before == "q"
        || (before.starts_with("q_") && before.ends_with(['_', '.']))
        || ["orient", "quat", "rot"].iter().any(|part| before.contains(part))
}

#[cfg(test)]
mod tests {
    use super::*;

    const METRES: [LengthUnit; 3] = [LengthUnit::METRE; 3];

    fn roles(line: &str) -> Option<Roles> {
        match Names::of(line) {
            Names::Poses(roles) => Some(roles),
            _ => None,
        }
    }

    fn one(at: usize, digits: Option<i32>) -> Option<TimeColumns> {
        Some(TimeColumns::One(at, digits))
    }

    #[test]
    fn headers_of_many_programs_are_read() {
        let tum = Roles { time: one(0, None), position: [1, 2, 3], units: METRES, quaternion: [4, 5, 6, 7] };
        assert_eq!(roles(" timestamp tx ty tz qx qy qz qw   (sensor -> world)"), Some(tum.clone()));
        assert_eq!(roles("tx ty tz qx qy qz qw (sensor to world)").map(|roles| roles.units), Some(METRES));
        assert_eq!(roles("qx qy qz qw tx ty tz (world)").map(|roles| roles.position), Some([4, 5, 6]));
        assert_eq!(roles("t,x,y,z,qx,qy,qz,qw"), Some(tum));
        let wanted =
            Roles { time: one(0, Some(0)), position: [1, 2, 3], units: METRES, quaternion: [5, 6, 7, 4] };
        for euroc in [
            "timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []",
            "timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_RS_R_x \
             [m s^-1]",
            "timestamp [ns] p_RS_R_x [m] p_RS_R_y [m] p_RS_R_z [m] q_RS_w [] q_RS_x [] q_RS_y [] q_RS_z []",
        ] {
            let found = roles(euroc).map(|found| Roles { time: wanted.time, ..found });
            assert_eq!(found, Some(wanted.clone()), "{euroc}");
        }
        let ros = "%time,field.header.stamp,field.pose.position.x,field.pose.position.y,field.pose.position.z,\
                   field.pose.orientation.x,field.pose.orientation.y,field.pose.orientation.z,field.pose.orientation.w";
        let wanted =
            Roles { time: one(1, None), position: [2, 3, 4], units: METRES, quaternion: [5, 6, 7, 8] };
        assert_eq!(roles(ros), Some(wanted));
        assert_eq!(roles("qw qx qy qz z y x").map(|roles| roles.position), Some([6, 5, 4]));
        assert_eq!(Names::of("poses of the run of Monday"), Names::Prose);
    }

    #[test]
    fn seconds_and_nanoseconds_in_two_columns_are_one_time() {
        let two = Some(TimeColumns::Two { seconds: 0, nanoseconds: 1 });
        for line in [
            "sec,nsec,x,y,z,qx,qy,qz,qw",
            "header.stamp.sec,header.stamp.nanosec,pose.position.x,pose.position.y,pose.position.z,\
             pose.orientation.x,pose.orientation.y,pose.orientation.z,pose.orientation.w",
            "secs nsecs tx ty tz qx qy qz qw",
            "timestamp_sec timestamp_nsec tx ty tz qx qy qz qw",
        ] {
            assert_eq!(roles(line).and_then(|roles| roles.time), two, "{line}");
        }
        assert_eq!(roles("sec x y z qx qy qz qw").and_then(|roles| roles.time), one(0, None));
    }

    #[test]
    fn units_are_used_or_refused() {
        for (line, unit) in [
            ("t[s],x[mm],y[mm],z[mm],qx,qy,qz,qw", "mm"),
            ("t tx(cm) ty(cm) tz(cm) qx qy qz qw", "cm"),
            ("time [s] x [ft] y [ft] z [ft] qx qy qz qw", "ft"),
            ("t x_mm y_mm z_mm qx qy qz qw", "mm"),
        ] {
            let units = roles(line).map(|roles| roles.units.map(|unit| unit.name));
            assert_eq!(units, Some([unit; 3]), "{line}");
        }
        assert_eq!(roles("timestamp[us] x y z qx qy qz qw").and_then(|roles| roles.time), one(0, Some(3)));
        for (line, wanted) in [
            ("t x[px] y[px] z[px] qx qy qz qw", "`px` is an unknown unit of length"),
            ("t x y z [furlong] qx qy qz qw", "`furlong` is an unknown unit of length"),
            ("t [min] x y z qx qy qz qw", "`min` is an unknown unit of time"),
            ("t x y z roll pitch yaw", "`roll` is an angle"),
            ("time,x,y,z,rx [deg],ry [deg],rz [deg]", "`rx` is an angle"),
        ] {
            match Names::of(line) {
                Names::Wrong { reason, .. } => assert!(reason.contains(wanted), "{reason}"),
                other => panic!("{line}: {other:?}"),
            }
        }
    }
}
