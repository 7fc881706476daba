use std::path::Path;
use voxtile::{Error, Result};

/// File signatures of non-text files, with their names and how to get readable poses from them.
const KINDS: [(&[u8], &str, &str); 14] = [
    (b"PK\x03\x04", "an archive (.zip, .npz)", "save one array: numpy.save('poses.npy', archive['poses'])"),
    (b"\x1f\x8b", "packed (gzip)", UNPACK),
    (b"\x28\xb5\x2f\xfd", "packed (zstd)", UNPACK),
    (b"BZh", "packed (bzip2)", UNPACK),
    (b"\xfd7zXZ\0", "packed (xz)", UNPACK),
    (b"7z\xbc\xaf", "an archive (7z)", UNPACK),
    (b"#ROSBAG", "a recording (.bag)", RECORDING),
    (b"\x89MCAP", "a recording (.mcap)", RECORDING),
    (b"SQLite format 3\0", "a database, possibly a recording (.db3)", RECORDING),
    (b"\x89HDF", "HDF5", SAVE),
    (b"PAR1", "Parquet", SAVE),
    (b"MATLAB 5", "a MATLAB file (.mat)", SAVE),
    (b"\xff\xfe", "text in UTF-16", "save it as UTF-8"),
    (b"\xfe\xff", "text in UTF-16", "save it as UTF-8"),
];
const UNPACK: &str = "unpack it first";
const SAVE: &str = "save the poses as text (TUM, KITTI, CSV) or as .npy";
const RECORDING: &str =
    "use the recording itself as the input, with `odometry` for a topic of poses, or save its poses as text";

/// Checks that a pose file with this start can be text, which contains no zero bytes.
///
/// # Errors
///
/// Names the detected kind of file and how to convert it.
pub(super) fn check_text(path: &Path, head: &[u8]) -> Result<()> {
    let known = KINDS.iter().find(|(start, ..)| head.starts_with(start));
    let (kind, advice) = match known {
        Some((_, kind, advice)) => (*kind, *advice),
        None if head.contains(&0) => ("binary", SAVE),
        None => return Ok(()),
    };
    Err(Error::argument(path.display().to_string(), format!("is {kind}, not a text file of poses: {advice}")))
}
