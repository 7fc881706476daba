//! Polygons of GeoJSON files.

use serde_json::Value;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use voxtile::mapper::MapView;
use voxtile::space::{Area, AreaRing};
use voxtile::{Error, FormatError, Result};
use voxtile_formats::epsg_code;

/// Maximum size of a file: it is read into memory.
const MAX_BYTES: u64 = 256 << 20;

/// EPSG code of longitude and latitude, the coordinates of GeoJSON files that name no system.
const LONGITUDE_LATITUDE: u16 = 4326;

/// Polygons of a GeoJSON file.
#[derive(Clone, Debug)]
pub struct PolygonFile {
    path: PathBuf,
    area: Area,
    /// EPSG code of the coordinates, if the file names one, as files of earlier versions of GeoJSON do.
    epsg: Option<u16>,
}

impl PolygonFile {
    /// Reads the polygons of a file: a Polygon, a MultiPolygon, or features or collections of these.
    ///
    /// # Errors
    ///
    /// The file cannot be read, is no GeoJSON, has no polygon, or has other geometries.
    pub fn read(path: &Path) -> Result<Self> {
        let mut text = Vec::new();
        let read = |file: File| file.take(MAX_BYTES + 1).read_to_end(&mut text);
        File::open(path).and_then(read).map_err(|error| Error::io(path, "read", error))?;
        let wrong = |reason: String| Error::argument(path.display().to_string(), reason);
        if text.len() as u64 > MAX_BYTES {
            return Err(wrong(format!("is larger than {} MiB", MAX_BYTES >> 20)));
        }
        if text.iter().all(u8::is_ascii_whitespace) {
            return Err(wrong(
                "is empty; a GeoJSON file with a Polygon or MultiPolygon is needed".to_owned(),
            ));
        }
        let whole: Value = serde_json::from_slice(&text).map_err(|error| {
            let reason = format!("is no valid JSON: {error}");
            FormatError::at_line(error.line() as u64, reason).in_input(path)
        })?;
        let mut polygons = Vec::new();
        add_polygons(&whole, &mut polygons).map_err(wrong)?;
        let area = Area::new(&polygons).map_err(|error| wrong(error.to_string()))?;
        Ok(Self { path: path.to_owned(), area, epsg: epsg_of(&whole) })
    }

    /// Returns the area of the polygons in the coordinates of a map.
    ///
    /// # Errors
    ///
    /// The coordinates are in another system than the map's, or seem to be.
    pub fn area_in(&self, map: &impl MapView) -> Result<Area> {
        let own = map.config().crs.as_deref();
        let own_epsg = own.and_then(epsg_code);
        let wrong = |found: String| {
            let (convert, wanted) = match own_epsg {
                Some(code) => {
                    (format!("`ogr2ogr -t_srs EPSG:{code} NEW.geojson OLD.geojson`"), format!("EPSG:{code}"))
                }
                None => {
                    ("`ogr2ogr -t_srs`".to_owned(), own.map_or("metres", |_| "another system").to_owned())
                }
            };
            let reason = format!(
                "its coordinates {found}, but those of the map are in {wanted}: convert the file, for instance with \
                 {convert}"
            );
            Err(Error::argument(self.path.display().to_string(), reason))
        };
        if let (Some(found), Some(own)) = (self.epsg, own_epsg)
            && found != own
        {
            return wrong(format!("are in EPSG:{found}"));
        }
        let is_same = self.epsg.is_some() && self.epsg == own_epsg;
        if !is_same && self.may_be_degrees() && !self.touches(map) {
            return wrong("look like longitude and latitude".to_owned());
        }
        Ok(self.area.clone())
    }

    fn may_be_degrees(&self) -> bool {
        let limits = [180.0, 90.0];
        self.area.bounds_m().iter().all(|corner| (0..2).all(|k| corner[k].abs() <= limits[k]))
    }

    /// Returns whether the polygons and the map's tiles have common coordinates.
    fn touches(&self, map: &impl MapView) -> bool {
        let tile_m = map.config().grid.tile_size_m();
        let Some(tiles) = map.tile_bounds() else { return true };
        let (first, last) = (tiles.min().to_array(), tiles.max().to_array());
        let [least, most] = self.area.bounds_m();
        (0..2).all(|k| {
            least[k] <= (f64::from(last[k]) + 1.0) * tile_m && most[k] >= f64::from(first[k]) * tile_m
        })
    }
}

/// Adds the polygons of an object. The error is the reason why it has none.
fn add_polygons(object: &Value, polygons: &mut Vec<Vec<AreaRing>>) -> std::result::Result<(), String> {
    let list = |name: &str| {
        object[name].as_array().ok_or_else(|| format!("has no list `{name}` where GeoJSON has one"))
    };
    match object["type"].as_str() {
        Some("FeatureCollection") => list("features")?.iter().try_for_each(|one| add_polygons(one, polygons)),
        Some("GeometryCollection") => {
            list("geometries")?.iter().try_for_each(|one| add_polygons(one, polygons))
        }
        Some("Feature") if object["geometry"].is_null() => Ok(()),
        Some("Feature") => add_polygons(&object["geometry"], polygons),
        Some("MultiPolygon") => list("coordinates")?.iter().try_for_each(|one| add_polygon(one, polygons)),
        Some("Polygon") => add_polygon(&object["coordinates"], polygons),
        Some(other) => Err(format!("has a {other}; a Polygon or MultiPolygon is needed")),
        None => Err("is no GeoJSON: an object has no `type`".to_owned()),
    }
}

