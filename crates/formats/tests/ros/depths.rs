use crate::made::bag1::{BagMessage, bag1};
use crate::made::message::{F32, MessageWriter};
use crate::support::{Cloud, read, topic};
use std::path::PathBuf;
use voxtile_formats::ros::{BagOptions, PoseSource, open_bag};

const IMAGE: &str = "sensor_msgs/Image";
const COMPRESSED: &str = "sensor_msgs/CompressedImage";
const CAMERA: &str = "sensor_msgs/CameraInfo";

/// A recording of topics with one message each.
struct Bag {
    folder: tempfile::TempDir,
    topics: Vec<(String, &'static str)>,
    messages: Vec<BagMessage>,
}

impl Bag {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap(), topics: Vec::new(), messages: Vec::new() }
    }

    fn with(mut self, name: &str, type_name: &'static str, message: Vec<u8>) -> Self {
        self.messages.push((self.topics.len(), 5, message));
        self.topics.push((name.to_owned(), type_name));
        self
    }

    fn camera(self, name: &str) -> Self {
        self.with(name, CAMERA, MessageWriter::ros1().camera(5, "camera", [2.0, 4.0, 0.5, 1.0]))
    }

    fn image(self, name: &str, frame: &str, encoding: &str) -> Self {
        let pixels: Vec<u8> = match encoding {
            "32FC1" => [1.0_f32, f32::NAN].map(f32::to_le_bytes).concat(),
            _ => [1000_u16, 0].map(u16::to_le_bytes).concat(),
        };
        self.with(name, IMAGE, MessageWriter::ros1().image(5, frame, encoding, 2, &pixels))
    }

    fn compressed(self, name: &str, format: &str, data: &[u8]) -> Self {
        self.with(name, COMPRESSED, MessageWriter::ros1().compressed_image(5, "camera", format, data))
    }

    fn points(self) -> Self {
        let fields = [("x", 0, F32), ("y", 4, F32), ("z", 8, F32)];
        let point = [[7.0_f32, 1.0, 2.0].map(f32::to_le_bytes).concat()];
        let cloud = MessageWriter::ros1().point_cloud2(5, "lidar", &fields, &point);
        self.with("/points", "sensor_msgs/PointCloud2", cloud)
    }

    fn path(&self) -> PathBuf {
        let path = self.folder.path().join("a.bag");
        let topics: Vec<(&str, &str)> = self.topics.iter().map(|(name, of)| (name.as_str(), *of)).collect();
        std::fs::write(&path, bag1(&topics, &self.messages)).unwrap();
        path
    }

    fn read(&self, options: BagOptions) -> (Vec<Cloud>, Vec<String>, Vec<String>) {
        read(&[self.path()], &BagOptions { poses: PoseSource::None, ..options })
    }

    fn refusal(&self) -> String {
        open_bag(&[self.path()], &BagOptions::default()).err().map(|error| format!("{error:#}")).unwrap()
    }
}

/// Encodes a PNG with one row.
fn png(bits: png::BitDepth, pixels: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let pixel_bytes = if bits == png::BitDepth::Sixteen { 2 } else { 1 };
    let mut encoder = png::Encoder::new(&mut bytes, (pixels.len() / pixel_bytes) as u32, 1);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(bits);
    encoder.write_header().unwrap().write_image_data(pixels).unwrap();
    bytes
}

fn png16(pixels: &[u16]) -> Vec<u8> {
    png(png::BitDepth::Sixteen, &pixels.iter().flat_map(|pixel| pixel.to_be_bytes()).collect::<Vec<u8>>())
}

/// Returns the header that the transport `compressedDepth` writes before a PNG.
fn config(a: f32, b: f32) -> Vec<u8> {
    [1_u32.to_le_bytes(), a.to_le_bytes(), b.to_le_bytes()].concat()
}

fn depths(clouds: &[Cloud]) -> Vec<Option<f64>> {
    clouds[0].1.iter().map(|point| point.is_return.then_some(point.position_m[2])).collect()
}

#[test]
fn images_named_as_depth_are_depths() {
    for (name, frame, encoding) in [
        ("/camera/depth/image_raw", "camera", "mono16"),
        ("/camera/depth/image_raw", "infra", "16UC1"),
        ("/camera/image_raw", "camera_depth_optical_frame", "mono16"),
        ("/camera/depth/image_raw", "camera", "32FC1"),
    ] {
        let bag = Bag::new()
            .image(name, frame, encoding)
            .camera(&format!("{}/camera_info", &name[..name.len() - 10]));
        let (clouds, errors, remarks) = bag.read(BagOptions::default());
        assert_eq!((errors, remarks), (vec![], vec![]), "{name} {encoding}");
        assert_eq!(depths(&clouds), [Some(1.0), None], "{name} {encoding}");
    }
    // Depth cameras use both encodings; other evidence is missing, so this is a guess.
    for encoding in ["16UC1", "32FC1"] {
        let bag = Bag::new().image("/camera/image_raw", "camera", encoding).camera("/camera/camera_info");
        let (clouds, _, remarks) = bag.read(BagOptions::default());
        assert_eq!(depths(&clouds), [Some(1.0), None]);
        let expected =
            format!("/camera/image_raw is read as depth images because of its encoding {encoding}");
        assert!(remarks[0].starts_with(&expected), "{remarks:?}");
    }
}

