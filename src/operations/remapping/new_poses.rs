use crate::error::{Error, Result};
use crate::mapper::{KeptScanHead, KeptSummary, NewPose};
use crate::scan::Pose;
use rustc_hash::{FxHashMap, FxHashSet};

/// New poses of a map's scans.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum NewPoses {
    /// One pose per kept scan, in order.
    InOrder(Vec<Pose>),
    /// Poses by the number of the scan in the map. Other scans keep their pose.
    Numbered(Vec<(u64, Pose)>),
    /// As before, with the motion of the sensor during each scan.
    Moving(Vec<(u64, NewPose)>),
}

/// Maximum number of scans named in an error.
const MAX_NAMED: usize = 5;

impl NewPoses {
    /// Returns the new poses by scan number.
    ///
    /// # Errors
    ///
    /// A scan without a pose, a pose without a scan, or a pose that is not finite.
    pub fn by_number(&self, scans: &KeptSummary) -> Result<FxHashMap<u64, NewPose>> {
        let scans = scans.scans();
        match self {
            Self::InOrder(poses) => in_order(scans, poses),
            Self::Numbered(poses) => {
                check_numbers(scans, poses.iter().map(|(number, _)| *number))?;
                checked(poses.iter().map(|(number, pose)| (*number, (*pose).into())))
            }
            Self::Moving(poses) => {
                check_numbers(scans, poses.iter().map(|(number, _)| *number))?;
                checked(poses.iter().cloned())
            }
        }
    }
}

/// Returns the pose of a scan that gets a new one.
///
/// # Errors
///
/// The points of the scan are in the world frame.
pub(super) fn check_can_move(scan: &KeptScanHead) -> Result<Pose> {
    scan.world_from_sensor.ok_or_else(|| {
        let reason = format!(
            "the points of scan {} are in the world frame, so a pose cannot move them; insert scans in the sensor's \
             frame",
            scan.number
        );
        Error::argument("poses", reason)
    })
}

fn check_numbers(scans: &[KeptScanHead], numbers: impl Iterator<Item = u64>) -> Result<()> {
    let known: FxHashSet<u64> = scans.iter().map(|scan| scan.number).collect();
    refuse("the map keeps no scan with the number", numbers.filter(|number| !known.contains(number)))
}

fn in_order(scans: &[KeptScanHead], poses: &[Pose]) -> Result<FxHashMap<u64, NewPose>> {
    if scans.len() == poses.len() {
        return checked(scans.iter().map(|scan| scan.number).zip(poses.iter().copied().map(NewPose::from)));
    }
    let surplus = poses.len().saturating_sub(scans.len());
    let reason = match scans.get(poses.len()) {
        Some(KeptScanHead { number, .. }) => {
            format!(
                "{} poses for {} scans: none for scan {number} of the map and later ones",
                poses.len(),
                scans.len()
            )
        }
        None => format!("{} poses for {} scans: {surplus} too many", poses.len(), scans.len()),
    };
    Err(Error::argument("poses", reason))
}

/// Returns an error with the first of these numbers, if there are any.
fn refuse(reason: &str, mut named: impl Iterator<Item = u64>) -> Result<()> {
    let first: Vec<_> = named.by_ref().take(MAX_NAMED).map(|number| number.to_string()).collect();
    if first.is_empty() {
        return Ok(());
    }
    let more = match named.count() {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    Err(Error::argument("poses", format!("{reason} {}{more}", first.join(", "))))
}

fn checked(poses: impl Iterator<Item = (u64, NewPose)>) -> Result<FxHashMap<u64, NewPose>> {
    let mut by_number = FxHashMap::default();
    for (number, pose) in poses {
        let sensor = &pose.world_from_sensor;
        let is_finite = sensor.position_m().iter().chain(&sensor.quaternion()).all(|x| x.is_finite());
        if !is_finite {
            return Err(Error::argument("poses", format!("the pose of scan {number} is not finite")));
        }
        if by_number.insert(number, pose).is_some() {
            return Err(Error::argument("poses", format!("two poses for scan {number}")));
        }
    }
    Ok(by_number)
}
