//! Small valid files of every format as initial inputs for fuzzing.

use super::made::bag1::bag1;
use super::made::message::{F32, MessageWriter, U32};
use super::made::voxels::voxel_file;
use super::targets::choice;
use std::fs;
use std::path::Path;
use voxtile_formats::ros::Wire;
use voxtile_formats::ros::messages::MessageKind;

/// Target, name and content of seeds.
pub type Seeds = Vec<(&'static str, &'static str, Vec<u8>)>;

/// Returns all seeds.
pub fn all() -> Seeds {
    [plain(), surveys(), poses(), recordings(), messages()].concat()
}

/// Reads a file created by `tests/fixtures/clouds.py`.
fn fixture(name: &str) -> Vec<u8> {
    fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)).unwrap()
}

fn plain() -> Seeds {
    let lists =
        b"ply\nformat binary_big_endian 1.0\nelement face 1\nproperty list uchar int i\nelement vertex 1\n\
                  property double x\nproperty uchar y\nproperty short z\nend_header\n\x01\0\0\0\x07\
                  \x3f\xf0\0\0\0\0\0\0\x02\0\x03";
    let floats: Vec<u8> = (0..20_u8).flat_map(|k| f32::from(k).to_le_bytes()).collect();
    vec![
        ("cloud_ply", "ascii", fixture("ascii.ply")),
        ("cloud_ply", "little", fixture("little.ply")),
        ("cloud_ply", "lists", lists.to_vec()),
        ("cloud_text", "names", b"x;y;z;intensity;t\n1;2;3;4;0\n-1e3;nan;;5;0.01\n".to_vec()),
        ("cloud_text", "comment", b"//X Y Z Scalar_Intensity\n1 2 3 7\n4 5 6 8\n".to_vec()),
        ("cloud_text", "pts", b"2\n1 2 3 7 255 0 0\n4 5 6 8 255 0 0\n".to_vec()),
        ("cloud_bin", "five-by-four", floats),
    ]
}

fn surveys() -> Seeds {
    vec![
        ("cloud_las", "timed", fixture("timed.las")),
        ("cloud_las", "timed-laz", fixture("timed.laz")),
        ("cloud_las", "feet", fixture("feet.las")),
        ("cloud_las", "keys", fixture("survey_feet.las")),
        ("cloud_las", "layers", voxel_file("laz")),
        ("cloud_las", "copc", voxel_file("copc")),
        ("cloud_e57", "scans", [&[1], &fixture("scans.e57")[..]].concat()),
        ("cloud_e57", "plain", [&[0], &voxel_file("e57")[..]].concat()),
        ("cloud_e57", "sealed", [&[1], &unsealed(voxel_file("e57"))[..]].concat()),
    ]
}

/// Clears the page checksums of an E57 file.
fn unsealed(mut file: Vec<u8>) -> Vec<u8> {
    file.chunks_mut(1024).for_each(|page| page[1020..].fill(0));
    file
}

fn poses() -> Seeds {
    let euroc = "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n\
                 1700000000000000000,1,2,3,1,0,0,0\n1700000000100000000,1,2,4,0.7,0,0,0.7\n";
    let kitti = "1 0 0 1 0 1 0 2 0 0 1 3\n0 -1 0 4 1 0 0 5 0 0 1 6\n";
    let rows = "1 0 0 1\n0 1 0 2\n0 0 1 3\n0 0 0 1700000000.5\n";
    vec![
        (
            "trajectory",
            "tum",
            b"# t x y z q\n1.5 1 2 3 0 0 0 1\n1.6 1 2 3 0 0 0.6 0.8\n1.4 0 0 0 0 0 0 1\n".to_vec(),
        ),
        ("trajectory", "kitti", kitti.into()),
        ("trajectory", "euroc", euroc.into()),
        ("trajectory", "rows", rows.into()),
        ("trajectory", "npy-tum", fixture("poses_tum.npy")),
        ("trajectory", "npy-matrices", fixture("poses_3x4_f4.npy")),
    ]
}

const STAMP_NS: i64 = 1_700_000_000_100_000_000;
const POSE: [f64; 7] = [1.0, 2.0, 3.0, 0.0, 0.0, 0.6, 0.8];