#[test]
fn temperature_images_are_not_depths() {
    for (name, frame, encoding) in [
        ("/thermal/image_raw", "camera", "mono16"),
        ("/thermal/image_raw", "camera", "16UC1"),
        ("/flir_boson/image_raw", "camera", "32FC1"),
        ("/camera/image_raw", "thermal_optical_frame", "16UC1"),
        ("/camera/image_raw", "camera", "mono16"),
        ("/depth_camera/ir/image_raw", "depth_camera", "mono16"),
    ] {
        let bag = || {
            Bag::new()
                .image(name, frame, encoding)
                .camera(&format!("{}/camera_info", &name[..name.len() - 10]))
        };
        let error = bag().refusal();
        let expected = format!(
            "images that are not named as depth: {name} ({encoding}); if they are depth images, select"
        );
        assert!(error.contains("no topic contains clouds") && error.contains(&expected), "{error}");
        // If there are clouds too, the images are skipped with a remark.
        let (clouds, _, remarks) = bag().points().read(BagOptions::default());
        assert_eq!(clouds[0].1[0].position_m, [7.0, 1.0, 2.0]);
        assert!(remarks.len() == 1 && remarks[0].contains(&expected), "{remarks:?}");
        // The images are used if their topic is selected.
        let (clouds, errors, remarks) = bag().points().read(topic(name));
        assert_eq!((depths(&clouds), errors), (vec![Some(1.0), None], vec![]), "{name}");
        let expected = format!("{name} ({encoding}) is read as depth images, because it was selected");
        assert_eq!(remarks, [expected]);
    }
}

#[test]
fn largest_value_is_not_a_depth() {
    let pixels = [65535_u16, 65534].map(u16::to_le_bytes).concat();
    let image = MessageWriter::ros1().image(5, "camera", "16UC1", 2, &pixels);
    let bag = Bag::new().with("/depth/image", IMAGE, image).camera("/depth/camera_info");
    assert_eq!(depths(&bag.read(BagOptions::default()).0), [None, Some(65.534)]);
}

#[test]
fn compressed_depths_are_read() {
    // Encoder: value = a / depth + b.
    let (a, b) = (100.0 * 101.0_f32, 1.0 - 100.0 * 101.0 / 10.0);
    let inverse = |depth_m: f32| (a / depth_m + b) as u16;
    let millimetres = png16(&[1500, 0, 65535, 12]);
    let wanted = [Some(1.5), None, None, Some(0.012)];
    // Width and height, then the values in groups of four bits, eight per word: no zero, one value (2 * 1500); one
    // zero, two values (2 * 64035, and 2 * 65523 - 1, which is negative).
    let groups: [u32; 20] =
        [0, 1, 0x8, 0xf, 0xe, 0x5, 1, 2, 0xe, 0x8, 0x9, 0xa, 0xf, 0x3, 0xd, 0xc, 0xf, 0xf, 0xf, 0x3];
    let word = |groups: &[u32]| groups.iter().zip(0..).fold(0, |word, (bits, k)| word | bits << (28 - 4 * k));
    let rvl: Vec<u8> =
        [4, 1].into_iter().chain(groups.chunks(8).map(word)).flat_map(u32::to_le_bytes).collect();
    for (name, format, data) in [
        (
            "/depth/image/compressedDepth",
            "16UC1; compressedDepth",
            [config(0.0, 0.0), millimetres.clone()].concat(),
        ),
        (
            "/depth/image/compressedDepth",
            "16UC1; compressedDepth png",
            [config(7.0, 7.0), millimetres.clone()].concat(),
        ),
        ("/depth/image/compressedDepth", "16UC1; compressedDepth rvl", [config(0.0, 0.0), rvl].concat()),
        ("/depth/image/compressed", "16UC1; png compressed ", millimetres.clone()),
        ("/depth/image/compressed", "png", millimetres.clone()),
    ] {
        let bag = Bag::new().compressed(name, format, &data).camera("/depth/camera_info");
        let (clouds, errors, remarks) = bag.read(BagOptions::default());
        assert_eq!((depths(&clouds), errors, remarks), (wanted.to_vec(), vec![], vec![]), "{format}");
        assert_eq!(clouds[0].0.points, Some(4));
        let second = clouds[0].1[0].position_m;
        assert_eq!(second, [(0.0 - 0.5) / 2.0 * 1.5, (0.0 - 1.0) / 4.0 * 1.5, 1.5]);
    }
    let data = [config(a, b), png16(&[inverse(2.0), 0, inverse(0.5)])].concat();
    let bag = Bag::new().compressed("/depth/image/compressedDepth", "32FC1; compressedDepth png", &data);
    let (clouds, errors, _) = bag.camera("/depth/camera_info").read(BagOptions::default());
    let found = depths(&clouds);
    assert_eq!((found.len(), found[1], errors), (3, None, vec![]));
    let near = |found: Option<f64>, wanted: f64| (found.unwrap() - wanted).abs() < 1e-3;
    assert!(near(found[0], 2.0) && near(found[2], 0.5), "{found:?}");
}

