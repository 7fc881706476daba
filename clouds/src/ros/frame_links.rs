use super::transforms::WhyNot;
use crate::pose::RigidPose;
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// By stamp.
type Samples = BTreeMap<i64, RigidPose>;

/// The parents of a frame, each with where the frame was in it. A frame has one parent at a time; transforms that name
/// others are kept next to it, so that a wrong one hides nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct FrameLinks {
    /// In the order in which the parents were first named.
    links: Vec<Link>,
}

/// Where a frame was in one of its parents.
#[derive(Clone, Debug, Default)]
struct Link {
    parent: String,
    /// At any time.
    fixed: Option<RigidPose>,
    /// By stamp.
    samples: Samples,
    /// Number of the last transform of this link among all.
    last: u64,
}

/// A step from a frame to one of its parents.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step<'a> {
    pub(super) child: &'a str,
    pub(super) parent: &'a str,
    place: Place<'a>,
    trust: Trust,
}

#[derive(Clone, Copy, Debug)]
enum Place<'a> {
    Fixed(&'a RigidPose),
    Moving(&'a Samples),
}

/// Which parent a frame has at a time: the first of these that leads to where the search goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Trust {
    /// Samples before and after the stamp, or at it. First those with the latest sample up to the stamp.
    Between(Reverse<i64>),
    /// Samples at several times, where no time is asked for; first the newest.
    Moving(Reverse<u64>),
    /// Samples around or shortly before the stamp that give no pose, or not yet.
    Held(Reverse<i64>),
    /// A static transform; first the newest.
    Fixed(Reverse<u64>),
    /// One sample alone, or samples at other times; first the newest.
    Doubtful(Reverse<u64>),
}

/// Parents of a frame that are kept: the first ones, and the last one. Real frames have one or two.
const MAX_PARENTS: usize = 16;
/// For so long after its last sample a moving parent hides static ones: as long as the buffers of tf2 are.
const HOLD_NS: i64 = 10_000_000_000;

impl FrameLinks {
    /// Adds a transform, the one of this number, and returns whether it names a new parent.
    pub(super) fn insert(
        &mut self,
        parent: &str,
        stamp_ns: i64,
        pose: RigidPose,
        is_static: bool,
        number: u64,
    ) -> bool {
        let at = self.links.iter().position(|link| link.parent == parent);
        let is_new = at.is_none();
        let at = at.unwrap_or_else(|| {
            self.links.truncate(MAX_PARENTS - 1);
            self.links.push(Link { parent: parent.to_owned(), ..Link::default() });
            self.links.len() - 1
        });
        if let Some(link) = self.links.get_mut(at) {
            link.last = number;
            match is_static {
                true => link.fixed = Some(pose),
                false => drop(link.samples.insert(stamp_ns, pose)),
            }
        }
        is_new
    }

    /// Whether a transform names this parent.
    pub(super) fn has_parent(&self, parent: &str) -> bool {
        self.links.iter().any(|link| link.parent == parent)
    }

    /// Whether any link changes over time.
    pub(super) fn is_moving(&self) -> bool {
        self.links.iter().any(|link| !link.samples.is_empty())
    }

    pub(super) fn is_empty(&self) -> bool {
        self.links.is_empty()
    }

    /// Forgets all samples; static transforms stay.
    pub(super) fn forget_samples(&mut self) {
        self.links.iter_mut().for_each(|link| link.samples.clear());
        self.drop_empty();
    }

    /// Forgets samples that are older than this before the last one of the same link.
    pub(super) fn forget_older_than(&mut self, span_ns: i64) {
        for samples in self.links.iter_mut().map(|link| &mut link.samples) {
            if let Some((&last_ns, _)) = samples.last_key_value() {
                *samples = samples.split_off(&last_ns.saturating_sub(span_ns));
            }
        }
    }

    /// Number of poses.
    pub(super) fn len(&self) -> usize {
        self.links.iter().map(|link| link.samples.len() + usize::from(link.fixed.is_some())).sum()
    }

    pub(super) fn samples(&self) -> usize {
        self.links.iter().map(|link| link.samples.len()).sum()
    }

