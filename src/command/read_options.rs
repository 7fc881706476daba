use crate::command::args::{FrameName, ReadArgs};
use crate::command::part::region_of;
use crate::io::{CloudOptions, ReadOptions, RecordingOptions, Selection};
use crate::scan::Pose;
use crate::{Error, Result};
use voxtile_clouds::RigidPose;
use voxtile_clouds::read::OpenOptions;

/// Most seconds that a tolerance or a period may have.
const MOST_S: f64 = 1e9;

/// The nanoseconds of `--pose-tolerance`.
pub fn tolerance_ns(seconds: f64) -> Result<i64> {
    match (0.0..=MOST_S).contains(&seconds) {
        true => Ok((seconds * 1e9).round() as i64),
        false => {
            let reason = format!("{seconds} is no time in seconds, from 0 to {MOST_S}");
            Err(Error::argument("--pose-tolerance", reason))
        }
    }
}

/// What the command line says of the input.
pub fn read_options(args: &ReadArgs) -> Result<ReadOptions> {
    let extrinsic = args.extrinsic.as_deref().map(pose_of).transpose()?;
    let body_from_sensor = extrinsic.map_or(RigidPose::IDENTITY, |(rigid, _)| rigid);
    let open = OpenOptions {
        format: args.format.as_deref().map(str::parse).transpose()?,
        fields: args.fields.clone(),
        scan_period_s: args.scan_period,
        sensor_origin_m: args.sensor_origin.as_deref().map(crate::command::map_at::point_of),
        depth_scale: args.depth_scale,
        intrinsics_path: args.intrinsics.clone(),
        ..OpenOptions::default()
    };
    let clouds = CloudOptions {
        pose_tolerance_ns: tolerance_ns(args.pose_tolerance)?,
        body_from_sensor,
        is_world_frame: args.world_frame,
        is_deskewed: args.deskew,
        ..CloudOptions::default()
    };
    let mut selection = Selection {
        first: args.first,
        count: args.count,
        every: args.every,
        ignored: args.ignore_box.as_deref().map(region_of).transpose()?,
        ..Selection::default()
    };
    if args.ignore_frame == FrameName::Body {
        let Some((_, pose)) = extrinsic else {
            let reason = "the body's frame is known by --extrinsic only; add it, or name the box in the sensor's frame";
            return Err(Error::argument("--ignore-frame", reason));
        };
        selection.body_from_sensor = Some(pose);
    }
    let recording = RecordingOptions {
        topic: args.topic.clone(),
        odometry_topic: args.odometry.clone(),
        fixed_frame: args.fixed_frame.clone(),
    };
    let (poses, calib) = (args.poses.clone(), args.calib.clone());
    Ok(ReadOptions { open, recording, poses, calib, clouds, selection, ..ReadOptions::default() })
}

/// A pose of 7 numbers (position, quaternion) or of a 3x4 matrix; and in the 9 numbers of a 3x3 matrix a rotation.
pub fn pose_of(numbers: &[f64]) -> Result<(RigidPose, Pose)> {
    let pose = match *numbers {
        [x, y, z, qx, qy, qz, qw] => {
            let pose = Pose::from_quaternion([x, y, z], [qx, qy, qz, qw])?;
            return Ok((RigidPose { position_m: [x, y, z], quaternion: [qx, qy, qz, qw] }, pose));
        }
        [a, b, c, d, e, f, g, h, i] => Pose::from_matrix(&[[a, b, c, 0.0], [d, e, f, 0.0], [g, h, i, 0.0]])?,
        _ if numbers.len() == 12 => Pose::from_matrix(numbers.as_chunks().0)?,
        _ => {
            let reason = format!(
                "{} numbers; give 7 (tx ty tz qx qy qz qw), 9 (a 3x3 matrix) or 12 (a 3x4 matrix, row by row)",
                numbers.len()
            );
            return Err(Error::argument("--extrinsic", reason));
        }
    };
    Ok((RigidPose { position_m: pose.position_m(), quaternion: pose.quaternion() }, pose))
}
