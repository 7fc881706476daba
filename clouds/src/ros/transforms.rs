use super::samples::Samples;
use crate::pose::RigidPose;
use crate::spill::TimedPose;
use std::collections::{HashMap, HashSet};

/// The tree of frames of a recording: where each frame was in its parent, over time.
#[derive(Clone, Debug, Default)]
pub struct Transforms {
    frames: HashMap<String, Frame>,
    /// Two samples further apart have nothing between them.
    most_gap_ns: Option<i64>,
}

/// What is known of a frame that has a parent.
#[derive(Clone, Debug, Default)]
struct Frame {
    /// The parent that came last.
    parent: String,
    links: HashMap<String, Link>,
}

#[derive(Clone, Debug)]
enum Link {
    /// At any time.
    Static(RigidPose),
    /// By stamp.
    Moving(Samples),
}

impl Frame {
    fn samples(&self) -> usize {
        self.links.values().map(Link::samples).sum()
    }
}

impl Link {
    fn samples(&self) -> usize {
        match self {
            Self::Static(_) => 1,
            Self::Moving(samples) => samples.len(),
        }
    }
}

/// Why the pose of a frame in another is not known at a time.
#[derive(Clone, Debug, PartialEq, Eq, Hash, thiserror::Error)]
#[non_exhaustive]
pub enum WhyNot {
    /// No transform names it.
    #[error("no transform names the frame {0}")]
    UnknownFrame(String),
    /// Both frames are known, but nothing connects them.
    #[error("nothing connects the frames {0} and {1}")]
    NotConnected(String, String),
    /// A frame is its own ancestor.
    #[error("the frame {0} is its own ancestor")]
    Loop(String),
    /// The stamp is before the first transform of a frame.
    #[error("the stamp is before the first transform of {0}")]
    Before(String),
    /// The stamp is behind the last transform of a frame.
    #[error("the stamp is after the last transform of {0}")]
    After(String),
    /// The transforms before and after the stamp are too far apart.
    #[error(
        "the transforms of {0} before and after the stamp are too far apart; --pose-tolerance allows for more"
    )]
    Gap(String),
    /// The frame moves in no other, so that nothing says where it was.
    #[error("no transform says how {0} moves")]
    NothingMoves(String),
    /// The points are in the fixed frame already, and where the sensor was is not known.
    #[error("the points are in the frame {0} already; nothing says where the sensor was")]
    AlreadyFixed(String),
    /// A temporary file cannot be read.
    #[error("{0}")]
    Unreadable(String),
}

impl Transforms {
    /// Sets how far apart in time two samples may be that a pose is found between; see
    /// [`most_gap_ns`](crate::poses::most_gap_ns).
    pub fn set_most_gap_ns(&mut self, most_gap_ns: Option<i64>) {
        self.most_gap_ns = most_gap_ns;
    }

    /// Adds where a child was in its parent. The parent that comes last is the one of the child; of two samples of the
    /// same stamp the later one counts. Returns whether it was taken: poses that are not valid, and frames without a
    /// name or in themselves, are not.
    pub fn insert(
        &mut self,
        parent: &str,
        child: &str,
        stamp_ns: i64,
        parent_from_child: RigidPose,
        is_static: bool,
    ) -> bool {
        let (parent, child) = (bare(parent), bare(child));
        if parent.is_empty() || child.is_empty() || parent == child || !parent_from_child.is_valid() {
            return false;
        }
        if !self.frames.contains_key(child) {
            self.frames.insert(child.to_owned(), Frame::default());
        }
        let Some(frame) = self.frames.get_mut(child) else { return false };
        if frame.parent != parent {
            parent.clone_into(&mut frame.parent);
        }
        match frame.links.get_mut(parent) {
            Some(Link::Moving(samples)) if !is_static => samples.insert(stamp_ns, parent_from_child),
            Some(link) if is_static => *link = Link::Static(parent_from_child),
            _ if is_static => drop(frame.links.insert(parent.to_owned(), Link::Static(parent_from_child))),
            _ => {
                let mut samples = Samples::default();
                samples.insert(stamp_ns, parent_from_child);
                frame.links.insert(parent.to_owned(), Link::Moving(samples));
            }
        }
        true
    }

