use super::frame_links::{FrameLinks, Step};
use super::frame_search::Search;
use super::samples::Samples;
use super::second_parent::SecondParent;
use crate::poses::RigidPose;
use std::collections::{HashMap, HashSet};
use std::convert::Infallible;

/// Tree of coordinate frames of a recording or a robot: the poses of each frame in its parents, over time.
///
/// At each time, a frame has one parent: the first of these that leads to the wanted frame without visiting a frame
/// twice.
///
/// 1. A parent with transforms before and after the stamp, or at it. Of several, the one with the latest sample before.
/// 2. A parent with transforms up to 10 s before the stamp that do not give a pose (yet).
/// 3. A static parent. Of several, the newest.
/// 4. A parent with a single transform, or with transforms at other times. Of several, the newest.
///
/// A transform that closes a loop, or a single transform to another parent, therefore does not change any pose.
#[derive(Clone, Debug, Default)]
pub struct Transforms {
    frames: HashMap<String, FrameLinks>,
    /// Number of transforms added.
    taken: u64,
    /// Maximum time between two samples to interpolate, in nanoseconds.
    most_gap_ns: Option<i64>,
}

/// Frames to visit in a search for the pose of one frame in another, so that unrelated frames take no time.
#[derive(Debug)]
pub(super) struct SearchFrames {
    /// See [`Transforms::frames_between`].
    between: HashSet<String>,
    /// All ancestors of the source, if they include the target at some time, because a common ancestor may connect the
    /// two frames at other times. `None` if there are too many.
    above: Option<HashSet<String>>,
}

/// Reason why the pose of a frame in another is unknown at a time.
#[derive(Clone, Debug, PartialEq, Eq, Hash, thiserror::Error)]
#[non_exhaustive]
pub enum WhyNot {
    /// No transform names the frame.
    #[error("no transform names the frame {0}")]
    UnknownFrame(String),
    /// Both frames are known, but not connected.
    #[error("the frames {0} and {1} are not connected")]
    NotConnected(String, String),
    /// A frame is its own ancestor.
    #[error("the frame {0} is its own ancestor")]
    Loop(String),
    /// The frame has more ancestors than the limit.
    #[error(
        "the frame {0} has too many ancestors: select a closer frame with `fixed_frame` (ROS 2 node: `frame_id`)"
    )]
    TooManyFrames(String),
    /// The stamp is before the first transform of a frame.
    #[error("the stamp is before the first transform of {0}")]
    Before(String),
    /// The stamp is after the last transform of a frame.
    #[error("the stamp is after the last transform of {0}")]
    After(String),
    /// The transforms before and after the stamp are too far apart.
    #[error(
        "the transforms of {0} before and after the stamp are too far apart; `pose_tolerance` permits larger gaps"
    )]
    Gap(String),
    /// The frame does not move in any other frame, so its pose is unknown.
    #[error("no transform describes how {0} moves")]
    NothingMoves(String),
    /// The points are already in the fixed frame, and the sensor position is unknown.
    #[error("the points are already in the frame {0}, but the sensor position is unknown")]
    AlreadyFixed(String),
    /// A temporary file cannot be read.
    #[error("{0}")]
    Unreadable(String),
}

/// Reason why a transform is rejected.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BadTransform {
    /// The parent or the child has no name.
    #[error("a frame has no name")]
    NoName,
    /// Parent and child are the same frame.
    #[error("the frame {0} is its own parent")]
    InItself(String),
    /// Numbers are not finite, or the length of the quaternion differs from 1 by more than 0.1.
    #[error("the pose of {0} has a number that is not finite, or a quaternion with a length other than 1")]
    Pose(String),
}

/// Maximum deviation of a quaternion's length from 1, as for pose files.
const MAX_LENGTH_ERROR: f64 = 0.1;
/// Limit for the frames to search for each cloud of a recording.
const MAX_FRAMES_BETWEEN: usize = 1000;
/// Limit for the moving frames to consider as the robot's frame.
const MAX_MOVING: usize = 100;

impl Transforms {
    /// Sets the maximum time between two samples to interpolate; see [`most_gap_ns`](crate::poses::most_gap_ns).
    pub fn set_most_gap_ns(&mut self, most_gap_ns: Option<i64>) {
        self.most_gap_ns = most_gap_ns;
    }

