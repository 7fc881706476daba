use crate::made::bag1::bag1;
use crate::made::message::{CloudLayout, F32, F64, Field, MessageWriter};
use crate::support::{Cloud, read};
use voxtile_formats::CloudPoint;
use voxtile_formats::ros::{BagOptions, PoseSource};

const XYZ: [Field; 3] = [("x", 0, F32), ("y", 4, F32), ("z", 8, F32)];

/// Reads a recording with one topic.
fn read_messages(type_name: &str, messages: &[Vec<u8>]) -> (Vec<Cloud>, Vec<String>, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.bag");
    let messages: Vec<_> = messages.iter().zip(10..).map(|(message, at)| (0, at, message.clone())).collect();
    std::fs::write(&path, bag1(&[("/points", type_name)], &messages)).unwrap();
    read(&[path], &BagOptions { poses: PoseSource::None, ..BagOptions::default() })
}

/// Reads a cloud with this layout. Returns its points, the errors and the remarks.
fn read_cloud(
    layout: &CloudLayout,
    fields: &[Field],
    data: &[u8],
) -> (Vec<CloudPoint>, Vec<String>, Vec<String>) {
    let message = MessageWriter::ros1().header(5, "lidar").cloud_data(layout, fields, data);
    let (clouds, errors, remarks) = read_messages("sensor_msgs/PointCloud2", &[message]);
    (clouds.into_iter().flat_map(|(_, points)| points).collect(), errors, remarks)
}

fn positions(points: &[CloudPoint]) -> Vec<[f64; 3]> {
    points.iter().map(|point| point.position_m).collect()
}

fn le(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

/// Encodes six points with x from 1 to 6.
fn six() -> Vec<u8> {
    (1..=6).flat_map(|k| le(&[k as f32, 0.5, -0.25])).collect()
}

fn layout(size: [u32; 2], row_step: u32) -> CloudLayout {
    CloudLayout { size, is_big_endian: false, point_step: 12, row_step }
}

#[test]
fn points_are_found_for_any_row_step() {
    let wanted: Vec<[f64; 3]> = (1..=6).map(|k| [f64::from(k), 0.5, -0.25]).collect();
    // The size of a row, 0, the size of the cloud, the points per row, and two sizes that are too large.
    for row_step in [36, 0, 72, 3, 40, u32::MAX] {
        let (points, errors, remarks) = read_cloud(&layout([2, 3], row_step), &XYZ, &six());
        assert_eq!((positions(&points), errors, remarks), (wanted.clone(), vec![], vec![]), "{row_step}");
    }
    // Rows followed by a gap, with the last gap missing in one case.
    for last in [0, 4] {
        let mut data = six();
        data.splice(36..36, [9; 4]);
        data.extend(std::iter::repeat_n(9, last));
        let (points, errors, _) = read_cloud(&layout([2, 3], 40), &XYZ, &data);
        assert_eq!((positions(&points), errors), (wanted.clone(), vec![]), "{last}");
    }
    // Missing bytes are an error; the available points are returned.
    for row_step in [36, 72] {
        let (points, errors, _) = read_cloud(&layout([2, 3], row_step), &XYZ, &six()[..60]);
        assert_eq!(positions(&points), wanted[..5], "{row_step}");
        assert!(errors[0].contains("6 points are announced, but 60 bytes of data contain 5"), "{errors:?}");
    }
}

#[test]
fn large_clouds_are_found_for_any_row_step() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.bag");
    let count = 200_000;
    let data: Vec<u8> = (1..=count).flat_map(|k| le(&[k as f32, 0.5, 0.0])).collect();
    for row_step in [0, 12 * count] {
        let message = MessageWriter::ros1().header(5, "lidar").cloud_data(
            &layout([100, count / 100], row_step),
            &XYZ,
            &data,
        );
        std::fs::write(&path, bag1(&[("/points", "sensor_msgs/PointCloud2")], &[(0, 5, message)])).unwrap();
        let options = BagOptions { memory_bytes: 0, poses: PoseSource::None, ..BagOptions::default() };
        let (clouds, errors, _) = read(std::slice::from_ref(&path), &options);
        assert_eq!(errors, Vec::<String>::new());
        let points = &clouds[0].1;
        assert!(points.iter().zip(1..).all(|(point, k)| point.position_m == [f64::from(k), 0.5, 0.0]));
        assert_eq!(points.len(), count as usize, "{row_step}");
    }
}

