use crate::made::voxels::format_of;
use crate::support::{all, clouds, clouds_with, failure, fixture, shared_data, wanted};
use std::fs;
use voxtile_formats::CloudPoint;
use voxtile_formats::write::{VoxelsHead, WriteOptions};
use voxtile_formats::{ReadOptions, open_clouds};

fn one_cloud() -> ReadOptions {
    ReadOptions { scan_period_s: 0.0, ..ReadOptions::default() }
}

fn assert_near(found: &[CloudPoint], wanted: &[CloudPoint], what: &str) {
    assert_eq!(found.len(), wanted.len(), "{what}");
    for (found, wanted) in found.iter().zip(wanted) {
        let is_near = |k: usize| (found.position_m[k] - wanted.position_m[k]).abs() < 1e-6;
        assert!((0..3).all(is_near) && found.intensity == wanted.intensity, "{what}: {found:?} {wanted:?}");
    }
}

/// Expected by construction: for even k, points k and k + 1 were measured at 3e8 + k / 32 s, in any order in the file.
/// Windows of 0.1 s contain the points 0 1, 2 3, 4, 5 6, 7, 8 9.
#[test]
fn files_are_split_into_scans_by_time() {
    for name in ["timed.las", "timed.laz"] {
        for memory_bytes in [0, 1 << 20] {
            let clouds = clouds_with(&fixture(name), &ReadOptions { memory_bytes, ..Default::default() });
            let names: Vec<&str> = clouds.iter().map(|(head, _)| head.name.as_str()).collect();
            assert_eq!(names, ["0", "1", "2", "3", "4", "5"], "{name}");
            // The first window ends at 0.1 s and contains times 0 and 0.0625. Adjusted GPS time adds 1e9 s.
            assert_eq!(clouds[0].0.stamp_ns, Some(1_300_000_000_050_000_000));
            let counts: Vec<usize> = clouds.iter().map(|(_, points)| points.len()).collect();
            assert_eq!(counts, [4, 4, 2, 4, 2, 4], "{name}");
            let times: Vec<f64> = clouds[0].1.iter().map(|point| point.time_s).collect();
            for (found, wanted) in times.iter().zip([-0.05, -0.05, 0.0125, 0.0125]) {
                assert!((found - wanted).abs() < 1e-6, "{times:?}");
            }
            let mut points: Vec<CloudPoint> = clouds.into_iter().flat_map(|(_, points)| points).collect();
            // Two points with equal times are in any order.
            for pair in points.chunks_mut(2) {
                pair.sort_by(|a, b| a.intensity.total_cmp(&b.intensity));
            }
            assert_near(&points, &wanted([600_000.0, 5_000_000.0, 100.0]), name);
        }
    }
}

#[test]
fn unread_scans_are_skipped() {
    let mut source = open_clouds(&fixture("timed.laz"), &ReadOptions::default()).unwrap();
    let mut heads = 0;
    while source.next_cloud().unwrap().is_some() {
        heads += 1;
    }
    assert_eq!(heads, 6);
}

#[test]
fn feet_are_converted_on_each_axis() {
    let us_foot = 1200.0 / 3937.0;
    for (name, flat) in [("feet.las", 0.3048), ("survey_feet.las", us_foot)] {
        let mut source = open_clouds(&fixture(name), &ReadOptions::default()).unwrap();
        let clouds = all(source.as_mut()).unwrap();
        let mut points = wanted([600_000.0, 5_000_000.0, 100.0]);
        for point in &mut points {
            let [x, y, z] = point.position_m;
            point.position_m = [x * flat, y * flat, z];
        }
        assert_near(&clouds[0].1, &points, name);
        let remarks = source.remarks();
        assert!(remarks[0].contains("coordinates are converted to metres"), "{remarks:?}");
        // The coordinates read are no longer in the file's system.
        assert_eq!(source.crs(), None, "{name}");
        assert!(remarks[1].starts_with("the coordinate system is not in metres"), "{remarks:?}");
    }
}

#[test]
fn withheld_points_are_skipped() {
    let mut source = open_clouds(&fixture("withheld.laz"), &one_cloud()).unwrap();
    let clouds = all(source.as_mut()).unwrap();
    let mut points = wanted([600_000.0, 5_000_000.0, 100.0]);
    points.drain(3..5);
    assert_near(&clouds[0].1, &points, "withheld");
    assert!(source.remarks()[0].starts_with("2 points are marked as withheld"), "{:?}", source.remarks());
}

