//! Fuzz targets: arbitrary bytes for every reader of foreign files. No input may cause a panic, a hang or high memory
//! use, and decoded data must be consistent. A target returns whether the input was read completely.
//!
//! The crates `las` and `e57` panic on damaged input, which the readers convert to errors. libFuzzer aborts at a panic
//! before it can be caught, so these two targets replace its panic hook; see `fuzz/src/lib.rs`.

use std::fs;
use std::path::Path;
use tempfile::TempDir;
use voxtile::Error;
use voxtile::scan::AttributeSet;
use voxtile_formats::CloudSource;
use voxtile_formats::poses::{Found, Trajectory};
use voxtile_formats::ros::messages::{
    CameraInfo, CompressedDepth, Image, LaserScan, LivoxCustom, MessageKind, PointCloud, PointCloud2,
    decode_poses,
};
use voxtile_formats::ros::{BagOptions, Decoded, PoseSource, Recording, Wire, open_bag, open_recording};
use voxtile_formats::{ReadOptions, open_clouds};

pub type Target = fn(&[u8]) -> bool;

/// All targets by corpus name.
pub const TARGETS: [(&str, Target); 10] = [
    ("cloud_ply", ply),
    ("cloud_text", text),
    ("cloud_bin", bin),
    ("cloud_las", las),
    ("cloud_e57", e57),
    ("trajectory", trajectory),
    ("ros_bag1", bag1),
    ("ros_mcap", mcap),
    ("ros_metadata", bag2_metadata),
    ("ros_messages", messages),
];

/// Limit for the points of a cloud: a few bytes of LAZ can decode to a huge number of points.
const MAX_POINTS: u64 = 2_000;

/// PLY in any encoding.
pub fn ply(data: &[u8]) -> bool {
    clouds(data, "a.ply", "ply", 0.0)
}

/// Points as text.
pub fn text(data: &[u8]) -> bool {
    clouds(data, "a.xyz", "xyz", 0.0)
}

/// Floats without a header, as in KITTI and nuScenes.
pub fn bin(data: &[u8]) -> bool {
    let is_kitti = clouds(data, "a.bin", "bin", 0.0);
    is_kitti || clouds(data, "a.pcd.bin", "bin", 0.0)
}

/// LAS and LAZ: as one cloud and, if it has few points, split into scans by time.
pub fn las(data: &[u8]) -> bool {
    let is_read = clouds(data, "a.laz", "las", 0.0);
    if is_read {
        clouds(data, "a.laz", "las", 0.1);
    }
    is_read
}

/// E57. If the lowest bit of the first byte is set, the page checksums are corrected first, so that damage is not only
/// found by them.
pub fn e57(data: &[u8]) -> bool {
    let Some((&choice, file)) = data.split_first() else { return false };
    let mut file = file.to_vec();
    if choice & 1 == 1 {
        file.as_chunks_mut::<1024>().0.iter_mut().for_each(seal_page);
    }
    clouds(&file, "a.e57", "e57", 0.0)
}

/// Sets the last four bytes to the CRC-32C of the others, in big-endian order.
fn seal_page(page: &mut [u8; 1024]) {
    let Some((content, crc)) = page.split_last_chunk_mut::<4>() else { return };
    let shifted = |sum: u32, _| if sum & 1 == 1 { sum >> 1 ^ 0x82f6_3b78 } else { sum >> 1 };
    let sum = content.iter().fold(!0, |sum, &byte| (0..8).fold(sum ^ u32::from(byte), shifted));
    *crc = (!sum).to_be_bytes();
}

fn clouds(data: &[u8], name: &str, format: &str, scan_period_s: f64) -> bool {
    let options = ReadOptions {
        format: Some(format.to_owned()),
        scan_period_s,
        memory_bytes: 1 << 16,
        attributes: AttributeSet { colours: true, classes: true, ..AttributeSet::NONE },
        ..ReadOptions::default()
    };
    with_file(name, data, |path| {
        open_clouds(path, &options).is_ok_and(|mut source| drain(source.as_mut(), data.len()))
    })
}

