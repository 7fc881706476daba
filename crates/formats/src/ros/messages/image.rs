use super::header::Header;
use super::point_field::FieldType;
use crate::read::cloud::CloudPoint;
use crate::read::depth::depth_of;
use crate::ros::wire::{Decoded, Wire, WireError, WireReader};

/// `sensor_msgs/Image` with its undecoded pixels.
#[derive(Clone, Debug)]
pub struct Image<'a> {
    /// Stamp and frame. The frame is the camera's optical frame: z forward, x right, y down.
    pub header: Header,
    /// Number of rows.
    pub height: u32,
    /// Number of columns.
    pub width: u32,
    /// Pixel encoding, such as `16UC1`.
    pub encoding: String,
    is_big_endian: bool,
    row_bytes: usize,
    data: &'a [u8],
}

/// `sensor_msgs/CameraInfo`, reduced to the pinhole parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraInfo {
    /// Stamp and frame.
    pub header: Header,
    /// Focal lengths, in pixels.
    pub focal_px: [f64; 2],
    /// Principal point, in pixels.
    pub center_px: [f64; 2],
}

/// Returns whether pixels of an encoding may be depths. `16UC1` and `mono16` may also be other 16-bit values.
pub fn is_depth_encoding(encoding: &str) -> bool {
    matches!(encoding, "16UC1" | "mono16" | "32FC1")
}

impl CameraInfo {
    /// Decodes a message.
    ///
    /// # Errors
    ///
    /// The message is truncated, or the camera is not calibrated.
    pub fn decode(wire: Wire, bytes: &[u8]) -> Decoded<Self> {
        let mut reader = WireReader::new(wire, bytes)?;
        let header = Header::read(&mut reader)?;
        reader.u32()?;
        reader.u32()?;
        // The distortion is ignored: most depth images are rectified, and the others have little distortion.
        reader.string()?;
        for _ in 0..reader.sequence(8)? {
            reader.f64()?;
        }
        let mut k = [0.0; 9];
        for value in &mut k {
            *value = reader.f64()?;
        }
        let [fx, _, cx, _, fy, cy, ..] = k;
        if ![fx, fy, cx, cy].iter().all(|value| value.is_finite()) || fx == 0.0 || fy == 0.0 {
            return Err(reader.error("the camera is not calibrated: K contains no focal lengths"));
        }
        Ok(Self { header, focal_px: [fx, fy], center_px: [cx, cy] })
    }
}

impl CameraInfo {
    /// Returns the point of a pixel (column and row). Without a valid depth, it is a ray without a return.
    pub(super) fn point(&self, pixel: [usize; 2], depth_m: f64) -> CloudPoint {
        let is_return = depth_m.is_finite() && depth_m > 0.0;
        let z = if is_return { depth_m } else { 1.0 };
        let [u, v] = pixel.map(|number| number as f64);
        let x = (u - self.center_px[0]) / self.focal_px[0] * z;
        let y = (v - self.center_px[1]) / self.focal_px[1] * z;
        CloudPoint { is_return, ..CloudPoint::hit([x, y, z]) }
    }
}

impl<'a> Image<'a> {
    /// Decodes a message.
    ///
    /// # Errors
    ///
    /// The message is truncated.
    pub fn decode(wire: Wire, bytes: &'a [u8]) -> Decoded<Self> {
        let mut reader = WireReader::new(wire, bytes)?;
        Ok(Self {
            header: Header::read(&mut reader)?,
            height: reader.u32()?,
            width: reader.u32()?,
            encoding: reader.string()?,
            is_big_endian: reader.u8()? != 0,
            row_bytes: reader.u32()? as usize,
            data: reader.byte_sequence()?,
        })
    }

    /// Returns the number of pixels according to the image size.
    pub fn pixels_claimed(&self) -> u64 {
        u64::from(self.height) * u64::from(self.width)
    }

    /// Iterates over one point per pixel, row by row. Empty if the pixels are not depths.
    pub fn points<'s>(&'s self, camera: &'s CameraInfo) -> impl Iterator<Item = CloudPoint> + 's {
        let depth = self.depth();
        let rows = if self.width == 0 || depth.is_none() { 0 } else { self.height };
        let pixel_bytes = depth.map_or(1, |(kind, _)| kind.bytes());
        let width = self.width as usize;
        let row_bytes = self.row_bytes.max(width.saturating_mul(pixel_bytes));
        let rows = (0..rows as usize)
            .map_while(move |row| Some((row, self.data.get(row.checked_mul(row_bytes)?..)?)));
        rows.flat_map(move |(v, row)| {
            row.chunks_exact(pixel_bytes).take(width).enumerate().map(move |(u, pixel)| (u, v, pixel))
        })
        .map(move |(u, v, pixel)| {
            let value = depth.and_then(|(kind, unit_m)| {
                let value = kind.value(pixel, self.is_big_endian)?;
                match kind {
                    FieldType::U16 => depth_of(value as u16).map(|depth| depth * unit_m),
                    _ => Some(value * unit_m),
                }
            });
            camera.point([u, v], value.unwrap_or(f64::NAN))
        })
    }

    /// Returns the reason if there are fewer points than pixels.
    pub fn shortage(&self) -> Option<WireError> {
        let Some((kind, _)) = self.depth() else {
            let reason = format!(
                "the pixel encoding is `{}`; depth images have 16UC1 (mm) or 32FC1 (m)",
                self.encoding
            );
            return Some(WireError { byte: 0, reason });
        };
        let row = (self.width as usize).checked_mul(kind.bytes())?;
        let rows = (self.height as usize).checked_sub(1)?.checked_mul(self.row_bytes.max(row));
        let needed = rows.and_then(|rows| rows.checked_add(row));
        if self.width == 0 || needed.is_some_and(|needed| needed <= self.data.len()) {
            return None;
        }
        let (claimed, bytes) = (self.pixels_claimed(), self.data.len());
        Some(WireError {
            byte: 0,
            reason: format!("{claimed} pixels are announced, but there are {bytes} bytes"),
        })
    }

    /// Returns the pixel type and its unit in metres.
    fn depth(&self) -> Option<(FieldType, f64)> {
        match self.encoding.as_str() {
            "16UC1" | "mono16" => Some((FieldType::U16, 1e-3)),
            "32FC1" => Some((FieldType::F32, 1.0)),
            _ => None,
        }
    }
}
