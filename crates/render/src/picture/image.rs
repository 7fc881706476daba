use std::io::Write;
use std::{fmt, io};

const METRES_PER_INCH: f64 = 0.0254;

/// Image in sRGB, with alpha.
#[derive(Clone, PartialEq)]
pub struct Image {
    width_px: usize,
    height_px: usize,
    rgba: Vec<u8>,
    dpi: f64,
}

impl fmt::Debug for Image {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Omit the pixels, of which there may be millions.
        write!(f, "Image of {} x {} px", self.width_px, self.height_px)
    }
}

impl Image {
    pub(super) fn new(width_px: usize, height_px: usize, rgba: Vec<u8>, dpi: f64) -> Self {
        debug_assert_eq!(rgba.len(), 4 * width_px * height_px);
        Self { width_px, height_px, rgba, dpi }
    }

    /// Width in pixels.
    pub fn width_px(&self) -> usize {
        self.width_px
    }

    /// Height in pixels.
    pub fn height_px(&self) -> usize {
        self.height_px
    }

    /// Resolution in pixels per inch, for which type and lines are made.
    pub fn dpi(&self) -> f64 {
        self.dpi
    }

    /// Red, green, blue and alpha of each pixel, row by row from the top. Alpha is 255 but on a transparent background.
    pub fn rgba(&self) -> &[u8] {
        &self.rgba
    }

    /// Red, green and blue of a pixel; `None` outside.
    pub fn pixel(&self, x: usize, y: usize) -> Option<[u8; 3]> {
        let is_inside = x < self.width_px && y < self.height_px;
        let at = 4 * (x + y * self.width_px);
        is_inside.then(|| self.rgba.get(at..at + 3)?.try_into().ok())?
    }

    /// Writes the image as PNG, with its resolution. Memory: a row.
    ///
    /// # Errors
    ///
    /// Fails if `out` fails or the image is too large for PNG.
    pub fn write_png(&self, out: &mut impl io::Write) -> io::Result<()> {
        let too_large = |_| io::Error::other("the picture is too large for PNG");
        let width = u32::try_from(self.width_px).map_err(too_large)?;
        let height = u32::try_from(self.height_px).map_err(too_large)?;
        let mut encoder = png::Encoder::new(out, width, height);
        // A constant alpha would add a tenth to the file.
        let is_opaque = self.rgba.chunks_exact(4).all(|pixel| pixel[3] == 255);
        encoder.set_color(if is_opaque { png::ColorType::Rgb } else { png::ColorType::Rgba });
        encoder.set_depth(png::BitDepth::Eight);
        let per_metre = (self.dpi / METRES_PER_INCH).round().clamp(1.0, f64::from(u32::MAX)) as u32;
        let unit = png::Unit::Meter;
        encoder.set_pixel_dims(Some(png::PixelDimensions { xppu: per_metre, yppu: per_metre, unit }));
        let mut writer = encoder.write_header()?;
        let mut stream = writer.stream_writer()?;
        for row in self.rgba.chunks_exact((4 * self.width_px).max(1)) {
            if is_opaque {
                let rgb: Vec<u8> =
                    row.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
                stream.write_all(&rgb)?;
            } else {
                stream.write_all(row)?;
            }
        }
        stream.finish()?;
        Ok(writer.finish()?)
    }
}
