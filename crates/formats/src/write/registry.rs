use super::output_format::OutputOption::{
    Cell, Classes, Crs, Heights, MeanPoints, Quantized, Region, Unit, Which,
};
use super::*;
use std::path::Path;
use voxtile::octree::OctreeFormat;

/// Wraps the constructor of a stream sink.
macro_rules! stream {
    ($new:expr) => {
        Writer::Stream(|head, out, options| Ok(Box::new($new(head, out, options)?)))
    };
}

/// Wraps the constructor of a file sink.
macro_rules! files {
    ($create:expr) => {
        Writer::Files(|head, path, options| Ok(Box::new($create(head, path, options)?)))
    };
}

/// A row that depends on a Cargo feature.
macro_rules! with_feature {
    ($feature:literal, $name:literal, $extension:literal, $help:literal, $writer:expr) => {
        OutputFormat {
            feature: Some($feature),
            ..row($name, Some($extension), $help, {
                #[cfg(feature = $feature)]
                {
                    $writer
                }
                #[cfg(not(feature = $feature))]
                {
                    Writer::NotBuilt
                }
            })
        }
    };
}

/// A row with common defaults.
const fn row(
    name: &'static str,
    extension: Option<&'static str>,
    help: &'static str,
    writer: Writer,
) -> OutputFormat {
    OutputFormat {
        name,
        extension,
        help,
        feature: None,
        takes: &[Region, Which],
        origin: Origin::Map,
        refusal: "omit the option",
        is_text: false,
        needs_free_voxels: false,
        writer,
    }
}

/// Options of formats of points.
const POINTS: &[OutputOption] = &[Region, Which, Classes, MeanPoints];
const POINTS_CRS: &[OutputOption] = &[Region, Which, Classes, MeanPoints, Crs];
const POINTS_CRS_UNIT: &[OutputOption] = &[Region, Which, Classes, MeanPoints, Crs, Unit];

const TREE_REFUSAL: &str = "an octree file always contains free and occupied voxels; omit the option";

/// All output formats. Help texts, hints and option checks are generated from this table, and documents are checked
/// against it.
#[rustfmt::skip]
const TABLE: [OutputFormat; 19] = [
    OutputFormat { origin: Origin::Corner, takes: POINTS,
        ..row("ply", Some("ply"), "Points with doubles, probability, log-odds and count",
              stream!(ply::PlySink::new)) },
    OutputFormat { origin: Origin::CornerNearby, takes: POINTS,
        ..row("pcd", Some("pcd"), "Points with float32, as PCL reads them", stream!(pcd::PcdSink::new)) },
    OutputFormat { origin: Origin::Corner, takes: POINTS, is_text: true,
        ..row("csv", Some("csv"), "Text", stream!(csv::CsvSink::new)) },
    OutputFormat { origin: Origin::Corner, takes: &[Region], refusal: TREE_REFUSAL,
        ..row("bt", Some("bt"), "OctoMap's free and occupied voxels", Writer::Octree(OctreeFormat::Bt)) },
    OutputFormat { origin: Origin::Corner, takes: &[Region], refusal: TREE_REFUSAL,
        ..row("ot", Some("ot"), "OctoMap's log-odds", Writer::Octree(OctreeFormat::Ot)) },
    OutputFormat { is_text: true, takes: &[Region, Which, Classes, MeanPoints, Unit],
        ..row("xyz", Some("xyz"), "Text: x y z probability", files!(xyz::XyzSink::create)) },
    OutputFormat { takes: POINTS,
        ..row("npz", Some("npz"), "NumPy arrays: xyz, log_odds, probability, count",
              files!(npz::NpzSink::create)) },
    OutputFormat { takes: POINTS_CRS_UNIT,
        ..with_feature!("las", "las", "las", "LAS 1.4 with log-odds and count as extra bytes",
                        files!(las::LasSink::plain)) },
    OutputFormat { takes: POINTS_CRS_UNIT,
        ..with_feature!("las", "laz", "laz", "The same, compressed", files!(las::LasSink::compressed)) },
    OutputFormat { takes: POINTS_CRS_UNIT,
        ..with_feature!("las", "copc", "copc.laz", "The same with levels of detail",
                        files!(copc::CopcSink::create)) },
    OutputFormat { takes: POINTS_CRS,
        ..with_feature!("e57", "e57", "e57", "ASTM E57", files!(e57::E57Sink::create)) },
    OutputFormat { takes: POINTS_CRS,
        ..with_feature!("parquet", "parquet", "parquet", "Apache Parquet, if enabled in this build",
                        files!(parquet::ParquetSink::create)) },
    OutputFormat { takes: POINTS,
        ..with_feature!("ros", "mcap", "mcap", "A recording with PointCloud2 messages, for Foxglove and others",
                        files!(mcap::McapSink::create)) },
    OutputFormat::GLB,
    OutputFormat { takes: &[Region, Which, Heights], needs_free_voxels: true,
        ..row("nav2", Some("pgm"), "A 2D occupancy grid for nav2: .pgm and .yaml", files!(nav2::Nav2Sink::create)) },
    OutputFormat { takes: &[Region, Which, Classes, Heights],
        ..row("heightmap", Some("png"), "Heights as a 16-bit PNG with a world file",
              files!(heightmap::HeightmapSink::create)) },
    OutputFormat { takes: &[Region, Which, Classes, Heights, Crs, Unit],
        ..row("geotiff", Some("tif"), "Heights as a GeoTIFF: highest, lowest and mean of each column of voxels",
              files!(geotiff::GeoTiffSink::create)) },
    OutputFormat { takes: &[Region, Which, Classes, MeanPoints, Cell], origin: Origin::Point,
        ..row("autoware", None, "A folder with a PCD file per grid square, and Autoware's metadata",
              files!(autoware::AutowareSink::create)) },
    OutputFormat { takes: &[],
        refusal: "it always contains the occupied voxels of the whole map in map coordinates; for a part, create a \
                  smaller map with `voxtile crop`",
        ..row("3dtiles", None,
              "A folder of 3D Tiles: the surface at every level of detail, for Cesium and others",
              Writer::Tileset) },
];