    /// Forgets the older half of the link with most samples.
    pub(super) fn shrink(&mut self) {
        let Some(link) = self.links.iter_mut().max_by_key(|link| link.samples.len()) else { return };
        let middle = link.samples.len().div_ceil(2);
        link.samples = match link.samples.keys().nth(middle) {
            Some(&middle_ns) => link.samples.split_off(&middle_ns),
            None => Samples::new(),
        };
        self.drop_empty();
    }

    fn drop_empty(&mut self) {
        self.links.retain(|link| link.fixed.is_some() || !link.samples.is_empty());
    }

    /// The steps to the parents at a time, the most trusted first. Without a time all samples count.
    pub(super) fn steps<'a>(
        &'a self,
        child: &'a str,
        stamp_ns: Option<i64>,
        most_gap_ns: Option<i64>,
    ) -> Vec<Step<'a>> {
        let mut steps = Vec::with_capacity(self.links.len());
        for Link { parent, fixed, samples, last } in &self.links {
            if let Some(pose) = fixed {
                let trust = Trust::Fixed(Reverse(*last));
                steps.push(Step { child, parent, place: Place::Fixed(pose), trust });
            }
            if !samples.is_empty() {
                let trust = trust_of(samples, *last, stamp_ns, most_gap_ns);
                steps.push(Step { child, parent, place: Place::Moving(samples), trust });
            }
        }
        steps.sort_by_key(|step| step.trust);
        steps
    }
}

fn trust_of(samples: &Samples, last: u64, stamp_ns: Option<i64>, most_gap_ns: Option<i64>) -> Trust {
    // Anything may send one sample.
    if samples.len() < 2 {
        return Trust::Doubtful(Reverse(last));
    }
    let Some(stamp_ns) = stamp_ns else { return Trust::Moving(Reverse(last)) };
    let is_near = |gap_ns: i64| most_gap_ns.is_none_or(|most| gap_ns <= most);
    match around(samples, stamp_ns) {
        [Some((before_ns, _)), Some((after_ns, _))] if is_near(after_ns.saturating_sub(before_ns)) => {
            Trust::Between(Reverse(before_ns))
        }
        [Some((before_ns, _)), Some(_)] => Trust::Held(Reverse(before_ns)),
        [Some((before_ns, _)), None] if stamp_ns.saturating_sub(before_ns) <= HOLD_NS => {
            Trust::Held(Reverse(before_ns))
        }
        _ => Trust::Doubtful(Reverse(last)),
    }
}

/// The last sample up to a stamp, and the first one from it on.
fn around(samples: &Samples, stamp_ns: i64) -> [Option<(i64, RigidPose)>; 2] {
    let owned = |(stamp_ns, pose): (&i64, &RigidPose)| (*stamp_ns, *pose);
    [samples.range(..=stamp_ns).next_back().map(owned), samples.range(stamp_ns..).next().map(owned)]
}

impl Step<'_> {
    /// Whether more than one sample alone, or samples at other times, say so.
    pub(super) fn is_trusted(&self) -> bool {
        !matches!(self.trust, Trust::Doubtful(_))
    }

    /// Where the child was in the parent. Nothing is extrapolated.
    pub(super) fn pose(&self, stamp_ns: i64, most_gap_ns: Option<i64>) -> Result<RigidPose, WhyNot> {
        let samples = match self.place {
            Place::Fixed(pose) => return Ok(*pose),
            Place::Moving(samples) => samples,
        };
        let child = || self.child.to_owned();
        let [before, after] = around(samples, stamp_ns);
        let Some((before_ns, before)) = before else { return Err(WhyNot::Before(child())) };
        if before_ns == stamp_ns {
            return Ok(before);
        }
        let Some((after_ns, after)) = after else { return Err(WhyNot::After(child())) };
        let gap_ns = after_ns.saturating_sub(before_ns);
        if most_gap_ns.is_some_and(|most| gap_ns > most) {
            return Err(WhyNot::Gap(child()));
        }
        Ok(before.towards(&after, stamp_ns.saturating_sub(before_ns) as f64 / gap_ns as f64))
    }
}
