use super::voxel_changes::{VoxelChanges, VoxelState};
use crate::live_map::MapVersion;
use std::time::{Duration, Instant};
use voxtile::VoxelIndex;

/// Tracks which changes subscribers have received, and which to send next.
#[derive(Debug)]
pub struct Viewers {
    count: usize,
    changes: VoxelChanges,
    /// Version that was sent last.
    sent: Option<MapVersion>,
    /// Version for which no message can be made.
    failed: Option<MapVersion>,
    /// Whether all voxels must be sent.
    is_whole_due: bool,
    whole_at: Instant,
}

/// Interval between complete messages: the viewer count does not show that one viewer left and another arrived.
const WHOLE_EVERY: Duration = Duration::from_secs(30);

impl Viewers {
    pub fn new(now: Instant) -> Self {
        Self {
            count: 0,
            changes: VoxelChanges::default(),
            sent: None,
            failed: None,
            is_whole_due: false,
            whole_at: now,
        }
    }

    /// Updates the number of viewers. Returns whether they need a message about this version.
    pub fn needs_update(&mut self, count: usize, version: MapVersion, now: Instant) -> bool {
        let before = std::mem::replace(&mut self.count, count);
        if count == 0 {
            // Keep the sent voxels: the next viewer first gets the cached messages and must learn which of their voxels
            // were removed.
            (self.sent, self.failed) = (None, None);
            return false;
        }
        let is_time = now.saturating_duration_since(self.whole_at) >= WHOLE_EVERY;
        self.is_whole_due |= count > before || self.sent.is_none() || is_time;
        self.failed != Some(version) && (self.is_whole_due || self.sent != Some(version))
    }

    /// Returns the changes since the last message, given the sorted occupied voxels.
    pub fn changes(
        &self,
        occupied: &[VoxelIndex],
        is_in_box: impl Fn(VoxelIndex) -> bool,
    ) -> Vec<(VoxelIndex, VoxelState)> {
        self.changes.to(occupied, self.is_whole_due, is_in_box)
    }

    /// Records that a version was sent, or had no changes.
    pub fn note_sent(&mut self, version: MapVersion, occupied: Vec<VoxelIndex>, now: Instant) {
        self.changes.note(occupied);
        (self.sent, self.failed) = (Some(version), None);
        if std::mem::take(&mut self.is_whole_due) {
            self.whole_at = now;
        }
    }

    /// Records that no message can be made of this version. The next version may succeed.
    pub fn note_failed(&mut self, version: MapVersion) {
        self.failed = Some(version);
    }

    /// Returns whether all voxels must be sent, even without changes.
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

    fn sent(viewers: &mut Viewers, scan_number: u64, xs: &[i32]) -> Vec<(i32, VoxelState)> {
        let occupied: Vec<VoxelIndex> = xs.iter().map(|&x| [x, 0, 0]).collect();
        let changes = viewers.changes(&occupied, |_| true);
        viewers.note_sent(version(scan_number), occupied, Instant::now());
        changes.into_iter().map(|(voxel, state)| (voxel[0], state)).collect()
    }

    #[test]
    fn a_viewer_after_a_pause_gets_removed_voxels() {
        let now = Instant::now();
        let mut viewers = Viewers::new(now);
        assert!(!viewers.needs_update(0, version(1), now));
        assert!(viewers.needs_update(1, version(1), now));
        assert_eq!(sent(&mut viewers, 1, &[1, 2]), [(1, Occupied), (2, Occupied)]);
        assert!(!viewers.needs_update(1, version(1), now));
        assert!(viewers.needs_update(1, version(2), now));
        assert_eq!(sent(&mut viewers, 2, &[1, 2, 3]), [(3, Occupied)]);
        assert!(!viewers.needs_update(0, version(3), now));
        // The viewer first gets the messages above from the cache of the publisher.
        assert!(viewers.needs_update(1, version(4), now));
        assert_eq!(sent(&mut viewers, 4, &[2]), [(1, NotOccupied), (2, Occupied), (3, NotOccupied)]);
        // A second viewer arrives; later the interval passes.
        assert!(viewers.needs_update(2, version(4), now) && viewers.is_whole_due());
        assert_eq!(sent(&mut viewers, 4, &[2]), [(2, Occupied)]);
        assert!(!viewers.needs_update(2, version(4), now));
        assert!(viewers.needs_update(2, version(4), now + 2 * WHOLE_EVERY));
    }

    #[test]
    fn a_failed_version_is_not_retried() {
        let now = Instant::now();
        let mut viewers = Viewers::new(now);
        assert!(viewers.needs_update(1, version(1), now));
        viewers.note_failed(version(1));
        assert!(!viewers.needs_update(1, version(1), now));
        assert!(!viewers.needs_update(2, version(1), now + WHOLE_EVERY));
        assert!(viewers.needs_update(2, version(2), now) && viewers.is_whole_due());
        assert_eq!(sent(&mut viewers, 2, &[5]), [(5, Occupied)]);
        viewers.note_failed(version(3));
        assert!(!viewers.needs_update(2, version(3), now));
        // A viewer that arrives after all others left triggers a retry.
        assert!(!viewers.needs_update(0, version(3), now) && viewers.needs_update(1, version(3), now));
    }
}