#[test]
fn unannounced_points_are_read_and_remarked() {
    for size in [[0, 6], [6, 0], [0, 0]] {
        let (points, errors, remarks) = read_cloud(&layout(size, 72), &XYZ, &six());
        assert_eq!((points.len(), errors), (6, vec![]), "{size:?}");
        assert_eq!(remarks, ["1 clouds announce no points, but contain points, which are read"]);
    }
    // These messages do not contain six points.
    for (size, data) in [([0, 5], six()), ([0, 0], vec![]), ([0, 0], vec![7; 13])] {
        let (points, errors, remarks) = read_cloud(&layout(size, 72), &XYZ, &data);
        assert_eq!((points.len(), errors, remarks), (0, vec![], vec![]), "{size:?}");
    }
    // A cloud without points needs no fields.
    let empty = CloudLayout { size: [0, 0], is_big_endian: false, point_step: 0, row_step: 0 };
    let (points, errors, _) = read_cloud(&empty, &[], &[]);
    assert_eq!((points.len(), errors), (0, vec![]));
}

#[test]
fn byte_order_is_detected_from_the_points() {
    let numbers: Vec<f32> = (1..=6).flat_map(|k| [1.7 * k as f32, -0.3 * k as f32, 0.0]).collect();
    let wanted: Vec<[f64; 3]> =
        numbers.chunks(3).map(|point| [0, 1, 2].map(|k| f64::from(point[k]))).collect();
    let big: Vec<u8> = numbers.iter().flat_map(|number| number.to_be_bytes()).collect();
    let expected = CloudLayout { is_big_endian: true, ..layout([1, 6], 72) };
    let (points, _, remarks) = read_cloud(&expected, &XYZ, &big);
    assert_eq!((positions(&points), remarks), (wanted.clone(), vec![]));
    let (points, _, remarks) = read_cloud(&expected, &XYZ, &le(&numbers));
    assert_eq!(positions(&points), wanted);
    assert_eq!(remarks, ["1 clouds are marked as big-endian, but are little-endian"]);
    // Too few points to detect the byte order.
    let one = CloudLayout { size: [1, 1], ..expected };
    let (points, _, remarks) = read_cloud(&one, &XYZ, &big[..12]);
    assert_eq!((positions(&points), remarks), (wanted[..1].to_vec(), vec![]));
}

#[test]
fn fields_are_found_in_any_case_and_as_vectors() {
    let data = le(&[1.0, 2.0, 3.0, 40.0]);
    let layout = CloudLayout { size: [1, 1], is_big_endian: false, point_step: 16, row_step: 16 };
    for fields in [
        vec![("X", 0, F32), ("Y", 4, F32), ("Z", 8, F32), ("INTENSITY", 12, F32)],
        vec![("xyz", 0, F32), ("intensity", 12, F32)],
        vec![("x", 0, F32), ("X", 12, F32), ("y", 4, F32), ("Z", 8, F32), ("Reflectivity", 12, F32)],
    ] {
        let (points, errors, remarks) = read_cloud(&layout, &fields, &data);
        assert_eq!((positions(&points), errors), (vec![[1.0, 2.0, 3.0]], vec![]), "{fields:?}");
        assert_eq!((points[0].intensity, remarks), (40.0, vec![]), "{fields:?}");
    }
    // `T` is a temperature, not a time.
    let fields = [("x", 0, F32), ("y", 4, F32), ("z", 8, F32), ("T", 12, F32)];
    assert_eq!(read_cloud(&layout, &fields, &data).0[0].time_s, 0.0);
}

#[test]
fn planar_clouds_have_z_0_and_fields_outside_of_points_are_errors() {
    let data = le(&[1.0, 2.0, 3.0, 4.0]);
    let layout = CloudLayout { size: [1, 2], is_big_endian: false, point_step: 8, row_step: 16 };
    let (points, errors, remarks) = read_cloud(&layout, &[("x", 0, F32), ("y", 4, F32)], &data);
    assert_eq!((positions(&points), errors), (vec![[1.0, 2.0, 0.0], [3.0, 4.0, 0.0]], vec![]));
    assert_eq!(remarks, ["1 clouds have no field z: 0 is used"]);
    for (fields, expected) in [
        (
            vec![("x", 0, F32), ("y", 4, F32), ("z", 8, F32)],
            "the field z at byte 8 is outside of the point, which has 8 bytes",
        ),
        (
            vec![("x", 0, F32), ("y", 1, F64)],
            "the field y at byte 1 is outside of the point, which has 8 bytes",
        ),
        (vec![("x", 0, F32), ("y", 4, 99)], "the field y has an unknown type"),
        (vec![("range", 0, F32), ("azimuth", 4, F32)], "have no field x; fields: range, azimuth"),
        (vec![("xyz", 0, F32)], "have no field x; fields: xyz"),
    ] {
        let (_, errors, _) = read_cloud(&layout, &fields, &data);
        assert!(errors[0].contains(expected), "{errors:?}");
    }
}

