use crate::output;
use crate::robot_name::RobotName;
use std::collections::BTreeMap;

/// Problems of robots, each printed once on standard error.
#[derive(Default)]
pub struct Reports {
    /// Messages by robot and kind.
    reported: BTreeMap<(RobotName, Kind), String>,
    is_full: bool,
}

/// Kind of a robot's problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Its layer file could not be read.
    Read,
    /// Its layer file could not be written.
    Save,
    /// Its layer could not be folded into the map.
    Fold,
    /// Its voxel or tile size differs from the map's.
    Grid,
    /// It sends more than the limits allow.
    Limit,
    /// It sends malformed packets.
    Malformed,
    /// Requests to it cannot be sent.
    Ask,
}

/// Maximum number of reports, because anyone can invent robot names.
const MAX_REPORTS: usize = 1000;

impl Reports {
    /// Prints a problem, unless it is already reported.
    pub fn report(&mut self, robot: &RobotName, kind: Kind, text: impl FnOnce() -> String) {
        if self.reported.contains_key(&(robot.clone(), kind)) || self.is_full {
            return;
        }
        if self.reported.len() >= MAX_REPORTS {
            self.is_full = true;
            output::report(format_args!(
                "more than {MAX_REPORTS} problems of robots; no further ones are reported"
            ));
            return;
        }
        let text = text();
        output::report(format_args!("{robot}: {text}"));
        self.reported.insert((robot.clone(), kind), text);
    }

    /// Removes a solved problem. If it recurs, it is reported again.
    pub fn is_over(&mut self, robot: &RobotName, kind: Kind) {
        self.reported.remove(&(robot.clone(), kind));
    }

    pub fn of<'a>(&'a self, robot: &'a RobotName) -> impl Iterator<Item = &'a str> {
        self.reported.iter().filter(move |((name, _), _)| name == robot).map(|(_, text)| text.as_str())
    }
}
