use crate::args::{FrameName, ReadArgs};
use crate::part::{point_of, region_of};
use voxtile::scan::Pose;
use voxtile::{Error, Result};
use voxtile_formats::ReadOptions;
use voxtile_formats::clouds::RigidPose;

/// Most seconds that a tolerance or a period may have.
const MAX_S: f64 = 1e9;

/// The nanoseconds of `--pose-tolerance`.
pub fn tolerance_ns(seconds: f64) -> Result<i64> {
    match (0.0..=MAX_S).contains(&seconds) {
        true => Ok((seconds * 1e9).round() as i64),
        false => {
            let reason = format!("{seconds} is no time in seconds, from 0 to {MAX_S}");
            Err(Error::argument("--pose-tolerance", reason))
        }
    }
}

/// What the command line says of the input.
pub fn read_options(args: &ReadArgs) -> Result<ReadOptions> {
    let extrinsic = args.extrinsic.as_deref().map(pose_of).transpose()?;
    let mut options = ReadOptions::default();
    let open = &mut options.open;
    open.format = args.format.as_deref().map(str::parse).transpose()?;
    open.fields.clone_from(&args.fields);
    open.scan_period_s = args.scan_period;
    open.sensor_origin_m = args.sensor_origin.as_deref().map(point_of);
    open.depth_scale = args.depth_scale;
    open.intrinsics_path.clone_from(&args.intrinsics);
    let clouds = &mut options.clouds;
    clouds.pose_tolerance_ns = tolerance_ns(args.pose_tolerance)?;
    clouds.body_from_sensor = extrinsic.map_or(RigidPose::IDENTITY, |(rigid, _)| rigid);
    clouds.is_world_frame = args.world_frame;
    clouds.is_deskewed = args.deskew;
    let selection = &mut options.selection;
    selection.first = args.first;
    selection.count = args.count;
    selection.every = args.every;
    selection.ignored = args.ignore_box.as_deref().map(region_of).transpose()?;
    if args.ignore_frame == FrameName::Body {
        let Some((_, pose)) = extrinsic else {
            let reason = "the body's frame is known by --extrinsic only; add it, or name the box in the sensor's frame";
            return Err(Error::argument("--ignore-frame", reason));
        };
        selection.body_from_sensor = Some(pose);
    }
    let recording = &mut options.recording;
    recording.topic.clone_from(&args.topic);
    recording.odometry_topic.clone_from(&args.odometry);
    recording.fixed_frame.clone_from(&args.fixed_frame);
    options.poses.clone_from(&args.poses);
    options.calib.clone_from(&args.calib);
    Ok(options)
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
