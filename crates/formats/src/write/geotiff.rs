use super::column_grid::nothing_to_draw;
use super::height_range::HeightRange;
use super::lattice::Lattice;
use super::options::WriteOptions;
use super::out_file::OutFile;
use super::row::{RowLayers, VoxelRow, VoxelSink, VoxelsHead};
use super::sorted_columns::{Column, SortedColumns};
use super::tiff_file::{TiffFile, Values};
use super::{Error, FileUnit, Result};
use crate::crs_codes::{CrsCodes, FlatCode};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Edge of a tile of the image, in columns of voxels.
const TILE_EDGE: usize = 256;

/// Maximum number of tiles of the image: the file stores the place of each.
const MAX_TILES: u64 = 1 << 22;

/// Names of the bands of heights, without their unit.
const HEIGHTS: [&str; 3] = [
    "top of the highest occupied voxel",
    "bottom of the lowest occupied voxel",
    "mean height of the centers of the occupied voxels",
];

/// Band of the values of the highest occupied voxels.
struct LayerBand {
    name: &'static str,
    value: fn(&RowLayers) -> Option<f32>,
}

const COLOUR_BANDS: [LayerBand; 3] = [
    LayerBand { name: "red", value: |top| Some(top.colour?[0].into()) },
    LayerBand { name: "green", value: |top| Some(top.colour?[1].into()) },
    LayerBand { name: "blue", value: |top| Some(top.colour?[2].into()) },
];
const INTENSITY_BAND: LayerBand =
    LayerBand { name: "intensity", value: |top| top.intensity.map(|mean| mean as f32) };
const CLASS_BAND: LayerBand = LayerBand { name: "class", value: |top| top.class.map(f32::from) };

/// Writer of the heights of occupied voxels as a GeoTIFF of three bands, and of the layers of the highest ones in
/// further bands.
pub(super) struct GeoTiffSink {
    file: TiffFile,
    head: VoxelsHead,
    options: WriteOptions,
    heights: HeightRange,
    layer_bands: Vec<LayerBand>,
    raster: Option<Raster>,
}

/// Place of the image, and its columns.
struct Raster {
    lattice: Lattice,
    /// Indices of the voxels in the upper left cell: the lowest along x, the highest along y.
    first_x: i64,
    first_y: i64,
    /// Columns and rows.
    size: [u32; 2],
    /// Tiles along x and y.
    tiles: [u64; 2],
    columns: SortedColumns,
}

impl GeoTiffSink {
    pub(super) fn create(head: &VoxelsHead, path: &Path, options: &WriteOptions) -> Result<Self> {
        let heights = HeightRange::of(options)?;
        let mut layer_bands = Vec::new();
        layer_bands.extend(COLOUR_BANDS.into_iter().filter(|_| head.layers.colour));
        layer_bands.extend(Some(INTENSITY_BAND).filter(|_| head.layers.intensity_max.is_some()));
        layer_bands.extend(Some(CLASS_BAND).filter(|_| head.layers.class));
        Ok(Self {
            file: TiffFile::create(path)?,
            head: head.clone(),
            options: options.clone(),
            heights,
            layer_bands,
            raster: None,
        })
    }
}

impl Raster {
    /// Creates the raster of the bounding box in `head`. The first voxel relates indices to coordinates.
    fn new(head: &VoxelsHead, first: &VoxelRow, scratch: &Path) -> Result<Self> {
        let lattice = Lattice::of(first, head.resolution_m);
        let [lowest, highest] = head.bounds_m.map(|corner| lattice.index_at(corner));
        let size = [0, 1].map(|k| highest[k].saturating_sub(lowest[k]).saturating_add(1).max(1) as u64);
        let tiles = size.map(|columns| columns.div_ceil(TILE_EDGE as u64));
        let is_small = tiles[0].checked_mul(tiles[1]).is_some_and(|tiles| tiles <= MAX_TILES);
        let [Ok(width), Ok(height)] = size.map(u32::try_from) else { return Err(too_large(size)) };
        if !is_small {
            return Err(too_large(size));
        }
        let (first_x, first_y) = (lowest[0], highest[1]);
        let columns = SortedColumns::new(scratch);
        Ok(Self { lattice, first_x, first_y, size: [width, height], tiles, columns })
    }

