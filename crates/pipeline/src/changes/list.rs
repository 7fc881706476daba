use crate::output::OutputFile;
use serde_json::{Value, json};
use std::io::{self, Write};
use std::path::Path;
use voxtile::{Error, Result};
use voxtile_compare::{Change, Comparison};
use voxtile_formats::epsg_code;

/// Format of a list of changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ListFormat {
    /// A line of text per change.
    Csv,
    /// An object with the counts and all changes.
    Json,
    /// A feature per change: the rectangle around it.
    GeoJson,
}

impl ListFormat {
    /// Returns the format of a path, by its extension.
    ///
    /// # Errors
    ///
    /// The extension is unknown.
    pub fn of_path(path: &Path) -> Result<Self> {
        let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        match extension.to_ascii_lowercase().as_str() {
            "csv" => Ok(Self::Csv),
            "json" => Ok(Self::Json),
            "geojson" => Ok(Self::GeoJson),
            _ => {
                let reason = format!("{}: a list of changes is .csv, .json or .geojson", path.display());
                Err(Error::argument("list", reason))
            }
        }
    }
}

/// Writes the list of changes, in metres. `crs` is the coordinate reference system of the maps.
///
/// # Errors
///
/// The extension is unknown, or the file cannot be written.
pub fn write_change_list(comparison: &Comparison, crs: Option<&str>, output: &Path) -> anyhow::Result<()> {
    let format = ListFormat::of_path(output)?;
    let mut file = OutputFile::create(output)?;
    let written = match format {
        ListFormat::Csv => write_csv(&comparison.changes, file.out()),
        ListFormat::Json => write_json(&serde_json::to_value(comparison)?, file.out()),
        ListFormat::GeoJson => write_json(&change_features(&comparison.changes, crs), file.out()),
    };
    file.written(written)?;
    file.finish()
}

fn write_csv(changes: &[Change], out: &mut impl Write) -> io::Result<()> {
    writeln!(
        out,
        "number,kind,voxels,volume_m3,min_x,min_y,min_z,max_x,max_y,max_z,center_x,center_y,center_z,red,green,blue,\
         class,first_ns,last_ns"
    )?;
    for change in changes {
        write!(out, "{},{},{},{}", change.number, change.kind.name(), change.voxels, change.volume_m3)?;
        for coordinate in change.bounds_m.min.iter().chain(&change.bounds_m.max).chain(&change.center_m) {
            write!(out, ",{coordinate}")?;
        }
        let layers = colours(change).into_iter().chain([change.class.map(i64::from)]);
        for value in layers.chain([0, 1].map(|k| change.time_ns.map(|time_ns| time_ns[k]))) {
            write!(out, ",{}", value.map_or(String::new(), |value| value.to_string()))?;
        }
        writeln!(out)?;
    }
    Ok(())
}

fn colours(change: &Change) -> [Option<i64>; 3] {
    [0, 1, 2].map(|k| change.colour.map(|colour| i64::from(colour[k])))
}

fn write_json(value: &Value, out: &mut impl Write) -> io::Result<()> {
    serde_json::to_writer_pretty(&mut *out, value)?;
    writeln!(out)
}

/// Returns the changes as GeoJSON. Coordinates are those of the map, whose system is named as in GeoJSON before RFC 7946,
/// which GDAL and QGIS read.
pub fn change_features(changes: &[Change], crs: Option<&str>) -> Value {
    let feature = |change: &Change| {
        let ([x0, y0, z0], [x1, y1, z1]) = (change.bounds_m.min, change.bounds_m.max);
        json!({
            "type": "Feature",
            "geometry": {
                "type": "Polygon",
                "coordinates": [[[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]]],
            },
            "properties": {
                "number": change.number,
                "kind": change.kind.name(),
                "voxels": change.voxels,
                "volume_m3": change.volume_m3,
                "z_min": z0,
                "z_max": z1,
                "colour": change.colour.map(|[red, green, blue]| format!("#{red:02x}{green:02x}{blue:02x}")),
                "class": change.class,
                "first_ns": change.time_ns.map(|[first, _]| first),
                "last_ns": change.time_ns.map(|[_, last]| last),
            },
        })
    };
    let mut collection = json!({
        "type": "FeatureCollection",
        "features": changes.iter().map(feature).collect::<Vec<_>>(),
    });
    if let Some(code) = crs.and_then(epsg_code) {
        let name = format!("urn:ogc:def:crs:EPSG::{code}");
        collection["crs"] = json!({ "type": "name", "properties": { "name": name } });
    }
    collection
}
