use crate::support::{clouds, clouds_with, failure, shared_data};
use std::fs::{self, File};
use std::path::Path;
use voxtile::scan::AttributeSet;
use voxtile_formats::ReadOptions;
use voxtile_formats::read::Intrinsics;

fn image(path: &Path, width: u32, depths: &[u16]) {
    let mut encoder = png::Encoder::new(File::create(path).unwrap(), width, depths.len() as u32 / width);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let bytes: Vec<u8> = depths.iter().flat_map(|depth| depth.to_be_bytes()).collect();
    encoder.write_header().unwrap().write_image_data(&bytes).unwrap();
}

#[test]
fn seven_scenes_data_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    image(&at("frame-000000.depth.png"), 2, &[2000, 0, 65535, 500]);
    image(&at("frame-000001.depth.png"), 2, &[0; 4]);
    fs::write(at("frame-000000.color.png"), "not looked at").unwrap();
    fs::write(at("camera-intrinsics.txt"), "100 0 1\n0 200 0.5\n0 0 1\n").unwrap();
    fs::write(at("frame-000000.pose.txt"), "0 -1 0 7\n1 0 0 8\n0 0 1 9\n0 0 0 1\n").unwrap();
    fs::write(at("frame-000001.pose.txt"), "-1.#IND ".repeat(16)).unwrap();
    let clouds = clouds(folder.path());
    assert_eq!(clouds.len(), 2);
    let (head, points) = &clouds[0];
    let pose = head.world_from_sensor.unwrap();
    assert_eq!(pose.position_m, [7.0, 8.0, 9.0]);
    // A quarter turn about z: the camera's x is the world's y.
    let turned = pose.apply([1.0, 0.0, 0.0]);
    assert!((turned[0] - 7.0).abs() < 1e-12 && (turned[1] - 9.0).abs() < 1e-12, "{turned:?}");
    let found: Vec<_> = points.iter().map(|point| (point.position_m, point.is_return)).collect();
    let wanted = [
        ([-0.02, -0.005, 2.0], true),
        ([0.0, -0.0025, 1.0], false),
        ([-0.01, 0.0025, 1.0], false),
        ([0.0, 0.00125, 0.5], true),
    ];
    for ((found, is_return), (wanted, is_hit)) in found.iter().zip(wanted) {
        assert!(found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?} {wanted:?}");
        assert_eq!(*is_return, is_hit);
    }
    assert_eq!(clouds[1].0.world_from_sensor, None);
}

#[test]
fn tum_data_has_a_list_and_a_scale_of_5000() {
    // A camera file is also searched for next to the folder.
    let outer = tempfile::tempdir().unwrap();
    let folder = outer.path().join("folder");
    fs::create_dir_all(folder.join("depth")).unwrap();
    image(&folder.join("depth/b.png"), 1, &[5000, 65535]);
    fs::write(folder.join("depth.txt"), "# depth maps\n1305031453.374112 depth/b.png\n").unwrap();
    let (error, _) = failure(&folder, &ReadOptions::default());
    assert!(error.contains("fx fy cx cy"), "{error}");
    let intrinsics = Some(Intrinsics::new([525.0, 525.0, 319.5, 239.5]).unwrap());
    let clouds = clouds_with(&folder, &ReadOptions { intrinsics, ..Default::default() });
    assert_eq!(clouds[0].0.stamp_ns, Some(1_305_031_453_374_112_000));
    let depths: Vec<_> = clouds[0].1.iter().map(|point| (point.position_m[2], point.is_return)).collect();
    // The largest value means no return.
    assert_eq!(depths, [(1.0, true), (1.0, false)]);
}

#[test]
fn invalid_lines_of_the_list_are_skipped() {
    let folder = tempfile::tempdir().unwrap();
    let options = ReadOptions {
        intrinsics: Some(Intrinsics::new([525.0, 525.0, 319.5, 239.5]).unwrap()),
        format: Some("tum-rgbd".into()),
        ..Default::default()
    };
    image(&folder.path().join("1.png"), 1, &[5000]);
    let list = folder.path().join("depth.txt");
    fs::write(&list, "# depth maps\nnan 1.png\n// a comment\n1.png\n12.5 1.png\n").unwrap();
    let mut source = voxtile_formats::open_clouds(folder.path(), &options).unwrap();
    let clouds = crate::support::all(&mut *source).unwrap();
    assert_eq!(clouds.iter().map(|(head, _)| head.stamp_ns).collect::<Vec<_>>(), [Some(12_500_000_000)]);
    let remarks = source.remarks();
    assert!(
        remarks.len() == 1 && remarks[0].starts_with("2 lines are invalid and skipped, the first: "),
        "{remarks:?}"
    );
    assert!(remarks[0].contains("line 2: `nan` is not a time stamp"), "{remarks:?}");
    fs::write(&list, "nan 1.png\n").unwrap();
    let (error, points) = failure(folder.path(), &options);
    assert!(error.contains("line 1: `nan` is not a time stamp") && points == 0, "{error}");
}

