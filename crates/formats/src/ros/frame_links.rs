use super::samples::{Around, Samples};
use super::transforms::WhyNot;
use crate::poses::RigidPose;
use crate::spill::TimedPose;
use std::cmp::Reverse;
use std::convert::Infallible;

/// Parents of a frame, each with the poses of the frame in it. A frame has one parent at a time. Transforms with other
/// parents are kept too, so that a wrong transform does not displace a correct one.
#[derive(Clone, Debug, Default)]
pub(super) struct FrameLinks {
    /// In the order in which the parents first appeared.
    links: Vec<Link>,
}

/// Poses of a frame in one parent.
#[derive(Clone, Debug, Default)]
struct Link {
    parent: String,
    /// Static transform.
    fixed: Option<RigidPose>,
    samples: Samples,
    /// Sequence number of this link's last transform among all transforms.
    last: u64,
}

/// Step from a frame to one of its parents.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step<'a> {
    pub(super) child: &'a str,
    pub(super) parent: &'a str,
    place: LinkPose<'a>,
    trust: Trust,
}

#[derive(Clone, Copy, Debug)]
enum LinkPose<'a> {
    Fixed(&'a RigidPose),
    /// Samples around the time of the search.
    Moving(Around),
}

/// Confidence in a parent at a time, best first. A search takes the first parent that leads to its target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Trust {
    /// Samples before and after the stamp, or at it. Ordered by the latest sample up to the stamp.
    Between(Reverse<i64>),
    /// Samples at several times, for a search without a time. Newest first.
    Moving(Reverse<u64>),
    /// Samples around or shortly before the stamp that do not give a pose (yet).
    Held(Reverse<i64>),
    /// A static transform. Newest first.
    Fixed(Reverse<u64>),
    /// A single sample, or samples at other times only. Newest first.
    Doubtful(Reverse<u64>),
}

/// Limit for the parents of a frame: the first ones and the last one are kept. Real frames have one or two.
const MAX_PARENTS: usize = 16;
/// Time after its last sample during which a moving parent takes precedence over static ones. Equal to the default
/// buffer length of tf2.
const HOLD_NS: i64 = 10_000_000_000;

impl FrameLinks {
    /// Adds a transform with this sequence number. Returns whether its parent is new.
    pub(super) fn insert(
        &mut self,
        parent: &str,
        stamp_ns: i64,
        pose: RigidPose,
        is_static: bool,
        number: u64,
    ) -> bool {
        let is_new = !self.has_parent(parent);
        if let Some(link) = self.link_to(parent, number) {
            match is_static {
                true => link.fixed = Some(pose),
                false => link.samples.insert(stamp_ns, pose),
            }
        }
        is_new
    }

    /// Replaces the samples of a parent. Returns whether the parent is new.
    pub(super) fn attach(&mut self, parent: &str, samples: Samples, number: u64) -> bool {
        let is_new = !self.has_parent(parent);
        if let Some(link) = self.link_to(parent, number) {
            link.samples = samples;
        }
        is_new
    }

    /// Returns the link to a parent, and sets the sequence number of its last transform.
    fn link_to(&mut self, parent: &str, number: u64) -> Option<&mut Link> {
        let at = self.links.iter().position(|link| link.parent == parent).unwrap_or_else(|| {
            self.links.truncate(MAX_PARENTS - 1);
            self.links.push(Link { parent: parent.to_owned(), ..Link::default() });
            self.links.len() - 1
        });
        let link = self.links.get_mut(at)?;
        link.last = number;
        Some(link)
    }

    /// Returns the number of parents.
    pub(super) fn parents(&self) -> usize {
        self.links.len()
    }

    /// Iterates over the samples of all parents.
    pub(super) fn samples_mut(&mut self) -> impl Iterator<Item = &mut Samples> {
        self.links.iter_mut().map(|link| &mut link.samples)
    }

    /// Returns whether a transform names this parent.
    pub(super) fn has_parent(&self, parent: &str) -> bool {
        self.links.iter().any(|link| link.parent == parent)
    }

    /// Returns whether any link has a sample with a time.
    pub(super) fn is_moving(&self) -> bool {
        self.links.iter().any(|link| !link.samples.is_empty())
    }

    /// Returns whether any link has samples at several times.
    pub(super) fn moves(&self) -> bool {
        self.links.iter().any(|link| link.samples.has_several())
    }

    pub(super) fn is_empty(&self) -> bool {
        self.links.is_empty()
    }

    /// Drops all samples and keeps static transforms.
    pub(super) fn forget_samples(&mut self) {
        self.samples_mut().for_each(|samples| *samples = Samples::default());
        self.drop_empty();
    }

    /// Drops samples older than `span_ns` before the last sample of the same link.
    pub(super) fn forget_older_than(&mut self, span_ns: i64) {
        self.samples_mut().for_each(|samples| samples.forget_older_than(span_ns));
    }

