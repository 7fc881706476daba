use super::options::WriteOptions;
use super::out_file::OutFile;
use super::row::{RowLayers, VoxelRow, VoxelsHead};
use super::{Error, FileUnit, Result};
use ::las::raw::header::{Evlr, LargeFile};
use ::las::raw::vlr::RecordLength;
use ::las::raw::{Header, Vlr};
use std::io::{Seek, SeekFrom};
use voxtile::Layers;

/// Size of the extra bytes of a point: log-odds as f64, number of updates as i32.
pub(super) const EXTRA_BYTES: u16 = 12;
/// Maximum size of a point.
pub(super) const MAX_POINT_BYTES: usize = 36 + EXTRA_BYTES as usize;
/// Point format, and the same with colours.
const POINT_FORMAT: u8 = 6;
const COLOURED_FORMAT: u8 = 7;
/// Bit of the point format that marks compressed points.
const COMPRESSED: u8 = 0x80;
/// Size of the LAS 1.4 header.
const HEADER_BYTES: u16 = 375;

/// Conversion of voxels to LAS 1.4 points: scaled integers relative to an offset near the voxels.
#[derive(Clone, Debug)]
pub(super) struct LasLayout {
    /// A power of two. Since all offsets are integers, decoded coordinates have no additional rounding error.
    scale_m: f64,
    offset_m: [f64; 3],
    layers: Layers,
    /// Statistics of the points converted so far.
    points: u64,
    least: [i32; 3],
    most: [i32; 3],
}

impl LasLayout {
    /// Chooses a scale so that the error of a centre is at most a thousandth of a voxel, that of a mean point a ten
    /// thousandth, or a coarser one if 32-bit integers require it.
    ///
    /// # Errors
    ///
    /// The voxels are too far apart.
    pub(super) fn of(head: &VoxelsHead, options: &WriteOptions) -> Result<Self> {
        let [low, high] = head.bounds_m;
        let offset_m: [f64; 3] = std::array::from_fn(|k| (0.5 * (low[k] + high[k])).round());
        let reach = (0..3).map(|k| (high[k] - offset_m[k]).max(offset_m[k] - low[k])).fold(0.0, f64::max);
        let steps = if options.has_mean_points { 10_000.0 } else { 1000.0 };
        let mut scale_m = (head.resolution_m / steps).log2().floor().exp2();
        while reach / scale_m > f64::from(i32::MAX - 1) && scale_m < head.resolution_m {
            scale_m *= 2.0;
        }
        if scale_m > head.resolution_m / 8.0 || scale_m <= 0.0 {
            let reason = format!(
                "voxels of {} m over {reach} m exceed the 32-bit coordinates of the format: choose a region",
                head.resolution_m
            );
            return Err(Error::argument("LAS", reason));
        }
        Ok(Self {
            scale_m,
            offset_m,
            layers: head.layers,
            points: 0,
            least: [i32::MAX; 3],
            most: [i32::MIN; 3],
        })
    }

    /// Point format without the bit for compression.
    pub(super) fn point_format(&self) -> u8 {
        if self.layers.colour { COLOURED_FORMAT } else { POINT_FORMAT }
    }

    /// Size of a point in bytes.
    pub(super) fn point_bytes(&self) -> usize {
        self.standard_bytes() + usize::from(EXTRA_BYTES)
    }

    fn standard_bytes(&self) -> usize {
        if self.layers.colour { 36 } else { 30 }
    }