/// `sensor_msgs/PointCloud`, which also exists in ROS 2.
#[test]
fn old_clouds_are_read_with_their_channels() {
    let cloud = |writer: MessageWriter| {
        let message = writer.header(7_000_000_000, "lidar").u32(3).f32s(&[1.0, 2.0, 3.0]);
        let message = message.f32s(&[0.0, 0.0, 0.0]).f32s(&[4.0, f32::NAN, 6.0]).u32(3);
        let message =
            message.text("rgb").u32(1).f32s(&[9.0]).text("intensity").u32(3).f32s(&[10.0, 20.0, 30.0]);
        message.text("stamps").u32(3).f32s(&[0.0, 0.25, f32::NAN]).done()
    };
    let folder = tempfile::tempdir().unwrap();
    let (bag, mcap_path) = (folder.path().join("a.bag"), folder.path().join("a.mcap"));
    let ros1 = (0, 9, cloud(MessageWriter::ros1()));
    std::fs::write(&bag, bag1(&[("/points", "sensor_msgs/PointCloud")], &[ros1])).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut writer = mcap::Writer::new(&mut bytes).unwrap();
    let schema = writer.add_schema("sensor_msgs/msg/PointCloud", "ros2msg", b"").unwrap();
    let channel_id = writer.add_channel(schema, "/points", "cdr", &Default::default()).unwrap();
    let header = mcap::records::MessageHeader { channel_id, sequence: 0, log_time: 9, publish_time: 9 };
    writer.write_to_known_channel(&header, &cloud(MessageWriter::cdr())).unwrap();
    writer.finish().unwrap();
    drop(writer);
    std::fs::write(&mcap_path, bytes.into_inner()).unwrap();
    for path in [bag, mcap_path] {
        let options = BagOptions { poses: PoseSource::None, ..BagOptions::default() };
        let (clouds, errors, remarks) = read(&[path], &options);
        assert_eq!((clouds.len(), errors, remarks), (1, vec![], vec![]));
        let (head, points) = &clouds[0];
        assert_eq!(head.fields, ["x", "y", "z", "rgb", "intensity", "stamps"]);
        assert_eq!((head.stamp_ns, head.points), (Some(7_000_000_000), Some(3)));
        assert!(head.has_intensities && head.has_times);
        assert_eq!(points[0], CloudPoint { intensity: 10.0, ..CloudPoint::hit([1.0, 2.0, 3.0]) });
        assert_eq!((points[1].is_return, points[1].time_s), (false, 0.25));
        assert_eq!((points[2].is_return, points[2].intensity, points[2].time_s), (false, 30.0, 0.0));
    }
    // A channel with fewer values than points is ignored.
    let short = MessageWriter::ros1().header(7, "lidar").u32(1).f32s(&[1.0, 2.0, 3.0]).u32(1);
    let short = short.text("intensity").u32(0).done();
    let (clouds, errors, _) = read_messages("sensor_msgs/PointCloud", std::slice::from_ref(&short));
    assert_eq!((clouds[0].0.has_intensities, errors), (false, vec![]));
    let (_, errors, _) = read_messages("sensor_msgs/PointCloud", &[short[..40].to_vec()]);
    assert!(errors[0].contains("topic /points: byte"), "{errors:?}");
}

/// A driver without a clock writes the stamp 0 and the time base 0.
#[test]
fn livox_messages_of_both_drivers_are_read() {
    let point = MessageWriter::ros1()
        .u32(5_000_000)
        .f32s(&[1.0, 2.0, 3.0])
        .number([7])
        .number([0])
        .number([2])
        .done();
    let message = MessageWriter::ros1().header(0, "livox").u32(0).u32(0).u32(1).number([0; 4]).u32(1).done();
    for package in ["livox_ros_driver", "livox_ros_driver2", "livox_interfaces2"] {
        let message = [message.clone(), point.clone()].concat();
        let (clouds, errors, remarks) = read_messages(&format!("{package}/CustomMsg"), &[message]);
        assert_eq!((clouds.len(), errors), (1, vec![]), "{package}");
        assert_eq!((clouds[0].0.stamp_ns, clouds[0].1[0].position_m), (Some(10), [1.0, 2.0, 3.0]));
        assert!(remarks[0].contains("1 clouds have no stamp"), "{remarks:?}");
    }
}
