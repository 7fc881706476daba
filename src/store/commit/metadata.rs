use super::commits::Commits;
use super::input_record::InputRecord;
use crate::config::{Clearing, Layers, RayConfig, Storage};
use crate::error::FormatError;
use crate::sensor::SensorModel;
use crate::space::TileIndex;
use crate::store::scans::CatalogVersion;
use crate::store::snapshots::snapshot_list::SnapshotList;
use crate::store::tiles::tile_version::MAX_NUMBER;
use serde::{Deserialize, Serialize};

/// Content of `metadata.json`: the keys of the original format, and voxtile's own in the last object `ext`.
#[derive(Clone, Debug, PartialEq)]
pub struct Metadata {
    /// Edge of a voxel in metres.
    pub resolution_m: f64,
    /// Edge of a tile in metres.
    pub tile_size_m: f64,
    /// Bounding box of the tiles; `None` for an empty map.
    pub bounds: Option<Bounds>,
    /// voxtile's own keys; `None` for a map of the original format, which cannot be verified.
    pub ext: Option<Extension>,
}

/// Lowest and highest tile index along each axis, both included.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bounds {
    /// Lowest tile index along x, y and z.
    pub min: [i32; 3],
    /// Highest tile index along x, y and z.
    pub max: [i32; 3],
}

/// Metadata that voxtile adds to the original format.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Extension {
    /// Whether the map has no tiles. Its bounds are zeros then.
    pub empty: bool,
    /// Id of the map, 32 hexadecimal digits.
    pub map_id: String,
    /// Number of the last flush.
    pub flush_number: u64,
    /// Number of the last scan in the map.
    pub scan_number: u64,
    /// Sensor model.
    pub sensor_model: SensorModel,
    /// Probability from which a voxel counts as occupied.
    pub occupancy_threshold: f64,
    /// Ray settings when the map was last written.
    pub rays: RayConfig,
    /// Inputs of the map, the latest last. Beyond 1000 the earliest are dropped.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub inputs: Vec<InputRecord>,
    /// Number of the last scan in the map at the last decay; 0 without any.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub decayed_scan: u64,
    /// Storage of the tiles; missing in maps of the original format.
    #[serde(default, skip_serializing_if = "Storage::is_octomap")]
    pub storage: Storage,
    /// Layers of the map.
    #[serde(default, skip_serializing_if = "Layers::is_none")]
    pub layers: Layers,
    /// Coordinate reference system of the map's frame, if known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crs: Option<String>,
    /// Whether the map keeps its scans.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub keeps_scans: bool,
    /// Whether the map keeps scans with the motion of the sensor, or once did.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub keeps_motion: bool,
    /// Catalog of kept scans as of the last flush; `None` in maps of versions that did not record it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub catalog: Option<CatalogVersion>,
    /// Number of records in `scans.bin` as of the last flush; `None` if unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scan_records: Option<u64>,
    /// Snapshots of the map; in the file of a snapshot, only itself. `None` before the first snapshot, and in maps of
    /// versions without a list: then every file in the folder of snapshots is a snapshot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub snapshots: Option<SnapshotList>,
}

/// Parameters of a map that never change. Every tile contains a copy, so that the metadata can be rebuilt from tiles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapParameters {
    /// Edge of a voxel in metres.
    pub resolution: f64,
    /// Edge of a tile in metres.
    pub tile_size: f64,
    /// Sensor model.
    pub sensor_model: SensorModel,
    /// Probability from which a voxel counts as occupied.
    pub occupancy_threshold: f64,
    /// Rule for the voxels that rays pass; `None` for OctoMap's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clearing: Option<Clearing>,
    /// Layers of the map.
    #[serde(default, skip_serializing_if = "Layers::is_none")]
    pub layers: Layers,
}

impl MapParameters {
    /// Returns the parameters as one line of JSON.
    pub fn to_text(&self) -> String {
        serde_json::to_string(self).expect("plain data of strings and numbers")
    }

    /// Parses the line of JSON.
    ///
    /// # Errors
    ///
    /// Text that is not JSON of the parameters.
    pub fn from_text(text: &str) -> Result<Self, FormatError> {
        serde_json::from_str(text)
            .map_err(|error| FormatError::at_offset(0, format!("not the parameters of a map: {error}")))
    }
}

