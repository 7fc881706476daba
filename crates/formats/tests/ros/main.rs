//! Recordings that rosbags and the writer of mcap.dev made (tests/fixtures/make_ros.py) give what was put into them.
#![cfg(feature = "ros")]

/// Clouds and poses of whole recordings.
mod contents;
/// Files that are cut off, damaged or no recordings.
mod damage;
/// Transforms that contradict one another.
mod frames;
#[path = "../made/mod.rs"]
mod made;
/// What exceeds the memory goes to temporary files.
mod memory;
/// Poses of a topic.
mod odometry;
/// Recordings of several files.
mod parts;
mod support;
/// Recordings with many topics.
mod topics;
