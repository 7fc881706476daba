use crate::made::las::{Las, Packing};
use crate::made::voxels::{VOXELS, format_of, voxel, voxel_file};
use crate::support::{Cloud, all, clouds, clouds_with, failure, fixture};
use std::fs;
use voxtile_formats::{CloudPoint, ReadOptions, open_clouds};

/// Returns the offsets of the points and of the chunk table.
fn places(file: &[u8]) -> (usize, usize) {
    let points_at = u32::from_le_bytes(file[96..100].try_into().unwrap()) as usize;
    let table_at = u64::from_le_bytes(file[points_at..points_at + 8].try_into().unwrap()) as usize;
    (points_at, table_at)
}

/// Returns the error for a file with some bytes overwritten.
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

/// Returns the number of points and the remarks for a file with some bytes overwritten.
fn of_changed(file: &[u8], at: usize, bytes: &[u8]) -> (usize, String) {
    let folder = tempfile::tempdir().unwrap();
    let [whole, changed] = ["whole.laz", "changed.laz"].map(|name| folder.path().join(name));
    let mut other = file.to_vec();
    other[at..at + bytes.len()].copy_from_slice(bytes);
    fs::write(&whole, file).unwrap();
    fs::write(&changed, other).unwrap();
    let mut source = open_clouds(&changed, &ReadOptions::default()).unwrap();
    let found = all(source.as_mut()).unwrap();
    assert_eq!(points_of(found.clone()), points_of(clouds(&whole)));
    (points_of(found).len(), source.remarks().join("\n"))
}

fn points_of(clouds: Vec<Cloud>) -> Vec<CloudPoint> {
    clouds.into_iter().flat_map(|(_, points)| points).collect()
}

fn assert_error_at(error: &str, at: usize, what: &str) {
    assert!(
        error.contains(&format!("damaged.laz: malformed: offset {at}: ")) && error.contains(what),
        "{error}"
    );
}

/// Each of these claims would make the library reserve gigabytes or read for years.
#[test]
fn false_chunk_tables_are_refused() {
    let (by_point, by_layer) = (fs::read(fixture("timed.laz")).unwrap(), voxel_file("laz"));
    for file in [&by_point, &by_layer, &voxel_file("copc")] {
        let (points_at, table_at) = places(file);
        let error = of_damaged(file, table_at + 4, &[0xff; 4]);
        assert_error_at(&error, table_at + 4, "the chunk table lists 4294967295 chunks");
        // Without the table, each chunk states its number of points.
        let (points, remarks) = of_changed(file, points_at, &u64::to_le_bytes(1 << 40));
        assert!(
            remarks.contains(&format!("truncated or damaged: {points} points are read without it")),
            "{remarks}"
        );
        // The table is compressed: changed bytes give other chunk lengths or an invalid table.
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("damaged.laz");
        let mut refused = 0;
        for byte in 0..=u8::MAX {
            let mut damaged = file.clone();
            damaged[table_at + 8..table_at + 12].fill(byte);
            fs::write(&path, damaged).unwrap();
            match open_clouds(&path, &ReadOptions::default()) {
                Ok(mut source) => assert_eq!(points_of(all(source.as_mut()).unwrap()).len(), points),
                Err(error) => {
                    let expected = format!("{error:#}");
                    assert!(expected.contains("damaged.laz: malformed: offset "), "{expected}");
                    refused += 1;
                }
            }
        }
        assert!(refused > 50, "{refused}");
    }
    let (points_at, _) = places(&by_layer);
    // The sizes of the layers follow the offset of the table, the first point and the number of points.
    let lengths_at = points_at + 8 + 42 + 4;
    let error = of_damaged(&by_layer, lengths_at, &[0xff; 4]);
    assert_error_at(&error, lengths_at, "the fields of a chunk need 42949");
    // Found by fuzzing: if the fields end before their chunk, the library looks for the next chunk in the remaining
    // bytes.
    let shorter =
        (u32::from_le_bytes(by_layer[lengths_at..lengths_at + 4].try_into().unwrap()) - 1).to_le_bytes();
    let error = of_damaged(&by_layer, lengths_at, &shorter);
    assert_error_at(&error, lengths_at, "the fields of a chunk need ");
}

/// Found by fuzzing: the layers were not checked if the compressor type claimed that there are none.
#[test]
fn compressor_type_must_match_item_versions() {
    for (file, compressor) in
        [(fs::read(fixture("timed.laz")).unwrap(), 2_u16), (voxel_file("laz"), 2), (voxel_file("laz"), 1)]
    {
        // The description follows the record header, which begins with two bytes and the user ID.
        let name_at = file.windows(14).position(|bytes| bytes == b"laszip encoded").unwrap();
        let error = of_damaged(&file, name_at - 2 + 54, &compressor.to_le_bytes());
        assert_error_at(&error, 100, &format!("compressor type {compressor} contradicts"));
    }
}

#[test]
fn more_points_than_in_chunks_are_refused() {
    // For layered chunks, the chunks' own counts are used.
    let by_layer = voxel_file("laz");
    let (points, remarks) = of_changed(&by_layer, 247, &u64::to_le_bytes(1 << 50));
    assert_eq!(points, VOXELS as usize);
    assert!(remarks.contains("announces 1125899906842624 points; 30 exist"), "{remarks}");
    let by_point = Las { legacy: 1 << 30, ..Las::new(2, 1, 400) }.packed(Packing::Chunked(100));
    let error = of_damaged(&by_point, 107, &u32::to_le_bytes(1 << 30));
    assert_error_at(&error, 107, "1073741824 points are announced, but the chunk table lists 400");
    let error = of_damaged(&by_layer, 105, &60_000_u16.to_le_bytes());
    assert_error_at(&error, 105, "points of 60000 bytes are compressed as 2 parts of 42 bytes");
}

/// Each point of a COPC file is read once, in the order of the chunks.
#[test]
fn copc_is_read_like_laz() {
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
