use crate::support::{assert_clouds, assert_points, assert_pose, data, expected, read, recordings, topic};
use voxtile_formats::poses::most_gap_ns;
use voxtile_formats::ros::{BagOptions, PoseSource, open_bag, open_recording};

#[test]
fn all_formats_give_equal_clouds_and_poses() {
    for name in recordings() {
        let (clouds, errors, remarks) = read(&[data(name)], &topic("/points"));
        assert_eq!((errors, remarks), (vec![], vec![]), "{name}");
        assert_clouds(&clouds, "map", name);
    }
}

#[test]
fn fixed_frame_can_be_chosen() {
    let options = BagOptions { fixed_frame: Some("/odom".to_owned()), ..topic("points") };
    let (clouds, errors, _) = read(&[data("zstd.mcap")], &options);
    assert_eq!(errors, Vec::<String>::new());
    assert_clouds(&clouds, "odom", "odom");
}

#[test]
fn odometry_and_poses_include_the_mount() {
    for name in recordings() {
        for odometry in ["/odometry", "/pose"] {
            let options = BagOptions {
                poses: PoseSource::Odometry,
                odometry_topic: Some(odometry.to_owned()),
                ..topic("/points")
            };
            let (clouds, errors, remarks) = read(&[data(name)], &options);
            assert_eq!(errors, Vec::<String>::new());
            assert_eq!(remarks.len(), usize::from(odometry == "/pose"), "{remarks:?}");
            assert_clouds(&clouds, "odom", &format!("{name} {odometry}"));
        }
    }
}

#[test]
fn odometry_is_preferred_to_unnamed_poses() {
    let options = BagOptions { poses: PoseSource::Odometry, ..topic("/points") };
    let (clouds, _, remarks) = read(&[data("none.bag")], &options);
    assert!(remarks.is_empty(), "{remarks:?}");
    assert_clouds(&clouds, "odom", "odometry");
}

#[test]
fn scans_depth_images_and_livox_are_clouds() {
    let expected = expected();
    for name in recordings() {
        for (topic_name, key) in [("/scan", "scan"), ("/depth/image_raw", "depth"), ("/livox", "livox")] {
            let of = format!("{name} {topic_name}");
            let (clouds, errors, remarks) = read(&[data(name)], &topic(topic_name));
            assert_eq!((errors, remarks), (vec![], vec![]), "{of}");
            assert_eq!(clouds.len(), 1, "{of}");
            let (head, points) = &clouds[0];
            assert_points(points, &expected[key], &of);
            assert_eq!(head.points, Some(points.len() as u64), "{of}");
            assert_pose(head.world_from_sensor, &expected["clouds"][1]["poses"]["map"], &of);
        }
    }
}

#[test]
fn several_topics_or_none_are_listed() {
    let error = |name: &str, options: &BagOptions| match open_bag(&[data(name)], options) {
        Ok(_) => panic!("{name} opens"),
        Err(error) => format!("{error:#}"),
    };
    for name in recordings() {
        let text = error(name, &BagOptions::default());
        let image = if name.ends_with(".bag") || name == "ros1.mcap" {
            "/depth/image_raw (sensor_msgs/Image, 1 messages)"
        } else {
            "/depth/image_raw (sensor_msgs/msg/Image, 1 messages)"
        };
        for part in
            ["`topic` NAME", "/points (sensor_msgs/", "PointCloud2, 4 messages)", "/livox", "/scan", image]
        {
            assert!(text.contains(part), "{name}: {text}");
        }
        assert!(!text.contains("/color"), "{text}");
        assert!(text.contains(name), "{text}");
        assert!(error(name, &topic("/pionts")).contains("/points"));
        assert!(error(name, &topic("/tf")).contains("are not clouds"));
        assert!(error(name, &topic("/color/image_raw")).contains("/color/camera_info"));
    }
}

#[test]
fn single_topics_need_no_name_and_may_lack_poses() {
    let (clouds, errors, remarks) = read(&[data("only_points.mcap")], &BagOptions::default());
    assert_eq!((clouds.len(), errors), (4, vec![]));
    assert!(clouds.iter().all(|(head, _)| head.world_from_sensor.is_none()));
    assert_eq!(remarks, ["4 clouds have no pose: no transform names the frame lidar"]);
    let options = BagOptions { poses: PoseSource::None, ..BagOptions::default() };
    let (_, _, remarks) = read(&[data("only_points.mcap")], &options);
    assert!(remarks.is_empty());
}

#[test]
fn recordings_are_detected_by_content() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["none.bag", "none.mcap"] {
        for renamed in ["drive", "drive.bag", "drive.mcap.backup"] {
            let path = folder.path().join(renamed);
            std::fs::copy(data(name), &path).unwrap();
            let (clouds, errors, _) = read(&[path], &topic("/points"));
            assert_eq!((clouds.len(), errors), (4, vec![]), "{name} as {renamed}");
        }
    }
    let path = folder.path().join("points.xyz");
    std::fs::write(&path, "1 2 3\n").unwrap();
    let Err(error) = open_recording(&[path]) else { panic!("points are no recording") };
    assert!(format!("{error:#}").contains("not a supported recording"), "{error}");
}

#[test]
fn transform_gaps_can_be_limited() {
    let options = BagOptions { most_gap_ns: Some(10_000_000), ..topic("/points") };
    let (clouds, _, remarks) = read(&[data("lz4.bag")], &options);
    assert!(clouds.iter().all(|(head, _)| head.world_from_sensor.is_none()));
    let why = "too far apart; `pose_tolerance` permits larger gaps";
    assert!(remarks.iter().any(|remark| remark.contains(why)), "{remarks:?}");
    // `map` moves in `odom` five times a second.
    for (tolerance_ns, posed) in [(99_999_999, 0), (100_000_000, 4)] {
        let options = BagOptions { most_gap_ns: Some(most_gap_ns(tolerance_ns)), ..topic("/points") };
        let (clouds, ..) = read(&[data("lz4.bag")], &options);
        assert_eq!(clouds.iter().filter(|(head, _)| head.world_from_sensor.is_some()).count(), posed);
    }
}

#[test]
fn messages_are_in_recording_order() {
    for name in recordings() {
        let mut recording = open_recording(&[data(name)]).unwrap();
        let all: Vec<usize> = (0..recording.topics().len()).collect();
        let announced: u64 = recording.topics().iter().map(|topic| topic.messages).sum();
        recording.begin(&all).unwrap();
        let mut stamps = Vec::new();
        while let Some(message) = recording.next_message().unwrap() {
            stamps.push(message.log_ns);
        }
        assert_eq!((stamps.len() as u64, announced), (41, 41), "{name}");
        assert!(stamps.is_sorted(), "{name}: {stamps:?}");
    }
}
