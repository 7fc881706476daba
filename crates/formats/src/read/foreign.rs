use std::path::Path;
use voxtile::Error;

/// A known format that is not supported.
pub(crate) struct Foreign {
    name: &'static str,
    /// File signatures; empty if only the extension identifies the format.
    magic: &'static [&'static [u8]],
    extensions: &'static [&'static str],
    /// Advice to the user.
    advice: &'static str,
}

impl Foreign {
    /// Creates an error that names the format and how to convert it.
    pub(crate) fn error(&self, path: &Path) -> Error {
        Error::argument(
            path.display().to_string(),
            format!("is {}, which is not supported: {}", self.name, self.advice),
        )
    }
}

const TO_CLOUD: &str =
    "sample points of its surface (CloudCompare, MeshLab) and save them as PLY, LAS or PCD";
const UNPACK: &str = "unpack it and use the files inside";
const PACKETS: &str =
    "convert it to clouds (PCD, PLY, .bag or .mcap) with the sensor's software or its ROS driver";

const FOREIGN: [Foreign; 27] = [
    Foreign {
        name: "a network capture",
        magic: &[
            b"\xd4\xc3\xb2\xa1",
            b"\xa1\xb2\xc3\xd4",
            b"\x4d\x3c\xb2\xa1",
            b"\xa1\xb2\x3c\x4d",
            b"\x0a\x0d\x0d\x0a",
        ],
        extensions: &["pcap", "pcapng"],
        advice: PACKETS,
    },
    Foreign {
        name: "HDF5",
        magic: &[b"\x89HDF\r\n\x1a\n"],
        extensions: &["h5", "hdf5"],
        advice: "write its clouds as PLY, .bin or CSV (Python: h5py)",
    },
    Foreign {
        name: "a NumPy array",
        magic: &[b"\x93NUMPY"],
        extensions: &["npy"],
        advice: "write it as .bin, `array.astype('<f4').tofile(...)`, and give its columns with `fields`; only poses \
              are read from .npy",
    },
    Foreign {
        name: "one image",
        magic: &[b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"II*\0", b"MM\0*"],
        extensions: &["png", "jpg", "jpeg", "tif", "tiff", "pgm"],
        advice: "use the folder of 16-bit depth PNGs as the input",
    },
    Foreign {
        name: "a ZIP archive",
        magic: &[b"PK\x03\x04", b"PK\x05\x06"],
        extensions: &["zip", "npz"],
        advice: UNPACK,
    },
    Foreign {
        name: "packed with gzip",
        magic: &[b"\x1f\x8b\x08"],
        extensions: &["gz", "tgz"],
        advice: UNPACK,
    },
    Foreign {
        name: "packed with Zstandard",
        magic: &[b"\x28\xb5\x2f\xfd"],
        extensions: &["zst"],
        advice: UNPACK,
    },
    Foreign { name: "packed with bzip2", magic: &[b"BZh"], extensions: &["bz2"], advice: UNPACK },
    Foreign { name: "packed with xz", magic: &[b"\xfd7zXZ\0"], extensions: &["xz"], advice: UNPACK },
    Foreign { name: "packed with LZ4", magic: &[b"\x04\x22\x4d\x18"], extensions: &["lz4"], advice: UNPACK },
    Foreign { name: "a 7z archive", magic: &[b"7z\xbc\xaf\x27\x1c"], extensions: &["7z"], advice: UNPACK },
    Foreign { name: "a RAR archive", magic: &[b"Rar!"], extensions: &["rar"], advice: UNPACK },
    Foreign { name: "a tar archive", magic: &[], extensions: &["tar"], advice: UNPACK },
    Foreign { name: "a mesh (OBJ)", magic: &[], extensions: &["obj"], advice: TO_CLOUD },
    Foreign { name: "a mesh (STL)", magic: &[b"solid "], extensions: &["stl"], advice: TO_CLOUD },
    Foreign { name: "a mesh (OFF)", magic: &[b"OFF\n", b"COFF"], extensions: &["off"], advice: TO_CLOUD },
    Foreign { name: "a scene (glTF)", magic: &[b"glTF"], extensions: &["glb", "gltf"], advice: TO_CLOUD },
    Foreign { name: "a mesh (FBX)", magic: &[b"Kaydara FBX"], extensions: &["fbx"], advice: TO_CLOUD },
    Foreign {
        name: "Parquet",
        magic: &[b"PAR1"],
        extensions: &["parquet"],
        advice: "write x, y, z and intensity as CSV (Python: pandas)",
    },
    Foreign {
        name: "a map (OctoMap)",
        magic: &[b"# Octomap OcTree"],
        extensions: &["bt", "ot"],
        advice: "it contains no clouds; convert it to a map with `voxtile import FILE -o MAP`, or use it directly with \
              info, query, raycast and export",
    },
    Foreign {
        name: "OpenVDB",
        magic: &[b" BDV"],
        extensions: &["vdb"],
        advice: "it contains volumes, not clouds; write its points as PLY",
    },
    Foreign {
        name: "a scanner manufacturer's project",
        magic: &[],
        extensions: &["rcp", "rcs", "fls", "zfs", "rdbx", "rxp", "lgs", "ptg", "ptx", "3dd"],
        advice: "export it as E57 or LAS with the manufacturer's software",
    },
    Foreign {
        name: "a Livox recording",
        magic: &[b"livox_tech"],
        extensions: &["lvx", "lvx2"],
        advice: "export LAS or CSV with Livox Viewer, or record a .bag with the driver",
    },
    Foreign { name: "Ouster packets", magic: &[], extensions: &["osf"], advice: PACKETS },
    Foreign {
        name: "CloudCompare's own format",
        magic: &[b"CCB"],
        extensions: &["sbf", "bin2"],
        advice: "save it as PLY, LAS or E57 with CloudCompare",
    },
    Foreign {
        name: "a point cloud for the web",
        magic: &[],
        extensions: &["pnts", "ept", "slpk"],
        advice: "use the LAZ or COPC file that it was created from",
    },
    Foreign {
        name: "an Excel or MATLAB table",
        magic: &[b"MATLAB 5.0"],
        extensions: &["mat", "xlsx", "xls"],
        advice: "save x, y, z and intensity as CSV",
    },
];