    /// Converts a voxel to a point, in the first [`Self::point_bytes`] bytes. The intensity is the mean of the points,
    /// as a share of the map's largest, or else the probability.
    ///
    /// # Errors
    ///
    /// The voxel is far outside of the bounding box.
    pub(super) fn point(&mut self, voxel: &VoxelRow) -> Result<[u8; MAX_POINT_BYTES]> {
        let mut position = [0; 3];
        for (k, whole) in position.iter_mut().enumerate() {
            let scaled = ((voxel.center_m[k] - self.offset_m[k]) / self.scale_m).round();
            if scaled.abs() > f64::from(i32::MAX) {
                let reason = format!("voxel {:?} is outside of the announced bounds", voxel.index);
                return Err(Error::argument("LAS", reason));
            }
            *whole = scaled as i32;
            self.least[k] = self.least[k].min(*whole);
            self.most[k] = self.most[k].max(*whole);
        }
        self.points += 1;
        let mut point = [0; MAX_POINT_BYTES];
        let [x, y, z] = position.map(i32::to_le_bytes);
        point[..12].copy_from_slice([x, y, z].as_flattened());
        let RowLayers { colour, stored_intensity, class, .. } = voxel.layers;
        let intensity = match self.layers.intensity_max {
            Some(_) => stored_intensity.unwrap_or_default(),
            None => (voxel.probability.clamp(0.0, 1.0) * 65535.0).round() as u16,
        };
        point[12..14].copy_from_slice(&intensity.to_le_bytes());
        // First of one return; without a class "created, never classified".
        point[14] = 0x11;
        point[16] = class.unwrap_or(1);
        if self.layers.colour {
            // 16 bits per channel.
            let colour = colour.unwrap_or_default().map(|channel| (257 * u16::from(channel)).to_le_bytes());
            point[30..36].copy_from_slice(colour.as_flattened());
        }
        let extra = self.standard_bytes();
        point[extra..extra + 8].copy_from_slice(&voxel.log_odds.to_le_bytes());
        point[extra + 8..extra + 12].copy_from_slice(&voxel.observation_count.to_le_bytes());
        Ok(point)
    }

    /// Writes the header at the start of the file, overwriting an earlier one.
    pub(super) fn write_head(
        &self,
        out: &mut OutFile,
        is_compressed: bool,
        vlrs: &[Vlr],
        evlr_start: Option<u64>,
    ) -> Result<()> {
        let vlr_bytes: usize = vlrs.iter().map(|vlr| 54 + vlr.data.len()).sum();
        let bound = |of: [i32; 3], k: usize| match self.points {
            0 => self.offset_m[k],
            _ => f64::from(of[k]) * self.scale_m + self.offset_m[k],
        };
        let mut by_return = [0; 15];
        by_return[0] = self.points;
        let header = Header {
            // With this point format, well-known text is the only standard way to name a coordinate system.
            global_encoding: 1 << 4,
            version: ::las::Version::new(1, 4),
            system_identifier: padded("voxtile"),
            generating_software: padded(concat!("voxtile-clouds ", env!("CARGO_PKG_VERSION"))),
            header_size: HEADER_BYTES,
            offset_to_point_data: u32::from(HEADER_BYTES) + vlr_bytes as u32,
            number_of_variable_length_records: vlrs.len() as u32,
            point_data_record_format: self.point_format() | if is_compressed { COMPRESSED } else { 0 },
            point_data_record_length: self.point_bytes() as u16,
            x_scale_factor: self.scale_m,
            y_scale_factor: self.scale_m,
            z_scale_factor: self.scale_m,
            x_offset: self.offset_m[0],
            y_offset: self.offset_m[1],
            z_offset: self.offset_m[2],
            max_x: bound(self.most, 0),
            min_x: bound(self.least, 0),
            max_y: bound(self.most, 1),
            min_y: bound(self.least, 1),
            max_z: bound(self.most, 2),
            min_z: bound(self.least, 2),
            start_of_waveform_data_packet_record: None,
            evlr: evlr_start.map(|start| Evlr { start_of_first_evlr: start, number_of_evlrs: 1 }),
            large_file: Some(LargeFile {
                number_of_point_records: self.points,
                number_of_points_by_return: by_return,
            }),
            ..Header::default()
        };
        let path = out.path().to_owned();
        out.seek(SeekFrom::Start(0)).map_err(|error| Error::io(&path, "write", error))?;
        header.write_to(&mut *out).map_err(|error| refused(&path, error))?;
        for vlr in vlrs {
            vlr.write_to(&mut *out).map_err(|error| refused(&path, error))?;
        }
        Ok(())
    }
}

/// Returns the records of every file: the extra fields of points, and the coordinate system.
pub(super) fn common_vlrs(options: &WriteOptions) -> Result<Vec<Vlr>> {
    let mut fields = extra_field("log_odds", 10, "log-odds of being occupied");
    fields.extend(extra_field("count", 6, "number of updates"));
    let mut vlrs = vec![vlr("LASF_Spec", 4, "fields of voxels", fields)?];
    if let Some(crs) = &options.crs {
        vlrs.push(crs_vlr(crs, options.unit)?);
    }
    Ok(vlrs)
}

