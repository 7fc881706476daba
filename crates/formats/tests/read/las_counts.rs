use crate::made::las::{Las, Packing};
use crate::support::{all, failure};
use std::fs;
use voxtile_formats::{ReadOptions, open_clouds};

/// Ways to read a file: split by time, as one cloud, and as one cloud with an origin.
fn ways() -> [ReadOptions; 3] {
    [
        ReadOptions::default(),
        ReadOptions { scan_period_s: 0.0, ..ReadOptions::default() },
        ReadOptions { sensor_origin_m: Some([500_000.0, 4_180_000.0, 0.0]), ..ReadOptions::default() },
    ]
}

/// Reads a file and checks that its points are the first ones of `las`. Returns their number and the remarks.
fn read(las: &Las, bytes: &[u8]) -> (usize, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.las");
    fs::write(&path, bytes).unwrap();
    let mut outcomes = ways().map(|options| {
        let mut source = open_clouds(&path, &options).unwrap_or_else(|error| panic!("{error:#}"));
        let clouds = all(source.as_mut()).unwrap_or_else(|error| panic!("{error:#}"));
        let points: Vec<_> = clouds.into_iter().flat_map(|(_, points)| points).collect();
        let origin = options.sensor_origin_m.unwrap_or_default();
        for (k, point) in points.iter().enumerate() {
            let place = las.place(k);
            let wanted: [f64; 3] = std::array::from_fn(|axis| place[axis] - origin[axis]);
            assert_eq!((point.position_m, point.intensity), (wanted, k as f32));
        }
        (points.len(), source.remarks().join("\n"))
    });
    assert!(outcomes.windows(2).all(|pair| pair[0] == pair[1]), "{outcomes:?}");
    std::mem::take(&mut outcomes[0])
}

fn refusal(bytes: &[u8]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.las");
    fs::write(&path, bytes).unwrap();
    ways().map(|options| failure(&path, &options).0).into_iter().next().unwrap()
}

/// LASzip and laspy use the 64-bit count; the old field may contain any value.
#[test]
fn matching_point_count_is_used() {
    for (legacy, large, remark) in [
        (100, 400, "two point counts, 100 and 400: 400 points exist"),
        (400, 100, "two point counts, 400 and 100: 400 points exist"),
        (400, 1 << 60, "two point counts, 400 and 1152921504606846976: 400 points exist"),
        (400, 0, ""),
        (0, 400, ""),
        (400, 400, ""),
    ] {
        let las = Las { legacy, large, ..Las::new(4, 6, 400) };
        for bytes in [las.bytes(), las.packed(Packing::Chunked(50_000)), las.packed(Packing::Chunked(100))] {
            let (points, remarks) = read(&las, &bytes);
            assert!(points == 400 && remarks.contains(remark), "{legacy} {large}: {points} {remarks}");
            assert_eq!(remarks.is_empty(), remark.is_empty(), "{remarks}");
        }
    }
}

#[test]
fn points_after_the_announced_ones_are_read() {
    let las = Las { legacy: 100, ..Las::new(2, 1, 400) };
    let announced = "the header announces 100 points";
    let (points, remarks) = read(&las, &las.bytes());
    assert!(points == 400 && remarks == format!("{announced}; 400 exist and are read"), "{remarks}");
    // Zeros and other bytes after the points are not points.
    for noise in [vec![0; 28 * 50], (0..28 * 50).map(|k| (k * 37 % 251) as u8).collect()] {
        let whole = Las::new(2, 1, 100);
        let (points, remarks) = read(&whole, &[whole.bytes(), noise].concat());
        let wanted = format!("{announced}, which are read; the file has space for 50 more after them");
        assert!(points == 100 && remarks == wanted, "{points} {remarks}");
    }
    // Compressed points are counted by their chunks if these are layered.
    let las = Las { large: 100, ..Las::new(4, 6, 400) };
    let (points, remarks) = read(&las, &las.packed(Packing::Chunked(50_000)));
    assert!(points == 400 && remarks == format!("{announced}; 400 exist and are read"), "{remarks}");
    let las = Las { legacy: 100, ..Las::new(2, 1, 400) };
    let (points, remarks) = read(&las, &las.packed(Packing::Chunked(150)));
    assert!(points == 100 && remarks.contains("the chunks contain 301 or more"), "{remarks}");
}

