use std::{fmt, io};

/// Opaque image in sRGB.
#[derive(Clone, PartialEq, Eq)]
pub struct Image {
    width_px: usize,
    height_px: usize,
    rgba: Vec<u8>,
}

impl fmt::Debug for Image {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Omit the pixels, of which there may be millions.
        write!(f, "Image of {} x {} px", self.width_px, self.height_px)
    }
}

impl Image {
    pub(super) fn new(width_px: usize, height_px: usize, rgba: Vec<u8>) -> Self {
        debug_assert_eq!(rgba.len(), 4 * width_px * height_px);
        Self { width_px, height_px, rgba }
    }

    /// Width in pixels.
    pub fn width_px(&self) -> usize {
        self.width_px
    }

    /// Height in pixels.
    pub fn height_px(&self) -> usize {
        self.height_px
    }

    /// Red, green, blue and alpha (always 255) of each pixel, row by row from the top.
    pub fn rgba(&self) -> &[u8] {
        &self.rgba
    }

    /// Red, green and blue of a pixel; `None` outside.
    pub fn pixel(&self, x: usize, y: usize) -> Option<[u8; 3]> {
        let is_inside = x < self.width_px && y < self.height_px;
        let at = 4 * (x + y * self.width_px);
        is_inside.then(|| self.rgba.get(at..at + 3)?.try_into().ok())?
    }

    /// Writes the image as PNG.
    ///
    /// # Errors
    ///
    /// Fails if `out` fails or the image is too large for PNG.
    pub fn write_png(&self, out: &mut impl io::Write) -> io::Result<()> {
        let too_large = |_| io::Error::other("the picture is too large for PNG");
        let width = u32::try_from(self.width_px).map_err(too_large)?;
        let height = u32::try_from(self.height_px).map_err(too_large)?;
        let mut encoder = png::Encoder::new(out, width, height);
        // Alpha is constant and would add a tenth to the file.
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        let rgb: Vec<u8> =
            self.rgba.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
        writer.write_image_data(&rgb)?;
        Ok(writer.finish()?)
    }
}
