use super::font;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

pub type Color = [u8; 3];

/// A picture of square pixels, row by row from the top.
pub struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<Color>,
}

impl Canvas {
    pub fn new(width: usize, height: usize, background: Color) -> Self {
        Self { width, height, pixels: vec![background; width * height] }
    }

    /// Sets a pixel; outside the picture nothing happens.
    pub fn set(&mut self, x: i64, y: i64, color: Color) {
        if let Some(pixel) = self.pixel(x, y) {
            *pixel = color;
        }
    }

    /// Mixes a color into a pixel: 0 leaves it, 1 replaces it.
    pub fn blend(&mut self, x: i64, y: i64, color: Color, share: f64) {
        if let Some(pixel) = self.pixel(x, y) {
            *pixel = std::array::from_fn(|k| {
                (f64::from(pixel[k]) * (1.0 - share) + f64::from(color[k]) * share).round() as u8
            });
        }
    }

    pub fn rectangle(&mut self, x: i64, y: i64, width: i64, height: i64, color: Color) {
        for dy in 0..height {
            (0..width).for_each(|dx| self.set(x + dx, y + dy, color));
        }
    }

    /// Writes text with its upper left corner at (x, y), each dot of the letters `scale` pixels wide.
    pub fn text(&mut self, x: i64, y: i64, text: &str, scale: i64, color: Color) {
        let mut left = x;
        for letter in text.chars() {
            for (row, bits) in (0..).zip(font::glyph(letter)) {
                for column in (0..font::WIDTH).filter(|column| bits >> (font::WIDTH - 1 - column) & 1 == 1) {
                    self.rectangle(left + column * scale, y + row * scale, scale, scale, color);
                }
            }
            left += (font::WIDTH + 1) * scale;
        }
    }

    pub fn write_png(&self, path: &Path) -> anyhow::Result<()> {
        let file = File::create(path).map_err(|error| voxtile::Error::io(path, "create", error))?;
        let mut encoder = png::Encoder::new(BufWriter::new(file), self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(self.pixels.as_flattened())?;
        Ok(writer.finish()?)
    }

    fn pixel(&mut self, x: i64, y: i64) -> Option<&mut Color> {
        let inside = (0..self.width as i64).contains(&x) && (0..self.height as i64).contains(&y);
        inside.then(|| &mut self.pixels[y as usize * self.width + x as usize])
    }
}
