use super::bucket::RESEND_HINT;
use super::object_name::ObjectName;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use voxtile::space::TileIndex;
use voxtile::store::{FileVersion, tile_of_folder};

/// The manifest of a map in a bucket, `manifest.json`: the only object that changes. It lists all files of the map.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub(super) struct Manifest {
    pub(super) format: String,
    pub(super) version: u32,
    /// Id of the map; `None` for a map of the original format.
    pub(super) map_id: Option<String>,
    pub(super) flush_number: u64,
    pub(super) scan_number: u64,
    pub(super) tiles: u64,
    /// Total size of all files, in bytes.
    pub(super) bytes: u64,
    /// Files that belong to no tile, by path.
    pub(super) files: Files,
    /// Objects that list the files of tiles, by the name of the page.
    pub(super) pages: BTreeMap<String, ObjectName>,
    /// BLAKE3 of the other fields, as JSON without whitespace. Set when the manifest is written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) checksum: Option<ObjectName>,
}

/// Files by their paths in the folder of the map.
pub(super) type Files = BTreeMap<String, StoredFile>;

/// A file of a map. Its parts have [`PART_BYTES`] each; the last part is shorter.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub(super) struct StoredFile {
    pub(super) bytes: u64,
    /// CRC-32 of a tile's file in the map's log.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) crc32: Option<u32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) scan_number: Option<u64>,
    pub(super) parts: Vec<ObjectName>,
}

/// Name of the manifest below the map's prefix.
pub(super) const MANIFEST: &str = "manifest.json";

/// Size of a part, in bytes. When a file grows at its end, all parts but the last are unchanged.
pub(super) const PART_BYTES: u64 = 16 << 20;

/// Tiles along an edge of a page. Pages are large, so that a drive changes few of them.
const PAGE_TILES: i32 = 16;

const FORMAT: &str = "voxtile bucket";
const VERSION: u32 = 1;

impl Manifest {
    /// Creates the manifest of a map at a flush, without files.
    pub(super) fn new(map_id: Option<String>, flush_number: u64, scan_number: u64) -> Self {
        Self {
            format: FORMAT.to_owned(),
            version: VERSION,
            map_id,
            flush_number,
            scan_number,
            tiles: 0,
            bytes: 0,
            files: Files::new(),
            pages: BTreeMap::new(),
            checksum: None,
        }
    }

    /// Encodes the manifest with its checksum.
    pub(super) fn to_bytes(&self) -> serde_json::Result<Vec<u8>> {
        serde_json::to_vec_pretty(&Self { checksum: Some(self.computed_checksum()?), ..self.clone() })
    }

    /// Returns the checksum, which identifies this state of the map.
    pub(super) fn computed_checksum(&self) -> serde_json::Result<ObjectName> {
        Ok(ObjectName::of(&serde_json::to_vec(&Self { checksum: None, ..self.clone() })?))
    }

    /// Decodes a manifest. The error describes the problem.
    pub(super) fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        let mut manifest: Self = serde_json::from_slice(bytes).map_err(|error| error.to_string())?;
        if manifest.format != FORMAT {
            return Err(format!("its format is {:?}, not {FORMAT:?}", manifest.format));
        }
        if manifest.version != VERSION {
            let version = manifest.version;
            return Err(format!("its version is {version}; this voxtile reads version {VERSION}"));
        }
        let computed = manifest.computed_checksum().map_err(|error| error.to_string())?;
        if manifest.checksum.take() != Some(computed) {
            return Err(format!("its checksum does not match; {RESEND_HINT}"));
        }
        check_files(&manifest.files)?;
        Ok(manifest)
    }

    /// Returns whether these bytes are a manifest of a later version of voxtile.
    pub(super) fn is_of_later_version(bytes: &[u8]) -> bool {
        let found: serde_json::Result<serde_json::Value> = serde_json::from_slice(bytes);
        found.is_ok_and(|found| {
            found["format"] == FORMAT
                && found["version"].as_u64().is_some_and(|version| version > VERSION.into())
        })
    }

    /// Returns the name of the page that lists the files of a tile.
    pub(super) fn page_of(tile: TileIndex) -> String {
        let [x, y, z] = [tile.x, tile.y, tile.z].map(|number| number.div_euclid(PAGE_TILES));
        format!("{x}_{y}_{z}")
    }
}

