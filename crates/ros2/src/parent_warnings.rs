use crate::transport::Gid;
use std::collections::{HashMap, HashSet};
use voxtile_formats::ros::{SecondParent, Transforms};

/// Warns of frames that get a second parent or a parent that closes a loop, once for each pair of frames.
#[derive(Debug, Default)]
pub struct ParentWarnings {
    warned: HashSet<[String; 2]>,
    /// First publisher of the transform of each frame.
    publishers: HashMap<String, Gid>,
}

/// Bounds on the log and the memory under a flood of frames.
const MAX_WARNINGS: usize = 100;
const MAX_PUBLISHERS: usize = 2000;

impl ParentWarnings {
    /// Checks a parent that a frame did not have before, and warns of a second parent or a loop.
    pub fn check(&mut self, transforms: &Transforms, [parent, child]: [&str; 2], publisher: Option<Gid>) {
        if self.warned.len() < MAX_WARNINGS
            && !self.warned.contains(&[parent, child].map(str::to_owned))
            && let Some(second) = transforms.second_parent(parent, child)
        {
            log::warn!("{}", self.text(&second, publisher));
            self.warned.insert([parent, child].map(str::to_owned));
            if self.warned.len() == MAX_WARNINGS {
                log::warn!("{MAX_WARNINGS} pairs of frames have conflicting parents; no more are reported");
            }
        }
        if let Some(gid) = publisher
            && self.publishers.len() < MAX_PUBLISHERS
            && !self.publishers.contains_key(child)
        {
            self.publishers.insert(child.to_owned(), gid);
        }
    }

    fn text(&self, second: &SecondParent, publisher: Option<Gid>) -> String {
        let first = self.publishers.get(&second.child).filter(|_| second.before.is_some());
        let publishers = match (first, publisher) {
            (Some(first), Some(gid)) if *first == gid => format!("; publisher of both: {gid}"),
            (Some(first), Some(gid)) => format!("; publisher of the first: {first}, of the second: {gid}"),
            (None, Some(gid)) => format!("; publisher: {gid}"),
            (_, None) => String::new(),
        };
        format!(
            "{second}; a parent named by one transform, or one that closes a loop, is used only if no other leads to the \
             map frame{publishers}"
        )
    }

    /// Returns the number of pairs with a warning.
    #[cfg(test)]
    pub fn len(&self) -> usize {
        self.warned.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use voxtile_formats::RigidPose;

    #[test]
    fn both_publishers_are_named() {
        let (mut warnings, mut transforms) = (ParentWarnings::default(), Transforms::default());
        let mut put = |parent: &str, child: &str, gid| {
            transforms.insert(parent, child, 0, RigidPose::IDENTITY, false).unwrap();
            warnings.check(&transforms, [parent, child], gid);
            let second = transforms.second_parent(parent, child);
            (warnings.len(), second.map(|second| warnings.text(&second, gid)).unwrap_or_default())
        };
        assert_eq!(put("map", "base", Some(Gid([1; 16]))), (0, String::new()));
        let (count, text) = put("odom", "base", Some(Gid([0xab; 16])));
        assert_eq!(count, 1);
        assert!(text.starts_with("frame base has two parents: map and odom; "), "{text}");
        assert!(text.contains("first: 01.01.") && text.contains("second: ab.ab."), "{text}");
        assert_eq!(put("odom", "base", None).0, 1);
        for parent in 0..2 * MAX_WARNINGS {
            put(&parent.to_string(), "base", None);
        }
        assert_eq!(put("x", "base", None).0, MAX_WARNINGS);
    }
}