    /// Adds the pose of a child in a parent. Returns whether the parent is new for the child. A sample replaces one
    /// with the same stamp. If a frame has more than 16 parents, the first ones and the last one are kept.
    ///
    /// # Errors
    ///
    /// The transform is rejected: a frame has no name, parent and child are the same, or the pose is invalid.
    pub fn insert(
        &mut self,
        parent: &str,
        child: &str,
        stamp_ns: i64,
        parent_from_child: RigidPose,
        is_static: bool,
    ) -> Result<bool, BadTransform> {
        let (parent, child) = names(parent, child)?;
        if !is_pose(&parent_from_child) {
            return Err(BadTransform::Pose(child.to_owned()));
        }
        let (links, number) = self.links_of(child);
        Ok(links.is_some_and(|links| links.insert(parent, stamp_ns, parent_from_child, is_static, number)))
    }

    /// Replaces the samples of a child in a parent. Returns whether the parent is new for the child. All samples must
    /// be [poses](is_pose).
    ///
    /// # Errors
    ///
    /// The samples are rejected: a frame has no name, or parent and child are the same.
    pub(super) fn attach(
        &mut self,
        parent: &str,
        child: &str,
        samples: Samples,
    ) -> Result<bool, BadTransform> {
        let (parent, child) = names(parent, child)?;
        if samples.is_empty() {
            return Ok(false);
        }
        let (links, number) = self.links_of(child);
        Ok(links.is_some_and(|links| links.attach(parent, samples, number)))
    }

    /// Returns the links of a child, and the sequence number of its next transform.
    fn links_of(&mut self, child: &str) -> (Option<&mut FrameLinks>, u64) {
        if !self.frames.contains_key(child) {
            self.frames.insert(child.to_owned(), FrameLinks::default());
        }
        self.taken += 1;
        (self.frames.get_mut(child), self.taken)
    }

    /// Returns whether a transform names this parent of a child.
    pub(super) fn has_link(&self, parent: &str, child: &str) -> bool {
        self.frames.get(bare(child)).is_some_and(|links| links.has_parent(bare(parent)))
    }

    /// Returns the number of parents of a child.
    pub(super) fn parents_of(&self, child: &str) -> usize {
        self.frames.get(bare(child)).map_or(0, FrameLinks::parents)
    }

    /// Iterates over all samples.
    pub(super) fn samples_mut(&mut self) -> impl Iterator<Item = &mut Samples> {
        self.frames.values_mut().flat_map(FrameLinks::samples_mut)
    }

    /// Returns the conflict if a child has another parent than this one, or if they form a loop.
    pub fn second_parent(&self, parent: &str, child: &str) -> Option<SecondParent> {
        let (parent, child) = (bare(parent), bare(child));
        let others = self.steps(child);
        let before = others.iter().find(|step| step.parent != parent).map(|step| step.parent.to_owned());
        let found = self.search(parent, |_| true, |frame| frame == child);
        let above = found.route.into_iter().flatten().map(|step| step.parent.to_owned());
        let mut loop_frames: Vec<String> = above.collect();
        if !loop_frames.is_empty() {
            loop_frames.insert(0, parent.to_owned());
        }
        if before.is_none() && loop_frames.is_empty() {
            return None;
        }
        Some(SecondParent { child: child.to_owned(), parent: parent.to_owned(), before, loop_frames })
    }

    /// Removes all poses of a frame in its parents.
    pub fn detach(&mut self, child: &str) {
        self.frames.remove(bare(child));
    }

    /// Removes the moving poses of a frame in its parents; static transforms are kept.
    pub fn forget_samples(&mut self, child: &str) {
        if let Some(links) = self.frames.get_mut(bare(child)) {
            links.forget_samples();
            if links.is_empty() {
                self.detach(child);
            }
        }
    }

    /// Drops samples more than `span_ns` older than the last one of the same link, like the buffer of tf2. Returns the
    /// number of samples left, counting a static transform as one.
    pub fn forget_older_than(&mut self, span_ns: i64) -> usize {
        self.frames.values_mut().for_each(|links| links.forget_older_than(span_ns));
        self.frames.values().map(FrameLinks::len).sum()
    }

    /// Drops older samples of the frame with most samples, so that one busy publisher does not displace other frames.
    /// Returns the number of dropped samples. Static transforms are kept.
    pub fn shrink_largest(&mut self) -> usize {
        let largest = self.frames.iter_mut().max_by_key(|(_, links)| links.samples());
        let Some((child, links)) = largest else { return 0 };
        let before = links.samples();
        links.shrink();
        let lost = before - links.samples();
        if links.is_empty() {
            let child = child.clone();
            self.frames.remove(&child);
        }
        lost
    }