/// Returns the coordinate system record. LAS 1.4 requires well-known text with this point format. An EPSG code cannot
/// be converted to it here, so it is stored as GeoTIFF keys, as in older versions.
fn crs_vlr(crs: &str, unit: FileUnit) -> Result<Vlr> {
    let Some(number) = crs.strip_prefix("EPSG:") else {
        let text = [crs.as_bytes(), &[0]].concat();
        return vlr("LASF_Projection", 2112, "coordinate system", text);
    };
    let number: u16 = number.parse().map_err(|_| {
        Error::argument(
            "crs",
            format!("`{crs}` is not the EPSG code of a projected system: use well-known text"),
        )
    })?;
    // Key directory version 1.1.0: projected model, EPSG code, its unit, and that of heights unless it is the metre.
    let epsg = unit.epsg();
    let keys = [[1, 1, 0, 4], [1024, 0, 1, 1], [3072, 0, 1, number], [3076, 0, 1, epsg], [4099, 0, 1, epsg]];
    let mut keys = keys.to_vec();
    if unit == FileUnit::Metre {
        keys.pop();
        keys[0][3] -= 1;
    }
    let data = keys.as_flattened().iter().flat_map(|value| value.to_le_bytes()).collect();
    vlr("LASF_Projection", 34735, "coordinate system", data)
}

/// Creates a variable length record.
pub(super) fn vlr(user: &str, record_id: u16, description: &str, data: Vec<u8>) -> Result<Vlr> {
    let too_long = |_| Error::argument("LAS", format!("{description}: {} bytes are too many", data.len()));
    let length = u16::try_from(data.len()).map_err(too_long)?;
    Ok(Vlr {
        reserved: 0,
        user_id: padded(user),
        record_id,
        record_length_after_header: RecordLength::Vlr(length),
        description: padded(description),
        data,
    })
}

/// Truncates a text or pads it with zeros.
pub(super) fn padded<const N: usize>(text: &str) -> [u8; N] {
    let mut bytes = [0; N];
    bytes.iter_mut().zip(text.bytes()).for_each(|(to, from)| *to = from);
    bytes
}

/// Describes an extra field of points.
fn extra_field(name: &str, data_type: u8, description: &str) -> Vec<u8> {
    let mut field = vec![0, 0, data_type, 0];
    field.extend(padded::<32>(name));
    // No "no data" value, bounds and scale.
    field.extend([0; 4 + 5 * 24]);
    field.extend(padded::<32>(description));
    field
}

pub(super) fn refused(path: &std::path::Path, error: ::las::Error) -> Error {
    match error {
        ::las::Error::Io(error) => Error::io(path, "write", error),
        other => Error::argument(path.display().to_string(), other.to_string()),
    }
}

pub(super) fn not_compressed(path: &std::path::Path, error: laz::LasZipError) -> Error {
    match error {
        laz::LasZipError::IoError(error) => Error::io(path, "write", error),
        other => Error::argument(path.display().to_string(), other.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{head_of, row};
    use super::*;

    #[test]
    fn distant_voxels_use_a_coarser_scale_or_are_refused() {
        let mut head = head_of(&[row([0; 3], 0.5)]);
        let mut options = WriteOptions::for_path("a.las".as_ref());
        let scale_m =
            |head: &VoxelsHead, options: &WriteOptions| LasLayout::of(head, options).unwrap().scale_m;
        assert_eq!(scale_m(&head, &options), 1.0 / 2048.0);
        options.has_mean_points = true;
        assert_eq!(scale_m(&head, &options), 1.0 / 32_768.0);
        head.bounds_m = [[-1e8; 3], [1e8; 3]];
        assert_eq!(scale_m(&head, &options), 1.0 / 16.0);
        head.bounds_m = [[-1e9; 3], [1e9; 3]];
        assert!(LasLayout::of(&head, &options).unwrap_err().to_string().contains("choose a region"));
    }
}
