use crate::support::fixture;
use std::fs;
use voxtile_formats::clouds::read::{Format, OpenOptions, open};

#[test]
fn content_tells_the_format_whatever_the_name() {
    let folder = tempfile::tempdir().unwrap();
    for (name, format) in [
        ("ascii.ply", Format::Ply),
        ("points.csv", Format::Text),
        ("points.xyz", Format::Text),
        ("timed.las", Format::Las),
        ("timed.laz", Format::Laz),
        ("scans.e57", Format::E57),
    ] {
        assert_eq!(Format::guess(&fixture(name)).unwrap(), format, "{name}");
        let renamed = folder.path().join("cloud.dat");
        fs::copy(fixture(name), &renamed).unwrap();
        assert_eq!(Format::guess(&renamed).unwrap(), format, "{name} renamed");
    }
    for (bytes, format) in [
        (&b"#ROSBAG V2.0\n"[..], Format::Bag1),
        (b"\x89MCAP0\r\n", Format::Mcap),
        (b"SQLite format 3\0", Format::Db3),
        (b"# .PCD v0.7\n", Format::Pcd),
    ] {
        let path = folder.path().join("other.dat");
        fs::write(&path, bytes).unwrap();
        assert_eq!(Format::guess(&path).unwrap(), format);
    }
    assert_eq!(Format::guess(&fixture("kitti.bin")).unwrap(), Format::Bin);
}

#[test]
fn folders_tell_what_they_hold() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("data")).unwrap();
    let error = Format::guess(folder.path()).unwrap_err().to_string();
    assert!(error.contains("is one of its folders meant (data)"), "{error}");
    fs::copy(fixture("kitti.bin"), at("1.bin")).unwrap();
    assert_eq!(Format::guess(folder.path()).unwrap(), Format::Bin);
    fs::copy(fixture("ascii.ply"), at("1.ply")).unwrap();
    let error = Format::guess(folder.path()).unwrap_err().to_string();
    assert!(error.contains("holds 1 files of bin and 1 of ply"), "{error}");
    fs::write(at("depth.txt"), "").unwrap();
    assert_eq!(Format::guess(folder.path()).unwrap(), Format::DepthTum);
    fs::write(at("metadata.yaml"), "rosbag2_bagfile_information:\n").unwrap();
    assert_eq!(Format::guess(folder.path()).unwrap(), Format::Bag2Folder);
}

#[test]
fn what_is_not_read_is_named_with_the_way() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes, reason) in [
        ("a.dat", &b"\xd4\xc3\xb2\xa1\x02\x00"[..], "is a network capture"),
        ("a.h5", b"\x89HDF\r\n\x1a\n", "is HDF5"),
        ("a.obj", b"v 1 2 3\n", "is a mesh (OBJ)"),
        ("a.stl", b"\0\0\0\0", "is a mesh (STL)"),
        ("a.zip", b"PK\x03\x04", "unpack it"),
        ("a.txt", b"some prose\n", "is no text of points"),
        ("a.e57", b"ASTM", "is called .e57"),
        ("a.weird", b"\0\x01", "known are pcd, ply, xyz"),
        ("a.ply", b"", "the file is empty"),
    ] {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        let error = Format::guess(&path).unwrap_err().to_string();
        assert!(error.contains(reason) && error.contains(name), "{error}");
    }
    let path = folder.path().join("a.pcd");
    fs::write(&path, "# .PCD v0.7\n").unwrap();
    let error = open(&path, &OpenOptions::default()).err().map(|error| error.to_string()).unwrap_or_default();
    assert!(error.contains("voxtile itself reads"), "{error}");
    assert!(
        Format::guess(&folder.path().join("nothing")).unwrap_err().to_string().starts_with("cannot read")
    );
    assert_eq!("LAZ".parse::<Format>().unwrap(), Format::Laz);
    assert!("foo".parse::<Format>().is_err());
}
