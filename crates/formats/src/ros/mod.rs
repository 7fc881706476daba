//! Recordings of ROS 1 and ROS 2.
//!
//! ```text
//! .bag, .mcap, .db3, bag folder -> Recording -> Message
//! Message -> messages -> points, poses
//! poses -> Transforms -> RigidPose at a stamp
//! all of these -> BagClouds, a CloudSource
//! ```

mod bag1;
mod bag1_record;
mod bag2_folder;
mod bag2_metadata;
mod bag_clouds;
mod bag_options;
mod bag_poses;
mod bag_topic;
mod chunk;
mod chunk_file;
mod chunk_order;
mod cloud_message;
mod cloud_topics;
#[cfg(feature = "sqlite")]
mod db3;
mod depth_images;
mod depth_name;
mod file_bytes;
mod frame_links;
mod frame_search;
mod mcap_file;
mod mcap_record;
mod message_data;
pub mod messages;
mod open;
mod packed_file;
mod packed_messages;
mod pose_hint;
mod pose_lookup;
mod pose_track;
mod recording;
pub(crate) mod recording_clouds;
mod registered;
mod sample_spool;
mod samples;
mod second_parent;
mod sequence;
mod transform_collector;
mod transforms;
mod unstamped;
mod wire;

pub use bag_clouds::{BagClouds, open_bag};
pub use bag_options::{BagOptions, PoseSource};
pub use bag1::Bag1;
pub use bag2_folder::Bag2Folder;
#[cfg(feature = "sqlite")]
pub use db3::Db3;
pub use mcap_file::McapFile;
pub use message_data::MessageData;
pub use open::{open_recording, open_recording_within};
pub use recording::{Message, Recording, Topic};
pub use second_parent::SecondParent;
pub use sequence::Sequence;
pub use transforms::{BadTransform, Transforms, WhyNot};
pub use wire::{Decoded, Wire, WireError, WireReader};