    /// Returns the tile of a voxel's column, and its place in the tile.
    fn place_of(&self, voxel: &VoxelRow) -> Result<(u32, u16)> {
        let (x, y) = (i64::from(voxel.index[0]) - self.first_x, self.first_y - i64::from(voxel.index[1]));
        let inside = |at: i64, k: usize| u64::try_from(at).ok().filter(|&at| at < u64::from(self.size[k]));
        let (x, y) = inside(x, 0).zip(inside(y, 1)).ok_or_else(|| {
            let reason = format!("voxel {:?} is outside of the announced bounds", voxel.index);
            Error::argument("geotiff", reason)
        })?;
        let edge = TILE_EDGE as u64;
        // Neither is larger: there are at most MAX_TILES tiles, of 2^16 columns.
        Ok(((y / edge * self.tiles[0] + x / edge) as u32, (y % edge * edge + x % edge) as u16))
    }

    /// Returns the three heights of a column with occupied voxels, in metres.
    fn heights_of(&self, column: &Column, resolution_m: f64) -> [f32; 3] {
        let height = |z: i64| self.lattice.corner_m([0, 0, z])[2];
        let mean = column.sum as f64 / f64::from(column.count) + 0.5;
        let heights_m = [
            height(i64::from(column.highest) + 1),
            height(i64::from(column.lowest)),
            height(0) + mean * resolution_m,
        ];
        heights_m.map(|height_m| height_m as f32)
    }
}

fn too_large([width, height]: [u64; 2]) -> Error {
    let reason = format!(
        "{width} x {height} columns of voxels are too many for an image of {MAX_TILES} tiles: choose a region, or use \
         coarser voxels"
    );
    Error::argument("geotiff", reason)
}

impl VoxelSink for GeoTiffSink {
    fn put(&mut self, voxel: &VoxelRow) -> Result<()> {
        let raster = match &mut self.raster {
            Some(raster) => raster,
            none => none.insert(Raster::new(&self.head, voxel, &self.options.scratch_folder)?),
        };
        let (tile, place) = raster.place_of(voxel)?;
        if voxel.log_odds >= self.head.occupied_log_odds && self.heights.meets(voxel, self.head.resolution_m)
        {
            let map_tile = [voxel.tile[0], voxel.tile[1]];
            raster.columns.add(tile, place, voxel.index[2], &voxel.layers, map_tile)?;
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        let mut raster = self.raster.take().ok_or_else(nothing_to_draw)?;
        let path = self.file.path().to_owned();
        let blank = f32::NAN.to_le_bytes().repeat(TILE_EDGE * TILE_EDGE);
        // All empty tiles are one.
        let empty = append(&mut self.file, &path, &blank)?;
        let mut places: BTreeMap<u64, Vec<(u64, u64)>> = BTreeMap::new();
        let sorted = std::mem::replace(&mut raster.columns, SortedColumns::new(&self.options.scratch_folder));
        let mut parts = sorted.into_parts()?;
        let mut next = parts.next()?;
        let count = HEIGHTS.len() + self.layer_bands.len();
        let mut bands = vec![blank.clone(); count];
        while let Some((tile, ..)) = next {
            bands.iter_mut().for_each(|band| band.copy_from_slice(&blank));
            while let Some((_, place, mut column)) = next.filter(|(of, ..)| *of == tile) {
                next = parts.next()?;
                while let Some((.., part)) = next.filter(|(of, at, _)| (*of, *at) == (tile, place)) {
                    column.add(&part);
                    next = parts.next()?;
                }
                let heights = raster.heights_of(&column, self.head.resolution_m);
                let layers =
                    self.layer_bands.iter().map(|band| (band.value)(&column.top).unwrap_or(f32::NAN));
                for (band, value) in bands.iter_mut().zip(heights.into_iter().chain(layers)) {
                    let at = 4 * usize::from(place);
                    band[at..at + 4].copy_from_slice(&value.to_le_bytes());
                }
            }
            let of_tile = bands.iter().map(|band| append(&mut self.file, &path, band));
            let of_tile = of_tile.collect::<Result<_>>()?;
            places.insert(u64::from(tile), of_tile);
        }
        let tiles = raster.tiles[0] * raster.tiles[1];
        let place = |at: u64| places.get(&(at % tiles)).map_or(empty, |bands| bands[(at / tiles) as usize]);
        let (offsets, lengths) = (|at: u64| place(at).0, |at: u64| place(at).1);
        let all = count as u64 * tiles;
        let fields = self.fields(&raster, Values::Places(all, &offsets), Values::Places(all, &lengths));
        let wkt = self.options.crs.as_deref().filter(|crs| needs_wkt(crs));
        if let Some(wkt) = wkt {
            write_aux(&aux_path(&self.options)?, wkt)?;
        }
        self.file.finish(&fields)
    }
}

impl GeoTiffSink {
    fn fields<'a>(
        &self,
        raster: &Raster,
        offsets: Values<'a>,
        lengths: Values<'a>,
    ) -> Vec<(u16, Values<'a>)> {
        let resolution_m = self.head.resolution_m;
        let [x, y, _] = raster.lattice.corner_m([raster.first_x, raster.first_y + 1, 0]);
        let bands = HEIGHTS.len() + self.layer_bands.len();
        let (keys, text) = geo_keys(self.options.crs.as_deref(), self.options.unit);
        let mut fields = vec![
            (256, Values::Longs(vec![raster.size[0]])),
            (257, Values::Longs(vec![raster.size[1]])),
            (258, Values::Shorts(vec![32; bands])),
            // Deflate.
            (259, Values::Shorts(vec![8])),
            // Photometric interpretation: small values are dark.
            (262, Values::Shorts(vec![1])),
            (277, Values::Shorts(vec![bands as u16])),
            // Each band has its own tiles.
            (284, Values::Shorts(vec![2])),
            (305, Values::Text(concat!("voxtile ", env!("CARGO_PKG_VERSION")).to_owned())),
            (322, Values::Longs(vec![TILE_EDGE as u32])),
            (323, Values::Longs(vec![TILE_EDGE as u32])),
            (324, offsets),
            (325, lengths),
            // The bands after the first have no meaning that TIFF defines.
            (338, Values::Shorts(vec![0; bands - 1])),
            // Floating-point numbers.
            (339, Values::Shorts(vec![3; bands])),
            (33550, Values::Doubles(vec![resolution_m, resolution_m, 0.0])),
            // The upper left corner of the image is at this point.
            (33922, Values::Doubles(vec![0.0, 0.0, 0.0, x, y, 0.0])),
        ];
        if !keys.is_empty() {
            fields.push((34735, Values::Shorts(keys)));
        }
        if !text.is_empty() {
            fields.push((34737, Values::Text(text)));
        }
        let unit = self.options.unit.name();
        let heights = HEIGHTS.iter().map(|name| format!("{name}, {unit}"));
        let layers =
            self.layer_bands.iter().map(|band| format!("{} of the highest occupied voxel", band.name));
        let mut items = String::new();
        for (band, name) in heights.chain(layers).enumerate() {
            items +=
                &format!("<Item name=\"DESCRIPTION\" sample=\"{band}\" role=\"description\">{name}</Item>");
        }
        fields.push((42112, Values::Text(format!("<GDALMetadata>{items}</GDALMetadata>"))));
        fields.push((42113, Values::Text("nan".to_owned())));
        fields
    }
}