#[test]
fn given_ray_origin_gives_one_cloud() {
    let options =
        ReadOptions { sensor_origin_m: Some([600_000.0, 5_000_000.0, 100.0]), ..Default::default() };
    let clouds = clouds_with(&fixture("feet.las"), &options);
    assert_eq!(clouds.len(), 1);
    let clouds = clouds_with(&fixture("timed.laz"), &options);
    assert_eq!((clouds.len(), clouds[0].1.len()), (1, 20));
    assert!(clouds[0].1.iter().all(|point| point.position_m[0].abs() < 10.0));
}

#[test]
fn truncated_files_give_complete_points() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.las");
    let bytes = fs::read(fixture("timed.las")).unwrap();
    fs::write(&path, &bytes[..bytes.len() - 29]).unwrap();
    for options in [one_cloud(), ReadOptions::default()] {
        let mut source = open_clouds(&path, &options).unwrap();
        let points: usize = all(source.as_mut()).unwrap().iter().map(|(_, points)| points.len()).sum();
        assert_eq!(points, 18);
        assert_eq!(source.remarks(), ["the file is truncated: 18 of 20 points exist and are read"]);
    }
}

/// Writes a point count into a header, which has two of them in LAS 1.4.
fn announce(bytes: &mut [u8], points: u64) {
    bytes[107..111].copy_from_slice(&(points as u32).to_le_bytes());
    if bytes[25] >= 4 {
        bytes[247..255].copy_from_slice(&points.to_le_bytes());
    }
}

/// A recorder writes the point count last.
#[test]
fn files_of_killed_writers_are_read_to_their_end() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("killed.las");
    let whole = fs::read(fixture("timed.las")).unwrap();
    for (announced, cut, points, remark) in [
        (0, 5, 19, "announces no points, because its writer was interrupted: the 19 "),
        (0, 20 * 28, 0, ""),
        (15, 0, 20, "announces 15 points; 20 exist and are read"),
        (20, 0, 20, ""),
    ] {
        let mut bytes = whole[..whole.len() - cut].to_vec();
        announce(&mut bytes, announced);
        fs::write(&path, &bytes).unwrap();
        for options in [one_cloud(), ReadOptions::default()] {
            let mut source = open_clouds(&path, &options).unwrap();
            let clouds = all(source.as_mut()).unwrap();
            let found: usize = clouds.iter().map(|(_, points)| points.len()).sum();
            let remarks = source.remarks().join("\n");
            assert!(found == points && remarks.contains(remark), "{announced}: {found} {remarks}");
            assert_eq!(remarks.is_empty(), remark.is_empty(), "{remarks}");
        }
    }
}

/// Data after the points is not a point: wave packets of LAS 1.3, extended records of LAS 1.4.
#[test]
fn records_after_points_are_not_points() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("records.las");
    for place in [227, 235] {
        let mut bytes = fs::read(fixture("feet.las")).unwrap();
        let points_at = u64::from(u32::from_le_bytes(bytes[96..100].try_into().unwrap()));
        announce(&mut bytes, 0);
        bytes[place..place + 8].copy_from_slice(&(points_at + 12 * 30).to_le_bytes());
        fs::write(&path, &bytes).unwrap();
        assert_eq!(clouds(&path)[0].1.len(), 12, "{place}");
    }
}

/// A complete LAZ file without points must not be taken for an interrupted one.
#[test]
fn compressed_files_may_be_empty() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("empty.laz");
    let head = VoxelsHead::of_stream(0, 0.5);
    let sink = format_of("laz").open(&head, &path, &WriteOptions::for_path(&path)).unwrap();
    sink.finish().unwrap();
    assert_eq!(clouds(&path).iter().map(|(_, points)| points.len()).sum::<usize>(), 0);
}