/// An untrusted list must not open arbitrary files.
#[test]
fn images_outside_of_the_folder_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("set");
    fs::create_dir(&inner).unwrap();
    image(&folder.path().join("1.png"), 1, &[5000]);
    let options = ReadOptions {
        intrinsics: Some(Intrinsics::new([525.0, 525.0, 319.5, 239.5]).unwrap()),
        format: Some("tum-rgbd".into()),
        ..Default::default()
    };
    for name in ["../1.png".to_owned(), folder.path().join("1.png").display().to_string()] {
        fs::write(inner.join("depth.txt"), format!("# depth maps\n1305031453.374112 {name}\n")).unwrap();
        let (error, points) = failure(&inner, &options);
        assert!(
            error.contains("depth.txt: malformed: line 2") && error.contains("is outside of the folder"),
            "{error}"
        );
        assert_eq!(points, 0);
    }
}

#[test]
fn other_images_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("1.png");
    let intrinsics = Some(Intrinsics::new([1.0, 1.0, 0.0, 0.0]).unwrap());
    let options = ReadOptions { intrinsics, ..Default::default() };
    let encoder = png::Encoder::new(File::create(&path).unwrap(), 1, 1);
    encoder.write_header().unwrap().write_image_data(&[9]).unwrap();
    let (error, _) = failure(folder.path(), &options);
    assert!(error.contains("is not a depth image"), "{error}");
    let depths: Vec<u16> = (0..40_000_u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 16) as u16).collect();
    image(&path, 100, &depths);
    let whole = fs::read(&path).unwrap();
    fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    let (error, points) = failure(folder.path(), &options);
    assert!(error.contains("of 400") && points > 0 && points < 40_000, "{error} after {points}");
}

#[test]
fn real_depth_images() {
    let Some(folder) = shared_data("sevenscenes_kinect") else { return };
    let mut source = voxtile_formats::open_clouds(&folder.join("scans"), &ReadOptions::default()).unwrap();
    assert_eq!(source.len_hint(), Some(100));
    let head = source.next_cloud().unwrap().unwrap();
    assert_eq!((head.name.as_str(), head.points), ("000000.depth.png", Some(640 * 480)));
    let (mut hits, mut far) = (0, 0.0_f64);
    source
        .read_points(&mut |point| {
            hits += u32::from(point.is_return);
            far = far.max(if point.is_return { point.position_m[2] } else { 0.0 });
            Ok(())
        })
        .unwrap();
    assert!(hits > 200_000 && far > 1.0 && far < 10.0, "{hits} {far}");
}

#[cfg(unix)]
#[test]
fn fifos_among_depth_images_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let fifo = |name: &str| {
        assert!(std::process::Command::new("mkfifo").arg(at(name)).status().unwrap().success());
    };
    image(&at("frame-000000.depth.png"), 1, &[2000]);
    fifo("camera-intrinsics.txt");
    let (error, _) = failure(folder.path(), &ReadOptions::default());
    assert!(error.contains("camera-intrinsics.txt: is a FIFO"), "{error}");
    fs::remove_file(at("camera-intrinsics.txt")).unwrap();
    fs::write(at("camera-intrinsics.txt"), "100 0 1\n0 200 0.5\n0 0 1\n").unwrap();
    fifo("frame-000000.pose.txt");
    let (error, _) = failure(folder.path(), &ReadOptions::default());
    assert!(error.contains("frame-000000.pose.txt: is a FIFO"), "{error}");
    // Only formats that are read in one pass may be a FIFO.
    for (name, is_hinted) in [("a.ply", true), ("b.e57", false)] {
        fifo(name);
        let (error, _) = failure(&at(name), &ReadOptions::default());
        assert!(error.contains("is a FIFO") && error.contains("`format`") == is_hinted, "{error}");
    }
}

