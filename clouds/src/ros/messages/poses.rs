use super::header::{Header, read_frame};
use super::kind::MessageKind;
use crate::pose::RigidPose;
use crate::ros::wire::{Decoded, Wire, WireReader};

/// Where a frame was in another, and when.
#[derive(Clone, Debug, PartialEq)]
pub struct StampedPose {
    /// Stamp and the parent frame.
    pub header: Header,
    /// The frame whose pose this is; empty if the message does not say.
    pub child_frame: String,
    /// The child in the parent.
    pub parent_from_child: RigidPose,
}

/// The fewest bytes of a transform, and of a pose, in a message.
const LEAST_BYTES: usize = 7 * 8;

/// Decodes the poses of a message: tf, odometry, poses and paths. Messages of other kinds have none.
///
/// # Errors
///
/// The message is cut off.
pub fn decode_poses(kind: MessageKind, wire: Wire, bytes: &[u8]) -> Decoded<Vec<StampedPose>> {
    let reader = &mut WireReader::new(wire, bytes)?;
    Ok(match kind {
        MessageKind::Tf => {
            let count = reader.sequence(LEAST_BYTES)?;
            (0..count).map(|_| transform(reader)).collect::<Decoded<_>>()?
        }
        MessageKind::TransformStamped => vec![transform(reader)?],
        MessageKind::Odometry => {
            let (header, child_frame) = (Header::read(reader)?, read_frame(reader)?);
            vec![StampedPose { header, child_frame, parent_from_child: pose(reader)? }]
        }
        MessageKind::PoseStamped | MessageKind::PoseWithCovarianceStamped => vec![stamped(reader)?],
        MessageKind::Path => {
            let whole = Header::read(reader)?;
            let count = reader.sequence(LEAST_BYTES)?;
            let mut poses = (0..count).map(|_| stamped(reader)).collect::<Decoded<Vec<_>>>()?;
            for pose in poses.iter_mut().filter(|pose| pose.header.frame_id.is_empty()) {
                pose.header.frame_id.clone_from(&whole.frame_id);
            }
            poses
        }
        _ => Vec::new(),
    })
}

/// `geometry_msgs/TransformStamped`.
fn transform(reader: &mut WireReader<'_>) -> Decoded<StampedPose> {
    let (header, child_frame) = (Header::read(reader)?, read_frame(reader)?);
    // A transform is laid out like a pose.
    Ok(StampedPose { header, child_frame, parent_from_child: pose(reader)? })
}

/// `geometry_msgs/PoseStamped`.
fn stamped(reader: &mut WireReader<'_>) -> Decoded<StampedPose> {
    let header = Header::read(reader)?;
    Ok(StampedPose { header, child_frame: String::new(), parent_from_child: pose(reader)? })
}

/// `geometry_msgs/Pose`.
fn pose(reader: &mut WireReader<'_>) -> Decoded<RigidPose> {
    let position_m = [reader.f64()?, reader.f64()?, reader.f64()?];
    Ok(RigidPose { position_m, quaternion: [reader.f64()?, reader.f64()?, reader.f64()?, reader.f64()?] })
}