    /// Whether it is known, or was, where a child was in a parent.
    pub(super) fn has_link(&self, parent: &str, child: &str) -> bool {
        self.frames.get(bare(child)).is_some_and(|frame| frame.links.contains_key(bare(parent)))
    }

    /// The samples of all links that move.
    pub(super) fn samples_mut(&mut self) -> impl Iterator<Item = &mut Samples> {
        let links = self.frames.values_mut().flat_map(|frame| frame.links.values_mut());
        links.filter_map(|link| match link {
            Link::Moving(samples) => Some(samples),
            Link::Static(_) => None,
        })
    }

    /// Puts samples in the place of what is known of a child in a parent, which becomes its parent. Returns whether
    /// they were taken: frames without a name or in themselves are not.
    pub(super) fn attach(&mut self, parent: &str, child: &str, samples: Samples) -> bool {
        let (parent, child) = (bare(parent), bare(child));
        if parent.is_empty() || child.is_empty() || parent == child {
            return false;
        }
        let frame = self.frames.entry(child.to_owned()).or_default();
        parent.clone_into(&mut frame.parent);
        frame.links.insert(parent.to_owned(), Link::Moving(samples));
        true
    }

    /// Forgets where a frame was in its parents.
    pub fn detach(&mut self, child: &str) {
        self.frames.remove(bare(child));
    }

    /// Forgets samples that are older than this before the last one of the same frames, and returns how many samples
    /// are left, with one for what is static: a buffer of tf keeps its last seconds.
    pub fn forget_older_than(&mut self, span_ns: i64) -> usize {
        let mut left = 0;
        for link in self.frames.values_mut().flat_map(|frame| frame.links.values_mut()) {
            if let Link::Moving(samples) = link {
                samples.forget_older_than(span_ns);
            }
            left += link.samples();
        }
        left
    }

    /// Forgets the older half of the frame that has most samples, and returns how many those were: who sends too many
    /// takes no room of others. What it was in other parents than the last one goes first.
    pub fn shrink_largest(&mut self) -> usize {
        let largest = self.frames.values_mut().max_by_key(|frame| frame.samples());
        let Some(frame) = largest else { return 0 };
        let before = frame.samples();
        let Frame { parent, links } = &mut *frame;
        links.retain(|of, _| *of == *parent);
        if let Some(Link::Moving(samples)) = links.get_mut(parent.as_str())
            && samples.len() == before
        {
            samples.forget_older_half();
        }
        before - frame.samples()
    }

    /// Number of frames that have a parent.
    pub fn frames(&self) -> usize {
        self.frames.len()
    }

    /// Whether a transform names a frame.
    pub fn knows(&self, frame: &str) -> bool {
        let frame = bare(frame);
        self.frames.contains_key(frame) || self.frames.values().any(|known| known.parent == frame)
    }

    /// Whether there are no transforms.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// The frame, its parent, and so on up to the root.
    ///
    /// # Errors
    ///
    /// A loop.
    pub fn ancestors(&self, frame: &str) -> Result<Vec<String>, WhyNot> {
        let mut chain = vec![bare(frame).to_owned()];
        let mut seen: HashSet<&str> = HashSet::from([bare(frame)]);
        let mut at = bare(frame);
        while let Some(known) = self.frames.get(at) {
            at = &known.parent;
            if !seen.insert(at) {
                return Err(WhyNot::Loop(at.to_owned()));
            }
            chain.push(at.to_owned());
        }
        Ok(chain)
    }

    /// Whether the link of a frame to its parent changes over time.
    pub fn is_moving(&self, child: &str) -> bool {
        let link = self.frames.get(bare(child)).and_then(|frame| frame.links.get(&frame.parent));
        matches!(link, Some(Link::Moving(_)))
    }

    /// The pose of the source frame in the target frame at a time: along the whole chain, each link between the samples
    /// around the stamp. Nothing is extrapolated.
    ///
    /// # Errors
    ///
    /// Why it is not known.
    pub fn lookup(&self, target_frame: &str, source_frame: &str, stamp_ns: i64) -> Result<RigidPose, WhyNot> {
        let (target, source) = (bare(target_frame), bare(source_frame));
        if target == source {
            return Ok(RigidPose::IDENTITY);
        }
        let [from_target, from_source] = self.links_between(target, source)?;
        let common_from_source = self.along(&from_source, stamp_ns)?;
        let common_from_target = self.along(&from_target, stamp_ns)?;
        Ok(common_from_target.inverse().then(&common_from_source))
    }