fn colour_image(path: &Path, width: u32, color: png::ColorType, bytes: &[u8]) {
    let pixel_bytes = color.samples() as u32;
    let height = bytes.len() as u32 / pixel_bytes / width;
    let mut encoder = png::Encoder::new(File::create(path).unwrap(), width, height);
    encoder.set_color(color);
    encoder.write_header().unwrap().write_image_data(bytes).unwrap();
}

fn with_colours() -> ReadOptions {
    ReadOptions {
        intrinsics: Some(Intrinsics::new([525.0, 525.0, 319.5, 239.5]).unwrap()),
        attributes: AttributeSet { colours: true, classes: false, ..AttributeSet::NONE },
        ..Default::default()
    }
}

/// Colours of the points of an image.
type Colours = Vec<Option<[u8; 3]>>;

fn colours_of(folder: &Path, options: &ReadOptions) -> (Vec<Colours>, Vec<String>) {
    let mut source = voxtile_formats::open_clouds(folder, options).unwrap();
    let clouds = crate::support::all(source.as_mut()).unwrap();
    let of = |(head, points): &crate::support::Cloud| {
        let colours: Vec<_> = points.iter().map(|point| point.colour).collect();
        assert_eq!(head.attributes.colours, colours.iter().any(Option::is_some));
        colours
    };
    (clouds.iter().map(of).collect(), source.remarks())
}

#[test]
fn pixels_of_seven_scenes_have_the_colours_of_their_image() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    for number in 0..3 {
        image(&at(&format!("frame-00000{number}.depth.png")), 2, &[2000, 0, 65535, 500]);
    }
    let rgb: Vec<u8> = (1..=12).collect();
    colour_image(&at("frame-000000.color.png"), 2, png::ColorType::Rgb, &rgb);
    colour_image(&at("frame-000001.color.png"), 2, png::ColorType::Grayscale, &[9, 8, 7, 6]);
    let (colours, remarks) = colours_of(folder.path(), &with_colours());
    assert_eq!(colours[0], [[1, 2, 3], [4, 5, 6], [7, 8, 9], [10, 11, 12]].map(Some));
    assert_eq!(colours[1], [[9; 3], [8; 3], [7; 3], [6; 3]].map(Some));
    assert_eq!(colours[2], [None; 4]);
    assert!(remarks.iter().any(|remark| remark.starts_with("1 depth images have no colour")), "{remarks:?}");
    let without = ReadOptions { attributes: AttributeSet::NONE, ..with_colours() };
    assert_eq!(colours_of(folder.path(), &without).0, [[None; 4]; 3]);
    // Images of other sizes, and files that are not images.
    colour_image(&at("frame-000000.color.png"), 1, png::ColorType::Rgb, &rgb);
    let (error, points) = failure(folder.path(), &with_colours());
    assert!(error.contains("frame-000000.color.png: malformed: ") && points == 0, "{error}");
    assert!(
        error.contains("has 1 x 4 pixels, but the depth image") && error.contains("has 2 x 2"),
        "{error}"
    );
    fs::write(at("frame-000000.color.png"), "no image").unwrap();
    assert!(failure(folder.path(), &with_colours()).0.contains("frame-000000.color.png: malformed: "));
}

#[test]
fn pixels_of_tum_data_have_the_colours_of_the_nearest_image() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    image(&at("depth.png"), 1, &[5000, 5000]);
    for shade in [1, 2, 3] {
        colour_image(&at(&format!("{shade}.png")), 1, png::ColorType::Rgba, &[shade; 8]);
    }
    // The last two depth images are not in order of time.
    let depths = "10.00 depth.png\n10.05 depth.png\n10.5 depth.png\n11 depth.png\n10.051 depth.png\n";
    fs::write(at("depth.txt"), depths).unwrap();
    let list =
        "# colours\n10.01 1.png\nno line\n10.04 2.png\n10.06 ../3.png\n10.061 3.png\n11.0200001 3.png\n";
    fs::write(at("rgb.txt"), list).unwrap();
    let (colours, remarks) = colours_of(folder.path(), &with_colours());
    let shades: Vec<Option<u8>> = colours.iter().map(|image| image[1].map(|colour| colour[2])).collect();
    assert_eq!(shades, [Some(1), Some(2), None, None, Some(3)]);
    assert!(remarks[0].starts_with("2 depth images have no colour image"), "{remarks:?}");
}