    /// Returns the number of frames with a parent.
    pub fn frames(&self) -> usize {
        self.frames.len()
    }

    /// Returns whether a transform names a frame.
    pub fn knows(&self, frame: &str) -> bool {
        let frame = bare(frame);
        self.frames.contains_key(frame) || self.frames.values().any(|links| links.has_parent(frame))
    }

    /// Returns whether there are no transforms.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// Returns a frame and its ancestors, at any time. Parents from a single transform are ignored if the other
    /// ancestors include a moving frame.
    pub fn ancestors(&self, frame: &str) -> Vec<String> {
        self.above(bare(frame)).frames.into_iter().map(str::to_owned).collect()
    }

    /// Returns the root above a frame: the last of its [ancestors](Self::ancestors).
    pub fn root_of(&self, frame: &str) -> String {
        let frame = bare(frame);
        self.above(frame).end.unwrap_or(frame).to_owned()
    }

    fn above<'a>(&'a self, frame: &'a str) -> Search<'a> {
        let trusted = self.search(frame, Step::is_trusted, |_| false);
        // Ignore single transforms if a moving ancestor is found without them.
        let moves = |frame: &&str| self.frames.get(*frame).is_some_and(FrameLinks::moves);
        if trusted.frames.iter().any(moves) {
            return trusted;
        }
        self.search(frame, |_| true, |_| false)
    }

