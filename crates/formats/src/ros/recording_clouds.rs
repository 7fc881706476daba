use crate::CloudSource;
use crate::poses::most_gap_ns;
use crate::read_options::ReadOptions;
use crate::ros::{BagOptions, PoseSource, open_bag};
use std::path::{Path, PathBuf};
use voxtile::{Error, Result};

/// Opens the clouds of a recording. A pose file takes precedence over the recording's own poses.
pub(crate) fn open(path: &Path, options: &ReadOptions) -> Result<Box<dyn CloudSource>> {
    open_parts(&[path.to_owned()], options)
}

/// As [`open`], for a recording in several files, in their order.
pub(crate) fn open_parts(paths: &[PathBuf], options: &ReadOptions) -> Result<Box<dyn CloudSource>> {
    check(options)?;
    let recording = &options.recording;
    let poses = match (&options.poses, &recording.odometry_topic) {
        (Some(_), _) => PoseSource::None,
        (None, Some(_)) => PoseSource::Odometry,
        (None, None) => PoseSource::Tf,
    };
    let bag = BagOptions {
        topic: recording.topic.clone(),
        odometry_topic: recording.odometry_topic.clone(),
        fixed_frame: recording.fixed_frame.clone(),
        poses,
        most_gap_ns: Some(most_gap_ns(options.clouds.pose_tolerance_ns)),
        is_world_frame: options.clouds.is_world_frame,
        are_poses_needed: options.clouds.are_poses_needed,
        attributes: options.attributes_to_read(),
        memory_bytes: options.memory_bytes,
        scratch: options.scratch.clone(),
    };
    Ok(Box::new(open_bag(paths, &bag)?))
}

/// Rejects options for values that the recording contains itself, which would be ignored.
fn check(options: &ReadOptions) -> Result<()> {
    if options.depth_scale.is_some() {
        let reason = "depth images of a recording have a fixed unit, millimetres for 16UC1 and metres for 32FC1: omit \
                      this option";
        return Err(Error::argument("depth_scale", reason));
    }
    if options.intrinsics_path.is_some() || options.intrinsics.is_some() {
        let reason = "a recording contains its camera in a topic `camera_info`: omit this option";
        return Err(Error::argument("intrinsics", reason));
    }
    Ok(())
}
