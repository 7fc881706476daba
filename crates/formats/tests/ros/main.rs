//! Reads recordings written by rosbags and by the MCAP library (tests/fixtures/make_ros.py).
#![cfg(feature = "ros")]

/// Colours and classes of points.
mod attributes;
/// Clouds and poses of intact recordings.
mod contents;
/// Truncated, damaged and foreign files.
mod damage;
/// Depth images, also compressed ones.
mod depths;
/// Contradictory transforms.
mod frames;
/// Message layouts used by drivers.
mod layouts;
#[path = "../made/mod.rs"]
mod made;
/// Temporary files for data beyond the memory budget.
mod memory;
/// Topics of poses.
mod odometry;
/// Compressed messages and files.
mod packed;
/// Recordings of several files.
mod parts;
/// Clouds that are already in the map frame.
mod registered;
mod support;
/// Recordings with many topics.
mod topics;
