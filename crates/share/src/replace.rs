use super::differences::{Content, Difference, brick_at};
use super::receiver::Receiver;
use super::set_range::{SetPosition, SetRange};
use voxtile::space::{BrickCode, is_in_mask, places};

/// Maximum number of voxels that one packet may change. The rest of a larger packet is requested again.
const MAX_CHANGES: usize = 1 << 20;
/// Number of bricks that are compared at a time.
const BRICKS_AT_A_TIME: usize = 1024;

/// Number of voxels that a packet may still change.
pub(super) struct WorkBudget(usize);

impl WorkBudget {
    pub(super) fn per_packet() -> Self {
        Self(MAX_CHANGES)
    }
}

impl Receiver {
    /// Replaces a range of the layer with a packet's content, except for voxels with later versions. Returns the part
    /// of the range that is done: the whole range, unless the work limit was reached first.
    pub(super) fn replace(
        &mut self,
        as_of: u64,
        range: SetRange,
        content: &Content,
        work: &mut WorkBudget,
    ) -> Option<SetRange> {
        let parts = self.stream.as_ref()?.versions.not_replaced(range, as_of);
        for part in parts {
            let mut from = brick_at(part.first);
            loop {
                let found = content.differences(self.layer.as_ref()?, from, part, BRICKS_AT_A_TIME);
                let is_all = found.len() < BRICKS_AT_A_TIME;
                for difference in found {
                    let (tile, brick) = difference.place;
                    if work.0 == 0 {
                        let end = SetPosition { tile, code: brick.voxel(0).0 }.max(part.first);
                        let is_some = range.first < end;
                        return is_some.then(|| SetRange { first: range.first, last: end.before() });
                    }
                    self.replace_brick(as_of, &difference, work)?;
                    from = (tile, BrickCode(brick.0 + 1));
                }
                if is_all {
                    break;
                }
            }
        }
        Some(range)
    }

    fn replace_brick(&mut self, as_of: u64, difference: &Difference, work: &mut WorkBudget) -> Option<()> {
        let (stream, layer) = (self.stream.as_ref()?, self.layer.as_mut()?);
        let (tile, brick) = difference.place;
        let min = layer.grid().voxels_of_tile(tile).min;
        for place in places(difference.differing) {
            work.0 = work.0.saturating_sub(1);
            let voxel = brick.voxel(place).to_key().to_index_from(min);
            let is_in = is_in_mask(&difference.after, place);
            if !stream.versions.was_changed_after(voxel, as_of) && !self.limits.put(layer, voxel, is_in) {
                self.counts.refused_voxels += 1;
                self.is_over_limit = true;
            }
        }
        Some(())
    }
}