    /// Searches without a time.
    fn search<'a>(
        &'a self,
        frame: &'a str,
        is_taken: impl Fn(&Step<'a>) -> bool,
        is_wanted: impl Fn(&str) -> bool,
    ) -> Search<'a> {
        let steps = |at: &'a str| Ok(kept(self.steps(at), &is_taken));
        let Ok(search) = Search::run::<Infallible>(frame, &steps, is_wanted);
        search
    }

    /// Returns whether a frame has samples in any parent, even a single one.
    pub fn is_moving(&self, child: &str) -> bool {
        self.frames.get(bare(child)).is_some_and(FrameLinks::is_moving)
    }

    /// Returns the names of the moving frames below a frame, sorted. The flag is true if no frame moves below the named
    /// one. The frame of the robot or sensor is such a frame below the map frame.
    pub(super) fn moving_below(&self, frame: &str) -> Vec<(String, bool)> {
        let frame = bare(frame);
        let mut children: HashMap<&str, Vec<&str>> = HashMap::new();
        for child in self.frames.keys() {
            for step in self.steps(child) {
                children.entry(step.parent).or_default().push(child);
            }
        }
        let moves = |child: &str| self.frames.get(child).is_some_and(FrameLinks::moves);
        let moving: Vec<&str> =
            below(&children, frame).into_iter().filter(|child| *child != frame && moves(child)).collect();
        // A robot does not have that many moving frames.
        if moving.len() > MAX_MOVING {
            return Vec::new();
        }
        let is_last =
            |child: &str| !below(&children, child).into_iter().any(|lower| lower != child && moves(lower));
        let mut all: Vec<(String, bool)> =
            moving.into_iter().map(|child| (child.to_owned(), is_last(child))).collect();
        all.sort_unstable();
        all
    }

    /// Returns the pose of the source frame in the target frame at a time. Each link of the chain is interpolated
    /// between the samples around the stamp; poses are not extrapolated.
    ///
    /// # Errors
    ///
    /// The reason why the pose is unknown.
    pub fn lookup(&self, target_frame: &str, source_frame: &str, stamp_ns: i64) -> Result<RigidPose, WhyNot> {
        self.lookup_among(target_frame, source_frame, stamp_ns, None)
    }

    /// As [`Transforms::lookup`], restricted to the given frames.
    pub(super) fn lookup_among(
        &self,
        target_frame: &str,
        source_frame: &str,
        stamp_ns: i64,
        among: Option<&SearchFrames>,
    ) -> Result<RigidPose, WhyNot> {
        let (target, source) = (bare(target_frame), bare(source_frame));
        if target == source {
            return Ok(RigidPose::IDENTITY);
        }
        let [from_target, from_source] = self.route(target, source, stamp_ns, among)?;
        let common_from_source = self.along(&from_source, stamp_ns)?;
        let common_from_target = self.along(&from_target, stamp_ns)?;
        Ok(common_from_target.inverse().then(&common_from_source))
    }

    /// Returns the frames to search for poses of a source in a target.
    ///
    /// # Errors
    ///
    /// There are too many.
    pub(super) fn search_frames(&self, target: &str, source: &str) -> Result<SearchFrames, WhyNot> {
        let between = self.frames_between(target, source)?;
        let above = self.children_above(bare(source), None);
        let is_small = above.contains_key(bare(target)) && above.len() <= MAX_FRAMES_BETWEEN;
        let above = is_small.then(|| above.into_keys().map(str::to_owned).collect());
        Ok(SearchFrames { between, above })
    }

    /// Returns the frames on all upward paths from a source to a target, at any time. If there is no such path, returns
    /// the ancestors of both.
    ///
    /// # Errors
    ///
    /// There are too many.
    pub fn frames_between(&self, target: &str, source: &str) -> Result<HashSet<String>, WhyNot> {
        let (target, source) = (bare(target), bare(source));
        let up = self.children_above(source, Some(target));
        let mut between: HashSet<String> = HashSet::new();
        if up.contains_key(target) {
            let mut open = vec![target];
            while let Some(frame) = open.pop() {
                if between.insert(frame.to_owned()) {
                    open.extend(up.get(frame).into_iter().flatten());
                }
            }
        } else {
            let down = self.children_above(target, Some(source));
            between.extend(up.into_keys().chain(down.into_keys()).map(str::to_owned));
        }
        match between.len() > MAX_FRAMES_BETWEEN {
            true => Err(WhyNot::TooManyFrames(source.to_owned())),
            false => Ok(between),
        }
    }

    /// Returns the children of each frame above a frame. The search stops at `end`, whose ancestors are irrelevant.
    fn children_above<'a>(&'a self, from: &'a str, end: Option<&str>) -> HashMap<&'a str, Vec<&'a str>> {
        let mut children: HashMap<&str, Vec<&str>> = HashMap::from([(from, Vec::new())]);
        let mut open = vec![from];
        while let Some(child) = open.pop() {
            for step in self.steps(child) {
                let is_new = !children.contains_key(step.parent);
                children.entry(step.parent).or_default().push(child);
                if is_new && Some(step.parent) != end {
                    open.push(step.parent);
                }
            }
        }
        children
    }

    /// Returns the frames whose poses in their parents connect two frames at a time: from each frame up to their common
    /// ancestor.
    ///
    /// # Errors
    ///
    /// The reason why the frames are not connected.
    pub fn links_between(
        &self,
        target_frame: &str,
        source_frame: &str,
        stamp_ns: i64,
    ) -> Result<[Vec<String>; 2], WhyNot> {
        let route = self.route(bare(target_frame), bare(source_frame), stamp_ns, None)?;
        Ok(route.map(|steps| steps.iter().map(|step| step.child.to_owned()).collect()))
    }

    /// Returns the steps from both frames up to their common ancestor. Untrusted steps are used only if no trusted ones
    /// lead there. They mostly serve to find the reason why the pose is unknown.
    fn route<'a>(
        &'a self,
        target: &'a str,
        source: &'a str,
        stamp_ns: i64,
        among: Option<&SearchFrames>,
    ) -> Result<[Vec<Step<'a>>; 2], WhyNot> {
        let Some(SearchFrames { between, above }) = among else {
            return self.route_among(target, source, stamp_ns, None);
        };
        let Some(above) = above else {
            return self.route_among(target, source, stamp_ns, Some(between));
        };
        // Try the trusted upward steps first, because a search of all ancestors is slower and gives the same path.
        let trusted = |at: &'a str| {
            let steps = self.steps_at(at, stamp_ns)?;
            Ok(kept(steps, |step| step.is_trusted() && between.contains(step.parent)))
        };
        match Search::run(source, &trusted, |frame| frame == target)?.route {
            Some(route) => Ok([Vec::new(), route]),
            None => self.route_among(target, source, stamp_ns, Some(above)),
        }
    }

    fn route_among<'a>(
        &'a self,
        target: &'a str,
        source: &'a str,
        stamp_ns: i64,
        among: Option<&HashSet<String>>,
    ) -> Result<[Vec<Step<'a>>; 2], WhyNot> {
        let is_among = |step: &Step<'a>| among.is_none_or(|among| among.contains(step.parent));
        let all = |at: &'a str| self.steps_at(at, stamp_ns).map(|steps| kept(steps, is_among));
        let trusted = |at: &'a str| all(at).map(|steps| kept(steps, Step::is_trusted));
        let found = match route_by(target, source, &trusted) {
            found @ (Ok(_) | Err(WhyNot::Unreadable(_))) => return found,
            Err(_) => route_by(target, source, &all),
        };
        found.map_err(|why| match [target, source].into_iter().find(|frame| !self.knows(frame)) {
            Some(frame) if !matches!(why, WhyNot::Unreadable(_)) => WhyNot::UnknownFrame(frame.to_owned()),
            _ => why,
        })
    }

    fn steps_at<'a>(&'a self, child: &'a str, stamp_ns: i64) -> Result<Vec<Step<'a>>, WhyNot> {
        let links = self.frames.get(child);
        links.map_or(Ok(Vec::new()), |links| links.steps_at(child, stamp_ns, self.most_gap_ns))
    }

    fn steps<'a>(&'a self, child: &'a str) -> Vec<Step<'a>> {
        self.frames.get(child).map_or(Vec::new(), |links| links.steps(child))
    }

    /// Returns the pose of the first frame in the parent of the last.
    fn along(&self, steps: &[Step<'_>], stamp_ns: i64) -> Result<RigidPose, WhyNot> {
        let mut pose = RigidPose::IDENTITY;
        for step in steps {
            pose = step.pose(stamp_ns, self.most_gap_ns)?.then(&pose);
        }
        Ok(pose)
    }
}

