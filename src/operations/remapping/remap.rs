use super::new_poses::NewPoses;
use super::revision::{Change, Changes};
use super::rework::{MappedAgain, Rework, rework};
use crate::error::{Error, Result};
use crate::mapper::{KeptScanHead, KeptSummary};
use crate::scan::Pose;
use serde::Serialize;

/// How a map follows new poses.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
#[must_use]
pub struct Remap {
    /// What every rework can do.
    pub rework: Rework,
    /// Scans that move by no more than so many metres and turn by no more than so many radians stay where they are.
    /// Default: every scan gets its new pose.
    pub tolerance: Option<(f64, f64)>,
}

impl Remap {
    /// Remaps in this way.
    pub fn new(rework: Rework) -> Self {
        Self { rework, tolerance: None }
    }

    /// The same, leaving scans alone that hardly move: metres and radians.
    pub fn with_tolerance(self, tolerance: impl Into<Option<(f64, f64)>>) -> Self {
        Self { tolerance: tolerance.into(), ..self }
    }
}

/// What became of a map by new poses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Remapped {
    /// What was mapped again.
    #[serde(flatten)]
    pub mapped: MappedAgain,
    /// Scans whose new pose differs by no more than the tolerance; they keep the pose that they had.
    pub scans_within_tolerance: u64,
    /// The longest way between an old and a new pose, in metres.
    pub largest_move_m: f64,
    /// The largest angle between an old and a new pose, in degrees.
    pub largest_turn_deg: f64,
    /// The same of the scans that kept their pose: how far the map is from the new poses at most, in metres.
    pub largest_move_left_m: f64,
    /// Likewise, in degrees.
    pub largest_turn_left_deg: f64,
}

/// Gives the scans of a map new poses: what they touch under the old or the new ones is mapped again, from all scans
/// that touch it. One commit; the map is then as if it had been built with these poses, to the bit.
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
/// Work: the tiles touched, in the memory that `how` allows. `progress` is told the scans done and all.
///
/// # Errors
///
/// A map that keeps no scans or consists of more than these; poses that are not finite, missing or too many; scans
/// whose points are in the world frame, which no pose moves; a damaged segment or catalog; another writer, and
/// [`Error::Changed`] if one has flushed before the map was locked; a disk that refuses; a request to stop. The map is
/// as it was then; the snapshot that keeps it may have been made.
pub fn remap(
    scans: &KeptSummary,
    poses: &NewPoses,
    how: &Remap,
    progress: impl FnMut(u64, u64),
) -> Result<Remapped> {
    let (mut remapped, changes) = Remapped::by_poses(scans, poses, how)?;
    remapped.mapped = rework(scans, changes, &how.rework, progress)?;
    Ok(remapped)
}

impl Remapped {
    /// Which scans of the map get a new pose, and how far they move.
    pub(super) fn by_poses(scans: &KeptSummary, poses: &NewPoses, how: &Remap) -> Result<(Self, Changes)> {
        if let Some((moved_m, turned)) = how.tolerance
            && !(moved_m >= 0.0 && turned >= 0.0)
        {
            return Err(Error::argument(
                "tolerance",
                "two lengths that are not negative: metres and an angle",
            ));
        }
        let (mut remapped, mut changes) = (Self::default(), Changes::default());
        scans.check_keeps_all()?;
        let poses = poses.by_number(scans)?;
        for scan in scans.scans() {
            if let Some(pose) = poses.get(&scan.number)
                && remapped.moves(scan, pose, how.tolerance)?
            {
                changes.insert(scan.number, Change::Move(*pose));
            }
        }
        Ok((remapped, changes))
    }

    /// Whether a scan gets a new pose.
    fn moves(&mut self, scan: &KeptScanHead, new: &Pose, tolerance: Option<(f64, f64)>) -> Result<bool> {
        let Some(old) = scan.world_from_sensor else {
            let reason = format!(
                "scan {} has its points in the world frame, so that no pose moves it; insert scans in the frame of \
                 their sensor",
                scan.number
            );
            return Err(Error::argument("poses", reason));
        };
        if old == *new {
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
