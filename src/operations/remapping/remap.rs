use super::change::{Change, Changes};
use super::new_poses::{NewPoses, check_can_move};
use super::replay::{Replay, Replayed, replay};
use crate::error::{Error, Result};
use crate::mapper::{KeptScanHead, KeptSummary, NewPose};
use crate::scan::Sweep;
use serde::Serialize;

/// Options of a remap.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
#[must_use]
pub struct Remap {
    /// Options of the replay.
    pub replay: Replay,
    /// Scans whose new pose differs by at most this translation in metres and rotation in radians keep their old pose.
    /// Default: every scan gets its new pose.
    pub tolerance: Option<(f64, f64)>,
}

impl Remap {
    /// Returns the options with this replay.
    pub fn new(replay: Replay) -> Self {
        Self { replay, tolerance: None }
    }

    /// Sets the tolerance in metres and radians.
    pub fn with_tolerance(self, tolerance: impl Into<Option<(f64, f64)>>) -> Self {
        Self { tolerance: tolerance.into(), ..self }
    }
}

/// Result of a remap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Remapped {
    /// Counts of the replay.
    #[serde(flatten)]
    pub mapped: Replayed,
    /// Number of scans that kept their pose, because the new one is within the tolerance.
    pub scans_within_tolerance: u64,
    /// Largest translation between an old and a new pose, in metres.
    pub largest_move_m: f64,
    /// Largest rotation between an old and a new pose, in degrees.
    pub largest_turn_deg: f64,
    /// Largest translation of the scans that kept their pose, in metres: bound of the deviation from the new poses.
    pub largest_move_left_m: f64,
    /// Largest rotation of the scans that kept their pose, in degrees.
    pub largest_turn_left_deg: f64,
}

/// Assigns new poses to the scans of a map. Tiles that these scans touch with the old or new poses are replayed from
/// all scans that touch them. In one commit the map becomes equal, bit by bit, to one built with the new poses.
///
/// ```no_run
/// use voxtile::mapper::KeptSummary;
/// use voxtile::operations::{NewPoses, Remap, remap};
///
/// # fn main() -> voxtile::Result<()> {
/// # let poses = Vec::new();
/// let scans = KeptSummary::read("maps/city")?;
/// remap(&scans, &NewPoses::InOrder(poses), &Remap::default(), |_, _| ())?;
/// # Ok(())
/// # }
/// ```
///
/// The cost depends on the affected tiles; `how` limits the memory. `progress` receives the number of scans done and in
/// total.
///
/// # Errors
///
/// A map that keeps no scans or has other scans too; missing, surplus or non-finite poses; scans whose points are in
/// the world frame, which poses cannot move; a damaged segment or catalog; another writer, or [`Error::Changed`] if one
/// has flushed before the map was locked; an I/O error; a request to stop. The map is unchanged then. A snapshot
/// `keep_as` may have been created.
pub fn remap(
    scans: &KeptSummary,
    poses: &NewPoses,
    how: &Remap,
    progress: impl FnMut(u64, u64),
) -> Result<Remapped> {
    let (mut remapped, changes) = Remapped::by_poses(scans, poses, how.tolerance)?;
    remapped.mapped = replay(scans, changes, &how.replay, progress)?;
    Ok(remapped)
}

impl Remapped {
    /// Returns the changes of scans by new poses, and how far they move.
    pub(super) fn by_poses(
        scans: &KeptSummary,
        poses: &NewPoses,
        tolerance: Option<(f64, f64)>,
    ) -> Result<(Self, Changes)> {
        if let Some((moved_m, turned)) = tolerance
            && !(moved_m >= 0.0 && turned >= 0.0)
        {
            return Err(Error::argument(
                "tolerance",
                "must be a distance in metres and an angle, both not negative",
            ));
        }
        let (mut remapped, mut changes) = (Self::default(), Changes::default());
        scans.check_keeps_all()?;
        let poses = poses.by_number(scans)?;
        for scan in scans.scans() {
            if let Some(pose) = poses.get(&scan.number)
                && remapped.moves(scan, scans.sweep(scan.number), pose, tolerance)?
            {
                changes.insert(scan.number, Change::Move(pose.clone()));
            }
        }
        Ok((remapped, changes))
    }

    fn moves(
        &mut self,
        scan: &KeptScanHead,
        old_sweep: Option<&Sweep>,
        new: &NewPose,
        tolerance: Option<(f64, f64)>,
    ) -> Result<bool> {
        let NewPose { world_from_sensor: new, sweep } = new;
        let is_same_motion =
            old_sweep.is_none() || sweep.as_deref().is_none_or(|sweep| Some(sweep) == old_sweep);
        let old = check_can_move(scan)?;
        if old == *new && is_same_motion {
            return Ok(false);
        }
        let between = old.isometry().inv_mul(new.isometry());
        let (moved_m, turned) = (between.translation.vector.norm(), between.rotation.angle());
        self.largest_move_m = self.largest_move_m.max(moved_m);
        self.largest_turn_deg = self.largest_turn_deg.max(turned.to_degrees());
        if !tolerance.is_some_and(|(most_m, most)| moved_m <= most_m && turned <= most) {
            return Ok(true);
        }
        self.scans_within_tolerance += 1;
        self.largest_move_left_m = self.largest_move_left_m.max(moved_m);
        self.largest_turn_left_deg = self.largest_turn_left_deg.max(turned.to_degrees());
        Ok(false)
    }
}