fn add_polygon(rings: &Value, polygons: &mut Vec<Vec<AreaRing>>) -> std::result::Result<(), String> {
    let number = polygons.len();
    let wrong = || format!("polygon {number}: its coordinates are no rings of corners [x, y]");
    let corner = |corner: &Value| Some([corner.get(0)?.as_f64()?, corner.get(1)?.as_f64()?]);
    let ring = |ring: &Value| ring.as_array()?.iter().map(corner).collect::<Option<AreaRing>>();
    let rings = rings.as_array().and_then(|rings| rings.iter().map(ring).collect::<Option<Vec<_>>>());
    polygons.push(rings.ok_or_else(wrong)?);
    Ok(())
}

/// Returns the EPSG code that an object names: `{"crs": {"properties": {"name": "urn:ogc:def:crs:EPSG::25832"}}}`.
fn epsg_of(object: &Value) -> Option<u16> {
    let name = object["crs"]["properties"]["name"].as_str()?;
    if name.ends_with("CRS84") {
        return Some(LONGITUDE_LATITUDE);
    }
    let (authority, code) = name.rsplit_once(':')?;
    authority.to_ascii_uppercase().contains("EPSG").then(|| code.parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<PolygonFile> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("area.geojson");
        std::fs::write(&path, text).unwrap();
        PolygonFile::read(&path)
    }

    const SQUARE: &str = "[[[0, 0], [4, 0], [4, 4, 7.5], [0, 4], [0, 0]], [[1, 1], [2, 1], [1, 2]]]";

    #[test]
    fn polygons_are_found_in_all_objects() {
        let polygon = format!(r#"{{"type": "Polygon", "coordinates": {SQUARE}}}"#);
        let multi = format!(
            r#"{{"type": "MultiPolygon", "coordinates": [{SQUARE}, [[[-9, 0], [-8, 0], [-9, 9.5]]]]}}"#
        );
        let feature = format!(r#"{{"type": "Feature", "properties": null, "geometry": {multi}}}"#);
        let null = r#"{"type": "Feature", "geometry": null}"#;
        let features = format!(r#"{{"type": "FeatureCollection", "features": [{null}, {feature}]}}"#);
        let geometries = format!(r#"{{"type": "GeometryCollection", "geometries": [{polygon}, {multi}]}}"#);
        assert_eq!(read(&polygon).unwrap().area.bounds_m(), [[0.0, 0.0], [4.0, 4.0]]);
        for text in [multi, feature, features, geometries] {
            assert_eq!(read(&text).unwrap().area.bounds_m(), [[-9.0, 0.0], [4.0, 9.5]], "{text}");
        }
    }

    #[test]
    fn named_systems_are_read() {
        let of = |name: &str| {
            let crs = format!(r#"{{"type": "name", "properties": {{"name": "{name}"}}}}"#);
            read(&format!(r#"{{"type": "Polygon", "crs": {crs}, "coordinates": {SQUARE}}}"#)).unwrap().epsg
        };
        assert_eq!(of("urn:ogc:def:crs:EPSG::25832"), Some(25832));
        assert_eq!(of("EPSG:3857"), Some(3857));
        assert_eq!(of("urn:ogc:def:crs:OGC:1.3:CRS84"), Some(4326));
        assert_eq!(of("hall"), None);
    }

    #[test]
    fn files_without_polygons_are_refused() {
        let polygon = |rings: &str| format!(r#"{{"type": "Polygon", "coordinates": {rings}}}"#);
        let cases = [
            (String::new(), "is empty"),
            (" \n".to_owned(), "is empty"),
            ("{\n\"type\": Polygon}".to_owned(), "line 2"),
            ("[]".to_owned(), "has no `type`"),
            (r#"{"type": "Point", "coordinates": [1, 2]}"#.to_owned(), "has a Point; a Polygon"),
            (r#"{"type": "FeatureCollection", "features": []}"#.to_owned(), "there is no polygon"),
            (r#"{"type": "FeatureCollection"}"#.to_owned(), "no list `features`"),
            (polygon("[]"), "there is no polygon"),
            (polygon("[[[0, 0], [1, 1], [0, 0]]]"), "2 different corners"),
            (polygon(r#"[[[0, 0], [1, "1"], [0, 1]]]"#), "no rings of corners"),
            (polygon("[[0, 0], [1, 1], [0, 1]]"), "no rings of corners"),
            (polygon("[[[0, NaN], [1, 1], [0, 1]]]"), "line 1"),
            (polygon("[[[0, 1e999], [1, 1], [0, 1]]]"), "out of range"),
        ];
        for (text, expected) in cases {
            let error = format!("{:#}", anyhow::Error::new(read(&text).unwrap_err()));
            assert!(error.contains("area.geojson") && error.contains(expected), "{text}: {error}");
        }
        let error = PolygonFile::read(Path::new("nothing.geojson")).unwrap_err().to_string();
        assert!(error.contains("nothing.geojson"), "{error}");
    }
}