    /// Returns the number of poses.
    pub(super) fn len(&self) -> usize {
        self.links.iter().map(|link| link.samples.len() + usize::from(link.fixed.is_some())).sum()
    }

    pub(super) fn samples(&self) -> usize {
        self.links.iter().map(|link| link.samples.len()).sum()
    }

    /// Drops the older half of the samples of the link with most samples.
    pub(super) fn shrink(&mut self) {
        if let Some(samples) = self.samples_mut().max_by_key(|samples| samples.len()) {
            samples.forget_older_half();
        }
        self.drop_empty();
    }

    fn drop_empty(&mut self) {
        self.links.retain(|link| link.fixed.is_some() || !link.samples.is_empty());
    }

    /// Returns the steps to the parents at a time, by decreasing confidence.
    ///
    /// # Errors
    ///
    /// Samples cannot be read.
    pub(super) fn steps_at<'a>(
        &'a self,
        child: &'a str,
        stamp_ns: i64,
        most_gap_ns: Option<i64>,
    ) -> Result<Vec<Step<'a>>, WhyNot> {
        self.steps_by(child, |link| {
            let around = link.samples.around(stamp_ns);
            let around = around.map_err(|error| WhyNot::Unreadable(format!("{error:#}")))?;
            Ok((around, trust_at(link, &around, stamp_ns, most_gap_ns)))
        })
    }

    /// Returns the steps to the parents at any time, by decreasing confidence. These steps have no pose.
    pub(super) fn steps<'a>(&'a self, child: &'a str) -> Vec<Step<'a>> {
        let Ok(steps) = self.steps_by::<Infallible>(child, |link| {
            let last = Reverse(link.last);
            let trust = if link.samples.has_several() { Trust::Moving(last) } else { Trust::Doubtful(last) };
            Ok((Around::default(), trust))
        });
        steps
    }

    fn steps_by<'a, E>(
        &'a self,
        child: &'a str,
        moving: impl Fn(&Link) -> Result<(Around, Trust), E>,
    ) -> Result<Vec<Step<'a>>, E> {
        let mut steps = Vec::with_capacity(self.links.len());
        for link in &self.links {
            let parent = link.parent.as_str();
            if let Some(pose) = &link.fixed {
                let trust = Trust::Fixed(Reverse(link.last));
                steps.push(Step { child, parent, place: LinkPose::Fixed(pose), trust });
            }
            if !link.samples.is_empty() {
                let (around, trust) = moving(link)?;
                steps.push(Step { child, parent, place: LinkPose::Moving(around), trust });
            }
        }
        steps.sort_by_key(|step| step.trust);
        Ok(steps)
    }
}

fn trust_at(link: &Link, around: &Around, stamp_ns: i64, most_gap_ns: Option<i64>) -> Trust {
    // A single sample may be spurious.
    if !link.samples.has_several() {
        return Trust::Doubtful(Reverse(link.last));
    }
    let is_near = |gap_ns: i64| most_gap_ns.is_none_or(|most| gap_ns <= most);
    let (before, after) = around;
    let stamp = |sample: &Option<TimedPose>| sample.map(|sample| sample.stamp_ns);
    match (stamp(before), stamp(after)) {
        (Some(before_ns), Some(after_ns)) if is_near(after_ns.saturating_sub(before_ns)) => {
            Trust::Between(Reverse(before_ns))
        }
        (Some(before_ns), Some(_)) => Trust::Held(Reverse(before_ns)),
        (Some(before_ns), None) if stamp_ns.saturating_sub(before_ns) <= HOLD_NS => {
            Trust::Held(Reverse(before_ns))
        }
        _ => Trust::Doubtful(Reverse(link.last)),
    }
}

impl Step<'_> {
    /// Returns whether the evidence is better than a single sample or samples at other times.
    pub(super) fn is_trusted(&self) -> bool {
        !matches!(self.trust, Trust::Doubtful(_))
    }

    /// Returns the pose of the child in the parent at the time of the search. Poses are not extrapolated.
    pub(super) fn pose(&self, stamp_ns: i64, most_gap_ns: Option<i64>) -> Result<RigidPose, WhyNot> {
        let (before, after) = match self.place {
            LinkPose::Fixed(pose) => return Ok(*pose),
            LinkPose::Moving(around) => around,
        };
        let child = || self.child.to_owned();
        let Some(before) = before else { return Err(WhyNot::Before(child())) };
        if before.stamp_ns == stamp_ns {
            return Ok(before.pose);
        }
        let Some(after) = after else { return Err(WhyNot::After(child())) };
        let gap_ns = after.stamp_ns.saturating_sub(before.stamp_ns);
        if most_gap_ns.is_some_and(|most| gap_ns > most) {
            return Err(WhyNot::Gap(child()));
        }
        let part = stamp_ns.saturating_sub(before.stamp_ns) as f64 / gap_ns as f64;
        Ok(before.pose.towards(&after.pose, part))
    }
}
