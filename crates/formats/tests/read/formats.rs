use crate::support::fixture;
use std::fs;
use std::path::Path;
use voxtile_formats::{ReadOptions, Registry, open_clouds};

/// Returns the name of the detected format.
fn guess(path: &Path) -> voxtile::Result<&'static str> {
    Registry::default().guess(path, &[]).map(|format| format.name)
}

#[test]
fn formats_are_detected_by_content() {
    let folder = tempfile::tempdir().unwrap();
    for (name, format) in [
        ("ascii.ply", "ply"),
        ("points.csv", "xyz"),
        ("points.xyz", "xyz"),
        ("timed.las", "las"),
        ("timed.laz", "laz"),
        ("scans.e57", "e57"),
    ] {
        assert_eq!(guess(&fixture(name)).unwrap(), format, "{name}");
        let renamed = folder.path().join("cloud.dat");
        fs::copy(fixture(name), &renamed).unwrap();
        assert_eq!(guess(&renamed).unwrap(), format, "{name} renamed");
    }
    for (bytes, format) in [
        (&b"#ROSBAG V2.0\n"[..], "bag"),
        (b"\x89MCAP0\r\n", "mcap"),
        (b"SQLite format 3\0", "db3"),
        (b"# .PCD v0.7\n", "pcd"),
    ] {
        let path = folder.path().join("other.dat");
        fs::write(&path, bytes).unwrap();
        assert_eq!(guess(&path).unwrap(), format);
    }
    assert_eq!(guess(&fixture("kitti.bin")).unwrap(), "bin");
}

#[test]
fn folder_formats_are_detected() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("data")).unwrap();
    let error = format!("{:#}", guess(folder.path()).unwrap_err());
    assert!(error.contains("did you mean one of its subfolders (data)"), "{error}");
    fs::copy(fixture("kitti.bin"), at("1.bin")).unwrap();
    assert_eq!(guess(folder.path()).unwrap(), "bin");
    fs::copy(fixture("ascii.ply"), at("1.ply")).unwrap();
    let error = format!("{:#}", guess(folder.path()).unwrap_err());
    assert!(error.contains("contains files of format bin (1) and of format ply (1)"), "{error}");
    fs::write(at("depth.txt"), "").unwrap();
    assert_eq!(guess(folder.path()).unwrap(), "tum-rgbd");
    fs::write(at("metadata.yaml"), "rosbag2_bagfile_information:\n").unwrap();
    assert_eq!(guess(folder.path()).unwrap(), "rosbag2");
}

#[test]
fn unsupported_formats_are_reported_with_advice() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes, reason) in [
        ("a.dat", &b"\xd4\xc3\xb2\xa1\x02\x00"[..], "is a network capture"),
        ("a.h5", b"\x89HDF\r\n\x1a\n", "is HDF5"),
        ("a.obj", b"v 1 2 3\n", "is a mesh (OBJ)"),
        ("a.stl", b"\0\0\0\0", "is a mesh (STL)"),
        ("a.zip", b"PK\x03\x04", "unpack it"),
        ("a.txt", b"some prose\n", "is not a valid text of points"),
        ("a.e57", b"ASTM", "has the extension .e57"),
        ("a.weird", b"\0\x01", "known formats: pcd, ply, xyz"),
        ("a.ply", b"", "the file is empty"),
    ] {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        let error = format!("{:#}", guess(&path).unwrap_err());
        assert!(error.contains(reason) && error.contains(name), "{error}");
    }
    let path = folder.path().join("a.pcd");
    fs::write(&path, "# .PCD v0.7\n").unwrap();
    let error = open_clouds(&path, &ReadOptions::default())
        .err()
        .map(|error| format!("{error:#}"))
        .unwrap_or_default();
    assert!(error.contains("is PCD, which contains scans with poses"), "{error}");
    let error = guess(&folder.path().join("nothing")).unwrap_err().to_string();
    assert!(error.ends_with("nothing: there is no such file or folder"), "{error}");
    let formats = Registry::default();
    assert_eq!(formats.named("LAZ").unwrap().name, "laz");
    assert_eq!(formats.named("kitti").unwrap().name, "bin");
    assert!(formats.named("foo").unwrap_err().to_string().contains("known formats: pcd, ply, xyz"));
}