#[derive(Deserialize)]
struct Document {
    version: String,
    resolution: f64,
    tile_size: f64,
    bounds: Bounds,
    ext: Option<ReadExtension>,
}

/// Extension with the fields of earlier versions, which recorded only the name of the last input.
#[derive(Deserialize)]
struct ReadExtension {
    #[serde(flatten)]
    ext: Extension,
    input_fingerprint: Option<String>,
    #[serde(default)]
    input_first_scan: u64,
}

impl ReadExtension {
    fn into_extension(self) -> Extension {
        let Self { mut ext, input_fingerprint, input_first_scan: first_scan } = self;
        if let Some(name) = input_fingerprint {
            ext.inputs.push(InputRecord { first_scan, ..InputRecord::from(name) });
        }
        ext
    }
}

const VERSION: &str = "1.0";
/// Version of maps with guarded clearing. Programs which do not know the rule must not add scans to them.
const GUARDED_VERSION: &str = "1.1";
/// Version of maps with layers. Programs which do not know them would drop them.
const LAYERED_VERSION: &str = "1.2";
/// Version of maps that keep the motion of the sensor. Programs which do not know it would take such scans for damage.
const MOTION_VERSION: &str = "1.3";
const VERSIONS: [&str; 4] = [VERSION, GUARDED_VERSION, LAYERED_VERSION, MOTION_VERSION];
/// The file ends with a checksum of all bytes before it.
const CHECKSUM_KEY: &str = "    \"crc32\": \"";
const END: &str = "\"\n  }\n}\n";

impl Bounds {
    /// Returns the bounding box of the tiles; `None` without tiles.
    pub fn of(tiles: impl Iterator<Item = TileIndex>) -> Option<Self> {
        tiles.map(TileIndex::to_array).fold(None, |bounds: Option<Self>, tile| {
            let Self { min, max } = bounds.unwrap_or(Self { min: tile, max: tile });
            Some(Self {
                min: std::array::from_fn(|k| min[k].min(tile[k])),
                max: std::array::from_fn(|k| max[k].max(tile[k])),
            })
        })
    }
}

impl Metadata {
    /// Fixed parameters of the map; `None` for a map of the original format, which lacks some of them.
    pub fn parameters(&self) -> Option<MapParameters> {
        self.ext.as_ref().map(|ext| MapParameters {
            resolution: self.resolution_m,
            tile_size: self.tile_size_m,
            sensor_model: ext.sensor_model,
            occupancy_threshold: ext.occupancy_threshold,
            clearing: ext.rays.clearing,
            layers: ext.layers,
        })
    }

    /// Storage of the tiles.
    pub fn storage(&self) -> Storage {
        self.ext.as_ref().map_or(Storage::OctoMap, |ext| ext.storage)
    }

    /// Returns the metadata with bounds and numbers as of a commit.
    pub(in crate::store) fn as_of(&self, commits: &Commits) -> Self {
        let mut metadata = Self { bounds: Bounds::of(commits.tiles.tiles()), ..self.clone() };
        if let Some(ext) = &mut metadata.ext {
            ext.empty = metadata.bounds.is_none();
            (ext.flush_number, ext.scan_number) = (commits.flush_number, commits.scan_number);
            (ext.scan_records, ext.catalog) = (None, commits.catalog);
        }
        metadata
    }

    /// Returns whether the two are equal apart from bounds and numbers, which every flush changes.
    pub(in crate::store) fn is_same_but_for_progress(&self, other: &Self) -> bool {
        let without_progress = |metadata: &Self| {
            let mut metadata = Self { bounds: None, ..metadata.clone() };
            if let Some(ext) = &mut metadata.ext {
                (ext.empty, ext.flush_number, ext.scan_number) = (true, 0, 0);
                (ext.scan_records, ext.catalog) = (None, None);
            }
            metadata
        };
        without_progress(self) == without_progress(other)
    }

