use std::collections::BTreeMap;
use voxtile::mapper::{KeptScanHead, KeptSummary};
use voxtile::operations::NewPoses;
use voxtile::scan::Pose;
use voxtile::{Error, Result};
use voxtile_formats::RigidPose;

/// Returns poses for all scans of a map from those of some, by the numbers of these: the others move with their
/// neighbors.
///
/// A scan between two with a new pose keeps its motion since the one before and until the one after. The two poses that
/// follow are interpolated: positions linearly, rotations by slerp, by time, or by number if a time stamp is missing.
/// Scans before the first and after the last keep their motion relative to it.
///
/// # Errors
///
/// No pose, a number without a scan, or a scan whose points are in the world frame.
pub fn interpolated_poses(scans: &KeptSummary, some: &[(u64, Pose)]) -> Result<NewPoses> {
    scans.check_keeps_all()?;
    let all = scans.scans();
    if some.is_empty() {
        return Err(Error::argument("poses", "there is none; give those of some scans"));
    }
    let mut anchors = BTreeMap::new();
    for (number, new) in some {
        let at = all.binary_search_by_key(number, |scan| scan.number);
        let at = at.map_err(|_| {
            Error::argument("poses", format!("the map keeps no scan with the number {number}"))
        })?;
        anchors.insert(at, Anchor { old: old_pose(&all[at])?, new: rigid(new), given: *new });
    }
    let have_stamps = all.iter().all(|scan| scan.stamp_ns.is_some());
    let mut poses = Vec::with_capacity(all.len());
    for (at, scan) in all.iter().enumerate() {
        let before = anchors.range(..=at).next_back();
        let after = anchors.range(at..).next();
        let pose = match (before, after) {
            (Some((of_this, anchor)), _) if *of_this == at => anchor.given,
            (Some((first, before)), Some((last, after))) => {
                let old = old_pose(scan)?;
                let share = share_between(&all[*first], &all[*last], scan, have_stamps)
                    .unwrap_or((at - first) as f64 / (last - first) as f64);
                pose_of(&before.moved(&old).towards(&after.moved(&old), share))?
            }
            (Some((_, only)), None) | (None, Some((_, only))) => pose_of(&only.moved(&old_pose(scan)?))?,
            (None, None) => continue,
        };
        poses.push((scan.number, pose));
    }
    Ok(NewPoses::Numbered(poses))
}

/// A scan with a new pose.
struct Anchor {
    old: RigidPose,
    new: RigidPose,
    /// The new pose, bit by bit.
    given: Pose,
}

impl Anchor {
    /// The new pose of another scan whose pose relative to this one does not change.
    fn moved(&self, old: &RigidPose) -> RigidPose {
        self.new.then(&self.old.inverse().then(old))
    }
}

/// How far a scan is from the first of two to the second, by time; `None` if the stamps are not in order.
fn share_between(
    first: &KeptScanHead,
    last: &KeptScanHead,
    scan: &KeptScanHead,
    have_stamps: bool,
) -> Option<f64> {
    let [first, last, at] = [first, last, scan].map(|scan| scan.stamp_ns.filter(|_| have_stamps));
    let (first, last, at) = (first?, last?, at?);
    let is_in_order = first <= at && at <= last && first < last;
    is_in_order.then(|| at.abs_diff(first) as f64 / last.abs_diff(first) as f64)
}

fn old_pose(scan: &KeptScanHead) -> Result<RigidPose> {
    scan.world_from_sensor.as_ref().map(rigid).ok_or_else(|| {
        let reason =
            format!("the points of scan {} are in the world frame, so a pose cannot move them", scan.number);
        Error::argument("poses", reason)
    })
}

fn rigid(pose: &Pose) -> RigidPose {
    RigidPose { position_m: pose.position_m(), quaternion: pose.quaternion() }
}

fn pose_of(rigid: &RigidPose) -> Result<Pose> {
    Pose::from_quaternion(rigid.position_m, rigid.quaternion)
}