/// Returns all frames below a frame, given the children of each.
fn below<'a>(children: &HashMap<&'a str, Vec<&'a str>>, from: &str) -> HashSet<&'a str> {
    let mut found = HashSet::new();
    let mut open: Vec<&str> = vec![from];
    while let Some(at) = open.pop() {
        for child in children.get(at).into_iter().flatten() {
            if found.insert(*child) {
                open.push(child);
            }
        }
    }
    found
}

/// Searches for the target above the source, then for the source above the target, then for a common ancestor. In a
/// tree the path is unique. In a loop, the first path found is the robot's, because frames above the map frame are
/// irrelevant.
fn route_by<'a>(
    target: &'a str,
    source: &'a str,
    steps: &dyn Fn(&'a str) -> Result<Vec<Step<'a>>, WhyNot>,
) -> Result<[Vec<Step<'a>>; 2], WhyNot> {
    let up = Search::run(source, steps, |frame| frame == target)?;
    if let Some(route) = up.route {
        return Ok([Vec::new(), route]);
    }
    let down = Search::run(target, steps, |frame| frame == source)?;
    if let Some(route) = down.route {
        return Ok([route, Vec::new()]);
    }
    let above_target: HashSet<&str> = down.frames.into_iter().collect();
    let to_common = Search::run(source, steps, |frame| above_target.contains(frame))?;
    if let Some(from_source) = to_common.route {
        let common = from_source.last().map_or(source, |step| step.parent);
        let from_target = Search::run(target, steps, |frame| frame == common)?.route;
        return Ok([from_target.unwrap_or_default(), from_source]);
    }
    Err(match up.looped.or(down.looped) {
        _ if up.is_cut || down.is_cut => WhyNot::TooManyFrames(source.to_owned()),
        Some(frame) => WhyNot::Loop(frame.to_owned()),
        None => WhyNot::NotConnected(target.to_owned(), source.to_owned()),
    })
}

fn kept<'a>(mut steps: Vec<Step<'a>>, is_kept: impl Fn(&Step<'a>) -> bool) -> Vec<Step<'a>> {
    steps.retain(is_kept);
    steps
}

/// Checks and normalises the names of a parent and a child.
fn names<'a>(parent: &'a str, child: &'a str) -> Result<(&'a str, &'a str), BadTransform> {
    let (parent, child) = (bare(parent), bare(child));
    if parent.is_empty() || child.is_empty() {
        return Err(BadTransform::NoName);
    }
    if parent == child {
        return Err(BadTransform::InItself(child.to_owned()));
    }
    Ok((parent, child))
}

/// Returns whether a pose is valid: finite numbers, and a quaternion with a length of about 1.
pub(super) fn is_pose(pose: &RigidPose) -> bool {
    let length = pose.quaternion.iter().map(|q| q * q).sum::<f64>().sqrt();
    pose.is_valid() && (length - 1.0).abs() <= MAX_LENGTH_ERROR
}

/// Strips the leading slashes of tf 1 names, which tf 2 does not use.
fn bare(frame: &str) -> &str {
    frame.trim_start_matches('/')
}

#[cfg(test)]
mod tests;
