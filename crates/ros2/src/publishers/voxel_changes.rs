use std::cmp::Ordering;
use voxtile::VoxelIndex;

/// Published state of a voxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VoxelState {
    /// The voxel is free or unknown.
    NotOccupied = 0,
    Occupied = 1,
    /// The voxel has left the box; its state is not published.
    OutOfBox = 2,
}

/// Sorted occupied voxels that were sent to viewers.
#[derive(Debug, Default)]
pub struct VoxelChanges {
    sent: Vec<VoxelIndex>,
}

impl VoxelChanges {
    /// Returns the changes from the sent voxels to `occupied`; with `is_whole` also the unchanged occupied voxels.
    /// Applying the changes twice has no further effect.
    pub fn to(
        &self,
        occupied: &[VoxelIndex],
        is_whole: bool,
        is_in_box: impl Fn(VoxelIndex) -> bool,
    ) -> Vec<(VoxelIndex, VoxelState)> {
        let (mut changes, mut before, mut now) =
            (Vec::new(), self.sent.iter().peekable(), occupied.iter().peekable());
        loop {
            let order = match (before.peek(), now.peek()) {
                (Some(old), Some(new)) => old.cmp(new),
                (Some(_), None) => Ordering::Less,
                (None, Some(_)) => Ordering::Greater,
                (None, None) => return changes,
            };
            let old = if order.is_le() { before.next() } else { None };
            let new = if order.is_ge() { now.next() } else { None };
            match (old, new) {
                (Some(_), Some(voxel)) if is_whole => changes.push((*voxel, VoxelState::Occupied)),
                (None, Some(voxel)) => changes.push((*voxel, VoxelState::Occupied)),
                (Some(voxel), None) => {
                    let is_in_box = is_in_box(*voxel);
                    changes.push((
                        *voxel,
                        if is_in_box { VoxelState::NotOccupied } else { VoxelState::OutOfBox },
                    ));
                }
                _ => {}
            }
        }
    }

    /// Replaces the sent voxels. They must be sorted.
    pub fn note(&mut self, occupied: Vec<VoxelIndex>) {
        self.sent = occupied;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use VoxelState::{NotOccupied, Occupied, OutOfBox};

    fn voxels(xs: &[i32]) -> Vec<VoxelIndex> {
        xs.iter().map(|&x| [x, 7, -x]).collect()
    }

    fn changed(changes: &VoxelChanges, xs: &[i32], is_whole: bool) -> Vec<(i32, VoxelState)> {
        let found = changes.to(&voxels(xs), is_whole, |voxel| voxel[0] < 10);
        found.into_iter().map(|(voxel, state)| (voxel[0], state)).collect()
    }

    #[test]
    fn only_changes_are_sent_unless_all_voxels_are_due() {
        let mut changes = VoxelChanges::default();
        assert_eq!(changed(&changes, &[1, 3], false), [(1, Occupied), (3, Occupied)]);
        changes.note(voxels(&[1, 3, 5, 12]));
        assert_eq!(changed(&changes, &[1, 3, 5, 12], false), []);
        assert_eq!(
            changed(&changes, &[3, 4], false),
            [(1, NotOccupied), (4, Occupied), (5, NotOccupied), (12, OutOfBox)]
        );
        assert_eq!(
            changed(&changes, &[3, 4], true),
            [(1, NotOccupied), (3, Occupied), (4, Occupied), (5, NotOccupied), (12, OutOfBox)]
        );
    }
}