impl OutputFormat {
    /// Surface of occupied voxels as binary glTF, which 3D Tiles also consist of.
    pub const GLB: Self = Self {
        takes: &[Region, Which, Classes, Quantized],
        ..row(
            "glb",
            Some("glb"),
            "The surface of occupied voxels as binary glTF, Y-up",
            files!(glb::GlbSink::create),
        )
    };
}

/// Output formats of maps.
#[derive(Clone, Debug)]
pub struct OutputFormats {
    rows: Vec<OutputFormat>,
}

impl Default for OutputFormats {
    /// All formats of this crate, including those not available in this build.
    fn default() -> Self {
        Self { rows: TABLE.to_vec() }
    }
}

impl OutputFormats {
    /// Adds a format.
    pub fn with(mut self, format: OutputFormat) -> Self {
        self.rows.push(format);
        self
    }

    /// Returns all formats, in the order of help texts.
    pub fn all(&self) -> &[OutputFormat] {
        &self.rows
    }

    /// Returns the format with this name, such as `nav2` or `copc`, in any case.
    pub fn of_name(&self, name: &str) -> Option<&OutputFormat> {
        self.rows.iter().find(|format| format.name.eq_ignore_ascii_case(name))
    }

    /// Returns the format with the extension of a file name. Folder formats have none.
    pub fn of_path(&self, path: &Path) -> Option<&OutputFormat> {
        let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
        let name = name.strip_suffix(".tiff").map_or(name.clone(), |before| format!("{before}.tif"));
        let is_end = |end: &str| name.strip_suffix(end).is_some_and(|before| before.ends_with('.'));
        let found = self.rows.iter().filter(|format| format.extension.is_some_and(is_end));
        // `.copc.laz` also ends with `.laz`.
        found.max_by_key(|format| format.extension.map_or(0, str::len))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_extensions_select_formats() {
        let formats = OutputFormats::default();
        let of_path = |name: &str| formats.of_path(Path::new(name)).map(|format| format.name);
        for format in formats.all() {
            assert_eq!(formats.of_name(format.name).map(|found| found.name), Some(format.name));
            if let Some(extension) = format.extension {
                let name = format!("a.b/hall.2.{}", extension.to_ascii_uppercase());
                assert_eq!(of_path(&name), Some(format.name));
            }
        }
        assert_eq!(of_path("hall.TIFF"), Some("geotiff"));
        assert_eq!(of_path("hall.copc"), None);
        assert_eq!(of_path("laz"), None);
        assert_eq!(of_path("copc.laz"), Some("laz"));
    }
}