/// Compresses and appends a tile of a band. Returns its offset and length.
fn append(file: &mut TiffFile, path: &Path, band: &[u8]) -> Result<(u64, u64)> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    let compressed = encoder.write_all(band).and_then(|()| encoder.finish());
    let bytes = compressed.map_err(|error| Error::io(path, "compress", error))?;
    Ok((file.append(&bytes)?, bytes.len() as u64))
}

/// Returns whether a system has no EPSG code, so that its text is needed.
fn needs_wkt(crs: &str) -> bool {
    CrsCodes::of(crs).flat.is_none()
}

/// Returns the GeoTIFF keys of a coordinate system, and their text.
fn geo_keys(crs: Option<&str>, unit: FileUnit) -> (Vec<u16>, String) {
    const USER_DEFINED: u16 = 32767;
    let Some(crs) = crs else { return (Vec::new(), String::new()) };
    // Cells are areas, not points.
    let (mut keys, mut text) = (vec![[1025, 0, 1, 1]], String::new());
    let CrsCodes { flat, vertical } = CrsCodes::of(crs);
    match flat {
        Some(FlatCode::Projected(code)) => {
            keys.extend([[1024, 0, 1, 1], [3072, 0, 1, code], [3076, 0, 1, unit.epsg()]]);
        }
        Some(FlatCode::Geographic(code)) => keys.extend([[1024, 0, 1, 2], [2048, 0, 1, code]]),
        Some(FlatCode::Geocentric(code)) => keys.extend([[1024, 0, 1, 3], [2048, 0, 1, code]]),
        None => {
            // Parts of the text end with a bar; it is ASCII.
            let citation: String = crs.chars().filter(|c| c.is_ascii() && *c != '|').collect();
            text = citation.chars().take(usize::from(u16::MAX) - 1).collect::<String>() + "|";
            keys.extend([[1024, 0, 1, USER_DEFINED], [1026, 34737, text.len() as u16, 0]]);
        }
    }
    if let Some(code) = vertical {
        keys.push([4096, 0, 1, code]);
    }
    if vertical.is_some() || unit != FileUnit::Metre {
        keys.push([4099, 0, 1, unit.epsg()]);
    }
    keys.sort_unstable();
    let head = [1, 1, 0, keys.len() as u16];
    (head.into_iter().chain(keys.into_iter().flatten()).collect(), text)
}

