use crate::ros::wire::{Decoded, Wire, WireReader};

/// `std_msgs/Header`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Header {
    /// Time stamp of the data, in nanoseconds.
    pub stamp_ns: i64,
    /// Frame of the data, without the leading slashes of tf 1, which tf 2 does not use.
    pub frame_id: String,
}

impl Header {
    /// Reads a header.
    ///
    /// # Errors
    ///
    /// The message is truncated.
    pub fn read(reader: &mut WireReader<'_>) -> Decoded<Self> {
        if reader.wire() == Wire::Ros1 {
            // `seq`, which ROS 2 dropped.
            reader.u32()?;
        }
        Ok(Self { stamp_ns: reader.stamp_ns()?, frame_id: read_frame(reader)? })
    }
}

/// Reads the name of a frame.
pub(super) fn read_frame(reader: &mut WireReader<'_>) -> Decoded<String> {
    let name = reader.string()?;
    Ok(name.trim_start_matches('/').to_owned())
}