/// Encodes a cloud of two points with times.
fn cloud(message: MessageWriter) -> Vec<u8> {
    let fields = [("x", 0, F32), ("y", 4, F32), ("z", 8, F32), ("intensity", 12, F32), ("t", 16, U32)];
    let point = |k: f32| [[k, 2.0, 3.0, 4.0].map(f32::to_le_bytes).as_flattened(), &[9, 0, 0, 0]].concat();
    message.point_cloud2(STAMP_NS, "lidar", &fields, &[point(1.0), point(f32::NAN)])
}

fn recordings() -> Seeds {
    let topics = [
        ("/tf", "tf2_msgs/TFMessage"),
        ("/points", "sensor_msgs/PointCloud2"),
        ("/odom", "nav_msgs/Odometry"),
    ];
    let tf = |stamp_ns| MessageWriter::ros1().tf(stamp_ns, "map", "lidar", &POSE);
    let messages = [
        (0, STAMP_NS - 50_000_000, tf(STAMP_NS - 50_000_000)),
        (1, STAMP_NS, cloud(MessageWriter::ros1())),
        (2, STAMP_NS + 1, odometry(MessageWriter::ros1())),
        (0, STAMP_NS + 50_000_000, tf(STAMP_NS + 50_000_000)),
    ];
    let bag = bag1(&topics, &messages);
    let metadata = "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n    - x_0.mcap\n  \
                    compression_format: \"\"\n  compression_mode: MESSAGE\n";
    let behind = "rosbag2_bagfile_information: {}\nrelative_file_paths: ['x/x_0.mcap', x_0.mcap]\n";
    vec![
        ("ros_bag1", "whole", bag),
        ("ros_bag1", "small", bag1(&topics[..1], &messages[..1])),
        ("ros_mcap", "points", fixture("ros/only_points.mcap")),
        ("ros_mcap", "voxels", voxel_file("mcap")),
        ("ros_metadata", "list", metadata.into()),
        ("ros_metadata", "behind", behind.into()),
    ]
}

fn odometry(message: MessageWriter) -> Vec<u8> {
    message.header(STAMP_NS, "odom").text("base_link").f64s(&POSE).f64s(&[0.0; 36 + 6 + 36]).done()
}

/// Encodes messages of every kind, for ROS 1 and as CDR.
fn messages() -> Seeds {
    let of = |new: fn() -> MessageWriter, wire: Wire| {
        let header = || new().header(STAMP_NS, "lidar");
        let laser =
            header().f32s(&[-1.0, 1.0, 0.5, 0.001, 0.1, 0.2, 30.0]).u32(2).f32s(&[1.0, 40.0]).u32(0).done();
        let livox =
            [1, 0, 0, 0].into_iter().fold(header().f64s(&[0.0]).u32(1), |livox, id| livox.number([id]));
        let livox = livox.u32(1).u32(500).f32s(&[1.0, 2.0, 3.0]).number([7]).number([0]).number([1]).done();
        let image = header().u32(1).u32(2).text("16UC1").number([0]).u32(4).sized(&[1, 0, 0, 0]).done();
        let camera = header().u32(1).u32(2).text("plumb_bob").u32(0);
        let camera = camera.f64s(&[500.0, 0.0, 320.0, 0.0, 500.0, 240.0, 0.0, 0.0, 1.0]).done();
        let tf = new().tf(STAMP_NS, "map", "base_link", &POSE);
        let path = header().u32(1).header(STAMP_NS, "").f64s(&POSE).done();
        let all = [
            (MessageKind::PointCloud2, cloud(new())),
            (MessageKind::LaserScan, laser),
            (MessageKind::LivoxCustom, livox),
            (MessageKind::Image, image),
            (MessageKind::CameraInfo, camera),
            (MessageKind::Tf, tf),
            (MessageKind::Odometry, odometry(new())),
            (MessageKind::Path, path),
        ];
        all.map(|(kind, bytes)| [vec![choice(kind, wire)], bytes].concat())
    };
    const ROS1: [&str; 8] = ["points", "laser", "livox", "image", "camera", "tf", "odometry", "path"];
    const CDR: [&str; 8] = [
        "cdr-points",
        "cdr-laser",
        "cdr-livox",
        "cdr-image",
        "cdr-camera",
        "cdr-tf",
        "cdr-odometry",
        "cdr-path",
    ];
    let ros1 = ROS1.into_iter().zip(of(MessageWriter::ros1, Wire::Ros1));
    let cdr = CDR.into_iter().zip(of(MessageWriter::cdr, Wire::Cdr));
    ros1.chain(cdr).map(|(name, bytes)| ("ros_messages", name, bytes)).collect()
}