    fn version(&self) -> &'static str {
        let Some(ext) = &self.ext else { return VERSION };
        let is_guarded = ext.rays.clearing().guard().is_some();
        if ext.keeps_motion {
            return MOTION_VERSION;
        }
        match (ext.layers.is_none(), is_guarded) {
            (false, _) => LAYERED_VERSION,
            (true, true) => GUARDED_VERSION,
            (true, false) => VERSION,
        }
    }

    /// Returns the text of the file. The original keys come first, in the original order. Lengths are plain decimals.
    pub fn to_text(&self) -> String {
        let Bounds { min, max } = self.bounds.unwrap_or(Bounds { min: [0; 3], max: [0; 3] });
        let bounds = format!("\"bounds\": {{\n    \"min\": {min:?},\n    \"max\": {max:?}\n  }}");
        // Rust prints the shortest decimal that reads back to the same bits, without an exponent.
        let (resolution, tile_size) = (decimal(self.resolution_m), decimal(self.tile_size_m));
        let version = self.version();
        let head = format!(
            "{{\n  \"version\": \"{version}\",\n  \"resolution\": {resolution},\n  \"tile_size\": {tile_size},\n  {bounds}"
        );
        let Some(ext) = &self.ext else { return head + "\n}\n" };
        let ext = serde_json::to_string_pretty(ext).expect("plain data of strings and numbers");
        let ext = ext.replace('\n', "\n  ");
        let ext = ext.strip_suffix("\n  }").expect("an object ends with its brace").to_owned();
        let text = format!("{head},\n  \"ext\": {ext},\n{CHECKSUM_KEY}");
        let crc = crc32fast::hash(text.as_bytes());
        format!("{text}{crc:08x}{END}")
    }

    /// Parses the text of the file.
    ///
    /// # Errors
    ///
    /// Text that is not JSON of a map's metadata, an unknown version, or a wrong checksum.
    pub fn from_text(text: &str) -> Result<Self, FormatError> {
        let document: Document = serde_json::from_str(text).map_err(|error| {
            FormatError::at_line(error.line() as u64, format!("not a map's metadata: {error}"))
        })?;
        if !VERSIONS.contains(&document.version.as_str()) {
            let reason = format!(
                "version {:?} is not known; this program reads {VERSION:?} to {MOTION_VERSION:?}",
                document.version
            );
            return Err(FormatError::at_offset(0, reason));
        }
        // A checksum without `ext` indicates a damaged key, not a file of the original format.
        if document.ext.is_some() || text.contains("\"crc32\"") {
            check_crc(text)?;
        }
        let ext = document.ext.map(ReadExtension::into_extension);
        if let Some(ext) = &ext
            && !([ext.flush_number, ext.scan_number, ext.decayed_scan]
                .into_iter()
                .chain(ext.snapshots.iter().flat_map(SnapshotList::flushes))
                .chain(ext.catalog.iter().flat_map(|catalog| [catalog.generation, catalog.bytes]))
                .all(|number| number <= MAX_NUMBER)
                && ext.inputs.iter().all(InputRecord::is_sound))
        {
            return Err(FormatError::at_offset(0, "flush or scan number exceeds 2^62"));
        }
        let is_empty = ext.as_ref().is_some_and(|ext| ext.empty);
        Ok(Self {
            resolution_m: document.resolution,
            tile_size_m: document.tile_size,
            bounds: (!is_empty).then_some(document.bounds),
            ext,
        })
    }
}

fn check_crc(text: &str) -> Result<(), FormatError> {
    let wrong = |at: usize| Err(FormatError::at_offset(at as u64, "the text does not match its checksum"));
    let Some(key) = text.rfind(CHECKSUM_KEY) else { return wrong(text.len()) };
    let end = key + CHECKSUM_KEY.len();
    let crc = format!("{:08x}{END}", crc32fast::hash(&text.as_bytes()[..end]));
    if text[end..] == crc { Ok(()) } else { wrong(end) }
}

fn is_zero(number: &u64) -> bool {
    *number == 0
}