/// Decodes a page, which lists files of tiles.
pub(super) fn page_from_bytes(name: &str, bytes: &[u8]) -> Result<Files, String> {
    let files: Files = serde_json::from_slice(bytes).map_err(|error| error.to_string())?;
    check_files(&files)?;
    for path in files.keys() {
        let tile = path.split_once('/').and_then(|(folder, _)| tile_of_folder(folder));
        if tile.is_none_or(|tile| Manifest::page_of(tile) != name) {
            return Err(format!("it lists {path:?}, which is not a tile file of page {name}"));
        }
    }
    Ok(files)
}

impl StoredFile {
    /// Returns the size in bytes of the part with this number, from 0.
    pub(super) fn bytes_of_part(&self, number: usize) -> u64 {
        self.bytes.saturating_sub((number as u64).saturating_mul(PART_BYTES)).min(PART_BYTES)
    }

    /// Returns whether this is the given version of a tile's file.
    pub(super) fn is_version(&self, version: FileVersion) -> bool {
        self.bytes == version.checksum.bytes
            && self.crc32 == Some(version.checksum.crc)
            && self.scan_number == Some(version.scan_number)
    }
}

/// Checks the paths, which are untrusted input: each must be inside the map's folder.
fn check_files(files: &Files) -> Result<(), String> {
    for (path, file) in files {
        if !is_path_in_map(path) {
            return Err(format!("it lists {path:?}, which is not a file of a map"));
        }
        if file.parts.len() as u64 != file.bytes.div_ceil(PART_BYTES) {
            let (parts, bytes) = (file.parts.len(), file.bytes);
            return Err(format!("it lists {path:?} with {parts} parts for {bytes} bytes"));
        }
    }
    Ok(())
}

/// Returns whether a path has one or two plain names.
fn is_path_in_map(path: &str) -> bool {
    let is_name = |name: &str| {
        let is_letter = |letter: u8| letter.is_ascii_alphanumeric() || b"._-".contains(&letter);
        !name.is_empty() && name.len() < 128 && !name.starts_with('.') && name.bytes().all(is_letter)
    };
    let names: Vec<_> = path.split('/').collect();
    names.len() <= 2 && names.iter().all(|name| is_name(name)) && path != "writer.lock"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_is_a_cube_of_tiles() {
        assert_eq!(Manifest::page_of(TileIndex::new(0, 15, -1)), "0_0_-1");
        assert_eq!(Manifest::page_of(TileIndex::new(16, -16, -17)), "1_-1_-2");
    }

    #[test]
    fn a_path_stays_in_the_map() {
        for path in ["metadata.json", "tile_0_1_-1/tile.vxt", "kept_scans/segment.3", "snapshots/before"] {
            assert!(is_path_in_map(path), "{path}");
        }
        for path in
            ["", "/etc/passwd", "../x", "a/../b", "a//b", "a/b/c", "a\\b", ".next", "writer.lock", "a/", "ä"]
        {
            assert!(!is_path_in_map(path), "{path}");
        }
    }

    #[test]
    fn invalid_manifests_are_refused() {
        let good = Manifest::new(None, 3, 7);
        let text = String::from_utf8(good.to_bytes().unwrap()).unwrap();
        assert_eq!(Manifest::from_bytes(text.as_bytes()), Ok(good));
        let newer = text.replace("\"version\": 1", "\"version\": 2");
        assert!(Manifest::from_bytes(newer.as_bytes()).unwrap_err().contains("version is 2"));
        assert!(Manifest::is_of_later_version(newer.as_bytes()));
        assert!(!Manifest::is_of_later_version(&text.as_bytes()[1..]));
        let other = text.replace("voxtile bucket", "tiles");
        assert!(Manifest::from_bytes(other.as_bytes()).unwrap_err().contains("its format"));
        let changed = text.replace("\"flush_number\": 3", "\"flush_number\": 4");
        assert!(Manifest::from_bytes(changed.as_bytes()).unwrap_err().contains("push --resend"));
        let file = StoredFile { bytes: 5, crc32: None, scan_number: None, parts: Vec::new() };
        let short = Manifest { files: Files::from([("a".to_owned(), file)]), ..Manifest::new(None, 3, 7) };
        let short = Manifest::from_bytes(&short.to_bytes().unwrap()).unwrap_err();
        assert!(short.contains("0 parts for 5 bytes"), "{short}");
        assert!(Manifest::from_bytes(b"{").is_err());
    }
}
