use super::options::WriteOptions;
use super::out_file::OutFile;
use super::row::{RowLayers, VoxelRow, VoxelSink, VoxelsHead};
use super::sort::part;
use super::spool::Spool;
use super::{Error, Result};
use ::e57::{E57Writer, Record, RecordDataType, RecordName, RecordValue};
use std::path::{Path, PathBuf};
use voxtile::Layers;

/// Three 64-bit coordinates, a 32-bit intensity, and a colour.
const RECORD_BYTES: u64 = 31;
/// Number of points to read back at once.
const BATCH: u64 = 4096;

/// Writer of an E57 point cloud with coordinates in double precision, and probabilities as intensities unless the map
/// has the layer.
///
/// The library's point writer borrows its file for its whole lifetime, so points are first stored in a temporary file.
pub(super) struct E57Sink {
    out: OutFile,
    points: Spool,
    layers: Layers,
    crs: Option<String>,
}

impl E57Sink {
    pub(super) fn create(head: &VoxelsHead, path: &Path, options: &WriteOptions) -> Result<Self> {
        let points = Spool::new(&options.scratch_folder)?;
        let crs = options.crs.as_deref().map(as_cdata).transpose()?;
        Ok(Self { out: OutFile::create(path)?, points, layers: head.layers, crs })
    }
}

impl VoxelSink for E57Sink {
    fn put(&mut self, voxel: &VoxelRow) -> Result<()> {
        let RowLayers { colour, intensity, .. } = voxel.layers;
        // E57's marks of invalid values are not written: pye57 refuses files that have them.
        let intensity = match self.layers.intensity_max {
            // A mean can exceed the largest value by rounding.
            Some(max) => intensity.map_or(0.0, |mean| (mean as f32).min(max)),
            None => voxel.probability.clamp(0.0, 1.0) as f32,
        };
        self.points.write(voxel.center_m.map(f64::to_le_bytes).as_flattened())?;
        self.points.write(&intensity.to_le_bytes())?;
        self.points.write(&colour.unwrap_or_default())
    }

    fn finish(self: Box<Self>) -> Result<()> {
        let Self { mut out, points, layers, crs } = *self;
        let path: PathBuf = out.path().to_owned();
        let refused = |error: ::e57::Error| Error::io(&path, "write", std::io::Error::other(error));
        let bytes = points.len();
        let mut reader = points.into_reader()?;
        let mut file = E57Writer::new(&mut out, &guid(bytes, 1)).map_err(refused)?;
        file.set_coordinate_metadata(crs);
        let mut cloud = file.add_pointcloud(&guid(bytes, 2), records_of(&layers)).map_err(refused)?;
        cloud.set_name(Some("voxels".to_owned()));
        let mut batch = Vec::new();
        let mut at = 0;
        while at < bytes {
            reader.read_at(at, &mut batch, BATCH * RECORD_BYTES)?;
            at += BATCH * RECORD_BYTES;
            for record in batch.chunks(RECORD_BYTES as usize) {
                let [x, y, z] = [0, 8, 16].map(|k| RecordValue::Double(f64::from_le_bytes(part(record, k))));
                let mut values = vec![x, y, z, RecordValue::Single(f32::from_le_bytes(part(record, 24)))];
                if layers.colour {
                    values.extend(part::<3>(record, 28).map(|channel| RecordValue::Integer(channel.into())));
                }
                cloud.add_point(values).map_err(refused)?;
            }
        }
        cloud.finalize().map_err(refused)?;
        file.finalize().map_err(refused)?;
        drop(file);
        out.finish()
    }
}

/// Returns the fields of a point.
fn records_of(layers: &Layers) -> Vec<Record> {
    let record = |name, data_type| Record { name, data_type };
    let mut records = vec![Record::CARTESIAN_X_F64, Record::CARTESIAN_Y_F64, Record::CARTESIAN_Z_F64];
    records.push(match layers.intensity_max {
        Some(max) => record(RecordName::Intensity, RecordDataType::Single { min: Some(0.0), max: Some(max) }),
        None => Record::INTENSITY_UNIT_F32,
    });
    if layers.colour {
        let channels = [RecordName::ColorRed, RecordName::ColorGreen, RecordName::ColorBlue];
        records.extend(channels.map(|name| record(name, RecordDataType::Integer { min: 0, max: 255 })));
    }
    records
}

