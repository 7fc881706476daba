use crate::args::{FrameName, ReadArgs};
use crate::part::region_of;
use voxtile::io::{CloudOptions, ReadOptions, RecordingOptions, Selection};
use voxtile::scan::Pose;
use voxtile::{Error, Result};
use voxtile_clouds::RigidPose;
use voxtile_clouds::read::OpenOptions;

/// Most seconds that a tolerance or a period may have.
const MOST_S: f64 = 1e9;

/// What the command line says of the input.
pub fn read_options(args: &ReadArgs) -> Result<ReadOptions> {
    if !(0.0..=MOST_S).contains(&args.pose_tolerance) {
        return Err(Error::argument(
            "--pose-tolerance",
            format!("{} is no time in seconds", args.pose_tolerance),
        ));
    }
    let extrinsic = args.extrinsic.as_deref().map(pose_of).transpose()?;
    let body_from_sensor = extrinsic.map_or(RigidPose::IDENTITY, |(rigid, _)| rigid);
    let open = OpenOptions {
        format: args.format.as_deref().map(str::parse).transpose()?,
        fields: args.fields.clone(),
        scan_period_s: args.scan_period,
        sensor_origin_m: args.sensor_origin.as_deref().map(crate::map_at::point_of),
        depth_scale: args.depth_scale,
        intrinsics_path: args.intrinsics.clone(),
        ..OpenOptions::default()
    };
    let mut clouds = CloudOptions::default();
    clouds.pose_tolerance_ns = (args.pose_tolerance * 1e9).round() as i64;
    clouds.body_from_sensor = body_from_sensor;
    (clouds.is_world_frame, clouds.is_deskewed) = (args.world_frame, args.deskew);
    let mut selection = Selection::default();
    (selection.first, selection.count, selection.every) = (args.first, args.count, args.every);
    selection.ignored = args.ignore_box.as_deref().map(region_of).transpose()?;
    if args.ignore_frame == FrameName::Body {
        let Some((_, pose)) = extrinsic else {
            let reason = "the body's frame is known by --extrinsic only; add it, or name the box in the sensor's frame";
            return Err(Error::argument("--ignore-frame", reason));
        };
        selection.body_from_sensor = Some(pose);
    }
    let mut options = ReadOptions::default();
    options.open = open;
    options.recording = RecordingOptions {
        topic: args.topic.clone(),
        odometry_topic: args.odometry.clone(),
        fixed_frame: args.fixed_frame.clone(),
    };
    (options.poses, options.calib) = (args.poses.clone(), args.calib.clone());
    (options.clouds, options.selection) = (clouds, selection);
    Ok(options)
}

/// A pose of 7 numbers (position, quaternion) or of a 3x4 matrix; and in the 9 numbers of a 3x3 matrix a rotation.
fn pose_of(numbers: &[f64]) -> Result<(RigidPose, Pose)> {
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
