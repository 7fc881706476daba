use std::cmp::Ordering;
use voxtile::VoxelIndex;

/// What a viewer is told of a voxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VoxelState {
    /// It is free or unknown now.
    NotOccupied = 0,
    Occupied = 1,
    /// It is not in the box any more; nothing else is said of it.
    OutOfBox = 2,
}

/// The occupied voxels that viewers know of, in order.
#[derive(Debug, Default)]
pub struct VoxelChanges {
    told: Vec<VoxelIndex>,
}

impl VoxelChanges {
    /// What viewers have to be told, so that they know of these voxels; all of them for viewers that know of none.
    /// Telling it twice changes nothing.
    pub fn to(
        &self,
        occupied: &[VoxelIndex],
        is_whole: bool,
        is_in_box: impl Fn(VoxelIndex) -> bool,
    ) -> Vec<(VoxelIndex, VoxelState)> {
        let (mut changes, mut before, mut now) =
            (Vec::new(), self.told.iter().peekable(), occupied.iter().peekable());
        loop {
            let order = match (before.peek(), now.peek()) {
                (Some(old), Some(new)) => old.cmp(new),
                (Some(_), None) => Ordering::Less,
                (None, Some(_)) => Ordering::Greater,
                (None, None) => return changes,
            };
            let gone = if order.is_le() { before.next() } else { None };
            let here = if order.is_ge() { now.next() } else { None };
            match (gone, here) {
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

    /// Viewers know of these now, which are in order.
    pub fn note(&mut self, occupied: Vec<VoxelIndex>) {
        self.told = occupied;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use VoxelState::{NotOccupied, Occupied, OutOfBox};

    fn voxels(xs: &[i32]) -> Vec<VoxelIndex> {
        xs.iter().map(|&x| [x, 7, -x]).collect()
    }

    fn told(changes: &VoxelChanges, xs: &[i32], is_whole: bool) -> Vec<(i32, VoxelState)> {
        let told = changes.to(&voxels(xs), is_whole, |voxel| voxel[0] < 10);
        told.into_iter().map(|(voxel, state)| (voxel[0], state)).collect()
    }

    #[test]
    fn what_changed_is_told_and_what_did_not_only_to_who_knows_nothing() {
        let mut changes = VoxelChanges::default();
        assert_eq!(told(&changes, &[1, 3], false), [(1, Occupied), (3, Occupied)]);
        changes.note(voxels(&[1, 3, 5, 12]));
        assert_eq!(told(&changes, &[1, 3, 5, 12], false), []);
        assert_eq!(
            told(&changes, &[3, 4], false),
            [(1, NotOccupied), (4, Occupied), (5, NotOccupied), (12, OutOfBox)]
        );
        assert_eq!(
            told(&changes, &[3, 4], true),
            [(1, NotOccupied), (3, Occupied), (4, Occupied), (5, NotOccupied), (12, OutOfBox)]
        );
    }
}