/// Found by fuzzing: coordinates were NaN but counted as returns.
#[test]
fn scales_and_offsets_must_give_coordinates() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damaged.las");
    let bytes = fs::read(fixture("timed.las")).unwrap();
    for (at, value, what) in [
        (131, f64::NAN, "offset 131: the scale of x is NaN"),
        (147, 0.0, "offset 147: the scale of z is 0"),
        (163, f64::INFINITY, "offset 163: the offset of y is inf"),
    ] {
        let mut damaged = bytes.clone();
        damaged[at..at + 8].copy_from_slice(&value.to_le_bytes());
        fs::write(&path, &damaged).unwrap();
        let (error, points) = failure(&path, &ReadOptions::default());
        assert!(points == 0 && error.contains(what), "{error}");
    }
}

#[test]
fn damage_never_panics() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["timed.las", "timed.laz", "feet.las", "survey_feet.las"] {
        let bytes = fs::read(fixture(name)).unwrap();
        for at in (0..bytes.len()).step_by(23) {
            for flip in [0xff_u8] {
                let mut damaged = bytes.clone();
                damaged[at] ^= flip;
                let path = folder.path().join(name);
                fs::write(&path, &damaged).unwrap();
                if let Ok(mut source) = open_clouds(&path, &ReadOptions::default()) {
                    // A gap of hours without points is skipped in one step.
                    for _ in 0..50 {
                        match source.next_cloud() {
                            Ok(Some(_)) => drop(source.read_points(&mut |_| Ok(()))),
                            Ok(None) => break,
                            Err(_) => {}
                        }
                    }
                }
            }
        }
    }
}

type Sums = (&'static str, usize, [f64; 3], f64, [f64; 2]);
const FT: f64 = 1200.0 / 3937.0;
const LASPY: [Sums; 8] = [
    (
        "autzen_trim.las",
        110000,
        [70020104544.61, 93406036431.28, 47337127.730000004],
        11220547.0,
        [0.3048; 2],
    ),
    (
        "autzen_trim.laz",
        110000,
        [70020104544.61, 93406036431.28, 47337127.730000004],
        11220547.0,
        [0.3048; 2],
    ),
    (
        "certainty3d-color-utm-feet-navd88.las",
        10126,
        [64083393715.56996, 20954059642.2831, 28897394.740343627],
        8902430.0,
        [FT; 2],
    ),
    ("lidR_Megaplot.laz", 81590, [55879288878.380005, 409410433749.01, 1082864.1], 1878418.0, [1.0; 2]),
    (
        "lidR_Topography.laz",
        73403,
        [20076894310.32075, 387163805581.34076, 59389154.98625],
        63213441.0,
        [1.0; 2],
    ),
    ("loadersgl_indoor.laz", 808042, [-5781227.5, 2379069.97, 3102581.71], 0.0, [1.0; 2]),
    ("lone-star.laz", 518862, [267417386868.5165, 2551953195888.609, 1208260675.9405], 562919835.0, [1.0; 2]),
    ("pdal_4_6_crop.las", 23875, [39147701499.18, 34728463766.2, 169401233.96], 439166.0, [FT; 2]),
];

/// Expected values: number of points, and sums of x, y, z (in the unit of the file) and intensity, from laspy 2.7 with
/// lazrs.
#[test]
fn real_files_are_what_laspy_reads() {
    let Some(folder) = shared_data("las_large_coords") else { return };
    for (name, count, sums, intensities, metres) in LASPY {
        let mut source = open_clouds(&folder.join(name), &one_cloud()).unwrap();
        let clouds = all(source.as_mut()).unwrap();
        let points = &clouds[0].1;
        assert_eq!(points.len(), count, "{name}");
        for (axis, sum) in sums.into_iter().enumerate() {
            let unit = metres[usize::from(axis == 2)];
            let found: f64 = points.iter().map(|point| point.position_m[axis]).sum();
            assert!((found / unit / sum - 1.0).abs() < 1e-11, "{name}: axis {axis}: {found} {sum}");
        }
        assert_eq!(points.iter().map(|point| f64::from(point.intensity)).sum::<f64>(), intensities, "{name}");
        let scans =
            clouds_with(&folder.join(name), &ReadOptions { memory_bytes: 1 << 20, ..Default::default() });
        assert_eq!(scans.iter().map(|(_, points)| points.len()).sum::<usize>(), count, "{name}");
    }
    assert_eq!(clouds(&folder.join("loadersgl_indoor.laz")).len(), 1);
}
