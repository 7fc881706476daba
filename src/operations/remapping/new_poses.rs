use crate::error::{Error, Result};
use crate::mapper::MapReader;
use crate::scan::Pose;
use crate::store::KeptRecords;
use rustc_hash::FxHashMap;

/// Poses that the scans of a map get.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum NewPoses {
    /// One a scan that the map keeps, in order.
    InOrder(Vec<Pose>),
    /// By the time stamps of the scans in nanoseconds, which may differ by so many.
    Stamped {
        /// Time stamps and poses, in any order.
        poses: Vec<(i64, Pose)>,
        /// How far a pose may be from its scan in time, in nanoseconds.
        tolerance_ns: u64,
    },
    /// By the numbers of the scans in the map; scans that are not named stay.
    Numbered(Vec<(u64, Pose)>),
}

/// Most scans that an error names.
const MAX_NAMED: usize = 5;

impl NewPoses {
    /// The pose of every scan, by its number.
    ///
    /// # Errors
    ///
    /// A scan without a pose, a pose without a scan, numbers that are not finite: named.
    pub fn of_scans(&self, map: &MapReader) -> Result<FxHashMap<u64, Pose>> {
        self.by_number(map.kept_records()?)
    }

    /// The same, from the records of the scans.
    pub(super) fn by_number(&self, mut records: KeptRecords) -> Result<FxHashMap<u64, Pose>> {
        let mut scans = Vec::new();
        while let Some(record) = records.next_kept()? {
            scans.push((record.number, record.stamp_ns));
        }
        match self {
            Self::InOrder(poses) => in_order(&scans, poses),
            Self::Stamped { poses, tolerance_ns } => stamped(&scans, poses, *tolerance_ns),
            Self::Numbered(poses) => {
                let known: FxHashMap<u64, ()> = scans.iter().map(|(number, _)| (*number, ())).collect();
                let unknown =
                    poses.iter().map(|(number, _)| *number).filter(|number| !known.contains_key(number));
                refuse("the map keeps no scan with the number", unknown.map(|number| number.to_string()))?;
                checked(poses.iter().copied())
            }
        }
    }
}

fn in_order(scans: &[(u64, Option<i64>)], poses: &[Pose]) -> Result<FxHashMap<u64, Pose>> {
    if scans.len() == poses.len() {
        return checked(scans.iter().map(|(number, _)| *number).zip(poses.iter().copied()));
    }
    let (missing, surplus) = (scans.get(poses.len()..), poses.len().saturating_sub(scans.len()));
    let reason = match missing.and_then(<[_]>::first) {
        Some((number, _)) => {
            format!("{} poses for {} scans: none from scan {number} of the map on", poses.len(), scans.len())
        }
        None => format!("{} poses for {} scans: {surplus} too many", poses.len(), scans.len()),
    };
    Err(Error::argument("poses", reason))
}

fn stamped(
    scans: &[(u64, Option<i64>)],
    poses: &[(i64, Pose)],
    tolerance_ns: u64,
) -> Result<FxHashMap<u64, Pose>> {
    let unstamped = scans.iter().filter(|(_, stamp)| stamp.is_none()).map(|(number, _)| number.to_string());
    refuse("no time stamp in the map, so that it gets its pose by number alone: scan", unstamped)?;
    let mut poses: Vec<_> = poses.iter().map(|&(stamp, pose)| (stamp, pose, false)).collect();
    poses.sort_by_key(|(stamp, ..)| *stamp);
    let (mut found, mut missing) = (Vec::new(), Vec::new());
    for &(number, stamp) in scans {
        let stamp = stamp.unwrap_or_default();
        let after = poses.partition_point(|(of_pose, ..)| *of_pose < stamp);
        let nearest = (after.saturating_sub(1)..poses.len().min(after + 1))
            .min_by_key(|&at| poses[at].0.abs_diff(stamp))
            .filter(|&at| poses[at].0.abs_diff(stamp) <= tolerance_ns);
        match nearest {
            Some(at) => {
                poses[at].2 = true;
                found.push((number, poses[at].1));
            }
            None => missing.push(format!("{number} at {} s", seconds(stamp))),
        }
    }
    refuse("no pose for scan", missing.into_iter())?;
    let surplus = poses.iter().filter(|(.., is_used)| !is_used);
    refuse("no scan for the pose at", surplus.map(|(stamp, ..)| format!("{} s", seconds(*stamp))))?;
    checked(found.into_iter())
}

/// An error that names what there is; none if there is nothing.
fn refuse(reason: &str, mut named: impl Iterator<Item = String>) -> Result<()> {
    let first: Vec<_> = named.by_ref().take(MAX_NAMED).collect();
    if first.is_empty() {
        return Ok(());
    }
    let more = match named.count() {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    Err(Error::argument("poses", format!("{reason} {}{more}", first.join(", "))))
}

fn checked(poses: impl Iterator<Item = (u64, Pose)>) -> Result<FxHashMap<u64, Pose>> {
    let mut by_number = FxHashMap::default();
    for (number, pose) in poses {
        let is_finite = pose.position_m().iter().chain(&pose.quaternion()).all(|x| x.is_finite());
        if !is_finite {
            return Err(Error::argument("poses", format!("the pose of scan {number} is not finite")));
        }
        if by_number.insert(number, pose).is_some() {
            return Err(Error::argument("poses", format!("two poses for scan {number}")));
        }
    }
    Ok(by_number)
}

/// Nanoseconds as seconds, exactly.
fn seconds(stamp_ns: i64) -> String {
    let (whole, rest) = (stamp_ns.div_euclid(1_000_000_000), stamp_ns.rem_euclid(1_000_000_000));
    format!("{whole}.{rest:09}")
}