/// Returns the path of the file from which GDAL reads what a GeoTIFF cannot hold.
fn aux_path(options: &WriteOptions) -> Result<PathBuf> {
    Ok(options.companion_folder.join(format!("{}.aux.xml", options.final_name()?)))
}

fn write_aux(path: &Path, wkt: &str) -> Result<()> {
    let escaped = wkt.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    let mut file = OutFile::create(path)?;
    file.write(format!("<PAMDataset>\n  <SRS>{escaped}</SRS>\n</PAMDataset>\n").as_bytes())?;
    file.finish()
}

#[cfg(test)]
mod tests {
    use super::super::testing::{head_of, row};
    use super::super::tiff_file::reader::fields_of;
    use super::*;
    use flate2::read::ZlibDecoder;
    use std::io::Read;
    use voxtile::Layers;

    /// Writes voxels. Returns the file and the fields of its directory.
    fn written(rows: &[VoxelRow], options: &WriteOptions) -> (Vec<u8>, BTreeMap<u64, Vec<u64>>) {
        written_with(Layers::NONE, rows, options)
    }

    /// The same, with layers.
    fn written_with(
        layers: Layers,
        rows: &[VoxelRow],
        options: &WriteOptions,
    ) -> (Vec<u8>, BTreeMap<u64, Vec<u64>>) {
        let path = &options.final_path;
        let head = VoxelsHead { layers, ..head_of(rows) };
        let mut sink = Box::new(GeoTiffSink::create(&head, path, options).unwrap());
        rows.iter().for_each(|row| sink.put(row).unwrap());
        sink.finish().unwrap();
        let bytes = std::fs::read(path).unwrap();
        let fields = fields_of(&bytes);
        (bytes, fields)
    }

    /// Returns the values of a cell in each band.
    fn cell(file: &(Vec<u8>, BTreeMap<u64, Vec<u64>>), column: usize, row: usize) -> Vec<f32> {
        let (bytes, fields) = file;
        let across = (fields[&256][0] as usize).div_ceil(TILE_EDGE);
        let bands = fields[&277][0] as usize;
        let tiles = fields[&324].len() / bands;
        let value = |band: usize| {
            let tile = band * tiles + row / TILE_EDGE * across + column / TILE_EDGE;
            let (at, length) = (fields[&324][tile] as usize, fields[&325][tile] as usize);
            let mut values = Vec::new();
            ZlibDecoder::new(&bytes[at..at + length]).read_to_end(&mut values).unwrap();
            assert_eq!(values.len(), 4 * TILE_EDGE * TILE_EDGE);
            let at = 4 * (row % TILE_EDGE * TILE_EDGE + column % TILE_EDGE);
            f32::from_le_bytes(values[at..at + 4].try_into().unwrap())
        };
        (0..bands).map(value).collect()
    }

    #[test]
    fn layers_are_those_of_the_highest_voxel() {
        let folder = tempfile::tempdir().unwrap();
        let options = WriteOptions::for_path(&folder.path().join("dem.tif"));
        let mut rows = [row([0; 3], 0.9), row([0, 0, 2], 0.9), row([0, 0, 5], 0.1), row([1, 0, 0], 0.9)];
        for (k, row) in rows[..3].iter_mut().enumerate() {
            let class = (k == 1).then_some(6);
            row.layers = RowLayers { colour: Some([k as u8, 20, 30]), class, ..RowLayers::NONE };
            row.layers.intensity = Some(0.5 + k as f64);
        }
        let layers = Layers { colour: true, intensity_max: Some(9.0), class: true, ..Layers::NONE };
        let file = written_with(layers, &rows, &options);
        assert_eq!([file.1[&258].len(), file.1[&338].len(), file.1[&339].len()], [8, 7, 8]);
        assert_eq!(cell(&file, 0, 0)[3..], [1.0, 20.0, 30.0, 1.5, 6.0]);
        assert!(cell(&file, 1, 0)[3..].iter().all(|value| value.is_nan()));
        let text: String = file.1[&42112].iter().map(|&byte| byte as u8 as char).collect();
        assert!(text.contains("sample=\"7\" role=\"description\">class of the highest"), "{text}");
        // Only the bands of existing layers.
        let class_alone = Layers { class: true, ..Layers::NONE };
        assert_eq!(cell(&written_with(class_alone, &rows, &options), 0, 0)[3..], [6.0]);
    }

