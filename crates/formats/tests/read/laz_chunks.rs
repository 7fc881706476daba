use crate::made::voxels::{VOXELS, format_of, voxel, voxel_file};
use crate::support::{clouds, clouds_with, failure, fixture};
use std::fs;
use voxtile_formats::CloudPoint;
use voxtile_formats::ReadOptions;

/// Where the points begin, and where the chunk table is.
fn places(file: &[u8]) -> (usize, usize) {
    let points_at = u32::from_le_bytes(file[96..100].try_into().unwrap()) as usize;
    let table_at = u64::from_le_bytes(file[points_at..points_at + 8].try_into().unwrap()) as usize;
    (points_at, table_at)
}

/// What is said of a file with some bytes of it overwritten.
fn of_damaged(file: &[u8], at: usize, bytes: &[u8]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damaged.laz");
    let mut damaged = file.to_vec();
    damaged[at..at + bytes.len()].copy_from_slice(bytes);
    fs::write(&path, damaged).unwrap();
    let (error, points) = failure(&path, &ReadOptions::default());
    assert_eq!(points, 0, "{error}");
    error
}

fn assert_says(error: &str, at: usize, what: &str) {
    assert!(
        error.contains(&format!("damaged.laz: malformed: offset {at}: ")) && error.contains(what),
        "{error}"
    );
}

/// Each claim would have the library reserve gigabytes, or read for years.
#[test]
fn a_chunk_table_that_lies_is_refused() {
    let (by_point, by_layer) = (fs::read(fixture("timed.laz")).unwrap(), voxel_file("laz"));
    for file in [&by_point, &by_layer, &voxel_file("copc")] {
        let (points_at, table_at) = places(file);
        let error = of_damaged(file, table_at + 4, &[0xff; 4]);
        assert_says(&error, table_at + 4, "the chunk table promises 4294967295 chunks");
        let error = of_damaged(file, points_at, &u64::to_le_bytes(1 << 40));
        assert_says(&error, points_at, "the chunk table is said to be at byte 1099511627776");
        // The table itself is compressed: other bytes are other lengths of chunks.
        let error = of_damaged(file, table_at + 8, &[0xf3; 4]);
        assert!(error.contains(&format!("damaged.laz: malformed: offset {table_at}: ")), "{error}");
    }
    let (points_at, _) = places(&by_layer);
    // Behind the place of the table, the first point and the number of points.
    let lengths_at = points_at + 8 + 42 + 4;
    let error = of_damaged(&by_layer, lengths_at, &[0xff; 4]);
    assert_says(&error, lengths_at, "the fields of a chunk claim 42949");
    // Found by fuzzing: where the fields end before their chunk does, the next one is looked for in their bytes.
    let shorter =
        (u32::from_le_bytes(by_layer[lengths_at..lengths_at + 4].try_into().unwrap()) - 1).to_le_bytes();
    let error = of_damaged(&by_layer, lengths_at, &shorter);
    assert_says(&error, lengths_at, "the fields of a chunk claim ");
}

/// Found by fuzzing: layers that are said to be none are not checked as such.
#[test]
fn a_compressor_must_fit_the_versions_of_its_parts() {
    for (file, compressor) in
        [(fs::read(fixture("timed.laz")).unwrap(), 2_u16), (voxel_file("laz"), 2), (voxel_file("laz"), 1)]
    {
        // The description follows the head of its record, which begins with two bytes and the name.
        let name_at = file.windows(14).position(|bytes| bytes == b"laszip encoded").unwrap();
        let error = of_damaged(&file, name_at - 2 + 54, &compressor.to_le_bytes());
        assert_says(&error, 100, &format!("compressor {compressor} does not fit"));
    }
}

#[test]
fn more_points_than_the_chunks_have_room_for_are_refused() {
    let by_layer = voxel_file("laz");
    let error = of_damaged(&by_layer, 247, &u64::to_le_bytes(1 << 50));
    assert_says(&error, 247, "1125899906842624 points are announced; the chunk table has room for 50000");
    let by_point = fs::read(fixture("timed.laz")).unwrap();
    let at = if by_point[107..111] == [0; 4] { 247 } else { 107 };
    let error = of_damaged(&by_point, at, &u32::to_le_bytes(1 << 30));
    assert_says(&error, at, "1073741824 points are announced");
    let error = of_damaged(&by_layer, 105, &60_000_u16.to_le_bytes());
    assert_says(&error, 105, "points of 60000 bytes are compressed as 2 parts of 42 bytes");
}

/// Every point of a COPC file is in it once, in the order of its chunks.
#[test]
fn copc_is_read_as_laz_is() {
    let folder = tempfile::tempdir().unwrap();
    let centers = |format: &str| {
        let path = folder.path().join(format!("a.{}", format_of(format).extension.unwrap()));
        fs::write(&path, voxel_file(format)).unwrap();
        let clouds = clouds_with(&path, &ReadOptions { scan_period_s: 0.0, ..ReadOptions::default() });
        let [(head, points)] = clouds.as_slice() else { panic!("{} clouds", clouds.len()) };
        assert_eq!(head.points, Some(VOXELS as u64));
        let mut points: Vec<CloudPoint> = points.clone();
        points.sort_by(|a, b| a.position_m[0].total_cmp(&b.position_m[0]));
        points
    };
    let copc = centers("copc");
    assert_eq!(
        copc.iter().map(|point| point.position_m).collect::<Vec<_>>(),
        (0..VOXELS).map(|k| voxel(k).center_m).collect::<Vec<_>>()
    );
    assert_eq!(copc, centers("laz"));
    assert_eq!(copc, centers("las"));
    assert_eq!(clouds(&folder.path().join("a.copc.laz")).len(), 1);
}
