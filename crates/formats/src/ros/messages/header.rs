use crate::ros::wire::{Decoded, Wire, WireReader};

/// `std_msgs/Header`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Header {
    /// When the data were taken, in nanoseconds.
    pub stamp_ns: i64,
    /// The frame of the data, without slashes at its start: tf 1 wrote them, tf 2 does not know them.
    pub frame_id: String,
}

impl Header {
    /// Reads it.
    ///
    /// # Errors
    ///
    /// The message is cut off.
    pub fn read(reader: &mut WireReader<'_>) -> Decoded<Self> {
        if reader.wire() == Wire::Ros1 {
            // `seq`, which ROS 2 dropped.
            reader.u32()?;
        }
        Ok(Self { stamp_ns: reader.stamp_ns()?, frame_id: read_frame(reader)? })
    }
}

/// The name of a frame.
pub(super) fn read_frame(reader: &mut WireReader<'_>) -> Decoded<String> {
    let name = reader.string()?;
    Ok(name.trim_start_matches('/').to_owned())
}