    /// The frames whose place in their parents leads from one frame to another: up to what is above both, from each.
    ///
    /// # Errors
    ///
    /// Why there is no such way.
    pub fn links_between(&self, target_frame: &str, source_frame: &str) -> Result<[Vec<String>; 2], WhyNot> {
        let (target, source) = (bare(target_frame), bare(source_frame));
        for frame in [target, source] {
            if !self.knows(frame) {
                return Err(WhyNot::UnknownFrame(frame.to_owned()));
            }
        }
        let (mut from_target, mut from_source) = (self.ancestors(target)?, self.ancestors(source)?);
        let places: HashMap<&str, usize> = from_target.iter().map(String::as_str).zip(0..).collect();
        let common = (0..).zip(&from_source).find_map(|(k, frame)| Some((k, *places.get(frame.as_str())?)));
        let Some((source_links, target_links)) = common else {
            return Err(WhyNot::NotConnected(target.to_owned(), source.to_owned()));
        };
        from_source.truncate(source_links);
        from_target.truncate(target_links);
        Ok([from_target, from_source])
    }

    /// The pose of the first frame in the parent of the last.
    fn along(&self, frames: &[String], stamp_ns: i64) -> Result<RigidPose, WhyNot> {
        let mut pose = RigidPose::IDENTITY;
        for child in frames {
            pose = self.in_parent(child, stamp_ns)?.then(&pose);
        }
        Ok(pose)
    }

    fn in_parent(&self, child: &str, stamp_ns: i64) -> Result<RigidPose, WhyNot> {
        let link = self.frames.get(child).and_then(|frame| frame.links.get(&frame.parent));
        let samples = match link {
            Some(Link::Static(pose)) => return Ok(*pose),
            Some(Link::Moving(samples)) => samples,
            None => return Err(WhyNot::UnknownFrame(child.to_owned())),
        };
        let (before, after) =
            samples.around(stamp_ns).map_err(|error| WhyNot::Unreadable(error.to_string()))?;
        let Some(TimedPose { stamp_ns: before_ns, pose: before }) = before else {
            return Err(WhyNot::Before(child.to_owned()));
        };
        if before_ns == stamp_ns {
            return Ok(before);
        }
        let Some(TimedPose { stamp_ns: after_ns, pose: after }) = after else {
            return Err(WhyNot::After(child.to_owned()));
        };
        let gap_ns = after_ns.saturating_sub(before_ns);
        if self.most_gap_ns.is_some_and(|most| gap_ns > most) {
            return Err(WhyNot::Gap(child.to_owned()));
        }
        Ok(before.towards(&after, stamp_ns.saturating_sub(before_ns) as f64 / gap_ns as f64))
    }
}