/// Reads all clouds of a source. Returns whether there were no errors.
fn drain(source: &mut dyn CloudSource, bytes: usize) -> bool {
    let (mut is_whole, mut steps) = (true, 0);
    loop {
        // Detects a hang: an error that repeats forever.
        steps += 1;
        assert!(steps <= 2 * bytes + 16, "{} steps", steps);
        match source.next_cloud() {
            Ok(None) => break,
            Err(_) => is_whole = false,
            Ok(Some(head)) => {
                assert!(head.world_from_sensor.is_none_or(|pose| pose.is_valid()), "{head:?}");
                let mut points = 0;
                let read = source.read_points(&mut |point| {
                    assert!(
                        !point.is_return || point.position_m.iter().all(|axis| axis.is_finite()),
                        "{point:?}"
                    );
                    points += 1;
                    if points < MAX_POINTS { Ok(()) } else { Err(Error::argument("points", "enough")) }
                });
                is_whole &= read.is_ok();
            }
        }
    }
    source.remarks();
    is_whole
}

/// Poses in any layout, as text or as a NumPy array.
pub fn trajectory(data: &[u8]) -> bool {
    let read = with_file("poses", data, |path| Trajectory::read(path, None));
    let Ok(poses) = read else { return false };
    assert!(!poses.is_empty() && poses.len() <= data.len());
    // Lost poses are `None`.
    let known: Vec<_> = (0..poses.len()).filter_map(|number| poses.by_number(number).unwrap()).collect();
    assert!(!known.is_empty() && known.iter().all(|pose| pose.is_valid()));
    let stamps: Vec<i64> = poses.stamps_ns().map(|stamp| stamp.unwrap()).collect();
    assert!(stamps.is_sorted());
    for pair in stamps.windows(2) {
        assert!(matches!(poses.at(pair[0], 0).unwrap(), Found::Exact(_)));
        let middle = pair[0].midpoint(pair[1]);
        if let Found::Between(pose) = poses.at(middle, i64::MAX).unwrap() {
            assert!(pose.quaternion.iter().all(|number| number.is_finite()), "{pose:?}");
        }
    }
    true
}

/// ROS 1 recording.
pub fn bag1(data: &[u8]) -> bool {
    recording(data, "a.bag")
}

/// MCAP recording.
pub fn mcap(data: &[u8]) -> bool {
    recording(data, "a.mcap")
}

fn recording(data: &[u8], name: &str) -> bool {
    with_file(name, data, |path| {
        let paths = [path.to_owned()];
        let Ok(mut recording) = open_recording(&paths) else { return false };
        let topics: Vec<usize> = (0..recording.topics().len()).collect();
        let is_whole = recording.begin(&topics).is_ok() && play(recording.as_mut(), data.len());
        for poses in [PoseSource::Tf, PoseSource::Odometry] {
            let options = BagOptions { poses, ..BagOptions::default() };
            if let Ok(mut clouds) = open_bag(&paths, &options) {
                let stamp_ns = clouds.next_cloud().ok().flatten().and_then(|head| head.stamp_ns);
                if let Some(pose_at) = clouds.poses() {
                    pose_at(stamp_ns.unwrap_or(0).saturating_add(1)).unwrap();
                }
                while let Ok(Some(_)) = clouds.next_cloud() {
                    let _ = clouds.read_points(&mut |_| Ok(()));
                }
                clouds.remarks();
            }
        }
        is_whole && !topics.is_empty()
    })
}