#[test]
fn truncated_files_are_read_to_their_end() {
    for (minor, format) in [(2, 1), (4, 6)] {
        let las = Las::new(minor, format, 400);
        let whole = las.bytes();
        let cut = &whole[..whole.len() - 60 * las.point_bytes() - 5];
        let (points, remarks) = read(&las, cut);
        let wanted = "the file is truncated: 339 of 400 points exist and are read";
        assert!(points == 339 && remarks == wanted, "{points} {remarks}");
        let error = refusal(&whole[..las.head(false).len() + 10]);
        assert!(error.contains("the file ends before the first of 400 points"), "{error}");
    }
}

/// A truncated file has no chunk table.
#[test]
fn compressed_points_are_read_without_the_chunk_table() {
    // Point-wise compression: all points before the cut.
    let las = Las::new(2, 1, 400);
    for packing in [Packing::Chunked(100), Packing::Chunked(50_000), Packing::PointWise] {
        let whole = las.packed(packing);
        let (points, remarks) = read(&las, &whole);
        assert_eq!((points, remarks.as_str()), (400, ""), "{packing:?}");
        let (points, remarks) = read(&las, &whole[..whole.len() - whole.len() / 4]);
        assert!((200..400).contains(&points), "{packing:?}: {points}");
        assert_eq!(remarks, format!("the file is truncated: {points} of 400 points exist and are read"));
    }
    // Layered compression: whole chunks.
    let las = Las::new(4, 6, 400);
    let whole = las.packed(Packing::Chunked(100));
    let (points, remarks) = read(&las, &whole[..whole.len() - whole.len() / 4]);
    assert!(points == 200 && remarks.contains("truncated: 200 of 400 points"), "{points} {remarks}");
    let (points, remarks) = read(&las, &whole[..whole.len() - 3]);
    assert!(
        points == 400 && remarks.contains("the chunk table is truncated or damaged"),
        "{points} {remarks}"
    );
    let error = refusal(&whole[..las.head(true).len() + 200]);
    assert!(error.contains("the file ends within the first chunk of its 400 points"), "{error}");
}

/// An interrupted writer leaves no point count, and possibly no chunk table.
#[test]
fn layers_count_their_points() {
    let las = Las { large: 0, ..Las::new(4, 6, 400) };
    let whole = las.packed(Packing::Chunked(100));
    for (bytes, wanted) in [(&whole[..], 400), (&whole[..whole.len() - whole.len() / 4], 200)] {
        let (points, remarks) = read(&las, bytes);
        assert!(
            points == wanted && remarks.contains(&format!("the {wanted} points that exist")),
            "{points} {remarks}"
        );
    }
    // The end of point-wise compressed points is unknown without a count.
    let las = Las { legacy: 0, ..Las::new(2, 1, 400) };
    for packing in [Packing::Chunked(100), Packing::PointWise] {
        let error = refusal(&las.packed(packing));
        assert!(error.contains("offset 107: the header announces no points, but "), "{error}");
    }
}

/// LASzip 1.2 and older: no chunks and no chunk table.
#[test]
fn one_stream_of_points_is_read() {
    for format in [0, 1, 2, 3] {
        let las = Las::new(2, format, 1065);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("old.laz");
        fs::write(&path, las.packed(Packing::PointWise)).unwrap();
        let options = ReadOptions { scan_period_s: 0.0, ..ReadOptions::default() };
        let mut source = open_clouds(&path, &options).unwrap();
        let clouds = all(source.as_mut()).unwrap();
        let places: Vec<_> = clouds[0].1.iter().map(|point| point.position_m).collect();
        assert_eq!(places, (0..1065).map(|k| las.place(k)).collect::<Vec<_>>());
        assert_eq!(source.remarks(), Vec::<String>::new());
    }
}

