use voxtile::Pose;
use voxtile::mapper::KeptScanHead;
use voxtile_formats::RigidPose;
use voxtile_formats::ros::messages::StampedPose;

/// New poses of a map's scans, computed from a corrected path. The path names scans by their stamps; scans between them
/// are moved with them.
#[derive(Clone, Debug, Default)]
pub struct Corrections {
    /// Number and new pose of each scan.
    pub poses: Vec<(u64, Pose)>,
    /// Number of scans that the path names.
    pub named: usize,
    /// Largest displacement of a scan, in metres.
    pub most_moved_m: f64,
    /// Largest rotation of a scan, in radians.
    pub most_turned: f64,
}

/// Maximum difference between the stamps of a scan and its path pose, because paths are often stored with rounded
/// seconds.
const SAME_STAMP_NS: u64 = 1_000_000;
/// If stamps decrease by more than this, the scans that follow belong to another run of the robot.
const ANOTHER_RUN_NS: i64 = 2_000_000_000;

struct Scan {
    number: u64,
    stamp_ns: i64,
    world_from_sensor: Pose,
}

impl Corrections {
    /// Computes the corrections. A scan that the path does not name keeps its pose relative to the nearest named scan
    /// in time. Scans without a stamp or a pose keep their poses, as do scans of earlier runs, whose stamps may be the
    /// same.
    ///
    /// # Errors
    ///
    /// Invalid poses.
    pub fn of<'a>(
        records: impl IntoIterator<Item = &'a KeptScanHead>,
        path: &[StampedPose],
    ) -> voxtile::Result<Self> {
        let mut path: Vec<(i64, RigidPose)> =
            path.iter().map(|pose| (pose.header.stamp_ns, pose.parent_from_child)).collect();
        path.sort_by_key(|(stamp_ns, _)| *stamp_ns);
        let (mut scans, mut newest_ns) = (Vec::new(), i64::MIN);
        for record in records {
            if let (Some(stamp_ns), Some(world_from_sensor)) = (record.stamp_ns, record.world_from_sensor) {
                if stamp_ns < newest_ns.saturating_sub(ANOTHER_RUN_NS) {
                    scans.clear();
                    newest_ns = i64::MIN;
                }
                newest_ns = newest_ns.max(stamp_ns);
                scans.push(Scan { number: record.number, stamp_ns, world_from_sensor });
            }
        }
        // Stamp, old pose and new pose of the scans that the path names, sorted by stamp.
        let mut named = Vec::new();
        for scan in &scans {
            let pose = nearest(&path, scan.stamp_ns, |(stamp_ns, _)| *stamp_ns);
            if let Some((stamp_ns, pose)) = pose
                && stamp_ns.abs_diff(scan.stamp_ns) <= SAME_STAMP_NS
            {
                let new = Pose::from_quaternion(pose.position_m, pose.quaternion)?;
                named.push((scan.stamp_ns, scan.world_from_sensor, new));
            }
        }
        named.sort_by_key(|(stamp_ns, ..)| *stamp_ns);
        let mut found = Self { named: named.len(), ..Self::default() };
        for scan in &scans {
            let Some(&(stamp_ns, old, new)) = nearest(&named, scan.stamp_ns, |(stamp_ns, ..)| *stamp_ns)
            else {
                break;
            };
            let own = scan.world_from_sensor;
            let corrected = if stamp_ns == scan.stamp_ns {
                new
            } else if old == new {
                own
            } else {
                let own = old.isometry().inv_mul(own.isometry());
                Pose::from(new.isometry() * own)
            };
            let between = own.isometry().inv_mul(corrected.isometry());
            found.most_moved_m = found.most_moved_m.max(between.translation.vector.norm());
            found.most_turned = found.most_turned.max(between.rotation.angle());
            found.poses.push((scan.number, corrected));
        }
        Ok(found)
    }
}

/// Returns the item nearest in time from items sorted by time.
fn nearest<T>(sorted: &[T], stamp_ns: i64, stamp_of: impl Fn(&T) -> i64) -> Option<&T> {
    let after = sorted.partition_point(|one| stamp_of(one) < stamp_ns);
    let around = sorted.get(after.saturating_sub(1)..sorted.len().min(after + 1))?;
    around.iter().min_by_key(|one| stamp_of(one).abs_diff(stamp_ns))
}

