use super::header::{Header, read_frame};
use super::kind::MessageKind;
use crate::poses::RigidPose;
use crate::ros::wire::{Decoded, Wire, WireReader};

/// Pose of a frame in another frame at a time.
#[derive(Clone, Debug, PartialEq)]
pub struct StampedPose {
    /// Stamp and parent frame.
    pub header: Header,
    /// Child frame; empty if the message does not name it.
    pub child_frame: String,
    /// Pose of the child in the parent.
    pub parent_from_child: RigidPose,
}

/// The poses of messages up to this size are decoded together.
const SMALL_BYTES: usize = 1 << 16;
/// Minimum size of a transform or a pose in a message.
const MIN_BYTES: usize = 7 * 8;

/// Decodes the poses of a message: tf, odometry, poses and paths. Other message types contain none.
///
/// # Errors
///
/// The message is truncated.
pub fn decode_poses(kind: MessageKind, wire: Wire, bytes: &[u8]) -> Decoded<Vec<StampedPose>> {
    let mut poses = Vec::new();
    visit(kind, wire, bytes, &mut |pose| poses.push(pose))?;
    Ok(poses)
}

/// Visits the poses of a message, or none of them if it is truncated. A large message is decoded twice for this, so
/// that never all its poses are in memory at once.
///
/// # Errors
///
/// The message is truncated.
pub(crate) fn visit_poses(
    kind: MessageKind,
    wire: Wire,
    bytes: &[u8],
    take: &mut dyn FnMut(StampedPose),
) -> Decoded<()> {
    if bytes.len() <= SMALL_BYTES {
        decode_poses(kind, wire, bytes)?.into_iter().for_each(take);
        return Ok(());
    }
    visit(kind, wire, bytes, &mut |_| {})?;
    visit(kind, wire, bytes, take)
}

fn visit(kind: MessageKind, wire: Wire, bytes: &[u8], take: &mut dyn FnMut(StampedPose)) -> Decoded<()> {
    let reader = &mut WireReader::new(wire, bytes)?;
    match kind {
        MessageKind::Tf => {
            for _ in 0..reader.sequence(MIN_BYTES)? {
                take(transform(reader)?);
            }
        }
        MessageKind::TransformStamped => take(transform(reader)?),
        MessageKind::Odometry => {
            let (header, child_frame) = (Header::read(reader)?, read_frame(reader)?);
            take(StampedPose { header, child_frame, parent_from_child: pose(reader)? });
        }
        MessageKind::PoseStamped | MessageKind::PoseWithCovarianceStamped => take(stamped(reader)?),
        MessageKind::Path => {
            let whole = Header::read(reader)?;
            for _ in 0..reader.sequence(MIN_BYTES)? {
                let mut pose = stamped(reader)?;
                if pose.header.frame_id.is_empty() {
                    pose.header.frame_id.clone_from(&whole.frame_id);
                }
                take(pose);
            }
        }
        _ => {}
    }
    Ok(())
}

/// `geometry_msgs/TransformStamped`.
fn transform(reader: &mut WireReader<'_>) -> Decoded<StampedPose> {
    let (header, child_frame) = (Header::read(reader)?, read_frame(reader)?);
    // A transform has the same layout as a pose.
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
