use crate::transport::Gid;
use std::cmp::Reverse;
use std::collections::{BTreeSet, HashMap, HashSet};

/// Publishers of child frames, in the order of their last transforms. Chooses the frames to drop when the buffer is
/// full: a flood of frames from one publisher must not displace those of others.
#[derive(Debug, Default)]
pub struct FrameOwners {
    frames: HashMap<String, Owned>,
    /// Number of transforms received.
    taken: u64,
}

#[derive(Clone, Debug)]
struct Owned {
    publisher: Option<Gid>,
    parent: String,
    is_static: bool,
    /// Number of the last transform of the frame.
    last: u64,
}

/// Order in which frames of a publisher are dropped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Rank {
    /// Sent repeatedly.
    Moving,
    /// Sent once.
    Static,
    /// Sent once and mounted on the robot, for example a sensor whose clouds start later.
    Mounted,
}

/// A publisher loses one in `PART` of its frames at a time.
const PART: usize = 4;
/// Minimum number of frames dropped at a time, because the selection is slow. Several publishers may be affected.
const MIN_FORGOTTEN: usize = 100;

impl FrameOwners {
    /// Returns the number of frames, including those whose transforms were dropped.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    pub fn knows(&self, child: &str) -> bool {
        self.frames.contains_key(child)
    }

    /// Returns the names of all frames, sorted.
    pub fn names(&self) -> BTreeSet<&str> {
        self.frames.iter().flat_map(|(child, owned)| [child.as_str(), owned.parent.as_str()]).collect()
    }

    pub fn note(&mut self, parent: &str, child: &str, publisher: Option<Gid>, is_static: bool) {
        self.taken += 1;
        let owned = Owned { publisher, parent: parent.to_owned(), is_static, last: self.taken };
        if let Some(known) = self.frames.get_mut(child) {
            // A static frame remains static if another publisher sends it: its transform is not repeated.
            *known = Owned { is_static: is_static || known.is_static, ..owned };
        } else {
            self.frames.insert(child.to_owned(), owned);
        }
    }

    /// Removes some frames that are not needed, and returns them. Starts with the publishers with most frames. Removes
    /// the frames of a publisher in the order of `Rank`, and those of equal rank by age, the least recently sent first.
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
        // Among publishers with equally many frames, the one with the oldest frame is first.
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

    /// Returns the static frames mounted on needed frames other than the fixed one.
    fn mounted<'a>(&'a self, needed: &'a HashSet<String>, fixed: &str) -> HashSet<&'a str> {
        let mut children: HashMap<&str, Vec<&str>> = HashMap::new();
        for (child, owned) in self.frames.iter().filter(|(_, owned)| owned.is_static) {
            children.entry(&owned.parent).or_default().push(child);
        }
        let mut open: Vec<&str> = needed.iter().map(String::as_str).filter(|frame| *frame != fixed).collect();
        let mut mounted = HashSet::new();
        while let Some(frame) = open.pop() {
            // The fixed frame may be an ancestor of others; frames on it are not mounted on the robot.
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
    fn sensor_mounts_are_dropped_last() {
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
    fn many_frames_are_dropped_at_a_time_from_publishers_of_one_frame() {
        let mut owners = FrameOwners::default();
        for k in 0..200 {
            owners.note("map", &format!("f{k}"), gid(k), false);
        }
        owners.note("map", "f0", gid(0), false);
        let forgotten = owners.forget_some(&needed(), "map");
        assert_eq!((forgotten.len(), owners.len(), owners.knows("f0")), (100, 100, true));
    }
}