/// Returns the unsupported format with this file signature.
pub(crate) fn of_bytes(start: &[u8]) -> Option<&'static Foreign> {
    if start.get(257..262) == Some(b"ustar") {
        return of_extension("tar");
    }
    FOREIGN.iter().find(|foreign| foreign.magic.iter().any(|magic| start.starts_with(magic)))
}

/// Returns the archive format with this signature, whatever the file's name.
pub(crate) fn archive_of(start: &[u8]) -> Option<&'static Foreign> {
    of_bytes(start).filter(|foreign| foreign.advice == UNPACK)
}

/// Returns the unsupported format with this extension (lower case).
pub(crate) fn of_extension(extension: &str) -> Option<&'static Foreign> {
    FOREIGN.iter().find(|foreign| foreign.extensions.contains(&extension))
}

/// Describes a placeholder or error page stored instead of the file, with advice.
pub(crate) fn stand_in(start: &[u8]) -> Option<&'static str> {
    let text = without_bom(start).trim_ascii_start();
    let starts =
        |word: &str| text.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word.as_bytes()));
    if starts("version https://git-lfs.") || starts("version https://hawser.") {
        return Some("is a Git LFS pointer, not the file itself: get it with `git lfs pull`");
    }
    if starts("/annex/objects/") {
        return Some("is a git-annex pointer, not the file itself: get it with `git annex get`");
    }
    if ["<!doctype html", "<html", "<head", "<body", "<!-- saved from url"].iter().any(|tag| starts(tag)) {
        return Some(
            "is an HTML page, not data: the download returned a web page, possibly a login or an error; open it in a \
             browser and download the file itself",
        );
    }
    if starts("<?xml") || starts("<Error>") {
        return Some(
            "is XML, not data: the download returned an error or a list; open it in an editor to see the reason",
        );
    }
    None
}

/// Describes the encoding of a text that is not UTF-8, with advice.
pub(crate) fn text_encoding(start: &[u8]) -> Option<&'static str> {
    let is_utf16 = match *start {
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => true,
        // Digits and blanks, each with a zero byte.
        [0, low, 0, ..] | [low, 0, _, 0, ..] => low.is_ascii_graphic() || low == b' ',
        _ => false,
    };
    is_utf16.then_some("is text in UTF-16: save it as UTF-8")
}

/// UTF-8 byte order mark, written by some Windows editors.
pub(crate) const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Strips a byte order mark.
pub(crate) fn without_bom(start: &[u8]) -> &[u8] {
    start.strip_prefix(BYTE_ORDER_MARK).unwrap_or(start)
}

/// Describes the first bytes of a file for an error message.
pub(crate) fn beginning_of(start: &[u8]) -> String {
    let line = start.split(|byte| matches!(byte, b'\n' | b'\r')).next().unwrap_or_default().trim_ascii();
    let is_text = !line.is_empty() && line.iter().all(|byte| byte.is_ascii_graphic() || *byte == b' ');
    if is_text {
        return format!("; it starts with `{:.60}`", String::from_utf8_lossy(line));
    }
    let are_zeros = !start.is_empty() && start.iter().all(|byte| *byte == 0);
    if are_zeros {
        "; it starts with zeros: was a copy or a download interrupted?".to_owned()
    } else {
        String::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn placeholders_are_reported() {
        for (start, what) in [
            (&b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n"[..], "git lfs pull"),
            (b"version https://hawser.github.com/spec/v1\n", "git lfs pull"),
            (b"/annex/objects/SHA256E-s1--0\n", "git annex get"),
            (b"\xef\xbb\xbf\r\n<!DOCTYPE HTML><html>", "is an HTML page"),
            (b"<html lang=\"en\">", "is an HTML page"),
            (b"<?xml version=\"1.0\"?><Error>", "is XML"),
        ] {
            assert!(stand_in(start).is_some_and(|found| found.contains(what)), "{what}");
        }
        for start in [&b"version 0.7\n"[..], b"<", b"", b"1 2 3", b"VERSION .7\nFIELDS x y z\n"] {
            assert_eq!(stand_in(start), None);
        }
    }

    #[test]
    fn each_archive_format_is_reported() {
        let tar = [&[b'a'; 257][..], b"ustar\x0000"].concat();
        for (start, name) in [
            (&b"PK\x03\x04"[..], "ZIP"),
            (b"\x1f\x8b\x08\0", "gzip"),
            (b"7z\xbc\xaf\x27\x1c", "7z"),
            (b"BZh91AY", "bzip2"),
            (&tar, "tar"),
        ] {
            assert!(archive_of(start).is_some_and(|found| found.name.contains(name)), "{name}");
        }
        assert!(archive_of(b"\x89HDF\r\n\x1a\n").is_none());
        assert!(archive_of(b"\x1f\x8b\x23\x41").is_none(), "a float");
    }
}