    #[test]
    fn heights_are_those_of_the_occupied_voxels_of_a_column() {
        let folder = tempfile::tempdir().unwrap();
        let options = WriteOptions::for_path(&folder.path().join("dem.tif"));
        // Voxels of 0.5 m in three of the image's tiles; the free one does not count.
        let rows = [
            row([-3, 7, -4], 0.9),
            row([-3, 7, 1], 0.9),
            row([-3, 7, 2], 0.9),
            row([-3, 7, 9], 0.1),
            row([-2, 6, 3], 0.2),
            row([500, 7, 0], 0.9),
            row([-3, -400, 5], 0.5),
        ];
        let file = written(&rows, &options);
        assert_eq!([256, 257, 277].map(|tag| file.1[&tag][0]), [504, 408, 3]);
        assert_eq!(file.1[&324].len(), 12);
        assert_eq!(cell(&file, 0, 0), [1.5, -2.0, 1.0 / 12.0]);
        assert!(cell(&file, 1, 1).iter().all(|height| height.is_nan()));
        assert_eq!(cell(&file, 503, 0), [0.5, 0.0, 0.25]);
        assert_eq!(cell(&file, 0, 407), [3.0, 2.5, 2.75]);
        // The tile without a voxel is empty.
        assert!(cell(&file, 503, 407)[0].is_nan());
        let doubles = |tag: u64| file.1[&tag].iter().map(|&bits| f64::from_bits(bits)).collect::<Vec<_>>();
        assert_eq!(doubles(33550), [0.5, 0.5, 0.0]);
        assert_eq!(doubles(33922), [0.0, 0.0, 0.0, -1.5, 4.0, 0.0]);
        assert!(!file.1.contains_key(&34735), "no keys without a coordinate system");
        let low = written(&rows, &WriteOptions { z_max_m: Some(0.5), ..options });
        assert_eq!(cell(&low, 0, 0), [-1.5, -2.0, -1.75]);
    }

    #[test]
    fn coordinate_systems_are_stored_by_their_codes() {
        let keys = |crs: &str| geo_keys(Some(crs), FileUnit::Metre).0;
        assert_eq!(
            keys("EPSG:25832"),
            [1, 1, 0, 4, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, 25832, 3076, 0, 1, 9001]
        );
        let both =
            r#"COMPD_CS["x",PROJCS["a",AUTHORITY["EPSG","25832"]],VERT_CS["b",AUTHORITY["EPSG","7837"]]]"#;
        assert_eq!(keys(both)[16..], [3076, 0, 1, 9001, 4096, 0, 1, 7837, 4099, 0, 1, 9001]);
        let in_feet = geo_keys(Some("EPSG:2229"), FileUnit::UsSurveyFoot).0;
        assert_eq!(in_feet[12..], [3072, 0, 1, 2229, 3076, 0, 1, 9003, 4099, 0, 1, 9003]);
        // A system without a code is text, in a file that GDAL reads too.
        let folder = tempfile::tempdir().unwrap();
        let mut options = WriteOptions::for_path(&folder.path().join("dem.tif"));
        options.crs = Some("LOCAL_CS[\"hall <1>\"]".to_owned());
        let (_, fields) = written(&[row([0; 3], 0.9)], &options);
        assert_eq!(fields[&34735], [1, 1, 0, 3, 1024, 0, 1, 32767, 1025, 0, 1, 1, 1026, 34737, 21, 0]);
        assert_eq!(fields[&34737].len(), 22);
        let aux = std::fs::read_to_string(folder.path().join("dem.tif.aux.xml")).unwrap();
        assert!(aux.contains("<SRS>LOCAL_CS[\"hall &lt;1&gt;\"]</SRS>"), "{aux}");
    }

    #[test]
    fn images_that_are_too_large_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let options = WriteOptions::for_path(&folder.path().join("dem.tif"));
        let mut head = head_of(&[row([0; 3], 0.9)]);
        head.voxels = 1;
        for far in [1e6, f64::MAX] {
            head.bounds_m[1] = [far, far, 1.0];
            let mut sink = GeoTiffSink::create(&head, &options.final_path, &options).unwrap();
            let error = sink.put(&row([0; 3], 0.9)).unwrap_err().to_string();
            assert!(error.contains("choose a region"), "{error}");
        }
        let sink = Box::new(GeoTiffSink::create(&head, &options.final_path, &options).unwrap());
        assert!(sink.finish().unwrap_err().to_string().contains("no voxels"));
    }
}
