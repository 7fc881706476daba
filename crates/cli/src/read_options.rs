use crate::args::{FrameName, ReadArgs, ReturnsName};
use voxtile::Result;
use voxtile_formats::{ReadOptions, Returns};
use voxtile_pipeline::numbers::{Mount, point_of, region_of, set_mount, step_of_points_m, tolerance_ns};

pub fn read_options(args: &ReadArgs) -> Result<ReadOptions> {
    let mut options = ReadOptions::default();
    options.format.clone_from(&args.format);
    options.fields.clone_from(&args.fields);
    options.scan_period_s = args.scan_period;
    options.sensor_origin_m =
        args.sensor_origin.as_deref().map(|numbers| point_of("sensor_origin", numbers)).transpose()?;
    options.depth_scale = args.depth_scale;
    options.intrinsics_path.clone_from(&args.intrinsics);
    let clouds = &mut options.clouds;
    clouds.pose_tolerance_ns = tolerance_ns(args.pose_tolerance)?;
    clouds.is_world_frame = args.world_frame;
    clouds.is_deskewed = args.deskew;
    let selection = &mut options.selection;
    selection.first = args.first;
    selection.count = args.count;
    selection.every = args.every;
    selection.ignored =
        args.ignore_box.as_deref().map(|corners| region_of("ignore_box", corners)).transpose()?;
    selection.step_m = args.round_points.map(step_of_points_m).transpose()?;
    options.classes.only_class.clone_from(&args.only_class);
    options.classes.skip_class.clone_from(&args.skip_class);
    options.returns = match args.returns {
        ReturnsName::All => Returns::All,
        ReturnsName::First => Returns::First,
        ReturnsName::Last => Returns::Last,
    };
    let recording = &mut options.recording;
    recording.topic.clone_from(&args.topic);
    recording.odometry_topic.clone_from(&args.odometry);
    recording.fixed_frame.clone_from(&args.fixed_frame);
    options.poses.clone_from(&args.poses);
    options.calib.clone_from(&args.calib);
    let mount = args.extrinsic.as_deref().map(Mount::of).transpose()?;
    set_mount(&mut options, mount, args.ignore_frame == FrameName::Body)?;
    Ok(options)
}
