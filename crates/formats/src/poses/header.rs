use super::time_unit::SECONDS;

/// Which columns of a table are a pose.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Roles {
    /// With the decimal digits between its unit and a nanosecond, if its name tells the unit.
    pub(super) time: Option<(usize, Option<i32>)>,
    pub(super) position: [usize; 3],
    pub(super) quaternion: [usize; 4],
}

const UNITS: [(&str, i32); 9] = [
    ("ns", 0),
    ("nsec", 0),
    ("nsecs", 0),
    ("us", 3),
    ("ms", 6),
    ("s", SECONDS),
    ("sec", SECONDS),
    ("secs", SECONDS),
    ("seconds", SECONDS),
];
/// Names of times, the best first.
const TIMES: [&str; 6] = ["timestamp", "stamp", "header.stamp", "field.header.stamp", "time", "t"];

impl Roles {
    /// The columns that a line names, if they make a pose.
    pub(super) fn of(line: &str) -> Option<Self> {
        let mark = [';', ','].into_iter().find(|mark| line.contains(*mark));
        let words: Vec<&str> = match mark {
            Some(mark) => line.split(mark).collect(),
            None => line.split_ascii_whitespace().collect(),
        };
        let names: Vec<(String, Option<i32>)> = words.iter().map(|word| plain(word)).collect();
        let find = |is_it: &dyn Fn(&str) -> bool| names.iter().position(|(name, _)| is_it(name));
        let position = |axis: char| find(&|name| is_position(name, axis));
        let quaternion = |axis: char| find(&|name| is_quaternion(name, axis));
        let time = TIMES.iter().find_map(|time| find(&|name| name == *time));
        Some(Self {
            time: time.map(|at| (at, names.get(at).and_then(|(_, unit)| *unit))),
            position: [position('x')?, position('y')?, position('z')?],
            quaternion: [quaternion('x')?, quaternion('y')?, quaternion('z')?, quaternion('w')?],
        })
    }

    /// Whether these are `t x y z qx qy qz qw`, in seconds as far as the names tell.
    pub(super) fn are_those_of_tum(&self) -> bool {
        matches!(self.time, Some((0, None | Some(SECONDS))))
            && (self.position, self.quaternion) == ([1, 2, 3], [4, 5, 6, 7])
    }

    /// The last column that is needed.
    pub(super) fn last(&self) -> usize {
        let all = self.position.into_iter().chain(self.quaternion).chain(self.time.map(|(at, _)| at));
        all.max().unwrap_or(0)
    }
}

/// A name in lower case without its unit, and the unit.
fn plain(word: &str) -> (String, Option<i32>) {
    let lower = word.trim().trim_matches(['"', '#', '%']).trim().to_lowercase();
    let of_unit = |text: &str| UNITS.iter().find(|(unit, _)| *unit == text).map(|&(_, digits)| digits);
    if let Some((name, unit)) = lower.split_once(['[', '(']) {
        return (name.trim().to_owned(), of_unit(unit.trim_end_matches([']', ')']).trim()));
    }
    if let Some((name, unit)) = lower.rsplit_once('_') {
        if of_unit(unit).is_some() {
            return (name.to_owned(), of_unit(unit));
        }
        if unit == "m" {
            return (name.to_owned(), None);
        }
    }
    (lower, None)
}

/// `x`, `tx`, `px`, `pos_x`, `p_RS_R_x`, `pose.position.x`; no velocity.
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

/// `qx`, `q_x`, `q_RS_x`, `pose.orientation.x`, `quat_x`.
fn is_quaternion(name: &str, axis: char) -> bool {
    let Some(before) = name.strip_suffix(axis) else { return false };
    before == "q"
        || (before.starts_with("q_") && before.ends_with(['_', '.']))
        || ["orient", "quat", "rot"].iter().any(|part| before.contains(part))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_of_many_programs() {
        let tum = Roles { time: Some((0, None)), position: [1, 2, 3], quaternion: [4, 5, 6, 7] };
        assert_eq!(Roles::of(" timestamp tx ty tz qx qy qz qw   (sensor -> world)"), Some(tum.clone()));
        assert_eq!(Roles::of("t,x,y,z,qx,qy,qz,qw"), Some(tum));
        let euroc = "timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z [],v_RS_R_x \
                     [m s^-1]";
        let wanted = Roles { time: Some((0, Some(0))), position: [1, 2, 3], quaternion: [5, 6, 7, 4] };
        assert_eq!(Roles::of(euroc), Some(wanted));
        let ros = "%time,field.header.stamp,field.pose.position.x,field.pose.position.y,field.pose.position.z,\
                   field.pose.orientation.x,field.pose.orientation.y,field.pose.orientation.z,field.pose.orientation.w";
        let wanted = Roles { time: Some((1, None)), position: [2, 3, 4], quaternion: [5, 6, 7, 8] };
        assert_eq!(Roles::of(ros), Some(wanted));
        assert_eq!(Roles::of("qw qx qy qz z y x").map(|roles| roles.position), Some([6, 5, 4]));
        assert_eq!(Roles::of("poses of the run of Monday"), None);
    }
}