/// tf 1 wrote slashes before names, tf 2 does not know them.
fn bare(frame: &str) -> &str {
    frame.trim_start_matches('/')
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64) -> RigidPose {
        RigidPose { position_m: [x, 0.1, 0.2], quaternion: [0.0, 0.0, 0.6, 0.8] }
    }

    #[test]
    fn a_stamp_that_is_there_keeps_every_bit() {
        let mut tf = Transforms::default();
        tf.insert("/odom", "base", 5, at(0.3), false);
        tf.insert("odom", "base", 9, at(0.7), false);
        tf.insert("base", "lidar", 0, RigidPose::IDENTITY, true);
        assert_eq!(tf.lookup("odom", "/lidar", 5), Ok(at(0.3)));
        assert_eq!(tf.lookup("odom", "lidar", 7).unwrap().position_m[0], 0.5);
        assert_eq!(tf.lookup("base", "base", 1), Ok(RigidPose::IDENTITY));
        let back = tf.lookup("lidar", "odom", 5).unwrap();
        assert!(back.then(&at(0.3)).position_m.iter().all(|m| m.abs() < 1e-12));
    }

    #[test]
    fn nothing_is_extrapolated_or_bridged() {
        let mut tf = Transforms::default();
        tf.insert("odom", "base", 5, at(0.3), false);
        tf.insert("odom", "base", 9, at(0.7), false);
        assert_eq!(tf.lookup("odom", "base", 4), Err(WhyNot::Before("base".into())));
        assert_eq!(tf.lookup("odom", "base", 10), Err(WhyNot::After("base".into())));
        tf.set_most_gap_ns(Some(3));
        assert_eq!(tf.lookup("odom", "base", 7), Err(WhyNot::Gap("base".into())));
        assert!(tf.lookup("odom", "base", 9).is_ok());
        assert_eq!(tf.lookup("odom", "camera", 9), Err(WhyNot::UnknownFrame("camera".into())));
        tf.insert("rig", "camera", 9, at(1.0), true);
        assert!(matches!(tf.lookup("odom", "camera", 9), Err(WhyNot::NotConnected(..))));
    }

    #[test]
    fn each_link_keeps_its_own_last_seconds() {
        let mut tf = Transforms::default();
        for stamp_ns in 0..10 {
            tf.insert("odom", "base", stamp_ns, at(0.3), false);
        }
        tf.insert("map", "odom", 2, at(0.7), false);
        tf.insert("base", "lidar", 0, RigidPose::IDENTITY, true);
        assert_eq!((tf.forget_older_than(3), tf.frames()), (6, 3));
        assert_eq!(tf.lookup("odom", "lidar", 5), Err(WhyNot::Before("base".into())));
        assert_eq!(tf.lookup("odom", "lidar", 6), Ok(at(0.3)));
        assert_eq!(tf.lookup("map", "odom", 2), Ok(at(0.7)));
    }

    #[test]
    fn the_frame_with_most_samples_loses_the_older_half() {
        let mut tf = Transforms::default();
        for stamp_ns in 0..10 {
            tf.insert("odom", "base", stamp_ns, at(0.3), false);
        }
        tf.insert("map", "odom", 2, at(0.7), false);
        tf.insert("base", "lidar", 0, RigidPose::IDENTITY, true);
        assert_eq!(tf.shrink_largest(), 5);
        assert_eq!(tf.lookup("odom", "base", 4), Err(WhyNot::Before("base".into())));
        assert_eq!(tf.lookup("odom", "lidar", 5), Ok(at(0.3)));
        for parent in 0..20 {
            tf.insert(&format!("p{parent}"), "lidar", 0, at(0.1), true);
        }
        assert_eq!((tf.shrink_largest(), tf.lookup("p19", "lidar", 7)), (20, Ok(at(0.1))));
        assert_eq!((tf.shrink_largest(), tf.shrink_largest(), tf.shrink_largest()), (2, 1, 1));
        assert_eq!((tf.shrink_largest(), tf.lookup("map", "odom", 2)), (0, Ok(at(0.7))));
    }

    #[test]
    fn the_last_parent_wins_and_a_loop_is_an_error() {
        let mut tf = Transforms::default();
        tf.insert("odom", "base", 5, at(0.3), false);
        tf.insert("map", "base", 5, at(0.9), false);
        assert_eq!(tf.lookup("map", "base", 5), Ok(at(0.9)));
        tf.insert("odom", "base", 6, at(0.4), false);
        assert_eq!(tf.lookup("odom", "base", 5), Ok(at(0.3)));
        tf.insert("base", "odom", 5, at(0.3), true);
        assert!(matches!(tf.lookup("odom", "base", 5), Err(WhyNot::Loop(_))));
        assert!(!tf.insert("base", "base", 5, at(0.3), true));
        let broken = RigidPose { position_m: [f64::NAN; 3], ..RigidPose::IDENTITY };
        assert!(!tf.insert("base", "wheel", 5, broken, true));
    }

    #[test]
    fn two_branches_meet_at_their_common_ancestor() {
        let mut tf = Transforms::default();
        tf.insert("base", "left", 0, RigidPose { position_m: [1.0, 0.0, 0.0], ..RigidPose::IDENTITY }, true);
        tf.insert(
            "base",
            "right",
            0,
            RigidPose { position_m: [-1.0, 0.0, 0.0], ..RigidPose::IDENTITY },
            true,
        );
        assert_eq!(tf.lookup("left", "right", 77).unwrap().position_m, [-2.0, 0.0, 0.0]);
    }
}
