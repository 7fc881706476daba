use std::error::Error as _;
use std::io;
use std::path::Path;
use voxtile::space::TileIndex;
use voxtile::{Error, FormatError, MapReader, Place};

#[test]
fn a_cause_is_printed_once() {
    let place = Path::new("map/tile_0_0_0");
    let tile = Some(TileIndex::new(0, -1, 2));
    let damaged = FormatError::at_offset(12, "a wrong checksum").in_map(place, tile);
    let malformed = FormatError::at_line(3, "no number").in_input(Path::new("a.pcd"));
    let refused = Error::io(place, "read", io::Error::from_raw_os_error(5));
    for (error, alone, cause) in [
        (
            damaged,
            "map/tile_0_0_0: tile (0, -1, 2) is damaged (see `voxtile verify` and `voxtile repair`)",
            "offset 12: a wrong checksum",
        ),
        (malformed, "a.pcd: malformed", "line 3: no number"),
        (refused, "map/tile_0_0_0: cannot read", "Input/output error (os error 5)"),
    ] {
        assert_eq!(error.to_string(), alone);
        assert_eq!(error.source().unwrap().to_string(), cause);
        assert!(error.source().unwrap().source().is_none());
        let whole = format!("{alone}: {cause}");
        assert_eq!(format!("{error:#}"), whole);
        // The command prints the error with or without a context.
        let error = anyhow::Error::from(error);
        assert_eq!(format!("{error:#}"), whole);
        assert_eq!(format!("{:#}", error.context("after 3 scans")), format!("after 3 scans: {whole}"));
    }
    let error = MapReader::open("/no/map/here", 0).err().unwrap();
    assert!(error.source().is_none(), "the error has no source");
    assert_eq!(format!("{error}"), format!("{error:#}"));
}

#[test]
fn the_os_error_is_a_source_of_the_error() {
    let error = Error::io(Path::new("map"), "open", io::Error::from(io::ErrorKind::PermissionDenied));
    let cause = error.source().and_then(|cause| cause.downcast_ref::<io::Error>()).unwrap();
    assert_eq!(cause.kind(), io::ErrorKind::PermissionDenied);
}

#[test]
fn errors_name_their_subject() {
    let tile = TileIndex::new(4, 5, 6);
    let error = FormatError::at_offset(8, "short").in_map(Path::new("t"), Some(tile));
    assert_eq!(error.kind(), "damaged");
    assert_eq!((error.path(), error.tile()), (Some(Path::new("t")), Some(tile)));
    assert_eq!(error.place(), Some((Place::Offset, 8)));
    let error = Error::argument("--region", "is empty");
    assert_eq!(error.kind(), "invalid_argument");
    assert_eq!((error.path(), error.tile(), error.place()), (None, None, None));
    assert_eq!(Error::UnsavedChanges { tile }.tile(), Some(tile));
}