/// Reads all messages. Returns whether there were no errors.
fn play(recording: &mut dyn Recording, bytes: usize) -> bool {
    let (mut is_whole, mut errors) = (true, 0);
    loop {
        match recording.next_message() {
            Ok(None) => break,
            Ok(Some(message)) => assert!(message.topic < recording.topics().len()),
            Err(_) => {
                (is_whole, errors) = (false, errors + 1);
                assert!(errors <= bytes, "{errors} errors");
            }
        }
    }
    recording.remarks();
    is_whole
}

/// `metadata.yaml` of a ROS 2 bag, next to a file without messages.
pub fn bag2_metadata(data: &[u8]) -> bool {
    let folder = TempDir::new().expect("a temporary folder");
    fs::write(folder.path().join("metadata.yaml"), data).expect("a temporary file");
    fs::write(folder.path().join("x_0.mcap"), b"\x89MCAP0\r\n").expect("a temporary file");
    let recording = open_recording(&[folder.path().to_owned()]);
    recording.is_ok_and(|mut recording| play(recording.as_mut(), data.len()))
}

const KINDS: [MessageKind; 13] = [
    MessageKind::PointCloud2,
    MessageKind::LivoxCustom,
    MessageKind::LaserScan,
    MessageKind::Image,
    MessageKind::CameraInfo,
    MessageKind::Tf,
    MessageKind::TransformStamped,
    MessageKind::Odometry,
    MessageKind::PoseStamped,
    MessageKind::PoseWithCovarianceStamped,
    MessageKind::Path,
    MessageKind::PointCloud,
    MessageKind::CompressedImage,
];

/// A message. The first byte selects its kind, and ROS 1 or CDR.
pub fn messages(data: &[u8]) -> bool {
    let Some((&choice, data)) = data.split_first() else { return false };
    let wire = if choice & 1 == 1 { Wire::Cdr } else { Wire::Ros1 };
    let kind = KINDS[usize::from(choice >> 1) % KINDS.len()];
    decode(kind, wire, data).is_ok_and(|points| {
        assert!(points <= data.len(), "{points} points of {} bytes", data.len());
        true
    })
}

/// Returns the first byte of the input of [`messages`] for a kind of message.
pub fn choice(kind: MessageKind, wire: Wire) -> u8 {
    let number = KINDS.iter().position(|known| *known == kind).expect("all kinds are listed");
    (number as u8) << 1 | u8::from(wire == Wire::Cdr)
}

/// Returns the number of points or poses.
fn decode(kind: MessageKind, wire: Wire, data: &[u8]) -> Decoded<usize> {
    Ok(match kind {
        MessageKind::PointCloud2 => {
            let cloud = PointCloud2::decode(wire, data)?;
            cloud.shortage();
            cloud.points().count()
        }
        MessageKind::PointCloud => PointCloud::decode(wire, data)?.points().map_while(Decoded::ok).count(),
        MessageKind::CompressedImage => CompressedDepth::decode(wire, data).map(|_| 0)?,
        MessageKind::LivoxCustom => LivoxCustom::decode(wire, data)?.points().map_while(Decoded::ok).count(),
        MessageKind::LaserScan => LaserScan::decode(wire, data)?.points().count(),
        MessageKind::Image => {
            let image = Image::decode(wire, data)?;
            image.shortage();
            let (focal_px, center_px) = ([500.0; 2], [320.0, 240.0]);
            image.points(&CameraInfo { header: image.header.clone(), focal_px, center_px }).count()
        }
        MessageKind::CameraInfo => CameraInfo::decode(wire, data).map(|_| 0)?,
        _ => decode_poses(kind, wire, data)?.len(),
    })
}

/// Writes the input to a file, because readers take paths. Each thread has its own folder.
fn with_file<T>(name: &str, data: &[u8], read: impl FnOnce(&Path) -> T) -> T {
    thread_local!(static FOLDER: TempDir = TempDir::new().expect("a temporary folder"));
    FOLDER.with(|folder| {
        let path = folder.path().join(name);
        fs::write(&path, data).expect("a temporary file");
        read(&path)
    })
}
