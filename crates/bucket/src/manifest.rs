use super::bucket::SEND_AGAIN;
use super::object_name::ObjectName;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use voxtile::space::TileIndex;
use voxtile::store::{FileVersion, tile_of_folder};

/// What a map in a bucket consists of: the one object that changes, `manifest.json`.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub(super) struct Manifest {
    pub(super) format: String,
    pub(super) version: u32,
    /// The map's id; none for a map of the original format.
    pub(super) map_id: Option<String>,
    pub(super) flush_number: u64,
    pub(super) scan_number: u64,
    pub(super) tiles: u64,
    /// Bytes of all files.
    pub(super) bytes: u64,
    /// The files that belong to no tile, by their paths.
    pub(super) files: Files,
    /// The objects that list the files of tiles, by the names of pages.
    pub(super) pages: BTreeMap<String, ObjectName>,
    /// BLAKE3 of all the others, as JSON without blanks; set where it is written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) checksum: Option<ObjectName>,
}

/// Files by their paths in the folder of the map.
pub(super) type Files = BTreeMap<String, StoredFile>;

/// A file of a map: parts of [`PART_BYTES`], the last one shorter.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub(super) struct StoredFile {
    pub(super) bytes: u64,
    /// What the log says of a tile's file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) crc32: Option<u32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) scan_number: Option<u64>,
    pub(super) parts: Vec<ObjectName>,
}

/// The name of the manifest below the map's prefix.
pub(super) const MANIFEST: &str = "manifest.json";

/// Bytes of a part. A file that grows at its end has all its parts but the last as before.
pub(super) const PART_BYTES: u64 = 16 << 20;

/// Tiles along an edge of a page. A drive changes few pages.
const PAGE_TILES: i32 = 16;

const FORMAT: &str = "voxtile bucket";
const VERSION: u32 = 1;

impl Manifest {
    /// Of a map as of a flush, without files yet.
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

    /// The object's content.
    pub(super) fn to_bytes(&self) -> serde_json::Result<Vec<u8>> {
        serde_json::to_vec_pretty(&Self { checksum: Some(self.computed_checksum()?), ..self.clone() })
    }

    /// What tells this state of the map from all others.
    pub(super) fn computed_checksum(&self) -> serde_json::Result<ObjectName> {
        Ok(ObjectName::of(&serde_json::to_vec(&Self { checksum: None, ..self.clone() })?))
    }

    /// Reads a manifest; an error says what is wrong with it.
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
            return Err(format!("its checksum does not match; {SEND_AGAIN}"));
        }
        check_files(&manifest.files)?;
        Ok(manifest)
    }

    /// Whether a later version of voxtile wrote what this one cannot read.
    pub(super) fn is_of_later_version(bytes: &[u8]) -> bool {
        let found: serde_json::Result<serde_json::Value> = serde_json::from_slice(bytes);
        found.is_ok_and(|found| {
            found["format"] == FORMAT
                && found["version"].as_u64().is_some_and(|version| version > VERSION.into())
        })
    }

    /// The page that lists the files of a tile.
    pub(super) fn page_of(tile: TileIndex) -> String {
        let [x, y, z] = [tile.x, tile.y, tile.z].map(|number| number.div_euclid(PAGE_TILES));
        format!("{x}_{y}_{z}")
    }
}

/// Reads a page, which lists files of tiles.
pub(super) fn page_from_bytes(name: &str, bytes: &[u8]) -> Result<Files, String> {
    let files: Files = serde_json::from_slice(bytes).map_err(|error| error.to_string())?;
    check_files(&files)?;
    for path in files.keys() {
        let tile = path.split_once('/').and_then(|(folder, _)| tile_of_folder(folder));
        if tile.is_none_or(|tile| Manifest::page_of(tile) != name) {
            return Err(format!("it lists {path:?}, which is no file of a tile of the page {name}"));
        }
    }
    Ok(files)
}

impl StoredFile {
    /// Whether it is this version of a tile's file.
    pub(super) fn is_version(&self, version: FileVersion) -> bool {
        self.bytes == version.checksum.bytes
            && self.crc32 == Some(version.checksum.crc)
            && self.scan_number == Some(version.scan_number)
    }
}

/// Whoever can write to the bucket chooses these paths: each must stay inside of the map's folder.
fn check_files(files: &Files) -> Result<(), String> {
    for (path, file) in files {
        if !is_path_in_map(path) {
            return Err(format!("it lists {path:?}, which is no file of a map"));
        }
        if file.parts.len() as u64 != file.bytes.div_ceil(PART_BYTES) {
            let (parts, bytes) = (file.parts.len(), file.bytes);
            return Err(format!("it lists {path:?} with {parts} parts for {bytes} bytes"));
        }
    }
    Ok(())
}

/// One or two plain names.
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
    fn what_is_no_manifest_is_told() {
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
