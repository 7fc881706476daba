use super::header::Header;
use super::image::CameraInfo;
use super::rvl::Rvl;
use crate::read::cloud::CloudPoint;
use crate::read::depth::depth_of;
use crate::read::gray16;
use crate::ros::wire::{Decoded, Wire, WireError, WireReader};
use std::io::Cursor;
use voxtile::Result;

/// `sensor_msgs/CompressedImage` whose pixels may be depths: from the transport `compressedDepth` (PNG or RVL), or a
/// 16-bit PNG.
#[derive(Clone, Debug)]
pub struct CompressedDepth<'a> {
    /// Stamp and frame, as of an uncompressed image.
    pub header: Header,
    /// Number of rows.
    pub height: u32,
    /// Number of columns.
    pub width: u32,
    /// Encoding of the uncompressed pixels, such as `16UC1`.
    pub encoding: String,
    /// Whether the transport is `compressedDepth`, which is only used for depths.
    pub is_depth_transport: bool,
    code: Code,
    pixels: Pixels<'a>,
}

/// Compressed pixel values.
#[derive(Clone, Copy, Debug)]
enum Pixels<'a> {
    Png(&'a [u8]),
    Rvl(&'a [u8]),
}

/// Meaning of pixel values.
#[derive(Clone, Copy, Debug)]
enum Code {
    Millimetres,
    /// The depth is `a / (value - b)` metres.
    Inverse {
        a: f64,
        b: f64,
    },
}

const PNG_MAGIC: &[u8] = b"\x89PNG\r\n\x1a\n";
/// Size of the header before the pixels: the code type and its two parameters.
const CONFIG_BYTES: usize = 12;
/// Limit for the pixels of an RVL image: a few bytes can decode to millions of zeros.
const MAX_RVL_PIXELS: u64 = 1 << 26;

impl<'a> CompressedDepth<'a> {
    /// Decodes a message and the size of its image.
    ///
    /// # Errors
    ///
    /// The message is truncated, or its data is neither a 16-bit PNG nor RVL.
    pub fn decode(wire: Wire, bytes: &'a [u8]) -> Decoded<Self> {
        let mut reader = WireReader::new(wire, bytes)?;
        let (header, format) = (Header::read(&mut reader)?, reader.string()?);
        let data = reader.byte_sequence()?;
        let is_png = data.starts_with(PNG_MAGIC);
        let config = data.get(..CONFIG_BYTES).filter(|_| !is_png);
        let packed = if is_png { data } else { data.get(CONFIG_BYTES..).unwrap_or_default() };
        let pixels = match (packed.starts_with(PNG_MAGIC), packed.split_at_checked(8)) {
            (true, _) => Pixels::Png(packed),
            (false, Some((_, rvl))) if format.contains("compressedDepth rvl") => Pixels::Rvl(rvl),
            _ => return Err(reader.error(format!("the image is neither PNG nor RVL (format `{format}`)"))),
        };
        let encoding = format.split(';').next().unwrap_or_default().trim().to_owned();
        let code = match (config, encoding.as_str()) {
            (None, "32FC1") => {
                return Err(reader.error("the 32FC1 depth parameters before the PNG are missing"));
            }
            (Some(config), "32FC1") => {
                let number = |at: usize| {
                    let bytes = config.get(at..).and_then(|bytes| bytes.first_chunk()).copied();
                    f64::from(f32::from_le_bytes(bytes.unwrap_or_default()))
                };
                let (a, b) = (number(4), number(8));
                if !(a.is_finite() && b.is_finite() && a > 0.0) {
                    return Err(reader.error(format!("the depth parameters {a} and {b} are invalid")));
                }
                Code::Inverse { a, b }
            }
            (_, "16UC1" | "mono16") | (None, _) => Code::Millimetres,
            (Some(_), other) => {
                let reason =
                    format!("the pixel encoding is `{other}`; depth images have 16UC1 (mm) or 32FC1 (m)");
                return Err(reader.error(reason));
            }
        };
        let (width, height) = match pixels {
            Pixels::Png(png) => {
                let image = gray16::open(Cursor::new(png)).map_err(|(_, reason)| reader.error(reason))?;
                gray16::size(&image)
            }
            Pixels::Rvl(_) => {
                let number = |at: usize| packed.get(at..).and_then(|bytes| bytes.first_chunk()).copied();
                let [width, height] = [0, 4].map(|at| u32::from_le_bytes(number(at).unwrap_or_default()));
                if u64::from(width) * u64::from(height) > MAX_RVL_PIXELS {
                    let reason = format!("{width} x {height} pixels; at most {MAX_RVL_PIXELS} are supported");
                    return Err(reader.error(reason));
                }
                (width, height)
            }
        };
        let is_depth_transport = config.is_some();
        Ok(Self { header, height, width, encoding, is_depth_transport, code, pixels })
    }

    /// Returns the number of pixels according to the image size.
    pub fn pixels_claimed(&self) -> u64 {
        u64::from(self.height) * u64::from(self.width)
    }

    /// Visits one point per pixel, row by row. Returns the reason if some are missing.
    pub(crate) fn visit(
        &self,
        camera: &CameraInfo,
        visit: &mut dyn FnMut(CloudPoint) -> Result<()>,
    ) -> Result<Option<WireError>> {
        let wrong = |reason: String| Ok(Some(WireError { byte: 0, reason }));
        let png = match self.pixels {
            Pixels::Png(png) => png,
            Pixels::Rvl(rvl) => {
                let mut pixels = Rvl::new(rvl);
                for (row, column) in
                    (0..self.height).flat_map(|row| (0..self.width).map(move |column| (row, column)))
                {
                    let Some(number) = pixels.pixel() else {
                        return wrong(format!("row {row} of {} is truncated", self.height));
                    };
                    visit(camera.point([column as usize, row as usize], self.code.depth_m(number)))?;
                }
                return Ok(None);
            }
        };
        let mut image = match gray16::open(Cursor::new(png)) {
            Ok(image) => image,
            Err((_, reason)) => return wrong(reason),
        };
        for row in 0..self.height {
            let pixels = match image.next_row() {
                Ok(Some(pixels)) => pixels,
                Ok(None) => return wrong(format!("row {row} of {} of its PNG is missing", self.height)),
                Err(error) => return wrong(format!("row {row} of {} of its PNG: {error}", self.height)),
            };
            for (column, pixel) in pixels.data().as_chunks::<2>().0.iter().enumerate() {
                visit(camera.point([column, row as usize], self.code.depth_m(u16::from_be_bytes(*pixel))))?;
            }
        }
        Ok(None)
    }
}

impl Code {
    /// Returns the depth of a pixel value; NaN if there is no return.
    fn depth_m(self, number: u16) -> f64 {
        match self {
            Self::Millimetres => depth_of(number).map_or(f64::NAN, |depth| depth * 1e-3),
            Self::Inverse { .. } if number == 0 => f64::NAN,
            // The encoder used single precision; the difference is negligible.
            Self::Inverse { a, b } => a / (f64::from(number) - b),
        }
    }
}
