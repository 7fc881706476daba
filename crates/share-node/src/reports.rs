use crate::output;
use crate::robot_name::RobotName;
use std::collections::BTreeMap;

/// What is wrong with robots, told once each on standard error.
#[derive(Default)]
pub struct Reports {
    /// Of each robot, by kind.
    told: BTreeMap<(RobotName, Kind), String>,
    is_full: bool,
}

/// What can be wrong with one robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Its layer could not be read.
    Read,
    /// Its layer could not be written.
    Save,
    /// Its layer could not be folded.
    Fold,
    /// Its voxels are of another size.
    Grid,
    /// It sends more than there is room for.
    Limit,
    /// It sends what are no packets.
    Malformed,
    /// Nothing can be sent to it.
    Ask,
}

/// More than that are not told: names of robots are made up as easily as packets.
const MAX_TOLD: usize = 1000;

impl Reports {
    /// Tells of it, if that is new.
    pub fn tell(&mut self, robot: &RobotName, kind: Kind, text: impl FnOnce() -> String) {
        if self.told.contains_key(&(robot.clone(), kind)) || self.is_full {
            return;
        }
        if self.told.len() >= MAX_TOLD {
            self.is_full = true;
            output::tell(format_args!("more than {MAX_TOLD} faults of robots; no further ones are told"));
            return;
        }
        let text = text();
        output::tell(format_args!("{robot}: {text}"));
        self.told.insert((robot.clone(), kind), text);
    }

    /// Notes that it is over: next time it is new.
    pub fn is_over(&mut self, robot: &RobotName, kind: Kind) {
        self.told.remove(&(robot.clone(), kind));
    }

    /// What was told of a robot.
    pub fn of<'a>(&'a self, robot: &'a RobotName) -> impl Iterator<Item = &'a str> {
        self.told.iter().filter(move |((name, _), _)| name == robot).map(|(_, text)| text.as_str())
    }
}
