use crate::transport::Gid;
use std::cmp::Reverse;
use std::collections::{HashMap, HashSet};

/// Which publisher names which child frames, and in which order they were last named: it chooses the frames to forget,
/// so that a flood of frames fills a bounded buffer and costs other publishers none of theirs.
#[derive(Debug, Default)]
pub struct FrameOwners {
    frames: HashMap<String, Owned>,
    /// Number of transforms so far.
    taken: u64,
}

#[derive(Clone, Debug)]
struct Owned {
    publisher: Option<Gid>,
    parent: String,
    is_static: bool,
    /// Number of the last transform.
    last: u64,
}

/// In which order frames of a publisher are forgotten.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Rank {
    /// Sent again and again.
    Moving,
    /// Sent once.
    Static,
    /// Sent once, and mounted on the robot: perhaps a sensor whose clouds start later.
    Mounted,
}

/// So many of the frames of a publisher are forgotten at a time: one of these.
const PART: usize = 4;
/// At least so many frames are forgotten at a time, of several publishers if need be: choosing them takes time.
const MIN_FORGOTTEN: usize = 100;

impl FrameOwners {
    /// Number of frames, those whose transforms are forgotten among them.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    pub fn knows(&self, child: &str) -> bool {
        self.frames.contains_key(child)
    }

    /// Notes a transform of a child.
    pub fn note(&mut self, parent: &str, child: &str, publisher: Option<Gid>, is_static: bool) {
        self.taken += 1;
        let owned = Owned { publisher, parent: parent.to_owned(), is_static, last: self.taken };
        if let Some(known) = self.frames.get_mut(child) {
            // What was sent once is not sent again because another publisher names it.
            *known = Owned { is_static: is_static || known.is_static, ..owned };
        } else {
            self.frames.insert(child.to_owned(), owned);
        }
    }

    /// Forgets some frames that are not needed, and returns them: of the publishers that have most, first moving ones
    /// and last static ones on needed frames other than the fixed one, of each kind those not named for longest.
    pub fn forget_some(&mut self, needed: &HashSet<String>, fixed: &str) -> Vec<String> {
        let mounted = self.mounted(needed, fixed);
        let mut publishers: HashMap<Option<Gid>, Vec<(Rank, u64, &str)>> = HashMap::new();
        for (child, owned) in self.frames.iter().filter(|(child, _)| !needed.contains(*child)) {
            let rank = match owned.is_static {
                false => Rank::Moving,
                true if mounted.contains(child.as_str()) => Rank::Mounted,
                true => Rank::Static,
            };
            publishers.entry(owned.publisher).or_default().push((rank, owned.last, child));
        }
        let mut publishers: Vec<_> = publishers.into_values().collect();
        publishers.iter_mut().for_each(|frames| frames.sort_unstable());
        // Of equally many, first those that were not named for longest.
        publishers.sort_by_key(|frames| (Reverse(frames.len()), frames.first().copied()));
        let mut forgotten: Vec<String> = Vec::new();
        for frames in publishers {
            let part = frames.len().div_ceil(PART);
            forgotten.extend(frames.into_iter().take(part).map(|(_, _, child)| child.to_owned()));
            if forgotten.len() >= MIN_FORGOTTEN {
                break;
            }
        }
        for child in &forgotten {
            self.frames.remove(child);
        }
        forgotten
    }

    /// The static frames that needed frames carry, the fixed one aside.
    fn mounted<'a>(&'a self, needed: &'a HashSet<String>, fixed: &str) -> HashSet<&'a str> {
        let mut children: HashMap<&str, Vec<&str>> = HashMap::new();
        for (child, owned) in self.frames.iter().filter(|(_, owned)| owned.is_static) {
            children.entry(&owned.parent).or_default().push(child);
        }
        let mut open: Vec<&str> = needed.iter().map(String::as_str).filter(|frame| *frame != fixed).collect();
        let mut mounted = HashSet::new();
        while let Some(frame) = open.pop() {
            // The fixed frame may be above others, and does not carry what is on it.
            let carried = children.get(frame).into_iter().flatten().filter(|child| **child != fixed);
            open.extend(carried.filter(|child| mounted.insert(**child)));
        }
        mounted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gid(number: usize) -> Option<Gid> {
        Some(Gid([number as u8; 16]))
    }

    fn needed() -> HashSet<String> {
        ["map", "base", "lidar"].map(str::to_owned).into()
    }

    #[test]
    fn mounts_of_sensors_are_forgotten_last() {
        let mut owners = FrameOwners::default();
        // The mount is sent once, before all markers of the same publisher.
        owners.note("rig", "camera", gid(1), true);
        owners.note("base", "rig", gid(1), true);
        for k in 0..2000 {
            owners.note("map", &format!("m{k}"), gid(1), true);
            owners.note("base", &format!("arm{k}"), gid(1), false);
        }
        let forgotten = owners.forget_some(&needed(), "map");
        assert!(forgotten.len() == 1001 && forgotten.iter().all(|frame| frame.starts_with("arm")));
        while owners.frames.len() > 10 {
            assert!(owners.knows("rig") && owners.knows("camera"), "{}", owners.len());
            owners.forget_some(&needed(), "map");
        }
    }

    #[test]
    fn many_publishers_of_one_frame_each_lose_many_at_a_time() {
        let mut owners = FrameOwners::default();
        for k in 0..200 {
            owners.note("map", &format!("f{k}"), gid(k), false);
        }
        owners.note("map", "f0", gid(0), false);
        let forgotten = owners.forget_some(&needed(), "map");
        assert_eq!((forgotten.len(), owners.len(), owners.knows("f0")), (100, 100, true));
    }
}
