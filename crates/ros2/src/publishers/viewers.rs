use super::voxel_changes::{VoxelChanges, VoxelState};
use crate::live_map::MapVersion;
use std::time::{Duration, Instant};
use voxtile::VoxelIndex;

/// Those who put changes together: what they were told, and what they are to be told next.
#[derive(Debug)]
pub struct Viewers {
    count: usize,
    changes: VoxelChanges,
    /// What they know, or need not be told again.
    told: Option<MapVersion>,
    /// Of which map no message can be made.
    failed: Option<MapVersion>,
    /// Whether one of them does not know yet what all others do.
    is_whole_due: bool,
    whole_at: Instant,
}

/// Of two viewers one may leave and another come unseen.
const WHOLE_EVERY: Duration = Duration::from_secs(30);

impl Viewers {
    pub fn new(now: Instant) -> Self {
        Self {
            count: 0,
            changes: VoxelChanges::default(),
            told: None,
            failed: None,
            is_whole_due: false,
            whole_at: now,
        }
    }

    /// Whether so many viewers are to be told of a state of the map.
    pub fn are_to_hear(&mut self, count: usize, version: MapVersion, now: Instant) -> bool {
        let before = std::mem::replace(&mut self.count, count);
        if count == 0 {
            // What they were told stays in mind: who comes next gets the last messages first, and has to hear what of
            // them is so no more.
            (self.told, self.failed) = (None, None);
            return false;
        }
        let is_time = now.saturating_duration_since(self.whole_at) >= WHOLE_EVERY;
        self.is_whole_due |= count > before || self.told.is_none() || is_time;
        self.failed != Some(version) && (self.is_whole_due || self.told != Some(version))
    }

    /// What they have to be told, so that they know of these voxels, which are in order.
    pub fn changes(
        &self,
        occupied: &[VoxelIndex],
        is_in_box: impl Fn(VoxelIndex) -> bool,
    ) -> Vec<(VoxelIndex, VoxelState)> {
        self.changes.to(occupied, self.is_whole_due, is_in_box)
    }

    /// They were told so, or there was nothing to tell.
    pub fn note_told(&mut self, version: MapVersion, occupied: Vec<VoxelIndex>, now: Instant) {
        self.changes.note(occupied);
        (self.told, self.failed) = (Some(version), None);
        if std::mem::take(&mut self.is_whole_due) {
            self.whole_at = now;
        }
    }

    /// No message can be made of this state of the map; the next one may do.
    pub fn note_failed(&mut self, version: MapVersion) {
        self.failed = Some(version);
    }

    /// Whether they are to be told all, even if nothing has changed.
    pub fn is_whole_due(&self) -> bool {
        self.is_whole_due
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use VoxelState::{NotOccupied, Occupied};

    fn version(scan_number: u64) -> MapVersion {
        MapVersion { opening: 0, scan_number }
    }

    fn told(viewers: &mut Viewers, scan_number: u64, xs: &[i32]) -> Vec<(i32, VoxelState)> {
        let occupied: Vec<VoxelIndex> = xs.iter().map(|&x| [x, 0, 0]).collect();
        let changes = viewers.changes(&occupied, |_| true);
        viewers.note_told(version(scan_number), occupied, Instant::now());
        changes.into_iter().map(|(voxel, state)| (voxel[0], state)).collect()
    }

    #[test]
    fn who_comes_after_a_pause_hears_what_is_no_more() {
        let now = Instant::now();
        let mut viewers = Viewers::new(now);
        assert!(!viewers.are_to_hear(0, version(1), now));
        assert!(viewers.are_to_hear(1, version(1), now));
        assert_eq!(told(&mut viewers, 1, &[1, 2]), [(1, Occupied), (2, Occupied)]);
        assert!(!viewers.are_to_hear(1, version(1), now));
        assert!(viewers.are_to_hear(1, version(2), now));
        assert_eq!(told(&mut viewers, 2, &[1, 2, 3]), [(3, Occupied)]);
        assert!(!viewers.are_to_hear(0, version(3), now));
        // The messages above come first, out of the cache of the publisher.
        assert!(viewers.are_to_hear(1, version(4), now));
        assert_eq!(told(&mut viewers, 4, &[2]), [(1, NotOccupied), (2, Occupied), (3, NotOccupied)]);
        // A second one, and then now and then.
        assert!(viewers.are_to_hear(2, version(4), now) && viewers.is_whole_due());
        assert_eq!(told(&mut viewers, 4, &[2]), [(2, Occupied)]);
        assert!(!viewers.are_to_hear(2, version(4), now));
        assert!(viewers.are_to_hear(2, version(4), now + 2 * WHOLE_EVERY));
    }

    #[test]
    fn a_map_that_makes_no_message_is_not_asked_again_until_it_changes() {
        let now = Instant::now();
        let mut viewers = Viewers::new(now);
        assert!(viewers.are_to_hear(1, version(1), now));
        viewers.note_failed(version(1));
        assert!(!viewers.are_to_hear(1, version(1), now));
        assert!(!viewers.are_to_hear(2, version(1), now + WHOLE_EVERY));
        assert!(viewers.are_to_hear(2, version(2), now) && viewers.is_whole_due());
        assert_eq!(told(&mut viewers, 2, &[5]), [(5, Occupied)]);
        viewers.note_failed(version(3));
        assert!(!viewers.are_to_hear(2, version(3), now));
        // Who comes when all others have left makes it try again.
        assert!(!viewers.are_to_hear(0, version(3), now) && viewers.are_to_hear(1, version(3), now));
    }
}
