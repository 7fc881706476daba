//! Recordings that rosbags and the writer of mcap.dev made (tests/fixtures/make_ros.py) give what was put into them.
#![cfg(feature = "ros")]

/// Clouds and poses of whole recordings.
mod contents;
/// Files that are cut off, damaged or no recordings.
mod damage;
/// Images of 16 bits, and compressed ones.
mod depths;
/// Transforms that contradict one another.
mod frames;
/// Clouds whose messages are laid out as drivers do it.
mod layouts;
#[path = "../made/mod.rs"]
mod made;
/// What exceeds the memory goes to temporary files.
mod memory;
/// Poses of a topic.
mod odometry;
/// Messages and files that are compressed.
mod packed;
/// Recordings of several files.
mod parts;
/// Clouds that are in the frame of the map already.
mod registered;
mod support;
/// Recordings with many topics.
mod topics;
