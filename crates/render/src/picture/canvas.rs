use super::font;
use super::image::Image;
use super::palette::{self, Rgb, mixed};

/// Pixels with alpha, row by row from the top. Drawing outside is clipped.
pub struct Canvas {
    width: usize,
    height: usize,
    bytes: Vec<u8>,
}

impl Canvas {
    pub fn new(width: usize, height: usize, color: Rgb) -> Self {
        Self { width, height, bytes: opaque(color).repeat(width * height) }
    }

    pub fn width(&self) -> usize {
        self.width
    }

    #[cfg(test)]
    pub fn height(&self) -> usize {
        self.height
    }

    /// Blends a color over a box of pixels; `cover` is the opacity from 0 to 1.
    pub fn fill(&mut self, left: usize, top: usize, size: [usize; 2], color: Rgb, cover: f64) {
        for y in top.min(self.height)..top.saturating_add(size[1]).min(self.height) {
            for x in left.min(self.width)..left.saturating_add(size[0]).min(self.width) {
                let at = 4 * (x + y * self.width);
                let pixel = &mut self.bytes[at..at + 3];
                let new =
                    if cover >= 1.0 { color } else { mixed([pixel[0], pixel[1], pixel[2]], color, cover) };
                pixel.copy_from_slice(&new);
            }
        }
    }

    /// Draws a filled disc around the center of a pixel.
    pub fn disc(&mut self, middle: [usize; 2], radius: usize, color: Rgb) {
        for dy in 0..=2 * radius {
            let up = dy as f64 - radius as f64;
            let half = ((radius as f64 + 0.3).powi(2) - up * up).max(0.0).sqrt() as usize;
            let (Some(y), Some(x)) = ((middle[1] + dy).checked_sub(radius), middle[0].checked_sub(half))
            else {
                continue;
            };
            self.fill(x, y, [2 * half + 1, 1], color, 1.0);
        }
    }

    /// Draws the trajectory: a disc around each pixel with a dark rim, visible on any color.
    pub fn path(&mut self, middles: impl Iterator<Item = [usize; 2]>, radius: usize, color: Rgb) {
        let middles: Vec<[usize; 2]> = middles.collect();
        // Draw all rims first, so that close discs form one line.
        for (radius, color) in
            [(radius + usize::from(radius > 0) + radius / 2, palette::UNKNOWN), (radius, color)]
        {
            middles.iter().for_each(|&middle| self.disc(middle, radius, color));
        }
    }

    /// Writes text from its upper left corner, with dots of `dot` pixels.
    pub fn text(&mut self, left: usize, top: usize, dot: usize, color: Rgb, text: &str) {
        for (index, letter) in text.chars().enumerate() {
            for (row, bits) in font::glyph(letter).into_iter().enumerate() {
                for column in 0..font::WIDTH {
                    if bits >> (font::WIDTH - 1 - column) & 1 == 1 {
                        let x = left + (index * font::ADVANCE + column) * dot;
                        self.fill(x, top + row * dot, [dot; 2], color, 1.0);
                    }
                }
            }
        }
    }

    /// Writes text that ends at a column.
    pub fn text_before(&mut self, right: usize, top: usize, dot: usize, color: Rgb, text: &str) {
        self.text(right.saturating_sub(font::width_of(text) * dot), top, dot, color, text);
    }

    pub fn into_image(self) -> Image {
        Image::new(self.width, self.height, self.bytes)
    }
}

fn opaque([red, green, blue]: Rgb) -> [u8; 4] {
    [red, green, blue, 255]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drawing_outside_is_clipped() {
        let mut canvas = Canvas::new(4, 3, [0; 3]);
        canvas.fill(3, 2, [10, 10], [9; 3], 1.0);
        canvas.fill(usize::MAX, 0, [2, 2], [9; 3], 1.0);
        canvas.disc([0, 0], 2, [7; 3]);
        canvas.text(2, 1, 3, [5; 3], "10 m");
        let image = canvas.into_image();
        assert_eq!(image.rgba().len(), 48);
        assert_eq!(image.pixel(3, 2), Some([9; 3]));
        assert!(image.rgba().chunks(4).all(|pixel| pixel[3] == 255));
    }
}