#[test]
fn compressed_images_without_depths_report_the_reason() {
    let png8 = png(png::BitDepth::Eight, &[1, 2]);
    let whole = png16(&[1; 4]);
    let cut = [config(0.0, 0.0), whole[..whole.len() - 26].to_vec()].concat();
    for (format, data, expected) in [
        (
            "rgb8; jpeg compressed bgr8",
            b"\xff\xd8\xff\xe0....".to_vec(),
            "is neither PNG nor RVL (format `rgb8; jpeg",
        ),
        ("16UC1; compressedDepth rvl", [config(0.0, 0.0), vec![1, 2, 3]].concat(), "is neither PNG nor RVL"),
        ("16UC1; compressedDepth rvl", [config(0.0, 0.0), vec![255; 12]].concat(), "pixels; at most"),
        (
            "16UC1; compressedDepth rvl",
            [config(0.0, 0.0), vec![1, 0, 0, 0, 2, 0, 0, 0]].concat(),
            "row 0 of 2 is truncated",
        ),
        ("32FC1; compressedDepth png", [config(f32::NAN, 0.0), png16(&[1])].concat(), "the depth parameters"),
        (
            "bgr8; compressedDepth png",
            [config(0.0, 0.0), png16(&[1])].concat(),
            "the pixel encoding is `bgr8`",
        ),
        ("mono8; png compressed", png8, "16-bit grey"),
        ("16UC1; compressedDepth", cut, "row 0 of 1 of its PNG"),
        ("16UC1; compressedDepth", vec![], "is neither PNG nor RVL"),
    ] {
        let name = "/depth/image/compressedDepth";
        let bag = Bag::new().compressed(name, format, &data).camera("/depth/camera_info");
        let (_, errors, _) = bag.read(topic(name));
        assert!(errors.len() == 1 && errors[0].contains(expected), "{errors:?} {expected}");
    }
    // Colour images are not a second topic of clouds, and neither is the same depth image in another encoding.
    let depth = [config(0.0, 0.0), png16(&[2000])].concat();
    let bag = Bag::new()
        .compressed("/color/image/compressed", "rgb8; jpeg compressed bgr8", b"\xff\xd8\xff\xe0")
        .camera("/color/camera_info")
        .compressed("/depth/image/compressed", "16UC1; png compressed", &png16(&[2000]))
        .compressed("/depth/image/compressedDepth", "16UC1; compressedDepth", &depth)
        .camera("/depth/camera_info");
    let (clouds, errors, remarks) = bag.read(BagOptions::default());
    assert_eq!((depths(&clouds), errors, remarks), (vec![Some(2.0)], vec![], vec![]));
    let bag = bag.image("/depth/image", "camera", "16UC1");
    let (clouds, _, remarks) = bag.read(BagOptions::default());
    assert_eq!((depths(&clouds), remarks), (vec![Some(1.0), None], vec![]));
    // Points are preferred to compressed depth images.
    let bag =
        Bag::new().points().compressed("/depth/image/compressedDepth", "16UC1; compressedDepth", &depth);
    let (clouds, _, remarks) = bag.camera("/depth/camera_info").read(BagOptions::default());
    assert_eq!(clouds[0].1[0].position_m, [7.0, 1.0, 2.0]);
    assert!(
        remarks[0]
            .starts_with("/points is read; other topics can be chosen with `topic` NAME: /depth/image/c"),
        "{remarks:?}"
    );
}

#[test]
fn missing_requirements_are_reported() {
    let error = Bag::new().image("/depth/image", "camera", "16UC1").refusal();
    assert!(error.contains("of type CameraInfo: /depth/image without /depth/camera_info"), "{error}");
    for (type_name, expected) in [
        (
            "velodyne_msgs/VelodyneScan",
            "/packets contains no points: convert it to clouds with velodyne_pointcloud",
        ),
        ("ouster_ros/PacketMsg", "convert it to clouds with ouster_ros"),
    ] {
        let error = Bag::new().with("/packets", type_name, vec![0; 20]).refusal();
        assert!(error.contains(expected), "{error}");
        let bag = Bag::new().with("/packets", type_name, vec![0; 20]).points();
        let error = open_bag(&[bag.path()], &topic("/packets")).err().map(|error| format!("{error:#}"));
        assert!(error.as_ref().is_some_and(|error| error.contains(expected)), "{error:?}");
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.bag");
    let no_message = "it contains no messages; topics: /points";
    for (topics, expected) in [(vec![], "it contains no topics"), (vec![("/points", "x/Y")], no_message)] {
        std::fs::write(&path, bag1(&topics, &[])).unwrap();
        let error = open_bag(std::slice::from_ref(&path), &BagOptions::default())
            .err()
            .map(|error| format!("{error:#}"));
        assert!(error.as_ref().is_some_and(|error| error.contains(expected)), "{error:?}");
    }
}