/// Escapes the text of a coordinate system, which the library writes as a CDATA section. `]]>` within the text is split
/// between two sections, which readers join.
fn as_cdata(crs: &str) -> Result<String> {
    let is_xml = |c: char| matches!(c, '\t' | '\n' | '\r' | ' '..='\u{fffd}' | '\u{10000}'..);
    if let Some(c) = crs.chars().find(|c| !is_xml(*c)) {
        let reason =
            format!("contains the character {c:?}, which E57 does not support: export .las, .laz or .ply");
        return Err(Error::argument("coordinate reference system", reason));
    }
    Ok(crs.replace("]]>", "]]]]><![CDATA[>"))
}

/// Returns a GUID for a file or cloud. It is unique within a file and the same for the same voxels.
fn guid(bytes: u64, number: u16) -> String {
    format!("{{766f7874-696c-{number:04x}-8000-{:012x}}}", bytes & 0xffff_ffff_ffff)
}

#[cfg(test)]
mod tests {
    use super::super::testing::{head_of, row};
    use super::*;
    use ::e57::{CartesianCoordinate, E57Reader};

    fn crs_read_back(crs: &str) -> Result<Option<String>> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.e57");
        let options = WriteOptions { crs: Some(crs.to_owned()), ..WriteOptions::for_path(&path) };
        let voxel = row([1, 2, 3], 0.75);
        let mut sink = Box::new(E57Sink::create(&head_of(&[voxel]), &path, &options)?);
        sink.put(&voxel).unwrap();
        sink.finish().unwrap();
        Ok(E57Reader::from_file(&path).unwrap().coordinate_metadata().map(str::to_owned))
    }

    #[test]
    fn every_coordinate_system_is_readable_or_refused() {
        for crs in ["EPSG:25832", "PROJCS[\"a & b <c>\",\n\tUNIT[\"metre\",1]]", "a]]>b]]]>c]]", "]]>"] {
            assert_eq!(crs_read_back(crs).unwrap().as_deref(), Some(crs));
        }
        for crs in ["EPSG:25832\0", "a\u{1b}[2J", "\u{ffff}"] {
            let error = crs_read_back(crs).unwrap_err().to_string();
            assert!(error.contains("E57") && error.contains(".laz"), "{error}");
        }
    }

    #[test]
    fn points_round_trip() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.e57");
        let rows: Vec<_> = (0..5000).map(|k| row([k, -k, 3], 0.75)).collect();
        let options = WriteOptions::for_path(&path);
        let mut sink = Box::new(E57Sink::create(&head_of(&rows), &path, &options).unwrap());
        rows.iter().for_each(|row| sink.put(row).unwrap());
        sink.finish().unwrap();
        let mut reader = E57Reader::from_file(&path).unwrap();
        let cloud = reader.pointclouds().remove(0);
        let points: Vec<_> = reader.pointcloud_simple(&cloud).unwrap().collect::<::e57::Result<_>>().unwrap();
        assert_eq!(points.len(), rows.len());
        for (point, row) in points.iter().zip(&rows) {
            let [x, y, z] = row.center_m;
            assert_eq!(point.cartesian, CartesianCoordinate::Valid { x, y, z });
            assert_eq!(point.intensity, Some(0.75));
        }
    }

    #[test]
    fn colours_and_intensities_round_trip() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.e57");
        let layers = Layers { colour: true, intensity_max: Some(100.0), ..Layers::NONE };
        let mut rows: Vec<_> = (0..300).map(|k| row([k, 0, 0], 0.75)).collect();
        for (k, row) in rows.iter_mut().enumerate().filter(|(k, _)| k % 7 > 0) {
            // The last one is above the largest by rounding.
            let intensity = if k == 299 { 100.000_01 } else { k as f64 / 3.0 };
            (row.layers.colour, row.layers.intensity) = (Some([k as u8, 2, 255]), Some(intensity));
        }
        let head = VoxelsHead { layers, ..head_of(&rows) };
        let mut sink = Box::new(E57Sink::create(&head, &path, &WriteOptions::for_path(&path)).unwrap());
        rows.iter().for_each(|row| sink.put(row).unwrap());
        sink.finish().unwrap();
        let mut reader = E57Reader::from_file(&path).unwrap();
        let cloud = reader.pointclouds().remove(0);
        let mut simple = reader.pointcloud_simple(&cloud).unwrap();
        simple.normalize_intensity(false);
        let points: Vec<_> = simple.collect::<::e57::Result<_>>().unwrap();
        for (point, row) in points.iter().zip(&rows) {
            let RowLayers { colour, intensity, .. } = row.layers;
            let found = point.color.as_ref().unwrap();
            let found = [found.red, found.green, found.blue].map(|channel| (255.0 * channel).round() as u8);
            assert_eq!(found, colour.unwrap_or_default());
            assert_eq!(point.intensity, Some(intensity.unwrap_or(0.0).min(100.0) as f32));
        }
    }
}
