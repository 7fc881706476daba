use crate::transport::Gid;
use std::collections::{HashMap, HashSet};

/// Which publisher names which child frames, and in which order they were last named: what a flood of frames may fill is
/// bounded, and whose frames are forgotten for others.
#[derive(Debug, Default)]
pub struct FrameOwners {
    frames: HashMap<String, Owned>,
    /// Number of transforms so far.
    taken: u64,
}

#[derive(Clone, Copy, Debug)]
struct Owned {
    publisher: Option<Gid>,
    /// Number of the last transform.
    last: u64,
}

/// So many of the frames of a publisher are forgotten at a time: one of these.
const PART: usize = 4;

impl FrameOwners {
    /// Number of frames, those whose transforms are forgotten among them.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    pub fn knows(&self, child: &str) -> bool {
        self.frames.contains_key(child)
    }

    /// Notes a transform of a child.
    pub fn note(&mut self, child: &str, publisher: Option<Gid>) {
        self.taken += 1;
        let owned = Owned { publisher, last: self.taken };
        if let Some(known) = self.frames.get_mut(child) {
            *known = owned;
        } else {
            self.frames.insert(child.to_owned(), owned);
        }
    }

    /// Forgets some frames that are not needed, and returns them: of the publisher that has most, those that it has not
    /// named for longest.
    pub fn forget_some(&mut self, needed: &HashSet<String>) -> Vec<String> {
        let spare = || self.frames.iter().filter(|(child, _)| !needed.contains(*child));
        let mut counts: HashMap<Option<Gid>, usize> = HashMap::new();
        spare().for_each(|(_, owned)| *counts.entry(owned.publisher).or_default() += 1);
        let Some((publisher, count)) = counts.into_iter().max_by_key(|(_, count)| *count) else {
            return Vec::new();
        };
        let mut frames: Vec<(u64, String)> = spare()
            .filter(|(_, owned)| owned.publisher == publisher)
            .map(|(child, owned)| (owned.last, child.clone()))
            .collect();
        frames.sort_unstable();
        frames.truncate(count.div_ceil(PART));
        let frames: Vec<String> = frames.into_iter().map(|(_, child)| child).collect();
        for child in &frames {
            self.frames.remove(child);
        }
        frames
    }
}
