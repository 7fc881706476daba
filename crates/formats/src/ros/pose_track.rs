use super::messages::StampedPose;
use super::samples::Samples;
use super::transforms::is_pose;

/// Poses of a topic, all of one child frame in one parent frame. Each message of a path repeats all previous poses, so
/// a pose is stored once per stamp.
#[derive(Debug, Default)]
pub(super) struct PoseTrack {
    /// Parent frame of the first valid pose.
    pub(super) parent: String,
    /// Child frame; empty if the poses do not name it.
    pub(super) child: String,
    /// Poses by stamp. Of poses with equal stamps, the last one is kept.
    pub(super) poses: Samples,
    /// Number of poses that are invalid or belong to other frames.
    pub(super) odd: u64,
}

impl PoseTrack {
    /// Adds a pose if it is valid.
    pub(super) fn insert(&mut self, pose: StampedPose) {
        let StampedPose { header, child_frame, parent_from_child } = pose;
        let parent = header.frame_id;
        if parent.is_empty() || parent == child_frame || !is_pose(&parent_from_child) {
            self.odd += 1;
            return;
        }
        if self.poses.is_empty() {
            (self.parent, self.child) = (parent, child_frame);
        } else if parent != self.parent || !(child_frame.is_empty() || child_frame == self.child) {
            self.odd += 1;
            return;
        }
        self.poses.insert(header.stamp_ns, parent_from_child);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::poses::RigidPose;
    use crate::ros::messages::Header;

    fn pose(stamp_ns: i64, parent: &str, x_m: f64) -> StampedPose {
        let header = Header { stamp_ns, frame_id: parent.to_owned() };
        let parent_from_child = RigidPose { position_m: [x_m, 0.0, 0.0], ..RigidPose::IDENTITY };
        StampedPose { header, child_frame: String::new(), parent_from_child }
    }

    #[test]
    fn repeated_path_poses_are_stored_once() {
        let mut track = PoseTrack::default();
        for message in 1..=100 {
            (0..message).for_each(|stamp_ns| track.insert(pose(stamp_ns, "odom", f64::from(message as i32))));
        }
        assert_eq!((track.poses.len(), track.odd), (100, 0));
        let (_, first) = track.poses.around(0).unwrap();
        assert_eq!(first.map(|first| first.pose.position_m[0]), Some(100.0), "the last pose is kept");
    }

    #[test]
    fn first_valid_pose_determines_the_frames() {
        let mut track = PoseTrack::default();
        for (parent, x_m) in [("", 1.0), ("map", f64::NAN), ("odom", 2.0), ("map", 3.0), ("odom", 4.0)] {
            track.insert(pose(track.odd as i64, parent, x_m));
        }
        assert_eq!((track.parent.as_str(), track.poses.len(), track.odd), ("odom", 2, 3));
        // Simulates full memory.
        assert_eq!(track.poses.drain().len(), 2);
        track.insert(pose(9, "map", 5.0));
        assert_eq!((track.parent.as_str(), track.odd), ("odom", 4));
    }

    #[test]
    fn poses_are_validated_like_transforms() {
        let mut track = PoseTrack::default();
        for length in [1.0, 0.95, 0.5, 0.0, f64::INFINITY] {
            let mut pose = pose(0, "odom", 1.0);
            pose.parent_from_child.quaternion = [0.0, 0.0, 0.0, length];
            track.insert(pose);
        }
        assert_eq!((track.poses.len(), track.odd), (1, 3));
    }
}
