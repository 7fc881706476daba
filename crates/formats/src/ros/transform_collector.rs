use super::messages::StampedPose;
use super::second_parent::SecondParent;
use super::transforms::{BadTransform, Transforms};

/// Adds the transforms of a recording and counts the rejected ones.
#[derive(Debug, Default)]
pub(super) struct TransformCollector {
    /// Number of distinct pairs of a frame and its parent.
    links: usize,
    beyond: u64,
    invalid: u64,
    first_invalid: Option<BadTransform>,
    /// Number of links checked for second parents.
    checked: usize,
    seconds: Vec<SecondParent>,
}

/// Limit for pairs of a frame and its parent. Robots have about a hundred.
const MAX_LINKS: usize = 10_000;
/// Limit for the length of a frame name.
const MAX_NAME_BYTES: usize = 256;
/// Limits for the second parents to report and the links to check for them.
const MAX_SECONDS: usize = 8;
const MAX_CHECKED: usize = 2000;

impl TransformCollector {
    pub(super) fn take(&mut self, transforms: &mut Transforms, pose: StampedPose, is_static: bool) {
        let StampedPose { header, child_frame, parent_from_child } = pose;
        let (parent, stamp_ns) = (header.frame_id.as_str(), header.stamp_ns);
        // A frame at its limit of parents drops one for the new parent.
        let parents = transforms.parents_of(&child_frame);
        let is_new = !transforms.has_link(parent, &child_frame);
        if is_new && (self.links >= MAX_LINKS || parent.len().max(child_frame.len()) > MAX_NAME_BYTES) {
            self.beyond += 1;
            return;
        }
        match transforms.insert(parent, &child_frame, stamp_ns, parent_from_child, is_static) {
            Ok(false) => {}
            Ok(true) => {
                self.links += transforms.parents_of(&child_frame).saturating_sub(parents);
                self.checked += 1;
                if self.checked <= MAX_CHECKED && self.seconds.len() < MAX_SECONDS {
                    self.seconds.extend(transforms.second_parent(parent, &child_frame));
                }
            }
            Err(why) => {
                self.invalid += 1;
                self.first_invalid.get_or_insert(why);
            }
        }
    }

    /// Returns remarks for the user.
    pub(super) fn remarks(self) -> Vec<String> {
        let Self { beyond, invalid, first_invalid, seconds, .. } = self;
        let beyond = (beyond > 0).then(|| {
            format!(
                "{beyond} transforms were skipped: there are more than {MAX_LINKS} frames, or frame names exceed \
                 {MAX_NAME_BYTES} bytes"
            )
        });
        let invalid = first_invalid
            .map(|first| format!("{invalid} transforms are invalid and were skipped; the first: {first}"));
        beyond.into_iter().chain(invalid).chain(seconds.into_iter().map(remark_on)).collect()
    }
}

/// Explains the consequence of a second parent.
pub(super) fn remark_on(second: SecondParent) -> String {
    format!(
        "{second}; a parent that appears in a single transform or closes a loop is only used if no other parent leads \
         to the map frame"
    )
}