#[test]
fn missing_announced_records_are_harmless() {
    let las = Las::new(2, 1, 400);
    let mut bytes = las.bytes();
    bytes[100..104].copy_from_slice(&30_u32.to_le_bytes());
    let (points, remarks) = read(&las, &bytes);
    assert!(
        points == 400 && remarks.contains("announces 30 records before the points; 0 exist"),
        "{remarks}"
    );
    let las = Las::new(4, 6, 400);
    for start in [0, 375 + 30 * 400, u64::MAX] {
        let mut bytes = las.bytes();
        bytes[235..243].copy_from_slice(&start.to_le_bytes());
        bytes[243..247].copy_from_slice(&7_u32.to_le_bytes());
        let (points, remarks) = read(&las, &bytes);
        assert!(
            points == 400 && remarks.contains("announces 7 records after the points; 0 exist"),
            "{remarks}"
        );
    }
}

#[test]
fn las_1_5_time_offset_is_used() {
    let las = Las { encoding: 1 << 6 | 1, ..Las::new(5, 6, 400) };
    let mut bytes = las.bytes();
    bytes[391..393].copy_from_slice(&1250_u16.to_le_bytes());
    assert_eq!(read(&las, &bytes), (400, String::new()));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.las");
    let first_ns = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        let mut source = open_clouds(&path, &ReadOptions::default()).unwrap();
        source.next_cloud().unwrap().unwrap().stamp_ns
    };
    assert_eq!(first_ns(&bytes), Some(1_250_001_000_050_000_000));
    assert_eq!(first_ns(&Las::new(5, 6, 400).bytes()), Some(1_000_001_000_050_000_000));
    assert_eq!(first_ns(&Las { encoding: 0, ..Las::new(4, 6, 400) }.bytes()), Some(1_000_050_000_000));
}

#[test]
fn unknown_point_formats_and_short_points_are_refused() {
    let mut bytes = Las::new(4, 6, 4).bytes();
    bytes[104] = 11;
    assert!(
        refusal(&bytes).contains("offset 104: point format 11 is unknown; formats 0 to 10 are supported")
    );
    bytes[104] = 7;
    assert!(
        refusal(&bytes).contains("offset 105: points of format 7 have 36 bytes, but the header states 30")
    );
}

#[test]
fn points_without_time_are_only_skipped_in_scans() {
    let las = Las::new(2, 1, 400);
    let mut bytes = las.bytes();
    let time_at = |k: usize| 227 + 28 * k + 20;
    for (k, time) in [(7, f64::NAN), (30, f64::INFINITY)] {
        bytes[time_at(k)..time_at(k) + 8].copy_from_slice(&time.to_le_bytes());
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.las");
    fs::write(&path, &bytes).unwrap();
    let counts = ways().map(|options| {
        let mut source = open_clouds(&path, &options).unwrap();
        let clouds = all(source.as_mut()).unwrap();
        (clouds.iter().map(|(_, points)| points.len()).sum::<usize>(), source.remarks())
    });
    assert_eq!(counts[0].0, 398);
    let remark = &counts[0].1[0];
    assert!(remark.starts_with("2 of 400 points have a GPS time of NaN"), "{remark}");
    assert!(remark.contains("first record 7; `scan_period` 0"), "{remark}");
    assert!(counts[1..].iter().all(|(points, remarks)| *points == 400 && remarks.is_empty()), "{counts:?}");
    // All points have an invalid time.
    (0..400).for_each(|k| bytes[time_at(k)..time_at(k) + 8].copy_from_slice(&f64::NAN.to_le_bytes()));
    fs::write(&path, &bytes).unwrap();
    let (error, points) = failure(&path, &ReadOptions::default());
    assert!(points == 0 && error.contains("no point has a valid GPS time"), "{error}");
}