/// Formats a length as a plain decimal that JSON reads as a float.
fn decimal(length_m: f64) -> String {
    let text = length_m.to_string();
    if text.contains('.') { text } else { text + ".0" }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::InputContent;

    fn metadata() -> Metadata {
        let ext = Extension {
            empty: false,
            map_id: "00ff".repeat(8),
            flush_number: 3,
            scan_number: 75,
            sensor_model: SensorModel::default(),
            occupancy_threshold: 0.5,
            rays: RayConfig::default(),
            inputs: vec![InputRecord { first_scan: 45, ..InputRecord::from("abc") }],
            decayed_scan: 0,
            storage: Storage::OctoMap,
            layers: Layers::NONE,
            crs: None,
            keeps_scans: false,
            keeps_motion: false,
            catalog: None,
            scan_records: None,
            snapshots: None,
        };
        let bounds = Bounds::of([TileIndex::new(0, -1, 4), TileIndex::new(-7, 2, 0)].into_iter());
        Metadata { resolution_m: 0.05, tile_size_m: 10.0, bounds, ext: Some(ext) }
    }

    #[test]
    fn metadata_round_trips() {
        let written = metadata();
        let text = written.to_text();
        let seed = "{\n  \"version\": \"1.0\",\n  \"resolution\": 0.05,\n  \"tile_size\": 10.0,\n  \"bounds\": {\n    \
                    \"min\": [-7, -1, 0],\n    \"max\": [0, 2, 4]\n  },\n  \"ext\": {\n    \"empty\": false";
        assert!(text.starts_with(seed), "{text}");
        assert_eq!(Metadata::from_text(&text), Ok(written));
    }

    #[test]
    fn inputs_round_trip_and_earlier_versions_are_read() {
        let mut written = metadata();
        let content = InputContent {
            scans: 12,
            begins_with: Some("0a".repeat(16)),
            scan_chain: "0b".repeat(16),
            pose_chain: "0c".repeat(16),
            skipped: vec![3, 7],
        };
        let ext = written.ext.as_mut().unwrap();
        ext.inputs.push(InputRecord {
            first_scan: 60,
            content: Some(content),
            ..InputRecord::from("a \"b\"")
        });
        assert_eq!(Metadata::from_text(&written.to_text()), Ok(written.clone()));
        written.ext.as_mut().unwrap().inputs[1].first_scan = u64::MAX;
        assert!(Metadata::from_text(&written.to_text()).is_err());

        let mut without = metadata();
        without.ext.as_mut().unwrap().inputs.clear();
        let text = without.to_text();
        let text = text.replace(
            "    \"crc32\"",
            "    \"input_fingerprint\": \"abc\",\n    \"input_first_scan\": 45,\n    \"crc32\"",
        );
        let end = text.find(CHECKSUM_KEY).unwrap() + CHECKSUM_KEY.len();
        let crc = crc32fast::hash(&text.as_bytes()[..end]);
        let earlier = format!("{}{crc:08x}{END}", &text[..end]);
        assert_eq!(Metadata::from_text(&earlier), Ok(metadata()));
    }

    #[test]
    fn decayed_scan_is_written_only_after_a_decay() {
        let mut written = metadata();
        assert!(!written.to_text().contains("decayed"));
        if let Some(ext) = &mut written.ext {
            ext.decayed_scan = 70;
        }
        assert!(written.to_text().contains("\n    \"decayed_scan\": 70"));
        assert_eq!(Metadata::from_text(&written.to_text()), Ok(written));
    }

    #[test]
    fn storage_is_written_only_if_not_original() {
        let mut written = metadata();
        assert!(!written.to_text().contains("storage"));
        if let Some(ext) = &mut written.ext {
            ext.storage = Storage::Compact;
        }
        assert!(written.to_text().contains("\n    \"storage\": \"compact\",\n"));
        assert_eq!(Metadata::from_text(&written.to_text()), Ok(written));
    }

    #[test]
    fn original_files_are_read_without_ext() {
        let text = r#"{"version": "1.0", "resolution": 0.05, "tile_size": 10.0,
            "bounds": {"min": [0, -1, 0], "max": [5, 3, 2]}}"#;
        let read = Metadata::from_text(text).unwrap();
        assert_eq!(read.bounds, Some(Bounds { min: [0, -1, 0], max: [5, 3, 2] }));
        assert_eq!(read.ext, None);
    }

    #[test]
    fn every_changed_byte_is_found() {
        let text = metadata().to_text();
        for at in 0..text.len() {
            for flip in [1, 2, 16, 32] {
                let mut bytes = text.clone().into_bytes();
                bytes[at] ^= flip;
                if let Ok(changed) = String::from_utf8(bytes) {
                    assert!(Metadata::from_text(&changed).is_err(), "byte {at} ^ {flip}: {changed}");
                }
            }
            assert!(Metadata::from_text(&text[..at]).is_err());
        }
    }

    #[test]
    fn small_lengths_are_written_without_exponent() {
        let tiny = Metadata { resolution_m: 1e-7, tile_size_m: 1e-5, bounds: None, ext: None };
        assert!(tiny.to_text().contains("\"resolution\": 0.0000001,"));
    }
}