#[cfg(test)]
mod tests {
    use super::*;
    use voxtile_formats::ros::messages::Header;

    fn record(number: u64, stamp_ns: Option<i64>, x: f64) -> KeptScanHead {
        let pose = Pose::from_quaternion([x, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        KeptScanHead::new(number, stamp_ns, Some(pose))
    }

    fn pose(stamp_ns: i64, position_m: [f64; 3], quaternion: [f64; 4]) -> StampedPose {
        let header = Header { stamp_ns, frame_id: "map".to_owned() };
        StampedPose {
            header,
            child_frame: String::new(),
            parent_from_child: RigidPose { position_m, quaternion },
        }
    }

    const STRAIGHT: [f64; 4] = [0.0, 0.0, 0.0, 1.0];
    /// Quarter turn to the left, not normalized.
    const LEFT: [f64; 4] = [0.0, 0.0, 2.0, 2.0];

    #[test]
    fn scans_between_follow_the_nearest_named_scan() {
        let s = 1_000_000_000;
        let records = [
            record(1, Some(0), 0.0),
            record(2, Some(s), 1.0),
            record(3, Some(4 * s), 4.0),
            record(4, Some(10 * s), 10.0),
            record(5, None, 11.0),
        ];
        let path = [
            pose(10 * s + 900_000, [10.0, 5.0, 0.0], LEFT),
            pose(7, [0.0; 3], STRAIGHT),
            pose(50 * s, [9.0; 3], LEFT),
        ];
        let found = Corrections::of(&records, &path).unwrap();
        assert_eq!(found.named, 2);
        let numbers: Vec<u64> = found.poses.iter().map(|(number, _)| *number).collect();
        assert_eq!(numbers, [1, 2, 3, 4]);
        let positions = found.poses.iter().map(|(_, pose)| pose.position_m());
        assert_eq!(
            positions.collect::<Vec<_>>(),
            [[0.0; 3], [1.0, 0.0, 0.0], [4.0, 0.0, 0.0], [10.0, 5.0, 0.0]]
        );
        assert!(
            (found.most_moved_m - 5.0).abs() < 1e-12 && (found.most_turned.to_degrees() - 90.0).abs() < 1e-9
        );

        // The third scan keeps its pose relative to the fourth, which is turned: it is six metres behind the fourth.
        let found = Corrections::of(&records[2..4], &path).unwrap();
        let position = found.poses[0].1.position_m();
        assert!((0..3).all(|k| (position[k] - [10.0, -1.0, 0.0][k]).abs() < 1e-12), "{position:?}");
    }

    #[test]
    fn scans_of_another_run_keep_their_poses_despite_equal_stamps() {
        let s = 1_000_000_000;
        let stamps_s = [0, 1, 2, 3, 0, 2, 1, 4];
        let records: Vec<_> = stamps_s
            .iter()
            .zip(1..)
            .map(|(stamp_s, number)| record(number, Some(stamp_s * s), 0.0))
            .collect();
        let path = [pose(s, [0.0, 7.0, 0.0], STRAIGHT)];
        let found = Corrections::of(&records, &path).unwrap();
        let numbers: Vec<u64> = found.poses.iter().map(|(number, _)| *number).collect();
        assert_eq!((found.named, numbers), (1, vec![5, 6, 7, 8]));
        // All scans of one run are moved.
        assert_eq!(Corrections::of(&records[..4], &path).unwrap().poses.len(), 4);
    }

    #[test]
    fn a_path_without_known_stamps_changes_nothing_and_invalid_poses_are_refused() {
        let records = [record(1, Some(0), 0.0)];
        let found = Corrections::of(&records, &[pose(2_000_000, [1.0; 3], STRAIGHT)]).unwrap();
        assert_eq!((found.named, found.poses.len()), (0, 0));
        assert!(Corrections::of(&records, &[pose(0, [1.0; 3], [0.0; 4])]).is_err());
        assert!(Corrections::of(&records, &[pose(0, [f64::NAN; 3], STRAIGHT)]).is_err());
    }
}
